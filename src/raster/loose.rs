//! Small triangles far out of focus: the lens points from which a tile sees them.
//!
//! In: a triangle's corners. Out: the lens points that see it in a tile, as a rectangle, for [`super::lens_points`], which leaves out what
//! none of a tile's sees. Sixty-four lens points see such a triangle in 64 places all over
//! its disk of confusion, so most of the tiles under the disk see it from none, and need not set it up.
//!
//! A corner's image moves with the lens point: `x(s) = x(0) + (g.s) w(0) / w(s)`, `g = (dx - x(0) dw) / w(0)`, in the
//! terms of [`super::bounds`]. So the images that touch a tile are those of lens points in a rectangle, which moves in
//! proportion to the tile's place.

use super::TILE;
use super::lists::Tiles;
use super::view::View;
use glam::DVec3;
use rayon::prelude::*;

/// The least way, in pixels, that an image moves from one end of the lens to the other, for a triangle to be loose. At one
/// and a half tiles (the tower at f/1.2) it is as fast without.
const LEAST_BLUR: f64 = 3.0 * TILE as f64;

/// Along one axis of the lens, the middle of the lens points that see the triangle at pixel coordinate 0 of the same axis
/// of the picture, its change with a pixel, and how far from the middle they lie; fractions of the aperture's radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub at_zero: f32,
    pub per_pixel: f32,
    pub reach: f32,
}

/// A triangle whose image is small beside its way over the film.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loose {
    pub axes: [Axis; 2],
}

impl Loose {
    /// Stands for a triangle that is not loose.
    pub(super) const SEEN_BY_ALL: Self =
        Self { axes: [Axis { at_zero: 0.0, per_pixel: 0.0, reach: f32::INFINITY }; 2] };

    /// None for a triangle that is not loose; all `corners` have to lie within the frustum.
    pub(super) fn new(view: &View, corners: [DVec3; 3]) -> Option<Self> {
        let mut images = [[[0.0; 3]; 2]; 3];
        let mut swings = [0.0; 3];
        let [c0, cu, cv] = &view.pixel_from_lens;
        for ((axes, swing), corner) in images.iter_mut().zip(&mut swings).zip(corners) {
            let at = corner.extend(1.0);
            let [w, wu, wv] = [c0, cu, cv].map(|rows| rows[2].dot(at));
            let h = libm::hypot(wu, wv);
            // How far w(0) / w(s) may be from 1.
            *swing = if w > h { h / (w - h) } else { return None };
            for (row, image) in axes.iter_mut().enumerate() {
                let middle = c0[row].dot(at) / w;
                *image = [middle, (cu[row].dot(at) - middle * wu) / w, (cv[row].dot(at) - middle * wv) / w];
            }
        }
        let [x, y] = [0, 1].map(|row| {
            let own = 1 + row;
            let each = || images.iter().zip(&swings).map(|(axes, swing)| (axes[row], *swing));
            let middle = |part: usize| {
                let low = each().map(|(image, _)| image[part]).fold(f64::INFINITY, f64::min);
                let high = each().map(|(image, _)| image[part]).fold(f64::NEG_INFINITY, f64::max);
                0.5 * (low + high)
            };
            let (place, way) = (middle(0), middle(own));
            let reach = |(image, swing): ([f64; 3], f64)| {
                let across = image[3 - own].abs();
                let bend = swing * libm::hypot(image[1], image[2]);
                (image[0] - place).abs() + (image[own] - way).abs() + across + bend
            };
            let reach = each().map(reach).fold(0.0, f64::max);
            // As in `bounds`, and what the single precision of this file may lose.
            let most = f64::from(view.width.max(view.height)) + place.abs() + way.abs();
            let reach = reach + view.spread[row] + 2e-3 + 4e-6 * most;
            let is_loose = 2.0 * way.abs() >= LEAST_BLUR && 2.0 * reach <= way.abs();
            is_loose.then(|| Axis {
                at_zero: (-place / way) as f32,
                per_pixel: (1.0 / way) as f32,
                reach: (reach / way.abs()) as f32,
            })
        });
        Some(Self { axes: [x?, y?] })
    }
}

/// A triangle in fewer tiles is not taken for loose.
const FEW_TILES: u32 = 4;

/// One in so many candidates tells whether most of what the tiles list is loose.
const STRIDE: usize = 29;

/// The candidates in `order`, which touch `tiles`; none where most of what the tiles list is not loose. `corners` tells those
/// of a candidate within the frustum.
pub(super) fn find(
    view: &View,
    order: &[u32],
    tiles: &[Tiles],
    corners: impl Fn(u32) -> Option<[DVec3; 3]> + Sync,
) -> Vec<Loose> {
    let of = |at: usize| {
        let loose = (tiles[at].count() >= FEW_TILES).then(|| Loose::new(view, corners(order[at])?));
        loose.flatten()
    };
    // One in a few tells enough.
    let some = (0..order.len()).step_by(STRIDE);
    let (all, loose) = some.fold((0, 0), |(all, loose), at| {
        let count = u64::from(tiles[at].count());
        (all + count, loose + if of(at).is_some() { count } else { 0 })
    });
    if 2 * loose <= all {
        return Vec::new();
    }
    (0..order.len()).into_par_iter().map(|at| of(at).unwrap_or(Loose::SEEN_BY_ALL)).collect()
}
