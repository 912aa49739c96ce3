//! The inner loop: one triangle for 16 samples at a time.
//!
//! In: a triangle's set-up and a batch of 16 samples, which have a place in every block of the tile. Out: what
//! is seen. The edge functions are made for the 16 lens points; then [`super::regions`] draws block by block, or
//! [`super::scatter`] lens point by lens point, whichever visits less.
//!
//! One generic source for every SIMD level. Multiply and add stay apart: a fused product rounds
//! differently, and the same bytes are wanted at every level.

use super::setup::{Bilinear, Setup};
use super::view::Batch;
use super::visibility::Visibility;
use super::{TILE, regions, scatter};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16, mask32x16};

/// A triangle of the tile with the blocks to visit: columns `x0..=x1`, rows `y0..=y1`.
pub(crate) struct Visit<'a> {
    pub setup: &'a Setup,
    /// What is written where the triangle is seen: the number of its surface in the tile.
    pub id: u32,
    pub blocks: [u8; 4],
    /// It may come nearer than the near plane, whose `1/t` is then checked at each sample.
    pub near: Option<[f32; 3]>,
    /// Samples that meet it may pass through.
    pub cutout: bool,
}

/// Which of the lanes of a mask meet, at block `block`, the surface of a visit that may let them through.
pub(crate) type Opaque<'a> = dyn Fn(&Visit<'_>, usize, u16) -> u16 + 'a;

/// A triangle's functions for 16 lens points: each the value at the left top block, and its change with `x`
/// and `y` in pixels. Inside where `a`, `b` and `c` are not negative; `z` is `1/t`.
#[derive(Clone, Copy)]
pub(super) struct Functions<S: Simd> {
    pub a: [f32x16<S>; 3],
    pub b: [f32x16<S>; 3],
    pub c: [f32x16<S>; 3],
    pub z: [f32x16<S>; 3],
    /// Lanes that are in use, do not see the triangle edge-on and may see it at all.
    pub live: mask32x16<S>,
    /// The size of a block in pixels.
    pub step: (f32, f32),
}

/// Tests every visit, in order, against `seen`.
pub(crate) fn cover<'a>(
    level: Level,
    batch: &Batch,
    block: (u32, u32),
    visits: impl Iterator<Item = Visit<'a>>,
    seen: &mut Visibility,
    opaque: &Opaque<'_>,
) {
    // One dispatch for each triangle: the loop over its blocks is the hot part, and the kernel stays small.
    for visit in visits {
        at_level!(level, simd => cover_one(simd, batch, block, &visit, seen, opaque));
    }
}

/// A bilinear function for the 16 lens points, times `factor`: its value at the block grid's origin, and its
/// change with `x` and `y`. A function and not a closure: closures do not inline into a SIMD context.
#[inline(always)]
fn at_lens<S: Simd>(e: &Bilinear, batch: &Batch, factor: f32x16<S>, simd: S) -> [f32x16<S>; 3] {
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let jx = f32x16::load_array_ref(simd, &batch.x);
    let jy = f32x16::load_array_ref(simd, &batch.y);
    let c = u * e[1] + v * e[2] + e[0];
    let cx = u * e[4] + v * e[5] + e[3];
    let cy = u * e[7] + v * e[8] + e[6];
    [(c + cx * jx + cy * jy) * factor, cx * factor, cy * factor]
}

#[inline(always)]
fn cover_one<S: Simd>(
    simd: S,
    batch: &Batch,
    block: (u32, u32),
    visit: &Visit<'_>,
    seen: &mut Visibility,
    opaque: &Opaque<'_>,
) {
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, 1.0);
    let step = (block.0 as f32, block.1 as f32);

    let plane = visit.setup.plane;
    let distance = u * plane[1] + v * plane[2] + plane[0];
    // Edge-on for this lens point: no sample of the lane can meet it.
    let live = mask32x16::from_bitmask(simd, u64::from(batch.live)) & distance.simd_ne(zero);
    let z = at_lens(&visit.setup.facing, batch, one / distance, simd);
    seen.raise_floor(simd);
    let floor = f32x16::load_array_ref(simd, &seen.floor);
    let live = live & nearest(simd, z, step, visit.blocks).simd_gt(floor);
    if !live.any_true() {
        return;
    }

    let mut blocks = [0, 1, 2, 3].map(|i| i32::from(visit.blocks[i]));
    let mut boxes = None;
    if let Some(corners) = &visit.setup.corners {
        // Where each lens point sees the triangle: tighter than any box that was made beforehand.
        let found = scatter::lane_boxes(simd, corners, batch, block, blocks);
        let [x0, x1, y0, y1] = found.union;
        if x0 > x1 || y0 > y1 {
            return;
        }
        blocks = found.union;
        // Small triangles far apart for different lens points: one lens point and 16 blocks at a time.
        if !visit.cutout && visit.near.is_none() && 6 * found.row_visits < (x1 - x0 + 1) * (y1 - y0 + 1) {
            boxes = Some(found);
        }
    }
    let side = live.select(one.copysign(distance), zero);
    let edges = &visit.setup.edges;
    let functions = Functions {
        a: at_lens(&edges[0], batch, side, simd),
        b: at_lens(&edges[1], batch, side, simd),
        c: at_lens(&edges[2], batch, side, simd),
        z,
        live,
        step,
    };
    match boxes {
        Some(boxes) => scatter::draw(simd, &functions, &boxes, visit.id, seen),
        None => {
            let blocks = blocks.map(|b| b as usize);
            regions::draw(simd, &functions, batch, blocks, visit, seen, opaque);
        }
    }
}

