//! Where a tile shows edges along rows, columns or diagonals of pixels. In: its sums. Out: for each block the squared contrasts of such
//! edges, for [`super::edges`].

use super::differences::{self, NUMBERS};
use super::resolve::{BLOCKS, ByBlock, Sum, WIDTH};
use crate::picture::BLOCK;
use crate::raster::{LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, f32x8, f32x16};
use glam::{Mat4, Vec4};

/// So many pixels of a block must be alike along a diagonal for it to be an edge.
const FEWEST: u32 = 6;

/// How many pixels to both sides an edge's contrast is looked for.
const REACH: usize = 4;

/// Steps along an edge that runs as pixels do are at most this part of the steps across it.
const ALIGNED: f32 = 0.125;

/// A pixel is part of an edge if what changes there is at least this part of the contrast. An even slope has an eighth of it in
/// each step, one that begins or ends there a quarter; rows of wider blur make up for each other.
const PART: f32 = 0.3;

/// Of lights so many times as bright as white edges hide more than those of white. (Of an edge two or three rows count, and one is
/// where so small a part of the lens sees the light.)
const BRIGHT: f32 = 2.5;

/// No edge hides more than so many times what an edge of white does.
const MOST_TIMES: f32 = 40.0;

/// Of eight pixels beside each other so many need not see the edge.
const OTHERS: u32 = 1;

/// Pixels of a tile beside each other, with as many more on both sides as an edge's contrast is looked for.
const SIDE: usize = TILE as usize + 2 * REACH;

/// What a tile shows, channel by channel and row by row. What lies outside of the picture shows what is nearest to it inside.
pub(super) struct Shown {
    size: [usize; 2],
    channels: [[[f32; SIDE]; SIDE]; 3],
    /// Which pixels may be part of an edge across either axis: bit `y` of number `x`, and bit `x` of number `y`.
    edges: [[u32; TILE as usize]; 2],
    /// And of one along the diagonal that falls to the right, or rises: bit `x` of number `y`.
    diagonals: [[u32; TILE as usize]; 2],
    /// The most light of each block, in whites, where it is [`BRIGHT`] or more.
    pub(super) peaks: ByBlock<f32>,
}

impl Shown {
    #[inline(always)]
    pub(super) fn nothing(size: [usize; 2]) -> Self {
        Self {
            size,
            channels: [[[0.0; SIDE]; SIDE]; 3],
            edges: [[0; TILE as usize]; 2],
            diagonals: [[0; TILE as usize]; 2],
            peaks: ByBlock::default(),
        }
    }

    /// From the sums of a tile and, for each block, what they are to be multiplied by. (In place: 20 KB that went from function to
    /// function took 2 % of a picture with the error of 16 samples.)
    pub(super) fn fill(&mut self, level: Level, sums: &[Sum], scales: &ByBlock<f32>) {
        let [width, height] = self.size;
        let [red, green, blue] = &mut self.channels;
        for (y, row) in sums.chunks_exact(TILE as usize).enumerate().take(height) {
            let y = y + REACH;
            let (red, green, blue) = (&mut red[y][REACH..], &mut green[y][REACH..], &mut blue[y][REACH..]);
            let channels =
                red.chunks_exact_mut(4).zip(green.chunks_exact_mut(4)).zip(blue.chunks_exact_mut(4));
            for (four, ((red, green), blue)) in row.chunks_exact(4).zip(channels) {
                // Red, green and blue of the even samples, and of the odd ones after another number.
                let numbers = four.as_flattened().as_flattened();
                let of = |pixel: usize, first: usize| Vec4::from_slice(&numbers[NUMBERS * pixel + first..]);
                let even = Mat4::from_cols(of(0, 0), of(1, 0), of(2, 0), of(3, 0)).transpose();
                let odd = Mat4::from_cols(of(0, 2), of(1, 2), of(2, 2), of(3, 2)).transpose();
                (even.x_axis + odd.y_axis).write_to_slice(red);
                (even.y_axis + odd.z_axis).write_to_slice(green);
                (even.z_axis + odd.w_axis).write_to_slice(blue);
            }
        }
        at_level!(level, simd => show(simd, self, scales));
        for channel in &mut self.channels {
            for row in &mut channel[REACH..REACH + height] {
                let (first, last) = (row[REACH], row[REACH + width - 1]);
                row[..REACH].fill(first);
                row[REACH + width..].fill(last);
            }
            let (first, last) = (channel[REACH], channel[REACH + height - 1]);
            channel[..REACH].fill(first);
            channel[REACH + height..].fill(last);
        }
        at_level!(level, simd => mark(simd, self));
    }

