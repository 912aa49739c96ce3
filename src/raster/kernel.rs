//! The inner loop: coverage and depth of one triangle for 16 samples at each block of a tile.
//!
//! One generic source for every SIMD level. Multiply and add stay apart: a fused product rounds
//! differently, and the same bytes are wanted at every level.

use super::setup::Setup;
use super::view::Batch;
use super::{LANES, TILE};
use fearless_simd::{
    Level, Select, Simd, SimdBase, SimdFloat, SimdMask, dispatch, f32x16, mask32x16, u32x16,
};

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
    /// The `id` of the visit that is seen, [`NOTHING`] where none is.
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
        self.id.clear();
        self.id.resize(blocks, [NOTHING; LANES]);
    }
}

/// Whether lane `lane` at block `block` meets the surface of a visit that may let it through.
pub(crate) type Opaque<'a> = dyn Fn(&Visit<'_>, usize, usize) -> bool + 'a;

/// The id where nothing is seen.
pub(crate) const NOTHING: u32 = u32::MAX;

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

/// A bilinear function for the 16 lens points: its value at the block grid's origin, and its change with
/// `x` and `y`. A function and not a closure: closures do not inline into a SIMD context.
#[inline(always)]
fn at_lens<S: Simd>(
    e: &[f32; 9],
    u: f32x16<S>,
    v: f32x16<S>,
    jx: f32x16<S>,
    jy: f32x16<S>,
) -> [f32x16<S>; 3] {
    let c = u * e[1] + v * e[2] + e[0];
    let cx = u * e[4] + v * e[5] + e[3];
    let cy = u * e[7] + v * e[8] + e[6];
    [c + cx * jx + cy * jy, cx, cy]
}

#[inline(always)]
fn times<S: Simd>(e: [f32x16<S>; 3], factor: f32x16<S>) -> [f32x16<S>; 3] {
    [e[0] * factor, e[1] * factor, e[2] * factor]
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
    let jx = f32x16::load_array_ref(simd, &batch.x);
    let jy = f32x16::load_array_ref(simd, &batch.y);
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, 1.0);

    let plane = visit.setup.plane;
    let distance = u * plane[1] + v * plane[2] + plane[0];
    // Edge-on for this lens point: no sample of the lane can meet it.
    let live = mask32x16::from_bitmask(simd, u64::from(batch.live)) & distance.simd_ne(zero);
    let side = live.select(one.copysign(distance), zero);

    let edges = &visit.setup.edges;
    let [a0, ax, ay] = times(at_lens(&edges[0], u, v, jx, jy), side);
    let [b0, bx, by] = times(at_lens(&edges[1], u, v, jx, jy), side);
    let [c0, cx, cy] = times(at_lens(&edges[2], u, v, jx, jy), side);
    let [z0, zx, zy] = times(at_lens(&visit.setup.facing, u, v, jx, jy), one / distance);

    let mut blocks = visit.blocks.map(i32::from);
    if let Some(corners) = &visit.setup.corners {
        // Where each lens point sees the triangle: tighter than any box that was made beforehand.
        let boxes = lane_boxes(simd, corners, batch, block, blocks);
        let [x0, x1, y0, y1] = boxes.union;
        if x0 > x1 || y0 > y1 {
            return;
        }
        blocks = boxes.union;
        // Small triangles far apart for different lens points: one lens point and 16 blocks at a time.
        if !visit.cutout && visit.near.is_none() && 2 * boxes.row_visits < (x1 - x0 + 1) * (y1 - y0 + 1) {
            let live = live.to_bitmask();
            let functions = [a0, ax, ay, b0, bx, by, c0, cx, cy, z0, zx, zy].map(|f| f.to_array());
            return scatter(simd, &functions, &boxes, live as u16, block, visit.id, seen);
        }
    }

    let half = 0.5 * TILE as f32;
    let id = u32x16::splat(simd, visit.id);
    let [x0, x1, y0, y1] = blocks.map(|b| b as usize);
    let (step_x, step_y) = (block.0 as f32, block.1 as f32);
    for row in y0..=y1 {
        let y = row as f32 * step_y - half;
        let (ra, rb, rc, rz) = (a0 + ay * y, b0 + by * y, c0 + cy * y, z0 + zy * y);
        let first = row * seen.columns;
        // One check a row instead of one a block.
        let (Some(depths), Some(ids)) =
            (seen.depth.get_mut(first + x0..=first + x1), seen.id.get_mut(first + x0..=first + x1))
        else {
            continue;
        };
        for (column, (depth, ids)) in depths.iter_mut().zip(ids).enumerate() {
            let x = (x0 + column) as f32 * step_x - half;
            let z = rz + zx * x;
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
                    if bits >> lane & 1 == 1 && !opaque(visit, first + x0 + column, lane) {
                        bits &= !(1 << lane);
                    }
                }
                hit = mask32x16::from_bitmask(simd, bits);
            }
            hit.select(z, before).store_array(depth);
            let old = u32x16::load_array_ref(simd, ids);
            hit.select(id, old).store_array(ids);
        }
    }
}

