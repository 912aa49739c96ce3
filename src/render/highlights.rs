//! Lights so small and bright that few samples, or none, meet them: what they may add to a picture that has not seen them.
//!
//! Two halves of the samples that both miss a light agree, and say that nothing is wrong: false convergence. But geometry
//! knows where the light can be seen. A light of `a` square pixels and radiance `L`, blurred over `D`, is met by a share
//! `q = a / D` of the samples of each pixel there, and adds `m = L q` to it. While `n` samples of a pixel are expected to
//! meet it fewer than [`ENOUGH`] times, the error there is taken to be at least what chance makes of it: a pixel meets the light
//! `k` times, Poisson about `n q`, and shows `min(1, k L / n)` for `min(1, m)`. Where the samples of a whole block should have
//! met it several times, `m` is at most what they saw: the rest is hidden.

use super::diffraction::Ring;
use super::resolve::{BLOCKS, ByBlock, Resolved};
use crate::picture::BLOCK;
use crate::raster::bounds::Frustum;
use crate::raster::view::View;
use crate::scene::{Scene, Surfaces};
use glam::{DVec2, DVec3, Vec3};

/// Times that a light is expected to be met in a pixel before the samples' own word is taken.
const ENOUGH: f64 = 16.0;

/// Times that a light is expected to be met in a block before it counts as hidden when its light is not there.
const SEVERAL: f64 = 8.0;

/// Radiance, as shown, from which a small surface counts as a light: beyond what any picture shows.
const BRIGHT: f32 = 2.0;

/// What lights may add to the pixels of a block.
#[derive(Clone, Copy, Default)]
struct Light {
    /// The share of a pixel's samples that meet one.
    share: f64,
    /// Their light, mean over the samples.
    mean: f64,
}

impl Light {
    fn add(&mut self, other: &Self, sign: f64) {
        self.share += sign * other.share;
        self.mean += sign * other.mean;
    }
}

/// The small bright lights of a picture.
pub(super) struct Highlights {
    columns: usize,
    /// Block by block; empty where there are no such lights.
    lights: Vec<Light>,
}

impl Highlights {
    /// `positions` are those of the surfaces, in the lens frame. Diffraction spreads light over `rings`, from the inmost.
    pub(super) fn new(scene: &Scene, view: &View, positions: &[DVec3], gain: f32, rings: &[Ring]) -> Self {
        let surfaces = &scene.surfaces;
        let (columns, rows) = (view.width.div_ceil(BLOCK) as usize, view.height.div_ceil(BLOCK) as usize);
        let bright: Vec<f32> = brightness(scene).into_iter().map(|light| light * gain).collect();
        let is_bright = |t: usize| bright[surfaces.attributes[t].material as usize] >= BRIGHT;
        if !bright.iter().any(|&light| light >= BRIGHT) || !(0..surfaces.triangles.len()).any(is_bright) {
            return Self { columns, lights: Vec::new() };
        }
        // Each light marks the corners of its box; sums along rows and columns then fill the boxes.
        let stride = columns + 1;
        let mut lights = vec![Light::default(); stride * (rows + 1)];
        let frustum = Frustum::new(view);
        for t in (0..surfaces.triangles.len()).filter(|&t| is_bright(t)) {
            let radiance = f64::from(bright[surfaces.attributes[t].material as usize]);
            let block = |x: f64, most: usize| ((x / f64::from(BLOCK)).floor().max(0.0) as usize).min(most);
            // From the outmost ring inward: each box adds what its ring is brighter than the one around it.
            let mut around = Light::default();
            for ring in rings.iter().rev() {
                let Some((light, [low, high])) = seen(surfaces, view, &frustum, positions, t, radiance, ring)
                else {
                    continue;
                };
                let mut more = light;
                more.add(&around, -1.0);
                around = light;
                let (x0, x1) = (block(low.x, columns), block(high.x + f64::from(BLOCK), columns));
                let (y0, y1) = (block(low.y, rows), block(high.y + f64::from(BLOCK), rows));
                for (x, y, sign) in [(x0, y0, 1.0), (x1, y0, -1.0), (x0, y1, -1.0), (x1, y1, 1.0)] {
                    lights[y * stride + x].add(&more, sign);
                }
            }
        }
        for i in 0..lights.len() {
            if i % stride > 0 {
                let left = lights[i - 1];
                lights[i].add(&left, 1.0);
            }
        }
        for i in stride..lights.len() {
            let above = lights[i - stride];
            lights[i].add(&above, 1.0);
        }
        let lights = lights.chunks(stride).take(rows).flat_map(|row| row[..columns].to_vec()).collect();
        Self { columns, lights }
    }

