//! Diffraction on the film: how far light of 550 nm strays there, by the frequency at which the aperture bends it.

use super::Optics;
use glam::{DMat2, DVec2, DVec3};
use std::f64::consts::PI;

/// The wavelength at which light is bent, metres.
pub const WAVELENGTH: f64 = 550e-9;

impl Optics {
    /// How diffraction displaces a film point at `x`, `y` (metres, film frame): the displacement `d`, metres along `fx` and `fy`, for
    /// each unit of the spatial frequency `k`, radians to the aperture's radius along `ex` and `ey`
    /// ([`crate::sampling::Diffraction`]). Airy's first dark ring is at `|k| = 3.8317`.
    ///
    /// With the film point at `r c` from the lens centre, `|c| = 1`, the phase at the lens point `s` is `2 pi s.t / (lambda r)`,
    /// `t = d - (d.c) c` (Fraunhofer), so `k = pi A (t.ex, t.ey) / (lambda r)`, linear in `d`; this is the inverse. It is not
    /// finite for a pinhole, nor where the film point lies in the plane of the lens.
    pub fn diffraction_at(&self, x: f64, y: f64) -> DMat2 {
        let point = self.film_point(x, y);
        let r = point.length();
        let c = point / r;
        let across = |d: DVec3| {
            let t = d - c * d.dot(c);
            DVec2::new(t.dot(self.ex), t.dot(self.ey))
        };
        let lens_from_film = DMat2::from_cols(across(self.fx), across(self.fy));
        lens_from_film.inverse() * (WAVELENGTH * r / (PI * 2.0 * self.radius))
    }
}
