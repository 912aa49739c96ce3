//! The rays of a tile's samples. In: places, `u, v, x, y`. Out: film points `p = p_0 + x dx + y dy`, and directions `q_w s - p` from
//! the lens points `s = radius (u, v, 0)`.

use crate::raster::LANES;
use fearless_simd::{Simd, SimdBase, f32x16};
use glam::Vec3;

/// The rays of a tile, in single precision about its centre, lens frame.
pub(crate) struct Rays {
    /// The tile's centre on the film, and the steps to the next pixel.
    pub p: Vec3,
    pub dx: Vec3,
    pub dy: Vec3,
    pub focal_length: f32,
    pub radius: f32,
}

impl Rays {
    /// The film points `p`.
    #[inline(always)]
    pub(super) fn film<S: Simd>(&self, at: &Places<S>) -> [f32x16<S>; 3] {
        [
            at.x * self.dx.x + at.y * self.dy.x + self.p.x,
            at.x * self.dx.y + at.y * self.dy.y + self.p.y,
            at.x * self.dx.z + at.y * self.dy.z + self.p.z,
        ]
    }

    /// The directions from the lens points: `q_w s - p`.
    #[inline(always)]
    pub(super) fn at_all<S: Simd>(&self, simd: S, at: &Places<S>) -> [f32x16<S>; 3] {
        let [px, py, pz] = self.film(at);
        let weight = (pz / self.focal_length + 1.0) * self.radius;
        [weight * at.u - px, weight * at.v - py, f32x16::splat(simd, 0.0) - pz]
    }
}

/// Sixteen places: of samples, or of groups on the mean.
pub(super) struct Places<S: Simd> {
    pub u: f32x16<S>,
    pub v: f32x16<S>,
    pub x: f32x16<S>,
    pub y: f32x16<S>,
}

impl<S: Simd> Places<S> {
    /// Of places one below the other: `u`, `v`, `x`, `y`.
    #[inline(always)]
    pub(super) fn of_rows(simd: S, rows: &[[f32; 4]; LANES]) -> Self {
        let (fours, _) = rows.as_chunks::<4>();
        let four = |i: usize| f32x16::from_slice(simd, fours[i].as_flattened());
        let (ux_a, vy_a) = four(0).deinterleave(four(1));
        let (ux_b, vy_b) = four(2).deinterleave(four(3));
        let ((u, x), (v, y)) = (ux_a.deinterleave(ux_b), vy_a.deinterleave(vy_b));
        Self { u, v, x, y }
    }
}
