//! The film about one tile's centre, and the functions of planes through lens points there.
//!
//! In: a [`View`], a tile's column and row, and corners in the lens frame. Out: an edge's or a face's nine coefficients, for
//! [`super::setup`] (of triangles) and `shade::look` (of surfaces). With `s = radius (u, v, 0)`, `p = p_0 + x dx + y dy` and
//! `q_w = 1 + p.z / f` they are those of `1, u, v, x, xu, xv, y, yu, yv` in `q_w s.m - p.m + s.(d x p)`: of an edge from `a` to
//! `b` `m = a x b` and `d = b - a`, of a face its normal and 0.
//!
//! What one edge or face needs is written once, for one number or for several side by side.

use super::TILE;
use super::view::View;
use fearless_simd::{Simd, f64x8};
use glam::{DVec3, DVec4};
use std::ops::{Add, Mul, Neg, Sub};

/// The film about one tile's centre.
pub(crate) struct TileFilm {
    /// The tile's centre, and the steps to the next pixel right and down.
    pub p: DVec3,
    pub dx: DVec3,
    pub dy: DVec3,
    weight: [f64; 3],
    pub(super) radius: f64,
    /// Rows of the projection to `x w`, `y w` and `w` from the tile's centre, for the parts `1, u, v`.
    pub(super) image: [[DVec4; 3]; 3],
    /// `1/t` of the near plane at the centre, and its change with a pixel to the right and down.
    pub near_inverse: [f32; 3],
    /// The largest distance of the tile's samples from the plane of the lens: `1/t` at depth 1.
    pub deepest: f64,
    /// How far samples lie from the tile's centre at most, right or left and down or up, pixels.
    pub(super) half: [f64; 2],
}

/// One number, or several side by side.
pub(super) trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
{
}

impl Number for f64 {}

impl<S: Simd> Number for f64x8<S> {}

#[inline(always)]
pub(super) fn cross<T: Number>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

#[inline(always)]
pub(super) fn minus<T: Number>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `1, u, v` of `q_w s.m - p.m + s.(d x p)`, for a film point or a step on the film.
#[inline(always)]
fn part<T: Number>(m: [T; 3], d: [T; 3], p: DVec3, weight: f64, radius: f64) -> [T; 3] {
    [
        -(m[0] * p.x + m[1] * p.y + m[2] * p.z),
        (m[0] * weight + (d[1] * p.z - d[2] * p.y)) * radius,
        (m[1] * weight + (d[2] * p.x - d[0] * p.z)) * radius,
    ]
}

/// What rounding may add to a `1/t`, as a factor.
pub(super) const ROUNDING: f32 = 1.000_01;

impl TileFilm {
    /// At least the `1/t` of anything in the tile at this depth or beyond.
    pub(super) fn most_inverse_beyond(&self, depth: f32) -> f32 {
        (self.deepest / f64::from(depth)) as f32 * ROUNDING
    }

    pub(crate) fn new(view: &View, tile_x: u32, tile_y: u32) -> Self {
        let middle = 0.5 * f64::from(TILE);
        let center = [tile_x, tile_y].map(|tile| f64::from(tile * TILE) + middle);
        let half = view.displacement.map(|displacement| middle + displacement);
        let p = view.film + view.film_dx * center[0] + view.film_dy * center[1];
        let (dx, dy) = (view.film_dx, view.film_dy);
        let f = view.focal_length;
        Self {
            p,
            dx,
            dy,
            weight: [1.0 + p.z / f, dx.z / f, dy.z / f],
            radius: view.radius,
            image: view.pixel_from_lens.map(|[x, y, w]| [x - w * center[0], y - w * center[1], w]),
            // Along the axis the ray advances -p.z for each unit of t.
            near_inverse: [p.z, dx.z, dy.z].map(|z| (-z / view.near) as f32),
            deepest: half[0] * dx.z.abs() + half[1] * dy.z.abs() - p.z,
            half,
        }
    }