    /// Raises the squared errors of a tile's blocks, each a sum over pixels and channels, to what unseen lights may add. Tells
    /// which were raised.
    pub(super) fn raise(&self, (tx, ty): (u32, u32), samples: &ByBlock<u32>, resolved: &mut Resolved) -> u16 {
        let mut raised = 0;
        let pixels = f64::from(BLOCK * BLOCK);
        for (block, error) in resolved.squared.iter_mut().enumerate() {
            let (x, y) = (tx * BLOCKS + block as u32 % BLOCKS, ty * BLOCKS + block as u32 / BLOCKS);
            let at = y as usize * self.columns + x as usize;
            let Some(light) = self.lights.get(at).filter(|_| (x as usize) < self.columns) else { continue };
            let n = f64::from(samples[block]);
            // Sums and differences leave a trace where there is nothing.
            if n == 0.0 || light.share * n >= ENOUGH || light.share < 1e-12 {
                continue;
            }
            let mut mean = light.mean;
            if light.share * n * pixels >= SEVERAL {
                // Met often enough about here to know how much of it is not hidden.
                mean = mean.min(resolved.light[block] / pixels);
            }
            let least = 3.0 * pixels * expected_error(n * light.share, mean);
            if least > *error {
                *error = least;
                raised |= 1 << block;
            }
        }
        raised
    }
}

/// The mean squared error of a pixel that meets a light `k` times, Poisson about `hits`, and shows `min(1, mean k / hits)`.
fn expected_error(hits: f64, mean: f64) -> f64 {
    let wanted = mean.min(1.0);
    let most = (hits + 10.0 * hits.sqrt() + 10.0).min(200.0) as u32;
    let (mut chance, mut sum) = (libm::exp(-hits), 0.0);
    for k in 0..=most {
        let gap = (mean * f64::from(k) / hits).min(1.0) - wanted;
        sum += chance * gap * gap;
        chance *= hits / f64::from(k + 1);
    }
    sum
}

/// The most light that comes from each material: its own, and what of sun and sky it gives back.
fn brightness(scene: &Scene) -> Vec<f32> {
    let sun = scene.sun.as_ref().map_or(Vec3::ZERO, |sun| sun.color.as_vec3());
    let light = scene.sky.ambient.as_vec3() + sun;
    let of = |material: &crate::scene::Material| {
        (Vec3::from(material.emission) + Vec3::from(material.diffuse) * light).max_element()
    };
    scene.surfaces.materials.iter().map(of).collect()
}

/// What a triangle adds to the pixels that may see its light in a ring, and the box of these, in pixels.
fn seen(
    surfaces: &Surfaces,
    view: &View,
    frustum: &Frustum,
    positions: &[DVec3],
    triangle: usize,
    radiance: f64,
    ring: &Ring,
) -> Option<(Light, [DVec2; 2])> {
    let corners = surfaces.triangles[triangle].map(|i| positions[i as usize]);
    if !corners.iter().all(|&corner| frustum.contains(corner)) {
        // It comes near the lens, and is not small then.
        return None;
    }
    let [c0, cu, cv] = &view.pixel_from_lens;
    let places = corners.map(|corner| {
        let p = corner.extend(1.0);
        let w = c0[2].dot(p);
        (DVec2::new(c0[0].dot(p), c0[1].dot(p)) / w, p, w)
    });
    let area = 0.5 * (places[1].0 - places[0].0).perp_dot(places[2].0 - places[0].0).abs();
    // The blur's ellipse: how the image moves with the lens point.
    let (center, p, w) = places[0];
    let moves = |c: &[glam::DVec4; 3]| (DVec2::new(c[0].dot(p), c[1].dot(p)) - center * c[2].dot(p)) / w;
    let (along, across) = (moves(cu), moves(cv));
    let blurred = std::f64::consts::PI * along.perp_dot(across).abs() + area.max(1.0) + ring.area;
    let reach = (along * along + across * across).map(f64::sqrt) + 1.0 + ring.reach;
    let low = places[0].0.min(places[1].0).min(places[2].0) - reach;
    let high = places[0].0.max(places[1].0).max(places[2].0) + reach;
    let share = (area * ring.share / blurred).min(1.0);
    let is_inside = high.x >= 0.0
        && high.y >= 0.0
        && low.x < f64::from(view.width)
        && low.y < f64::from(view.height)
        && share.is_finite()
        && low.is_finite()
        && high.is_finite();
    let light = Light { share, mean: radiance * share };
    is_inside.then_some((light, [low, high]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_errs_as_its_limits_say() {
        // Hardly ever met: all of it is missing. Met often and never clamped: the noise of counting.
        assert!((expected_error(1e-4, 0.3) - 0.09).abs() < 1e-3);
        let (hits, mean) = (16.0, 0.1);
        assert!((expected_error(hits, mean) / (mean * mean / hits) - 1.0).abs() < 1e-3);
        // So bright that one hit is white: wrong where there was none.
        assert!((expected_error(3.0, 50.0) - libm::exp(-3.0)).abs() < 1e-9);
    }
}
