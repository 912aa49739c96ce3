//! Shading: a run of groups of samples that see one surface in one tile in, light added to their pixels out.
//!
//! Sixteen groups at a time, what hardly changes within a group is computed at its mean place: the normal, the
//! light. What its samples read from the texture comes from [`super::texels`]. One generic source for every SIMD level, product and sum apart, so the same bits.

use super::coordinates::{at_lens, turns};
use super::look::{Bilinear4, Look};
use super::samples::{Places, Rays, Samples, Sums};
use super::texels::{LookUps, Textured};
use super::{Shader, gather};
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
            Some(look) => {
                at_level!(level, simd => surface(simd, self, (look, samples), groups, look_ups, sums))
            }
            None => at_level!(level, simd => sky(simd, self, samples, groups, sums)),
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
    let material = &shader.surfaces.materials[look.material as usize];
    let diffuse = Vec3::from(material.diffuse).extend(0.0);
    let emission = Vec3::from(material.emission).extend(0.0);
    let mut texture = Textured::new(material, look, samples);
    for chunk in groups.chunks(LANES) {
        let at = samples.places(simd, chunk);
        let (light, unsure) = light(simd, shader, look, samples, chunk, &at);
        let reads = texture.as_mut().map(|texture| texture.sums(simd, chunk, &at, look_ups));
        for (i, group) in chunk.iter().enumerate().take(LANES) {
            let counts = samples.counts(group);
            let lights = match &look.normal {
                Some(normal) if unsure >> i & 1 == 1 && group.lanes.count_ones() > FEW => {
                    light_of_each(simd, shader, look, normal, samples, group)
                }
                _ => [Vec4::new(light[0][i], light[1][i], light[2][i], 0.0); 2],
            };
            let [even, odd] = match &reads {
                Some(reads) => [reads[2 * i], reads[2 * i + 1]],
                None => counts.map(Vec4::splat),
            };
            let colors = [
                emission * counts[0] + even * (diffuse * lights[0]),
                emission * counts[1] + odd * (diffuse * lights[1]),
            ];
            samples.add(simd, group, colors, sums);
        }
    }
}

/// The light that falls on the surface at 16 places, on the side that is seen: red, green and blue. And where
/// it may be another nearby: see [`UNSURE`].
#[inline(always)]
fn light<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    look: &Look,
    samples: &Samples<'_>,
    groups: &[Group],
    at: &Places<S>,
) -> ([[f32; LANES]; 3], u16) {
    let zero = f32x16::splat(simd, 0.0);
    let rays = samples.rays;
    let Some(k) = &look.normal else {
        let [rx, ry, rz] = rays.at_all(simd, at);
        let face = look.face;
        let away = (rx * face.x + ry * face.y + rz * face.z).simd_gt(zero);
        let [front, back] = look.lit;
        let channel = |front: f32, back: f32| {
            away.select(f32x16::splat(simd, back), f32x16::splat(simd, front)).to_array()
        };
        return ([channel(front.x, back.x), channel(front.y, back.y), channel(front.z, back.z)], 0);
    };
    let (toward, color) = shader.sun.unwrap_or((Vec3::ZERO, Vec3::ZERO));
    let (rise, unsure) = rise(simd, k, look.face, toward, rays, at);
    let ambient = shader.ambient;
    let channels = [
        (rise * color.x + ambient.x).to_array(),
        (rise * color.y + ambient.y).to_array(),
        (rise * color.z + ambient.z).to_array(),
    ];
    if shader.sun.is_none() {
        return (channels, 0);
    }
    let mut unsure = unsure;
    let whole = (LANES * samples.batches.len()) as f32;
    for (i, turn) in turns(simd, k, samples.means.ranges, at).into_iter().enumerate().take(groups.len()) {
        // Of a surface of which so many samples see something they see that part.
        let part = groups[i].lanes.count_ones() as f32 / whole;
        unsure |= u16::from(turn * part > BENT * BENT) << i;
    }
    (channels, unsure)
}

/// Cosines against the line of sight and the sun that may be 0 at other samples of a group, where the other side
/// is seen, or the sun sets. One light for the group would be wrong there, whatever the number of samples: on small curved
/// models by 0.23 of the noise of 256 samples, and by 0.10 with light of their own.
const UNSURE: (f32, f32) = (0.2, 0.08);

/// The angle, in radians, over which a normal may turn within a group that shares it. The mean of a cosine over so much of a
/// circle is 1 - 0.3^2 / 24 of that in the middle.
const BENT: f32 = 0.3;

