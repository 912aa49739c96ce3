//! Coverage and depth of one triangle, 16 lens points at a time, region by region.
//!
//! In: the triangle's functions for the 16 lens points ([`super::kernel`]), and the blocks it may touch. Out: depth and id where
//! it is seen, in [`super::visibility`]. In the block at `x`, `y` a sample meets the triangle where `a`, `b` and `c >= 0` (of a quad
//! `d` too), each `c0 + x cx + y cy`, and sees it where `1/t`, of the same form, is the largest yet. A region of 4 x 4 blocks is passed over
//! where one corner says, for every lens point, that it lies outside an edge or behind what is there. Sums are taken in the same
//! order at corners and inside, so rounding is monotonic and the corner's word is exact.

use super::batch::Batch;
use super::visibility::{REGION, Visibility};
use super::visit::{AlphaTest, Functions, Hit, Visit};
use super::{LANES, TILE};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};
use std::ops::Range;

/// So many blocks are visited sooner than their regions are looked at, which takes some three hundred instructions before the first.
const WITHOUT_REGIONS: i32 = 9;

/// Blocks on the side of a region. (With a sign: numbers without one take a branch to become floats.)
const SIDE: i32 = REGION as i32;

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
pub(super) fn draw<S: Simd, const QUAD: bool>(
    simd: S,
    functions: &Functions<S>,
    batch: &Batch,
    blocks: [i32; 4],
    visit: &Visit,
    seen: &mut Visibility,
    alpha_test: &AlphaTest<'_>,
) {
    let half = 0.5 * TILE as f32;
    let zero = f32x16::splat(simd, 0.0);
    let Functions {
        a: [a0, ax, ay], b: [b0, bx, by], c: [c0, cx, cy], d: [d0, dx, dy], z: [z0, zx, zy], ..
    } = *functions;
    let Functions { live, block_size: step, .. } = *functions;
    let [x0, x1, y0, y1] = blocks;
    let is_plain = QUAD || !visit.cutout && visit.near_inverse.is_none();
    let is_few = is_plain && x1 - x0 < SIDE && (x1 - x0 + 1) * (y1 - y0 + 1) <= WITHOUT_REGIONS;
    // (Of a quad each region by itself: the loops once less, which are compiled for every level, a twentieth of the library's build, and
    // no slower. Of triangles too: coverage 10 to 40 % slower.)
    if !QUAD && is_few {
        if plain::<_, QUAD>(simd, functions, live, (x0..x1 + 1, y0..y1 + 1), visit.id, seen) {
            for row in y0 / SIDE..y1 / SIDE + 1 {
                for column in x0 / SIDE..x1 / SIDE + 1 {
                    seen.touch(column as usize, row as usize);
                }
            }
        }
        return;
    }
    let size = ((SIDE - 1) as f32 * step.0, (SIDE - 1) as f32 * step.1);
    let (a_right, a_down) = (farthest(simd, ax, size.0), farthest(simd, ay, size.1));
    let (b_right, b_down) = (farthest(simd, bx, size.0), farthest(simd, by, size.1));
    let (c_right, c_down) = (farthest(simd, cx, size.0), farthest(simd, cy, size.1));
    let (d_right, d_down) = (farthest(simd, dx, size.0), farthest(simd, dy, size.1));
    let (z_right, z_down) = (farthest(simd, zx, size.0), farthest(simd, zy, size.1));
    for region_row in y0 / SIDE..y1 / SIDE + 1 {
        let top = (region_row * SIDE) as f32 * step.1 - half;
        let (a_row, b_row) = (a0 + ay * (a_down + top), b0 + by * (b_down + top));
        let (c_row, z_row) = (c0 + cy * (c_down + top), z0 + zy * (z_down + top));
        let d_row = d0 + dy * (d_down + top);
        for region_column in x0 / SIDE..x1 / SIDE + 1 {
            let (column, row) = (region_column as usize, region_row as usize);
            let left = (region_column * SIDE) as f32 * step.0 - half;
            let mut candidates = live;
            if !(QUAD && is_few) {
                candidates &= (a_row + ax * (a_right + left)).simd_ge(zero)
                    & (b_row + bx * (b_right + left)).simd_ge(zero)
                    & (c_row + cx * (c_right + left)).simd_ge(zero);
                if QUAD {
                    candidates &= (d_row + dx * (d_right + left)).simd_ge(zero);
                }
                if !candidates.any_true() {
                    continue;
                }
                let most_inverse = z_row + zx * (z_right + left);
                candidates &= most_inverse.simd_gt(seen.region_floor(simd, column, row));
                if !candidates.any_true() {
                    continue;
                }
            }
            let columns = (region_column * SIDE).max(x0)..(region_column * SIDE + SIDE).min(x1 + 1);
            let rows = (region_row * SIDE).max(y0)..(region_row * SIDE + SIDE).min(y1 + 1);
            let drawn = if is_plain {
                plain::<_, QUAD>(simd, functions, candidates, (columns, rows), visit.id, seen)
            } else {
                checked(simd, functions, candidates, (columns, rows), (visit, batch, alpha_test), seen)
            };
            if drawn {
                seen.touch(column, row);
            }
        }
    }
}

