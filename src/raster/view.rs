//! The camera as the rasterizer sees it.
//!
//! In: the camera, from `render::frame`. Out: [`View`], plain numbers for all that follows. A sample with the lens point
//! `s = radius (u, v, 0)` at `x`, `y` pixels of the picture is the ray `s + t (q_w s - p)`, where `p = film + x film_dx + y film_dy` and
//! `q_w = 1 + p.z / f`. From `s` a point `X` is seen at `(x w, y w, w) = (C + u C_u + v C_v) (X, 1)`.

#[cfg(test)]
use super::TILE;
use glam::{DVec3, DVec4};

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
    pub displacement: [f64; 2],
}

/// A triangle with a corner within so many times the near distance is asked for it at each sample.
const MAY_BE_NEAR: f64 = 1.0 + 1e-6;

/// A quad, which is not asked, has all its corners beyond so many times: more than the other, since the depths of candidates are rounded.
const QUADS_FROM: f64 = 1.0 + 2e-6;

impl View {
    /// Whether something at the depth `z`, metres, may come nearer than the near plane.
    pub(super) fn may_be_near(&self, z: f64) -> bool {
        z < self.near * MAY_BE_NEAR
    }

    /// Whether what is drawn as a quad may be at the depth `z`.
    pub(super) fn may_have_quads(&self, z: f64) -> bool {
        z > self.near * QUADS_FROM
    }

    /// The least and the largest distance from the plane of the lens, metres, of film points at most `displacement` pixels outside
    /// of the picture.
    fn depths(&self, displacement: [f64; 2]) -> [f64; 2] {
        let (width, height) = (0.5 * f64::from(self.width), 0.5 * f64::from(self.height));
        let center = self.film.z + self.film_dx.z * width + self.film_dy.z * height;
        let reach = self.film_dx.z.abs() * (width + displacement[0])
            + self.film_dy.z.abs() * (height + displacement[1]);
        [-center - reach, -center + reach]
    }

    /// The same with samples that lie up to `displacement` pixels outside of their own; `None` where the film would reach the
    /// plane of the lens there.
    pub(crate) fn widened(&self, displacement: [f64; 2]) -> Option<Self> {
        let ([_, before], [nearest, deepest]) = (self.depths([0.0; 2]), self.depths(displacement));
        let least_w = self.least_w * (before / deepest);
        (nearest > 0.0 && least_w > 0.0).then(|| Self { displacement, least_w, ..self.clone() })
    }
}

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
        displacement: [0.0; 2],
    }
}
