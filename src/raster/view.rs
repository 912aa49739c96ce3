//! The camera as the rasterizer sees it, and the set of samples of a tile.
//!
//! In: the camera from `render::frame`, samples from `render::pattern`. Out: [`View`] and [`Pattern`], plain numbers for all that
//! follows. A sample with the lens point `s = radius (u, v, 0)` at `x`, `y` pixels of the picture is the ray `s + t (q_w s - p)`,
//! where `p = film + x film_dx + y film_dy` and `q_w = 1 + p.z / f`. From `s` a point `X` is seen at
//! `(x w, y w, w) = (C + u C_u + v C_v) (X, 1)`.

use super::{LANES, TILE};
use glam::{DVec3, DVec4, Vec2};

/// A camera in the lens frame. Pixel coordinates run right and down from the picture's top left.
#[derive(Clone, Debug)]
pub(crate) struct View {
    /// Picture size in pixels.
    pub width: u32,
    pub height: u32,
    /// Film point of pixel coordinate (0, 0), and its change with one pixel to the right and down.
    pub film: DVec3,
    pub film_dx: DVec3,
    pub film_dy: DVec3,
    pub focal_length: f64,
    /// Radius of the aperture; 0 for a pinhole.
    pub radius: f64,
    /// Nearest visible distance along the axis.
    pub near: f64,
    /// Rows of the projection of points in the lens frame to `(x w, y w, w)`, `x`, `y` in pixels: at the
    /// lens centre, and what each unit of `u` and `v` (fractions of the radius) adds.
    pub pixel_from_lens: [[DVec4; 3]; 3],
    /// The smallest `w` that a point at `near` on any ray of the picture can have, over all lens points.
    pub least_w: f64,
    /// How far a sample may lie outside of its pixel, right or left and down or up, pixels: 0 without diffraction.
    pub spread: [f64; 2],
}

impl View {
    /// The least and the largest distance from the plane of the lens, metres, of film points at most `spread` pixels outside
    /// of the picture.
    fn depths(&self, spread: [f64; 2]) -> [f64; 2] {
        let (width, height) = (0.5 * f64::from(self.width), 0.5 * f64::from(self.height));
        let center = self.film.z + self.film_dx.z * width + self.film_dy.z * height;
        let reach = self.film_dx.z.abs() * (width + spread[0]) + self.film_dy.z.abs() * (height + spread[1]);
        [-center - reach, -center + reach]
    }

    /// The same with samples that lie up to `spread` pixels outside of their own; `None` where the film would reach the
    /// plane of the lens there.
    pub(crate) fn widened(&self, spread: [f64; 2]) -> Option<Self> {
        let ([_, before], [nearest, deepest]) = (self.depths([0.0; 2]), self.depths(spread));
        let least_w = self.least_w * (before / deepest);
        (nearest > 0.0 && least_w > 0.0).then(|| Self { spread, least_w, ..self.clone() })
    }
}

/// The disk of the aperture that a cell of lens points lies in; fractions of the radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LensCell {
    pub u: f64,
    pub v: f64,
    pub radius: f64,
    /// How far its samples may lie outside of their pixels, as [`View::spread`].
    pub spread: [f64; 2],
}

/// Sixteen samples that are tested together, at every block of a tile.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    /// Which [`LensCell`] all of them lie in.
    pub cell: usize,
    /// Lens points, fractions of the radius.
    pub u: [f32; LANES],
    pub v: [f32; LANES],
    /// Place of the sample from the block's left top corner, pixels.
    pub x: [f32; LANES],
    pub y: [f32; LANES],
    /// Which pixel of the block each sample belongs to, row by row.
    pub pixel: [u8; LANES],
    /// The sample's number.
    pub index: [u32; LANES],
    /// Lanes in use, lane 0 in the lowest bit.
    pub live: u16,
    /// Lanes whose sample has an odd number: the other half of the error estimate.
    pub odd: u16,
}

