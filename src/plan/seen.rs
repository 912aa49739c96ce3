//! What a picture shows, as far as a plan must know: which materials, and how blurred. Bounds, found from corners of
//! triangles without drawing: nothing that is seen is missed, some that is hidden is counted.

use super::diffraction;
use crate::optics::Optics;
use crate::scene::{NONE, Scene, bounds};
use glam::DVec3;
use rayon::prelude::*;

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// By number of the material.
    pub materials: Vec<bool>,
    /// The largest and smallest blur of a corner, in pixels; `None` where nothing is in view.
    pub blur: Option<[f64; 2]>,
    /// How many pixels are between the shadow's ends, at most, where the sun's light takes two directions that are one radian
    /// apart: the way it goes within the scene to what is in view, as large as that is drawn. 0 without a sun.
    pub shadow: f64,
    pub triangles: usize,
    /// Some are textured: they have texture coordinates.
    pub textured: Vec<bool>,
    /// In view or not, which is what the sun sees: textured or not, and textured.
    pub anywhere: [Vec<bool>; 2],
}

#[derive(Clone)]
struct Part {
    materials: Vec<bool>,
    textured: Vec<bool>,
    anywhere: [Vec<bool>; 2],
    blur: [f64; 2],
    shadow: f64,
    triangles: usize,
}

impl Seen {
    /// Whether anything in view is blurred by at least `threshold` pixels.
    pub(super) fn has_blur_of(scene: &Scene, threshold: f64) -> bool {
        let (optics, surfaces) = (&scene.optics, &scene.surfaces);
        let (frame, bound) = (Frame::new(scene), optics.blur_bound());
        surfaces.triangles.par_iter().any(|corners| {
            let world = corners.map(|i| surfaces.positions[i as usize]);
            let corners = world.map(|p| optics.world_from_lens().point_inverse(p));
            // Mostly its corners tell enough: nothing between them is blurred more, and nothing is seen behind the lens.
            let is_before = |&corner: &DVec3| bound.depth(corner) >= frame.near;
            let is_small = |&corner: &DVec3| bound.at(corner) < threshold * frame.pixel;
            let is_told = match corners.iter().filter(|corner| is_before(corner)).count() {
                0 => true,
                3 => corners.iter().all(is_small),
                _ => false,
            };
            !is_told && frame.blurs(&frame.in_view(corners)).any(|blur| blur >= threshold)
        })
    }

    /// Whether [`Self::shadow`] is at least `threshold` pixels.
    pub(super) fn has_shadow_of(scene: &Scene, threshold: f64) -> bool {
        let (optics, surfaces) = (&scene.optics, &scene.surfaces);
        let (frame, light) = (Frame::new(scene), Light::of(scene));
        let Some(light) = light else { return false };
        surfaces.triangles.par_iter().any(|corners| {
            let world = corners.map(|i| surfaces.positions[i as usize]);
            let corners = world.map(|p| optics.world_from_lens().point_inverse(p));
            let way = light.way_to(world);
            // Mostly its corners tell enough: what is in view of it lies between them, no nearer and no farther. (A little more,
            // for rounding.)
            let beyond = corners.map(|p| optics.film_normal().dot(p) > 0.0);
            let is_told = beyond[0] == beyond[1]
                && beyond[1] == beyond[2]
                && 1.000_001 * way * frame.magnification(&corners) < threshold;
            if is_told {
                return false;
            }
            let corners = frame.in_view(corners);
            !corners.is_empty() && way * frame.magnification(&corners) >= threshold
        })
    }