/// The largest `1/t` at any of the blocks.
#[inline(always)]
fn nearest<S: Simd>(simd: S, [z0, zx, zy]: [f32x16<S>; 3], step: (f32, f32), blocks: [u8; 4]) -> f32x16<S> {
    let half = 0.5 * TILE as f32;
    let zero = f32x16::splat(simd, 0.0);
    let place = |block: u8, step: f32| f32x16::splat(simd, f32::from(block) * step - half);
    let [x0, x1, y0, y1] = blocks;
    let x = zx.simd_ge(zero).select(place(x1, step.0), place(x0, step.0));
    let y = zy.simd_ge(zero).select(place(y1, step.1), place(y0, step.1));
    z0 + zy * y + zx * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::LANES;
    use crate::raster::visibility::{EVERYWHERE, group};
    use crate::simd::SimdLevel;

    #[test]
    fn every_simd_level_sees_the_same_bits() {
        let mut state = 1u64;
        let mut random = |size: f32| {
            state = mix(state);
            ((state >> 40) as f32 / 8_388_608.0 - 1.0) * size
        };
        let batch = Batch {
            cell: 0,
            u: std::array::from_fn(|_| random(0.7)),
            v: std::array::from_fn(|_| random(0.7)),
            x: std::array::from_fn(|_| 0.5 + random(0.5)),
            y: std::array::from_fn(|_| 0.5 + random(0.5)),
            pixel: [0; LANES],
            index: [0; LANES],
            live: 0xfff7,
            odd: 0,
        };
        // Edges that pass near the tile's centre, small and large, with and without corners to box.
        let setups: Vec<Setup> = (0..120)
            .map(|i| {
                let slope = if i % 3 == 0 { 1.0 } else { 0.05 };
                let mut function = |size: f32| -> [f32; 9] {
                    std::array::from_fn(|k| random(if k == 0 { size } else { slope * size / 16.0 }))
                };
                let edges = [function(1.0), function(1.0), function(1.0)];
                let facing = function(0.5);
                let corners = (i % 2 == 0).then(|| {
                    std::array::from_fn(|_| {
                        [
                            [random(20.0), random(3.0), random(3.0)],
                            [random(20.0), random(3.0), random(3.0)],
                            [1.5, random(0.1), random(0.1)],
                        ]
                    })
                });
                Setup { triangle: i, edges, facing, corners, plane: [1.0, random(0.5), random(0.5)] }
            })
            .collect();
        let run = |level: Level| {
            let mut seen = Visibility::new();
            seen.clear(1, 1, EVERYWHERE);
            let visits = setups.iter().enumerate().map(|(id, setup)| Visit {
                setup,
                id: id as u32,
                blocks: [0, 31, 0, 31],
                near: (id % 5 == 0).then_some([3.0, 0.01, -0.01]),
                cutout: id % 7 == 0,
            });
            cover(level, &batch, (1, 1), visits, &mut seen, &|visit, block, lanes| {
                lanes & (0x6db6_u32 >> ((visit.id as usize + block) % 3)) as u16
            });
            let mut groups = Vec::new();
            group(level, &batch, &seen, &mut groups);
            let depth: Vec<u32> = seen.depth.iter().flatten().map(|z| z.to_bits()).collect();
            (depth, seen.id, groups)
        };
        let wanted = run(SimdLevel::Scalar.level());
        assert!(wanted.0.iter().filter(|&&bits| bits != 0).count() > 1000, "the test draws next to nothing");
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            assert!(run(level.level()) == wanted, "{} differs from scalar", level.name());
        }
    }

    fn mix(x: u64) -> u64 {
        x.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f)
    }
}
