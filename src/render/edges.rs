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
const BLURRED: f64 = 0.06;
const SHARP: f64 = 1.2 / 3.0;

/// How many pixels to both sides an edge's contrast is looked for: as far as blur is so narrow that its rows do not make up for
/// each other.
const REACH: usize = 3;

/// Steps along an edge that runs as pixels do are at most this part of the steps across it.
const ALIGNED: f32 = 0.125;

/// A pixel is part of the edge if what changes there is at least this part of the contrast.
const PART: f32 = 1.0 / 16.0;

/// An even slope is no edge: some step is at least so many times what each would have of the contrast if all were alike.
const STEEP: f32 = 4.0 / 3.0;

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

impl Picture<'_> {
    /// Raises the errors of the blocks with `samples` (of all, and of those that count) to what their edges may hide.
    pub(super) fn raise_edges(
        &self,
        (tx, ty): (u32, u32),
        sums: &[[Vec3; 2]],
        (all, changed): (&ByBlock<u32>, &ByBlock<u32>),
        squared: &mut ByBlock<f64>,
    ) {
        let size =
            [self.view.width - tx * TILE, self.view.height - ty * TILE].map(|size| size.min(TILE) as usize);
        let tile = Steps::new(size, |x, y| {
            let n = all[y / BLOCK as usize * BLOCKS as usize + x / BLOCK as usize].max(1);
            let [a, b] = sums.get(y * TILE as usize + x).copied().unwrap_or_default();
            ((a + b) * (self.gain / n as f32)).clamp(Vec3::ZERO, Vec3::ONE)
        });
        for (block, squared) in squared.iter_mut().enumerate().filter(|&(block, _)| changed[block] > 1) {
            let n = f64::from(changed[block]);
            let missed =
                if self.view.radius > 0.0 { BLURRED / libm::pow(n, 4.0 / 3.0) } else { SHARP / (n * n) };
            *squared = squared.max(missed * tile.contrasts(block));
        }
    }
}

impl Steps {
    fn new(size: [usize; 2], value: impl Fn(usize, usize) -> Vec3) -> Self {
        let mut shown = [Vec3::ZERO; (TILE * TILE) as usize];
        for y in 0..size[1] {
            for x in 0..size[0] {
                shown[y * TILE as usize + x] = value(x, y);
            }
        }
        let mut steps = [[0.0; (TILE * TILE) as usize]; 2];
        for (axis, steps) in steps.iter_mut().enumerate() {
            let ends = [size[0] - usize::from(axis == 0), size[1] - usize::from(axis == 1)];
            for y in 0..ends[1] {
                for at in (0..ends[0]).map(|x| y * TILE as usize + x) {
                    steps[at] = (shown[at + STRIDE[axis]] - shown[at]).length_squared();
                }
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
                let row = beside.clone().map(|across| self.contrast(axis, along, across));
                let (count, squared) = row.fold((0, 0.0), |(count, squared), contrast| {
                    (count + usize::from(contrast > 0.0), squared + f64::from(contrast))
                });
                if count * BLOCK as usize >= ROW * beside.len() {
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
        let window = [along.saturating_sub(REACH), (along + REACH).min(self.size[axis] - 1)];
        let steepest =
            (window[0]..window[1]).map(|near| self.steps[axis][line + near * stride]).fold(0.0, f32::max);
        if own(1 - axis, across) > ALIGNED * ALIGNED * steepest {
            return 0.0;
        }
        let (mut low, mut high) = (self.shown[here], self.shown[here]);
        for value in (window[0]..=window[1]).map(|near| self.shown[line + near * stride]) {
            (low, high) = (low.min(value), high.max(value));
        }
        let contrast = (high - low).length_squared();
        let steep = STEEP / (window[1] - window[0]) as f32;
        let is_edge = change >= PART * PART * contrast && steepest >= steep * steep * contrast;
        if is_edge { contrast } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contrasts(value: impl Fn(usize, usize) -> f32) -> f64 {
        let tile = Steps::new([32, 32], |x, y| Vec3::splat(value(x, y)));
        (0..16).map(|block| tile.contrasts(block)).sum()
    }

    #[test]
    fn edges_along_rows_count_and_others_do_not() {
        // White below row 13, which is half white: three pixels of each column see a step of white in three channels.
        let step = |at: usize| [0.0, 0.5, 1.0][(at + 1).saturating_sub(13).min(2)];
        assert_eq!(contrasts(|_, y| step(y)), 3.0 * 32.0 * 3.0);
        assert_eq!(contrasts(|x, _| step(x)), 3.0 * 32.0 * 3.0);
        // Blurred over four pixels as well; an even slope, a slanted edge and single pixels do not.
        assert!(contrasts(|_, y| ((y as f32 - 12.0) / 4.0).clamp(0.0, 1.0)) > 300.0);
        assert_eq!(contrasts(|_, y| y as f32 / 32.0), 0.0);
        assert_eq!(contrasts(|x, y| (y as f32 - 8.0 - x as f32 / 4.0).clamp(0.0, 1.0)), 0.0);
        assert_eq!(contrasts(|x, y| ((x * 7 + y * 13) % 5) as f32 / 4.0), 0.0);
    }
}
