//! A finished exposure: linear light, with the error that it estimates of itself.

mod allocation;
mod encode;

pub(crate) use allocation::check_samples;
pub use allocation::{Allocation, BLOCK, BlockSamples};
pub use encode::Notes;

use crate::error::{Error, ErrorKind, Result};
use crate::sampling::{GRID as TILE, MAX_SIDE};

/// The mean radiance of every pixel, linear, before exposure compensation.
#[derive(Clone, Debug)]
pub struct Exposure {
    width: u32,
    height: u32,
    /// Tile by tile, each of `TILE * TILE` pixels row by row, so that each tile is drawn in its own place.
    pixels: Vec<[f32; 3]>,
    rms_error: Option<f64>,
    /// As `pixels`; empty unless asked for.
    errors: Vec<f32>,
    samples: Allocation,
}

/// Whether a picture can have this size.
///
/// # Errors
/// [`ErrorKind::Invalid`] when it has no pixels; [`ErrorKind::TooLarge`] when a side has more than [`MAX_SIDE`]: beyond it places of pixels
/// have no number.
pub(crate) fn check_size(width: u32, height: u32) -> Result<()> {
    if width.min(height) == 0 {
        let message = format!("a picture of {width} x {height} pixels has none");
        return Err(Error::invalid(message).remedy("give at least 1"));
    }
    if width.max(height) > MAX_SIDE {
        let message = format!("a picture of {width} x {height} pixels; a side has at most {MAX_SIDE} pixels");
        return Err(Error::new(ErrorKind::TooLarge, message).remedy("give a smaller width"));
    }
    Ok(())
}

impl Exposure {
    pub(crate) fn new(
        (width, height): (u32, u32),
        pixels: Vec<[f32; 3]>,
        errors: Vec<f32>,
        rms_error: Option<f64>,
        samples: Allocation,
    ) -> Self {
        Self { width, height, pixels, rms_error, errors, samples }
    }

    /// A picture made elsewhere: linear light, row by row from the top left; black where rows are missing, and without those that are
    /// too many.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] when a side has more than [`MAX_SIDE`] pixels, or there is not so much memory;
    /// [`ErrorKind::Invalid`] when one has none, or `samples` are those of a picture of another size.
    pub fn from_rows(width: u32, height: u32, rows: &[[f32; 3]], samples: Allocation) -> Result<Self> {
        check_size(width, height)?;
        if let Allocation::Blocks(blocks) = &samples
            && blocks.size() != (width, height)
        {
            return Err(Error::invalid("the numbers of samples are those of a picture of another size")
                .remedy("give those of this one"));
        }
        let too_large = || {
            Error::new(ErrorKind::TooLarge, format!("a picture of {width} x {height} pixels is too large"))
        };
        let whole = |side: u32| side.div_ceil(TILE) as usize * TILE as usize;
        let (mut pixels, count) = (Vec::new(), whole(width) * whole(height));
        pixels.try_reserve_exact(count).map_err(|_| too_large())?;
        pixels.resize(count, [0.0; 3]);
        let mut exposure = Self::new((width, height), Vec::new(), Vec::new(), None, samples);
        for (row, y) in rows.chunks(width.max(1) as usize).zip(0..height) {
            for (pixel, x) in row.iter().zip(0..width) {
                if let Some(slot) = exposure.at(x, y).and_then(|at| pixels.get_mut(at)) {
                    *slot = *pixel;
                }
            }
        }
        exposure.pixels = pixels;
        Ok(exposure)
    }

