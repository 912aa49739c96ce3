//! Polygons: corners in space in, k - 2 triangles out, whatever the polygon is like.
//!
//! The polygon is seen along the axis nearest to its (Newell) normal: dropping a coordinate rounds nothing, and in a
//! plane it keeps every orientation. Convex ones become a fan; others lose ears, one at a time: a convex corner whose
//! triangle holds no reflex corner. Only the two neighbours of a removed ear can become ears, so a queue of
//! them replaces search (Eberly, "Triangulation by ear clipping"); reflex corners lie in a grid, so a test looks at
//! few. Corners in the same place are no obstacle: polygons with holes touch themselves along a bridge.
//!
//! Corners that lie where the one before does, and tips of spikes without width, go first: they have no turn to tell the others by.
//!
//! Where no ear is left (repeated or collinear corners, crossing edges) the rules are relaxed step by step, and work is
//! bounded: at least k - 2 triangles always come out, in time about linear in k.

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

/// Grid cells and corners looked at for each corner of a polygon, at most; simple polygons take a small part of it.
const WORK_PER_CORNER: u64 = 2000;

/// Work that one file may cost: about 2 s.
pub(crate) const WORK_PER_FILE: u64 = 1 << 29;

/// Cuts the polygon with these corners into `corners.len() - 2` triangles of corner numbers, in its own direction,
/// and hands each to `emit`. What is left of `work` bounds the effort, and so many looks at each corner; beyond that the rest is cut off
/// corner by corner. Tells whether it was enough.
pub(crate) fn triangulate(corners: &[DVec3], work: &mut u64, mut emit: impl FnMut([usize; 3])) -> bool {
    let n = corners.len();
    if n == 3 {
        emit([0, 1, 2]);
        return true;
    }
    let Some(points) = flattened(corners) else {
        (2..n).for_each(|i| emit([0, i - 1, i]));
        return true;
    };
    // As most are, and faster told.
    if turns(&points).all(|turn| turn > 0.0) {
        (2..n).for_each(|i| emit([0, i - 1, i]));
        return true;
    }
    let ring = without_spikes(&points, &mut emit);
    let n = ring.len();
    let points: Vec<DVec2> = ring.iter().map(|&i| points[i]).collect();
    let mut emit = |corners: [usize; 3]| emit(corners.map(|i| ring[i]));
    if turns(&points).all(|turn| turn >= 0.0) {
        (2..n).for_each(|i| emit([0, i - 1, i]));
        return true;
    }
    let mut clipper = Clipper::new(&points, (*work).min(WORK_PER_CORNER.saturating_mul(n as u64)));
    let granted = clipper.work;
    clipper.run(&mut emit);
    *work -= granted - clipper.work;
    clipper.work > 0
}

/// The corners in a plane, counter-clockwise, within 2 of the origin; none when the polygon has no area.
fn flattened(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    // By powers of two, so that nothing is rounded: first so that differences are finite, then to a size near 1.
    let largest = corners.iter().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    let first = scale_to_one(largest);
    let origin = corners.first().copied().unwrap_or_default() * first;
    let extent = corners.iter().fold(0.0, |m: f64, p| m.max((*p * first - origin).abs().max_element()));
    let second = scale_to_one(extent);
    let local: Vec<DVec3> = corners.iter().map(|p| (*p * first - origin) * second).collect();
    let mut normal = DVec3::ZERO;
    let mut before = local.last().copied().unwrap_or_default();
    for &p in &local {
        normal += before.cross(p);
        before = p;
    }
    let size = normal.abs();
    if size.max_element() <= 0.0 {
        return None;
    }
    let (axis, flat): (f64, fn(&DVec3) -> DVec2) = if size.z >= size.x && size.z >= size.y {
        (normal.z, |p| DVec2::new(p.x, p.y))
    } else if size.x >= size.y {
        (normal.x, |p| DVec2::new(p.y, p.z))
    } else {
        (normal.y, |p| DVec2::new(p.z, p.x))
    };
    let mirror = DVec2::new(if axis < 0.0 { -1.0 } else { 1.0 }, 1.0);
    Some(local.iter().map(|p| flat(p) * mirror).collect())
}

