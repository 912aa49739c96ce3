//! Small triangles far out of focus: how their images move over the film with the lens point.
//!
//! In: a triangle's corners. Out: how its middle moves over the film with the lens point, and how far the rest is from it, for
//! [`super::lens_points`], which leaves out what none of a tile's sees. Sixty-four lens points see such a triangle in 64 places all
//! over its disk of confusion, so most of the tiles under the disk see it from none, and need not set it up.
//!
//! A point's image is `x(s) = (x_1 + u x_u + v x_v) / (1 + u w_u + v w_v)`, `y` likewise, in the terms of [`super::view`] and all
//! divided by `w_1`; or `x_1 + g.s / (1 + p.s)` with `p = (w_u, w_v)` and `g = (x_u, x_v) - x_1 p`. With `r = 1 / (1 - |p|)`, the most
//! that `1 / (1 + p.s)` can be, a corner is at most `|x - x'| + |g - g'| r + |g'| |p - p'| r r'` from the middle (with a dash).

use super::TILE;
use super::lists::Tiles;
use super::view::View;
use glam::{DVec2, DVec3, Vec3Swizzles};
use rayon::prelude::*;

/// The least way, in pixels, that an image moves from one end of the lens to the other, for a triangle to be loose. At one
/// and a half tiles (the tower at f/1.2) it is as fast without.
const LEAST_BLUR: f64 = 3.0 * TILE as f64;

/// A triangle whose image is small beside its way over the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Loose {
    /// Where its middle is seen through the lens centre, pixels.
    pub place: [f32; 2],
    /// How far a lens point lies from the centre, `u` and `v`, for each pixel to the right, and down, that it sees the middle from there,
    /// but for [`Tilt`]: what is on the diagonal of the inverse of `g`, of `x` and of `y`.
    pub per_pixel: [f32; 2],
    /// How far any of it is from its middle at most, pixels right or left and down or up.
    pub reach: [f32; 2],
}

/// What a film that leans against the lens, or is turned, adds to that. (Kept apart: tiles go through all of them, and wait for memory.)
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tilt {
    /// What is beside the diagonal: `u` for each pixel down, and `v` for each to the right.
    pub across: [f32; 2],
    pub p: [f32; 2],
}

/// Triangles in the order of depth; of those that are not loose [`Loose::SEEN_BY_ALL`].
#[derive(Default)]
pub(super) struct LooseTriangles {
    pub each: Vec<Loose>,
    /// Empty where there is nothing in any.
    pub tilts: Vec<Tilt>,
}

/// How a point's image moves.
struct Image {
    place: DVec2,
    /// `g` of `x` and of `y`.
    g: [DVec2; 2],
    p: DVec2,
    /// The most that `1 / (1 + p.s)` can be.
    most: f64,
}

impl Image {
    /// None where `w` is not positive for all lens points.
    fn new(view: &View, at: DVec3) -> Option<Self> {
        let row = |row: usize| DVec3::from(view.pixel_from_lens.map(|part| part[row].dot(at.extend(1.0))));
        let w = row(2);
        let p = w.yz() / w.x;
        let [x, y] = [row(0) / w.x, row(1) / w.x];
        let is_seen = w.x > 0.0 && p.length() < 1.0;
        is_seen.then(|| Self {
            place: DVec2::new(x.x, y.x),
            g: [x.yz() - x.x * p, y.yz() - y.x * p],
            p,
            most: 1.0 / (1.0 - p.length()),
        })
    }

    /// In the middle of these, in everything.
    fn between(corners: &[Self; 3]) -> Option<Self> {
        let middle = |of: &dyn Fn(&Self) -> DVec2| {
            let [a, b, c] = corners.each_ref().map(of);
            0.5 * (a.min(b).min(c) + a.max(b).max(c))
        };
        let p = middle(&|corner| corner.p);
        (p.length() < 1.0).then(|| Self {
            place: middle(&|corner| corner.place),
            g: [middle(&|corner| corner.g[0]), middle(&|corner| corner.g[1])],
            p,
            most: 1.0 / (1.0 - p.length()),
        })
    }
}

impl Loose {
    /// Stands for a triangle that is not loose: what sees it cannot be told from place or way.
    pub(super) const SEEN_BY_ALL: Self = Self { place: [0.0; 2], per_pixel: [0.0; 2], reach: [0.0; 2] };

    /// None for a triangle that is not loose; all `corners` have to lie within the frustum.
    pub(super) fn new(view: &View, corners: [DVec3; 3]) -> Option<(Self, Tilt)> {
        let [a, b, c] = corners.map(|corner| Image::new(view, corner));
        let corners = [a?, b?, c?];
        let middle = Image::between(&corners)?;
        let mut reach = DVec2::ZERO;
        for corner in &corners {
            let bend = corner.p.distance(middle.p) * corner.most * middle.most;
            let way = [0, 1].map(|row| {
                corner.g[row].distance(middle.g[row]) * corner.most + middle.g[row].length() * bend
            });
            reach = reach.max((corner.place - middle.place).abs() + DVec2::from(way));
        }
        // As in `bounds`, and what single precision may lose.
        let [x, y] = middle.g;
        let most = f64::from(view.width.max(view.height))
            + middle.place.abs().max_element()
            + x.length()
            + y.length();
        reach += DVec2::from(view.spread) + 2e-3 + 4e-6 * most;
        // The shortest way across: twice the lesser singular value of the two rows.
        let way = (libm::hypot(x.x + y.y, y.x - x.y) - libm::hypot(x.x - y.y, x.y + y.x)).abs();
        let determinant = x.perp_dot(y);
        (way >= LEAST_BLUR && 4.0 * reach.max_element() <= way).then(|| {
            let single = |two: DVec2| two.as_vec2().to_array();
            let per_pixel = single(DVec2::new(y.y, x.x) / determinant);
            let across = single(DVec2::new(-x.y, -y.x) / determinant);
            let (place, reach, p) = (single(middle.place), single(reach), single(middle.p));
            (Self { place, per_pixel, reach }, Tilt { across, p })
        })
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
) -> LooseTriangles {
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
        return LooseTriangles::default();
    }
    let seen_by_all = (Loose::SEEN_BY_ALL, Tilt::default());
    let (each, mut tilts): (Vec<_>, Vec<_>) =
        (0..order.len()).into_par_iter().map(|at| of(at).unwrap_or(seen_by_all)).unzip();
    if tilts.iter().all(|tilt| *tilt == Tilt::default()) {
        tilts = Vec::new();
    }
    LooseTriangles { each, tilts }
}
