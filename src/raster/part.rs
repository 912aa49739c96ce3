//! What is drawn of a tile, and the blocks of it that triangles may touch.
//!
//! In: boxes of pixels ([`super::vertex_boxes`]). Out: the blocks of the tile that lie in them, for [`super::tile`], [`super::loose_queue`] and
//! [`super::kernel`]: from `(x0 - x) / w`, `x` being the tile's first pixel and `w` the width of a block, to `(x1 - x) / w`, and
//! likewise down.

use super::vertex_boxes::PixelBox;
use super::visibility::{EVERYWHERE, wants};
use super::{LANES, TILE};

/// The blocks of pixels that 16 triangles may touch from one cell of the lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spans {
    /// Columns `x0..=x1`, rows `y0..=y1`.
    pub blocks: [[u8; 4]; LANES],
    /// Triangles that may touch any.
    pub some: u16,
}

impl Spans {
    pub(super) const NONE: Self = Self { blocks: [[1, 0, 1, 0]; LANES], some: 0 };

    /// Those that one of the triangles may touch, if any.
    #[inline(always)]
    pub(super) fn set(&mut self, triangle: usize, blocks: Option<[u8; 4]>) {
        if let Some(blocks) = blocks {
            self.blocks[triangle] = blocks;
            self.some |= 1 << triangle;
        }
    }
}

/// What is drawn of a tile.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Its column and row.
    pub tile: (u32, u32),
    /// Pixels across and down that a batch serves.
    pub block_size: (u32, u32),
    /// Regions of 4 x 4 blocks outside of which nothing is drawn: see [`super::visibility`].
    pub wanted: u64,
}

impl Part {
    /// The blocks that lie in a box: columns, first and last, and rows.
    pub(super) fn blocks(&self, pixels: PixelBox) -> Option<[u8; 4]> {
        let (x0, x1) = range(pixels.x0, pixels.x1, self.tile.0, self.block_size.0)?;
        let (y0, y1) = range(pixels.y0, pixels.y1, self.tile.1, self.block_size.1)?;
        Some([x0, x1, y0, y1])
    }

    /// Whether what lies in these boxes, one for each cell of the lens, may touch anything that is wanted.
    pub(super) fn touches(&self, boxes: &[PixelBox]) -> bool {
        if self.wanted == EVERYWHERE {
            return true;
        }
        let all = boxes.iter().copied().fold(PixelBox::EMPTY, PixelBox::union);
        self.blocks(all).is_some_and(|blocks| wants(self.wanted, blocks))
    }
}

/// The blocks of a tile, `size` pixels each, that pixels from `low` to `high` lie in.
fn range(low: i16, high: i16, tile: u32, size: u32) -> Option<(u8, u8)> {
    let start = (tile * TILE) as i32;
    let low = (i32::from(low) - start).max(0);
    let high = (i32::from(high) - start).min(TILE as i32 - 1);
    // Sizes are powers of two, and a shift is not a division.
    let bits = size.trailing_zeros();
    (low <= high).then(|| ((low >> bits) as u8, (high >> bits) as u8))
}
