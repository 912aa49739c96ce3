//! Shading: a run of groups of samples that see one surface in one tile in, light added to their pixels out.
//!
//! Groups come from `raster::group`, by way of `render::draw`; the light of each goes to [`super::samples`], of its even and of
//! its odd samples: of `k` samples `k Ke + Kd (ambient sum texel + sun sum(texel max(0, n.l)))`, with 1 for a texel where there
//! is no texture. Of those that meet no surface: [`super::sky`].
//!
//! Sixteen groups at a time. Of a flat surface all samples of a group receive one light, that of the side which is seen from its
//! mean place; where normals are interpolated each sample has its own ([`Slope`]). What samples read from the texture comes
//! from [`super::texels`]. One generic source for every SIMD level, product and sum apart, so the same bits.

use super::Shader;
use super::coordinates::at_lens;
use super::look::{Bilinear4, Look};
use super::packed::Packed;
use super::reads::Reads;
use super::samples::{Places, Rays, Samples, Sums};
use super::single;
use super::sky;
use super::texels::{LookUps, Textured, lanes_of, of_groups};
use crate::raster::LANES;
use crate::raster::group::Group;
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16};
use glam::{Vec3, Vec4};

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
    let diffuse = Vec3::from(material.diffuse).extend(0.0);
    let emission = Vec3::from(material.emission).extend(0.0);
    let mut texture = Textured::new(material, look, samples);
    let slope = Slope::new(shader, look);
    let slope = slope.as_ref();
    let ambient = diffuse * shader.ambient.extend(0.0);
    let sun = diffuse * shader.sun.map_or(Vec4::ZERO, |(_, color)| color.extend(0.0));
    let mut reads = Reads::NONE;
    for chunk in groups.chunks(LANES) {
        let at = samples.places(simd, chunk);
        let away = match slope {
            Some(_) => 0,
            None => away(simd, look, samples.rays, &at),
        };
        match &mut texture {
            Some(texture) => {
                reads.clear(slope.is_some());
                texture.reads(simd, chunk, &at, slope, look_ups, &mut reads);
            }
            None => {
                for (i, group) in chunk.iter().enumerate().take(LANES) {
                    let [even, odd] = samples.counts(group);
                    (reads.all[2 * i], reads.all[2 * i + 1]) = (Vec4::splat(even), Vec4::splat(odd));
                }
                if let Some(slope) = slope {
                    let every = of_groups(chunk);
                    reads.lit =
                        slope.totals(simd, samples, chunk, every, &mut look_ups.packed).map(Vec4::splat);
                }
            }
        }
        for (i, group) in chunk.iter().enumerate().take(LANES) {
            let counts = samples.counts(group);
            let [even, odd] = [2 * i, 2 * i + 1].map(|at| (reads.all[at], reads.lit[at]));
            let colors = match slope {
                Some(_) => [
                    emission * counts[0] + (even.0 * ambient + even.1 * sun),
                    emission * counts[1] + (odd.0 * ambient + odd.1 * sun),
                ],
                None => {
                    let light = diffuse * look.lit[usize::from(away >> i & 1)].extend(0.0);
                    [emission * counts[0] + even.0 * light, emission * counts[1] + odd.0 * light]
                }
            };
            samples.add(simd, group, colors, sums);
        }
    }
}

/// Which of 16 places see the back of a flat surface.
#[inline(always)]
pub(super) fn away<S: Simd>(simd: S, look: &Look, rays: &Rays, at: &Places<S>) -> u16 {
    let [rx, ry, rz] = rays.at_all(simd, at);
    let face = look.face;
    (rx * face.x + ry * face.y + rz * face.z).simd_gt(f32x16::splat(simd, 0.0)).to_bitmask() as u16
}

/// A surface with a normal of its own at each place, and the sun above it. Each sample has its own light: with one for all of a
/// group the mean of many pictures of small curved models was wrong by 0.24 of the error of 256 samples, since light and texture
/// change together, and a cosine's mean is not that of the mean place.
pub(super) struct Slope<'a> {
    normal: &'a Bilinear4,
    face: Vec3,
    toward: Vec3,
}

impl<'a> Slope<'a> {
    /// None where the surface is flat, or there is no sun: all that comes is the same everywhere then.
    pub(super) fn new(shader: &Shader<'_>, look: &'a Look) -> Option<Self> {
        let (toward, _) = shader.sun?;
        look.normal.as_ref().map(|normal| Self { normal, face: look.face, toward })
    }

    /// The share of the sun's light that the side that is seen receives at 16 places.
    #[inline(always)]
    pub(super) fn light<S: Simd>(&self, simd: S, rays: &Rays, at: &Places<S>) -> f32x16<S> {
        rise(simd, self.normal, self.face, self.toward, rays, at).0
    }

