//! What a camera sees of a triangle, how blurred and how large. In: corners in lens space. Out: the corners of what is in view, from
//! the middle of the lens or from [`LENS`], their blur in pixels and what a metre between them is drawn as.

use super::diffraction;
use crate::optics::Optics;
use crate::scene::Scene;
use glam::DVec3;

/// How much larger than the film the part of a triangle's plane is that is looked at: blur and diffraction bring in what lies
/// beside it.
const MARGIN: f64 = 1.5;

/// How far from the middle of the film what is looked at may lie, across and up, metres.
pub(super) fn around(scene: &Scene) -> [f64; 2] {
    let film = scene.optics.camera().film;
    let [x, y] = diffraction::reach(scene);
    let of = |side: f64, reach: f64| (0.5 * MARGIN * side).max(0.5 * side + reach);
    [of(film.width.as_metres(), x), of(film.height.as_metres(), y)]
}

/// The shorter side of a pixel, metres: pixels need not be square.
pub(super) fn pixel(scene: &Scene) -> f64 {
    let (film, render) = (scene.optics.camera().film, &scene.render);
    (film.width.as_metres() / f64::from(render.width)).min(film.height.as_metres() / f64::from(render.height))
}

/// The camera, for points in lens space.
pub(super) struct Frame<'a> {
    optics: &'a Optics,
    /// Metres before the lens.
    pub(super) near: f64,
    /// How far from the middle of the film what is looked at may lie.
    around: [f64; 2],
    /// The shorter side of a pixel, metres.
    pub(super) pixel: f64,
}

impl<'a> Frame<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let optics = &scene.optics;
        Self { optics, near: optics.camera().near.as_metres(), around: around(scene), pixel: pixel(scene) }
    }

    /// Corners of what is in view of a triangle: none where nothing is.
    pub(super) fn in_view(&self, corners: [DVec3; 3]) -> Vec<DVec3> {
        let before = clip(corners.to_vec(), |p| self.optics.axis().dot(p) - self.near);
        if before.is_empty() || self.is_beside(&before) {
            return Vec::new();
        }
        // From the lens's middle it is mostly seen as a whole, or near enough.
        let mut found = self.seen_from(before.clone(), DVec3::ZERO);
        if found != before {
            for lens in LENS {
                found.extend(self.seen_from(before.clone(), self.lens(lens)));
            }
        }
        found
    }

    /// The blur of corners in pixels. Infinite where a point has no ellipse, being at the side of some lens point; and 0
    /// where the plane of focus passes between them.
    pub(super) fn blurs(&self, corners: &[DVec3]) -> impl Iterator<Item = f64> {
        let focus = self.optics.focus_plane();
        let is_beyond = |p: &DVec3| focus.m.dot(*p) + focus.e > 0.0;
        let crossing = corners.iter().any(is_beyond) && !corners.iter().all(is_beyond);
        let blur = |&corner: &DVec3| {
            self.optics.blur_of(corner).map_or(f64::INFINITY, |blur| blur.largest / self.pixel)
        };
        corners.iter().map(blur).chain(crossing.then_some(0.0))
    }

    /// How many pixels long a metre between these corners is drawn at most, seen from the lens's centre: `D r / (n . p)^2`
    /// of a point `p` at the distance `r`, with the film's normal `n` and its distance `D`.
    pub(super) fn magnification(&self, corners: &[DVec3]) -> f64 {
        let farthest = corners.iter().map(|p| p.length()).fold(0.0, f64::max);
        let depths = corners.iter().map(|p| self.optics.film_normal().dot(*p).abs());
        let nearest = depths.fold(f64::INFINITY, f64::min);
        self.optics.film_plane().e.abs() * farthest / (nearest * nearest) / self.pixel
    }

    /// Whether no lens point sees any of a polygon on this side of one of the sides of the film and what lies around it. (Of a
    /// tilted lens much is before it, and beside or behind what the film can see.) Images are affine in the lens point, so the
    /// most over the lens's disk is that of an affine function; and convex in the place, so corners tell of all between them.
    fn is_beside(&self, polygon: &[DVec3]) -> bool {
        let lens = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|at| self.lens(at));
        let images: Vec<_> =
            polygon.iter().map(|&p| lens.map(|lens| self.optics.film_image(lens, p))).collect();
        let most = |side: DVec3, [middle, u, v]: [DVec3; 3]| {
            side.dot(middle) + libm::hypot(side.dot(u - middle), side.dot(v - middle))
        };
        let mut sides = self.sides().into_iter().chain([DVec3::Z]);
        sides.any(|side| images.iter().all(|&images| most(side, images) <= 0.0))
    }

    /// A lens point in lens space, from aperture radii.
    fn lens(&self, [u, v]: [f64; 2]) -> DVec3 {
        self.optics.lens_point(u, v) * self.optics.aperture_radius()
    }

    /// What is positive of a homogeneous film point within each side of the film and what lies around it.
    fn sides(&self) -> [DVec3; 4] {
        let [x, y] = self.around;
        [[1.0, 0.0, x], [-1.0, 0.0, x], [0.0, 1.0, y], [0.0, -1.0, y]].map(DVec3::from)
    }

    /// The part of a polygon whose image from a lens point lies on the film or around it.
    fn seen_from(&self, polygon: Vec<DVec3>, lens: DVec3) -> Vec<DVec3> {
        self.sides()
            .into_iter()
            .fold(polygon, |polygon, side| clip(polygon, |p| side.dot(self.optics.film_image(lens, p))))
    }
}

/// Lens points, in aperture radii, from which a triangle is looked at that the middle does not see as a whole. Neighbours are about half
/// a radius apart and look [`MARGIN`] beyond the film: only what is blurred over more than three sides of the film may lie between them.
const LENS: [[f64; 2]; 12] = {
    // Four at half the radius; eight on the rim, at odd multiples of 22.5 degrees.
    let (half, low, high) = (0.5, 0.382_683_432_365_089_8, 0.923_879_532_511_286_7);
    [
        [half, 0.0],
        [-half, 0.0],
        [0.0, half],
        [0.0, -half],
        [high, low],
        [low, high],
        [-low, high],
        [-high, low],
        [-high, -low],
        [-low, -high],
        [low, -high],
        [high, -low],
    ]
};

/// The part of a convex polygon where an affine function is not negative.
fn clip(polygon: Vec<DVec3>, side: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let distances: Vec<f64> = polygon.iter().map(|&p| side(p)).collect();
    if distances.iter().all(|&d| d >= 0.0) {
        return polygon;
    }
    let count = polygon.len();
    let mut inside = Vec::with_capacity(count + 1);
    for i in 0..count {
        let next = (i + 1) % count;
        let (a, b, da, db) = (polygon[i], polygon[next], distances[i], distances[next]);
        if da >= 0.0 {
            inside.push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            inside.push(a + (b - a) * (da / (da - db)));
        }
    }
    inside
}