impl Batch {
    /// No samples yet, in this cell.
    pub(crate) const fn of_cell(cell: usize) -> Self {
        Self {
            cell,
            u: [0.0; LANES],
            v: [0.0; LANES],
            x: [0.0; LANES],
            y: [0.0; LANES],
            pixel: [0; LANES],
            index: [0; LANES],
            live: 0,
            odd: 0,
        }
    }
}

/// All samples of a tile: batches of 16, each of which visits every block of pixels.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    /// Logarithms to base 2 of a block's width and height: a shift is not a division, which every group of samples
    /// would need three times.
    pub block_bits: [u32; 2],
    pub batches: Vec<Batch>,
}

impl Pattern {
    /// The left top pixel of a block, in the tile.
    #[inline(always)]
    pub(crate) fn corner(&self, block: u32) -> (u32, u32) {
        let [across, down] = self.block_bits;
        let row = TILE.trailing_zeros() - across;
        ((block & ((1 << row) - 1)) << across, (block >> row) << down)
    }

    /// Moves all samples to the middle of their pixels.
    pub(crate) fn center(&mut self) {
        for batch in &mut self.batches {
            for lane in 0..LANES {
                let (column, row) = inside(batch.pixel[lane], self.block_bits);
                batch.x[lane] = column as f32 + 0.5;
                batch.y[lane] = row as f32 + 0.5;
            }
        }
    }

    /// The pixel, in the tile, of a lane at the block with this corner.
    #[inline(always)]
    pub(crate) fn pixel(&self, (x, y): (u32, u32), batch: &Batch, lane: usize) -> (u32, u32) {
        let (column, row) = inside(batch.pixel[lane % LANES], self.block_bits);
        (x + column, y + row)
    }
}

/// A pixel's column and row in its block.
#[inline(always)]
fn inside(pixel: u8, [across, _]: [u32; 2]) -> (u32, u32) {
    (u32::from(pixel) & ((1 << across) - 1), u32::from(pixel) >> across)
}

/// A pixel's left top corner from its tile's centre.
#[inline(always)]
pub(crate) fn from_center((x, y): (u32, u32)) -> Vec2 {
    Vec2::new(FROM_CENTER[x as usize % TILE as usize], FROM_CENTER[y as usize % TILE as usize])
}

/// A table is faster than two conversions, which every group of samples would need.
const FROM_CENTER: [f32; TILE as usize] = {
    let mut at = [0.0; TILE as usize];
    let mut i = 0;
    while i < TILE as usize {
        at[i] = i as f32 - 0.5 * TILE as f32;
        i += 1;
    }
    at
};

/// A tile 32 mm wide, 150 mm behind a lens of 140 mm focal length and 20 mm radius.
#[cfg(test)]
pub(crate) fn test_view() -> View {
    test_view_through(0.02)
}

/// The same with a lens of another radius, metres.
#[cfg(test)]
pub(crate) fn test_view_through(radius: f64) -> View {
    let (behind, step, focal_length) = (0.15, 1e-3, 0.14);
    // x w = (q_w s z + behind (s - X)) / step + 16 z, w = z.
    let moved = radius * (1.0 - behind / focal_length) / step;
    let row = |axis: DVec4| [axis * (-behind / step) + DVec4::Z * 16.0, DVec4::ZERO, DVec4::ZERO];
    let mut rows = [row(DVec4::X), row(DVec4::Y), [DVec4::Z, DVec4::ZERO, DVec4::ZERO]];
    for axis in 0..2 {
        rows[axis][axis + 1] = DVec4::Z * moved + DVec4::W * (behind * radius / step);
    }
    View {
        width: TILE,
        height: TILE,
        film: DVec3::new(-0.016, -0.016, -behind),
        film_dx: DVec3::X * step,
        film_dy: DVec3::Y * step,
        focal_length,
        radius,
        near: 0.3,
        pixel_from_lens: [0, 1, 2].map(|part| [0, 1, 2].map(|row: usize| rows[row][part])),
        least_w: 0.3,
        spread: [0.0; 2],
    }
}
