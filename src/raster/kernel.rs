//! The inner loop: coverage and depth of one triangle for 16 samples at each block of a tile.
//!
//! One generic source for every SIMD level. Multiply and add stay apart: a fused product rounds
//! differently, and the same bytes are wanted at every level.

use super::setup::Setup;
use super::view::Batch;
use super::{LANES, TILE};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, dispatch, f32x16, u32x16};

/// A triangle of the tile with the blocks to visit: columns `x0..=x1`, rows `y0..=y1`.
pub(crate) struct Visit<'a> {
    pub setup: &'a Setup,
    /// What is written where the triangle is seen.
    pub id: u32,
    pub blocks: [u8; 4],
    /// It may come nearer than the near plane, whose `1/t` is then checked at each sample.
    pub near: Option<[f32; 3]>,
    /// Samples that meet it may pass through.
    pub cutout: bool,
}

/// Depth and id of 16 samples at each block of a tile.
pub(crate) struct Visibility {
    /// `1/t`, 0 where nothing is seen.
    pub depth: Vec<[f32; LANES]>,
    /// The `id` of the visit that is seen; meaningless where nothing is.
    pub id: Vec<[u32; LANES]>,
    columns: usize,
}

impl Visibility {
    pub(crate) fn new() -> Self {
        Self { depth: Vec::new(), id: Vec::new(), columns: 0 }
    }

    /// Empties it for blocks of the given size.
    pub(crate) fn clear(&mut self, block_width: u32, block_height: u32) {
        self.columns = (TILE / block_width) as usize;
        let blocks = self.columns * (TILE / block_height) as usize;
        self.depth.clear();
        self.depth.resize(blocks, [0.0; LANES]);
        self.id.resize(blocks, [0; LANES]);
    }
}

/// Whether lane `lane` at block `block` meets a surface that may let it through.
pub(crate) type Opaque<'a> = dyn Fn(&Setup, usize, usize) -> bool + 'a;

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
        dispatch!(level, simd => cover_one(simd, batch, block, &visit, seen, opaque));
    }
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
    let load = |lanes: &[f32; LANES]| f32x16::load_array_ref(simd, lanes);
    let (u, v, jx, jy) = (load(&batch.u), load(&batch.v), load(&batch.x), load(&batch.y));
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, 1.0);

    let plane = visit.setup.plane;
    let distance = u * plane[1] + v * plane[2] + plane[0];
    // Edge-on for this lens point: no sample of the lane can meet it.
    let live = fearless_simd::mask32x16::from_bitmask(simd, u64::from(batch.live)) & distance.simd_ne(zero);
    let side = live.select(distance.copysign_one(one), zero);

    // Each function at the block grid's origin, and its change with x and y, for the 16 lens points.
    let lanes = |e: &[f32; 9]| {
        let c = u * e[1] + v * e[2] + e[0];
        let cx = u * e[4] + v * e[5] + e[3];
        let cy = u * e[7] + v * e[8] + e[6];
        (c + cx * jx + cy * jy, cx, cy)
    };
    let edge = |e: &[f32; 9]| {
        let (c, cx, cy) = lanes(e);
        (c * side, cx * side, cy * side)
    };
    let (a0, ax, ay) = edge(&visit.setup.edges[0]);
    let (b0, bx, by) = edge(&visit.setup.edges[1]);
    let (c0, cx, cy) = edge(&visit.setup.edges[2]);
    let (z0, zx, zy) = lanes(&visit.setup.facing);
    let inverse = one / distance;
    let (z0, zx, zy) = (z0 * inverse, zx * inverse, zy * inverse);

    let half = 0.5 * TILE as f32;
    let id = u32x16::splat(simd, visit.id);
    let [x0, x1, y0, y1] = visit.blocks.map(usize::from);
    for row in y0..=y1 {
        let y = (row as u32 * block.1) as f32 - half;
        let (ra, rb, rc, rz) = (a0 + ay * y, b0 + by * y, c0 + cy * y, z0 + zy * y);
        let first = row * seen.columns;
        for column in x0..=x1 {
            let x = (column as u32 * block.0) as f32 - half;
            let z = rz + zx * x;
            let at = first + column;
            let (Some(depth), Some(ids)) = (seen.depth.get_mut(at), seen.id.get_mut(at)) else { continue };
            let before = f32x16::load_array_ref(simd, depth);
            let mut hit = (ra + ax * x).simd_ge(zero)
                & (rb + bx * x).simd_ge(zero)
                & (rc + cx * x).simd_ge(zero)
                & z.simd_gt(before)
                & live;
            if let Some(near) = visit.near {
                let limit = (jx + x) * near[1] + (jy + y) * near[2] + near[0];
                hit &= z.simd_le(limit);
            }
            if !hit.any_true() {
                continue;
            }
            if visit.cutout {
                let mut bits = hit.to_bitmask();
                for lane in 0..LANES {
                    if bits >> lane & 1 == 1 && !opaque(visit.setup, at, lane) {
                        bits &= !(1 << lane);
                    }
                }
                hit = fearless_simd::mask32x16::from_bitmask(simd, bits);
            }
            hit.select(z, before).store_array(depth);
            let old = u32x16::load_array_ref(simd, ids);
            hit.select(id, old).store_array(ids);
        }
    }
}

trait CopySign {
    fn copysign_one(self, one: Self) -> Self;
}

impl<S: Simd> CopySign for f32x16<S> {
    /// 1 with the sign of `self`.
    #[inline(always)]
    fn copysign_one(self, one: Self) -> Self {
        use fearless_simd::SimdFloat;
        one.copysign(self)
    }
}
