//! Shading: a run of groups of samples that see one surface in one tile in, light added to their pixels out.
//!
//! Sixteen groups at a time, what hardly changes within a group is computed at its mean place: the normal, the
//! light, the pixel's footprint in the texture. Then, group by group, each sample looks into the texture for
//! itself ([`super::gather`]). One generic source for every SIMD level, product and sum apart, so the same bits.

use super::filter::Choice;
use super::gather::Coordinates;
use super::look::{Bilinear4, Look};
use super::{Place, Shader, filter, gather};
use crate::raster::view::Batch;
use crate::raster::visibility::Group;
use crate::raster::{LANES, TILE};
use crate::scene::{Material, Texture};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, f32x16};
use glam::{Vec2, Vec3, Vec4};

/// The rays of a tile, in single precision about its centre, lens frame.
pub(crate) struct Rays {
    /// The tile's centre on the film, and the steps to the next pixel.
    pub p: Vec3,
    pub dx: Vec3,
    pub dy: Vec3,
    pub focal_length: f32,
    pub radius: f32,
}

impl Rays {
    /// The direction from the lens point: `q_w s - p`.
    #[inline]
    pub(crate) fn at(&self, place: Place) -> Vec3 {
        let p = self.p + self.dx * place.x + self.dy * place.y;
        let weight = (1.0 + p.z / self.focal_length) * self.radius;
        Vec3::new(weight * place.u, weight * place.v, 0.0) - p
    }

    #[inline(always)]
    fn at_all<S: Simd>(&self, simd: S, at: &Places<S>) -> [f32x16<S>; 3] {
        let px = at.x * self.dx.x + at.y * self.dy.x + self.p.x;
        let py = at.x * self.dx.y + at.y * self.dy.y + self.p.y;
        let pz = at.x * self.dx.z + at.y * self.dy.z + self.p.z;
        let weight = (pz / self.focal_length + 1.0) * self.radius;
        [weight * at.u - px, weight * at.v - py, f32x16::splat(simd, 0.0) - pz]
    }
}

/// Sums over lanes for each value of each four bits of a mask: means of any group at the cost of four loads.
pub(crate) struct LaneSums([[Vec4; 16]; 4]);

impl LaneSums {
    pub(crate) fn new(batch: &Batch) -> Self {
        let lane = |i: usize| Vec4::new(batch.u[i], batch.v[i], batch.x[i], batch.y[i]);
        Self(std::array::from_fn(|part| {
            std::array::from_fn(|mask| {
                (0..4)
                    .filter(|bit| mask >> bit & 1 == 1)
                    .fold(Vec4::ZERO, |sum, bit| sum + lane(4 * part + bit))
            })
        }))
    }

    /// The mean place of `lanes`, which are not none, from the block's corner.
    #[inline(always)]
    fn mean(&self, lanes: u16) -> Vec4 {
        let [a, b, c, d] = &self.0;
        let part = |sums: &[Vec4; 16], shift: u32| sums[usize::from(lanes >> shift) & 15];
        (part(a, 0) + part(b, 4) + part(c, 8) + part(d, 12)) * (1.0 / lanes.count_ones() as f32)
    }
}

/// What all groups of one batch in one tile share.
pub(crate) struct Samples<'a> {
    pub batch: &'a Batch,
    pub means: &'a LaneSums,
    pub rays: &'a Rays,
    /// The size of a block in pixels.
    pub block: (u32, u32),
    /// Every group is a single sample, and looks into the texture exactly there.
    pub single: bool,
    /// What part of the light arrives, by place and direction.
    pub falloff: Option<&'a dyn Fn(Place, Vec3) -> f32>,
}

impl Samples<'_> {
    /// The place of a block's left top corner from the tile's centre, and the number of a group's pixel.
    #[inline(always)]
    fn corner(&self, group: &Group) -> (Vec2, usize) {
        // Blocks in a row are a power of two, and a shift is not a division.
        let block = u32::from(group.block);
        let column_bits = (TILE / self.block.0).trailing_zeros();
        let column = block & ((1 << column_bits) - 1);
        let (mut x, mut y) = (column * self.block.0, (block >> column_bits) * self.block.1);
        let corner = Vec2::new(x as f32, y as f32) - 0.5 * TILE as f32;
        if self.single {
            let inside = u32::from(self.batch.pixel[group.lanes.trailing_zeros() as usize % LANES]);
            x += inside % self.block.0;
            y += inside / self.block.0;
        }
        (corner, (y * TILE + x) as usize)
    }

    /// How many samples of a group belong to the even and the odd half.
    #[inline(always)]
    fn counts(&self, group: &Group) -> [f32; 2] {
        let odd = (group.lanes & self.batch.odd).count_ones();
        [(group.lanes.count_ones() - odd) as f32, odd as f32]
    }
}

/// Mean places of 16 groups.
struct Places<S: Simd> {
    u: f32x16<S>,
    v: f32x16<S>,
    x: f32x16<S>,
    y: f32x16<S>,
}

