//! Penumbras where the sun grazes a surface whose vertex normals turn to it: long, and bright. In: a scene. Out: how much of the picture they
//! change, RMS, at most: for [`super::small`].
//!
//! A penumbra on a plane at which light of a height `g` (its sine) grazes is `1 / g` times as long as square to the light, and as bright as
//! its normals say, `h`. Without normals of its own `h = g`, and square to the light it is most; `h^2` beyond `g` it is more. Over a penumbra
//! the sun's disk and its middle differ by `h^2 / 12`, squared, on the mean; one that crosses each such triangle is counted.

use super::frame::Frame;
use super::light::of_sun;
use super::seen::{CHUNK, Light, Stop};
use crate::scene::{NONE, Scene};
use glam::DVec3;
use rayon::prelude::*;

/// See the module.
pub(super) fn change(scene: &Scene, stop: Stop<'_>) -> f64 {
    let (optics, surfaces) = (&scene.optics, &scene.surfaces);
    if surfaces.normals.is_empty() {
        return 0.0;
    }
    let Some(light) = Light::of(scene).filter(|light| light.width > 0.0) else { return 0.0 };
    let frame = Frame::new(scene);
    let [width, height] = [scene.render.width, scene.render.height].map(f64::from);
    // Pixels times squares of heights.
    let of_triangle = |t: usize| {
        let normals = surfaces.attributes[t].normals;
        if normals[0] == NONE {
            return 0.0;
        }
        let [a, b, c] = surfaces.corners(t);
        // What has no area is not seen.
        let Some(face) = (b - a).cross(c - a).try_normalize() else { return 0.0 };
        let over = |normal: DVec3| normal.dot(light.toward).abs();
        let heights = normals.map(|i| over(surfaces.normals[i as usize].as_dvec3().normalize_or_zero()));
        let (most, plane) = (heights.into_iter().fold(0.0, f64::max), over(face));
        if most * most <= plane {
            return 0.0;
        }
        let corners = frame.in_view([a, b, c].map(|p| optics.world_from_lens().point_inverse(p)));
        let way = light.way_to([a, b, c]);
        if corners.is_empty() || way == 0.0 {
            return 0.0;
        }
        // What goes on beyond the triangle is its neighbours'.
        let scale = frame.magnification(&corners);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let longest = (scale * longest).min(libm::hypot(width, height));
        (scale * way * light.width / plane).min(longest) * longest * most * most
    };
    let count = surfaces.triangles.len();
    // Chunk by chunk in order: the same sum on any number of threads.
    let sums: Vec<f64> = (0..count)
        .into_par_iter()
        .step_by(CHUNK)
        .filter(|_| !stop())
        .map(|first| (first..(first + CHUNK).min(count)).map(of_triangle).sum())
        .collect();
    of_sun(scene) * (sums.iter().sum::<f64>() / 12.0 / (width * height)).sqrt()
}
