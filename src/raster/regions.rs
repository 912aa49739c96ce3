//! Coverage and depth of one triangle, 16 lens points at a time, region by region.
//!
//! In: the triangle's functions for the 16 lens points ([`super::kernel`]), and the blocks it may touch. Out: depth and id where
//! it is seen, in [`super::visibility`]. In the block at `x`, `y` a sample meets the triangle where `a`, `b` and `c >= 0`, each
//! `c0 + x cx + y cy`, and sees it where `1/t`, of the same form, is the largest yet. A region of 4 x 4 blocks is passed over
//! where one corner says, for every lens point, that it lies outside an edge or behind what is there. Sums are taken in the same
//! order at corners and inside, so rounding is monotonic and the corner's word is exact.

use super::kernel::{Functions, Hit, Opaque, Visit};
use super::view::Batch;
use super::visibility::{REGION, Visibility};
use super::{LANES, TILE};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};
use std::ops::Range;

/// See [`draw`].
const FEW: usize = 4;

/// A function's largest value in a region is at one corner for each lens point: this far from the left top one.
#[inline(always)]
fn farthest<S: Simd>(simd: S, slope: f32x16<S>, size: f32) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    slope.simd_ge(zero).select(f32x16::splat(simd, size), zero)
}

/// Draws a triangle into the blocks of columns `x0..=x1` and rows `y0..=y1`.
///
/// (Regions that no lens point's range of columns and rows touches are passed over as fast by their edges: nothing gained.)
#[inline(always)]
pub(super) fn draw<S: Simd>(
    simd: S,
    functions: &Functions<S>,
    batch: &Batch,
    blocks: [usize; 4],
    visit: &Visit,
    seen: &mut Visibility,
    opaque: &Opaque<'_>,
) {
    let half = 0.5 * TILE as f32;
    let zero = f32x16::splat(simd, 0.0);
    let Functions { a: [a0, ax, ay], b: [b0, bx, by], c: [c0, cx, cy], z: [z0, zx, zy], live, step } =
        *functions;
    let [x0, x1, y0, y1] = blocks;
    let size = ((REGION - 1) as f32 * step.0, (REGION - 1) as f32 * step.1);
    let (a_right, a_down) = (farthest(simd, ax, size.0), farthest(simd, ay, size.1));
    let (b_right, b_down) = (farthest(simd, bx, size.0), farthest(simd, by, size.1));
    let (c_right, c_down) = (farthest(simd, cx, size.0), farthest(simd, cy, size.1));
    let (z_right, z_down) = (farthest(simd, zx, size.0), farthest(simd, zy, size.1));
    // A few blocks are visited sooner than their regions are looked at.
    let few = (x1 - x0 + 1) * (y1 - y0 + 1) <= FEW;
    let is_plain = !visit.cutout && visit.near.is_none();
    for region_row in y0 / REGION..=y1 / REGION {
        let top = (region_row * REGION) as f32 * step.1 - half;
        let (a_row, b_row) = (a0 + ay * (a_down + top), b0 + by * (b_down + top));
        let (c_row, z_row) = (c0 + cy * (c_down + top), z0 + zy * (z_down + top));
        for region_column in x0 / REGION..=x1 / REGION {
            let left = (region_column * REGION) as f32 * step.0 - half;
            let mut candidates = live;
            if !few {
                candidates = live
                    & (a_row + ax * (a_right + left)).simd_ge(zero)
                    & (b_row + bx * (b_right + left)).simd_ge(zero)
                    & (c_row + cx * (c_right + left)).simd_ge(zero);
                if !candidates.any_true() {
                    continue;
                }
                let nearest = z_row + zx * (z_right + left);
                candidates &= nearest.simd_gt(seen.region_floor(simd, region_column, region_row));
                if !candidates.any_true() {
                    continue;
                }
            }
            let columns = (region_column * REGION).max(x0)..(region_column * REGION + REGION).min(x1 + 1);
            let rows = (region_row * REGION).max(y0)..(region_row * REGION + REGION).min(y1 + 1);
            let drawn = if is_plain {
                plain(simd, functions, candidates, (columns, rows), visit.id, seen)
            } else {
                checked(simd, functions, candidates, (columns, rows), (visit, batch, opaque), seen)
            };
            if drawn {
                seen.touch(region_column, region_row);
            }
        }
    }
}

/// Draws into some blocks of a region; tells whether any sample was hit.
#[inline(always)]
fn plain<S: Simd>(
    simd: S,
    functions: &Functions<S>,
    candidates: mask32x16<S>,
    (columns, rows): (Range<usize>, Range<usize>),
    id: u32,
    seen: &mut Visibility,
) -> bool {
    let id = u32x16::splat(simd, id);
    let mut drawn = false;
    for row in rows {
        let first = row * seen.columns;
        // One check a row instead of one a block.
        let range = first + columns.start..first + columns.end;
        let (Some(depths), Some(ids)) = (seen.depth.get_mut(range.clone()), seen.id.get_mut(range)) else {
            continue;
        };
        let row = Row::new(functions, candidates, (columns.start, row));
        drawn |= match depths.len() {
            1 => row.draw::<1>(simd, depths, ids, id),
            2 => row.draw::<2>(simd, depths, ids, id),
            3 => row.draw::<3>(simd, depths, ids, id),
            _ => row.draw::<REGION>(simd, depths, ids, id),
        };
    }
    drawn
}

