//! A slow, obvious renderer: one lens point, one matrix, one pixel at a time, in double precision.
//!
//! It shares the scene, the sample points and the projection matrices with the library, and no drawing
//! code. Triangles are met in homogeneous coordinates (M. Olano and T. Greer, "Triangle scan conversion
//! using 2D homogeneous coordinates", 1997): the corner weights of the pixel's ray are
//! `l = (c0 c1 c2)^-1 (x, y, 1)` for the corners' clip columns `(x, y, w)`; it is inside where no `l` is
//! negative, and `1/w = l0 + l1 + l2` orders depth.

use glam::{DMat3, DVec2, DVec3};
use groundglass::optics::{Projection, Ray};
use groundglass::sampling::{self, ApertureShape, Diffraction};
use groundglass::scene::{Budget, Mapping, NONE, Scene, Texture};
use std::sync::{Arc, Mutex};

/// A pixel's mean, and how many of its samples lie so near to an edge, or two surfaces so near to each
/// other, that single precision may decide otherwise.
pub struct Pixel {
    pub mean: DVec3,
    pub in_doubt: u32,
    /// How far off single precision may be where textures are steep: see [`TEXEL`].
    pub slack: f64,
}

/// How far off single precision places a sample on a texture, in texels, blurred over hundreds of pixels.
const TEXEL: f64 = 2e-4;

/// A sample: where it goes through the lens and meets the film, in half pictures, and what it sees.
struct Seen {
    number: u32,
    lens: DVec2,
    film: DVec2,
    toward: Option<DVec3>,
    hit: Option<Hit>,
    doubt: bool,
}

/// Renders the pixel in column `i` and row `j`. With `grouped` samples that see one triangle are shaded together, up to 64 in one go:
/// the level of a texture is that of their mean place. With falloff the light of each has its own weight.
pub fn pixel(scene: &Scene, i: u32, j: u32, grouped: bool) -> Pixel {
    let mut out = Pixel { mean: DVec3::ZERO, in_doubt: 0, slack: 0.0 };
    let Budget::Samples(n) = scene.render.budget else { panic!("the oracle needs a number of samples") };
    let stream = sampling::pixel_stream(i, j, n);
    let samples: Vec<Seen> = (0..n)
        .map(|k| {
            let s = sampling::sample_through(&scene.aperture_shape(), scene.render.seed, stream, k);
            let lens = DVec2::from_array(s.lens.map(f64::from)) * scene.optics.aperture_radius();
            let x = 2.0 * (f64::from(i) + f64::from(s.pixel[0])) / f64::from(scene.render.width) - 1.0;
            let y = 1.0 - 2.0 * (f64::from(j) + f64::from(s.pixel[1])) / f64::from(scene.render.height);
            let film = DVec2::new(x, y) + displacement(scene, (i, j), stream, k);
            let (hit, doubt) = see(scene, lens, film);
            Seen { number: k, lens, film, toward: scene.sun_direction((i, j), stream, k), hit, doubt }
        })
        .collect();
    for sample in &samples {
        let same = |other: &&Seen| {
            let triangles = [sample, other].map(|s| s.hit.as_ref().map(|hit| hit.triangle));
            triangles[0] == triangles[1]
        };
        let group: Vec<&Seen> = if grouped { samples.iter().filter(same).collect() } else { Vec::new() };
        // One in doubt moves the mean place of the others.
        let mut doubt = sample.doubt || group.iter().any(|other| other.doubt);
        let count = group.len() as f64;
        let [lens, film] =
            [|s: &&Seen| s.lens, |s: &&Seen| s.film].map(|of| group.iter().map(of).sum::<DVec2>() / count);
        let place = if group.len() > 1 { (lens, film) } else { (sample.lens, sample.film) };
        let (color, near, slack) = radiance(scene, sample, place);
        doubt |= near;
        out.mean += color * falloff(scene, sample) / f64::from(n);
        out.slack += slack / f64::from(n);
        out.in_doubt += u32::from(doubt);
    }
    out
}

/// Patterns that were made before.
static PATTERNS: Mutex<Vec<(ApertureShape, Arc<Diffraction>)>> = Mutex::new(Vec::new());

