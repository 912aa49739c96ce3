//! Texture look-ups for 16 samples of one pixel that see one triangle: places in, summed colours out.
//!
//! Texture coordinates, texel places and weights are computed for all 16 at once; the texels themselves
//! are fetched one by one. One generic source for every SIMD level, product and sum apart, so the same bits.

use super::filter::Levels;
use super::look::Bilinear4;
use crate::raster::LANES;
use crate::raster::view::Batch;
use crate::scene;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, dispatch, f32x16};
use glam::Vec4;

/// The sums of the colours of the even and the odd samples among `lanes` of a batch, whose block has its
/// corner at `(x, y)` in the tile.
#[inline]
pub(crate) fn sums(
    simd: Level,
    levels: &Levels<'_>,
    k: &Bilinear4,
    batch: &Batch,
    corner: (f32, f32),
    lanes: u16,
) -> [Vec4; 2] {
    dispatch!(simd, simd => both_levels(simd, levels, k, batch, corner, lanes))
}

#[inline(always)]
fn both_levels<S: Simd>(
    simd: S,
    levels: &Levels<'_>,
    k: &Bilinear4,
    batch: &Batch,
    corner: (f32, f32),
    lanes: u16,
) -> [Vec4; 2] {
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let x = f32x16::load_array_ref(simd, &batch.x) + corner.0;
    let y = f32x16::load_array_ref(simd, &batch.y) + corner.1;
    let zero = f32x16::splat(simd, 0.0);
    let weight = evaluate(k, 2, u, v, x, y);
    let usable = weight.simd_ne(zero);
    let s = usable.select(evaluate(k, 0, u, v, x, y) / weight, zero);
    let t = usable.select(evaluate(k, 1, u, v, x, y) / weight, zero);
    // What is no number looks at the first texel.
    let huge = f32x16::splat(simd, 1e30);
    let (s, t) = (s.abs().simd_lt(huge).select(s, zero), t.abs().simd_lt(huge).select(t, zero));
    let right = s - s.floor();
    // v runs up, rows run down.
    let down = f32x16::splat(simd, 1.0) - (t - t.floor());

    let mut out = [Vec4::ZERO; 2];
    add_level(simd, levels.low, (1.0 - levels.share) / 65535.0, right, down, lanes, batch.odd, &mut out);
    if levels.share > 0.0 {
        add_level(simd, levels.high, levels.share / 65535.0, right, down, lanes, batch.odd, &mut out);
    }
    out
}

/// Component `i` of the four functions at the 16 samples.
#[inline(always)]
fn evaluate<S: Simd>(
    k: &Bilinear4,
    i: usize,
    u: f32x16<S>,
    v: f32x16<S>,
    x: f32x16<S>,
    y: f32x16<S>,
) -> f32x16<S> {
    let c = u * k[1][i] + v * k[2][i] + k[0][i];
    let cx = u * k[4][i] + v * k[5][i] + k[3][i];
    let cy = u * k[7][i] + v * k[8][i] + k[6][i];
    c + cx * x + cy * y
}

/// The two texels beside each coordinate in 0..1 along one side, and how near it is to the second.
#[inline(always)]
fn neighbours<S: Simd>(simd: S, t: f32x16<S>, size: u32) -> ([u32; LANES], [u32; LANES], f32x16<S>) {
    let zero = f32x16::splat(simd, 0.0);
    let at = t * size as f32 - 0.5;
    let low = at.floor();
    let share = at - low;
    let last = f32x16::splat(simd, size as f32 - 1.0);
    // -0.5 to size - 0.5: one step either way wraps.
    let first = low.simd_lt(zero).select(last, low);
    let second = first.simd_ge(last).select(zero, first + 1.0);
    (simd.cvt_u32_f32x16(first).to_array(), simd.cvt_u32_f32x16(second).to_array(), share)
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "an inner loop, taken apart")]
fn add_level<S: Simd>(
    simd: S,
    level: &scene::Level,
    scale: f32,
    right: f32x16<S>,
    down: f32x16<S>,
    lanes: u16,
    odd: u16,
    out: &mut [Vec4; 2],
) {
    let (x0, x1, fx) = neighbours(simd, right, level.width);
    let (y0, y1, fy) = neighbours(simd, down, level.height);
    let one = f32x16::splat(simd, 1.0);
    let (gx, gy) = ((one - fx) * scale, one - fy);
    let fx = fx * scale;
    let weights = [(gx * gy).to_array(), (fx * gy).to_array(), (gx * fy).to_array(), (fx * fy).to_array()];
    let width = level.width as usize;
    let texels = &level.texels[..];
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let rows = [y0[lane] as usize * width, y1[lane] as usize * width];
        let columns = [x0[lane] as usize, x1[lane] as usize];
        let texel = |row: usize, column: usize| {
            let [r, g, b, a] = texels.get(rows[row] + columns[column]).copied().unwrap_or_default();
            Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
        };
        let color = texel(0, 0) * weights[0][lane]
            + texel(0, 1) * weights[1][lane]
            + texel(1, 0) * weights[2][lane]
            + texel(1, 1) * weights[3][lane];
        out[usize::from(odd >> lane & 1 == 1)] += color;
    }
}
