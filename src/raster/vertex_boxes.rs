//! Where on the film points can be seen: conservative pixel boxes over cells of the aperture.
//!
//! In: points in the lens frame, eight at a time: vertices, and corners of what the frustum leaves of a triangle. Out: for each
//! point and cell the pixels that it can reach, for [`super::triangle_boxes`]: from the cell's middle `x(c)` as far as the largest change of
//! its image over the cell, `radius |dx - x(c) dw| / least w`, to both sides.

use super::batch::LensCell;
use super::view::View;
use crate::geometry::clip;
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, f64x8, mask64x8};
use glam::{DVec3, DVec4};

/// Pixels `x0..=x1` by `y0..=y1`; empty when `x0 > x1`. Clamped to one pixel outside of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PixelBox {
    pub x0: i16,
    pub x1: i16,
    pub y0: i16,
    pub y1: i16,
}

impl PixelBox {
    /// Stands for the box of a point outside of the frustum; no point inside has it.
    pub(crate) const OUTSIDE: Self = Self { x0: 1, x1: 0, y0: 1, y1: 0 };

    pub(crate) const EMPTY: Self = Self { x0: i16::MAX, x1: i16::MIN, y0: i16::MAX, y1: i16::MIN };

    pub(crate) fn union(self, other: Self) -> Self {
        Self {
            x0: self.x0.min(other.x0),
            x1: self.x1.max(other.x1),
            y0: self.y0.min(other.y0),
            y1: self.y1.max(other.y1),
        }
    }

    pub(crate) fn is_empty(self) -> bool {
        self.x0 > self.x1
    }
}

/// The part of space in which a point has a finite image for every lens point: beyond `near`, and `w` at least a tenth of
/// [`View::least_w`]; and the part that rays of the picture can meet. Mostly the second lies within the first: where `w` changes by
/// as much over the lens as it amounts to, as it does through a wide lens on a film that is turned far from it, one lens point sees what has
/// no image for another.
#[derive(Clone, Debug)]
pub(crate) struct Frustum {
    /// Half-spaces `h.(x, 1) >= 0` of the first.
    finite: [DVec4; 3],
    /// What can be met, nearer than the focal length and beyond: half-spaces of either.
    met: [[DVec4; 3]; 2],
}

/// What of [`View::least_w`] is asked for, so that rounding can never put a visible point outside.
const FINITE: f64 = 0.1;
const MET: f64 = 0.5;

impl Frustum {
    pub(crate) fn new(view: &View) -> Self {
        let [c0, cu, cv] = &view.pixel_from_lens;
        // w_s = -n.x + (n.s)(1 - z/f): the lens part is a multiple of (1 - z/f) alone.
        let slope = libm::hypot(cu[2].w, cv[2].w);
        let lens = DVec4::new(0.0, 0.0, -slope / view.focal_length, slope);
        let near = DVec4::new(0.0, 0.0, 1.0, -view.near * (1.0 - 1e-6));
        let least = DVec4::new(0.0, 0.0, 0.0, FINITE * view.least_w);
        // Along a ray `w` grows as `z`, and is what it is for the ray's own lens point.
        let along = DVec4::new(0.0, 0.0, MET * view.least_w / view.near, 0.0);
        let beyond = DVec4::new(0.0, 0.0, 1.0, -view.focal_length);
        Self {
            finite: [near, c0[2] - lens - least, c0[2] + lens - least],
            met: [[near, -beyond, c0[2] + lens - along], [near, beyond, c0[2] - lens - along]],
        }
    }

    /// Whether a point has a finite image for every lens point.
    pub(crate) fn contains(&self, point: DVec3) -> bool {
        self.finite.iter().all(|plane| plane.dot(point.extend(1.0)) >= 0.0)
    }

    /// Whether nothing between these can be met.
    pub(crate) fn hides(&self, points: &[DVec3]) -> bool {
        let outside = |plane: &DVec4, point: &DVec3| plane.dot(point.extend(1.0)) < 0.0;
        let [[near, _, low], [.., high]] = &self.met;
        // The larger of two linear functions is nowhere more than at a corner.
        points.iter().all(|point| outside(near, point))
            || points.iter().all(|point| outside(low, point) && outside(high, point))
    }

    /// The corners of the part of a triangle that can be met: one polygon, or two.
    pub(crate) fn clip(&self, triangle: [DVec3; 3]) -> Vec<DVec3> {
        let [mut corners, beyond] = [0, 1].map(|part: usize| within(triangle.to_vec(), &self.met[part]));
        corners.extend(beyond);
        corners
    }
}

/// The part of a polygon within these half-spaces.
fn within(polygon: Vec<DVec3>, planes: &[DVec4]) -> Vec<DVec3> {
    planes.iter().fold(polygon, |polygon, plane| clip(polygon, |point| plane.dot(point.extend(1.0))))
}

