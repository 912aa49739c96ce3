//! Falloff: which part of the light arrives along each ray. In: places of samples. Out: their weights
//! `cos(lens) cos(film) / r^2`, relative to the ray from the lens centre to the film's centre, for [`super::samples`].
//!
//! Sample by sample, for a group may see through the whole lens: the weight of its mean place is another than its mean weight, at
//! f/2.8 by 3 %. Where all light of a group is alike the sum of its weights does; else each sample's light has its own, for
//! both change over the lens: the means' product was wrong by 0.002 at f/0.9, 30 degrees of tilt, however many samples there were.

use super::rays::{Places, Rays};
use fearless_simd::{Simd, SimdBase, f32x16};
use glam::{DVec3, Vec3};

/// See the module.
pub(crate) struct Falloff {
    /// The film's unit normal, away from the lens, lens frame.
    normal: Vec3,
    /// One over the distance from the lens centre to the film's, so that fourth powers stay in range.
    scale: f32,
    /// One over the product of cosines there.
    inverse: f32,
}

impl Falloff {
    /// For a film with this unit normal and centre, lens frame, metres.
    pub(crate) fn new(normal: DVec3, center: DVec3) -> Self {
        let unit = center / center.length();
        let cosines = unit.z.abs() * normal.dot(unit).abs();
        Self {
            normal: (normal * normal.dot(unit).signum()).as_vec3(),
            scale: (1.0 / center.length()) as f32,
            inverse: (1.0 / cosines) as f32,
        }
    }

    /// The weights at 16 places.
    #[inline(always)]
    pub(super) fn weights<S: Simd>(&self, simd: S, rays: &Rays, at: &Places<S>) -> f32x16<S> {
        let [px, py, pz] = rays.film(at);
        // From lens point to film point.
        let rx = (px - at.u * rays.radius) * self.scale;
        let ry = (py - at.v * rays.radius) * self.scale;
        let rz = pz * self.scale;
        let square = rx * rx + ry * ry + rz * rz;
        let film = rx * self.normal.x + ry * self.normal.y + rz * self.normal.z;
        // No light comes to where the film stands before the plane of the lens, or shows it its back.
        let zero = f32x16::splat(simd, 0.0);
        let behind = (zero - rz).max(zero);
        behind * film.max(zero) / (square * square) * self.inverse
    }
}
