//! From a visible point to linear radiance: interpolation, texture, Lambert's law, holes and coverage.
//!
//! `color = Ke + Kd map_Kd(uv) (ambient + sun max(0, n.l))`, all in linear light.

mod filter;

use crate::raster::setup::Setup;
use crate::sampling::{hash, shuffled_radical_inverse};
use crate::scene::{Material, NONE, Sky, Sun, Surfaces};
use filter::Footprint;
use glam::{DVec3, Vec2, Vec3};

/// What shading needs of a scene, in the lens frame of one camera.
pub(crate) struct Shader<'a> {
    surfaces: &'a Surfaces,
    /// Vertex normals and the face normals of triangles without, in the lens frame.
    normals: Vec<Vec3>,
    face_normals: Vec<Vec3>,
    sun: Option<(Vec3, Vec3)>,
    ambient: Vec3,
    horizon: Vec3,
    zenith: Vec3,
    up: DVec3,
}

/// A sample's place: lens point in fractions of the aperture's radius, place in the tile in pixels from
/// its centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub u: f32,
    pub v: f32,
    pub x: f32,
    pub y: f32,
}

impl<'a> Shader<'a> {
    /// `lens_from_world` turns directions; `positions` are the surfaces' in the lens frame.
    pub(crate) fn new(
        surfaces: &'a Surfaces,
        sun: Option<&Sun>,
        sky: &Sky,
        up: DVec3,
        positions: &[DVec3],
        lens_from_world: impl Fn(DVec3) -> DVec3,
    ) -> Self {
        let turn = |v: Vec3| lens_from_world(v.as_dvec3()).as_vec3();
        let unit = |v: DVec3| crate::camera::unit(v).unwrap_or(DVec3::Z);
        let face_normals = surfaces
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| positions[i as usize]);
                // The lens frame is left-handed; two-sided shading does not mind the sign.
                unit((b - a).cross(c - a)).as_vec3()
            })
            .collect();
        Self {
            surfaces,
            normals: surfaces.normals.iter().map(|&n| turn(n)).collect(),
            face_normals,
            sun: sun.map(|sun| (unit(lens_from_world(sun.toward)).as_vec3(), sun.color.as_vec3())),
            ambient: sky.ambient.as_vec3(),
            horizon: sky.horizon.as_vec3(),
            zenith: sky.zenith.as_vec3(),
            up: unit(lens_from_world(up)),
        }
    }

    /// The sky along `direction` (lens frame, any length).
    pub(crate) fn background(&self, direction: DVec3) -> Vec3 {
        let rise = (self.up.dot(direction) / direction.length()).max(0.0);
        self.horizon + (self.zenith - self.horizon) * rise as f32
    }

    /// The radiance that leaves the triangle of `setup` toward the lens point; `ray` is the direction from
    /// the lens, lens frame.
    pub(crate) fn radiance(&self, setup: &Setup, place: Place, ray: Vec3) -> Vec3 {
        let t = setup.triangle as usize;
        let attributes = &self.surfaces.attributes[t];
        let material = &self.surfaces.materials[attributes.material as usize];
        let weights = setup.weights(place.u, place.v, place.x, place.y);
        let mut normal = self.face_normals[t];
        if attributes.normals[0] != NONE {
            let [a, b, c] = attributes.normals.map(|i| self.normals[i as usize]);
            let smooth = a * weights.at[0] + b * weights.at[1] + c * weights.at[2];
            let length = smooth.dot(smooth).sqrt();
            if length > 1e-12 && length.is_finite() {
                normal = smooth / length;
            }
        }
        // Two-sided: the side that faces this lens point is lit.
        if normal.dot(ray) > 0.0 {
            normal = -normal;
        }
        let mut diffuse = Vec3::from(material.diffuse);
        if let Some(map) = &material.diffuse_map
            && let Some(footprint) = self.footprint(setup, place)
        {
            let [r, g, b, _] = filter::sample(map, &footprint);
            diffuse *= Vec3::new(r, g, b);
        }
        let mut light = self.ambient;
        if let Some((toward, color)) = self.sun {
            light += color * normal.dot(toward).max(0.0);
        }
        Vec3::from(material.emission) + diffuse * light
    }

    /// Whether a triangle can let samples through.
    pub(crate) fn is_cutout(material: &Material) -> bool {
        let holes =
            |map: &Option<std::sync::Arc<crate::scene::Texture>>| map.as_ref().is_some_and(|m| m.has_holes);
        material.coverage < 1.0 || holes(&material.diffuse_map) || holes(&material.opacity_map)
    }

    /// Whether sample `index` of the pixel with key `pixel` meets the surface: no hole there, and within its
    /// coverage. Each surface decides by itself.
    pub(crate) fn is_met(&self, setup: &Setup, place: Place, pixel: u64, index: u32) -> bool {
        let attributes = &self.surfaces.attributes[setup.triangle as usize];
        let material = &self.surfaces.materials[attributes.material as usize];
        let maps = [&material.diffuse_map, &material.opacity_map];
        for map in maps.into_iter().flatten().filter(|map| map.has_holes) {
            if let Some(footprint) = self.footprint(setup, place)
                && filter::sample(map, &footprint)[3] < 0.5
            {
                return false;
            }
        }
        material.coverage >= 1.0
            || shuffled_radical_inverse(index, hash(pixel, u64::from(setup.triangle))) < material.coverage
    }

    /// Texture coordinates and how they change from pixel to pixel; `None` where the file has none.
    fn footprint(&self, setup: &Setup, place: Place) -> Option<Footprint> {
        let attributes = &self.surfaces.attributes[setup.triangle as usize];
        if attributes.texcoords[0] == NONE {
            return None;
        }
        let [a, b, c] = attributes.texcoords.map(|i| self.surfaces.texcoords[i as usize]);
        let weights = setup.weights(place.u, place.v, place.x, place.y);
        let mix = |w: [f32; 3]| -> Vec2 { a * w[0] + b * w[1] + c * w[2] };
        Some(Footprint { uv: mix(weights.at), dx: mix(weights.dx), dy: mix(weights.dy) })
    }
}