/// The pixels that points can reach from the lens points of each cell, point by point. Those outside of the frustum
/// get [`PixelBox::OUTSIDE`]; without one, all count as inside.
pub(crate) fn point_boxes(
    level: Level,
    view: &View,
    frustum: Option<&Frustum>,
    cells: &[LensCell],
    points: &[DVec3],
    out: &mut [PixelBox],
) {
    at_level!(level, simd => boxes(simd, view, frustum, cells, points, out));
}

/// Points that are handled together.
const POINTS: usize = 8;

#[inline(always)]
fn boxes<S: Simd>(
    simd: S,
    view: &View,
    frustum: Option<&Frustum>,
    cells: &[LensCell],
    points: &[DVec3],
    out: &mut [PixelBox],
) {
    let [c0, cu, cv] = &view.pixel_from_lens;
    let zero = f64x8::splat(simd, 0.0);
    for (points, out) in points.chunks(POINTS).zip(out.chunks_mut(POINTS * cells.len())) {
        let mut places = [[0.0; POINTS]; 3];
        for (i, point) in points.iter().enumerate().take(POINTS) {
            places[0][i] = point.x;
            places[1][i] = point.y;
            places[2][i] = point.z;
        }
        let at = places.map(|axis| f64x8::load_array(simd, axis));
        let inside = match frustum {
            Some(frustum) => {
                let [near, low, high] = &frustum.finite;
                affine(near, &at).simd_ge(zero)
                    & affine(low, &at).simd_ge(zero)
                    & affine(high, &at).simd_ge(zero)
            }
            None => zero.simd_ge(zero),
        };
        let inside = inside.to_bitmask();
        let x = [affine(&c0[0], &at), affine(&cu[0], &at), affine(&cv[0], &at)];
        let y = [affine(&c0[1], &at), affine(&cu[1], &at), affine(&cv[1], &at)];
        let w = [affine(&c0[2], &at), affine(&cu[2], &at), affine(&cv[2], &at)];
        for (number, cell) in cells.iter().enumerate() {
            let center = w[0] + w[1] * cell.u + w[2] * cell.v;
            let least = center - (w[1] * w[1] + w[2] * w[2]).sqrt() * cell.radius;
            let positive = least.simd_gt(zero);
            let [x0, x1] =
                range(simd, &x, &w, center, least, positive, (cell, cell.displacement[0]), view.width);
            let [y0, y1] =
                range(simd, &y, &w, center, least, positive, (cell, cell.displacement[1]), view.height);
            for (i, out) in out.chunks_exact_mut(cells.len()).enumerate().take(POINTS) {
                out[number] = if inside >> i & 1 == 1 {
                    PixelBox { x0: x0[i] as i16, x1: x1[i] as i16, y0: y0[i] as i16, y1: y1[i] as i16 }
                } else {
                    PixelBox::OUTSIDE
                };
            }
        }
    }
}

/// `h.(x, 1)`.
#[inline(always)]
pub(super) fn affine<S: Simd>(h: &DVec4, at: &[f64x8<S>; 3]) -> f64x8<S> {
    at[0] * h.x + at[1] * h.y + at[2] * h.z + h.w
}

/// First and last pixel along one axis, of `size`, where `image` (homogeneous, with weight `w`) can lie: everywhere
/// unless `w` is `positive` in the whole cell; `center` and `least` are its values in the middle and at least. Samples lie up
/// to `displacement` pixels outside of their own.
#[expect(clippy::too_many_arguments, reason = "numbers of one formula")]
#[inline(always)]
fn range<S: Simd>(
    simd: S,
    image: &[f64x8<S>; 3],
    w: &[f64x8<S>; 3],
    center: f64x8<S>,
    least: f64x8<S>,
    positive: mask64x8<S>,
    (cell, displacement): (&LensCell, f64),
    size: u32,
) -> [[f64; POINTS]; 2] {
    let middle = (image[0] + image[1] * cell.u + image[2] * cell.v) / center;
    // x(s) - x(c) = (dx - x(c) dw) / w(s), and the numerator is linear in s - c.
    let (gu, gv) = (image[1] - middle * w[1], image[2] - middle * w[2]);
    let reach = (gu * gu + gv * gv).sqrt() * cell.radius / least;
    // A margin against rounding of these numbers and of the single-precision edge functions.
    let reach = reach + (reach + middle.abs()) * 1e-6 + (2e-3 + displacement);
    let (first, last) = (f64x8::splat(simd, -1.0), f64x8::splat(simd, f64::from(size)));
    let (low, high) = ((middle - reach).floor(), (middle + reach).floor());
    let known = positive & low.simd_le(high);
    let low = (known & low.simd_gt(first)).select(low, first);
    let high = (known & high.simd_lt(last)).select(high, last);
    [low.simd_lt(last).select(low, last).to_array(), high.simd_gt(first).select(high, first).to_array()]
}
