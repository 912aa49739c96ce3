//! A hierarchy of the triangles of a scene, for rays: which lie near one another. In: triangles; out: a binary tree.
//!
//! It keeps no boxes: these are made for each sun's own axes, where they are tight ([`crate::shade`]). So the tree
//! depends on the meshes alone and is part of loading. Split by the surface area heuristic over bins (I. Wald, "On
//! fast construction of SAH-based bounding volume hierarchies", 2007).

use super::surfaces::{Surfaces, bounds};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A node: a leaf with some triangles, or an inner node with two children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Node {
    /// Of an inner node: how far behind it its second child stands; the first is next to it. Of a leaf: its first
    /// triangle's place in [`Hierarchy::order`].
    pub at: u32,
    /// Triangles of a leaf; 0 for an inner node.
    pub count: u32,
}

/// The tree, root first, every child behind its parent; empty for no triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hierarchy {
    pub(crate) nodes: Vec<Node>,
    /// Numbers of triangles, leaf by leaf. Those without area are left out: no ray meets them.
    pub(crate) order: Vec<u32>,
    /// How many there are in all.
    pub(crate) triangles: usize,
}

/// No path from the root is longer.
pub(crate) const DEPTH: usize = 96;

/// From here on halves are split by number, so that [`DEPTH`] holds for 2^32 triangles.
const STEEP: usize = DEPTH - 34;

/// Bins along each axis.
const BINS: usize = 16;

/// Triangles of a leaf, at most.
const LEAF: usize = 6;

/// What a step down costs, in tests of a triangle.
const STEP: f32 = 0.7;

/// Slices of more triangles than this are split by two threads.
const PARALLEL: usize = 8192;

/// A triangle's box.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    triangle: u32,
}