/// The blocks that each of 16 lens points sees a triangle in.
struct LaneBoxes {
    x0: [i32; LANES],
    x1: [i32; LANES],
    y0: [i32; LANES],
    y1: [i32; LANES],
    union: [i32; 4],
    /// Rows of 16 blocks that drawing lane by lane would visit.
    row_visits: i32,
}

/// Lane by lane, the first and last block whose sample can lie in the triangle, within `blocks`.
#[inline(always)]
fn lane_boxes<S: Simd>(
    simd: S,
    corners: &[[[f32; 3]; 3]; 3],
    batch: &Batch,
    block: (u32, u32),
    blocks: [i32; 4],
) -> LaneBoxes {
    /// Against rounding of positions and edges, in pixels.
    const MARGIN: f32 = 4e-3;
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let at = |row: &[f32; 3]| u * row[1] + v * row[2] + row[0];
    let one = f32x16::splat(simd, 1.0);
    let [i0, i1, i2] = [one / at(&corners[0][2]), one / at(&corners[1][2]), one / at(&corners[2][2])];
    let half = 0.5 * TILE as f32;
    let bounds = |axis: usize, jitter: &[f32; LANES], step: u32, low: i32, high: i32| {
        let [p, q, r] = [at(&corners[0][axis]) * i0, at(&corners[1][axis]) * i1, at(&corners[2][axis]) * i2];
        let jitter = f32x16::load_array_ref(simd, jitter);
        let to_block = 1.0 / step as f32;
        let (low, high) = (f32x16::splat(simd, low as f32), f32x16::splat(simd, high as f32));
        let first = (p.min(q).min(r) - jitter + (half - MARGIN)) * to_block;
        let last = (p.max(q).max(r) - jitter + (half + MARGIN)) * to_block;
        // One beyond each end, so that an empty range stays empty and conversion to integers stays exact.
        let first = first.ceil().max(low).min(high + 1.0);
        let last = last.floor().min(high).max(low - 1.0);
        (simd.cvt_i32_f32x16(first).to_array(), simd.cvt_i32_f32x16(last).to_array())
    };
    let (x0, x1) = bounds(0, &batch.x, block.0, blocks[0], blocks[1]);
    let (y0, y1) = bounds(1, &batch.y, block.1, blocks[2], blocks[3]);
    let mut union = [i32::MAX, i32::MIN, i32::MAX, i32::MIN];
    let mut row_visits = 0;
    for lane in 0..LANES {
        let (w, h) = (x1[lane] - x0[lane] + 1, y1[lane] - y0[lane] + 1);
        if w > 0 && h > 0 {
            union[0] = union[0].min(x0[lane]);
            union[1] = union[1].max(x1[lane]);
            union[2] = union[2].min(y0[lane]);
            union[3] = union[3].max(y1[lane]);
            row_visits += if w > LANES as i32 { 2 * h } else { h };
        }
    }
    LaneBoxes { x0, x1, y0, y1, union, row_visits }
}