/// Groups of no more samples share their light all the same: they lie close together.
const FEW: u32 = 2;

/// The height of the sun, as a cosine, over the side that is seen, at 16 places, 0 where it has set; and where it is unsure.
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
    let [nx, ny, nz] = smooth(simd, k, face, at);
    // Two-sided: the side that faces this lens point is lit.
    let view = rx * nx + ry * ny + rz * nz;
    let rise = nx * toward.x + ny * toward.y + nz * toward.z;
    let grazing = (view * view).simd_lt((rx * rx + ry * ry + rz * rz) * (UNSURE.0 * UNSURE.0));
    let setting = rise.abs().simd_lt(f32x16::splat(simd, UNSURE.1));
    let unsure = (grazing | setting).to_bitmask() as u16;
    let rise = view.simd_gt(zero).select(zero - rise, rise);
    (rise.simd_gt(zero).select(rise, zero), unsure)
}

/// The mean light on the even and the odd samples of a group, each with a normal of its own.
#[inline(always)]
fn light_of_each<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    look: &Look,
    normal: &Bilinear4,
    samples: &Samples<'_>,
    group: &Group,
) -> [Vec4; 2] {
    let (toward, color) = shader.sun.unwrap_or((Vec3::ZERO, Vec3::ZERO));
    let mut sums = [0.0; 2];
    for number in group.batches() {
        let (lanes, Some(batch)) = (group.lanes_of(number), samples.batches.get(number)) else { continue };
        let at = samples.of_batch(simd, group, batch);
        let (rise, _) = rise(simd, normal, look.face, toward, samples.rays, &at);
        sums[0] += gather::total(simd, rise, lanes & !batch.odd);
        sums[1] += gather::total(simd, rise, lanes & batch.odd);
    }
    let counts = samples.counts(group);
    let mut lights = [Vec4::ZERO; 2];
    for half in 0..2 {
        if counts[half] > 0.0 {
            lights[half] = (shader.ambient + color * (sums[half] / counts[half])).extend(0.0);
        }
    }
    lights
}

/// The unit normals of a surface that interpolates them, on either side.
#[inline(always)]
fn smooth<S: Simd>(simd: S, k: &Bilinear4, face: Vec3, at: &Places<S>) -> [f32x16<S>; 3] {
    let zero = f32x16::splat(simd, 0.0);
    let nx = evaluate(k, 0, at);
    let ny = evaluate(k, 1, at);
    let nz = evaluate(k, 2, at);
    let square = nx * nx + ny * ny + nz * nz;
    // The sum of the edge functions has the sign of the side that is seen, and so has the length.
    let usable = square.simd_gt(zero) & square.simd_lt(f32x16::splat(simd, f32::INFINITY));
    let length = usable.select(square, f32x16::splat(simd, 1.0)).sqrt();
    [
        usable.select(nx / length, f32x16::splat(simd, face.x)),
        usable.select(ny / length, f32x16::splat(simd, face.y)),
        usable.select(nz / length, f32x16::splat(simd, face.z)),
    ]
}

/// The unit normals at 16 places of the side that is seen.
#[inline(always)]
pub(super) fn facing<S: Simd>(simd: S, look: &Look, rays: &Rays, at: &Places<S>) -> [f32x16<S>; 3] {
    let zero = f32x16::splat(simd, 0.0);
    let [rx, ry, rz] = rays.at_all(simd, at);
    let [nx, ny, nz] = match &look.normal {
        Some(k) => smooth(simd, k, look.face, at),
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

#[inline(always)]
fn sky<S: Simd>(simd: S, shader: &Shader<'_>, samples: &Samples<'_>, groups: &[Group], sums: &mut Sums) {
    let zero = f32x16::splat(simd, 0.0);
    let (up, horizon) = (shader.up, shader.horizon.extend(0.0));
    let climb = shader.zenith.extend(0.0) - horizon;
    for chunk in groups.chunks(LANES) {
        let at = samples.places(simd, chunk);
        let [rx, ry, rz] = samples.rays.at_all(simd, &at);
        let length = (rx * rx + ry * ry + rz * rz).sqrt();
        let rise = (rx * up.x + ry * up.y + rz * up.z) / length;
        let rise = rise.simd_gt(zero).select(rise, zero).to_array();
        for (i, group) in chunk.iter().enumerate().take(LANES) {
            let counts = samples.counts(group);
            let color = horizon + climb * rise[i];
            samples.add(simd, group, [color * counts[0], color * counts[1]], sums);
        }
    }
}