/// Draws into some blocks of a region; tells whether any sample was hit.
#[inline(always)]
fn plain<S: Simd, const QUAD: bool>(
    simd: S,
    functions: &Functions<S>,
    candidates: mask32x16<S>,
    (columns, rows): (Range<i32>, Range<i32>),
    id: u32,
    seen: &mut Visibility,
) -> bool {
    // A loop of its own for each width: what depends on the column alone is made once.
    match columns.end - columns.start {
        1 => plain_rows::<S, QUAD, 1>(simd, functions, candidates, (columns.start, rows), id, seen),
        2 => plain_rows::<S, QUAD, 2>(simd, functions, candidates, (columns.start, rows), id, seen),
        3 => plain_rows::<S, QUAD, 3>(simd, functions, candidates, (columns.start, rows), id, seen),
        _ => plain_rows::<S, QUAD, REGION>(simd, functions, candidates, (columns.start, rows), id, seen),
    }
}

/// The same in `N` columns.
#[inline(always)]
fn plain_rows<S: Simd, const QUAD: bool, const N: usize>(
    simd: S,
    functions: &Functions<S>,
    candidates: mask32x16<S>,
    (column, rows): (i32, Range<i32>),
    id: u32,
    seen: &mut Visibility,
) -> bool {
    let id = u32x16::splat(simd, id);
    let mut drawn = false;
    for row in rows {
        let first = row as usize * seen.columns + column as usize;
        // One check a row instead of one a block.
        if let Some(depths) =
            seen.inverse_depth.get_mut(first..first + N).and_then(|row| row.first_chunk_mut())
            && let Some(ids) = seen.id.get_mut(first..first + N).and_then(|row| row.first_chunk_mut())
        {
            let row = Row::<S, QUAD>::new(simd, functions, candidates, (column, row));
            drawn |= row.draw::<N>(simd, depths, ids, id);
        }
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
    (columns, rows): (Range<i32>, Range<i32>),
    (visit, batch, alpha_test): (&Visit, &Batch, &AlphaTest<'_>),
    seen: &mut Visibility,
) -> bool {
    let mut hits = [Hit { block: 0, lanes: 0 }; REGION * REGION];
    let mut count = 0;
    for row in rows {
        let along = Row::<S, false>::new(simd, functions, candidates, (columns.start, row));
        for (at, column) in columns.clone().enumerate() {
            let block = row as usize * seen.columns + column as usize;
            let Some(before) = seen.inverse_depth.get(block) else { continue };
            let (mut hit, z) = along.hit(simd, at, f32x16::load_array_ref(simd, before));
            if let Some(near) = visit.near_inverse {
                let x = f32x16::load_array_ref(simd, &batch.x) + along.x(at);
                let y = f32x16::load_array_ref(simd, &batch.y) + along.y;
                hit &= z.simd_le(x * near[1] + y * near[2] + near[0]);
            }
            let lanes = hit.to_bitmask() as u16;
            hits[count % hits.len()] = Hit { block: block as u16, lanes };
            z.store_array(&mut seen.asked[count % hits.len()]);
            count += usize::from(lanes != 0);
        }
    }
    let hits = &mut hits[..count.min(REGION * REGION)];
    if visit.cutout && !hits.is_empty() {
        alpha_test(visit, hits);
    }
    let mut drawn = false;
    let id = u32x16::splat(simd, visit.id);
    for (hit, z) in hits.iter().zip(&seen.asked) {
        let at = usize::from(hit.block);
        if let (Some(depth), Some(ids)) = (seen.inverse_depth.get_mut(at), seen.id.get_mut(at)) {
            let lanes = mask32x16::from_bitmask(simd, u64::from(hit.lanes));
            write(simd, lanes, f32x16::load_array_ref(simd, z), id, (depth, ids));
            drawn |= hit.lanes != 0;
        }
    }
    drawn
}

/// Writes depth and id where a block's samples are hit, and `z` is larger than what is there.
///
/// No choice between `z` and what is there: that becomes a store by mask, which on some processors takes a dozen cycles, and the
/// next triangle has to wait for.
#[inline(always)]
fn write<S: Simd>(
    simd: S,
    hit: mask32x16<S>,
    z: f32x16<S>,
    id: u32x16<S>,
    (depth, ids): (&mut [f32; LANES], &mut [u32; LANES]),
) {
    let nearer = hit.select(z, f32x16::splat(simd, 0.0));
    nearer.max(f32x16::load_array_ref(simd, depth)).store_array(depth);
    hit.select(id, u32x16::load_array_ref(simd, ids)).store_array(ids);
}

/// A triangle's functions along a row of blocks: each the value at `x` = 0 and its change with a pixel to the right.
#[derive(Clone, Copy)]
struct Row<S: Simd, const QUAD: bool> {
    edges: [[f32x16<S>; 2]; 4],
    inverse: [f32x16<S>; 2],
    /// The place of the first block, and the width of one.
    first: f32,
    step: f32,
    y: f32,
}

impl<S: Simd, const QUAD: bool> Row<S, QUAD> {
    #[inline(always)]
    fn new(simd: S, functions: &Functions<S>, candidates: mask32x16<S>, (column, row): (i32, i32)) -> Self {
        let half = 0.5 * TILE as f32;
        let Functions { a: [a0, ax, ay], b: [b0, bx, by], c: [c0, cx, cy], d: [d0, dx, dy], .. } = *functions;
        let Functions { z: [z0, zx, zy], block_size: step, .. } = *functions;
        let y = row as f32 * step.1 - half;
        let edges = [[a0 + ay * y, ax], [b0 + by * y, bx], [c0 + cy * y, cx], [d0 + dy * y, dx]];
        let first = column as f32 * step.0 - half;
        // NaN is not nearer than anything.
        let z0 = candidates.select(z0, f32x16::splat(simd, f32::NAN));
        Self { edges, inverse: [z0 + zy * y, zx], first, step: step.0, y }
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
        let [[a, ax], [b, bx], [c, cx], [d, dx]] = self.edges;
        let x = self.x(at);
        let z = self.inverse[0] + self.inverse[1] * x;
        let mut hit = (a + ax * x).simd_ge(zero)
            & (b + bx * x).simd_ge(zero)
            & (c + cx * x).simd_ge(zero)
            & z.simd_gt(before);
        if QUAD {
            hit &= (d + dx * x).simd_ge(zero);
        }
        (hit, z)
    }

    /// Draws into a row of blocks; tells whether any sample was hit. One branch a row, and not one a block: which blocks are hit
    /// nothing foresees.
    #[inline(always)]
    fn draw<const N: usize>(
        &self,
        simd: S,
        depths: &mut [[f32; LANES]; N],
        ids: &mut [[u32; LANES]; N],
        id: u32x16<S>,
    ) -> bool {
        let none = mask32x16::splat(simd, false);
        let (mut hit, mut z) = ([none; N], [f32x16::splat(simd, 0.0); N]);
        let mut any = none;
        for at in 0..N {
            (hit[at], z[at]) = self.hit(simd, at, f32x16::load_array_ref(simd, &depths[at]));
            any |= hit[at];
        }
        if !any.any_true() {
            return false;
        }
        for at in 0..N {
            write(simd, hit[at], z[at], id, (&mut depths[at], &mut ids[at]));
        }
        true
    }
}
