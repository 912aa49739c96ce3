//! What an edge along rows or columns of pixels may hide. In: the sums of a tile. Out: for each block at least so much squared error.
//!
//! All pixels of a tile share their places within a pixel and on the lens. Along an edge that runs as pixels do they therefore err
//! alike, and where the two halves of the samples happen to agree the whole row seems to be right: a block's stated error is one
//! throw then, mostly of 0. (A white rectangle on black, in focus, stopped at 16 samples in such rows, with up to 12 times the error
//! that was asked for.) What such an edge errs is known beforehand. Through a pinhole each half has one sample in each of `n / 2`
//! slices of the pixel, so of a step of contrast `c` its mean misses `c^2 f (1 - f) / (n / 2)^2`, where the edge cuts the slice at
//! `f`; with two halves and any `f`, `c^2 / (3 n^2)`. With a lens the samples that see it are a half-space of pixel and lens,
//! of which scrambled nets miss about `c^2 n^(-4/3)` times a constant (Owen 1997, for three dimensions), found by measuring.

use super::picture::Picture;
use super::resolve::{BLOCKS, ByBlock};
use crate::picture::BLOCK;
use crate::raster::TILE;
use glam::Vec3;

/// The constant for an edge through a lens; and through a pinhole, where it adds up over the two or three rows that count.
const BLURRED: f64 = 0.08;
const SHARP: f64 = 1.2 / 3.0;

/// How many pixels to both sides an edge's contrast is looked for.
const REACH: usize = 4;

/// Steps along an edge that runs as pixels do are at most this part of the steps across it.
const ALIGNED: f32 = 0.125;

/// A pixel is part of an edge if what changes there is at least this part of the contrast. An even slope has an eighth of it in
/// each step, one that begins or ends there a quarter; rows of wider blur make up for each other.
const PART: f32 = 0.3;

/// Of eight pixels beside each other so many must see the edge.
const ROW: usize = 7;

/// From a pixel of a tile to the next along each axis.
const STRIDE: [usize; 2] = [1, TILE as usize];

/// What a tile shows, and the squared steps from each pixel to the next along each axis.
struct Steps {
    size: [usize; 2],
    shown: [Vec3; (TILE * TILE) as usize],
    steps: [[f32; (TILE * TILE) as usize]; 2],
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

impl Picture<'_> {
    /// What the edges of the blocks with `samples` (of all, and of those that count) may hide at most: squared errors.
    pub(super) fn hidden(
        &self,
        (tx, ty): (u32, u32),
        sums: &[[Vec3; 2]],
        (all, changed): (&ByBlock<u32>, &ByBlock<u32>),
    ) -> ByBlock<f64> {
        let size =
            [self.view.width - tx * TILE, self.view.height - ty * TILE].map(|size| size.min(TILE) as usize);
        let scales = all.map(|n| self.gain / n.max(1) as f32);
        let mut shown = [Vec3::ZERO; (TILE * TILE) as usize];
        let rows = sums.chunks(TILE as usize).zip(shown.chunks_mut(TILE as usize)).take(size[1]);
        for (y, (sums, shown)) in rows.enumerate() {
            let scales = &scales[y / BLOCK as usize * BLOCKS as usize..];
            let blocks = sums.chunks(BLOCK as usize).zip(shown.chunks_mut(BLOCK as usize));
            for ((sums, shown), &scale) in blocks.zip(scales) {
                for ([a, b], shown) in sums.iter().zip(shown) {
                    *shown = ((a + b) * scale).clamp(Vec3::ZERO, Vec3::ONE);
                }
            }
        }
        let tile = Steps::new(size, shown);
        std::array::from_fn(|block| {
            if changed[block] < 2 {
                return 0.0;
            }
            let n = f64::from(changed[block]);
            let missed =
                if self.view.radius > 0.0 { BLURRED / libm::pow(n, 4.0 / 3.0) } else { SHARP / (n * n) };
            missed * tile.contrasts(block)
        })
    }
}

