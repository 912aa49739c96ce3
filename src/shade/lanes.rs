//! Masks of lanes, of samples and of groups: the lowest bit is lane 0, or the first group.

use crate::raster::LANES;
use crate::raster::group::Group;
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};

/// The lanes of those groups that are in the mask `which`, none of the others.
#[inline(always)]
pub(super) fn lanes_of(groups: &[Group], which: u16) -> [u64; LANES] {
    let mut lanes = [0; LANES];
    for (i, (lanes, group)) in lanes.iter_mut().zip(groups).enumerate() {
        *lanes = if which >> i & 1 == 1 { group.lanes } else { 0 };
    }
    lanes
}

/// The lanes that stand for a group.
#[inline(always)]
pub(super) fn of_groups(groups: &[Group]) -> u16 {
    (0xffff_u32 >> (LANES - groups.len().min(LANES))) as u16
}

/// The level of the first of `lanes`, and those of them that look into the same: mostly all.
#[inline(always)]
pub(super) fn of_first<S: Simd>(simd: S, levels: u32x16<S>, lanes: u16) -> (usize, u16) {
    let level = levels.to_array()[lanes.trailing_zeros() as usize % LANES];
    let same = levels.simd_eq(u32x16::splat(simd, level)).to_bitmask() as u16;
    (level as usize, same & lanes)
}

/// The sum over `lanes`, in one order at every SIMD level.
#[inline(always)]
pub(super) fn total<S: Simd>(simd: S, x: f32x16<S>, lanes: u16) -> f32 {
    let mask = mask32x16::from_bitmask(simd, u64::from(lanes));
    let x = mask.select(x, f32x16::splat(simd, 0.0)).to_array();
    let mut sum = [0.0; 8];
    for i in 0..8 {
        sum[i] = x[i] + x[i + 8];
    }
    let four = [sum[0] + sum[4], sum[1] + sum[5], sum[2] + sum[6], sum[3] + sum[7]];
    (four[0] + four[2]) + (four[1] + four[3])
}
