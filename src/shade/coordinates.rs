//! Texture coordinates of 16 samples as functions of place: where they look, and what a pixel spans there.
//!
//! In: the functions `S`, `T` and `W` of a surface ([`super::look`]), lens points and places. Out: `s = S / W` and `t = T / W`,
//! repeats of the texture from its anchor, for [`super::fetch`]; the width of the pixel's footprint across its longer side, squared, for
//! [`super::mip_level`]: `(s_x t_y - s_y t_x)^2` over the larger of `s_x^2 + t_x^2` and `s_y^2 + t_y^2` in texels, where
//! `s_x = (S_x - s W_x) / W`; and how far a group's samples look, for [`super::textured`]: the sum of `|s_i| range_i` over `u`, `v`, `x` and `y`.

use super::look::Bilinear4;
use super::mip_level::FARTHEST;
use super::rays::Places;
use crate::raster::batch::Batch;
use fearless_simd::{Select, Simd, SimdBase, f32x16};
use glam::{Vec2, Vec4};

/// A bilinear function's component `i` for 16 lens points: its value at the tile's centre, and its change with a
/// pixel to the right and down.
#[inline(always)]
pub(super) fn at_lens<S: Simd>(k: &Bilinear4, i: usize, u: f32x16<S>, v: f32x16<S>) -> [f32x16<S>; 3] {
    [
        u * k[1][i] + v * k[2][i] + k[0][i],
        u * k[4][i] + v * k[5][i] + k[3][i],
        u * k[7][i] + v * k[8][i] + k[6][i],
    ]
}

/// Homogeneous `s`, `t` and their weight for 16 lens points, as [`at_lens`] gives them.
#[derive(Clone, Copy)]
pub(super) struct Coordinates<S: Simd>([[f32x16<S>; 3]; 3]);

/// Where 16 samples look, from the texture's anchor, and one over their weights.
#[derive(Clone, Copy)]
pub(super) struct Spots<S: Simd> {
    pub s: f32x16<S>,
    pub t: f32x16<S>,
    inverse: f32x16<S>,
}

impl<S: Simd> Coordinates<S> {
    #[inline(always)]
    pub(super) fn new(k: &Bilinear4, u: f32x16<S>, v: f32x16<S>) -> Self {
        Self([at_lens(k, 0, u, v), at_lens(k, 1, u, v), at_lens(k, 2, u, v)])
    }

    /// For a batch's samples, as functions of their block's place.
    #[inline(always)]
    pub(super) fn of_batch(simd: S, k: &Bilinear4, batch: &Batch) -> Self {
        let u = f32x16::load_array_ref(simd, &batch.u);
        let v = f32x16::load_array_ref(simd, &batch.v);
        let x = f32x16::load_array_ref(simd, &batch.x);
        let y = f32x16::load_array_ref(simd, &batch.y);
        let Self([s, t, w]) = Self::new(k, u, v);
        Self([moved(s, x, y), moved(t, x, y), moved(w, x, y)])
    }

    #[inline(always)]
    pub(super) fn at(&self, simd: S, x: f32x16<S>, y: f32x16<S>) -> Spots<S> {
        let Self([s, t, w]) = *self;
        let zero = f32x16::splat(simd, 0.0);
        let [weight, ..] = moved(w, x, y);
        let inverse = weight.simd_ne(zero).select(f32x16::splat(simd, 1.0) / weight, zero);
        Spots { s: moved(s, x, y)[0] * inverse, t: moved(t, x, y)[0] * inverse, inverse }
    }

    /// The square of the width of each pixel's footprint across its longer side, for a fixed lens point; `size` texels make up the
    /// texture. Where the footprint is a rectangle that is its shorter side; of one that is sheared, both sides may be many times as long as
    /// it is wide: by the shorter side stripes on a floor vanished in a camera rolled by 45 degrees, however many samples there were.
    #[inline(always)]
    pub(super) fn width_squared(&self, spots: &Spots<S>, size: Vec2) -> f32x16<S> {
        let Self([[_, sx, sy], [_, tx, ty], [_, wx, wy]]) = *self;
        let Spots { s, t, inverse } = *spots;
        let (across, along) = (inverse * size.x, inverse * size.y);
        let (s_dx, t_dx) = ((sx - s * wx) * across, (tx - t * wx) * along);
        let (s_dy, t_dy) = ((sy - s * wy) * across, (ty - t * wy) * along);
        let (right, down) = (s_dx * s_dx + t_dx * t_dx, s_dy * s_dy + t_dy * t_dy);
        let area = s_dx * t_dy - s_dy * t_dx;
        // In this order nothing grows beyond measure.
        area * (area / right.simd_gt(down).select(right, down))
    }
}

/// How far from the mean places of 16 groups their samples may look, texels right and down: `ranges` is the most that
/// two samples of the batch lie apart in `u`, `v`, `x` and `y`. To first order.
#[inline(always)]
pub(super) fn reaches<S: Simd>(
    k: &Bilinear4,
    coordinates: &Coordinates<S>,
    at: &Places<S>,
    spots: &Spots<S>,
    ranges: Vec4,
    size: Vec2,
) -> [f32x16<S>; 2] {
    let Coordinates([[_, sx, sy], [_, tx, ty], [_, wx, wy]]) = *coordinates;
    let weight = [along(k, 2, 1, at), along(k, 2, 2, at), wx, wy];
    let right = [along(k, 0, 1, at), along(k, 0, 2, at), sx, sy];
    let down = [along(k, 1, 1, at), along(k, 1, 2, at), tx, ty];
    let inverse = spots.inverse.abs();
    [
        moves(right, spots.s, weight, ranges) * inverse * size.x,
        moves(down, spots.t, weight, ranges) * inverse * size.y,
    ]
}

/// How function `i` changes with `u` (`lens` 1) or `v` (2).
#[inline(always)]
pub(super) fn along<S: Simd>(k: &Bilinear4, i: usize, lens: usize, at: &Places<S>) -> f32x16<S> {
    at.x * k[lens + 3][i] + at.y * k[lens + 6][i] + k[lens][i]
}

/// The sum of what each of `ranges` moves a quotient that is `value`, times its denominator.
#[inline(always)]
fn moves<S: Simd>(by: [f32x16<S>; 4], value: f32x16<S>, weight: [f32x16<S>; 4], ranges: Vec4) -> f32x16<S> {
    (by[0] - value * weight[0]).abs() * ranges.x
        + (by[1] - value * weight[1]).abs() * ranges.y
        + (by[2] - value * weight[2]).abs() * ranges.z
        + (by[3] - value * weight[3]).abs() * ranges.w
}

#[inline(always)]
fn moved<S: Simd>([c, cx, cy]: [f32x16<S>; 3], x: f32x16<S>, y: f32x16<S>) -> [f32x16<S>; 3] {
    [c + cx * x + cy * y, cx, cy]
}

impl<S: Simd> Spots<S> {
    /// Right and down; NaN looks at the anchor.
    #[inline(always)]
    pub(super) fn usable(&self, simd: S) -> [f32x16<S>; 2] {
        let zero = f32x16::splat(simd, 0.0);
        let huge = f32x16::splat(simd, FARTHEST);
        let Self { s, t, .. } = *self;
        [s.abs().simd_lt(huge).select(s, zero), t.abs().simd_lt(huge).select(t, zero)]
    }
}
