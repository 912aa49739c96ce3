//! Falloff: which part of the light arrives along each ray. In: a group of samples. Out: the mean over its even and over its odd
//! samples of `cos(lens) cos(film) / r^2`, relative to the ray from the lens centre to the film's centre.
//!
//! Sample by sample, for a group may see through the whole lens: the weight of its mean place is another than its mean weight, at
//! f/2.8 by 3 %.

use super::gather::total;
use super::samples::Samples;
use crate::raster::visibility::Group;
use fearless_simd::{Simd, SimdBase, f32x16};
use glam::{DVec3, Vec3};

/// See the module.
pub(crate) struct Falloff {
    /// The film's unit normal, lens frame.
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
            normal: normal.as_vec3(),
            scale: (1.0 / center.length()) as f32,
            inverse: (1.0 / cosines) as f32,
        }
    }

    /// The mean weights of a group's even and odd samples, 0 where there are none.
    #[inline(always)]
    pub(super) fn means<S: Simd>(&self, simd: S, samples: &Samples<'_>, group: &Group) -> [f32; 2] {
        let (rays, corner) = (samples.rays, samples.corner(group));
        let mut sums = [0.0; 2];
        for number in group.batches() {
            let (lanes, Some(batch)) = (group.lanes_of(number), samples.batches.get(number)) else {
                continue;
            };
            let x = f32x16::load_array_ref(simd, &batch.x) + corner.x;
            let y = f32x16::load_array_ref(simd, &batch.y) + corner.y;
            let u = f32x16::load_array_ref(simd, &batch.u) * rays.radius;
            let v = f32x16::load_array_ref(simd, &batch.v) * rays.radius;
            // From lens point to film point.
            let rx = (x * rays.dx.x + y * rays.dy.x + rays.p.x - u) * self.scale;
            let ry = (x * rays.dx.y + y * rays.dy.y + rays.p.y - v) * self.scale;
            let rz = (x * rays.dx.z + y * rays.dy.z + rays.p.z) * self.scale;
            let square = rx * rx + ry * ry + rz * rz;
            let film = rx * self.normal.x + ry * self.normal.y + rz * self.normal.z;
            let weight = (rz * film).abs() / (square * square) * self.inverse;
            sums[0] += total(simd, weight, lanes & !batch.odd);
            sums[1] += total(simd, weight, lanes & batch.odd);
        }
        let counts = samples.counts(group);
        [0, 1].map(|half: usize| if counts[half] > 0.0 { sums[half] / counts[half] } else { 0.0 })
    }
}
