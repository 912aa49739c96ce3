//! Rays against triangles in double precision: a tree of boxes, split at the median. A ray in, what it meets first out.

use glam::DVec3;
use groundglass::scene::Surfaces;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Deeper than any: each level halves the number of triangles.
const DEPTH: usize = 64;

struct Node {
    low: DVec3,
    high: DVec3,
    /// A leaf: its triangles in the order. Otherwise empty, and the second child's place; the first follows.
    triangles: std::ops::Range<usize>,
    second: usize,
}

pub(super) struct Tree<'a> {
    pub(super) surfaces: &'a Surfaces,
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// Where a ray meets a triangle: lengths of its direction, and how much each corner weighs.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    pub(super) triangle: usize,
    pub(super) distance: f64,
    pub(super) weights: DVec3,
}

impl<'a> Tree<'a> {
    pub(super) fn new(surfaces: &'a Surfaces) -> Self {
        let mut order: Vec<u32> = (0..surfaces.triangles.len() as u32).collect();
        let middles: Vec<DVec3> =
            order.iter().map(|&t| surfaces.corners(t as usize).into_iter().sum()).collect();
        let mut nodes = Vec::new();
        if !order.is_empty() {
            let all = 0..order.len();
            split(surfaces, &middles, &mut order, all, &mut nodes);
        }
        Self { surfaces, nodes, order }
    }

    /// The nearest triangle beyond `least` and before `most` lengths of `direction` that `stops` the ray.
    pub(super) fn first(
        &self,
        from: DVec3,
        direction: DVec3,
        (least, most): (f64, f64),
        stops: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let inverse = direction.recip();
        let mut found: Option<Hit> = None;
        let mut stack = [0usize; DEPTH];
        let mut height = usize::from(!self.nodes.is_empty());
        while height > 0 {
            height -= 1;
            let at = stack[height];
            let node = &self.nodes[at];
            let limit = found.map_or(most, |hit| hit.distance);
            let (a, b) = ((node.low - from) * inverse, (node.high - from) * inverse);
            // What is no number lies in the plane of a side: along that axis the box counts as met.
            let in_plane = a.is_nan_mask() | b.is_nan_mask();
            let near = DVec3::select(in_plane, DVec3::NEG_INFINITY, a.min(b));
            let far = DVec3::select(in_plane, DVec3::INFINITY, a.max(b));
            let (enter, leave) = (near.max_element().max(least), far.min_element().min(limit));
            if enter > leave * (1.0 + 1e-12) {
                continue;
            }
            if node.triangles.is_empty() {
                for child in [node.second, at + 1] {
                    if height < DEPTH {
                        stack[height] = child;
                        height += 1;
                    }
                }
                continue;
            }
            for &t in &self.order[node.triangles.clone()] {
                let limit = found.map_or(most, |hit| hit.distance);
                if let Some(hit) = meet(self.surfaces, t as usize, from, direction)
                    && hit.distance > least
                    && hit.distance < limit
                    && hit.weights.min_element() >= 0.0
                    && stops(&hit)
                {
                    found = Some(hit);
                }
            }
        }
        found
    }
}

fn split(
    surfaces: &Surfaces,
    middles: &[DVec3],
    order: &mut [u32],
    range: std::ops::Range<usize>,
    nodes: &mut Vec<Node>,
) {
    let part = &mut order[range.clone()];
    let corners = part.iter().flat_map(|&t| surfaces.corners(t as usize));
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), corner| {
        (low.min(corner), high.max(corner))
    });
    let at = nodes.len();
    if part.len() <= LEAF {
        nodes.push(Node { low, high, triangles: range, second: 0 });
        return;
    }
    nodes.push(Node { low, high, triangles: 0..0, second: 0 });
    let place = |&t: &u32| middles[t as usize];
    let least = part.iter().map(place).fold(DVec3::INFINITY, DVec3::min);
    let most = part.iter().map(place).fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (most - least).max_position();
    let half = part.len() / 2;
    part.select_nth_unstable_by(half, |a, b| place(a)[axis].total_cmp(&place(b)[axis]));
    split(surfaces, middles, order, range.start..range.start + half, nodes);
    nodes[at].second = nodes.len();
    split(surfaces, middles, order, range.start + half..range.end, nodes);
}

/// Where the ray's line meets the triangle's plane (T. Möller and B. Trumbore, "Fast, minimum storage ray-triangle
/// intersection", Journal of Graphics Tools 2(1), 1997, 21-28); None where it runs along it.
pub(super) fn meet(surfaces: &Surfaces, triangle: usize, from: DVec3, direction: DVec3) -> Option<Hit> {
    let [a, b, c] = surfaces.corners(triangle);
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let to = from - a;
    let q = to.cross(ab);
    let (v, w) = (to.dot(p) / determinant, direction.dot(q) / determinant);
    Some(Hit { triangle, distance: ac.dot(q) / determinant, weights: DVec3::new(1.0 - v - w, v, w) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_in_the_plane_of_a_boxs_side_meets_what_is_there() {
        let surfaces = Surfaces {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Surfaces::default()
        };
        let tree = Tree::new(&surfaces);
        let meets = |from: DVec3| tree.first(from, DVec3::NEG_Z, (0.0, 10.0), |_| true).is_some();
        assert!(meets(DVec3::new(0.0, 0.3, 1.0)) && meets(DVec3::new(0.3, 0.0, 1.0)));
        assert!(!meets(DVec3::new(-1e-9, 0.3, 1.0)) && !meets(DVec3::new(0.3, 0.8, 1.0)));
    }
}