/// At each corner: positive where the border turns left.
fn turns(points: &[DVec2]) -> impl Iterator<Item = f64> {
    let n = points.len();
    (0..n).map(move |i| orient(points[(i + n - 1) % n], points[i], points[(i + 1) % n]))
}

/// The corners but those that lie where the one before them does and those where the border turns back upon itself; for each that
/// is left out a triangle without area.
fn without_spikes(points: &[DVec2], emit: &mut impl FnMut([usize; 3])) -> VecDeque<usize> {
    let is_spike = |a: usize, b: usize, c: usize| {
        let (a, b, c) = (points[a], points[b], points[c]);
        a == b || b == c || (orient(a, b, c) == 0.0 && (b - a).dot(c - b) < 0.0)
    };
    let mut ring: VecDeque<usize> = VecDeque::with_capacity(points.len());
    for c in 0..points.len() {
        while let [.., a, b] = ring.make_contiguous()[..]
            && is_spike(a, b, c)
        {
            emit([a, b, c]);
            ring.pop_back();
        }
        ring.push_back(c);
    }
    // And where the ends meet.
    while let [first, second, .., before, last] = ring.make_contiguous()[..] {
        if is_spike(before, last, first) {
            emit([before, last, first]);
            ring.pop_back();
        } else if is_spike(last, first, second) {
            emit([last, first, second]);
            ring.pop_front();
        } else {
            break;
        }
    }
    ring
}

/// A power of two that takes `size` to about 1; 1 for zero.
fn scale_to_one(size: f64) -> f64 {
    let (_, exponent) = libm::frexp(size);
    if size > 0.0 { libm::ldexp(1.0, (-exponent).clamp(-1020, 1020)) } else { 1.0 }
}

/// Twice the signed area of a, b, c: positive when they turn left.
fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// How strictly an ear is judged.
#[derive(Clone, Copy, PartialEq)]
enum Rule {
    /// It has area, and no reflex corner lies in it or on its border.
    Proper,
    /// It turns left or not at all, and no reflex corner lies inside.
    Touching,
    /// It turns left or not at all.
    Convex,
    /// Any corner.
    Any,
}

struct Clipper<'a> {
    points: &'a [DVec2],
    prev: Vec<usize>,
    next: Vec<usize>,
    alive: Vec<bool>,
    reflex: Vec<bool>,
    grid: Grid,
    work: u64,
}

impl<'a> Clipper<'a> {
    fn new(points: &'a [DVec2], work: u64) -> Self {
        let n = points.len();
        let mut clipper = Self {
            points,
            prev: (0..n).map(|i| (i + n - 1) % n).collect(),
            next: (0..n).map(|i| (i + 1) % n).collect(),
            alive: vec![true; n],
            reflex: vec![false; n],
            grid: Grid::default(),
            work,
        };
        clipper.reflex = (0..n).map(|i| clipper.turn(i) < 0.0).collect();
        let list: Vec<usize> = (0..n).filter(|&i| clipper.reflex[i]).collect();
        clipper.grid = Grid::new(points, &list);
        clipper
    }

    fn turn(&self, i: usize) -> f64 {
        orient(self.points[self.prev[i]], self.points[i], self.points[self.next[i]])
    }

    fn run(&mut self, emit: &mut impl FnMut([usize; 3])) {
        let n = self.points.len();
        let mut left = n;
        let mut queue: VecDeque<usize> = (0..n).collect();
        let mut at = 0;
        while left > 3 {
            let mut ear = None;
            while let Some(i) = queue.pop_front() {
                if self.alive[i] && self.is_ear(i, Rule::Proper) {
                    ear = Some(i);
                    break;
                }
            }
            let ear = ear.unwrap_or_else(|| self.forced(at, left));
            let (a, c) = (self.prev[ear], self.next[ear]);
            emit([a, ear, c]);
            self.alive[ear] = false;
            (self.next[a], self.prev[c]) = (c, a);
            left -= 1;
            for i in [a, c] {
                self.reflex[i] = self.turn(i) < 0.0;
                queue.push_back(i);
            }
            at = c;
        }
        emit([self.prev[at], at, self.next[at]]);
    }

