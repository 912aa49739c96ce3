//! What the sun sees: rays toward it in, which of them a surface crosses out. Exact: every ray meets every triangle that its
//! nodes' boxes let through, and edges are tested as the rasterizer does it: two triangles that share one cannot both miss a ray
//! between them. [`super::sun`] asks, and says of each triangle whether it stops what crosses it.
//!
//! The *sun frame* has its origin at the lens centre and `z` toward the sun's centre. A ray is a place and two slopes,
//! `x` and `y` for each metre of `z`; where the sun is a point both are 0, and nothing but comparisons is left of the
//! boxes' test. Sixteen rays go down the tree together.
//!
//! From the ray's start, and sheared so that it runs along `z`, a triangle's corners are `a`, `b`, `c`. It is crossed where
//! `u = b_x c_y - b_y c_x`, `v` of `c`, `a` and `w` of `a`, `b` have one sign, and `(u a_z + v b_z + w c_z) / (u + v + w) > 0`.

use crate::raster::LANES;
use crate::scene::{DEPTH, Hierarchy, Surfaces};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, f32x16, mask32x16};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A node of the scene's tree in the sun frame.
#[derive(Clone, Copy)]
struct Node {
    low: [f32; 3],
    high: [f32; 3],
    /// See [`crate::scene::Hierarchy`].
    at: u32,
    count: u32,
}

/// A triangle that may stand before the sun.
struct Occluder {
    corners: [[f32; 3]; 3],
    triangle: u32,
}

/// All triangles of a scene in the frame of its sun.
pub(crate) struct Occluders {
    nodes: Vec<Node>,
    occluders: Vec<Occluder>,
}

/// Sixteen rays in the sun frame.
#[derive(Clone, Copy, Default)]
pub(super) struct SunRays {
    pub from: [[f32; LANES]; 3],
    /// Change of `x` and `y` with `z`.
    pub slope: [[f32; LANES]; 2],
}

/// Where rays cross a triangle: how much each corner weighs there, times their sum.
pub(super) type Weights = [[f32; LANES]; 3];

/// Which of the lanes of a mask, which cross a triangle, it really stops.
pub(super) type Stops<'a> = dyn Fn(u32, u16, &Weights) -> u16 + 'a;

impl Occluders {
    /// `positions` are in the lens frame; the rows of `sun` are the axes of the sun frame there.
    pub(crate) fn new(surfaces: &Surfaces, positions: &[DVec3], sun: [DVec3; 3]) -> Self {
        let made;
        let hierarchy = match &surfaces.hierarchy {
            Some(hierarchy) => hierarchy,
            None => {
                made = Hierarchy::new(surfaces);
                &made
            }
        };
        let triangles = &surfaces.triangles;
        let turned: Vec<[f32; 3]> =
            positions.par_iter().map(|&p| sun.map(|axis| axis.dot(p) as f32)).collect();
        let occluders: Vec<Occluder> = hierarchy
            .order
            .par_iter()
            .map(|&t| Occluder { corners: triangles[t as usize].map(|i| turned[i as usize]), triangle: t })
            .collect();
        let mut nodes: Vec<Node> = hierarchy
            .nodes
            .iter()
            .map(|node| Node {
                low: [f32::INFINITY; 3],
                high: [f32::NEG_INFINITY; 3],
                at: node.at,
                count: node.count,
            })
            .collect();
        // Children stand behind their parents.
        for at in (0..nodes.len()).rev() {
            let Node { at: link, count, .. } = nodes[at];
            let mut low = Vec3::INFINITY;
            let mut high = Vec3::NEG_INFINITY;
            let mut add = |a: [f32; 3], b: [f32; 3]| {
                low = low.min(Vec3::from(a));
                high = high.max(Vec3::from(b));
            };
            if count == 0 {
                for child in [at + 1, at + link as usize] {
                    add(nodes[child].low, nodes[child].high);
                }
            } else {
                for occluder in &occluders[link as usize..(link + count) as usize] {
                    occluder.corners.iter().for_each(|&corner| add(corner, corner));
                }
            }
            (nodes[at].low, nodes[at].high) = (low.to_array(), high.to_array());
        }
        Self { nodes, occluders }
    }

    /// The lanes of `alive` whose rays are stopped. `parallel` rays have no slopes. `last` is a place to remember what
    /// stopped rays before: it is asked first, and changes nothing but the time.
    pub(super) fn stopped(
        &self,
        level: Level,
        rays: &SunRays,
        parallel: bool,
        alive: u16,
        last: &mut u32,
        stops: &Stops<'_>,
    ) -> u16 {
        if parallel {
            at_level!(level, simd => stopped::<_, true>(simd, self, rays, alive, last, stops))
        } else {
            at_level!(level, simd => stopped::<_, false>(simd, self, rays, alive, last, stops))
        }
    }
}

/// Sixteen rays in registers.
#[derive(Clone, Copy)]
struct Lanes<S: Simd> {
    from: [f32x16<S>; 3],
    slope: [f32x16<S>; 2],
}

