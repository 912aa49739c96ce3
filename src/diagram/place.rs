//! Where labels go. In: what is drawn in a panel and what each label names. Out: a box for each label, with a
//! leader where it stands off, so that no label touches another label, a line of weight or the frame.
//!
//! The name of a plane seen edge-on runs along its trace, turned with it, where it has room there. For other labels, in the
//! order given, every anchor is tried in sixteen directions and some distances; the cheapest free place is taken. What
//! finds none is looked for on a grid over the whole panel. A second round lets labels cross thin lines (they stand on a
//! plate then); heavy lines, labels and leaders are never crossed.

use super::display_list::Point;
use super::panel::Panel;
use super::room::{Room, reading};
use super::subject::distance_to_segment;

/// How strongly a drawn line repels labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Weight {
    /// Subject, fills: better avoided.
    Soft,
    /// Thin lines: crossed only in need.
    Light,
    /// Never touched.
    Heavy,
}

/// A drawn piece that labels keep clear of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Obstacle {
    pub(crate) a: Point,
    pub(crate) b: Point,
    /// Half the width it takes, millimetres.
    pub(crate) half: f64,
    pub(crate) weight: Weight,
}

/// A label to be placed.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    /// Width and height of its box, for each way to break its lines, the best first.
    pub(crate) sizes: Vec<[f64; 2]>,
    /// Points of the thing it names, the best first.
    pub(crate) anchors: Vec<Point>,
    /// Page direction in which it would best stand off, or zero.
    pub(crate) toward: Point,
    /// It names this convex area: it stands wholly in it, or outside with a leader.
    pub(crate) area: Option<Vec<Point>>,
    /// The straight piece that it names: it runs along it where it can, best where this share of the way is.
    pub(crate) line: Option<(Point, Point, f64)>,
    /// Left out where every place costs more than this.
    pub(crate) worth: f64,
}

/// A place for a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) room: Room,
    /// From the thing to the label.
    pub(crate) leader: Option<(Point, Point)>,
    /// Thin lines run behind it.
    pub(crate) plate: bool,
    /// Which of the request's sizes.
    pub(crate) variant: usize,
}

/// Free room around a label (mm).
const CLEAR: f64 = 0.45;
/// Free room between labels, beside and above one another: two on a line shall not read as one.
const BETWEEN: [f64; 2] = [2.0, 0.6];
/// Free room toward the frame.
const EDGE: f64 = 0.9;
/// Labels that stand off more than this have a leader.
const LEADER: f64 = 1.9;
/// Room between a line and words along it: beside thin lines, beside heavy ones.
const BESIDE: [f64; 2] = [0.65, 0.85];
const GAPS: [f64; 9] = [0.7, 1.2, 2.4, 4.0, 6.0, 9.0, 13.0, 18.0, 25.0];
/// Costs (mm of distance they are worth).
const THIN_LINE: f64 = 6.0;
const SOFT_LINE: f64 = 1.5;
const WITH_LEADER: f64 = 2.5;
const LEADER_OVER_HEAVY: f64 = 25.0;
const LEADER_OVER_LIGHT: f64 = 3.0;
const LEADER_ALONG_LINE: f64 = 15.0;
const BROKEN: f64 = 2.0;
/// What an optional label is worth: it is left out where every place costs more.
pub(crate) const OPTIONAL: f64 = 24.0;
/// What a label is worth that is clear only next to what it names.
pub(crate) const ADJACENT: f64 = 5.0;

/// Places all requests, in order; `None` for those left out.
pub(crate) fn place(panel: &Panel, obstacles: &[Obstacle], requests: &[Request]) -> Vec<Option<Placed>> {
    place_around(panel, &[], obstacles, requests)
}

/// The same where words stand already: no label touches these rooms, and no leader crosses them.
pub(crate) fn place_around(
    panel: &Panel,
    words: &[Room],
    obstacles: &[Obstacle],
    requests: &[Request],
) -> Vec<Option<Placed>> {
    let of_words = |&room: &Room| Placed { room, leader: None, plate: false, variant: 0 };
    let mut taken: Vec<Placed> = words.iter().map(of_words).collect();
    let mut placed = Vec::with_capacity(requests.len());
    for request in requests {
        let best = Scene { panel, obstacles, taken: &taken }.best(request);
        taken.extend(best);
        placed.push(best);
    }
    placed
}

struct Scene<'a> {
    panel: &'a Panel,
    obstacles: &'a [Obstacle],
    taken: &'a [Placed],
}

