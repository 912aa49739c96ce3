//! Shading where the sun casts shadows: groups of samples that see one surface in, light added to their pixels out.
//!
//! As [`super::run`], but the sun's light is weighed sample by sample: each has a ray of its own to the sun, or to a
//! point of its own of the sun's disk, with the normal where it starts, and its texel counts by what arrives along it.
//!
//! The ray starts at `s + t (q_w s - p)`, `1/t = D.N / N.(v0 - s)`, and [`super::sun`] tells whether it arrives. Of `k` samples
//! the light is `k Ke + Kd (ambient sum texel + sun sum(texel max(0, n.l) visible))`; [`super::samples`] adds it. With falloff each
//! sample counts by its weight, in `k` as in the sums.

use super::look::Look;
use super::rays::{Places, Rays};
use super::samples::{Samples, Sums};
use super::shadows::SunRays;
use super::slope::{dot, facing, set_around};
use super::sun::{Asking, ShadowSun, SurfacePlane, directions};
use super::textured::Textured;
use super::{Paint, Shader, fetch};
use crate::raster::LANES;
use crate::raster::batch::Batch;
use crate::raster::group::Group;
use crate::sampling::sun_shift;
use crate::simd::{apart, at_level};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, f32x16};
use glam::{Vec3, Vec4};

/// What one batch of samples in one tile brings beside what plain shading takes.
pub(crate) struct SunSamples<'a> {
    pub batch: &'a Batch,
    pub sun: &'a ShadowSun<'a>,
    /// Points of the unit square, in 2^-32, one for each lane; where the sun has a disk.
    pub square: [[u32; LANES]; 2],
    /// Names the pixel of a lane at a block.
    pub pixel: &'a dyn Fn(u32, usize) -> u64,
}

/// Numbers of 16 lanes each.
type Rows<const N: usize> = [[f32; LANES]; N];

/// A sample of a chunk of groups: group and lane.
type Ray = (u8, u8);

impl Shader<'_> {
    /// As [`Shader::shade`], with shadows; `last` is what [`super::shadows`] remembers.
    pub(crate) fn shade_shadowed(
        &self,
        level: Level,
        look: &Look,
        (samples, sun): (&Samples<'_>, &SunSamples<'_>),
        groups: &[Group],
        last: &mut u32,
        sums: &mut Sums,
    ) {
        let Some(plane) = &look.plane else { return };
        for chunk in groups.chunks(LANES) {
            let mut lights = [[0.0; LANES]; LANES];
            let set = at_level!(level, simd => set(simd, look, samples, sun.sun, chunk));
            let mut packet: [Ray; LANES] = Default::default();
            let mut filled = 0;
            for (i, group) in chunk.iter().enumerate() {
                if set >> i & 1 == 1 {
                    continue;
                }
                let mut rest = group.lanes_of(0);
                while rest != 0 {
                    packet[filled] = (i as u8, rest.trailing_zeros() as u8);
                    rest &= rest - 1;
                    filled += 1;
                    if filled == LANES {
                        trace(level, look, plane, (samples, sun), chunk, &packet, last, &mut lights);
                        filled = 0;
                    }
                }
            }
            if filled > 0 {
                trace(level, look, plane, (samples, sun), chunk, &packet[..filled], last, &mut lights);
            }
            at_level!(level, simd => surface(simd, self, look, (samples, sun.batch), chunk, &lights, sums));
        }
    }
}

/// Of up to 16 groups those that see a side on which the sun has set, for all of their samples.
#[inline(always)]
fn set<S: Simd>(simd: S, look: &Look, samples: &Samples<'_>, sun: &ShadowSun<'_>, groups: &[Group]) -> u16 {
    if sun.is_soft() {
        return 0;
    }
    let zero = f32x16::splat(simd, 0.0);
    let [.., toward] = sun.rows();
    if let Some(normal) = &look.normal {
        let middles = samples.middles(simd, groups);
        return set_around(simd, normal, look.face, toward, samples, &middles);
    }
    let at = samples.places(simd, groups);
    dot(&facing(simd, look, samples.rays, &at), toward).simd_le(zero).to_bitmask() as u16
}

