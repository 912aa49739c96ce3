//! Where on the film a triangle can be seen: conservative pixel boxes over a cell of the aperture.

use super::view::{LensCell, View};
use glam::{DVec3, DVec4};

/// Pixels `x0..=x1` by `y0..=y1`; empty when `x0 > x1`. Clamped to one pixel outside of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PixelBox {
    pub x0: i16,
    pub x1: i16,
    pub y0: i16,
    pub y1: i16,
}

impl PixelBox {
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

/// The part of space in which a point has a finite image for every lens point: beyond `near`, and `w` at
/// least [`View::least_w`]. Nothing that a ray of the picture meets lies outside of it.
#[derive(Clone, Debug)]
pub(crate) struct Frustum {
    /// Half-spaces `h.(x, 1) >= 0`.
    planes: [DVec4; 3],
}

impl Frustum {
    pub(crate) fn new(view: &View) -> Self {
        let [c0, cu, cv] = &view.pixel_from_lens;
        // w_s = -n.x + (n.s)(1 - z/f): the lens part is a multiple of (1 - z/f) alone.
        let slope = libm::hypot(cu[2].w, cv[2].w);
        let lens = DVec4::new(0.0, 0.0, -slope / view.focal_length, slope);
        // A tenth, so that rounding can never put a visible point outside.
        let least = DVec4::new(0.0, 0.0, 0.0, 0.1 * view.least_w);
        Self {
            planes: [
                DVec4::new(0.0, 0.0, 1.0, -view.near * (1.0 - 1e-6)),
                c0[2] - lens - least,
                c0[2] + lens - least,
            ],
        }
    }

    pub(crate) fn contains(&self, point: DVec3) -> bool {
        self.planes.iter().all(|plane| plane.dot(point.extend(1.0)) >= 0.0)
    }

    /// The part of a triangle inside: a polygon of at most six corners.
    pub(crate) fn clip(&self, triangle: [DVec3; 3]) -> Vec<DVec3> {
        let mut polygon = triangle.to_vec();
        for plane in &self.planes {
            let mut inside = Vec::with_capacity(polygon.len() + 1);
            for (i, &a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                let (da, db) = (plane.dot(a.extend(1.0)), plane.dot(b.extend(1.0)));
                if da >= 0.0 {
                    inside.push(a);
                }
                if (da >= 0.0) != (db >= 0.0) {
                    inside.push(a + (b - a) * (da / (da - db)));
                }
            }
            polygon = inside;
            if polygon.is_empty() {
                break;
            }
        }
        polygon
    }
}

/// The pixels that the point can reach from the lens points of `cell`. The point lies in the frustum.
pub(crate) fn point_box(view: &View, cell: LensCell, point: DVec3) -> PixelBox {
    let p = point.extend(1.0);
    let [c0, cu, cv] = &view.pixel_from_lens;
    let at = |row: usize| {
        let (u, v) = (cu[row].dot(p), cv[row].dot(p));
        (c0[row].dot(p) + u * cell.u + v * cell.v, u, v)
    };
    let (w, wu, wv) = at(2);
    let least = w - cell.radius * libm::sqrt(wu * wu + wv * wv);
    if least.is_nan() || least <= 0.0 {
        return everywhere(view);
    }
    // x(s) - x(c) = (dx - x(c) dw) / w(s), and the numerator is linear in s - c.
    let range = |row: usize| {
        let (x, xu, xv) = at(row);
        let center = x / w;
        let (gu, gv) = (xu - center * wu, xv - center * wv);
        let reach = cell.radius * libm::sqrt(gu * gu + gv * gv) / least;
        // A margin against rounding of these numbers and of the single-precision edge functions.
        let margin = 2e-3 + 1e-6 * (reach + center.abs());
        (center - reach - margin, center + reach + margin)
    };
    let ((x0, x1), (y0, y1)) = (range(0), range(1));
    if x0.is_nan() || x1.is_nan() || y0.is_nan() || y1.is_nan() {
        return everywhere(view);
    }
    let (width, height) = (f64::from(view.width), f64::from(view.height));
    PixelBox {
        x0: x0.floor().clamp(-1.0, width) as i16,
        x1: x1.floor().clamp(-1.0, width) as i16,
        y0: y0.floor().clamp(-1.0, height) as i16,
        y1: y1.floor().clamp(-1.0, height) as i16,
    }
}

fn everywhere(view: &View) -> PixelBox {
    PixelBox { x0: -1, x1: view.width as i16, y0: -1, y1: view.height as i16 }
}