impl Scene<'_> {
    fn best(&self, request: &Request) -> Option<Placed> {
        if let Some(place) = self.beside_line(request) {
            return Some(place);
        }
        for allow in [Weight::Soft, Weight::Light] {
            if request.worth.is_finite() && allow == Weight::Light {
                continue;
            }
            let mut best: Option<(f64, Placed)> = None;
            for variant in 0..request.sizes.len() {
                for (rank, &anchor) in request.anchors.iter().enumerate() {
                    for center in around(anchor, request, variant) {
                        if promising(&best, request, variant, anchor, center, rank) {
                            cheaper(&mut best, self.rate(request, variant, anchor, center, rank, allow));
                        }
                    }
                }
            }
            // A place far from any anchor is better than one on a line.
            if best.is_none() && request.worth.is_infinite() {
                for center in grid(self.panel) {
                    for variant in 0..request.sizes.len() {
                        for (rank, &anchor) in request.anchors.iter().enumerate() {
                            if promising(&best, request, variant, anchor, center, rank) {
                                cheaper(&mut best, self.rate(request, variant, anchor, center, rank, allow));
                            }
                        }
                    }
                }
            }
            if let Some((cost, place)) = best {
                return (cost < request.worth).then_some(place);
            }
        }
        None
    }

    /// The best free place along the line that a label names, beside it.
    fn beside_line(&self, r: &Request) -> Option<Placed> {
        let (a, b, best_at) = r.line?;
        let along = reading(a, b)?;
        let half = half(r, 0);
        let long = libm::hypot(b[0] - a[0], b[1] - a[1]);
        let mut best: Option<(f64, Placed)> = None;
        for step in 0..=48 {
            let share = f64::from(step) / 48.0;
            // The words stay beside what is drawn.
            if half[0] + 0.5 > share.min(1.0 - share) * long {
                continue;
            }
            let at = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
            // Over the line, unless the other side is asked for.
            let over = r.toward[0] * along[1] - r.toward[1] * along[0] >= 0.0;
            for (side, other) in if over { [(1.0, 0.0), (-1.0, 0.8)] } else { [(-1.0, 0.0), (1.0, 0.8)] } {
                for gap in BESIDE {
                    let off = side * (half[1] + gap);
                    let center = [at[0] + off * along[1], at[1] - off * along[0]];
                    let room = Room { center, half, along };
                    let cost = 6.0 * (share - best_at).abs() + other + gap;
                    if let Some((lines, _)) = self.crossings(&room, Weight::Soft) {
                        let place = Placed { room, leader: None, plate: false, variant: 0 };
                        cheaper(&mut best, Some((cost + lines, place)));
                    }
                }
            }
        }
        best.map(|(_, place)| place)
    }

    /// What the lines behind a room cost, and whether there are such; `None` when it is not free.
    fn crossings(&self, room: &Room, allow: Weight) -> Option<(f64, bool)> {
        let [l, t, r, b] = self.panel.frame;
        let [left, top, right, bottom] = [l + EDGE, t + EDGE, r - EDGE, b - EDGE];
        let within = |p: &Point| p[0] >= left && p[1] >= top && p[0] <= right && p[1] <= bottom;
        if !room.corners(0.0).iter().all(within) {
            return None;
        }
        for other in self.taken {
            if room.is_near(&other.room, BETWEEN) {
                return None;
            }
            if let Some((a, b)) = other.leader
                && room.is_crossed(a, b, CLEAR)
            {
                return None;
            }
        }
        let (mut cost, mut plate) = (0.0, false);
        for o in self.obstacles {
            if room.is_crossed(o.a, o.b, CLEAR + o.half) {
                if o.weight > allow {
                    return None;
                }
                cost += if o.weight == Weight::Light { THIN_LINE } else { SOFT_LINE };
                plate = true;
            }
        }
        Some((cost, plate))
    }

    /// What a place costs, or `None` when it is not free.
    fn rate(
        &self,
        r: &Request,
        variant: usize,
        anchor: Point,
        center: Point,
        rank: usize,
        allow: Weight,
    ) -> Option<(f64, Placed)> {
        let room = Room::level(center, half(r, variant));
        let (lines, plate) = self.crossings(&room, allow)?;
        let mut cost = rank as f64 * 0.4 + variant as f64 * BROKEN + lines;
        let to = room.nearest(anchor);
        let away = [to[0] - anchor[0], to[1] - anchor[1]];
        let gap = libm::hypot(away[0], away[1]);
        cost += gap;
        let lean = [center[0] - anchor[0], center[1] - anchor[1]];
        let length = libm::hypot(lean[0], lean[1]).max(1e-9);
        cost += 1.6 * (1.0 - (lean[0] * r.toward[0] + lean[1] * r.toward[1]) / length);
        let inside = match &r.area {
            None => false,
            Some(area) => {
                let inside = room.corners(0.0).iter().filter(|&&c| in_convex(area, c)).count();
                if inside % 4 != 0 {
                    return None;
                }
                inside == 4
            }
        };
        let mut leader = None;
        if (gap > LEADER || r.area.is_some()) && !inside {
            if gap < 1.0 {
                return None;
            }
            let end = [anchor[0] + away[0] * (1.0 - 0.35 / gap), anchor[1] + away[1] * (1.0 - 0.35 / gap)];
            for other in self.taken {
                if other.room.is_crossed(anchor, end, CLEAR) {
                    return None;
                }
                if let Some((a, b)) = other.leader
                    && segments_cross(anchor, end, a, b)
                {
                    cost += LEADER_OVER_HEAVY;
                }
            }
            // The first stretch belongs to the thing named.
            let from = [anchor[0] + away[0] * 0.6 / gap, anchor[1] + away[1] * 0.6 / gap];
            for o in self.obstacles {
                if segments_cross(from, end, o.a, o.b) {
                    cost += match o.weight {
                        Weight::Heavy => LEADER_OVER_HEAVY,
                        Weight::Light => LEADER_OVER_LIGHT,
                        Weight::Soft => 0.2,
                    };
                }
            }
            // A leader along the very line it comes from would look like a part of it.
            let middle = [0.5 * (anchor[0] + end[0]), 0.5 * (anchor[1] + end[1])];
            let along = |o: &&Obstacle| {
                distance_to_segment(anchor, o.a, o.b) < 0.3
                    && distance_to_segment(middle, o.a, o.b) < 0.12 * gap
            };
            if self.obstacles.iter().any(|o| along(&o)) {
                cost += LEADER_ALONG_LINE;
            }
            cost += WITH_LEADER + 0.03 * gap * gap;
            leader = Some((anchor, end));
        }
        Some((cost, Placed { room, leader, plate, variant }))
    }
}

