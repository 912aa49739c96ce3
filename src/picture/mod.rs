//! A finished exposure: linear light, with the error that it estimates of itself.

mod encode;

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
}

impl Exposure {
    pub(crate) fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>, rms_error: Option<f64>) -> Self {
        Self { width, height, pixels, rms_error }
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
        if x >= self.width || y >= self.height {
            return [0.0; 3];
        }
        let tile = (y / TILE) as usize * self.width.div_ceil(TILE) as usize + (x / TILE) as usize;
        let inside = ((y % TILE) * TILE + x % TILE) as usize;
        self.pixels[tile * (TILE * TILE) as usize + inside]
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
