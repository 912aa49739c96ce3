//! Lights so small and bright that few samples, or none, meet them: what they may add to a picture that has not seen them.
//!
//! Two halves of the samples that both miss a light agree, and say that nothing is wrong: false convergence. But geometry
//! knows where the light can be seen. A light of `a` square pixels and radiance `L`, spread over `D`, is met by a share
//! `q = a / D` of the samples of each pixel there, and adds `m = L q` to it. While `n` samples of a pixel are expected to
//! meet it fewer than [`ENOUGH`] times, the error there is taken to be at least what chance makes of it: of `n` samples `k`
//! meet the light, and a pixel that has the brightness `b` without it shows `min(1, b + k L / n)` for `min(1, b + m)`. Where the
//! samples of a whole block should have met it several times, `m` is at most what they saw: the rest is hidden.

use super::diffraction::Disk;
use super::picture::Picture;
use super::resolve::{BLOCKS, ByBlock, block_place};
use super::spread::Spread;
use crate::picture::BLOCK;
use crate::raster::TILE;
use crate::raster::bounds::Frustum;
use crate::raster::view::View;
use crate::scene::Scene;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// Times that a light is expected to be met in a pixel before the samples' own word is taken: they are spread so evenly over
/// pixel and lens that hardly any pixel misses it then. (With 16 times the error of lamps was stated up to 3 times too large.)
const ENOUGH: f64 = 2.0;

/// Times that a light is expected to be met in a block before it counts as hidden when its light is not there.
const SEVERAL: f64 = 8.0;

/// Radiance, as shown, from which a small surface counts as a light: beyond what any picture shows.
const BRIGHT: f32 = 2.0;

/// What lights may add to the pixels of a block.
#[derive(Clone, Copy, Default)]
struct Light {
    /// The part of the block that they are spread over, at most 1 for each.
    covered: f64,
    /// The share of a pixel's samples that meet one, times the part.
    share: f64,
    /// Their light, mean over the samples, times the part.
    mean: DVec3,
}

impl Light {
    fn add(&mut self, other: &Self, times: f64) {
        self.covered += times * other.covered;
        self.share += times * other.share;
        self.mean += times * other.mean;
    }
}

/// The small bright lights of a picture.
pub(super) struct Highlights {
    columns: usize,
    /// Block by block; empty where there are no such lights.
    lights: Vec<Light>,
}

impl Highlights {
    /// `positions` are those of the surfaces, in the lens frame. Diffraction spreads light over `disks`. A pixel has
    /// `samples` at least.
    pub(super) fn new(
        scene: &Scene,
        view: &View,
        positions: &[DVec3],
        (samples, gain): (u32, f32),
        disks: &[Disk],
    ) -> Self {
        let surfaces = &scene.surfaces;
        let (columns, rows) = (view.width.div_ceil(BLOCK) as usize, view.height.div_ceil(BLOCK) as usize);
        let shown: Vec<Vec3> = brightness(scene).into_iter().map(|light| light * gain).collect();
        let light_of = |t: usize| shown[surfaces.attributes[t].material as usize];
        let is_bright = |t: &usize| light_of(*t).max_element() >= BRIGHT;
        // One sample has no error stated.
        if samples < 2
            || !shown.iter().any(|light| light.max_element() >= BRIGHT)
            || !(0..surfaces.triangles.len()).any(|t| is_bright(&t))
        {
            return Self { columns, lights: Vec::new() };
        }
        // What changes from block to block; sums along rows then give what there is. A span may end past the last column.
        let stride = columns + 2;
        let mut lights = vec![Light::default(); stride * rows];
        let frustum = Frustum::new(view);
        let place = |&p: &DVec3| frustum.contains(p).then(|| pixel(view, p));
        let places: Vec<Option<DVec2>> = positions.par_iter().map(place).collect();
        for t in (0..surfaces.triangles.len()).filter(is_bright) {
            let [a, b, c] = surfaces.triangles[t].map(|i| i as usize);
            // What comes near the lens is not small.
            let (Some(pa), Some(pb), Some(pc)) = (places[a], places[b], places[c]) else { continue };
            let area = 0.5 * (pb - pa).perp_dot(pc - pa).abs();
            let blurred = Spread::of([pa, pb, pc]).over(blur(view, positions[a], pa));
            let radiance = light_of(t).as_dvec3();
            for disk in disks {
                let spread = blurred.over([DVec2::X * disk.reach.x, DVec2::Y * disk.reach.y]);
                let share = (area * disk.share / spread.area()).min(1.0);
                if !share.is_finite() {
                    continue;
                }
                let light = Light { covered: 1.0, share, mean: radiance * share };
                spread.cover([view.width, view.height], |row, column, by| {
                    lights[row * stride + column].add(&light, by);
                });
            }
        }
        for row in lights.chunks_mut(stride) {
            for column in 1..row.len() {
                let left = row[column - 1];
                row[column].add(&left, 1.0);
            }
        }
        let lights = lights.chunks(stride).flat_map(|row| row[..columns].to_vec()).collect();
        Self { columns, lights }
    }

