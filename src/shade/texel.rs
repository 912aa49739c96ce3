//! Single texels of a level, for [`super::fetch`], [`super::fetch_queue`] and [`super::interpolate`]: columns and rows, of 16 places at a
//! time, modulo the level's size; and the four channels of one.

use super::mip_level::Side;
use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16, u32x16};
use glam::Vec4;

/// [`Side::wrap`] for 16.
#[inline(always)]
pub(super) fn wrap<S: Simd>(simd: S, side: Side, steps: f32x16<S>) -> u32x16<S> {
    if let Some((start, mask)) = side.binary {
        return ((simd.cvt_i32_f32x16(steps) + start) & mask).bitcast();
    }
    let zero = f32x16::splat(simd, 0.0);
    let last = f32x16::splat(simd, side.size - 1.0);
    let texel = steps + side.start;
    if (texel.simd_ge(zero) & texel.simd_le(last)).all_true() {
        return simd.cvt_i32_f32x16(texel).bitcast();
    }
    let turns = ((texel + 0.5) * side.inverse).floor();
    let texel = texel - turns * side.size;
    let texel = texel.simd_gt(zero).select(texel, zero);
    simd.cvt_i32_f32x16(texel.simd_gt(last).select(last, texel)).bitcast()
}

/// A texel's channel as a part of a full one.
pub(super) const FULL: f32 = 1.0 / 65535.0;

/// A texel, 65535 for full. (Copied before it is looked at, it went through registers for whole numbers.)
#[inline(always)]
pub(super) fn texel(texels: &[[u16; 4]], place: usize) -> Vec4 {
    match texels.get(place) {
        Some(&[r, g, b, a]) => Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a)),
        None => Vec4::ZERO,
    }
}
