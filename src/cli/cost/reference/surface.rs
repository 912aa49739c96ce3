//! What a ray sees, in double precision: the contract's shading. A ray in, light out.

use super::tree::{Hit, Tree, meet};
use glam::{DVec2, DVec3};
use groundglass::scene::{Mapping, NONE, Scene, Texture};
use std::f64::consts::SQRT_2;

/// How colours are read from a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) enum Filter {
    /// As the renderer does: bilinear where magnified, else the nearest texel of a level finer than the pixel.
    Renderer,
    /// Between the two levels nearest to the pixel's size, bilinear in each (L. Williams, "Pyramidal parametrics", Computer
    /// Graphics 17(3), 1983, 1-11).
    Trilinear,
    /// Bilinear in the texture as it is.
    Bilinear,
    /// The nearest texel of the texture as it is.
    Nearest,
}

/// A ray, and the directions of those through the same lens point a pixel to the right and down.
pub(super) struct Eye {
    pub(super) from: DVec3,
    pub(super) direction: DVec3,
    pub(super) right: DVec3,
    pub(super) down: DVec3,
}

/// A place in a texture, and how it changes with a pixel to the right and down.
type Place = [DVec2; 3];

/// Light that arrives along a ray; `toward` is where the sun shines from.
pub(super) fn radiance(
    scene: &Scene,
    tree: &Tree<'_>,
    filter: Filter,
    eye: &Eye,
    toward: Option<DVec3>,
) -> DVec3 {
    let optics = &scene.optics;
    let axis = optics.world_from_lens().vector(optics.axis());
    let least = optics.camera().near.as_metres() / axis.dot(eye.direction);
    let range = (least.next_down(), f64::INFINITY);
    let stops = |hit: &Hit| alpha(scene, hit, || place(scene, eye, hit), Some(0.25)) >= 0.5;
    match tree.first(eye.from, eye.direction, range, stops) {
        Some(hit) => shade(scene, tree, filter, eye, &hit, toward),
        None => {
            let rise = scene.up.normalize().dot(eye.direction).max(0.0);
            scene.sky.horizon + (scene.sky.zenith - scene.sky.horizon) * rise
        }
    }
}