    /// The root mean square difference from another picture of the same size, over all pixels and channels, both clamped to
    /// 0..1 after `exposure_ev` stops. (Where the other is smaller it is taken for black.)
    pub fn rms_difference(&self, other: &Self, exposure_ev: f64) -> f64 {
        let gain = libm::exp2(exposure_ev) as f32;
        let shown = |c: f32| f64::from((c * gain).clamp(0.0, 1.0));
        let pixels = (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        let squares = pixels.map(|(x, y)| {
            let channels = self.pixel(x, y).into_iter().zip(other.pixel(x, y));
            channels.map(|(a, b)| shown(a) - shown(b)).map(|gap| gap * gap).sum::<f64>()
        });
        (squares.sum::<f64>() / (3.0 * f64::from(self.width) * f64::from(self.height))).sqrt()
    }

    /// The root mean square difference of what two ways to draw come to with infinitely many samples, as
    /// [`Exposure::rms_difference`], from two pictures of each way, all of one size: `[estimate, upper bound]`, the bound with two
    /// standard errors, by the blocks of 8 x 8 pixels. `ours[i]` and `theirs[i]` may share a seed; those of 0 and of 1 must not: the mean of
    /// products of two independent differences has no noise in it.
    pub fn rms_change(ours: [&Self; 2], theirs: [&Self; 2], exposure_ev: f64) -> [f64; 2] {
        let gain = libm::exp2(exposure_ev) as f32;
        let shown = |c: f32| f64::from((c * gain).clamp(0.0, 1.0));
        let (width, height) = (ours[0].width, ours[0].height);
        let product = |x: u32, y: u32| {
            let change = [0, 1].map(|i: usize| {
                let [ours, theirs] = [ours, theirs].map(|pictures| pictures[i].pixel(x, y).map(shown));
                [0, 1, 2].map(|c: usize| ours[c] - theirs[c])
            });
            (0..3).map(|c| change[0][c] * change[1][c]).sum::<f64>()
        };
        let (mut sum, mut squares) = (0.0, 0.0);
        for (x, y) in
            (0..height.div_ceil(BLOCK)).flat_map(|y| (0..width.div_ceil(BLOCK)).map(move |x| (x, y)))
        {
            let rows = y * BLOCK..(y * BLOCK + BLOCK).min(height);
            let block: f64 = rows
                .flat_map(|y| (x * BLOCK..(x * BLOCK + BLOCK).min(width)).map(move |x| (x, y)))
                .map(|(x, y)| product(x, y))
                .sum();
            (sum, squares) = (sum + block, squares + block * block);
        }
        let values = 3.0 * f64::from(width) * f64::from(height);
        [sum, sum.max(0.0) + 2.0 * squares.sqrt()].map(|sum| (sum / values).max(0.0).sqrt())
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Linear red, green and blue of the pixel in column `x` and row `y` (from the top left); black outside.
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 3] {
        self.at(x, y).and_then(|at| self.pixels.get(at)).copied().unwrap_or_default()
    }

    fn at(&self, x: u32, y: u32) -> Option<usize> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let tile = (y / TILE) as usize * self.width.div_ceil(TILE) as usize + (x / TILE) as usize;
        let inside = ((y % TILE) * TILE + x % TILE) as usize;
        Some(tile * (TILE * TILE) as usize + inside)
    }

    /// The estimated error of one pixel: root mean square over its three channels, clamped and brightened as for
    /// [`Exposure::rms_error`], which is the root mean square of these over the picture. `None` unless
    /// [`error_map`](crate::render::Execution::error_map) asked for it, and for one sample a pixel.
    ///
    /// It comes of two halves of the pixel's samples alone, so a single one is as uncertain as a throw of dice; means over
    /// many pixels are not.
    pub fn pixel_error(&self, x: u32, y: u32) -> Option<f32> {
        self.at(x, y).and_then(|at| self.errors.get(at)).copied()
    }

    /// The errors of its pixels ([`Exposure::pixel_error`]) as a grey picture; black where they were not kept.
    pub fn error_map(&self) -> Self {
        let mut pixels: Vec<[f32; 3]> = self.errors.iter().map(|&error| [error; 3]).collect();
        pixels.resize(self.pixels.len(), [0.0; 3]);
        Self { pixels, errors: Vec::new(), rms_error: self.rms_error, samples: self.samples.clone(), ..*self }
    }

    /// How many samples each part of it had.
    pub fn samples(&self) -> &Allocation {
        &self.samples
    }