/// Draws a triangle lens point by lens point, 16 blocks of a row at a time. The same sums in the same order
/// as block by block, so the same bits.
#[inline(always)]
fn scatter<S: Simd>(
    simd: S,
    functions: &[[f32; LANES]; 12],
    boxes: &LaneBoxes,
    live: u16,
    block: (u32, u32),
    id: u32,
    seen: &mut Visibility,
) {
    let half = 0.5 * TILE as f32;
    let (step_x, step_y) = (block.0 as f32, block.1 as f32);
    let zero = f32x16::splat(simd, 0.0);
    let count = f32x16::load_array(simd, std::array::from_fn(|i| i as f32));
    for lane in 0..LANES {
        let (x0, x1) = (boxes.x0[lane], boxes.x1[lane]);
        if live >> lane & 1 == 0 || x0 > x1 {
            continue;
        }
        let [a0, ax, ay, b0, bx, by, c0, cx, cy, z0, zx, zy] = functions.each_ref().map(|f| f[lane]);
        for row in boxes.y0[lane]..=boxes.y1[lane] {
            let y = row as f32 * step_y - half;
            let (ra, rb, rc, rz) = (a0 + ay * y, b0 + by * y, c0 + cy * y, z0 + zy * y);
            let first = row as usize * seen.columns;
            let mut start = x0;
            while start <= x1 {
                let x = (count + start as f32) * step_x - half;
                let hit =
                    (x * ax + ra).simd_ge(zero) & (x * bx + rb).simd_ge(zero) & (x * cx + rc).simd_ge(zero);
                let wanted = (x1 - start + 1).min(LANES as i32);
                let mut bits = hit.to_bitmask() & ((1 << wanted) - 1);
                if bits != 0 {
                    let z = (x * zx + rz).to_array();
                    while bits != 0 {
                        let column = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        let at = first + start as usize + column;
                        if let (Some(depth), Some(ids)) = (seen.depth.get_mut(at), seen.id.get_mut(at))
                            && z[column % LANES] > depth[lane]
                        {
                            depth[lane] = z[column % LANES];
                            ids[lane] = id;
                        }
                    }
                }
                start += LANES as i32;
            }
        }
    }
}

/// Samples of one block that see the same: lanes of a batch, lane 0 in the lowest bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Group {
    pub block: u16,
    pub lanes: u16,
    /// What they see, or [`NOTHING`].
    pub id: u32,
}

/// Sorts the samples of a batch into groups, block by block.
pub(crate) fn group(level: Level, batch: &Batch, seen: &Visibility, out: &mut Vec<Group>) {
    out.clear();
    dispatch!(level, simd => group_all(simd, batch, seen, out));
}

#[inline(always)]
fn group_all<S: Simd>(simd: S, batch: &Batch, seen: &Visibility, out: &mut Vec<Group>) {
    for (block, ids) in seen.id.iter().enumerate() {
        let all = u32x16::load_array_ref(simd, ids);
        let mut rest = batch.live;
        while rest != 0 {
            let id = ids[rest.trailing_zeros() as usize % LANES];
            let same = all.simd_eq(u32x16::splat(simd, id)).to_bitmask() as u16 & rest;
            out.push(Group { block: block as u16, lanes: same, id });
            rest &= !same;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The levels that this machine has.
    fn levels() -> Vec<(&'static str, Level)> {
        let best = Level::new();
        let mut list = vec![("scalar", Level::Fallback(fearless_simd::Fallback::new()))];
        #[cfg(target_arch = "x86_64")]
        {
            list.extend(best.as_sse2().map(|level| ("SSE2", Level::Sse2(level))));
            list.extend(best.as_sse4_2().map(|level| ("SSE4.2", Level::Sse4_2(level))));
            list.extend(best.as_avx2().map(|level| ("AVX2", Level::Avx2(level))));
        }
        list.push(("best", best));
        list
    }

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
            seen.clear(1, 1);
            let visits = setups.iter().enumerate().map(|(id, setup)| Visit {
                setup,
                id: id as u32,
                blocks: [0, 31, 0, 31],
                near: (id % 5 == 0).then_some([3.0, 0.01, -0.01]),
                cutout: id % 7 == 0,
            });
            cover(level, &batch, (1, 1), visits, &mut seen, &|visit, block, lane| {
                !(visit.id as usize + block + lane).is_multiple_of(3)
            });
            let mut groups = Vec::new();
            group(level, &batch, &seen, &mut groups);
            let depth: Vec<u32> = seen.depth.iter().flatten().map(|z| z.to_bits()).collect();
            (depth, seen.id, groups)
        };
        let levels = levels();
        let wanted = run(levels[0].1);
        assert!(wanted.0.iter().filter(|&&bits| bits != 0).count() > 1000, "the test draws next to nothing");
        for (name, level) in levels {
            assert!(run(level) == wanted, "{name} differs from scalar");
        }
    }

    fn mix(x: u64) -> u64 {
        x.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f)
    }
}