#[inline(always)]
fn places<S: Simd>(simd: S, samples: &Samples<'_>, groups: &[Group]) -> Places<S> {
    let mut rows = [[0.0; LANES]; 4];
    for (i, group) in groups.iter().enumerate().take(LANES) {
        let mean = samples.means.mean(group.lanes);
        let (corner, _) = samples.corner(group);
        rows[0][i] = mean.x;
        rows[1][i] = mean.y;
        rows[2][i] = mean.z + corner.x;
        rows[3][i] = mean.w + corner.y;
    }
    Places {
        u: f32x16::load_array(simd, rows[0]),
        v: f32x16::load_array(simd, rows[1]),
        x: f32x16::load_array(simd, rows[2]),
        y: f32x16::load_array(simd, rows[3]),
    }
}

/// Sums of the even and the odd samples of each pixel of a tile.
pub(crate) type Sums = [[Vec3; 2]];

impl Shader<'_> {
    /// Adds the light of `groups`, all of which see the surface of `look`, or the sky where there is none.
    pub(crate) fn shade(
        &self,
        level: Level,
        look: Option<&Look>,
        samples: &Samples<'_>,
        groups: &[Group],
        sums: &mut Sums,
    ) {
        match look {
            Some(look) => at_level!(level, simd => surface(simd, self, look, samples, groups, sums)),
            None => at_level!(level, simd => sky(simd, self, samples, groups, sums)),
        }
    }
}

#[inline(always)]
fn add(samples: &Samples<'_>, place: impl Fn() -> Place, pixel: usize, colors: [Vec3; 2], sums: &mut Sums) {
    let mut colors = colors;
    if let Some(falloff) = samples.falloff {
        let place = place();
        let weight = falloff(place, samples.rays.at(place));
        colors = [colors[0] * weight, colors[1] * weight];
    }
    if let Some([even, odd]) = sums.get_mut(pixel) {
        *even += colors[0];
        *odd += colors[1];
    }
}

#[inline(always)]
fn surface<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    look: &Look,
    samples: &Samples<'_>,
    groups: &[Group],
    sums: &mut Sums,
) {
    let material: &Material = &shader.surfaces.materials[look.material as usize];
    let diffuse = Vec3::from(material.diffuse);
    let emission = Vec3::from(material.emission);
    let texture = match (&material.diffuse_map, &look.texture) {
        (Some(map), Some(functions)) => {
            Some((&**map, functions, Coordinates::new(simd, functions, samples.batch)))
        }
        _ => None,
    };
    // Most groups of a run read the same level.
    let mut choice: Option<(usize, Choice<'_>)> = None;
    for chunk in groups.chunks(LANES) {
        let at = places(simd, samples, chunk);
        let light = light(simd, shader, look, samples.rays, &at);
        let footprint = match &texture {
            Some((map, functions, _)) => footprint(simd, map, functions, &at),
            None => Footprints::default(),
        };
        for (i, group) in chunk.iter().enumerate().take(LANES) {
            let (corner, pixel) = samples.corner(group);
            let counts = samples.counts(group);
            let reflected = diffuse * Vec3::new(light[0][i], light[1][i], light[2][i]);
            let mut colors = [(emission + reflected) * counts[0], (emission + reflected) * counts[1]];
            if let Some((map, _, coordinates)) = &texture {
                let level = filter::colour_level(footprint.square[i]);
                if choice.is_none_or(|(last, _)| last != level) {
                    choice = Choice::colour(map, level, look.anchor).map(|choice| (level, choice));
                }
                let Some((_, choice)) = choice else { continue };
                let read = if samples.single {
                    let texel = choice.read(Vec2::new(footprint.s[i], footprint.t[i]));
                    [texel * counts[0], texel * counts[1]]
                } else {
                    gather::sums(simd, choice, coordinates, corner, group.lanes, samples.batch.odd)
                };
                colors = [
                    emission * counts[0] + read[0].truncate() * reflected,
                    emission * counts[1] + read[1].truncate() * reflected,
                ];
            }
            let place = || {
                let mean = samples.means.mean(group.lanes);
                Place { u: mean.x, v: mean.y, x: mean.z + corner.x, y: mean.w + corner.y }
            };
            add(samples, place, pixel, colors, sums);
        }
    }
}

/// The light that falls on the surface at 16 places, on the side that is seen: red, green and blue.
#[inline(always)]
fn light<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    look: &Look,
    rays: &Rays,
    at: &Places<S>,
) -> [[f32; LANES]; 3] {
    let zero = f32x16::splat(simd, 0.0);
    let [rx, ry, rz] = rays.at_all(simd, at);
    let face = look.face;
    let Some(k) = &look.normal else {
        let away = (rx * face.x + ry * face.y + rz * face.z).simd_gt(zero);
        let [front, back] = look.lit;
        let channel = |front: f32, back: f32| {
            away.select(f32x16::splat(simd, back), f32x16::splat(simd, front)).to_array()
        };
        return [channel(front.x, back.x), channel(front.y, back.y), channel(front.z, back.z)];
    };
    let nx = evaluate(k, 0, at);
    let ny = evaluate(k, 1, at);
    let nz = evaluate(k, 2, at);
    let square = nx * nx + ny * ny + nz * nz;
    // The sum of the edge functions has the sign of the side that is seen, and so has the length.
    let usable = square.simd_gt(zero) & square.simd_lt(f32x16::splat(simd, f32::INFINITY));
    let length = usable.select(square, f32x16::splat(simd, 1.0)).sqrt();
    let nx = usable.select(nx / length, f32x16::splat(simd, face.x));
    let ny = usable.select(ny / length, f32x16::splat(simd, face.y));
    let nz = usable.select(nz / length, f32x16::splat(simd, face.z));
    let (toward, color) = shader.sun.unwrap_or((Vec3::ZERO, Vec3::ZERO));
    // Two-sided: the side that faces this lens point is lit.
    let away = (rx * nx + ry * ny + rz * nz).simd_gt(zero);
    let rise = nx * toward.x + ny * toward.y + nz * toward.z;
    let rise = away.select(zero - rise, rise);
    let rise = rise.simd_gt(zero).select(rise, zero);
    let ambient = shader.ambient;
    [
        (rise * color.x + ambient.x).to_array(),
        (rise * color.y + ambient.y).to_array(),
        (rise * color.z + ambient.z).to_array(),
    ]
}

