//! Tiles at the right and lower border, of which a part lies outside of the picture.
//!
//! In: how many columns and rows of a tile are in the picture. Out, for [`super::draw`]: which regions are to be drawn, and which
//! samples of a group are to be shaded. What lies outside has no samples, and its sums stay 0.

use crate::raster::batch::{Batch, Pattern};
use crate::raster::group::Group;
use crate::raster::visibility::{EVERYWHERE, REGION};
use crate::raster::{LANES, TILE};

/// The regions of 4 x 4 blocks of `block` pixels that have pixels in the picture, of a tile of which it has so many columns and rows.
pub(super) fn regions_inside([width, height]: [u32; 2], block: (u32, u32)) -> u64 {
    if [width, height] == [TILE; 2] {
        return EVERYWHERE;
    }
    let across = width.div_ceil(block.0 * REGION as u32);
    let row = EVERYWHERE >> (64 - across);
    (0..height.div_ceil(block.1 * REGION as u32)).fold(0, |sum, y| sum | row << (8 * y))
}

/// The lanes of a group that lie in the picture, of a tile of which it has so many columns and rows.
pub(super) fn lanes_inside(
    [width, height]: [u32; 2],
    pattern: &Pattern,
    batches: &[Batch],
    group: &Group,
) -> u64 {
    let corner = pattern.corner(u32::from(group.block));
    let is_inside = |lane: &usize| {
        let batch = &batches[lane / LANES % batches.len()];
        let (x, y) = pattern.pixel(corner, batch, *lane);
        x < width && y < height
    };
    let lanes = (0..batches.len() * LANES).filter(|lane| group.lanes >> lane & 1 == 1);
    lanes.filter(is_inside).fold(0, |sum, lane| sum | 1 << lane)
}
