//! Coverage and depth of one triangle, 16 lens points at a time, region by region.
//!
//! In: the triangle's edge functions for the 16 lens points, and the blocks it may touch. Out: depth and id
//! where it is seen. A region of 4 x 4 blocks is passed over where one corner already says, for every lens
//! point, that it lies outside an edge or behind what is there. Sums are taken in the same order at corners
//! and inside, so rounding is monotonic and the corner's word is exact.

use super::kernel::{Functions, Opaque, Visit};
use super::view::Batch;
use super::visibility::{REGION, Visibility};
use super::{LANES, TILE};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};

/// See [`draw`].
const FEW: usize = 4;

/// A function's largest value in a region is at one corner for each lens point: this far from the left top one.
#[inline(always)]
fn farthest<S: Simd>(simd: S, slope: f32x16<S>, size: f32) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    slope.simd_ge(zero).select(f32x16::splat(simd, size), zero)
}

/// Draws a triangle into the blocks of columns `x0..=x1` and rows `y0..=y1`.
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
    let id = u32x16::splat(simd, visit.id);
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
            let mut drawn = false;
            let columns = (region_column * REGION).max(x0)..=(region_column * REGION + REGION - 1).min(x1);
            for row in (region_row * REGION).max(y0)..=(region_row * REGION + REGION - 1).min(y1) {
                let y = row as f32 * step.1 - half;
                let (ra, rb, rc, rz) = (a0 + ay * y, b0 + by * y, c0 + cy * y, z0 + zy * y);
                let first = row * seen.columns;
                // One check a row instead of one a block.
                let range = first + columns.start()..=first + columns.end();
                let (Some(depths), Some(ids)) = (seen.depth.get_mut(range.clone()), seen.id.get_mut(range))
                else {
                    continue;
                };
                if is_plain {
                    let x = *columns.start() as f32 * step.0 - half;
                    let edges = [[ra, ax], [rb, bx], [rc, cx]];
                    let row = Row { edges, depth: [rz, zx], candidates, id, x, step: step.0 };
                    drawn |= match depths.len() {
                        1 => row.draw::<1>(simd, depths, ids),
                        2 => row.draw::<2>(simd, depths, ids),
                        3 => row.draw::<3>(simd, depths, ids),
                        _ => row.draw::<REGION>(simd, depths, ids),
                    };
                    continue;
                }
                for (column, (depth, ids)) in depths.iter_mut().zip(ids).enumerate() {
                    let column = columns.start() + column;
                    let x = column as f32 * step.0 - half;
                    let z = rz + zx * x;
                    let before = f32x16::load_array_ref(simd, depth);
                    let mut hit = (ra + ax * x).simd_ge(zero)
                        & (rb + bx * x).simd_ge(zero)
                        & (rc + cx * x).simd_ge(zero)
                        & z.simd_gt(before)
                        & candidates;
                    if let Some(near) = visit.near {
                        let jx = f32x16::load_array_ref(simd, &batch.x);
                        let jy = f32x16::load_array_ref(simd, &batch.y);
                        let limit = (jx + x) * near[1] + (jy + y) * near[2] + near[0];
                        hit &= z.simd_le(limit);
                    }
                    if !hit.any_true() {
                        continue;
                    }
                    if visit.cutout {
                        let bits = opaque(visit, first + column, hit.to_bitmask() as u16);
                        hit = mask32x16::from_bitmask(simd, u64::from(bits));
                    }
                    drawn = true;
                    hit.select(z, before).store_array(depth);
                    let old = u32x16::load_array_ref(simd, ids);
                    hit.select(id, old).store_array(ids);
                }
            }
            if drawn {
                seen.touch(region_column, region_row);
            }
        }
    }
}

/// A triangle's functions along a row of blocks: each the value at `x` = 0 and its change with a pixel to the right.
#[derive(Clone, Copy)]
struct Row<S: Simd> {
    edges: [[f32x16<S>; 2]; 3],
    depth: [f32x16<S>; 2],
    candidates: mask32x16<S>,
    id: u32x16<S>,
    /// The place of the first block, and the width of one.
    x: f32,
    step: f32,
}

impl<S: Simd> Row<S> {
    /// Draws into the first `N` blocks of a row; tells whether any sample was hit. One branch a row, and not one a block: which
    /// blocks are hit nothing foresees.
    #[inline(always)]
    fn draw<const N: usize>(&self, simd: S, depths: &mut [[f32; LANES]], ids: &mut [[u32; LANES]]) -> bool {
        let (Some(depths), Some(ids)) = (depths.first_chunk_mut::<N>(), ids.first_chunk_mut::<N>()) else {
            return false;
        };
        let zero = f32x16::splat(simd, 0.0);
        let [[a, ax], [b, bx], [c, cx]] = self.edges;
        let [z0, zx] = self.depth;
        let mut z = [zero; N];
        let mut hit = [self.candidates; N];
        let mut any = self.candidates & !self.candidates;
        for at in 0..N {
            let x = self.x + at as f32 * self.step;
            z[at] = z0 + zx * x;
            hit[at] = (a + ax * x).simd_ge(zero)
                & (b + bx * x).simd_ge(zero)
                & (c + cx * x).simd_ge(zero)
                & z[at].simd_gt(f32x16::load_array_ref(simd, &depths[at]))
                & self.candidates;
            any |= hit[at];
        }
        if !any.any_true() {
            return false;
        }
        for at in 0..N {
            let before = f32x16::load_array_ref(simd, &depths[at]);
            hit[at].select(z[at], before).store_array(&mut depths[at]);
            let old = u32x16::load_array_ref(simd, &ids[at]);
            hit[at].select(self.id, old).store_array(&mut ids[at]);
        }
        true
    }
}