fn shade(
    scene: &Scene,
    tree: &Tree<'_>,
    filter: Filter,
    eye: &Eye,
    hit: &Hit,
    toward: Option<DVec3>,
) -> DVec3 {
    let surfaces = &scene.surfaces;
    let attributes = surfaces.attributes[hit.triangle];
    let material = &surfaces.materials[attributes.material as usize];
    let mix = |[a, b, c]: [DVec3; 3]| a * hit.weights.x + b * hit.weights.y + c * hit.weights.z;
    let corners = surfaces.corners(hit.triangle);
    let normal = match attributes.normals {
        [NONE, ..] => (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize(),
        normals => mix(normals.map(|i| surfaces.normals[i as usize].as_dvec3().normalize())).normalize(),
    };
    let normal = if normal.dot(eye.direction) > 0.0 { -normal } else { normal };
    let mut diffuse = DVec3::from_array(material.diffuse.map(f64::from));
    if let (Some(map), Some(place)) = (&material.diffuse_map, place(scene, eye, hit)) {
        let [r, g, b, _] = colour(map, filter, &place);
        diffuse *= DVec3::new(r, g, b);
    }
    let mut light = scene.sky.ambient;
    if let (Some(sun), Some(toward)) = (&scene.sun, toward) {
        let height = normal.dot(toward).max(0.0);
        let point = mix(corners);
        let blocked = || {
            let stops = |other: &Hit| {
                other.triangle != hit.triangle && alpha(scene, other, || finest(scene, other), None) >= 0.5
            };
            tree.first(point, toward, (0.0, f64::INFINITY), stops).is_some()
        };
        if height > 0.0 && !(sun.shadows && blocked()) {
            light += sun.color * height;
        }
    }
    DVec3::from_array(material.emission.map(f64::from)) + diffuse * light
}

/// The opacity of a hit: less than a half is a hole. Read at a level for `pixel` of a pixel, or the finest.
fn alpha(scene: &Scene, hit: &Hit, place: impl Fn() -> Option<Place>, pixel: Option<f64>) -> f64 {
    let material = &scene.surfaces.materials[scene.surfaces.attributes[hit.triangle].material as usize];
    let maps =
        [(&material.diffuse_map, Mapping::IDENTITY), (&material.opacity_map, material.opacity_mapping)];
    let maps = maps.map(|(map, mapping)| Some((map.as_deref().filter(|map| map.has_holes)?, mapping)));
    if maps == [None, None] {
        return 1.0;
    }
    let Some([at, dx, dy]) = place() else { return 1.0 };
    let read = |(map, mapping): (&Texture, Mapping)| {
        let place = [mapping.at(at), mapping.scale * dx, mapping.scale * dy];
        let level = pixel.map_or(0.0, |pixel| level(map, pixel * width(map, &place)));
        bilinear(map, level as usize, place[0])[3]
    };
    maps.into_iter().flatten().map(read).fold(1.0, f64::min)
}

/// Where a hit lies in its texture, without a pixel's size.
fn finest(scene: &Scene, hit: &Hit) -> Option<Place> {
    Some([coordinates(scene, hit)?, DVec2::ZERO, DVec2::ZERO])
}

fn place(scene: &Scene, eye: &Eye, hit: &Hit) -> Option<Place> {
    let at = coordinates(scene, hit)?;
    let beside = |direction: DVec3| {
        let other = meet(&scene.surfaces, hit.triangle, eye.from, direction)?;
        Some(coordinates(scene, &other)? - at)
    };
    Some([at, beside(eye.right).unwrap_or(DVec2::ZERO), beside(eye.down).unwrap_or(DVec2::ZERO)])
}

fn coordinates(scene: &Scene, hit: &Hit) -> Option<DVec2> {
    let attributes = scene.surfaces.attributes[hit.triangle];
    if attributes.texcoords[0] == NONE {
        return None;
    }
    let [a, b, c] = attributes.texcoords.map(|i| scene.surfaces.texcoords[i as usize].as_dvec2());
    Some(a * hit.weights.x + b * hit.weights.y + c * hit.weights.z)
}

/// The sides of a pixel's footprint in texels.
fn sides(texture: &Texture, [_, dx, dy]: &Place) -> [DVec2; 2] {
    let size = DVec2::new(f64::from(texture.levels[0].width), f64::from(texture.levels[0].height));
    [*dx * size, *dy * size]
}

/// The width of a pixel's footprint across its longer side, texels: what the renderer goes by.
fn width(texture: &Texture, place: &Place) -> f64 {
    let [dx, dy] = sides(texture, place);
    dx.perp_dot(dy).abs() / dx.length().max(dy.length())
}

/// `log2` of a length in texels, at least 0 and at most the coarsest level.
fn level(texture: &Texture, length: f64) -> f64 {
    let level = libm::log2(length);
    if level > 0.0 { level.min((texture.levels.len() - 1) as f64) } else { 0.0 }
}

fn colour(texture: &Texture, filter: Filter, place: &Place) -> [f64; 4] {
    match filter {
        Filter::Renderer => match level(texture, width(texture, place) * SQRT_2 / 4.0) as usize {
            0 => bilinear(texture, 0, place[0]),
            level => nearest(texture, level, place[0]),
        },
        Filter::Trilinear => {
            // By the shorter side, as textbooks have it.
            let [dx, dy] = sides(texture, place).map(DVec2::length);
            let level = level(texture, dx.min(dy));
            let (fine, share) = (level as usize, level.fract());
            let coarse = (fine + 1).min(texture.levels.len() - 1);
            let (a, b) = (bilinear(texture, fine, place[0]), bilinear(texture, coarse, place[0]));
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
        }
        Filter::Bilinear => bilinear(texture, 0, place[0]),
        Filter::Nearest => nearest(texture, 0, place[0]),
    }
}

fn nearest(texture: &Texture, level: usize, uv: DVec2) -> [f64; 4] {
    let level = &texture.levels[level];
    let at = |c: f64, size: u32| (((c - c.floor()) * f64::from(size)) as usize).min(size as usize - 1);
    let (x, y) = (at(uv.x, level.width), at(1.0 - uv.y, level.height));
    level.texels[y * level.width as usize + x].map(|c| f64::from(c) / 65535.0)
}

fn bilinear(texture: &Texture, level: usize, uv: DVec2) -> [f64; 4] {
    let level = &texture.levels[level];
    let at = DVec2::new(uv.x * f64::from(level.width), (1.0 - uv.y) * f64::from(level.height)) - 0.5;
    let texel = |x: f64, y: f64| {
        let wrap = |c: f64, size: u32| (c as i64).rem_euclid(i64::from(size)) as usize;
        level.texels[wrap(y, level.height) * level.width as usize + wrap(x, level.width)]
            .map(|c| f64::from(c) / 65535.0)
    };
    let (x, y) = (at.x.floor(), at.y.floor());
    let (fx, fy) = (at.x - x, at.y - y);
    let corners = [texel(x, y), texel(x + 1.0, y), texel(x, y + 1.0), texel(x + 1.0, y + 1.0)];
    std::array::from_fn(|i| {
        let [a, b, c, d] = corners.map(|texel| texel[i]);
        (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
    })
}
