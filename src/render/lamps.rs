//! Lamps: which surfaces of a scene are small, bright and seen, and where the lens spreads their light. In: a scene and its view. Out: one
//! [`Lamp`] for all triangles of a material that are spread over the same place, for [`super::highlights`].

use super::diffraction::Disk;
use super::lit::Lit;
use super::spread::Spread;
use crate::raster::vertex_boxes::Frustum;
use crate::raster::view::View;
use crate::sampling::ApertureShape;
use crate::scene::{Material, Scene, Surfaces};
use crate::shade::{ShadowSun, Sight};
use fearless_simd::Level;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// Times that a light is expected to be met in a pixel before the samples' own word is taken: they are spread so evenly over
/// pixel and lens that hardly any pixel misses it then. (With 16 times the error of lamps was stated up to 3 times too large.)
pub(super) const ENOUGH: f64 = 2.0;

/// Radiance, as shown, from which a small surface counts as a light: beyond what any picture shows.
const BRIGHT: f32 = 2.0;

/// So many lights at most are looked at for what stands before them, some microseconds each.
const MOST_RARE: usize = 4096;

/// A small bright light.
pub(super) struct Lamp {
    /// What it shows on the mean, linear light after exposure.
    pub shown: DVec3,
    /// The area of it that is free, square pixels.
    pub area: f64,
    /// Where the lens spreads it, by how much its triangles cover: what each of them covers is mostly the same few pixels.
    pub spread: Spread,
}

/// A small bright triangle: its area where it is seen, square pixels, where the lens spreads it, and its light as shown ([`Lit`]).
struct Small {
    triangle: usize,
    area: f64,
    spread: Spread,
    own: Vec3,
    sun: Vec3,
}

/// Whether some of a scene's materials are bright enough.
pub(super) fn may_be_any(scene: &Scene) -> bool {
    let gain = libm::exp2(scene.render.exposure_ev) as f32;
    let most = |material: &Material| (scene.most_light(material) * gain).max_element();
    scene.surfaces.materials.iter().any(|material| most(material) >= BRIGHT)
}

/// The lamps of a scene in a view, none where nothing in it is bright; `positions` are those of the surfaces, in the lens frame. Diffraction
/// spreads light over `disks`. A pixel has `samples` at least. What stands before a light that few samples meet keeps its part away, and what
/// stands before the `sun`, where that casts shadows, the sun's. Once it is to `stop` what is found tells nothing.
pub(super) fn find(
    (scene, materials): (&Scene, &[Material]),
    (view, shape): (&View, &ApertureShape),
    positions: &[DVec3],
    (samples, gain): (u32, f32),
    disks: &[Disk],
    sun: Option<&ShadowSun<'_>>,
    (level, stop): (Level, &(dyn Fn() -> bool + Sync)),
) -> Option<Vec<Lamp>> {
    let surfaces = &scene.surfaces;
    let shown: Vec<Vec3> = materials.iter().map(|material| scene.most_light(material) * gain).collect();
    let light_of = |t: usize| shown[surfaces.attributes[t].material as usize];
    let is_bright = |t: &usize| light_of(*t).max_element() >= BRIGHT;
    // One sample has no error stated.
    if samples < 2
        || !shown.iter().any(|light| light.max_element() >= BRIGHT)
        || !(0..surfaces.triangles.len()).any(|t| is_bright(&t))
    {
        return None;
    }
    let frustum = Frustum::new(view);
    let place = |&p: &DVec3| (!stop() && frustum.contains(p)).then(|| pixel(view, p));
    let places: Vec<Option<DVec2>> = positions.par_iter().map(place).collect();
    let small: Vec<Small> = (0..surfaces.triangles.len())
        .into_par_iter()
        .filter(|t| is_bright(t) && !stop())
        .filter_map(|t| {
            let [a, b, c] = surfaces.triangles[t].map(|i| i as usize);
            // What comes near the lens is not small.
            let [pa, pb, pc] = [places[a]?, places[b]?, places[c]?];
            let Lit { own, sun } = Lit::of(scene, materials, t);
            if ((own + sun) * gain).max_element() < BRIGHT {
                return None;
            }
            let area = 0.5 * (pb - pa).perp_dot(pc - pa).abs();
            let spread = Spread::of([pa, pb, pc]).over(blur(view, positions[a], pa));
            Some(Small { triangle: t, area, spread, own: own * gain, sun: sun * gain })
        })
        .collect();
    // Through the disk that spreads them farthest few samples meet even a light that most meet without diffraction.
    let is_rare = |light: &Small| {
        let of_disk = |disk: &Disk| {
            f64::from(samples) * light.area * disk.share < ENOUGH * over(light.spread, disk).area()
        };
        disks.iter().any(of_disk)
    };
    let meshes = (&scene.surfaces, materials);
    let free = free((level, stop), meshes, (view, shape), positions, sun, (&small, is_rare));
    let material = |t: usize| {
        let own = f64::from(materials[surfaces.attributes[t].material as usize].coverage);
        (surfaces.attributes[t].material, own)
    };
    Some(together(small.iter().zip(free), material, stop))
}

