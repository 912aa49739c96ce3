//! The sky: a run of groups of samples that meet no surface in, light added to their pixels out. Of the even and of the odd samples
//! `sum(horizon + (zenith - horizon) max(0, up.d))`, `d` being each ray's unit vector.
//!
//! Sample by sample, for a group may see through the whole lens: close up, where what is far is out of focus, the mean place of its
//! samples gives another light than they do on the mean (at f/1 and 1:1 by 0.0025, which more samples did not change). An
//! empty picture takes 2.7 times as long as with one ray for a group, and a third of what the tower takes for each sample (Zen 3).

use super::Shader;
use super::lanes::total;
use super::rays::Places;
use super::samples::{Samples, Sums};
use crate::raster::LANES;
use crate::raster::group::Group;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16, mask32x16};
use glam::{DVec3, Vec4};

impl Shader<'_> {
    /// `max(0, up.d)` at these places.
    #[inline(always)]
    fn rise<S: Simd>(&self, simd: S, samples: &Samples<'_>, at: &Places<S>) -> f32x16<S> {
        let [rx, ry, rz] = samples.rays.at_all(simd, at);
        let square = rx * rx + ry * ry + rz * rz;
        let rise = rx * self.up.x + ry * self.up.y + rz * self.up.z;
        (rise / square.sqrt()).max(f32x16::splat(simd, 0.0))
    }

    #[inline(always)]
    fn sky_at(&self, rise: f32, count: f32) -> Vec4 {
        (self.horizon * count + (self.zenith - self.horizon) * rise).extend(0.0)
    }
}

impl Shader<'_> {
    /// The variance of the sky's light among rays through a ring of the lens that halves its area, all channels together; at the horizon,
    /// where some of the lens sees the same everywhere, that which it has above.
    pub(crate) fn sky_variance(&self, ring: [DVec3; 4]) -> f64 {
        let up = self.up.as_dvec3();
        let rises = ring.map(|ray| up.dot(ray) / ray.length());
        let mean = rises.iter().sum::<f64>() / 4.0;
        let squares = rises.map(|rise| (rise - mean) * (rise - mean));
        // The rim lies so much farther from the middle.
        let reach = 2.0 * squares.iter().copied().fold(0.0, f64::max);
        let is_dull = mean < 0.0 && mean * mean >= reach;
        let climb = f64::from((self.zenith - self.horizon).length_squared());
        if is_dull { 0.0 } else { climb * squares.iter().sum::<f64>() / 4.0 }
    }
}

#[inline(always)]
pub(super) fn sky<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    samples: &Samples<'_>,
    groups: &[Group],
    sums: &mut Sums,
) {
    if samples.single {
        for chunk in groups.chunks(LANES) {
            let at = samples.places(simd, chunk);
            let rise = shader.rise(simd, samples, &at).to_array();
            let weights = samples.weights(simd, &at).map_or([1.0; LANES], |weights| weights.to_array());
            for ((group, &rise), &weight) in chunk.iter().zip(&rise).zip(&weights) {
                samples.add_one(group, shader.sky_at(rise, 1.0) * weight, sums);
            }
        }
        return;
    }
    let zero = f32x16::splat(simd, 0.0);
    for group in groups {
        let (mut even, mut odd) = (zero, zero);
        for number in group.batches() {
            let (lanes, Some(batch)) = (group.lanes_of(number), samples.batches.get(number)) else {
                continue;
            };
            let at = samples.of_batch(simd, group, batch);
            let mut rise = shader.rise(simd, samples, &at);
            if let Some(weights) = samples.weights(simd, &at) {
                rise *= weights;
            }
            let part = |lanes: u16| mask32x16::from_bitmask(simd, u64::from(lanes));
            even += part(lanes & !batch.odd).select(rise, zero);
            odd += part(lanes & batch.odd).select(rise, zero);
        }
        let totals = samples.totals(simd, group);
        let colors = [(even, totals[0]), (odd, totals[1])]
            .map(|(rise, count)| shader.sky_at(total(simd, rise, 0xffff), count));
        samples.add(group, colors, sums);
    }
}
