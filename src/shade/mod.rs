//! From a visible point to linear radiance: interpolation, texture, Lambert's law, holes and coverage.
//!
//! In: groups of samples that see one surface (`raster::group`). Out: their light, in the sums of their pixels
//! (`render::resolve`). `color = Ke + Kd map_Kd(uv) (ambient + sun max(0, n.l) visible)`, all in linear light. `visible` is 1
//! unless the sun casts shadows, which have a path of their own ([`shadowed`]): what is off costs nothing.
//!
//! The way: [`look`], a surface in a tile; [`run`], [`single`] where samples share nothing, or [`shadowed`] with [`sun`] and
//! [`shadows`]; [`slope`] where normals are interpolated, [`sky`] where there is no surface; [`textured`] with [`coordinates`],
//! [`mip_level`], [`packed`], [`fetch_queue`], [`fetch`], [`interpolate`] and [`texel`]; [`samples`] with [`rays`] and [`falloff`];
//! masks in [`lanes`]. Before all these [`cutout`] tells `raster::regions` what samples pass through.
//!
//! Samples of a pixel, up to 64, that see one surface share what hardly changes between them; each looks into the texture for
//! itself, unless it is smooth there, and has light of its own where normals are interpolated. Sharing one look-up among 16 everywhere was
//! tried, with the filter as wide as the narrow side of what they span: four times as fast, but the paving of the
//! tower scene came out wrong by 0.009 RMS at 1024 samples (0.003 without), since few look-ups at regular places
//! alias.

mod coordinates;
mod cutout;
mod falloff;
mod fetch;
mod fetch_queue;
mod interpolate;
mod lanes;
mod look;
mod mip_level;
mod packed;
mod rays;
mod run;
mod samples;
mod shadowed;
mod shadows;
mod sight;
mod single;
mod sky;
mod slope;
mod sun;
mod texel;
mod textured;

pub(crate) use falloff::Falloff;
pub(crate) use look::{Look, LookParts};
pub(crate) use rays::Rays;
pub(crate) use samples::{LaneSums, Samples};
pub(crate) use shadowed::SunSamples;
pub(crate) use sight::Sight;
pub(crate) use sun::ShadowSun;
pub(crate) use textured::LookUps;

use crate::scene::{Mapping, Material, NONE, Sky, Sun, Surfaces};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// What shading needs of a scene, in the lens frame of one camera.
pub(crate) struct Shader<'a> {
    surfaces: &'a Surfaces,
    materials: &'a [Material],
    /// Vertex normals, and the face normals of triangles without, in the lens frame.
    normals: Vec<Vec3>,
    sun: Option<(Vec3, Vec3)>,
    ambient: Vec3,
    horizon: Vec3,
    zenith: Vec3,
    up: Vec3,
}

/// What a material makes of light, each channel: what it reflects of any, what it sends by itself, and what it shows of the light from
/// everywhere and of a sun square to it.
struct Paint {
    diffuse: Vec4,
    emission: Vec4,
    ambient: Vec4,
    sun: Vec4,
}

impl<'a> Shader<'a> {
    /// Of surfaces with these materials; `lens_from_world` turns directions.
    pub(crate) fn new(
        (surfaces, materials): (&'a Surfaces, &'a [Material]),
        sun: Option<&Sun>,
        sky: &Sky,
        up: DVec3,
        lens_from_world: impl Fn(DVec3) -> DVec3 + Sync,
    ) -> Self {
        let unit = |v: DVec3| crate::camera::unit(v).unwrap_or(DVec3::Z).as_vec3();
        Self {
            surfaces,
            materials,
            normals: surfaces.normals.par_iter().map(|&n| unit(lens_from_world(n.as_dvec3()))).collect(),
            sun: sun.map(|sun| (unit(lens_from_world(sun.toward)), sun.color.as_vec3())),
            ambient: sky.ambient.as_vec3(),
            horizon: sky.horizon.as_vec3(),
            zenith: sky.zenith.as_vec3(),
            up: unit(lens_from_world(up)),
        }
    }

    /// The light that falls on a surface with the unit normal `n`.
    fn light(&self, n: Vec3) -> Vec3 {
        match self.sun {
            Some((toward, color)) => self.ambient + color * n.dot(toward).max(0.0),
            None => self.ambient,
        }
    }

    #[inline(always)]
    fn paint(&self, material: &Material) -> Paint {
        let diffuse = Vec3::from(material.diffuse).extend(0.0);
        Paint {
            diffuse,
            emission: Vec3::from(material.emission).extend(0.0),
            ambient: diffuse * self.ambient.extend(0.0),
            sun: diffuse * self.sun.map_or(Vec4::ZERO, |(_, color)| color.extend(0.0)),
        }
    }

    /// What the look of a surface is made of: the triangle that stands for it, its corners in the lens frame, and those of one
    /// triangle that may be seen.
    pub(crate) fn parts(&self, triangle: u32, corners: [DVec3; 3], seen: [DVec3; 3]) -> LookParts {
        let attributes = &self.surfaces.attributes[triangle as usize];
        let material = &self.materials[attributes.material as usize];
        let texcoords = (attributes.texcoords[0] != NONE
            && (material.diffuse_map.is_some() || material.opacity_map.is_some()))
        .then(|| attributes.texcoords.map(|i| self.surfaces.texcoords[i as usize].as_dvec2()));
        let normals =
            (attributes.normals[0] != NONE).then(|| attributes.normals.map(|i| self.normals[i as usize]));
        let mut mappings = material.holed_maps().map(|(_, mapping)| mapping);
        let opacity = mappings.find(|&mapping| mapping != Mapping::IDENTITY);
        LookParts { triangle, material: attributes.material, corners, seen, texcoords, normals, opacity }
    }

    /// What all samples that see a surface in a tile share. `edges` are the functions there of the triangle that stands for it.
    pub(crate) fn look(&self, parts: &LookParts, edges: impl FnOnce() -> [[f64; 9]; 3]) -> Look {
        let edges = if parts.vary() { edges() } else { [[0.0; 9]; 3] };
        let mut look = Look::new(&edges, parts);
        look.lit = [self.light(look.face), self.light(-look.face)];
        look
    }
}