/// Component `i` of bilinear functions at 16 places.
#[inline(always)]
fn evaluate<S: Simd>(k: &Bilinear4, i: usize, at: &Places<S>) -> f32x16<S> {
    let [c, cx, cy] = parts(k, i, at);
    c + cx * at.x + cy * at.y
}

#[inline(always)]
fn parts<S: Simd>(k: &Bilinear4, i: usize, at: &Places<S>) -> [f32x16<S>; 3] {
    [
        at.u * k[1][i] + at.v * k[2][i] + k[0][i],
        at.u * k[4][i] + at.v * k[5][i] + k[3][i],
        at.u * k[7][i] + at.v * k[8][i] + k[6][i],
    ]
}

/// Where 16 places look into a texture, from its anchor, and the square of the shorter side of what a pixel spans
/// there for a fixed lens point, in texels of the finest level.
#[derive(Default)]
struct Footprints {
    s: [f32; LANES],
    t: [f32; LANES],
    square: [f32; LANES],
}

#[inline(always)]
fn footprint<S: Simd>(simd: S, map: &Texture, k: &Bilinear4, at: &Places<S>) -> Footprints {
    let zero = f32x16::splat(simd, 0.0);
    let size = filter::size(map);
    let [s, sx, sy] = parts(k, 0, at);
    let [t, tx, ty] = parts(k, 1, at);
    let [w, wx, wy] = parts(k, 2, at);
    let w = w + wx * at.x + wy * at.y;
    let inverse = w.simd_ne(zero).select(f32x16::splat(simd, 1.0) / w, zero);
    let s = (s + sx * at.x + sy * at.y) * inverse;
    let t = (t + tx * at.x + ty * at.y) * inverse;
    let (across, along) = (inverse * size.x, inverse * size.y);
    let (s_dx, t_dx) = ((sx - s * wx) * across, (tx - t * wx) * along);
    let (s_dy, t_dy) = ((sy - s * wy) * across, (ty - t * wy) * along);
    let (right, down) = (s_dx * s_dx + t_dx * t_dx, s_dy * s_dy + t_dy * t_dy);
    let square = right.simd_lt(down).select(right, down);
    Footprints { s: s.to_array(), t: t.to_array(), square: square.to_array() }
}

#[inline(always)]
fn sky<S: Simd>(simd: S, shader: &Shader<'_>, samples: &Samples<'_>, groups: &[Group], sums: &mut Sums) {
    let zero = f32x16::splat(simd, 0.0);
    let (up, horizon) = (shader.up, shader.horizon);
    let climb = shader.zenith - horizon;
    for chunk in groups.chunks(LANES) {
        let at = places(simd, samples, chunk);
        let [rx, ry, rz] = samples.rays.at_all(simd, &at);
        let length = (rx * rx + ry * ry + rz * rz).sqrt();
        let rise = (rx * up.x + ry * up.y + rz * up.z) / length;
        let rise = rise.simd_gt(zero).select(rise, zero).to_array();
        for (i, group) in chunk.iter().enumerate().take(LANES) {
            let (corner, pixel) = samples.corner(group);
            let counts = samples.counts(group);
            let color = horizon + climb * rise[i];
            let place = || {
                let mean = samples.means.mean(group.lanes);
                Place { u: mean.x, v: mean.y, x: mean.z + corner.x, y: mean.w + corner.y }
            };
            add(samples, place, pixel, [color * counts[0], color * counts[1]], sums);
        }
    }
}
