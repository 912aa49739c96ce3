//! What an edge along rows, columns or diagonals of pixels may hide. In: the sums of a tile. Out: for each block at least so much squared
//! error, for [`super::tile_round`] and [`super::finish`].
//!
//! All pixels of a tile share their places within a pixel and on the lens. Along an edge that runs as pixels do they therefore err
//! alike, and where the two halves of the samples happen to agree the whole row seems to be right: a block's stated error is one
//! throw then, mostly of 0. (A white rectangle on black, in focus, stopped at 16 samples in such rows, with up to 12 times the error
//! that was asked for.) What such an edge errs is known beforehand. Through a pinhole each half has one sample in each of `n / 2`
//! slices of the pixel, so of a step of contrast `c` its mean misses `c^2 f (1 - f) / (n / 2)^2`, where the edge cuts the slice at
//! `f`; with two halves and any `f`, `c^2 / (3 n^2)`. With a lens the samples that see it are a half-space of pixel and lens,
//! of which scrambled nets miss about `c^2 n^(-4/3)` times a constant (Owen 1997, for three dimensions), found by measuring. Of a light
//! `b` times as bright as white the edge that is shown lies where one part in `b` of the lens sees it: `b^2` times what is missed of so
//! small a part, which is about one part in `b` of what is missed of half of the lens.
//! Along a diagonal, too, all pixels err alike, and by more: through a pinhole by `n^(-3/2)` (Beck and Chen, *Irregularities of Distribution*,
//! 1987, for half-planes), with constants found by measuring. (A half-plane at 45 degrees stopped with up to 8.6 times the error that
//! was asked for, 16 samples a pixel. At 26.6 degrees every other pixel errs alike, and the two halves seldom agree.)

use super::covered::{is_covered, moved_to_covered};
use super::kept::Blocks;
use super::prepared::Prepared;
use super::resolve::{ByBlock, Sum};
use super::shown::Shown;
use super::weights::missed_by_weights;
use crate::picture::BLOCK;
use crate::simd::at_level;

/// The constant for an edge through a lens; and through a pinhole, where it adds up over the two or three rows that count.
const BLURRED: f64 = 0.08;
const SHARP: f64 = 1.2 / 3.0;

/// The same for diagonals: through a lens; and through a pinhole with a number of samples that 32 divides, and with others.
const DIAGONAL_BLURRED: f64 = 0.24;
const DIAGONAL_SHARP: [f64; 2] = [0.12, 0.42];

/// The constant for an edge that diffraction spreads, and the power by which its error falls: a ray is bent by two more numbers, and in
/// more dimensions the error falls more slowly. Both found by measuring (bars of one and three pixels, 16 to 4096 samples).
const SPREAD: f64 = 0.045;
const SPREAD_FALL: f64 = 1.1;

/// The edges of a tile.
#[derive(Clone, Copy, Default)]
pub(super) struct Contrasts {
    /// Block by block the sum of their squared contrasts, more where lights are brighter than white: of edges along rows and columns, and
    /// of those along diagonals.
    squared: [ByBlock<f64>; 2],
    /// Block by block the squared light that is weighed, times the variance of the weights; and what the sky varies by.
    weighed: ByBlock<f64>,
    /// Some are.
    pub are_bright: bool,
}

/// As much as so many tiles whose edges err as they may: what little has been seen tells little.
const DOUBT: f64 = 4.0;

/// How much edges err in a picture, as a part of what they may.
///
/// Blurred or smooth textures have steps that err less than edges of surfaces do, and pictures of thousands of edges
/// tell by themselves how much these err. In: for each tile what its blocks with edges err by their samples' word, and
/// what these may hide.
pub(super) fn share(tiles: impl IntoIterator<Item = [f64; 2]>) -> f64 {
    let add = |[count, found, hidden]: [f64; 3], tile: [f64; 2]| {
        if tile[1] > 0.0 { [count + 1.0, found + tile[0], hidden + tile[1]] } else { [count, found, hidden] }
    };
    let [count, found, hidden] = tiles.into_iter().fold([0.0; 3], add);
    let share = if hidden > 0.0 { (found / hidden).min(1.0) } else { 1.0 };
    (count * share + DOUBT) / (count + DOUBT)
}

