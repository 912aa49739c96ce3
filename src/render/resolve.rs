//! From sums to a picture: means out, and what the two halves of the samples say of their error.

use super::clipped::{self, Halves};
use super::picture::Picture;
use crate::picture::BLOCK;
use crate::raster::{LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16};
use glam::{Vec3, Vec4};
use std::ops::Range;

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

impl Picture<'_> {
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
            let halves = |at: usize| {
                let halves = sums.get(at)?.map(Vec3::from_array);
                Some([0, 1].map(|half| halves[half] * gains(n)[half]))
            };
            squared[block] *= clipped::share(n);
            let is_bright = is_bright[block] && !self.is_unseen(tile, block, n);
            if !is_bright && errors.is_none() {
                continue;
            }
            let pixels = places().filter_map(halves).collect();
            let halves = Halves { width: columns.len(), samples: n, pixels };
            let found = if is_bright { halves.errors() } else { halves.differences() };
            if is_bright {
                squared[block] = found.iter().sum();
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
    pub(super) fn spread_all(
        &self,
        tile: (u32, u32),
        (found, stated): (&ByBlock<f64>, &ByBlock<f64>),
        errors: &mut [f32],
    ) {
        for block in 0..stated.len() {
            self.spread(tile, block, (found[block], stated[block]), errors);
        }
    }

    /// Raises the errors of a block's pixels from what was `found` to what is `stated` for the block, if that is more.
    fn spread(&self, tile: (u32, u32), block: usize, (found, stated): (f64, f64), errors: &mut [f32]) {
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

/// Makes a tile's pixels 0 that are not among so many columns and rows.
pub(super) fn clear_outside([width, height]: [u32; 2], pixels: &mut [[f32; 3]]) {
    for (y, row) in pixels.chunks_exact_mut(TILE as usize).enumerate() {
        let inside = if y < height as usize { width as usize } else { 0 };
        row[inside..].fill([0.0; 3]);
    }
}

/// Numbers of a pixel: three of its even samples, three of the odd ones.
const NUMBERS: usize = 6;

/// Numbers of a row of a block's pixels, and registers that hold them.
const ROW: usize = BLOCK as usize * NUMBERS;
const REGISTERS: usize = ROW / LANES;

/// 1 where a number is one of the even samples of that many pixels.
const fn of_even(pixels: usize) -> [[f32; LANES]; REGISTERS] {
    let (mut all, mut at) = ([[0.0; LANES]; REGISTERS], 0);
    while at < pixels * NUMBERS {
        all[at / LANES][at % LANES] = if at % NUMBERS < 3 { 1.0 } else { 0.0 };
        at += 1;
    }
    all
}

const ALL_EVEN: [[f32; LANES]; REGISTERS] = of_even(BLOCK as usize);

/// What the two halves of some pixels of a block, times their gains, differ by where they are shown: squared, summed over
/// pixels and channels. And whether any is so bright that clipping counts.
///
/// The halves lie one after the other, so what lies three numbers further is the other half. (Pixel by pixel this took 3 % of the
/// city's time at 64 samples.)
#[inline(always)]
fn differences<S: Simd>(
    simd: S,
    numbers: &[f32],
    (columns, rows): (Range<u32>, Range<u32>),
    gains: [f32; 2],
) -> (f64, bool) {
    let zero = f32x16::splat(simd, 0.0);
    let [even_gain, odd_gain] = gains.map(|gain| f32x16::splat(simd, gain));
    let of_even = if columns.len() == BLOCK as usize { ALL_EVEN } else { of_even(columns.len()) };
    let is_even = of_even.map(|of_even| f32x16::load_array(simd, of_even).simd_gt(zero));
    let (mut sums, mut most) = ([zero; REGISTERS], zero);
    for y in rows {
        let row = &numbers[(y * TILE + columns.start) as usize * NUMBERS..];
        // The last row of a tile ends with its numbers.
        let mut last = [0.0; ROW + 3];
        let row = match row.first_chunk() {
            Some(row) => row,
            None => {
                last[..ROW].copy_from_slice(&row[..ROW]);
                &last
            }
        };
        for (register, sum) in sums.iter_mut().enumerate() {
            let at = register * LANES;
            let even = f32x16::from_slice(simd, &row[at..at + LANES]) * even_gain;
            let odd = f32x16::from_slice(simd, &row[at + 3..at + 3 + LANES]) * odd_gain;
            most = is_even[register].select(most.max(even.max(odd)), most);
            let difference = is_even[register].select(shown(simd, even) - shown(simd, odd), zero);
            *sum += difference * difference;
        }
    }
    let is_bright = most.simd_gt(f32x16::splat(simd, clipped::BRIGHT)).any_true();
    let mut all = 0.0;
    for sum in sums {
        for sum in sum.to_array() {
            all += f64::from(sum);
        }
    }
    (all, is_bright)
}

/// Clipped to black and white.
#[inline(always)]
fn shown<S: Simd>(simd: S, light: f32x16<S>) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let light = light.simd_gt(zero).select(light, zero);
    light.simd_lt(one).select(light, one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::SimdLevel;

    /// A tile of halves from below black to twice white.
    fn tile() -> Vec<Sum> {
        let number = |at: usize| (at * 7919 % 1000) as f32 / 400.0 - 0.25;
        (0..TILE as usize * TILE as usize)
            .map(|at| [0, 3].map(|half| std::array::from_fn(|channel| number(at * NUMBERS + half + channel))))
            .collect()
    }

    #[test]
    fn differences_are_those_of_shown_halves_at_every_level() {
        let (tile, gains) = (tile(), [0.5, 0.25]);
        for (columns, rows) in
            [(0..8, 0..8), (24..32, 24..32), (8..13, 16..24), (24..25, 31..32), (8..8, 0..8)]
        {
            let mut wanted = 0.0;
            for at in places(columns.clone(), rows.clone()) {
                let [even, odd] = [0, 1].map(|half| {
                    (Vec3::from_array(tile[at][half]) * gains[half]).clamp(Vec3::ZERO, Vec3::ONE)
                });
                wanted += f64::from((even - odd).length_squared());
            }
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                let numbers = tile.as_flattened().as_flattened();
                let found = at_level!(level.level(), simd => {
                    differences(simd, numbers, (columns.clone(), rows.clone()), gains)
                });
                assert!(
                    (found.0 - wanted).abs() <= 1e-6 * wanted,
                    "{level:?} {columns:?}: {found:?} {wanted}"
                );
                assert!(!found.1);
            }
        }
    }

    #[test]
    fn one_bright_half_is_told_and_what_lies_beside_the_block_is_not() {
        for (at, half, is_within) in [(9, 0, true), (9, 1, true), (8, 1, false), (13, 0, false)] {
            let mut tile = tile();
            tile[at][half][2] = 8.0;
            let numbers = tile.as_flattened().as_flattened();
            let found = at_level!(SimdLevel::best().level(), simd => {
                differences(simd, numbers, (9..13, 0..8), [0.5; 2])
            });
            assert_eq!(found.1, is_within, "{at} {half}");
        }
    }

    #[test]
    fn means_are_of_both_halves_and_nothing_is_left_outside() {
        let tile = tile();
        let mut means = vec![[9.0; 3]; tile.len()];
        means_of(&tile, 3, &mut means);
        clear_outside([20, 30], &mut means);
        for (at, (mean, [even, odd])) in means.iter().zip(&tile).enumerate() {
            let is_inside = at % 32 < 20 && at / 32 < 30;
            let wanted: [f32; 3] = std::array::from_fn(|channel| (even[channel] + odd[channel]) / 3.0);
            assert_eq!(*mean, if is_inside { wanted } else { [0.0; 3] }, "{at}");
        }
    }
}