fn pattern(shape: ApertureShape) -> Arc<Diffraction> {
    let mut patterns = PATTERNS.lock().unwrap();
    if let Some((_, pattern)) = patterns.iter().find(|(known, _)| *known == shape) {
        return pattern.clone();
    }
    let pattern = Arc::new(Diffraction::new(&shape));
    patterns.push((shape, pattern.clone()));
    pattern
}

/// How far diffraction displaces the film point of a sample, in half pictures to the right and up. Distance and direction are
/// those of the middle of the square of 32 x 32 pixels.
fn displacement(scene: &Scene, (i, j): (u32, u32), stream: u64, k: u32) -> DVec2 {
    if !scene.render.diffraction {
        return DVec2::ZERO;
    }
    let square = sampling::diffraction_square(scene.render.seed, stream, k);
    let [u, v] = pattern(scene.aperture_shape()).from_square(square);
    let optics = &scene.optics;
    let film = optics.camera().film;
    let (width, height) = (film.width.as_metres(), film.height.as_metres());
    let middle = |i: u32, size: u32| f64::from(i / 32 * 32 + 16) / f64::from(size) - 0.5;
    let point =
        optics.film_point(-middle(i, scene.render.width) * width, middle(j, scene.render.height) * height);
    let r = point.length();
    let c = point / r;
    // The phase 2 pi s.t / (lambda r) is k.s / R for the lens point s and the aperture's radius R.
    let wanted = DVec2::new(u, v) * 550e-9 * r / (std::f64::consts::TAU * optics.aperture_radius());
    let ((ex, ey), (fx, fy)) = (optics.lens_axes(), optics.film_axes());
    let across = |d: DVec3| {
        let t = d - c * c.dot(d);
        DVec2::new(t.dot(ex), t.dot(ey))
    };
    let (a, b) = (across(fx), across(fy));
    let d = DVec2::new(wanted.perp_dot(b), a.perp_dot(wanted)) / a.perp_dot(b);
    DVec2::new(-2.0 * d.x / width, -2.0 * d.y / height)
}

struct Hit {
    triangle: usize,
    weights: DVec3,
    /// Change of the weights with one pixel to the right and down.
    dx: DVec3,
    dy: DVec3,
    inverse_w: f64,
}

/// Whether no other surface crosses the ray from `point`, on `own`, along `l`; and whether it is a near thing.
fn visible(scene: &Scene, own: usize, point: DVec3, l: DVec3) -> (bool, bool) {
    let (x, y) = l.any_orthonormal_pair();
    // In single precision a ray's places are told by their height toward the middle of the sun: the flatter it is, the worse.
    let middle = scene.sun.as_ref().map_or(l, |sun| sun.toward.normalize());
    let hair = 3e-5 / middle.dot(l).max(1e-4);
    let (mut visible, mut doubt) = (true, false);
    for t in (0..scene.surfaces.triangles.len()).filter(|&t| t != own) {
        let corners = scene.surfaces.corners(t).map(|c| c - point);
        let [a, b, c] = corners.map(|c| DVec2::new(x.dot(c), y.dot(c)));
        let edges = [(b, c), (c, a), (a, b)];
        let sides = edges.map(|(p, q)| p.perp_dot(q));
        let area: f64 = sides.iter().sum();
        let inside = edges
            .iter()
            .zip(sides)
            .map(|((p, q), side)| side * area.signum() / (q - p).length().max(1e-300))
            .fold(f64::INFINITY, f64::min);
        if area == 0.0 || inside < -hair {
            continue;
        }
        let weights = DVec3::from_array(sides) / area;
        let height = l.dot(corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z);
        if height < -hair || (height.abs() < 1e-9 && inside < hair) {
            continue;
        }
        let alpha = texel_alpha(scene, t, weights);
        if alpha < 0.5 - 1e-3 {
            continue;
        }
        let near = inside < hair || height < hair || alpha < 0.5 + 1e-3;
        doubt |= near;
        visible &= near && (inside < 0.0 || height < 0.0 || alpha < 0.5);
        if !near {
            return (false, false);
        }
    }
    (visible, doubt)
}