    /// The sums of these shares over the even and the odd samples of the groups that are in the mask `which`: numbers `2 i` and `2 i + 1`
    /// for group `i`.
    #[inline(always)]
    pub(super) fn totals<S: Simd>(
        &self,
        simd: S,
        samples: &Samples<'_>,
        groups: &[Group],
        which: u16,
        packed: &mut Packed,
    ) -> [f32; 2 * LANES] {
        packed.fill(samples, groups, &lanes_of(groups, which));
        let mut totals = [0.0; 2 * LANES];
        for number in 0..packed.batches() {
            let (places, owners, filled) = packed.batch(simd, number);
            let lights = self.light(simd, samples.rays, &places).to_array();
            for (&owner, light) in owners.iter().zip(lights).take(filled) {
                totals[usize::from(owner) % (2 * LANES)] += light;
            }
        }
        totals
    }
}

/// Cosines against the line of sight and the sun that may be 0 at other samples of a group, where the other side is seen, or the
/// sun sets.
const UNSURE: (f32, f32) = (0.2, 0.08);

/// The height of the sun, as a cosine, over the side that is seen, at 16 places, 0 where it has set; and where it may have at others
/// nearby.
#[inline(always)]
pub(super) fn rise<S: Simd>(
    simd: S,
    k: &Bilinear4,
    face: Vec3,
    toward: Vec3,
    rays: &Rays,
    at: &Places<S>,
) -> (f32x16<S>, u16) {
    let zero = f32x16::splat(simd, 0.0);
    let [rx, ry, rz] = rays.at_all(simd, at);
    let ([nx, ny, nz], square) = interpolated(simd, k, face, at);
    // Two-sided: the side that faces this lens point is lit.
    let view = rx * nx + ry * ny + rz * nz;
    let rise = (nx * toward.x + ny * toward.y + nz * toward.z) / square.sqrt();
    let grazing = (view * view).simd_lt((rx * rx + ry * ry + rz * rz) * square * (UNSURE.0 * UNSURE.0));
    let setting = rise.abs().simd_lt(f32x16::splat(simd, UNSURE.1));
    let unsure = (grazing | setting).to_bitmask() as u16;
    let rise = view.simd_gt(zero).select(zero - rise, rise);
    (rise.simd_gt(zero).select(rise, zero), unsure)
}

/// The normals of a surface that interpolates them, on either side, and the squares of their lengths.
#[inline(always)]
fn interpolated<S: Simd>(simd: S, k: &Bilinear4, face: Vec3, at: &Places<S>) -> ([f32x16<S>; 3], f32x16<S>) {
    let zero = f32x16::splat(simd, 0.0);
    let (nx, ny, nz) = (evaluate(k, 0, at), evaluate(k, 1, at), evaluate(k, 2, at));
    let square = nx * nx + ny * ny + nz * nz;
    // The sum of the edge functions has the sign of the side that is seen, and so has the length.
    let usable = square.simd_gt(zero) & square.simd_lt(f32x16::splat(simd, f32::INFINITY));
    let normal = [
        usable.select(nx, f32x16::splat(simd, face.x)),
        usable.select(ny, f32x16::splat(simd, face.y)),
        usable.select(nz, f32x16::splat(simd, face.z)),
    ];
    (normal, usable.select(square, f32x16::splat(simd, 1.0)))
}

/// The unit normals at 16 places of the side that is seen.
#[inline(always)]
pub(super) fn facing<S: Simd>(simd: S, look: &Look, rays: &Rays, at: &Places<S>) -> [f32x16<S>; 3] {
    let zero = f32x16::splat(simd, 0.0);
    let [rx, ry, rz] = rays.at_all(simd, at);
    let [nx, ny, nz] = match &look.normal {
        Some(k) => {
            let ([nx, ny, nz], square) = interpolated(simd, k, look.face, at);
            let length = square.sqrt();
            [nx / length, ny / length, nz / length]
        }
        None => [
            f32x16::splat(simd, look.face.x),
            f32x16::splat(simd, look.face.y),
            f32x16::splat(simd, look.face.z),
        ],
    };
    let away = (rx * nx + ry * ny + rz * nz).simd_gt(zero);
    [away.select(zero - nx, nx), away.select(zero - ny, ny), away.select(zero - nz, nz)]
}

/// Component `i` of bilinear functions at 16 places.
#[inline(always)]
fn evaluate<S: Simd>(k: &Bilinear4, i: usize, at: &Places<S>) -> f32x16<S> {
    let [c, cx, cy] = at_lens(k, i, at.u, at.v);
    c + cx * at.x + cy * at.y
}