fn half(request: &Request, variant: usize) -> [f64; 2] {
    request.sizes.get(variant).map_or([0.0; 2], |size| size.map(|x| 0.5 * x))
}

/// Whether a point lies in a convex polygon of either orientation.
fn in_convex(polygon: &[Point], p: Point) -> bool {
    let side = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    };
    (0..polygon.len()).all(|i| side(i) >= 0.0) || (0..polygon.len()).all(|i| side(i) <= 0.0)
}

fn cheaper(best: &mut Option<(f64, Placed)>, found: Option<(f64, Placed)>) {
    if let Some((cost, place)) = found
        && best.is_none_or(|(least, _)| cost < least)
    {
        *best = Some((cost, place));
    }
}

/// Whether a place can cost less than the best found: what it costs by its distance alone is a lower bound.
fn promising(
    best: &Option<(f64, Placed)>,
    r: &Request,
    variant: usize,
    anchor: Point,
    center: Point,
    rank: usize,
) -> bool {
    let Some((least, _)) = best else { return true };
    let to = Room::level(center, half(r, variant)).nearest(anchor);
    let gap = libm::hypot(to[0] - anchor[0], to[1] - anchor[1]);
    // A place that stands off has a leader, unless it lies in the area it names.
    let leader = if gap > LEADER && r.area.is_none() { WITH_LEADER + 0.03 * gap * gap } else { 0.0 };
    // The margin is for the rounding of sums in another order.
    rank as f64 * 0.4 + variant as f64 * BROKEN + gap + leader <= least + 1e-6
}

/// Centres of boxes around an anchor.
fn around(anchor: Point, request: &Request, variant: usize) -> Vec<Point> {
    let half = half(request, variant);
    let mut centers = if request.area.is_some() { vec![anchor] } else { Vec::new() };
    // Multiples of 22.5 degrees; the diagonal ones slide along the box's sides.
    const SIN: [f64; 4] =
        [0.0, 0.382_683_432_365_089_8, std::f64::consts::FRAC_1_SQRT_2, 0.923_879_532_511_286_7];
    let sine = |i: usize| match (i / 4) % 4 {
        0 => SIN[i % 4],
        1 => {
            if i.is_multiple_of(4) {
                1.0
            } else {
                SIN[4 - i % 4]
            }
        }
        2 => -SIN[i % 4],
        _ => {
            if i.is_multiple_of(4) {
                -1.0
            } else {
                -SIN[4 - i % 4]
            }
        }
    };
    for gap in GAPS {
        for i in 0..16 {
            let (s, c) = (sine(i), sine(i + 4));
            // The box stands off by `gap`, its middle or a corner toward the anchor.
            let side = |x: f64| if x.abs() < 0.3 { x / 0.3 } else { x.signum() };
            centers.push([anchor[0] + c * gap + side(c) * half[0], anchor[1] + s * gap + side(s) * half[1]]);
        }
    }
    centers
}

fn grid(panel: &Panel) -> Vec<Point> {
    let [l, t, r, b] = panel.frame;
    let (columns, rows) = (((r - l) / 2.0) as usize, ((b - t) / 1.5) as usize);
    (0..columns * rows).map(|i| [l + 2.0 * (i % columns) as f64, t + 1.5 * (i / columns) as f64]).collect()
}

fn segments_cross(a: Point, b: Point, c: Point, d: Point) -> bool {
    let side = |p: Point, q: Point, r: Point| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}
