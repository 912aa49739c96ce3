//! What a camera sees of a triangle, how blurred and how large. In: corners in lens space. Out: the corners of what is in view, from
//! the middle of the lens or from [`LENS`], their blur in pixels and what a metre between them is drawn as.

use super::diffraction;
use crate::geometry::clip;
use crate::optics::Optics;
use crate::scene::Scene;
use glam::{DVec2, DVec3};

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
        if found.is_empty() {
            for lens in self.blurred_onto_film(&before) {
                found.extend(self.seen_from(before.clone(), self.lens(lens)));
            }
        }
        found
    }

    /// Lens points, in aperture radii, from which something of a convex polygon is seen at one of nine points of the film: what is
    /// so near that it is blurred over more of it than [`LENS`] tells of. A polygon's points are seen at a film point from lens points that
    /// are a polygon too, on each side of the plane of focus: the nearest to the lens's middle is taken, if it is within the lens.
    fn blurred_onto_film(&self, polygon: &[DVec3]) -> Vec<[f64; 2]> {
        let focus = self.optics.focus_plane();
        let [across, up] = self.around.map(|reach| reach / MARGIN);
        let mut found = Vec::new();
        for sign in [1.0, -1.0] {
            let part = clip(polygon.to_vec(), |p| sign * (focus.m.dot(p) + focus.e));
            let middle = part.iter().sum::<DVec3>() / part.len() as f64;
            // What is in focus is seen from all of the lens at once.
            let images: Vec<_> = part.iter().map(|p| self.images(p.lerp(middle, 1e-6))).collect();
            for at in [[0, 0], [0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [1, -1], [-1, 1], [-1, -1]] {
                let film = DVec3::new(across * f64::from(at[0]), up * f64::from(at[1]), 1.0);
                let lens: Vec<DVec2> = images.iter().map(|&images| seen_at(images, film)).collect();
                let nearest = nearest_to_middle(&lens);
                found.extend(nearest.filter(|lens| lens.length_squared() <= 1.0).map(|lens| lens.to_array()));
            }
        }
        found
    }

    /// The homogeneous film points of a point through the middle of the lens and one aperture radius from there, along each axis.
    fn images(&self, point: DVec3) -> [DVec3; 3] {
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|lens| self.optics.film_image(self.lens(lens), point))
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
        let images: Vec<_> = polygon.iter().map(|&p| self.images(p)).collect();
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

/// From which lens point, in aperture radii, a point with these [`Frame::images`] is seen at a point of the film: they are affine in the
/// lens point.
fn seen_at([middle, u, v]: [DVec3; 3], film: DVec3) -> DVec2 {
    let off = |image: DVec3| image.truncate() - film.truncate() * image.z;
    let (from, u, v) = (off(middle), off(u - middle), off(v - middle));
    DVec2::new(v.perp_dot(from), from.perp_dot(u)) / u.perp_dot(v)
}

/// The point of a convex polygon that is nearest to the origin; none where there is no number.
fn nearest_to_middle(corners: &[DVec2]) -> Option<DVec2> {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let turns = sides.clone().map(|(a, b)| a.perp_dot(*b));
    if corners.len() > 2 && (turns.clone().all(|turn| turn > 0.0) || turns.clone().all(|turn| turn < 0.0)) {
        return Some(DVec2::ZERO);
    }
    let of_side = |(a, b): (&DVec2, &DVec2)| {
        let along = b - a;
        let part = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        *a + along * if part.is_finite() { part } else { 0.0 }
    };
    sides
        .map(of_side)
        .filter(|p| p.is_finite())
        .min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
}
