//! The subject's outline. In: triangles in world metres and the section. Out: where the section cuts them, in
//! section metres; then chains of straight lines on the page, few and without doubles.

use super::display_list::Point;
use super::panel::Panel;
use super::section::SectionPlane;
use crate::geometry::Pose;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Page points are gathered on this grid (mm), so that what meets, meets exactly.
const GRID: f64 = 0.02;
/// Chains are straightened by at most this much (mm).
const STRAIGHT: f64 = 0.06;
/// Chains smaller than this (mm) are dropped.
const SMALL: f64 = 0.2;
/// Most points of a subject in one panel; the longest chains stay.
const MOST: usize = 600;

/// The segments in which the section cuts the triangles, in section metres.
pub(crate) fn cut(triangles: &[[DVec3; 3]], world: &Pose, section: &SectionPlane) -> Vec<[[f64; 2]; 2]> {
    let mut segments = Vec::new();
    for triangle in triangles {
        let corners = triangle.map(|p| world.point_inverse(p));
        let heights = corners.map(|p| section.normal.dot(p));
        let mut ends = Vec::with_capacity(2);
        for i in 0..3 {
            let (p, q) = (corners[i], corners[(i + 1) % 3]);
            let (hp, hq) = (heights[i], heights[(i + 1) % 3]);
            // Half open, so that a corner in the plane belongs to one side.
            if (hp < 0.0) != (hq < 0.0) {
                ends.push(section.project(p + (q - p) * (hp / (hp - hq))));
            }
        }
        if let [a, b] = ends[..]
            && [a, b].iter().flatten().all(|x| x.is_finite())
        {
            segments.push([a, b]);
        }
    }
    segments
}

/// The segments within a panel, joined into chains of page points.
pub(crate) fn chains(segments: &[[[f64; 2]; 2]], panel: &Panel) -> Vec<Vec<Point>> {
    let snap = |p: Point| ((p[0] / GRID).round() as i64, (p[1] / GRID).round() as i64);
    let mut edges = BTreeSet::new();
    for [a, b] in segments {
        if let Some((a, b)) = panel.clip_segment(panel.page(*a), panel.page(*b)) {
            let (a, b) = (snap(a), snap(b));
            if a != b {
                edges.insert((a.min(b), a.max(b)));
            }
        }
    }
    let mut at: BTreeMap<(i64, i64), BTreeSet<(i64, i64)>> = BTreeMap::new();
    for (a, b) in edges {
        at.entry(a).or_default().insert(b);
        at.entry(b).or_default().insert(a);
    }
    // Begin at loose ends and branches, so that a chain runs as far as it can; rings last.
    let mut starts: Vec<_> = at.iter().filter(|(_, to)| to.len() != 2).map(|(&p, _)| p).collect();
    starts.extend(at.iter().filter(|(_, to)| to.len() == 2).map(|(&p, _)| p));
    let mut chains = Vec::new();
    for start in starts {
        while let Some(chain) = walk(&mut at, start) {
            let points: Vec<Point> = chain.iter().map(|p| [p.0 as f64 * GRID, p.1 as f64 * GRID]).collect();
            if extent(&points) >= SMALL {
                chains.push(straighten(&points));
            }
        }
    }
    thin_out(chains)
}

type Node = (i64, i64);

fn walk(at: &mut BTreeMap<Node, BTreeSet<Node>>, start: Node) -> Option<Vec<Node>> {
    let mut chain = vec![start];
    let mut here = start;
    while let Some(next) = at.get_mut(&here).and_then(BTreeSet::pop_first) {
        if let Some(back) = at.get_mut(&next) {
            back.remove(&here);
        }
        chain.push(next);
        here = next;
    }
    (chain.len() > 1).then_some(chain)
}

fn extent(points: &[Point]) -> f64 {
    let mut extent: f64 = 0.0;
    for axis in 0..2 {
        let low = points.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        extent = extent.max(high - low);
    }
    extent
}

/// Douglas and Peucker's way of dropping points, with a stack instead of recursion.
pub(crate) fn straighten(points: &[Point]) -> Vec<Point> {
    let mut keep = vec![false; points.len()];
    let mut spans = vec![(0, points.len().saturating_sub(1))];
    while let Some((first, last)) = spans.pop() {
        keep[first] = true;
        keep[last] = true;
        let (a, b) = (points[first], points[last]);
        let mut worst = (STRAIGHT, None);
        for (i, &p) in points.iter().enumerate().take(last).skip(first + 1) {
            let off = distance_to_segment(p, a, b);
            if off > worst.0 {
                worst = (off, Some(i));
            }
        }
        if let Some(i) = worst.1 {
            spans.push((first, i));
            spans.push((i, last));
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(&p, _)| p).collect()
}

pub(crate) fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let square = dx * dx + dy * dy;
    let t =
        if square > 0.0 { (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    libm::hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy)
}

fn thin_out(mut chains: Vec<Vec<Point>>) -> Vec<Vec<Point>> {
    let total: usize = chains.iter().map(Vec::len).sum();
    if total <= MOST {
        return chains;
    }
    // Stable, so equal chains keep their order.
    chains.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
    let mut left = MOST;
    chains.retain(|chain| {
        let fits = chain.len() <= left;
        if fits {
            left -= chain.len();
        }
        fits
    });
    chains
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn section() -> SectionPlane {
        SectionPlane {
            u: DVec3::NEG_Z,
            v: DVec3::Y,
            normal: DVec3::X,
            view: super::super::section::View::Side,
            rail_level: false,
        }
    }

    #[test]
    fn a_cut_box_is_one_ring_of_four_corners() {
        // Two triangles a face; the four faces square to the section's normal, cut at x = 0.
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let ring = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
        let mut triangles = Vec::new();
        for i in 0..4 {
            let ([y0, z0], [y1, z1]) = (ring[i], ring[(i + 1) % 4]);
            triangles.push([corner(-1.0, y0, z0), corner(1.0, y0, z0), corner(1.0, y1, z1)]);
            triangles.push([corner(-1.0, y0, z0), corner(1.0, y1, z1), corner(-1.0, y1, z1)]);
        }
        let world = Pose { origin: DVec3::ZERO, axes: DMat3::IDENTITY };
        let segments = cut(&triangles, &world, &section());
        assert_eq!(segments.len(), 8);
        let panel = Panel { frame: [0.0, 0.0, 50.0, 50.0], scale: 10.0, origin: [20.0, 20.0] };
        let chains = chains(&segments, &panel);
        assert_eq!(chains.len(), 1);
        assert_eq!(chains[0].first(), chains[0].last());
        assert!(chains[0].len() <= 6, "{:?}", chains[0]);
    }

    #[test]
    fn straightening_moves_nothing_far() {
        let points: Vec<Point> =
            (0..200).map(|i| [f64::from(i) * 0.1, libm::sin(f64::from(i) * 0.05) * 5.0]).collect();
        let straight = straighten(&points);
        assert!(straight.len() < 60);
        for &p in &points {
            let off =
                straight.windows(2).map(|w| distance_to_segment(p, w[0], w[1])).fold(f64::INFINITY, f64::min);
            assert!(off <= STRAIGHT + 1e-12);
        }
    }
}
