//! From sums to a picture: means out, and what the two halves of the samples say of their error.

use super::clipped::{self, Halves};
use super::picture::Picture;
use crate::picture::BLOCK;
use crate::raster::TILE;
use glam::Vec3;
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
        let mut squared = ByBlock::default();
        let mut tell = |at: usize, error: f64| {
            if let Some(pixel) = errors.as_deref_mut().and_then(|errors| errors.get_mut(at)) {
                *pixel = (error / 3.0).sqrt() as f32;
            }
            error
        };
        for block in (0..samples.len()).filter(|&block| samples[block] > 1) {
            let (columns, rows) = self.pixels_of(tile, block);
            let places = || places(columns.clone(), rows.clone());
            let n = samples[block];
            let (share, gains) = (clipped::share(n), [n.div_ceil(2), n / 2].map(|n| self.gain / n as f32));
            let halves = |at: usize| {
                sums.get(at).map(|sum| [0, 1].map(|half| Vec3::from_array(sum[half]) * gains[half]))
            };
            let mut is_bright = false;
            for at in places() {
                let Some([a, b]) = halves(at) else { continue };
                let [a_shown, b_shown] = [a, b].map(|half| half.clamp(Vec3::ZERO, Vec3::ONE));
                squared[block] += tell(at, share * (a_shown - b_shown).as_dvec3().length_squared());
                is_bright |= clipped::is_bright([a, b]);
            }
            if is_bright && !self.is_unseen(tile, block, n) {
                let pixels = places().filter_map(halves).collect();
                let errors = Halves { width: columns.len(), samples: n, pixels }.errors();
                squared[block] = places().zip(errors).map(|(at, error)| tell(at, error)).sum();
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

    /// Makes the sums of a tile its pixels, the means of their samples: one after the other from its beginning on.
    pub(super) fn means(&self, (tx, ty): (u32, u32), sums: &mut [Sum], samples: &ByBlock<u32>) {
        let size = self.size_of((tx, ty));
        let (count, pixels) = (sums.len(), sums.as_flattened_mut());
        for at in 0..count {
            let (x, y) = (at as u32 % TILE, at as u32 / TILE);
            let n = samples[(y / BLOCK * BLOCKS + x / BLOCK) as usize].max(1) as f32;
            let [a, b] = [pixels[2 * at], pixels[2 * at + 1]].map(Vec3::from_array);
            let is_inside = x < size[0] && y < size[1];
            pixels[at] = if is_inside { ((a + b) / n).to_array() } else { [0.0; 3] };
        }
    }
}
