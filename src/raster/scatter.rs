//! Coverage and depth of a small triangle, lens point by lens point: a patch of 4 x 4 blocks at a time.
//!
//! In: the triangle's functions for the 16 lens points ([`super::kernel`]), and its corners on the film. Out: depth and id where
//! it is seen, in [`super::visibility`]. A lens point sees a corner at `x = X / W`, each `c_1 + u c_u + v c_v`, so its blocks are
//! columns `(min x - jx + 16) / width` to `(max x - jx + 16) / width`, with a margin, `width` being a block's, and rows likewise.
//! In these `c0 + x cx + y cy` decides, as in [`super::regions`].
//!
//! Out of focus, 16 lens points see a small triangle in 16 places. Drawn block by block all of the blocks
//! between would be visited; drawn lens point by lens point only its own. The sums are the same in the same
//! order, so the bits are those of [`super::regions`].

use super::batch::Batch;
use super::setup::{Image, Images};
use super::visibility::{REGION, Visibility};
use super::visit::Functions;
use super::{LANES, TILE};
use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16, i32x16, mask32x16};

/// The blocks that each of 16 lens points sees a triangle in.
pub(super) struct LaneBoxes {
    x0: [i32; LANES],
    x1: [i32; LANES],
    y0: [i32; LANES],
    y1: [i32; LANES],
    /// All of them: columns and rows, first and last; empty where a last comes before its first.
    pub union: [i32; 4],
    /// Patches that drawing lane by lane would visit.
    pub patches: i32,
    /// The lens points that have any.
    some: u64,
}

/// Lens point by lens point, the first and last column and row of blocks whose sample can lie in a triangle; none where a last
/// comes before its first.
pub(super) struct Ranges<S: Simd> {
    x0: i32x16<S>,
    x1: i32x16<S>,
    y0: i32x16<S>,
    y1: i32x16<S>,
}

/// Those of triangle `t`, within `blocks`; of a quad with its fourth corner.
#[inline(always)]
pub(super) fn ranges<S: Simd>(
    simd: S,
    (corners, fourth): (&Images, Option<&Image>),
    t: usize,
    batch: &Batch,
    block_size: (u32, u32),
    blocks: [i32; 4],
) -> Ranges<S> {
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let one = f32x16::splat(simd, 1.0);
    let i0 = one / linear(&corners[0][2], t, u, v);
    let i1 = one / linear(&corners[1][2], t, u, v);
    let i2 = one / linear(&corners[2][2], t, u, v);
    let p = linear(&corners[0][0], t, u, v) * i0;
    let q = linear(&corners[1][0], t, u, v) * i1;
    let r = linear(&corners[2][0], t, u, v) * i2;
    let (mut left, mut right) = (p.min(q).min(r), p.max(q).max(r));
    let p = linear(&corners[0][1], t, u, v) * i0;
    let q = linear(&corners[1][1], t, u, v) * i1;
    let r = linear(&corners[2][1], t, u, v) * i2;
    let (mut top, mut bottom) = (p.min(q).min(r), p.max(q).max(r));
    if let Some(fourth) = fourth {
        let inverse = one / linear(&fourth[2], t, u, v);
        let (x, y) = (linear(&fourth[0], t, u, v) * inverse, linear(&fourth[1], t, u, v) * inverse);
        (left, right) = (left.min(x), right.max(x));
        (top, bottom) = (top.min(y), bottom.max(y));
    }
    let (x0, x1) = range(simd, [left, right], &batch.x, block_size.0, [blocks[0], blocks[1]]);
    let (y0, y1) = range(simd, [top, bottom], &batch.y, block_size.1, [blocks[2], blocks[3]]);
    Ranges { x0, x1, y0, y1 }
}

impl<S: Simd> Ranges<S> {
    /// The lens points that have any.
    #[inline(always)]
    pub(super) fn some(&self) -> mask32x16<S> {
        self.x0.simd_le(self.x1) & self.y0.simd_le(self.y1)
    }

    /// Those of `some` of the lens points.
    #[inline(always)]
    pub(super) fn boxes(self, simd: S, some: mask32x16<S>) -> LaneBoxes {
        let Self { x0, x1, y0, y1 } = self;
        let (most, least) = (i32x16::splat(simd, i32::MAX), i32x16::splat(simd, i32::MIN));
        let union = [
            some.select(x0, most).reduce_min(),
            some.select(x1, least).reduce_max(),
            some.select(y0, most).reduce_min(),
            some.select(y1, least).reduce_max(),
        ];
        // From first to last, both counted, and rounded up.
        let patch = i32x16::splat(simd, PATCH);
        let patches = ((x1 - x0 + patch) >> 2) * ((y1 - y0 + patch) >> 2);
        let patches = some.select(patches, i32x16::splat(simd, 0)).reduce_sum();
        LaneBoxes {
            x0: x0.to_array(),
            x1: x1.to_array(),
            y0: y0.to_array(),
            y1: y1.to_array(),
            union,
            patches,
            some: some.to_bitmask(),
        }
    }
}

impl LaneBoxes {
    /// Leaves out the lens points from which what is nowhere nearer than `most_inverse` is hidden; tells whether any are left.
    #[inline(always)]
    pub(super) fn sift(&mut self, most_inverse: f32, seen: &Visibility) -> bool {
        let mut rest = self.some;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let region = |block: i32| block as usize / REGION;
            let columns = region(self.x0[lane])..region(self.x1[lane]) + 1;
            let mut rows = region(self.y0[lane])..region(self.y1[lane]) + 1;
            let hides =
                |row: usize| columns.clone().all(|column| seen.hides_in(column, row, lane, most_inverse));
            self.some &= !(u64::from(rows.all(hides)) << lane);
        }
        self.some != 0
    }
}

