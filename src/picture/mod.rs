//! A finished exposure: linear light, with the error that it estimates of itself.

mod allocation;
mod encode;

pub use allocation::{Allocation, BLOCK, BlockSamples};
pub use encode::Notes;

use crate::sampling::GRID as TILE;

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
        let tile = (y / TILE) as usize * self.width.div_ceil(TILE) as usize + (x / TILE) as usize;
        let inside = ((y % TILE) * TILE + x % TILE) as usize;
        (x < self.width && y < self.height).then_some(tile * (TILE * TILE) as usize + inside)
    }

    /// The estimated error of one pixel: root mean square over its three channels, clamped and brightened as for
    /// [`Exposure::rms_error`], which is the root mean square of these over the picture. `None` unless
    /// [`error_map`](crate::render::Execution::error_map) asked for it.
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