    /// The estimated root mean square error over all pixels and channels of the picture clamped to 0..1 in
    /// linear light, after exposure compensation; `None` for one sample a pixel.
    ///
    /// Half of the samples are an independent estimate of the picture, and so is the other half; their
    /// difference is twice the error of their mean.
    pub fn rms_error(&self) -> Option<f64> {
        self.rms_error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_samples_belong_to_a_picture_of_their_size() {
        let samples = |width, height| Allocation::Blocks(BlockSamples::new(width, height, 16));
        assert!(Exposure::from_rows(64, 51, &[], samples(64, 51)).is_ok());
        assert!(Exposure::from_rows(64, 51, &[], samples(64, 52)).is_err());
        let blocks = BlockSamples::new(64, 51, 16);
        assert_eq!([blocks.get(u32::MAX, 0), blocks.get(0, u32::MAX), blocks.get(0, 1 << 29)], [0; 3]);
        let picture = Exposure::from_rows(1, 1, &[[1.0; 3]], Allocation::Uniform(1)).unwrap();
        assert_eq!(picture.pixel(u32::MAX, u32::MAX), [0.0; 3]);
        assert!(picture.write_png(f64::NAN, &[], Vec::new()).is_err());
    }

    /// Pictures that differ everywhere by the same differ by that; by chance that two pairs do not share they do not.
    #[test]
    fn changes_are_measured_and_chance_is_not() {
        // No side is a multiple of a block's.
        let (width, height) = (37, 21);
        let picture = |color: &dyn Fn(usize) -> [f32; 3]| {
            let rows: Vec<_> = (0..(width * height) as usize).map(color).collect();
            let samples = Allocation::Uniform(1);
            Exposure::from_rows(width, height, &rows, samples).unwrap()
        };
        let change =
            |ours: [&Exposure; 2], theirs: [&Exposure; 2], ev| Exposure::rms_change(ours, theirs, ev);
        let (dark, light) = (picture(&|_| [0.2; 3]), picture(&|_| [0.5; 3]));
        let near = |[change, most]: [f64; 2], want: f64| {
            assert!((change - want).abs() < 1e-6 && most >= change, "{change} {most} {want}");
        };
        near(change([&dark; 2], [&light; 2], 0.0), 0.3);
        near(change([&dark; 2], [&dark; 2], 0.0), 0.0);
        // Twice as bright the lighter one is clipped to no more than white; once more both are.
        near(change([&dark; 2], [&light; 2], 1.0), 0.6);
        near(change([&dark; 2], [&light; 2], 2.0), 0.2);
        near(change([&dark; 2], [&light; 2], 3.0), 0.0);
        // One channel of three.
        let red = picture(&|_| [0.5, 0.2, 0.2]);
        near(change([&dark; 2], [&red; 2], 0.0), 0.3 / 3f64.sqrt());
        // Every other pixel lighter and darker: a change if both pairs have it, none if they have it the other way round.
        let by = |sign: f32| picture(&|i| [0.35 + sign * if i % 2 == 0 { 0.15 } else { -0.15 }; 3]);
        let (even, odd, middle) = (by(1.0), by(-1.0), picture(&|_| [0.35; 3]));
        near(change([&even; 2], [&middle; 2], 0.0), 0.15);
        near(change([&even, &odd], [&middle; 2], 0.0), 0.0);
        // The mean of many blocks is known better than that of few: two standard errors of the sum.
        let third = picture(&|i| [if i % 37 < 8 { 0.5 } else { 0.2 }; 3]);
        let [change, most] = change([&dark; 2], [&third; 2], 0.0);
        let block = |rows: f64| 3.0 * 8.0 * rows * 0.09;
        let blocks = [8.0, 8.0, 5.0].map(|rows| block(rows) * block(rows)).iter().sum::<f64>();
        let want = (8.0 * 21.0 * 3.0 * 0.09 + 2.0 * blocks.sqrt()) / (3.0 * 37.0 * 21.0);
        assert!((change - 0.3 * (8f64 / 37.0).sqrt()).abs() < 1e-6 && (most - want.sqrt()).abs() < 1e-6);
    }
}