    /// The lights of a block of a tile, if it has any.
    fn at(&self, tile: (u32, u32), block: usize) -> Option<&Light> {
        let (x, y) = block_place(tile, block);
        let light = self.lights.get(y as usize * self.columns + x as usize);
        // Sums and differences leave a trace where there is nothing.
        light.filter(|light| (x as usize) < self.columns && light.share > 1e-12)
    }
}

impl Picture<'_> {
    /// Raises the squared errors of the blocks with `samples`, each a sum over pixels and channels, to what unseen lights may
    /// add. Tells which were raised.
    pub(super) fn raise_unseen(
        &self,
        tile: (u32, u32),
        sums: &[[Vec3; 2]],
        samples: &ByBlock<u32>,
        squared: &mut ByBlock<f64>,
    ) -> u16 {
        let mut raised = 0;
        for (block, error) in squared.iter_mut().enumerate() {
            let Some(light) = self.highlights.at(tile, block) else { continue };
            let (n, covered) = (samples[block], light.covered.clamp(1e-3, 1.0));
            let share = (light.share / covered).min(1.0);
            if n == 0 || f64::from(n) * share >= ENOUGH {
                continue;
            }
            let Shown { pixels, mean: found, least } = self.shown(tile, block, sums, n);
            let mut mean = light.mean / covered;
            if f64::from(n) * share * pixels * covered >= SEVERAL {
                // Met often enough about here to know how much of it is not hidden.
                mean = mean.min((found - least).max(DVec3::ZERO) / covered);
            }
            let room = DVec3::ONE - least.min(DVec3::ONE);
            let of_channel = |i: usize| expected_error(n, share, mean[i], room[i]);
            let expected = covered * pixels * (of_channel(0) + of_channel(1) + of_channel(2));
            if expected > *error {
                *error = expected;
                raised |= 1 << block;
            }
        }
        raised
    }

    /// What a block shows after `n` samples.
    fn shown(&self, (tx, ty): (u32, u32), block: usize, sums: &[[Vec3; 2]], n: u32) -> Shown {
        let (left, top) = (block as u32 % BLOCKS * BLOCK, block as u32 / BLOCKS * BLOCK);
        let right = (left + BLOCK).min(self.view.width - tx * TILE);
        let bottom = (top + BLOCK).min(self.view.height - ty * TILE);
        let (mut pixels, mut all, mut least) = (0.0, DVec3::ZERO, Vec3::INFINITY);
        for y in top..bottom {
            for x in left..right {
                let Some([a, b]) = sums.get((y * TILE + x) as usize) else { continue };
                let light = (*a + *b) * (self.gain / n as f32);
                (pixels, all, least) = (pixels + 1.0, all + light.as_dvec3(), least.min(light));
            }
        }
        Shown { pixels, mean: all / f64::max(pixels, 1.0), least: least.as_dvec3() }
    }
}

/// What a block shows, not clamped.
struct Shown {
    pixels: f64,
    mean: DVec3,
    /// The least of any pixel, channel by channel: what is there without the light, where it is seldom met.
    least: DVec3,
}

/// The mean squared error of a pixel of which `k` of `n` samples, each with the chance `share`, meet a light that adds `mean`,
/// where it shows no more than `room`.
fn expected_error(n: u32, share: f64, mean: f64, room: f64) -> f64 {
    let hits = f64::from(n) * share;
    if share >= 1.0 || mean <= 0.0 || hits <= 0.0 {
        return 0.0;
    }
    let wanted = mean.min(room);
    let most = ((hits + 10.0 * hits.sqrt() + 10.0).min(200.0) as u32).min(n);
    let (mut chance, mut sum) = (libm::exp(f64::from(n) * libm::log1p(-share)), 0.0);
    for k in 0..=most {
        let gap = (mean * f64::from(k) / hits).min(room) - wanted;
        sum += chance * gap * gap;
        chance *= f64::from(n - k) / f64::from(k + 1) * share / (1.0 - share);
    }
    sum
}

/// The most light that comes from each material: its own, and what of sun and sky it gives back.
fn brightness(scene: &Scene) -> Vec<Vec3> {
    let sun = scene.sun.as_ref().map_or(Vec3::ZERO, |sun| sun.color.as_vec3());
    let light = scene.sky.ambient.as_vec3() + sun;
    let of = |material: &crate::scene::Material| {
        Vec3::from(material.emission) + Vec3::from(material.diffuse) * light
    };
    scene.surfaces.materials.iter().map(of).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_errs_as_its_limits_say() {
        // Hardly ever met: all of it is missing. Met often and never clamped: the noise of counting.
        assert!((expected_error(1, 1e-4, 0.3, 1.0) - 0.09).abs() < 1e-3);
        let (share, mean) = (16.0 / 4096.0, 0.1);
        let counted = mean * mean / 16.0 * (1.0 - share);
        assert!((expected_error(4096, share, mean, 1.0) / counted - 1.0).abs() < 1e-3);
        // So bright that one hit is white: wrong where there was none, and by no more than was dark.
        assert!(
            (expected_error(1 << 20, 3.0 / f64::from(1 << 20), 50.0, 1.0) - libm::exp(-3.0)).abs() < 1e-6
        );
        assert!((expected_error(1, 1e-6, 50.0, 0.5) - 0.25).abs() < 1e-5);
        // What every sample meets is right.
        assert_eq!(expected_error(4, 1.0, 50.0, 1.0), 0.0);
    }
}