/// A tile for [`share`].
pub(super) fn found_and_hidden(blocks: impl IntoIterator<Item = (f64, f64)>) -> [f64; 2] {
    let add = |[found, hidden]: [f64; 2], (error, edges): (f64, f64)| {
        if edges > 0.0 { [found + error, hidden + edges] } else { [found, hidden] }
    };
    blocks.into_iter().fold([0.0; 2], add)
}

impl Prepared<'_> {
    /// The squared contrasts of the edges in the blocks with `samples` (of all, and of those that count): what these may hide is
    /// as much times [`Self::missed`].
    pub(super) fn contrasts(
        &self,
        tile: (u32, u32),
        sums: &[Sum],
        (all, changed): (&ByBlock<u32>, &ByBlock<u32>),
        covered: Blocks,
    ) -> Contrasts {
        let size = self.size_of(tile).map(|size| size as usize);
        let counts = |block: usize| is_covered(covered, block) && changed[block] > 1;
        if !(0..changed.len()).any(counts) {
            return Contrasts::default();
        }
        let mut shown = Shown::nothing(size);
        shown.fill(self.level, sums, &all.map(|n| self.gain / n.max(1) as f32));
        let mut contrasts = [ByBlock::default(); 2];
        at_level!(self.level, simd => {
            for block in (0..changed.len()).filter(|&block| counts(block) || !is_covered(covered, block)) {
                [contrasts[0][block], contrasts[1][block]] = shown.contrasts(simd, block);
            }
        });
        let variance = if self.has_weights() { self.variance_of(tile) } else { 0.0 };
        let sky = if self.has_sky_over_lens() { self.sky_variance_of(tile) } else { 0.0 };
        let surfaces = if sky > 0.0 { self.bins.squares(tile, BLOCK) as Blocks } else { 0 };
        let of_light = |block| {
            let weighed = if variance > 0.0 { variance * shown.light(block) } else { 0.0 };
            if sky > 0.0 && !is_covered(surfaces, block) {
                weighed + sky * shown.pixels(block)
            } else {
                weighed
            }
        };
        // Of an edge along the border of two blocks half is seen in either, and the sky errs nothing.
        Contrasts {
            squared: contrasts.map(|contrasts| moved_to_covered(covered, contrasts)),
            weighed: std::array::from_fn(of_light),
            are_bright: shown.peaks.iter().any(|&peak| peak > 0.0),
        }
    }

    /// The squared error that `samples` make of an edge at most, as a part of its squared contrast: along rows and columns, and along
    /// diagonals.
    fn missed(&self, samples: u32) -> [f64; 2] {
        let n = f64::from(samples.max(1));
        if self.diffraction.is_some() {
            return [SPREAD, SPREAD * DIAGONAL_BLURRED / BLURRED]
                .map(|constant| constant / libm::pow(n, SPREAD_FALL));
        }
        if self.view.radius > 0.0 {
            return [BLURRED, DIAGONAL_BLURRED].map(|constant| constant / libm::pow(n, 4.0 / 3.0));
        }
        let diagonal = DIAGONAL_SHARP[usize::from(!samples.is_multiple_of(32))];
        [SHARP / (n * n), diagonal / (n * n.sqrt())]
    }

    /// What edges may hide in blocks of so many samples: squared errors.
    pub(super) fn hidden(
        &self,
        tile: (u32, u32),
        sums: &[Sum],
        samples: &ByBlock<u32>,
        covered: Blocks,
    ) -> ByBlock<f64> {
        let contrasts = self.contrasts(tile, sums, (samples, samples), covered);
        self.all_missed(samples, &contrasts)
    }

    /// As many squared errors as blocks, by their squared contrasts.
    pub(super) fn all_missed(&self, samples: &ByBlock<u32>, contrasts: &Contrasts) -> ByBlock<f64> {
        let [aligned, diagonal] = &contrasts.squared;
        std::array::from_fn(|block| {
            let (aligned, diagonal, weighed) = (aligned[block], diagonal[block], contrasts.weighed[block]);
            let mut squared = 0.0;
            if aligned != 0.0 || diagonal != 0.0 {
                let missed = self.missed(samples[block]);
                squared += missed[0] * aligned + missed[1] * diagonal;
            }
            if weighed != 0.0 {
                squared += missed_by_weights(samples[block]) * weighed;
            }
            squared
        })
    }
}