#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Twice the middle.
    fn middle(&self) -> Vec3 {
        self.low + self.high
    }

    /// Half the surface.
    fn area(&self) -> f32 {
        let size = (self.high - self.low).max(Vec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

impl Hierarchy {
    pub(crate) fn new(surfaces: &Surfaces) -> Self {
        let [low, high] = bounds(surfaces.positions.iter().copied());
        // Single precision is enough to sort with, and coordinates are brought to where its squares are finite.
        let center = 0.5 * low + 0.5 * high;
        let size = (high - low).max_element();
        let scale = if size > 0.0 && size.is_finite() { 1.0 / size } else { 1.0 };
        let mut items: Vec<Item> = (0..surfaces.triangles.len())
            .into_par_iter()
            .filter_map(|t| {
                let corners = surfaces.corners(t);
                let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                (across != DVec3::ZERO).then(|| {
                    let [a, b, c] = corners.map(|p| ((p - center) * scale).as_vec3());
                    Item {
                        bounds: Bounds { low: a.min(b).min(c), high: a.max(b).max(c) },
                        triangle: t as u32,
                    }
                })
            })
            .collect();
        let mut nodes = Vec::new();
        if !items.is_empty() {
            build(&mut items, 0, 0, &mut nodes);
        }
        Self {
            nodes,
            order: items.iter().map(|item| item.triangle).collect(),
            triangles: surfaces.triangles.len(),
        }
    }
}

/// Appends the tree of `items`, whose first is number `first` of all.
fn build(items: &mut [Item], first: u32, depth: usize, nodes: &mut Vec<Node>) {
    let Some(middle) = split(items, depth) else {
        nodes.push(Node { at: first, count: items.len() as u32 });
        return;
    };
    let (left, right) = items.split_at_mut(middle);
    let second = first + middle as u32;
    let root = nodes.len();
    nodes.push(Node { at: 0, count: 0 });
    if left.len() + right.len() > PARALLEL {
        let (mut behind, mut more) = (Vec::new(), Vec::new());
        rayon::join(
            || build(left, first, depth + 1, &mut behind),
            || build(right, second, depth + 1, &mut more),
        );
        nodes.append(&mut behind);
        nodes[root].at = (nodes.len() - root) as u32;
        nodes.append(&mut more);
    } else {
        build(left, first, depth + 1, nodes);
        nodes[root].at = (nodes.len() - root) as u32;
        build(right, second, depth + 1, nodes);
    }
}

/// Sorts `items` into two parts and returns where the second begins; nothing when they shall stay together.
fn split(items: &mut [Item], depth: usize) -> Option<usize> {
    let count = items.len();
    if count <= 1 {
        return None;
    }
    let halves = (count > LEAF).then_some(count / 2);
    if depth >= STEEP {
        return halves;
    }
    let mut whole = Bounds::EMPTY;
    let mut middles = Bounds::EMPTY;
    for item in items.iter() {
        whole = whole.union(item.bounds);
        let middle = item.bounds.middle();
        middles = middles.union(Bounds { low: middle, high: middle });
    }
    let extent = middles.high - middles.low;
    let scale = extent.map(|e| if e > 0.0 { BINS as f32 * (1.0 - 1e-6) / e } else { 0.0 });
    let bin = |item: &Item, axis: usize| {
        (((item.bounds.middle()[axis] - middles.low[axis]) * scale[axis]) as usize).min(BINS - 1)
    };
    let mut bins = [[(Bounds::EMPTY, 0usize); BINS]; 3];
    for item in items.iter() {
        for (axis, bins) in bins.iter_mut().enumerate() {
            let (bounds, count) = &mut bins[bin(item, axis)];
            *bounds = bounds.union(item.bounds);
            *count += 1;
        }
    }
    // The cost of a cut: each side's area times its triangles.
    let mut best = (f32::INFINITY, 0, 0);
    for (axis, bins) in bins.iter().enumerate() {
        let mut right = [0.0; BINS];
        let (mut bounds, mut sum) = (Bounds::EMPTY, 0);
        for at in (1..BINS).rev() {
            (bounds, sum) = (bounds.union(bins[at].0), sum + bins[at].1);
            right[at] = bounds.area() * sum as f32;
        }
        (bounds, sum) = (Bounds::EMPTY, 0);
        for at in 1..BINS {
            (bounds, sum) = (bounds.union(bins[at - 1].0), sum + bins[at - 1].1);
            let cost = bounds.area() * sum as f32 + right[at];
            if sum > 0 && sum < count && cost < best.0 {
                best = (cost, axis, at);
            }
        }
    }
    let (cost, axis, at) = best;
    if !cost.is_finite() {
        return halves;
    }
    if count <= LEAF && cost + STEP * whole.area() >= whole.area() * count as f32 {
        return None;
    }
    // In place, and in an order that depends on nothing but the items'.
    let mut middle = 0;
    for i in 0..count {
        if bin(&items[i], axis) < at {
            items.swap(i, middle);
            middle += 1;
        }
    }
    Some(middle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::scene::{Attributes, Material, NONE};

    fn scattered(count: u32, spread: f64) -> Surfaces {
        let mut surfaces = Surfaces { materials: vec![Material::default_surface()], ..Surfaces::default() };
        let mut numbers = Random(7);
        let mut random = || numbers.unit();
        for t in 0..count {
            let center = DVec3::new(random(), random(), random()) * spread;
            surfaces.positions.extend([0, 1, 2].map(|_| center + DVec3::new(random(), random(), random())));
            surfaces.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
            surfaces.attributes.push(Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material: 0 });
        }
        surfaces
    }

    /// Walks the tree; returns its depth.
    fn walk(tree: &Hierarchy, at: usize, met: &mut Vec<u32>) -> usize {
        let node = tree.nodes[at];
        if node.count > 0 {
            met.extend(node.at..node.at + node.count);
            return 1;
        }
        1 + walk(tree, at + 1, met).max(walk(tree, at + node.at as usize, met))
    }

    #[test]
    fn every_triangle_stands_in_one_leaf() {
        for (count, spread) in [(0, 1.0), (1, 1.0), (7, 0.0), (1000, 30.0), (40_000, 100.0)] {
            let mut surfaces = scattered(count, spread);
            if count > 100 {
                // Many at one place, and some without area.
                for t in 10..60 {
                    surfaces.triangles[t] = surfaces.triangles[0];
                }
                surfaces.triangles[3][1] = surfaces.triangles[3][0];
            }
            let tree = Hierarchy::new(&surfaces);
            let mut met = Vec::new();
            if count > 0 {
                assert!(walk(&tree, 0, &mut met) <= DEPTH);
            }
            assert_eq!(met, (0..tree.order.len() as u32).collect::<Vec<_>>());
            let mut order = tree.order.clone();
            order.sort_unstable();
            let all = (0..count).filter(|&t| count <= 100 || t != 3);
            assert_eq!(order, all.collect::<Vec<_>>());
        }
    }

    #[test]
    fn threads_do_not_change_it() {
        let surfaces = scattered(30_000, 50.0);
        let made = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Hierarchy::new(&surfaces))
        };
        assert!(made(1) == made(3));
    }
}