    /// The colours of 16 pixels from column `x` of row `y` on, counted from the one before the tile's first.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, x: usize, y: usize) -> [f32x16<S>; 3] {
        let [red, green, blue] = &self.channels;
        let (x, y) = (x + REACH - 1, y + REACH - 1);
        [
            f32x16::from_slice(simd, &red[y][x..x + LANES]),
            f32x16::from_slice(simd, &green[y][x..x + LANES]),
            f32x16::from_slice(simd, &blue[y][x..x + LANES]),
        ]
    }

    /// The squares of the largest steps from 16 pixels to those beside them on the diagonal that falls to the right, and on that which rises.
    #[inline(always)]
    fn along<S: Simd>(&self, simd: S, (x, y): (usize, usize), here: [f32x16<S>; 3]) -> [f32x16<S>; 2] {
        let falls = larger(step(self.load(simd, x, y), here), step(here, self.load(simd, x + 2, y + 2)));
        let rises = larger(step(self.load(simd, x, y + 2), here), step(here, self.load(simd, x + 2, y)));
        [falls, rises]
    }

    /// The lesser of these for green, which is not more than for all colours.
    #[inline(always)]
    fn green<S: Simd>(&self, simd: S, (x, y): (usize, usize)) -> f32x16<S> {
        let [_, green, _] = &self.channels;
        let row = |x: usize, y: usize| &green[y + REACH - 1][x + REACH - 1..x + REACH - 1 + LANES];
        let here = f32x16::from_slice(simd, row(x + 1, y + 1));
        let [a, b] =
            [f32x16::from_slice(simd, row(x, y)) - here, f32x16::from_slice(simd, row(x + 2, y + 2)) - here];
        let [c, d] =
            [f32x16::from_slice(simd, row(x, y + 2)) - here, f32x16::from_slice(simd, row(x + 2, y)) - here];
        let (falls, rises) = (larger(a * a, b * b), larger(c * c, d * d));
        falls.simd_lt(rises).select(falls, rises)
    }

    /// Squared contrasts of the edges along rows and columns, and of those along diagonals, summed over the pixels of a block that
    /// they touch.
    #[inline(always)]
    pub(super) fn contrasts<S: Simd>(&self, simd: S, block: usize) -> [f64; 2] {
        let [first, ends] = self.corners(block);
        if first[0] >= ends[0] || first[1] >= ends[1] {
            return [0.0; 2];
        }
        let mut sum = 0.0;
        for axis in 0..2 {
            let beside = first[1 - axis]..ends[1 - axis];
            let all = u32::MAX >> (u32::BITS as usize - beside.len());
            // Row by row of the block.
            let mut found = [[0.0; WIDTH]; WIDTH];
            let mut is_found = false;
            for along in first[axis]..ends[axis] {
                let seen = self.edges[axis][along] >> beside.start & all;
                if (all & !seen).count_ones() > OTHERS {
                    continue;
                }
                if axis == 1 {
                    found[along - first[1]] = self.contrast::<S, 1>(simd, first[0], along);
                } else if !is_found {
                    for (y, found) in (first[1]..ends[1]).zip(&mut found) {
                        *found = self.contrast::<S, 0>(simd, first[0], y);
                    }
                    is_found = true;
                }
                let (mut others, mut squared) = (0, 0.0);
                for across in 0..beside.len() {
                    let at = along - first[axis];
                    let [x, y] = if axis == 0 { [at, across] } else { [across, at] };
                    let contrast = if seen >> across & 1 == 1 { found[y][x] } else { 0.0 };
                    others += u32::from(contrast == 0.0);
                    squared += f64::from(contrast);
                }
                if others <= OTHERS {
                    sum += squared;
                }
            }
        }
        let sums = [sum, self.along_diagonals(simd, first, ends)];
        if sums == [0.0; 2] { sums } else { sums.map(|sum| sum * self.times_white(block as u32)) }
    }

    /// The squared contrasts of edges along diagonals between these columns and rows, summed over the pixels that they touch.
    #[inline(always)]
    fn along_diagonals<S: Simd>(&self, simd: S, first: [usize; 2], ends: [usize; 2]) -> f64 {
        let all = u32::MAX >> (u32::BITS as usize - (ends[0] - first[0]));
        let mut sum = 0.0;
        for diagonal in &self.diagonals {
            // What is alike on both sides of a step: along an edge of another slope a pixel beside it may be, by itself.
            let both = |row: u32| row & (row << 1 | row >> 1);
            let seen = |y: usize| both(diagonal[y]) >> first[0] & all;
            if (first[1]..ends[1]).map(|y| seen(y).count_ones()).sum::<u32>() < FEWEST {
                continue;
            }
            for y in first[1]..ends[1] {
                let seen = seen(y);
                if seen == 0 {
                    continue;
                }
                let contrasts = self.contrast::<S, 0>(simd, first[0], y);
                let of_edge = contrasts.into_iter().enumerate().filter(|(x, _)| seen >> x & 1 == 1);
                sum += of_edge.map(|(_, contrast)| f64::from(contrast)).sum::<f64>();
            }
        }
        sum
    }

    /// The first column and row of a block, and the ends of its columns and rows within the tile.
    #[inline(always)]
    fn corners(&self, block: usize) -> [[usize; 2]; 2] {
        let side = BLOCKS as usize;
        let first = [block % side * WIDTH, block / side * WIDTH];
        [first, [0, 1].map(|axis: usize| (first[axis] + WIDTH).min(self.size[axis]))]
    }

    /// The squared light that a block shows, all channels of all pixels; of white none, which does not change with a little less light.
    pub(super) fn light(&self, block: usize) -> f64 {
        let [first, ends] = self.corners(block);
        let rows = self.channels.iter().flat_map(|channel| (first[1]..ends[1]).map(|y| &channel[y + REACH]));
        let lights = rows.flat_map(|row| row.iter().take(ends[0] + REACH).skip(first[0] + REACH));
        lights.filter(|&&light| light < 1.0).map(|&light| f64::from(light) * f64::from(light)).sum()
    }

    /// The pixels of a block.
    pub(super) fn pixels(&self, block: usize) -> f64 {
        let [first, ends] = self.corners(block);
        [0, 1].map(|axis: usize| ends[axis].saturating_sub(first[axis]) as f64).iter().product()
    }

    /// How much more edges of a block may hide, by the lights near it.
    fn times_white(&self, block: u32) -> f64 {
        let around = |at: u32| at.saturating_sub(1)..=(at + 1).min(BLOCKS - 1);
        let (columns, rows) = (around(block % BLOCKS), around(block / BLOCKS));
        let blocks = rows.flat_map(|y| columns.clone().map(move |x| (y * BLOCKS + x) as usize));
        let peak = blocks.fold(0.0, |peak: f32, block| peak.max(self.peaks[block]));
        f64::from((peak / BRIGHT).clamp(1.0, MOST_TIMES))
    }

    /// The squared contrasts along an axis at the pixels of a block's row from column `x` of row `y` on, 0 where one is not part of
    /// an edge across that axis.
    #[inline(always)]
    fn contrast<S: Simd, const AXIS: usize>(&self, simd: S, x: usize, y: usize) -> [f32; WIDTH] {
        let zero = f32x8::splat(simd, 0.0);
        let (mut contrast, mut into, mut out) = (zero, zero, zero);
        for channel in &self.channels {
            let here = eight::<S, AXIS>(simd, channel, (x, y), REACH);
            let (mut low, mut high) = (here, here);
            for step in 0..=2 * REACH {
                let there = eight::<S, AXIS>(simd, channel, (x, y), step);
                (low, high) = (low.min(there), high.max(there));
            }
            let before = eight::<S, AXIS>(simd, channel, (x, y), REACH - 1);
            let after = eight::<S, AXIS>(simd, channel, (x, y), REACH + 1);
            contrast += (high - low) * (high - low);
            into += (here - before) * (here - before);
            out += (after - here) * (after - here);
        }
        let is_part = into.max(out).simd_ge(contrast * (PART * PART));
        is_part.select(contrast, zero).to_array()
    }
}

