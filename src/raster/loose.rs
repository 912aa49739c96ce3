//! Small triangles far out of focus: how their images move over the film with the lens point.
//!
//! In: a triangle's corners. Out: how its middle moves over the film with the lens point, and how far the rest is from it; the same of
//! several triangles together, for [`super::bunches`]. Sixty-four lens points see such a triangle in 64 places all over its disk of
//! confusion, so most of the tiles under the disk see it from none, and need not set it up.
//!
//! A point's image is `x(s) = (x_1 + u x_u + v x_v) / (1 + u w_u + v w_v)`, `y` likewise, in the terms of [`super::view`] and all
//! divided by `w_1`; or `x_1 + g.s / (1 + p.s)` with `p = (w_u, w_v)` and `g = (x_u, x_v) - x_1 p`. With `r = 1 / (1 - |p|)`, the most
//! that `1 / (1 + p.s)` can be, a corner is at most `|x - x'| + |g - g'| r + |g'| |p - p'| r r'` from the middle (with a dash).

use super::view::View;
use super::{LANES, TILE};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// The least way, in pixels, that an image moves from one end of the lens to the other, for a triangle to be loose. At one
/// and a half tiles (the tower at f/1.2) it is as fast without.
const LEAST_BLUR: f64 = 3.0 * TILE as f64;

/// How the image of a point moves, and how far others are from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Image {
    /// Where it is seen through the lens centre, pixels.
    pub place: DVec2,
    /// `g` of `x` and of `y`.
    g: [DVec2; 2],
    p: DVec2,
    /// How far what it stands for is from it at most, pixels right or left and down or up.
    reach: DVec2,
}

impl Image {
    /// Of a small triangle far out of focus, whose `corners` have to lie within the frustum; none of any other.
    pub(super) fn of_loose(view: &View, corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| Self::of_point(view, corner));
        let mut image = Self::around(&[a?, b?, c?])?;
        // As in `bounds`, and what single precision may lose.
        let [x, y] = image.g;
        let most = f64::from(view.width.max(view.height))
            + image.place.abs().max_element()
            + x.length()
            + y.length();
        image.reach += DVec2::from(view.displacement) + 2e-3 + 4e-6 * most;
        (4.0 * image.reach.max_element() <= image.way()).then_some(image)
    }

    /// None where `w` is not positive for all lens points.
    fn of_point(view: &View, at: DVec3) -> Option<Self> {
        let row = |row: usize| DVec3::from(view.pixel_from_lens.map(|part| part[row].dot(at.extend(1.0))));
        let w = row(2);
        let p = w.yz() / w.x;
        let [x, y] = [row(0) / w.x, row(1) / w.x];
        let is_seen = w.x > 0.0 && p.length() < 1.0;
        is_seen.then(|| Self {
            place: DVec2::new(x.x, y.x),
            g: [x.yz() - x.x * p, y.yz() - y.x * p],
            p,
            reach: DVec2::ZERO,
        })
    }

    /// In the middle of these in everything, and reaches what they do; none where it hardly moves.
    pub(super) fn around(images: &[Self]) -> Option<Self> {
        let middle = |of: &dyn Fn(&Self) -> DVec2| {
            let (least, most) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            let (least, most) =
                images.iter().map(of).fold((least, most), |(least, most), at| (least.min(at), most.max(at)));
            0.5 * (least + most)
        };
        let mut all = Self {
            place: middle(&|image| image.place),
            g: [middle(&|image| image.g[0]), middle(&|image| image.g[1])],
            p: middle(&|image| image.p),
            reach: DVec2::ZERO,
        };
        // (No number is not less.)
        if !(all.p.length() < 1.0 && all.way() >= LEAST_BLUR) {
            return None;
        }
        for image in images {
            let bend = image.p.distance(all.p) * image.most() * all.most();
            let way = [0, 1]
                .map(|row| image.g[row].distance(all.g[row]) * image.most() + all.g[row].length() * bend);
            let reach = (image.place - all.place).abs() + DVec2::from(way) + image.reach;
            all.reach = all.reach.max(reach);
        }
        Some(all)
    }

    /// The most that `1 / (1 + p.s)` can be.
    fn most(&self) -> f64 {
        1.0 / (1.0 - self.p.length())
    }

    /// The shortest way across the disk of confusion, pixels: twice the lesser singular value of the rows of `g`.
    pub(super) fn way(&self) -> f64 {
        let [x, y] = self.g;
        (libm::hypot(x.x + y.y, y.x - x.y) - libm::hypot(x.x - y.y, x.y + y.x)).abs()
    }
}

/// Images of sixteen, number by number, all in single precision.
#[derive(Clone, Debug, Default)]
pub(super) struct Sixteen {
    /// Where each is seen through the lens centre, pixels: `x` and `y`.
    pub place: [[f32; LANES]; 2],
    /// How far a lens point lies from the centre, `u` and `v`, for each pixel to the right, and down, that it sees the image from there,
    /// but for the tilt: what is on the diagonal of the inverse of `g`. Nothing where it is not known how it moves.
    pub per_pixel: [[f32; LANES]; 2],
    /// How far what it stands for is from it at most.
    pub reach: [[f32; LANES]; 2],
    /// What a film that leans against the lens, or is turned, adds to that: what is beside the diagonal, `u` for each pixel down and `v`
    /// for each to the right.
    pub across: [[f32; LANES]; 2],
    pub p: [[f32; LANES]; 2],
    /// Those that there are.
    pub live: u16,
}

impl Sixteen {
    /// Of so many at most; none is one that may be anywhere.
    pub(super) fn new(images: impl IntoIterator<Item = Option<Image>>) -> Self {
        let mut all = Self::default();
        for (lane, image) in images.into_iter().enumerate().take(LANES) {
            all.live |= 1 << lane;
            let Some(Image { place, g: [x, y], p, reach }) = image else { continue };
            let determinant = x.perp_dot(y);
            let mut put = |rows: fn(&mut Self) -> &mut [[f32; LANES]; 2], value: DVec2| {
                let [first, second] = rows(&mut all);
                [first[lane], second[lane]] = value.as_vec2().to_array();
            };
            put(|all| &mut all.place, place);
            put(|all| &mut all.per_pixel, DVec2::new(y.y, x.x) / determinant);
            put(|all| &mut all.across, DVec2::new(-x.y, -y.x) / determinant);
            put(|all| &mut all.reach, reach);
            put(|all| &mut all.p, p);
        }
        all
    }

    /// Whether nothing leans or is turned.
    pub(super) fn is_level(&self) -> bool {
        [&self.across, &self.p].into_iter().flatten().flatten().all(|&value| value == 0.0)
    }
}
