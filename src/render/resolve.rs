//! From sums to a picture: means out, and what the two halves of the samples say of their error.
//!
//! In: the sums of even and odd samples of a tile's pixels ([`super::draw`]). Out: `mean = (even + odd) / n`; and for each block
//! the squared error, summed over its pixels and channels, `(n_e n_o / n^2) sum (shown(even / n_e) - shown(odd / n_o))^2`, where
//! `shown` brightens and clips to 0..1 ([`super::differences`]). Where light is clipped [`super::clipped`] tells more;
//! [`super::highlights`] and, in rounds, [`super::edges`] raise what is found. [`super::uniform`] and [`super::finish`] take it
//! from here.

use super::clipped::{self, Halves};
use super::differences::{NUMBERS, differences};
use super::prepared::Prepared;
use crate::picture::BLOCK;
use crate::raster::TILE;
use crate::simd::at_level;
use glam::{Vec3, Vec4};
use std::ops::Range;

/// Pixels beside each other in a block.
pub(super) const WIDTH: usize = BLOCK as usize;

/// Pixels of a tile.
pub(super) const AREA: usize = (TILE * TILE) as usize;

/// Blocks on the side of a tile.
pub(super) const BLOCKS: u32 = TILE / BLOCK;

/// Column and row in the picture of a block of a tile, counted in blocks.
pub(super) fn block_place((tx, ty): (u32, u32), block: usize) -> (u32, u32) {
    (tx * BLOCKS + block as u32 % BLOCKS, ty * BLOCKS + block as u32 / BLOCKS)
}

/// The light of a pixel's samples, of the even and the odd ones. (Arrays and not vectors: memory of these comes zeroed from the
/// system, page by page as it is used.)
pub(super) type Sum = [[f32; 3]; 2];

/// A number for each block of a tile, row by row.
pub(super) type ByBlock<T> = [T; (BLOCKS * BLOCKS) as usize];

/// The numbers in a tile of the pixels in these columns and rows of it.
pub(super) fn places(columns: Range<u32>, rows: Range<u32>) -> impl Iterator<Item = usize> {
    rows.flat_map(move |y| columns.clone().map(move |x| (y * TILE + x) as usize))
}

