//! Which blocks of pixels may show more than the sky, and so how many samples each begins with.
//!
//! In: triangles in bins ([`crate::raster::bin`]). Out: for each tile its blocks that the pixels of any triangle reach, for
//! [`super::progressive`]. The sky changes so little in a pixel that the fewest samples are enough for it, however many all others
//! begin with. (A table top far away, 320 pixels wide, of which nine tenths are sky, took 1.8 times the samples of a perfect
//! allocation. That of the error of 64 samples took 3.2 times as many while the sky began with 16, lamps at night 8.8 times.) Where light
//! is weighed over the lens, or the sky changes over it, the sky errs as all else does ([`super::weights`]), and counts as covered.

use super::kept::Blocks;
use super::prepared::Prepared;
use super::resolve::{BLOCKS, ByBlock};
use crate::picture::BLOCK;
use crate::sampling::runs::FIRST_RUN;
use rayon::prelude::*;

/// The blocks of a picture that may show more than the sky.
pub(super) struct Covered {
    /// Tile by tile.
    blocks: Vec<Blocks>,
    /// Tiles in a row.
    columns: u32,
}

impl Covered {
    pub(super) fn new(picture: &Prepared<'_>) -> Self {
        let all = picture.has_weights() || picture.has_sky_over_lens();
        let of_tile = |tile| {
            let place = picture.place(tile);
            if all { within(picture.size_of(place)) } else { picture.bins.squares(place, BLOCK) as Blocks }
        };
        Self {
            blocks: (0..picture.tiles()).into_par_iter().map(of_tile).collect(),
            columns: picture.bins.tiles_x,
        }
    }

    /// Tile by tile whether it has any.
    pub(super) fn tiles(&self) -> impl Iterator<Item = bool> {
        self.blocks.iter().map(|&blocks| blocks > 0)
    }

    /// Those of the tile in this column and row.
    pub(super) fn of_tile(&self, (x, y): (u32, u32)) -> Blocks {
        self.blocks[(y * self.columns + x) as usize]
    }

    /// Whether the block in this column and row is one.
    pub(super) fn has(&self, x: u32, y: u32) -> bool {
        let (covered, block) = self.place(x, y);
        is_covered(covered, block)
    }

    /// The blocks of the tile that this block lies in, and its number among them.
    fn place(&self, x: u32, y: u32) -> (Blocks, usize) {
        (self.of_tile((x / BLOCKS, y / BLOCKS)), (y % BLOCKS * BLOCKS + x % BLOCKS) as usize)
    }

    /// How many samples that block begins with: see [`first_samples`].
    pub(super) fn first(&self, x: u32, y: u32, first: First) -> u32 {
        let (covered, block) = self.place(x, y);
        begins_with(covered, block, first)
    }
}

/// The blocks of a tile of so many columns and rows of pixels.
fn within([width, height]: [u32; 2]) -> Blocks {
    let is_within = |block: &u32| block % BLOCKS * BLOCK < width && block / BLOCKS * BLOCK < height;
    (0..BLOCKS * BLOCKS).filter(is_within).fold(0, |blocks, block| blocks | 1 << block)
}

/// Whether a block of a tile is one of these.
pub(super) fn is_covered(covered: Blocks, block: usize) -> bool {
    covered >> block & 1 == 1
}

/// How many samples blocks begin with: those that may show more than the sky, and all others.
#[derive(Clone, Copy, Debug)]
pub(super) struct First {
    pub base: u32,
    pub sky: u32,
}

/// How many samples the blocks of a tile begin with: the sky with its own number, but beside what begins with [`FIRST_RUN`] with as many, for
/// there a run of its own would take longer than it saves.
pub(super) fn first_samples(covered: Blocks, first: First) -> ByBlock<u32> {
    std::array::from_fn(|block| begins_with(covered, block, first))
}

fn begins_with(covered: Blocks, block: usize, First { base, sky }: First) -> u32 {
    if is_covered(covered, block) {
        base
    } else if covered == 0 || base > FIRST_RUN {
        sky
    } else {
        FIRST_RUN
    }
}

/// Numbers of a tile's blocks, of which each that shows nothing but the sky gives its own to those beside it that show more.
pub(super) fn moved_to_covered(covered: Blocks, mut numbers: ByBlock<f64>) -> ByBlock<f64> {
    let side = BLOCKS as usize;
    for block in (0..numbers.len()).filter(|&block| !is_covered(covered, block)) {
        let number = std::mem::take(&mut numbers[block]);
        if number == 0.0 {
            continue;
        }
        let (x, y) = (block % side, block / side);
        let beside = [
            (x > 0).then(|| block - 1),
            (x + 1 < side).then(|| block + 1),
            (y > 0).then(|| block - side),
            (y + 1 < side).then(|| block + side),
        ];
        let those = || beside.iter().flatten().filter(|&&other| is_covered(covered, other));
        let count = those().count() as f64;
        those().for_each(|&other| numbers[other] += number / count);
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_sky_gives_goes_to_what_lies_beside() {
        // The second block and the last two.
        let covered = 1 << 1 | 0b11 << 14;
        let mut numbers = ByBlock::default();
        (numbers[0], numbers[1], numbers[3], numbers[10], numbers[13]) = (1.0, 2.0, 4.0, 8.0, 16.0);
        let mut wanted = ByBlock::default();
        (wanted[1], wanted[14]) = (3.0, 24.0);
        assert_eq!(moved_to_covered(covered, numbers), wanted);
        assert_eq!(moved_to_covered(Blocks::MAX, numbers), numbers);
    }

    #[test]
    fn the_sky_begins_with_its_own_number_where_that_takes_no_longer() {
        let covered = 1 << 1 | 0b11 << 14;
        let with = |covered, sky, others| {
            std::array::from_fn(|block| if is_covered(covered, block) { others } else { sky })
        };
        let of = |covered, base| first_samples(covered, First { base, sky: 2 });
        assert_eq!(of(covered, 64), with(covered, 2, 64));
        assert_eq!(of(covered, 16), [16; 16]);
        assert_eq!(of(0, 16), [2; 16]);
    }
}