/// The same for a triangle that comes near or lets samples through: those that meet it are gathered first, and asked for all at
/// once. (Block by block an answer took 150 ns, most of it before the first sample.)
#[inline(always)]
fn checked<S: Simd>(
    simd: S,
    functions: &Functions<S>,
    candidates: mask32x16<S>,
    (columns, rows): (Range<usize>, Range<usize>),
    (visit, batch, opaque): (&Visit, &Batch, &Opaque<'_>),
    seen: &mut Visibility,
) -> bool {
    let mut hits = [Hit { block: 0, lanes: 0 }; REGION * REGION];
    let mut depths = [[0.0; LANES]; REGION * REGION];
    let mut count = 0;
    for row in rows {
        let along = Row::new(functions, candidates, (columns.start, row));
        for (at, column) in columns.clone().enumerate() {
            let block = row * seen.columns + column;
            let Some(before) = seen.depth.get(block) else { continue };
            let (mut hit, z) = along.hit(simd, at, f32x16::load_array_ref(simd, before));
            if let Some(near) = visit.near {
                let x = f32x16::load_array_ref(simd, &batch.x) + along.x(at);
                let y = f32x16::load_array_ref(simd, &batch.y) + along.y;
                hit &= z.simd_le(x * near[1] + y * near[2] + near[0]);
            }
            let lanes = hit.to_bitmask() as u16;
            hits[count % hits.len()] = Hit { block: block as u16, lanes };
            z.store_array(&mut depths[count % hits.len()]);
            count += usize::from(lanes != 0);
        }
    }
    let hits = &mut hits[..count.min(REGION * REGION)];
    if visit.cutout && !hits.is_empty() {
        opaque(visit, hits);
    }
    let mut drawn = false;
    let id = u32x16::splat(simd, visit.id);
    for (hit, z) in hits.iter().zip(&depths) {
        let at = usize::from(hit.block);
        if let (Some(depth), Some(ids)) = (seen.depth.get_mut(at), seen.id.get_mut(at)) {
            let lanes = mask32x16::from_bitmask(simd, u64::from(hit.lanes));
            let z = f32x16::load_array_ref(simd, z);
            lanes.select(z, f32x16::load_array_ref(simd, depth)).store_array(depth);
            lanes.select(id, u32x16::load_array_ref(simd, ids)).store_array(ids);
            drawn |= hit.lanes != 0;
        }
    }
    drawn
}

/// A triangle's functions along a row of blocks: each the value at `x` = 0 and its change with a pixel to the right.
#[derive(Clone, Copy)]
struct Row<S: Simd> {
    edges: [[f32x16<S>; 2]; 3],
    depth: [f32x16<S>; 2],
    candidates: mask32x16<S>,
    /// The place of the first block, and the width of one.
    first: f32,
    step: f32,
    y: f32,
}

impl<S: Simd> Row<S> {
    #[inline(always)]
    fn new(functions: &Functions<S>, candidates: mask32x16<S>, (column, row): (usize, usize)) -> Self {
        let half = 0.5 * TILE as f32;
        let Functions { a: [a0, ax, ay], b: [b0, bx, by], c: [c0, cx, cy], z: [z0, zx, zy], step, .. } =
            *functions;
        let y = row as f32 * step.1 - half;
        let edges = [[a0 + ay * y, ax], [b0 + by * y, bx], [c0 + cy * y, cx]];
        let first = column as f32 * step.0 - half;
        Self { edges, depth: [z0 + zy * y, zx], candidates, first, step: step.0, y }
    }

    /// Where the block that is `at` blocks from the first lies.
    #[inline(always)]
    fn x(&self, at: usize) -> f32 {
        self.first + at as f32 * self.step
    }

    /// Which samples of that block meet the triangle before what is there, and its `1/t`.
    #[inline(always)]
    fn hit(&self, simd: S, at: usize, before: f32x16<S>) -> (mask32x16<S>, f32x16<S>) {
        let zero = f32x16::splat(simd, 0.0);
        let [[a, ax], [b, bx], [c, cx]] = self.edges;
        let x = self.x(at);
        let z = self.depth[0] + self.depth[1] * x;
        let hit = (a + ax * x).simd_ge(zero)
            & (b + bx * x).simd_ge(zero)
            & (c + cx * x).simd_ge(zero)
            & z.simd_gt(before)
            & self.candidates;
        (hit, z)
    }

    /// Draws into the first `N` blocks of a row; tells whether any sample was hit. One branch a row, and not one a block: which
    /// blocks are hit nothing foresees.
    #[inline(always)]
    fn draw<const N: usize>(
        &self,
        simd: S,
        depths: &mut [[f32; LANES]],
        ids: &mut [[u32; LANES]],
        id: u32x16<S>,
    ) -> bool {
        let (Some(depths), Some(ids)) = (depths.first_chunk_mut::<N>(), ids.first_chunk_mut::<N>()) else {
            return false;
        };
        let mut z = [f32x16::splat(simd, 0.0); N];
        let mut hit = [self.candidates; N];
        let mut any = self.candidates & !self.candidates;
        for at in 0..N {
            (hit[at], z[at]) = self.hit(simd, at, f32x16::load_array_ref(simd, &depths[at]));
            any |= hit[at];
        }
        if !any.any_true() {
            return false;
        }
        for at in 0..N {
            let before = f32x16::load_array_ref(simd, &depths[at]);
            hit[at].select(z[at], before).store_array(&mut depths[at]);
            let old = u32x16::load_array_ref(simd, &ids[at]);
            hit[at].select(id, old).store_array(&mut ids[at]);
        }
        true
    }
}
