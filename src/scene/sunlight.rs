//! Where the sun shines from for one sample of a picture: another point of its disk for each where it casts shadows.

use super::load::Scene;
use super::material::Material;
use crate::sampling::{cone_direction, pixel_key, sun_shift, sun_square};
use glam::{DMat3, DVec3, Vec3};

impl Scene {
    /// The most light that a material gives: its own, and what it gives back of sun and sky; linear.
    pub(crate) fn most_light(&self, material: &Material) -> Vec3 {
        let sun = self.sun.as_ref().map_or(Vec3::ZERO, |sun| sun.color.as_vec3());
        let light = self.sky.ambient.as_vec3() + sun;
        Vec3::from(material.emission) + Vec3::from(material.diffuse) * light
    }

    /// The unit direction toward the sun, in the world, for sample `index` of the pixel in column and row `pixel`, whose samples
    /// are those of `stream` (see [`crate::sampling::pixel_stream`]); `None` without a sun.
    pub fn sun_direction(&self, pixel: (u32, u32), stream: u64, index: u32) -> Option<DVec3> {
        let sun = self.sun.as_ref()?;
        if !sun.shadows || sun.angular_diameter.as_radians() == 0.0 {
            return Some(sun.toward.normalize());
        }
        let (pose, seed) = (self.optics.world_from_lens(), self.render.seed);
        let (ex, ey) = self.optics.lens_axes();
        let axes = DMat3::from_cols(ex, ey, self.optics.axis());
        let toward = (axes.transpose() * pose.vector_inverse(sun.toward)).normalize();
        let (x, y) = toward.any_orthonormal_pair();
        let shift = sun_shift(pixel_key(seed, pixel.0, pixel.1), index);
        let bits = sun_square(seed, stream, index);
        let square = [0, 1].map(|c: usize| ((bits[c] ^ shift[c]) >> 8) as f32 / 16_777_216.0);
        let [a, b, c] = cone_direction(square, 0.5 * sun.angular_diameter.as_radians());
        Some(pose.vector(axes * (x * a + y * b + toward * c)))
    }
}