impl Steps {
    fn new(size: [usize; 2], shown: [Vec3; (TILE * TILE) as usize]) -> Self {
        let mut steps = [[0.0; (TILE * TILE) as usize]; 2];
        let [across, down] = &mut steps;
        let rows = |y: usize| &shown[y * TILE as usize..][..size[0]];
        for (y, steps) in across.chunks_mut(TILE as usize).take(size[1]).enumerate() {
            for (step, pair) in steps.iter_mut().zip(rows(y).windows(2)) {
                *step = (pair[1] - pair[0]).length_squared();
            }
        }
        for (y, steps) in down.chunks_mut(TILE as usize).take(size[1] - 1).enumerate() {
            for ((step, here), below) in steps.iter_mut().zip(rows(y)).zip(rows(y + 1)) {
                *step = (*below - *here).length_squared();
            }
        }
        Self { size, shown, steps }
    }

    /// Squared contrasts of the edges along rows and columns, summed over the pixels of a block that they touch.
    fn contrasts(&self, block: usize) -> f64 {
        let block = block as u32;
        let first = [block % BLOCKS * BLOCK, block / BLOCKS * BLOCK].map(|at| at as usize);
        let ends = [0, 1].map(|axis| (first[axis] + BLOCK as usize).min(self.size[axis]));
        let mut sum = 0.0;
        for axis in 0..2 {
            let beside = first[1 - axis]..ends[1 - axis];
            for along in first[axis]..ends[axis] {
                // Most rows are done after two pixels.
                let (mut others, mut squared) = (BLOCK as usize - ROW, 0.0);
                let sees = |across| {
                    let contrast = self.contrast(axis, along, across);
                    squared += f64::from(contrast);
                    contrast > 0.0 || others.checked_sub(1).inspect(|&left| others = left).is_some()
                };
                if beside.clone().all(sees) {
                    sum += squared;
                }
            }
        }
        sum
    }

    /// The squared contrast along `axis` at a pixel, 0 where it is not part of an edge across that axis.
    fn contrast(&self, axis: usize, along: usize, across: usize) -> f32 {
        let (stride, other) = (STRIDE[axis], STRIDE[1 - axis]);
        let line = across * other;
        let here = line + along * stride;
        // Steps into and out of the pixel.
        let own = |axis: usize, at: usize| {
            let steps = &self.steps[axis];
            let into = if at > 0 { steps[here - STRIDE[axis]] } else { 0.0 };
            into.max(steps[here])
        };
        let change = own(axis, along);
        if change == 0.0 {
            return 0.0;
        }
        if own(1 - axis, across) > ALIGNED * ALIGNED * change {
            return 0.0;
        }
        let window = along.saturating_sub(REACH)..(along + REACH + 1).min(self.size[axis]);
        let (mut low, mut high) = (self.shown[here], self.shown[here]);
        for value in window.map(|near| self.shown[line + near * stride]) {
            (low, high) = (low.min(value), high.max(value));
        }
        let contrast = (high - low).length_squared();
        if change >= PART * PART * contrast { contrast } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contrasts(value: impl Fn(usize, usize) -> f32) -> f64 {
        let shown = std::array::from_fn(|at| Vec3::splat(value(at % 32, at / 32)));
        let tile = Steps::new([32, 32], shown);
        (0..16).map(|block| tile.contrasts(block)).sum()
    }

    #[test]
    fn edges_along_rows_count_and_others_do_not() {
        // White below row 13, which is half white: three pixels of each column see a step of white in three channels.
        let step = |at: usize| [0.0, 0.5, 1.0][(at + 1).saturating_sub(13).min(2)];
        assert_eq!(contrasts(|_, y| step(y)), 3.0 * 32.0 * 3.0);
        assert_eq!(contrasts(|x, _| step(x)), 3.0 * 32.0 * 3.0);
        // Blurred over three pixels as well; an even slope, a slanted edge and single pixels do not.
        assert!(contrasts(|_, y| ((y as f32 - 12.0) / 3.0).clamp(0.0, 1.0)) > 300.0);
        assert_eq!(contrasts(|_, y| y as f32 / 32.0), 0.0);
        assert_eq!(contrasts(|x, y| (y as f32 - 8.0 - x as f32 / 4.0).clamp(0.0, 1.0)), 0.0);
        assert_eq!(contrasts(|x, y| ((x * 7 + y * 13) % 5) as f32 / 4.0), 0.0);
    }
}