    /// The function of the plane through the lens point with normal `m - s x d` as nine coefficients. Negating `m`
    /// and `d` negates each exactly.
    #[inline(always)]
    pub(super) fn bilinear<T: Number>(&self, m: [T; 3], d: [T; 3]) -> [T; 9] {
        let [a0, a1, a2] = part(m, d, self.p, self.weight[0], self.radius);
        let [b0, b1, b2] = part(m, d, self.dx, self.weight[1], self.radius);
        let [c0, c1, c2] = part(m, d, self.dy, self.weight[2], self.radius);
        [a0, a1, a2, b0, b1, b2, c0, c1, c2]
    }

    /// The function of the directed edge from `a` to `b`.
    #[inline(always)]
    pub(super) fn edge<T: Number>(&self, a: [T; 3], b: [T; 3]) -> [T; 9] {
        self.bilinear(cross(a, b), minus(b, a))
    }

    /// The plane of a triangle, `D.N` and `N.(v0 - s)`; `zero` is the number.
    #[inline(always)]
    pub(super) fn face<T: Number>(&self, v: &[[T; 3]; 3], zero: T) -> ([T; 9], [T; 3]) {
        let normal = cross(minus(v[1], v[0]), minus(v[2], v[0]));
        let along = normal[0] * v[0][0] + normal[1] * v[0][1] + normal[2] * v[0][2];
        let plane = [along, -normal[0] * self.radius, -normal[1] * self.radius];
        (self.bilinear(normal, [zero; 3]), plane)
    }

    /// A triangle's edge functions, each opposite to its corner, by a common power of two that keeps them within
    /// single precision.
    pub(crate) fn scaled_edges(&self, v: [DVec3; 3]) -> [[f64; 9]; 3] {
        let v = v.map(|corner| corner.to_array());
        let edges = [self.edge(v[1], v[2]), self.edge(v[2], v[0]), self.edge(v[0], v[1])];
        let largest = edges.iter().flatten().fold(0.0f64, |most, c| most.max(c.abs()));
        let scale = power_of_two_near(largest * f64::from(TILE));
        edges.map(|e| e.map(|c| c * scale))
    }

    /// Whether rays of the tile may run along `normal` as well as against it: of planes across it both sides may be seen, of one that
    /// the lens lies beside only the tile's part towards its vanishing line.
    pub(crate) fn may_see_both(&self, normal: DVec3) -> bool {
        let f = self.bilinear(normal.to_array(), [0.0; 3]);
        let over_lens = |k: usize| libm::hypot(f[k + 1], f[k + 2]);
        let over_pixels = |k: usize, axis: usize| (f[k].abs() + over_lens(k)) * self.half[axis];
        f[0].abs() <= (over_lens(0) + over_pixels(3, 0) + over_pixels(6, 1)) * (1.0 + 1e-6)
    }

    /// Which side of a triangle's plane all of the lens sees, if it is one: the normal's (`false`), or the other.
    pub(crate) fn side(&self, v: [DVec3; 3]) -> Option<bool> {
        let normal = (v[1] - v[0]).cross(v[2] - v[0]);
        let (along, swing) = (normal.dot(v[0]), self.radius * libm::hypot(normal.x, normal.y));
        (along.abs() > swing).then_some(along > 0.0)
    }

    /// [`SetUp::facing`](super::setup::SetUp) and `plane` of one triangle.
    pub(crate) fn depth(&self, v: [DVec3; 3]) -> ([f32; 9], [f32; 3]) {
        let (facing, plane) = self.face(&v.map(|corner| corner.to_array()), 0.0);
        let scale = power_of_two_near(plane.iter().map(|c| c.abs()).sum());
        let single = |c: f64| (c * scale) as f32;
        (facing.map(single), plane.map(single))
    }
}

/// A power of two that brings `x` to between 1 and 2, within the doubles' range.
#[inline(always)]
pub(super) fn power_of_two_near(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52) & 0x7ff;
    // 2^-(exponent - 1023); denormals and infinities are left alone.
    if exponent == 0 || exponent >= 2046 { 1.0 } else { f64::from_bits((2046 - exponent) << 52) }
}
