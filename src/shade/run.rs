//! Shading: a run of groups of samples that see one surface in one tile in, light added to their pixels out.
//!
//! Groups come from `raster::group`, by way of `render::draw`; the light of each goes to [`super::samples`], of its even and of
//! its odd samples: of `k` samples `k Ke + Kd (ambient sum texel + sun sum(texel max(0, n.l)))`, with 1 for a texel where there
//! is no texture; with falloff each sample counts by its weight, in `k` as in the sums. Of those that meet no surface: [`super::sky`].
//!
//! Sixteen groups at a time. Of a flat surface all samples of a group receive one light, that of the side which is seen from its
//! mean place; where normals are interpolated, or both sides of a flat surface may be seen (a table top at the lens's height was wrong by
//! 0.06 RMS at f/1, whatever the number of samples), each sample has its own ([`Slope`]). What samples read from the texture comes
//! from [`super::textured`]. One generic source for every SIMD level, product and sum apart, so the same bits.

use super::fetch_queue::Reads;
use super::lanes::of_groups;
use super::look::Look;
use super::samples::{Samples, Sums};
use super::single;
use super::sky;
use super::slope::Slope;
use super::textured::{LookUps, Textured};
use super::{Paint, Shader};
use crate::raster::LANES;
use crate::raster::group::Group;
use crate::simd::{apart, at_level};
use fearless_simd::{Level, Simd};
use glam::Vec4;

impl Shader<'_> {
    /// Adds the light of `groups`, all of which see the surface of `look`, or the sky where there is none.
    pub(crate) fn shade(
        &self,
        level: Level,
        look: Option<&Look>,
        samples: &Samples<'_>,
        groups: &[Group],
        look_ups: &mut LookUps,
        sums: &mut Sums,
    ) {
        match look {
            Some(look) if samples.single => {
                at_level!(level, simd => single::surface(simd, self, (look, samples), groups, sums))
            }
            Some(look) => {
                at_level!(level, simd => surface(simd, self, (look, samples), groups, look_ups, sums))
            }
            None => at_level!(level, simd => sky::sky(simd, self, samples, groups, sums)),
        }
    }
}

#[inline(always)]
fn surface<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    (look, samples): (&Look, &Samples<'_>),
    groups: &[Group],
    look_ups: &mut LookUps,
    sums: &mut Sums,
) {
    let material = &shader.materials[look.material as usize];
    let Paint { diffuse, emission, ambient, sun } = shader.paint(material);
    let mut texture = Textured::new(material, look, samples);
    let slope = Slope::new(shader, look);
    let slope = slope.as_ref();
    let glows = emission != Vec4::ZERO;
    let mut reads = Reads::NONE;
    for chunk in groups.chunks(LANES) {
        let at = samples.places(simd, chunk);
        let away = match slope {
            Some(_) => 0,
            None => look.away(simd, samples.rays, &at),
        };
        match &mut texture {
            Some(texture) => {
                reads.clear(slope.is_some());
                texture.reads(simd, chunk, &at, slope, look_ups, &mut reads);
            }
            None => {
                for (i, group) in chunk.iter().enumerate().take(LANES) {
                    let [even, odd] = samples.totals(simd, group);
                    (reads.all[2 * i], reads.all[2 * i + 1]) = (Vec4::splat(even), Vec4::splat(odd));
                }
                if let Some(slope) = slope {
                    let every = of_groups(chunk);
                    let packed = &mut look_ups.packed;
                    let totals = apart!(simd, slope.totals(simd, samples, chunk, every, packed));
                    reads.lit = totals.map(Vec4::splat);
                }
            }
        }
        for (i, group) in chunk.iter().enumerate().take(LANES) {
            let totals = if glows { samples.totals(simd, group) } else { [0.0; 2] };
            let [even, odd] = [2 * i, 2 * i + 1].map(|at| (reads.all[at], reads.lit[at]));
            let colors = match slope {
                Some(_) => [
                    emission * totals[0] + (even.0 * ambient + even.1 * sun),
                    emission * totals[1] + (odd.0 * ambient + odd.1 * sun),
                ],
                None => {
                    let light = diffuse * look.lit[usize::from(away >> i & 1)].extend(0.0);
                    [emission * totals[0] + even.0 * light, emission * totals[1] + odd.0 * light]
                }
            };
            samples.add(group, colors, sums);
        }
    }
}