#[inline(always)]
fn stopped<S: Simd, const PARALLEL: bool>(
    simd: S,
    scene: &Occluders,
    rays: &SunRays,
    alive: u16,
    last: &mut u32,
    stops: &Stops<'_>,
) -> u16 {
    let load = |a: &[f32; LANES]| f32x16::load_array_ref(simd, a);
    let lanes = Lanes {
        from: [load(&rays.from[0]), load(&rays.from[1]), load(&rays.from[2])],
        slope: [load(&rays.slope[0]), load(&rays.slope[1])],
    };
    let mut rest = alive;
    let Some(root) = scene.nodes.first() else { return 0 };
    if let Some(occluder) = scene.occluders.get(*last as usize) {
        rest &= !crossed::<S, PARALLEL>(simd, occluder, &lanes, rest, stops);
    }
    let mut stack = [0u32; DEPTH];
    let mut height = 0;
    let mut at = 0;
    if rest == 0 || enters::<S, PARALLEL>(simd, root, &lanes) & rest == 0 {
        return alive & !rest;
    }
    while let Some(node) = scene.nodes.get(at) {
        if node.count > 0 {
            let first = node.at as usize;
            for (place, occluder) in scene.occluders.iter().enumerate().skip(first).take(node.count as usize)
            {
                let hit = crossed::<S, PARALLEL>(simd, occluder, &lanes, rest, stops);
                if hit != 0 {
                    *last = place as u32;
                    rest &= !hit;
                    if rest == 0 {
                        return alive;
                    }
                }
            }
        } else {
            let pair = [at + 1, at + node.at as usize];
            let [Some(a), Some(b)] = pair.map(|child| scene.nodes.get(child)) else { break };
            let a = (enters::<S, PARALLEL>(simd, a, &lanes) & rest).count_ones();
            let b = (enters::<S, PARALLEL>(simd, b, &lanes) & rest).count_ones();
            // First where more rays go: what stops them all is found sooner.
            let (near, far) = if a >= b { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
            if a.max(b) > 0 {
                if a.min(b) > 0 {
                    stack[height] = far as u32;
                    height += 1;
                }
                at = near;
                continue;
            }
        }
        if height == 0 {
            break;
        }
        height -= 1;
        at = stack[height] as usize;
    }
    alive & !rest
}

/// The lanes whose rays may pass through a node's box.
#[inline(always)]
fn enters<S: Simd, const PARALLEL: bool>(simd: S, node: &Node, rays: &Lanes<S>) -> u16 {
    let [x, y, z] = rays.from;
    let splat = |value: f32| f32x16::splat(simd, value);
    let ahead = z.simd_lt(splat(node.high[2]));
    if PARALLEL {
        let inside = x.simd_ge(splat(node.low[0]))
            & x.simd_le(splat(node.high[0]))
            & y.simd_ge(splat(node.low[1]))
            & y.simd_le(splat(node.high[1]));
        return (inside & ahead).to_bitmask() as u16;
    }
    let zero = splat(0.0);
    let near = splat(node.low[2]) - z;
    let near = near.simd_gt(zero).select(near, zero);
    let far = splat(node.high[2]) - z;
    let (x, y) = (
        [rays.slope[0] * near + x, rays.slope[0] * far + x],
        [rays.slope[1] * near + y, rays.slope[1] * far + y],
    );
    // Against rounding, generously: a millionth of all that was added.
    let slack = (far + x[0].abs() + x[1].abs() + y[0].abs() + y[1].abs()) * 1e-6;
    let inside = (x[0].max(x[1]) + slack).simd_ge(splat(node.low[0]))
        & (x[0].min(x[1]) - slack).simd_le(splat(node.high[0]))
        & (y[0].max(y[1]) + slack).simd_ge(splat(node.low[1]))
        & (y[0].min(y[1]) - slack).simd_le(splat(node.high[1]));
    (inside & ahead).to_bitmask() as u16
}

/// The lanes of `alive` whose rays a triangle stops.
#[inline(always)]
fn crossed<S: Simd, const PARALLEL: bool>(
    simd: S,
    occluder: &Occluder,
    rays: &Lanes<S>,
    alive: u16,
    stops: &Stops<'_>,
) -> u16 {
    let zero = f32x16::splat(simd, 0.0);
    let [a, b, c] = [
        about::<S, PARALLEL>(simd, &occluder.corners[0], rays),
        about::<S, PARALLEL>(simd, &occluder.corners[1], rays),
        about::<S, PARALLEL>(simd, &occluder.corners[2], rays),
    ];
    // Twice the areas between the ray and an edge. Exchanging an edge's ends changes the sign and no other bit.
    let u = b[0] * c[1] - b[1] * c[0];
    let v = c[0] * a[1] - c[1] * a[0];
    let w = a[0] * b[1] - a[1] * b[0];
    let inside = (u.simd_ge(zero) & v.simd_ge(zero) & w.simd_ge(zero))
        | (u.simd_le(zero) & v.simd_le(zero) & w.simd_le(zero));
    let hit = inside & mask32x16::from_bitmask(simd, u64::from(alive));
    if !hit.any_true() {
        return 0;
    }
    let sum = u + v + w;
    let height = u * a[2] + v * b[2] + w * c[2];
    let ahead = (sum.simd_gt(zero) & height.simd_gt(zero)) | (sum.simd_lt(zero) & height.simd_lt(zero));
    let hit = (hit & ahead).to_bitmask() as u16;
    if hit == 0 {
        return 0;
    }
    stops(occluder.triangle, hit, &[u.to_array(), v.to_array(), w.to_array()]) & hit
}

/// A corner seen from the rays' starts, sheared so that they run along `z`.
#[inline(always)]
fn about<S: Simd, const PARALLEL: bool>(simd: S, corner: &[f32; 3], rays: &Lanes<S>) -> [f32x16<S>; 3] {
    let x = f32x16::splat(simd, corner[0]) - rays.from[0];
    let y = f32x16::splat(simd, corner[1]) - rays.from[1];
    let z = f32x16::splat(simd, corner[2]) - rays.from[2];
    if PARALLEL { [x, y, z] } else { [x - rays.slope[0] * z, y - rays.slope[1] * z, z] }
}
