//! Normals of surfaces that interpolate them, and how high the sun stands over these: places of samples in, for [`super::run`],
//! [`super::single`], [`super::textured`] and [`super::shadowed`]; cosines out, of each sample or summed over those of groups.
//!
//! `max(0, n.l) / |n|`, with `n` interpolated as `sum n_i e_i` ([`super::look`]), `l` towards the sun, and `n` turned to the side that the
//! ray sees.

use super::Shader;
use super::coordinates::{along, at_lens};
use super::lanes::lanes_of;
use super::look::{Bilinear4, Look};
use super::packed::Packed;
use super::rays::{Places, Rays};
use super::samples::Samples;
use crate::raster::LANES;
use crate::raster::group::Group;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16};
use glam::{Vec3, Vec4};

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
        rise(simd, self.normal, self.face, self.toward, rays, at)
    }

    /// The sums of these shares, weighed, over the even and the odd samples of the groups that are in the mask `which`: numbers `2 i` and
    /// `2 i + 1` for group `i`.
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
            let mut lights = self.light(simd, samples.rays, &places);
            if let Some(weights) = samples.weights(simd, &places) {
                lights *= weights;
            }
            for (&owner, light) in owners.iter().zip(lights.to_array()).take(filled) {
                totals[usize::from(owner) % (2 * LANES)] += light;
            }
        }
        totals
    }
}

/// The height of the sun, as a cosine, over the side that is seen, at 16 places, 0 where it has set.
#[inline(always)]
fn rise<S: Simd>(simd: S, k: &Bilinear4, face: Vec3, toward: Vec3, rays: &Rays, at: &Places<S>) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let [rx, ry, rz] = rays.at_all(simd, at);
    let ([nx, ny, nz], square) = interpolated(simd, k, face, at);
    // Two-sided: the side that faces this lens point is lit.
    let view = rx * nx + ry * ny + rz * nz;
    let rise = dot(&[nx, ny, nz], toward) / square.sqrt();
    let rise = view.simd_gt(zero).select(zero - rise, rise);
    rise.simd_gt(zero).select(rise, zero)
}

/// More than rounding, as a cosine.
const HAIR: f32 = 1e-4;

/// At which of these middles of 16 groups the sun has set over the side that is seen, and so it has for all of the group's samples:
/// between the middle and the ends of what they may lie in, bilinear functions reach `sum |f_i| half_i + sum |f_ij| half_i half_j`. Of
/// those are the sun's height times the normal's length, and the normal; the line of sight moves by as much as the lens and the pixels are wide.
/// (With fixed angles for how far normals turn, samples at f/0.9 went without sun that they had, by 3e-5 of white.)
#[inline(always)]
pub(super) fn set_around<S: Simd>(
    simd: S,
    k: &Bilinear4,
    face: Vec3,
    toward: Vec3,
    samples: &Samples<'_>,
    at: &Places<S>,
) -> u16 {
    let zero = f32x16::splat(simd, 0.0);
    let rays = samples.rays;
    let [rx, ry, rz] = rays.at_all(simd, at);
    let ([nx, ny, nz], square) = interpolated(simd, k, face, at);
    let view = rx * nx + ry * ny + rz * nz;
    let height = dot(&[nx, ny, nz], toward);
    let below = view.simd_gt(zero).select(height, zero - height);
    let length = square.sqrt();
    if below.simd_gt(length * HAIR).to_bitmask() == 0 {
        return 0;
    }
    let half = 0.5 * samples.means.ranges;
    let pairs = Vec4::new(half.x * half.z, half.y * half.z, half.x * half.w, half.y * half.w);
    let up = toward.extend(0.0);
    let both = Vec4::new(k[4].dot(up), k[5].dot(up), k[7].dot(up), k[8].dot(up)).abs().dot(pairs);
    let [by_u, by_v, by_x, by_y] = changes(k, at);
    let lift = dot(&by_u, toward).abs() * half.x
        + dot(&by_v, toward).abs() * half.y
        + dot(&by_x, toward).abs() * half.z
        + dot(&by_y, toward).abs() * half.w
        + both;
    let both = Vec4::new(k[4].length(), k[5].length(), k[7].length(), k[8].length()).dot(pairs);
    let turn =
        size(&by_u) * half.x + size(&by_v) * half.y + size(&by_x) * half.z + size(&by_y) * half.w + both;
    let lens = ((rz / -rays.focal_length + 1.0) * rays.radius).abs() * (half.x + half.y);
    let wider = 1.0 + rays.radius / rays.focal_length;
    let sway = lens + (rays.dx.length() * half.z + rays.dy.length() * half.w) * wider;
    let sight = size(&[rx, ry, rz]);
    let is_low = below.simd_gt(lift + length * HAIR);
    let is_facing = view.abs().simd_gt(turn * sight + sway * (length + turn) + length * sight * HAIR);
    (is_low & is_facing).to_bitmask() as u16
}

/// How a function of three components changes with `u`, `v`, `x` and `y` at 16 places.
#[inline(always)]
fn changes<S: Simd>(k: &Bilinear4, at: &Places<S>) -> [[f32x16<S>; 3]; 4] {
    let ([_, xx, xy], [_, yx, yy], [_, zx, zy]) =
        (at_lens(k, 0, at.u, at.v), at_lens(k, 1, at.u, at.v), at_lens(k, 2, at.u, at.v));
    [
        [along(k, 0, 1, at), along(k, 1, 1, at), along(k, 2, 1, at)],
        [along(k, 0, 2, at), along(k, 1, 2, at), along(k, 2, 2, at)],
        [xx, yx, zx],
        [xy, yy, zy],
    ]
}

#[inline(always)]
pub(super) fn dot<S: Simd>([x, y, z]: &[f32x16<S>; 3], row: Vec3) -> f32x16<S> {
    *x * row.x + *y * row.y + *z * row.z
}

#[inline(always)]
fn size<S: Simd>([x, y, z]: &[f32x16<S>; 3]) -> f32x16<S> {
    (*x * *x + *y * *y + *z * *z).sqrt()
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