impl Prepared<'_> {
    /// The columns and rows of a tile's pixels that a block of it has in the picture.
    pub(super) fn pixels_of(&self, (tx, ty): (u32, u32), block: usize) -> (Range<u32>, Range<u32>) {
        let (left, top) = (block as u32 % BLOCKS * BLOCK, block as u32 / BLOCKS * BLOCK);
        let (width, height) = (self.view.width - tx * TILE, self.view.height - ty * TILE);
        (left..(left + BLOCK).min(width), top..(top + BLOCK).min(height))
    }

    /// What the sums of a tile say of their error: squared, summed over the pixels and channels of each block; `samples` for each
    /// pixel of a block. Each pixel's own error goes to `errors`, where there are any.
    ///
    /// Half of the samples are an independent estimate of the picture, and so is the other half; the mean weighs them
    /// by their sizes, and for equal halves its squared error is a quarter of their squared difference.
    pub(super) fn resolve(
        &self,
        tile: (u32, u32),
        sums: &[Sum],
        samples: &ByBlock<u32>,
        mut errors: Option<&mut [f32]>,
    ) -> ByBlock<f64> {
        let gains = |n: u32| [n.div_ceil(2), n / 2].map(|n| self.gain / n as f32);
        let (mut squared, mut is_bright) = (ByBlock::default(), ByBlock::default());
        let numbers = sums.as_flattened().as_flattened();
        at_level!(self.level, simd => {
            for (block, &n) in samples.iter().enumerate().filter(|(_, n)| **n > 1) {
                let pixels = self.pixels_of(tile, block);
                (squared[block], is_bright[block]) = differences(simd, numbers, pixels, gains(n));
            }
        });
        for (block, &n) in samples.iter().enumerate().filter(|(_, n)| **n > 1) {
            let (columns, rows) = self.pixels_of(tile, block);
            let places = || places(columns.clone(), rows.clone());
            squared[block] *= clipped::share(n);
            let is_bright = is_bright[block] && !self.is_unseen(tile, block, n);
            if !is_bright && errors.is_none() {
                continue;
            }
            let [even_gain, odd_gain] = gains(n);
            let halves = |at: usize| {
                let [even, odd] = sums.get(at)?.map(Vec3::from_array);
                Some([even * even_gain, odd * odd_gain])
            };
            let pixels = places().filter_map(halves).collect();
            let halves = Halves { width: columns.len(), samples: n, pixels };
            let mut found = if is_bright { halves.errors() } else { halves.differences() };
            if is_bright {
                let all: f64 = found.iter().sum();
                let most =
                    self.most_by_lights(tile, block, (sums, n)).map_or(all, |most| most.max(squared[block]));
                if all > most {
                    found.iter_mut().for_each(|error| *error *= most / all);
                }
                squared[block] = all.min(most);
            }
            if let Some(errors) = &mut errors {
                for (at, error) in places().zip(found) {
                    errors[at] = (error / 3.0).sqrt() as f32;
                }
            }
        }
        squared
    }

    /// Raises the errors of a tile's pixels from what was `found` for its blocks to what is `stated`, where that is more.
    pub(super) fn raise_errors(
        &self,
        tile: (u32, u32),
        (found, stated): (&ByBlock<f64>, &ByBlock<f64>),
        errors: &mut [f32],
    ) {
        for block in 0..stated.len() {
            self.raise_block(tile, block, (found[block], stated[block]), errors);
        }
    }

    /// Raises the errors of a block's pixels from what was `found` to what is `stated` for the block, if that is more.
    fn raise_block(&self, tile: (u32, u32), block: usize, (found, stated): (f64, f64), errors: &mut [f32]) {
        if stated <= found {
            return;
        }
        let (columns, rows) = self.pixels_of(tile, block);
        let even = (stated / (3 * columns.len() * rows.len()) as f64).sqrt() as f32;
        let times = if found > 0.0 { (stated / found).sqrt() as f32 } else { 0.0 };
        for at in places(columns, rows) {
            if let Some(error) = errors.get_mut(at) {
                *error = if found > 0.0 { *error * times } else { even };
            }
        }
    }

    /// How many of a tile's columns and rows are in the picture.
    pub(super) fn size_of(&self, (tx, ty): (u32, u32)) -> [u32; 2] {
        [self.view.width - tx * TILE, self.view.height - ty * TILE].map(|size| size.min(TILE))
    }
}

/// The means of sums of so many samples, pixel by pixel. Four numbers at a time, of which the fourth is overwritten by the next
/// pixel's first.
pub(super) fn means_of(sums: &[Sum], samples: u32, out: &mut [[f32; 3]]) {
    let n = Vec4::splat(samples.max(1) as f32);
    let mean = |even: [f32; 4], odd: [f32; 4]| (Vec4::from_array(even) + Vec4::from_array(odd)) / n;
    let numbers = sums.as_flattened().as_flattened().chunks_exact(NUMBERS);
    let (out, mut at) = (out.as_flattened_mut(), 0);
    for (pixel, next) in numbers.clone().zip(numbers.skip(1)) {
        let odd = [pixel[3], pixel[4], pixel[5], next[0]];
        if let Some(out) = out.get_mut(at..at + 4) {
            out.copy_from_slice(&mean([pixel[0], pixel[1], pixel[2], 0.0], odd).to_array());
        }
        at += 3;
    }
    if let (Some([even, odd]), Some(last)) = (sums.last(), out.get_mut(at..at + 3)) {
        let mean = mean([even[0], even[1], even[2], 0.0], [odd[0], odd[1], odd[2], 0.0]);
        last.copy_from_slice(&mean.to_array()[..3]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_of_both_halves() {
        let number = |at: usize| (at * 7919 % 1000) as f32 / 400.0 - 0.25;
        let sum =
            |at: usize| [0, 3].map(|half| [0, 1, 2].map(|channel| number(at * NUMBERS + half + channel)));
        let tile: Vec<Sum> = (0..(TILE * TILE) as usize).map(sum).collect();
        let mut means = vec![[9.0; 3]; tile.len()];
        means_of(&tile, 3, &mut means);
        for (at, (mean, [even, odd])) in means.iter().zip(&tile).enumerate() {
            let wanted: [f32; 3] = std::array::from_fn(|channel| (even[channel] + odd[channel]) / 3.0);
            assert_eq!(*mean, wanted, "{at}");
        }
    }
}
