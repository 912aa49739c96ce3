//! What stands between a light and the lens: a place in, the part of its light that arrives out.
//!
//! For `render::highlights`: the mean, over 16 rays to points of the lens, of the product of `1 - coverage` of all surfaces that
//! a ray crosses ([`super::shadows`]); those with holes let all pass.
//!
//! For what is said of lights that no sample has met ([`crate::render`]), not for pictures: sixteen rays, in single precision.

use super::shadows::{Occluders, SunRays, Weights};
use crate::raster::LANES;
use crate::raster::view::View;
use crate::sampling::{self, ApertureShape, PointSet};
use crate::scene::{Material, Surfaces};
use fearless_simd::Level;
use glam::{DVec2, DVec3};
use std::cell::Cell;

/// A scene as lights see it that shine at the lens.
pub(crate) struct Sight<'a> {
    surfaces: &'a Surfaces,
    materials: &'a [Material],
    /// Lens frame.
    positions: &'a [DVec3],
    /// In a frame whose `z` points from the scene to the lens, where it is 0.
    occluders: Occluders,
    /// Points of the lens, metres.
    lens: [DVec2; LANES],
    /// Nothing nearer is seen.
    near: f64,
}

impl<'a> Sight<'a> {
    /// `positions` are in the lens frame of `view`, whose aperture has this shape.
    pub(crate) fn new(
        (surfaces, materials): (&'a Surfaces, &'a [Material]),
        positions: &'a [DVec3],
        view: &View,
        shape: &ApertureShape,
    ) -> Self {
        let occluders = Occluders::new(surfaces, positions, [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z]);
        let stream = sampling::pixel_stream(0, 0, LANES as u32);
        let lens = std::array::from_fn(|i| {
            let [u, v] = sampling::sample_of(PointSet::Sobol, shape, 0, stream, i as u32).lens;
            DVec2::new(f64::from(u), f64::from(v)) * view.radius
        });
        Self { surfaces, materials, positions, occluders, lens, near: view.near }
    }

    /// The part of the light of a `triangle`'s middle that arrives at the lens. Surfaces with holes are taken to let it pass.
    pub(crate) fn free(&self, level: Level, triangle: u32) -> f64 {
        let corners = self.surfaces.triangles[triangle as usize].map(|i| self.positions[i as usize]);
        let from = (corners[0] + corners[1] + corners[2]) / 3.0;
        let mut rays = SunRays::default();
        for (lane, to) in self.lens.iter().enumerate() {
            let slope = [(to.x - from.x) / from.z, (from.y - to.y) / from.z];
            for (axis, value) in [from.x, -from.y, -from.z].into_iter().enumerate() {
                rays.from[axis][lane] = value as f32;
            }
            (rays.slope[0][lane], rays.slope[1][lane]) = (slope[0] as f32, slope[1] as f32);
        }
        let passes: [Cell<f64>; LANES] = std::array::from_fn(|_| Cell::new(1.0));
        let stops =
            |t: u32, lanes: u16, weights: &Weights| self.stops((t, triangle), lanes, weights, &passes);
        // Nothing is asked first, and so again later: what half of the light passes would keep three quarters.
        let mut first = u32::MAX;
        let stopped = self.occluders.stopped(level, &rays, false, 0xffff, &mut first, &stops);
        let arrives = |lane: usize| if stopped >> lane & 1 == 1 { 0.0 } else { passes[lane].get() };
        (0..LANES).map(arrives).sum::<f64>() / LANES as f64
    }

    /// The lanes of `lanes`, which cross triangle `t` on the way from another, that it stops; what passes is dimmed.
    fn stops(
        &self,
        (t, light): (u32, u32),
        lanes: u16,
        weights: &Weights,
        passes: &[Cell<f64>; LANES],
    ) -> u16 {
        let attributes = &self.surfaces.attributes[t as usize];
        let material = &self.materials[attributes.material as usize];
        if t == light || material.holed_maps().next().is_some() {
            return 0;
        }
        let depths = self.surfaces.triangles[t as usize].map(|i| self.positions[i as usize].z);
        let mut solid = 0;
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
            let [u, v, w] = [0, 1, 2].map(|i: usize| f64::from(weights[i][lane]));
            let depth = (u * depths[0] + v * depths[1] + w * depths[2]) / (u + v + w);
            if depth > self.near {
                passes[lane].set(passes[lane].get() * f64::from(1.0 - material.coverage));
                solid |= u16::from(material.coverage >= 1.0) << lane;
            }
        }
        solid
    }
}