/// The opacity of a triangle at a place, in the finest level.
fn texel_alpha(scene: &Scene, t: usize, w: DVec3) -> f64 {
    let attributes = scene.surfaces.attributes[t];
    let material = &scene.surfaces.materials[attributes.material as usize];
    if attributes.texcoords[0] == NONE {
        return 1.0;
    }
    let [a, b, c] = attributes.texcoords.map(|i| scene.surfaces.texcoords[i as usize].as_dvec2());
    let uv = a * w.x + b * w.y + c * w.z;
    let of =
        |map: &Option<Arc<Texture>>, uv: DVec2| map.as_ref().map_or(1.0, |map| bilinear(map, 0, uv).0[3]);
    let Mapping { scale, offset } = material.opacity_mapping;
    of(&material.diffuse_map, uv).min(of(&material.opacity_map, uv * scale + offset))
}

/// Where the line through the lens point of a projection and a point of the film meets the plane of triangle `t`; none where the
/// triangle is edge-on.
fn meet(scene: &Scene, t: usize, matrix: &Projection, film: DVec2) -> Option<Hit> {
    let clip = scene.surfaces.corners(t).map(|c| {
        let c = matrix.project(c);
        DVec3::new(c.x, c.y, c.w)
    });
    let columns = DMat3::from_cols(clip[0], clip[1], clip[2]);
    if columns.determinant() == 0.0 {
        return None;
    }
    let inverse = columns.inverse();
    let l = inverse * film.extend(1.0);
    let inverse_w = l.element_sum();
    let weights = l / inverse_w;
    let pixel = [2.0 / f64::from(scene.render.width), -2.0 / f64::from(scene.render.height)];
    let change = |c: DVec3| (c - weights * c.element_sum()) / inverse_w;
    let (dx, dy) = (change(inverse.x_axis * pixel[0]), change(inverse.y_axis * pixel[1]));
    Some(Hit { triangle: t, weights, dx, dy, inverse_w })
}

/// What a sample sees, and whether by a hair it would be something else.
fn see(scene: &Scene, lens: DVec2, film: DVec2) -> (Option<Hit>, bool) {
    let optics = &scene.optics;
    let mut best: Option<Hit> = None;
    // What is behind what is seen can be in doubt and change nothing.
    let mut nearest_doubt = 0.0f64;
    let matrix = optics.projection_from_world(lens.x, lens.y);
    for t in 0..scene.surfaces.triangles.len() {
        let Some(hit) = meet(scene, t, &matrix, film) else { continue };
        let Hit { weights, dx, dy, inverse_w, .. } = hit;
        let corners = scene.surfaces.corners(t);
        // How far the nearest edge is, in pixels.
        let margin = (0..3)
            .map(|i| weights[i] / (dx[i].abs() + dy[i].abs()).max(1e-300))
            .fold(f64::INFINITY, f64::min);
        let point = corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
        let depth = optics.axis().dot(optics.world_from_lens().point_inverse(point));
        let near = optics.camera().near.as_metres();
        if inverse_w <= 0.0 || margin < -2e-3 || depth < near * (1.0 - 1e-5) {
            continue;
        }
        if margin.abs() < 2e-3 || (depth - near).abs() < near * 1e-5 {
            nearest_doubt = nearest_doubt.max(inverse_w);
        }
        if margin < 0.0 || depth < near {
            continue;
        }
        match alpha(scene, &hit) {
            a if a < 0.5 - 1e-4 => continue,
            a if a < 0.5 + 1e-4 => nearest_doubt = nearest_doubt.max(inverse_w),
            _ => {}
        }
        match &best {
            Some(other) if (inverse_w / other.inverse_w - 1.0).abs() < 1e-5 => {
                nearest_doubt = nearest_doubt.max(inverse_w);
                if inverse_w > other.inverse_w {
                    best = Some(hit);
                }
            }
            Some(other) if inverse_w <= other.inverse_w => {}
            _ => best = Some(hit),
        }
    }
    let seen = best.as_ref().map_or(0.0, |hit| hit.inverse_w);
    (best, nearest_doubt > 0.0 && nearest_doubt >= seen * (1.0 - 1e-4))
}