#[inline(always)]
fn linear<S: Simd>(row: &[[f32; LANES]; 3], t: usize, u: f32x16<S>, v: f32x16<S>) -> f32x16<S> {
    u * row[1][t] + v * row[2][t] + row[0][t]
}

/// The first and last block along one axis, of `step` pixels each, that corners from `least` to `most` span.
#[inline(always)]
fn range<S: Simd>(
    simd: S,
    [least, most]: [f32x16<S>; 2],
    jitter: &[f32; LANES],
    step: u32,
    [low, high]: [i32; 2],
) -> (i32x16<S>, i32x16<S>) {
    let half = 0.5 * TILE as f32;
    let jitter = f32x16::load_array_ref(simd, jitter);
    let to_block = 1.0 / step as f32;
    let (low, high) = (f32x16::splat(simd, low as f32), f32x16::splat(simd, high as f32));
    let first = (least - jitter + (half - MARGIN)) * to_block;
    let last = (most - jitter + (half + MARGIN)) * to_block;
    // One beyond each end, so that an empty range stays empty and conversion to integers stays exact.
    let first = first.ceil().max(low).min(high + 1.0);
    let last = last.floor().min(high).max(low - 1.0);
    (simd.cvt_i32_f32x16(first), simd.cvt_i32_f32x16(last))
}

/// Against rounding of positions and edges, in pixels.
pub(super) const MARGIN: f32 = 4e-3;

/// Draws a triangle, nowhere nearer than `most_inverse`, lens point by lens point. Where it is one of many that are `LOOSE`, large boxes begin at
/// the borders of regions, so that those are passed over that hide it.
#[inline(always)]
pub(super) fn draw<S: Simd, const LOOSE: bool, const QUAD: bool>(
    simd: S,
    functions: &Functions<S>,
    boxes: &LaneBoxes,
    (id, most_inverse): (u32, f32),
    seen: &mut Visibility,
) {
    let half = 0.5 * TILE as f32;
    let zero = f32x16::splat(simd, 0.0);
    let column = f32x16::load_array(simd, COLUMN);
    let row = f32x16::load_array(simd, ROW);
    let step = functions.block_size;
    let [a0, ax, ay] = arrays(functions.a);
    let [b0, bx, by] = arrays(functions.b);
    let [c0, cx, cy] = arrays(functions.c);
    let [d0, dx, dy] = arrays(functions.d);
    let [z0, zx, zy] = arrays(functions.z);
    // By mask: whether the next lens point has blocks nothing foresees.
    let mut rest = functions.live.to_bitmask() & boxes.some;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let (x0, x1, y0, y1) = (boxes.x0[lane], boxes.x1[lane], boxes.y0[lane], boxes.y1[lane]);
        let is_large = LOOSE && (x1 - x0 + PATCH) * (y1 - y0 + PATCH) > LARGE;
        let start = if is_large { !(PATCH - 1) } else { !0 };
        let mut top = y0 & start;
        while top <= y1 {
            let y = (row + top as f32) * step.1 - half;
            let (ra, rb) = (y * ay[lane] + a0[lane], y * by[lane] + b0[lane]);
            let (rc, rz) = (y * cy[lane] + c0[lane], y * zy[lane] + z0[lane]);
            let rd = y * dy[lane] + d0[lane];
            let rows = ((1 << (PATCH * (y1 - top + 1).min(PATCH))) - 1) & (!0 << (PATCH * (y0 - top).max(0)));
            let mut left = x0 & start;
            while left <= x1 {
                if is_large
                    && seen.hides_in(left as usize / REGION, top as usize / REGION, lane, most_inverse)
                {
                    left += PATCH;
                    continue;
                }
                let x = (column + left as f32) * step.0 - half;
                let mut hit = (x * ax[lane] + ra).simd_ge(zero)
                    & (x * bx[lane] + rb).simd_ge(zero)
                    & (x * cx[lane] + rc).simd_ge(zero);
                if QUAD {
                    hit &= (x * dx[lane] + rd).simd_ge(zero);
                }
                let first = 15 & (15 << (x0 - left).max(0));
                let columns = 0x1111 * (((1 << (x1 - left + 1).min(PATCH)) - 1) & first);
                let mut bits = hit.to_bitmask() & rows & columns;
                if bits != 0 {
                    let z = (x * zx[lane] + rz).to_array();
                    while bits != 0 {
                        let bit = bits.trailing_zeros() as usize % LANES;
                        bits &= bits - 1;
                        let (column, row) = (left as usize + bit % 4, top as usize + bit / 4);
                        let at = row * seen.columns + column;
                        if let (Some(depth), Some(ids)) =
                            (seen.inverse_depth.get_mut(at), seen.id.get_mut(at))
                            && z[bit] > depth[lane]
                        {
                            depth[lane] = z[bit];
                            ids[lane] = id;
                            seen.touch(column / REGION, row / REGION);
                        }
                    }
                }
                left += PATCH;
            }
            top += PATCH;
        }
    }
}

/// Some four patches.
const LARGE: i32 = 4 * PATCH * PATCH;

/// Blocks on the side of a patch, and which of it each lane is.
const PATCH: i32 = REGION as i32;
const COLUMN: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
const ROW: [f32; LANES] = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0];

#[inline(always)]
fn arrays<S: Simd>([c, x, y]: [f32x16<S>; 3]) -> [[f32; LANES]; 3] {
    [c.to_array(), x.to_array(), y.to_array()]
}