/// Eight pixels of a row from column `x` of row `y` on, so many further along an axis than [`REACH`] before them.
#[inline(always)]
fn eight<S: Simd, const AXIS: usize>(
    simd: S,
    channel: &[[f32; SIDE]; SIDE],
    (x, y): (usize, usize),
    step: usize,
) -> f32x8<S> {
    let (x, y) = if AXIS == 0 { (x + step, y + REACH) } else { (x + REACH, y + step) };
    f32x8::from_slice(simd, &channel[y][x..x + WIDTH])
}

/// Makes sums what is shown of them.
#[inline(always)]
fn show<S: Simd>(simd: S, shown: &mut Shown, scales: &ByBlock<f32>) {
    for y in 0..shown.size[1] {
        for x in (0..TILE as usize).step_by(LANES) {
            let mut scale = [0.0; LANES];
            for (lane, scale) in scale.iter_mut().enumerate() {
                *scale = scales[y / BLOCK as usize * BLOCKS as usize + (x + lane) / BLOCK as usize];
            }
            let scale = f32x16::load_array(simd, scale);
            let mut most = f32x16::splat(simd, 0.0);
            for channel in &mut shown.channels {
                let row = &mut channel[y + REACH][x + REACH..x + REACH + LANES];
                let light = f32x16::from_slice(simd, row) * scale;
                most = larger(most, light);
                differences::shown(simd, light).store_slice(row);
            }
            if most.simd_gt(f32x16::splat(simd, BRIGHT)).any_true() {
                for (lane, most) in most.to_array().into_iter().enumerate() {
                    let peak =
                        &mut shown.peaks[y / BLOCK as usize * BLOCKS as usize + (x + lane) / BLOCK as usize];
                    *peak = peak.max(most);
                }
            }
        }
    }
}

