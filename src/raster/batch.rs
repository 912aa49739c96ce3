//! The samples of a tile: batches of 16, each with a place in every block of pixels.
//!
//! In: samples, from `render::pattern` and `render::diffraction`. Out: a [`Pattern`] of [`Batch`]es, for [`super::tile`] and all that it
//! leads to, and for `shade`. A block at `(bx, by)` has the sample of each lane at `(bx + x, by + y)` pixels, with the lens point
//! `radius (u, v, 0)`.

use super::{LANES, TILE};
use glam::Vec2;

/// The disk of the aperture that a cell of lens points lies in; fractions of the radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LensCell {
    pub u: f64,
    pub v: f64,
    pub radius: f64,
    /// How far its samples may lie outside of their pixels, as [`View::displacement`].
    pub displacement: [f64; 2],
}

/// Sixteen samples that are tested together, at every block of a tile.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    /// Which [`LensCell`] all of them lie in.
    pub cell: usize,
    /// Lens points, fractions of the radius.
    pub u: [f32; LANES],
    pub v: [f32; LANES],
    /// Place of the sample from the block's left top corner, pixels.
    pub x: [f32; LANES],
    pub y: [f32; LANES],
    /// Which pixel of the block each sample belongs to, row by row.
    pub pixel: [u8; LANES],
    /// The sample's number.
    pub index: [u32; LANES],
    /// Lanes in use, lane 0 in the lowest bit.
    pub live: u16,
    /// Lanes whose sample has an odd number: the other half of the error estimate.
    pub odd: u16,
}

impl Batch {
    /// No samples yet, in this cell.
    pub(crate) const fn of_cell(cell: usize) -> Self {
        Self {
            cell,
            u: [0.0; LANES],
            v: [0.0; LANES],
            x: [0.0; LANES],
            y: [0.0; LANES],
            pixel: [0; LANES],
            index: [0; LANES],
            live: 0,
            odd: 0,
        }
    }
}

/// All samples of a tile: batches of 16, each of which visits every block of pixels.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    /// Logarithms to base 2 of a block's width and height: a shift is not a division, which every group of samples
    /// would need three times.
    pub block_bits: [u32; 2],
    pub batches: Vec<Batch>,
}

impl Pattern {
    /// The left top pixel of a block, in the tile.
    #[inline(always)]
    pub(crate) fn corner(&self, block: u32) -> (u32, u32) {
        let [across, down] = self.block_bits;
        let row = TILE.trailing_zeros() - across;
        ((block & ((1 << row) - 1)) << across, (block >> row) << down)
    }

    /// Moves all samples to the middle of their pixels.
    pub(crate) fn center(&mut self) {
        for batch in &mut self.batches {
            for lane in 0..LANES {
                let (column, row) = inside(batch.pixel[lane], self.block_bits);
                batch.x[lane] = column as f32 + 0.5;
                batch.y[lane] = row as f32 + 0.5;
            }
        }
    }

    /// The pixel, in the tile, of a lane at the block with this corner.
    #[inline(always)]
    pub(crate) fn pixel(&self, (x, y): (u32, u32), batch: &Batch, lane: usize) -> (u32, u32) {
        let (column, row) = inside(batch.pixel[lane % LANES], self.block_bits);
        (x + column, y + row)
    }
}

/// A pixel's column and row in its block.
#[inline(always)]
fn inside(pixel: u8, [across, _]: [u32; 2]) -> (u32, u32) {
    (u32::from(pixel) & ((1 << across) - 1), u32::from(pixel) >> across)
}

/// A pixel's left top corner from its tile's centre.
#[inline(always)]
pub(crate) fn from_center((x, y): (u32, u32)) -> Vec2 {
    Vec2::new(FROM_CENTER[x as usize % TILE as usize], FROM_CENTER[y as usize % TILE as usize])
}

/// A table is faster than two conversions, which every group of samples would need.
const FROM_CENTER: [f32; TILE as usize] = {
    let mut at = [0.0; TILE as usize];
    let mut i = 0;
    while i < TILE as usize {
        at[i] = i as f32 - 0.5 * TILE as f32;
        i += 1;
    }
    at
};
