//! How bright a small surface looks that no sample may have met. In: a triangle of a scene. Out: its own light with the sky's, and the
//! sun's if nothing stands before it, as [`crate::shade`] has them, at most: for [`super::highlights`].
//!
//! `Kd` is that of the texture's level whose texel is as large as the triangle, at its middle; of what vertex normals say the most.

use crate::scene::{Material, NONE, Scene, Surfaces, Texture};
use glam::{DVec2, DVec3, Vec3};

/// Light by what gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lit {
    /// Emission, and what comes from all of the sky.
    pub own: Vec3,
    pub sun: Vec3,
}

impl Lit {
    /// Of triangle `t`, with these `materials`.
    pub(super) fn of(scene: &Scene, materials: &[Material], t: usize) -> Self {
        let surfaces = &scene.surfaces;
        let material = &materials[surfaces.attributes[t].material as usize];
        let texel =
            material.diffuse_map.as_deref().and_then(|map| texel(surfaces, t, map)).unwrap_or(Vec3::ONE);
        let diffuse = Vec3::from(material.diffuse) * texel;
        let own = Vec3::from(material.emission) + diffuse * scene.sky.ambient.as_vec3();
        let sun = scene.sun.as_ref().map_or(Vec3::ZERO, |sun| {
            let half = 0.5 * sun.angular_diameter.as_radians();
            diffuse * sun.color.as_vec3() * height(scene, t, sun.toward, half) as f32
        });
        Self { own, sun }
    }
}

/// The sine of the sun's height over the side of a triangle that is seen, at most: of its disk, which reaches `half` to each side, and over
/// any of its corners' normals. Where it is seen at a grazing angle, either side may be.
fn height(scene: &Scene, t: usize, toward: DVec3, half: f64) -> f64 {
    let surfaces = &scene.surfaces;
    let [a, b, c] = surfaces.corners(t);
    let lens = scene.optics.world_from_lens().point(DVec3::ZERO);
    let (toward, view) = (toward.normalize_or_zero(), (lens - a).normalize_or_zero());
    let radius = scene.optics.aperture_radius();
    let grazing = (radius / (lens - a).length()).min(1.0) + 0.05;
    let over = |normal: DVec3| {
        let normal = normal.normalize_or_zero();
        let (seen, sun) = (normal.dot(view), normal.dot(toward));
        if seen.abs() < grazing { sun.abs() } else { sun * seen.signum() }
    };
    let most = match surfaces.attributes[t].normals {
        [NONE, ..] => over((b - a).cross(c - a)),
        normals => {
            let of_corner = |i: u32| over(surfaces.normals[i as usize].as_dvec3());
            normals.map(of_corner).into_iter().fold(f64::NEG_INFINITY, f64::max)
        }
    };
    (most + half).clamp(0.0, 1.0)
}

/// The texture's mean colour on a triangle, about; none where it has no texture coordinates.
fn texel(surfaces: &Surfaces, t: usize, map: &Texture) -> Option<Vec3> {
    let indices = surfaces.attributes[t].texcoords;
    if indices[0] == NONE {
        return None;
    }
    let uv = indices.map(|i| surfaces.texcoords[i as usize].as_dvec2());
    let finest = map.levels.first()?;
    let size = DVec2::new(f64::from(finest.width), f64::from(finest.height));
    let extent = (uv[0].max(uv[1]).max(uv[2]) - uv[0].min(uv[1]).min(uv[2])) * size;
    let level = libm::log2(extent.max_element().max(1.0)).ceil();
    let last = map.levels.len() - 1;
    let level = &map.levels[if level.is_finite() { (level as usize).min(last) } else { last }];
    let middle = (uv[0] + uv[1] + uv[2]) / 3.0;
    let at = DVec2::new(middle.x, 1.0 - middle.y);
    let at = (at - at.floor()) * DVec2::new(f64::from(level.width), f64::from(level.height));
    let [column, row] = [(at.x as u32).min(level.width - 1), (at.y as u32).min(level.height - 1)];
    let [red, green, blue, _] = *level.texels.get(row as usize * level.width as usize + column as usize)?;
    Some(Vec3::new(f32::from(red), f32::from(green), f32::from(blue)) / 65535.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Result;
    use crate::scene::{LoadSettings, Memory, parse};
    use std::path::Path;

    const SCENE: &str = "[camera]\neye_m = [0.0, 0.0, 1.0]\nlook_at_m = [0.0, 0.0, 0.0]\nfocal_length_mm = 150.0\nf_number = 16.0\n\
                         film = \"4x5\"\nextension_mm = 180.0\n[[mesh]]\npath = \"a.obj\"\n[sky]\nambient = [0.1, 0.2, 0.3]\n\
                         [sun]\ntoward = [0.0, 0.6, 0.8]\ncolor = [10.0, 20.0, 30.0]\n";

    /// Facing the camera; turned away from the sun; along its light; by vertex normals toward it.
    const MESH: &str = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -0.6 -0.8\nv 0 0.28 0.96\nvn 0 0.6 0.8\nf 1 2 3\nf 1 2 5\n\
                        f 1 2 4\nf 1//1 2//1 3//1\n";

    #[test]
    fn light_is_of_emission_sky_and_the_suns_height() -> Result<()> {
        let files = Memory::new()
            .with("a.obj", MESH.as_bytes().to_vec())
            .with("a.mtl", b"newmtl a\nKd 0.5 0.5 0.5\nKe 1 2 3\n".to_vec());
        let scene =
            parse(SCENE, "a.toml")?.describe()?.load_with(&files, Path::new(""), LoadSettings::default())?;
        let lit = |t: usize| Lit::of(&scene, &scene.surfaces.materials, t);
        for t in 0..4 {
            assert_eq!(lit(t).own, Vec3::new(1.05, 2.1, 3.15));
        }
        let sun = |t: usize| lit(t).sun.x / 5.0;
        let heights = [sun(0), sun(1), sun(2), sun(3)];
        for (found, want) in heights.into_iter().zip([0.8, 0.0, 0.0, 1.0]) {
            assert!((found - want).abs() < 1e-5, "{heights:?}");
        }
        Ok(())
    }
}