    /// The next corner to remove, from `at` on, when there is no proper ear.
    fn forced(&mut self, at: usize, left: usize) -> usize {
        for rule in [Rule::Touching, Rule::Convex] {
            let mut i = at;
            for _ in 0..left {
                if self.is_ear(i, rule) {
                    return i;
                }
                i = self.next[i];
            }
        }
        at
    }

    fn is_ear(&mut self, i: usize, rule: Rule) -> bool {
        // With its work used up the polygon is cut off corner by corner.
        let rule = if self.work == 0 { Rule::Any } else { rule };
        self.work = self.work.saturating_sub(1);
        let turn = self.turn(i);
        match rule {
            Rule::Any => return true,
            Rule::Convex => return turn >= 0.0,
            Rule::Proper if turn <= 0.0 => return false,
            Rule::Touching if turn < 0.0 => return false,
            Rule::Touching if turn == 0.0 => return true,
            Rule::Proper | Rule::Touching => {}
        }
        let (a, b, c) = (self.points[self.prev[i]], self.points[i], self.points[self.next[i]]);
        let mut work = 0;
        let blocked = self.grid.any(a.min(b).min(c), a.max(b).max(c), &mut work, |j| {
            let p = self.points[j];
            if !self.alive[j] || !self.reflex[j] || p == a || p == b || p == c {
                return false;
            }
            let sides = [orient(a, b, p), orient(b, c, p), orient(c, a, p)];
            if rule == Rule::Proper {
                sides.iter().all(|&s| s >= 0.0)
            } else {
                sides.iter().all(|&s| s > 0.0)
            }
        });
        self.work = self.work.saturating_sub(work);
        !blocked
    }
}

/// Corners by where they lie, so that only those near a triangle are looked at.
#[derive(Default)]
struct Grid {
    low: DVec2,
    per_unit: DVec2,
    side: usize,
    /// Where each cell's corners begin in `items`; one more than cells.
    starts: Vec<usize>,
    items: Vec<usize>,
}

impl Grid {
    fn new(points: &[DVec2], list: &[usize]) -> Self {
        let low = list.iter().fold(DVec2::INFINITY, |m, &i| m.min(points[i]));
        let high = list.iter().fold(DVec2::NEG_INFINITY, |m, &i| m.max(points[i]));
        // About one corner a cell.
        let side = list.len().isqrt().clamp(1, 512);
        let size = (high - low).max(DVec2::splat(1e-300));
        let mut grid = Self {
            low,
            per_unit: DVec2::splat(side as f64) / size,
            side,
            starts: vec![0; side * side + 2],
            items: vec![0; list.len()],
        };
        let cell = |grid: &Self, i: usize| grid.column(points[i].x) + side * grid.row(points[i].y);
        for &i in list {
            let at = cell(&grid, i);
            grid.starts[at + 2] += 1;
        }
        for at in 2..grid.starts.len() {
            grid.starts[at] += grid.starts[at - 1];
        }
        for &i in list {
            let at = cell(&grid, i);
            let slot = grid.starts[at + 1];
            grid.items[slot] = i;
            grid.starts[at + 1] += 1;
        }
        grid
    }

    // Casts from float saturate, so any coordinate lands in some cell, the same for equal coordinates.
    fn column(&self, x: f64) -> usize {
        (((x - self.low.x) * self.per_unit.x) as usize).min(self.side - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low.y) * self.per_unit.y) as usize).min(self.side - 1)
    }

    /// Whether `test` holds for any corner in the cells that the box touches; counts cells and corners into `work`.
    fn any(&self, low: DVec2, high: DVec2, work: &mut u64, test: impl Fn(usize) -> bool) -> bool {
        let (left, right) = (self.column(low.x), self.column(high.x));
        for y in self.row(low.y)..=self.row(high.y) {
            // A row of cells is one stretch of items.
            let (begin, end) = (self.starts[left + self.side * y], self.starts[right + self.side * y + 1]);
            *work += 1 + (end - begin) as u64;
            if self.items[begin..end].iter().any(|&j| test(j)) {
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
#[path = "triangulate_tests.rs"]
mod tests;