    pub(super) fn new(scene: &Scene) -> Self {
        let (optics, surfaces) = (&scene.optics, &scene.surfaces);
        let (frame, light) = (Frame::new(scene), Light::of(scene));
        let empty = Part {
            materials: vec![false; surfaces.materials.len()],
            textured: vec![false; surfaces.materials.len()],
            anywhere: [0; 2].map(|_| vec![false; surfaces.materials.len()]),
            blur: [0.0, f64::INFINITY],
            shadow: 0.0,
            triangles: 0,
        };
        let of_chunk = |first: usize, triangles: &[[u32; 3]]| {
            let mut part = empty.clone();
            for (i, corners) in triangles.iter().enumerate() {
                let world = corners.map(|i| surfaces.positions[i as usize]);
                let corners = world.map(|p| optics.world_from_lens().point_inverse(p));
                let corners = frame.in_view(corners);
                for blur in frame.blurs(&corners) {
                    part.blur = [part.blur[0].max(blur), part.blur[1].min(blur)];
                }
                let is_in_view = !corners.is_empty();
                let attributes = &surfaces.attributes[first + i];
                let (material, is_textured) = (attributes.material as usize, attributes.texcoords[0] != NONE);
                part.anywhere[0][material] = true;
                part.anywhere[1][material] |= is_textured;
                if is_in_view {
                    part.materials[material] = true;
                    part.textured[material] |= is_textured;
                    part.triangles += 1;
                    if let Some(light) = &light {
                        part.shadow = part.shadow.max(light.way_to(world) * frame.magnification(&corners));
                    }
                }
            }
            part
        };
        const CHUNK: usize = 4096;
        let whole = surfaces
            .triangles
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, triangles)| of_chunk(chunk * CHUNK, triangles))
            .reduce(|| empty.clone(), Part::join);
        Self {
            materials: whole.materials,
            textured: whole.textured,
            anywhere: whole.anywhere,
            blur: (whole.triangles > 0).then_some(whole.blur),
            shadow: whole.shadow,
            triangles: whole.triangles,
        }
    }
}

impl Part {
    fn join(mut self, other: Self) -> Self {
        let either = |ours: &mut Vec<bool>, theirs: &[bool]| {
            ours.iter_mut().zip(theirs).for_each(|(ours, theirs)| *ours |= theirs);
        };
        either(&mut self.materials, &other.materials);
        either(&mut self.textured, &other.textured);
        self.anywhere.iter_mut().zip(&other.anywhere).for_each(|(ours, theirs)| either(ours, theirs));
        self.blur = [self.blur[0].max(other.blur[0]), self.blur[1].min(other.blur[1])];
        self.shadow = self.shadow.max(other.shadow);
        self.triangles += other.triangles;
        self
    }
}

/// The sun's direction, and the box of all that may stand before it.
struct Light {
    toward: DVec3,
    bounds: [DVec3; 2],
}

impl Light {
    /// None without a sun.
    fn of(scene: &Scene) -> Option<Self> {
        let sun = scene.sun.as_ref()?;
        Some(Self {
            toward: sun.toward.normalize_or_zero(),
            bounds: bounds(scene.surfaces.positions.iter().copied()),
        })
    }

    /// The longest way that light goes within the box to a point of a triangle, metres.
    fn way_to(&self, corners: [DVec3; 3]) -> f64 {
        let [low, high] = self.bounds;
        // To each side of the box: it grows evenly over the triangle, so that a corner has the most.
        let sides = (0..3).map(|axis| {
            let to = if self.toward[axis] > 0.0 { high[axis] } else { low[axis] };
            let ways = corners.map(|p| {
                if self.toward[axis] == 0.0 { f64::INFINITY } else { (to - p[axis]) / self.toward[axis] }
            });
            ways.into_iter().fold(0.0, f64::max)
        });
        sides.fold(f64::INFINITY, f64::min)
    }
}

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

/// The shorter side of a pixel, metres: a film may be as wide as it likes and its pixels as many.
pub(super) fn pixel(scene: &Scene) -> f64 {
    let (film, render) = (scene.optics.camera().film, &scene.render);
    (film.width.as_metres() / f64::from(render.width)).min(film.height.as_metres() / f64::from(render.height))
}

/// The camera, for points in lens space.
struct Frame<'a> {
    optics: &'a Optics,
    near: f64,
    /// How far from the middle of the film what is looked at may lie.
    around: [f64; 2],
    /// The shorter side of a pixel, metres.
    pixel: f64,
}

impl<'a> Frame<'a> {
    fn new(scene: &'a Scene) -> Self {
        let optics = &scene.optics;
        Self { optics, near: optics.camera().near.as_metres(), around: around(scene), pixel: pixel(scene) }
    }

    /// Corners of what is in view of a triangle: none where nothing is.
    fn in_view(&self, corners: [DVec3; 3]) -> Vec<DVec3> {
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
    fn blurs(&self, corners: &[DVec3]) -> impl Iterator<Item = f64> {
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
    fn magnification(&self, corners: &[DVec3]) -> f64 {
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