/// The light of a sample, the level of its texture that of a mean place; whether by a hair it would be another; and how far
/// single precision may be off.
fn radiance(scene: &Scene, sample: &Seen, (lens, film): (DVec2, DVec2)) -> (DVec3, bool, f64) {
    match &sample.hit {
        Some(hit) => {
            let levels = meet(scene, hit.triangle, &scene.optics.projection_from_world(lens.x, lens.y), film);
            shade(
                scene,
                (hit, levels.as_ref().unwrap_or(hit)),
                direction(scene, sample.lens, sample.film),
                sample.toward,
            )
        }
        None => {
            let rise = scene.up.normalize().dot(direction(scene, sample.lens, sample.film)).max(0.0);
            (scene.sky.horizon + (scene.sky.zenith - scene.sky.horizon) * rise, false, 0.0)
        }
    }
}

/// Where the line through a lens point and a point of the film goes, in the world.
fn direction(scene: &Scene, lens: DVec2, film: DVec2) -> DVec3 {
    scene.optics.world_from_lens().vector(ray(scene, lens, film).direction).normalize()
}

fn ray(scene: &Scene, lens: DVec2, film: DVec2) -> Ray {
    let size = scene.optics.camera().film;
    let [x, y] = [-film.x * 0.5 * size.width.as_metres(), -film.y * 0.5 * size.height.as_metres()];
    scene.optics.ray(lens.x, lens.y, x, y)
}

/// The part of the light that arrives along a sample's ray: none where the film stands before the plane of the lens.
fn falloff(scene: &Scene, sample: &Seen) -> f64 {
    if !scene.render.falloff {
        return 1.0;
    }
    let optics = &scene.optics;
    let film = optics.camera().film;
    let film_x = -sample.film.x * 0.5 * film.width.as_metres();
    let film_y = -sample.film.y * 0.5 * film.height.as_metres();
    let origin = optics.ray(sample.lens.x, sample.lens.y, film_x, film_y).origin;
    let weight = |s: DVec3, p: DVec3| {
        let r = p - s;
        let cos = |n: DVec3| (n.dot(r) / r.length() * n.dot(optics.film_center()).signum()).max(0.0);
        cos(optics.axis()) * cos(optics.film_normal()) / r.length_squared()
    };
    weight(origin, optics.film_point(film_x, film_y)) / weight(DVec3::ZERO, optics.film_center())
}

fn shade(
    scene: &Scene,
    (hit, levels): (&Hit, &Hit),
    direction: DVec3,
    toward: Option<DVec3>,
) -> (DVec3, bool, f64) {
    let surfaces = &scene.surfaces;
    let attributes = surfaces.attributes[hit.triangle];
    let material = &surfaces.materials[attributes.material as usize];
    let w = hit.weights;
    let mut normal = if attributes.normals[0] == NONE {
        let [a, b, c] = surfaces.corners(hit.triangle);
        (b - a).cross(c - a).normalize()
    } else {
        let [a, b, c] = attributes.normals.map(|i| surfaces.normals[i as usize].as_dvec3().normalize());
        (a * w.x + b * w.y + c * w.z).normalize()
    };
    if normal.dot(direction) > 0.0 {
        normal = -normal;
    }
    let mut diffuse = DVec3::from_array(material.diffuse.map(f64::from));
    let (mut doubt, mut slack) = (false, 0.0);
    if let (Some(map), Some((uv, ..)), Some((_, dx, dy))) =
        (&material.diffuse_map, coordinates(scene, hit), coordinates(scene, levels))
    {
        let (texel, near, contrast) = colour(map, (uv, dx, dy));
        (doubt, slack) = (near, TEXEL * contrast);
        diffuse *= DVec3::new(texel[0], texel[1], texel[2]);
    }
    let mut light = scene.sky.ambient;
    if let (Some(sun), Some(toward)) = (&scene.sun, toward) {
        let mut height = normal.dot(toward).max(0.0);
        if sun.shadows && height > 0.0 {
            let [a, b, c] = surfaces.corners(hit.triangle);
            let (visible, near) = visible(scene, hit.triangle, a * w.x + b * w.y + c * w.z, toward);
            doubt |= near;
            height *= f64::from(u8::from(visible));
        }
        doubt |= sun.shadows && height.abs() < 1e-5 && height > 0.0;
        light += sun.color * height;
    }
    (DVec3::from_array(material.emission.map(f64::from)) + diffuse * light, doubt, slack)
}