/// Finds the pixels that change along one axis and hardly along the other, and those that hardly change along a diagonal.
#[inline(always)]
fn mark<S: Simd>(simd: S, shown: &mut Shown) {
    let zero = f32x16::splat(simd, 0.0);
    for y in 0..shown.size[1] {
        for x in (0..TILE as usize).step_by(LANES) {
            let here = shown.load(simd, x + 1, y + 1);
            let right =
                larger(step(shown.load(simd, x, y + 1), here), step(here, shown.load(simd, x + 2, y + 1)));
            let down =
                larger(step(shown.load(simd, x + 1, y), here), step(here, shown.load(simd, x + 1, y + 2)));
            let columns = right.simd_gt(zero) & down.simd_le(right * (ALIGNED * ALIGNED));
            let rows = down.simd_gt(zero) & right.simd_le(down * (ALIGNED * ALIGNED));
            shown.edges[1][y] |= (rows.to_bitmask() as u32) << x;
            // Green alone rules out nearly all (with three channels at once Sponza took 2 % longer).
            let least = larger(right, down) * (ALIGNED * ALIGNED);
            let some = least.simd_gt(zero) & shown.green(simd, (x, y)).simd_le(least);
            if some.any_true() {
                let [falls, rises] = shown.along(simd, (x, y), here);
                shown.diagonals[0][y] |= ((some & falls.simd_le(least)).to_bitmask() as u32) << x;
                shown.diagonals[1][y] |= ((some & rises.simd_le(least)).to_bitmask() as u32) << x;
            }
            let mut rest = columns.to_bitmask();
            while rest != 0 {
                shown.edges[0][x + rest.trailing_zeros() as usize] |= 1 << y;
                rest &= rest - 1;
            }
        }
    }
}

#[inline(always)]
fn larger<S: Simd>(a: f32x16<S>, b: f32x16<S>) -> f32x16<S> {
    a.simd_gt(b).select(a, b)
}

/// The squares of the steps from 16 pixels to 16 others.
#[inline(always)]
fn step<S: Simd>(from: [f32x16<S>; 3], to: [f32x16<S>; 3]) -> f32x16<S> {
    let (r, g, b) = (to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    r * r + g * g + b * b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::SimdLevel;

    fn contrasts(value: impl Fn(usize, usize) -> f32) -> f64 {
        let level = SimdLevel::best().level();
        let sums: Vec<_> = (0..1024).map(|at| [[value(at % 32, at / 32); 3], [0.0; 3]]).collect();
        let mut tile = Shown::nothing([32, 32]);
        tile.fill(level, &sums, &[1.0; 16]);
        at_level!(level, simd => (0..16).map(|block| tile.contrasts(simd, block).iter().sum::<f64>()).sum())
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
        assert_eq!(contrasts(|x, y| ((x * 3 + y) % 7) as f32 / 6.0), 0.0);
    }

    #[test]
    fn edges_along_diagonals_count_and_those_of_other_slopes_do_not() {
        // Two pixels of each row see a step of white in three channels; at the tile's border not all are known to be alike.
        let beyond = |beyond: f32| (beyond + 0.5).clamp(0.0, 1.0);
        for found in [
            contrasts(|x, y| beyond(y as f32 - x as f32)),
            contrasts(|x, y| beyond(y as f32 + x as f32 - 33.0)),
            contrasts(|x, y| beyond(0.998 * y as f32 - x as f32)),
        ] {
            assert!((2.0 * 24.0 * 3.0..=3.0 * 32.0 * 3.0).contains(&found), "{found}");
        }
        assert_eq!(contrasts(|x, y| beyond(0.5 * y as f32 - x as f32 + 8.0)), 0.0);
        assert_eq!(contrasts(|x, y| beyond(0.7 * y as f32 - x as f32 + 4.0)), 0.0);
        assert_eq!(contrasts(|x, y| (x + y) as f32 / 64.0), 0.0);
    }

    #[test]
    fn light_is_that_of_the_blocks_pixels_but_of_white() {
        let level = SimdLevel::best().level();
        let sums: Vec<_> =
            (0..1024).map(|at| [[if at % 32 < 20 { 0.25 } else { 1.5 }; 3], [0.0; 3]]).collect();
        let mut tile = Shown::nothing([30, 9]);
        tile.fill(level, &sums, &[1.0; 16]);
        let block = |pixels: f64| 3.0 * pixels * 0.25 * 0.25;
        let found: Vec<f64> = (0..6).map(|block| tile.light(block)).collect();
        assert_eq!(found, [block(64.0), block(64.0), block(32.0), 0.0, block(8.0), block(8.0)]);
    }
}