/// A spread again, over a disk of diffraction.
pub(super) fn over(spread: Spread, disk: &Disk) -> Spread {
    spread.over([DVec2::X * disk.reach.x, DVec2::Y * disk.reach.y])
}

/// Triangles of one `material`, each with the parts of its own light and of the sun's that are free, that are spread over the same place, as
/// one lamp each.
fn together<'a>(
    small: impl Iterator<Item = (&'a Small, [f64; 2])>,
    material: impl Fn(usize) -> (u32, f64),
    stop: &(dyn Fn() -> bool + Sync),
) -> Vec<Lamp> {
    let lit = |(light, [free, sunlit]): (&Small, [f64; 2])| {
        let (material, coverage) = material(light.triangle);
        let area = light.area * free * coverage;
        let shown = light.own + light.sun * sunlit as f32;
        let counts = area > 0.0 && light.spread.area().is_finite() && shown.max_element() >= BRIGHT;
        counts.then(|| ((material, light.spread.square()), shown.as_dvec3(), (area, light.spread)))
    };
    let mut places: Vec<_> = small.take_while(|_| !stop()).filter_map(lit).collect();
    // In a place they stay in order.
    places.par_sort_by_key(|(place, ..)| *place);
    let of_place = places.chunk_by(|a, b| a.0 == b.0).take_while(|_| !stop());
    let lamp = |lights: &[(_, DVec3, (f64, Spread))]| {
        let parts: Vec<(f64, Spread)> = lights.iter().map(|(.., part)| *part).collect();
        let area: f64 = parts.iter().map(|(area, _)| area).sum();
        let all: DVec3 = lights.iter().map(|(_, shown, (area, _))| *shown * *area).sum();
        Lamp { shown: all / area, area, spread: Spread::together(&parts) }
    };
    of_place.map(lamp).collect()
}

/// The parts of the light of these triangles that nothing keeps from the lens, and of the sun's light that nothing keeps from them; all where
/// so many are too small to be met often that it would take longer than the picture.
fn free(
    (level, stop): (Level, &(dyn Fn() -> bool + Sync)),
    shown: (&Surfaces, &[Material]),
    (view, shape): (&View, &ApertureShape),
    positions: &[DVec3],
    sun: Option<&ShadowSun<'_>>,
    (small, is_rare): (&[Small], impl Fn(&Small) -> bool + Sync),
) -> Vec<[f64; 2]> {
    let rare = small.iter().filter(|light| is_rare(light)).count();
    if rare == 0 || rare > MOST_RARE {
        return vec![[1.0; 2]; small.len()];
    }
    let sight = Sight::new(shown, positions, view, shape);
    let of = |light: &Small| {
        if !is_rare(light) || stop() {
            return [1.0; 2];
        }
        let t = light.triangle as u32;
        let has_sun = light.sun.max_element() > 0.0;
        [sight.free(level, t), sun.filter(|_| has_sun).map_or(1.0, |sun| sun.reaches(level, t))]
    };
    small.par_iter().map(of).collect()
}

/// Where a point is seen through the centre of the lens.
fn pixel(view: &View, point: DVec3) -> DVec2 {
    let ([c, ..], p) = (&view.pixel_from_lens, point.extend(1.0));
    DVec2::new(c[0].dot(p), c[1].dot(p)) / c[2].dot(p)
}

/// The half-axes of the ellipse over which the lens spreads a point, which is seen at `place`: how its image moves with the
/// lens point.
fn blur(view: &View, point: DVec3, place: DVec2) -> [DVec2; 2] {
    let ([c, cu, cv], p) = (&view.pixel_from_lens, point.extend(1.0));
    let w = c[2].dot(p);
    [cu, cv].map(|c| (DVec2::new(c[0].dot(p), c[1].dot(p)) - place * c[2].dot(p)) / w)
}