/// Sets the light of up to 16 samples: the cosine of their sun's height over the surface, or 0 in its shadow.
#[expect(clippy::too_many_arguments, reason = "what stands for one packet, apart from what it changes")]
fn trace(
    level: Level,
    look: &Look,
    plane: &SurfacePlane,
    (samples, sun): (&Samples<'_>, &SunSamples<'_>),
    groups: &[Group],
    packet: &[Ray],
    last: &mut u32,
    lights: &mut [[f32; LANES]; LANES],
) {
    let batch = sun.batch;
    let mut places = [[0.0; LANES]; 4];
    let mut square = [[0.0; LANES]; 2];
    let (mut keys, mut index) = ([0; LANES], [0; LANES]);
    let soft = sun.sun.is_soft();
    let mut named = (u32::MAX, u64::MAX);
    for (at, &(i, lane)) in packet.iter().enumerate().take(LANES) {
        let (i, lane) = (usize::from(i) % LANES, usize::from(lane) % LANES);
        let Some(group) = groups.get(i) else { continue };
        let corner = samples.corner(group);
        places[0][at] = batch.u[lane];
        places[1][at] = batch.v[lane];
        places[2][at] = batch.x[lane] + corner.x;
        places[3][at] = batch.y[lane] + corner.y;
        index[at] = batch.index[lane];
        // Mostly a whole group lies in one pixel.
        let name = u32::from(group.block) << 8 | u32::from(batch.pixel[lane]);
        if name != named.0 {
            named = (name, (sun.pixel)(u32::from(group.block), lane));
        }
        keys[at] = named.1;
        if soft {
            let shift = sun_shift(named.1, batch.index[lane]);
            for axis in 0..2 {
                let bits = sun.square[axis][lane] ^ shift[axis];
                square[axis][at] = (bits >> 8) as f32 * (1.0 / 16_777_216.0);
            }
        }
    }
    let mut rays = SunRays::default();
    let used = 0xffff_u16 >> (LANES - packet.len().clamp(1, LANES));
    let (heights, above) = at_level!(level, simd => {
        aim(simd, look, plane, (samples.rays, sun.sun), (&places, &square), &mut rays)
    });
    let mut alive = 0;
    for (lane, &height) in heights.iter().enumerate() {
        alive |= u16::from(height > 0.0) << lane;
    }
    alive &= used;
    if alive == 0 {
        return;
    }
    let asking = Asking { plane, above, keys: &keys, index: &index };
    let lit = alive & !sun.sun.stopped(level, &rays, alive, last, &asking);
    for (at, &(i, lane)) in packet.iter().enumerate().take(LANES) {
        if lit >> at & 1 == 1 {
            lights[usize::from(i) % LANES][usize::from(lane) % LANES] = heights[at];
        }
    }
}

