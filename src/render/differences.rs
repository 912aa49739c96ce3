//! What the two halves of the samples of a block's pixels differ by. In: the sums of a tile. Out: a number for a block, for
//! [`super::resolve`]: `sum (min(1, max(0, g_e even)) - min(1, max(0, g_o odd)))^2` over pixels and channels, `g_e` and `g_o`
//! being what makes the sum of either half what it shows; and whether any shows so much that [`super::clipped`] is to be asked.

use super::clipped;
use crate::picture::BLOCK;
use crate::raster::{LANES, TILE};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16};
use std::ops::Range;

/// Numbers of a pixel: three of its even samples, three of the odd ones.
pub(super) const NUMBERS: usize = 6;

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
pub(super) fn differences<S: Simd>(
    simd: S,
    numbers: &[f32],
    (columns, rows): (Range<u32>, Range<u32>),
    gains: [f32; 2],
) -> (f64, bool) {
    let zero = f32x16::splat(simd, 0.0);
    let [even_gain, odd_gain] = gains.map(|gain| f32x16::splat(simd, gain));
    let of_even = if columns.len() == BLOCK as usize { ALL_EVEN } else { of_even(columns.len()) };
    let is_even = of_even.map(|of_even| f32x16::load_array(simd, of_even).simd_gt(zero));
    let bright = f32x16::splat(simd, clipped::BRIGHT);
    let (mut sums, mut is_bright) = ([zero; REGISTERS], zero.simd_gt(zero));
    // The last row of a tile ends with its numbers.
    let mut last = [0.0; ROW + 3];
    for y in rows {
        let row = &numbers[(y * TILE + columns.start) as usize * NUMBERS..];
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
            is_bright |= is_even[register] & (even.simd_gt(bright) | odd.simd_gt(bright));
            let difference = is_even[register].select(shown(simd, even) - shown(simd, odd), zero);
            *sum += difference * difference;
        }
    }
    let mut all = 0.0;
    for sum in sums {
        for sum in sum.to_array() {
            all += f64::from(sum);
        }
    }
    (all, is_bright.any_true())
}

/// Clipped to black and white.
#[inline(always)]
pub(super) fn shown<S: Simd>(simd: S, light: f32x16<S>) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let light = light.simd_gt(zero).select(light, zero);
    light.simd_lt(one).select(light, one)
}

#[cfg(test)]
mod tests {
    use super::super::resolve::{Sum, places};
    use super::*;
    use crate::simd::{SimdLevel, at_level};
    use glam::Vec3;

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
}