fn alpha(scene: &Scene, hit: &Hit) -> f64 {
    let material = &scene.surfaces.materials[scene.surfaces.attributes[hit.triangle].material as usize];
    let Some((uv, dx, dy)) = coordinates(scene, hit) else { return 1.0 };
    let of = |map: &Option<Arc<Texture>>, scale: DVec2, offset: DVec2| {
        map.as_ref().map_or(1.0, |map| {
            let level = level_of(map, scale * dx, scale * dy, 0.25).0;
            bilinear(map, level, scale * uv + offset).0[3]
        })
    };
    let Mapping { scale, offset } = material.opacity_mapping;
    of(&material.diffuse_map, DVec2::ONE, DVec2::ZERO).min(of(&material.opacity_map, scale, offset))
}

fn coordinates(scene: &Scene, hit: &Hit) -> Option<(DVec2, DVec2, DVec2)> {
    let attributes = scene.surfaces.attributes[hit.triangle];
    if attributes.texcoords[0] == NONE {
        return None;
    }
    let [a, b, c] = attributes.texcoords.map(|i| scene.surfaces.texcoords[i as usize].as_dvec2());
    let mix = |w: DVec3| a * w.x + b * w.y + c * w.z;
    Some((mix(hit.weights), mix(hit.dx), mix(hit.dy)))
}

/// The level that is `log2` of `factor` widths of the pixel's footprint across its longer side, rounded down, and whether it is near the next.
fn level_of(texture: &Texture, dx: DVec2, dy: DVec2, factor: f64) -> (usize, bool) {
    let size = DVec2::new(f64::from(texture.levels[0].width), f64::from(texture.levels[0].height));
    let (dx, dy) = (dx * size, dy * size);
    let width = dx.perp_dot(dy).abs() / dx.length().max(dy.length());
    let level = libm::log2(width * factor).max(0.0);
    (
        (level as usize).min(texture.levels.len() - 1),
        (level - (level + 0.5).floor()).abs() < 1e-5 && level > 1e-5,
    )
}

/// Colour: magnified, bilinear in the finest level; else the nearest texel of the level whose texels are nearest
/// to a quarter of the pixel's width. And whether a hair's breadth would change it, and how much a texel's breadth does.
fn colour(texture: &Texture, (uv, dx, dy): (DVec2, DVec2, DVec2)) -> ([f64; 4], bool, f64) {
    let (level, doubt) = level_of(texture, dx, dy, std::f64::consts::SQRT_2 / 4.0);
    if level == 0 {
        let (texel, contrast) = bilinear(texture, 0, uv);
        return (texel, doubt, contrast);
    }
    let level = &texture.levels[level];
    let size = DVec2::new(f64::from(level.width), f64::from(level.height));
    let at = DVec2::new(uv.x - uv.x.floor(), (1.0 - uv.y) - (1.0 - uv.y).floor()) * size;
    let near = |c: f64| (c - (c + 0.5).floor()).abs() < 1e-3;
    let (x, y) = (at.x as usize % level.width as usize, at.y as usize % level.height as usize);
    let texel = level.texels[y * level.width as usize + x].map(|c| f64::from(c) / 65535.0);
    (texel, doubt || near(at.x) || near(at.y), 0.0)
}

/// Between the four texels around a place; and the largest difference of two beside each other.
fn bilinear(texture: &Texture, level: usize, uv: DVec2) -> ([f64; 4], f64) {
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
    let mut contrast = 0.0f64;
    let mean = std::array::from_fn(|i| {
        let [a, b, c, d] = corners.map(|t| t[i]);
        contrast = [a - b, c - d, a - c, b - d].into_iter().map(f64::abs).fold(contrast, f64::max);
        (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy
    });
    (mean, contrast)
}