/// Makes the rays from 16 places of a surface to the sun. Returns the cosines of the sun's height over the surface,
/// and which rays leave the plane on its normal's side.
#[inline(always)]
fn aim<S: Simd>(
    simd: S,
    look: &Look,
    plane: &SurfacePlane,
    (tile, sun): (&Rays, &ShadowSun<'_>),
    (places, square): (&Rows<4>, &Rows<2>),
    rays: &mut SunRays,
) -> ([f32; LANES], u16) {
    let zero = f32x16::splat(simd, 0.0);
    let load = |a: &[f32; LANES]| f32x16::load_array_ref(simd, a);
    let all = Places { u: load(&places[0]), v: load(&places[1]), x: load(&places[2]), y: load(&places[3]) };
    let [nx, ny, nz] = facing(simd, look, tile, &all);
    let Places { u, v, x, y } = all;
    // The surface is met at `s + t (q_w s - p)`, `1/t = facing / distance`.
    let k = &plane.facing;
    let facing =
        (u * k[1] + v * k[2] + k[0]) + (u * k[4] + v * k[5] + k[3]) * x + (u * k[7] + v * k[8] + k[6]) * y;
    let d = &plane.distance;
    let t = (u * d[1] + v * d[2] + d[0]) / facing;
    let [px, py, pz] = tile.film(&all);
    let lens = (t * (pz / tile.focal_length + 1.0) + 1.0) * tile.radius;
    let at = [lens * u - t * px, lens * v - t * py, zero - t * pz];
    let rows = sun.rows();
    let from = [dot(&at, rows[0]), dot(&at, rows[1]), dot(&at, rows[2])];
    rays.from = [from[0].to_array(), from[1].to_array(), from[2].to_array()];
    let normal = [nx, ny, nz];
    let n = [dot(&normal, rows[0]), dot(&normal, rows[1]), dot(&normal, rows[2])];
    let face = plane.normal.as_vec3();
    let face = Vec3::from_array(rows.map(|row| row.dot(face)));
    if !sun.is_soft() {
        return (n[2].to_array(), if face.z > 0.0 { 0xffff } else { 0 });
    }
    let [lx, ly, lz] = directions(simd, sun.one_minus_cos(), square);
    // At the rim of half the sky `z` is 0: there the ray is a hair steeper.
    let least = f32x16::splat(simd, 1e-4);
    let z = lz.simd_gt(least).select(lz, least);
    rays.slope = [(lx / z).to_array(), (ly / z).to_array()];
    let height = n[0] * lx + n[1] * ly + n[2] * lz;
    let above = (lx * face.x + ly * face.y + lz * face.z).simd_gt(zero).to_bitmask() as u16;
    (height.to_array(), above)
}

/// Adds the light of up to 16 groups whose samples receive these shares of the sun's.
#[inline(always)]
fn surface<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    look: &Look,
    (samples, batch): (&Samples<'_>, &Batch),
    groups: &[Group],
    lights: &[[f32; LANES]; LANES],
    sums: &mut Sums,
) {
    let material = &shader.materials[look.material as usize];
    let Paint { emission, ambient, sun: color, .. } = shader.paint(material);
    let mut texture = match Textured::new(material, look, samples) {
        Some(texture) => {
            let shared = apart!(simd, texture.shared(simd, groups, &samples.places(simd, groups)));
            let levels = shared.levels.to_array();
            Some((texture, shared, levels))
        }
        None => None,
    };
    for (i, group) in groups.iter().enumerate().take(LANES) {
        let lights = &lights[i];
        let weights = samples.weights(simd, &samples.of_batch(simd, group, batch));
        let weights = weights.map_or([1.0; LANES], |weights| weights.to_array());
        let (mut totals, mut light) = ([0.0; 2], [0.0; 2]);
        let mut rest = group.lanes_of(0);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let half = usize::from(batch.odd >> lane & 1);
            totals[half] += weights[lane];
            light[half] += lights[lane] * weights[lane];
        }
        let mut colors = [0, 1].map(|half: usize| (emission + ambient) * totals[half] + color * light[half]);
        if let Some((texture, shared, levels)) = &mut texture {
            let (all, lit) = if shared.which >> i & 1 == 1 {
                let texel = shared.texels[i];
                (totals.map(|total| texel * total), light.map(|light| texel * light))
            } else {
                let Some((choice, at)) = texture.alone(simd, group, levels[i] as usize) else {
                    continue;
                };
                let (lanes, odd) = (group.lanes_of(0), batch.odd);
                if samples.falloff.is_none() && light == [0.0; 2] {
                    (fetch::sums(simd, choice, at, lanes, odd), [Vec4::ZERO; 2])
                } else {
                    let [all, lit] =
                        fetch::weighed_and_lit(simd, choice, at, (lanes, odd), [&weights, lights]);
                    (all, lit)
                }
            };
            colors =
                [0, 1].map(|half: usize| emission * totals[half] + all[half] * ambient + lit[half] * color);
        }
        if samples.single {
            let [even, odd] = colors;
            // The other half has none.
            samples.add_one(group, even + odd, sums);
        } else {
            samples.add(group, colors, sums);
        }
    }
}
