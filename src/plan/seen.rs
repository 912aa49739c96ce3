//! What a picture shows, as far as a plan must know: which materials, and how blurred. Bounds, found from corners of
//! triangles without drawing: nothing that is seen is missed, some that is hidden is counted. What is found once it is to `stop` tells
//! nothing.

use super::frame::Frame;
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
    pub(super) fn has_blur_of(scene: &Scene, threshold: f64, stop: Stop<'_>) -> bool {
        let (optics, surfaces) = (&scene.optics, &scene.surfaces);
        let (frame, bound) = (Frame::new(scene), optics.blur_bound());
        any(surfaces.triangles.len(), stop, |t| {
            let corners = surfaces.corners(t).map(|p| optics.world_from_lens().point_inverse(p));
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
    pub(super) fn has_shadow_of(scene: &Scene, threshold: f64, stop: Stop<'_>) -> bool {
        let (optics, surfaces) = (&scene.optics, &scene.surfaces);
        let (frame, light) = (Frame::new(scene), Light::of(scene));
        let Some(light) = light else { return false };
        any(surfaces.triangles.len(), stop, |t| {
            let world = surfaces.corners(t);
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

    pub(super) fn new(scene: &Scene, stop: Stop<'_>) -> Self {
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
        let of_chunk = |chunk: std::ops::Range<usize>| {
            let mut part = empty.clone();
            for t in chunk {
                let world = surfaces.corners(t);
                let corners = frame.in_view(world.map(|p| optics.world_from_lens().point_inverse(p)));
                for blur in frame.blurs(&corners) {
                    part.blur = [part.blur[0].max(blur), part.blur[1].min(blur)];
                }
                let is_in_view = !corners.is_empty();
                let attributes = &surfaces.attributes[t];
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
        let count = surfaces.triangles.len();
        let whole = (0..count)
            .into_par_iter()
            .step_by(CHUNK)
            .filter(|_| !stop())
            .map(|first| of_chunk(first..(first + CHUNK).min(count)))
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

/// Triangles between two looks at whether to stop: some milliseconds.
pub(super) const CHUNK: usize = 4096;

pub(super) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Whether any of so many triangles `has` it, or it is to stop.
fn any(triangles: usize, stop: Stop<'_>, has: impl Fn(usize) -> bool + Sync) -> bool {
    let chunk = |first: usize| first..(first + CHUNK).min(triangles);
    (0..triangles).into_par_iter().step_by(CHUNK).any(|first| stop() || chunk(first).any(&has))
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

/// How wide the sun's disk is at a distance of one; 0 without a sun.
pub(super) fn sun_width(scene: &Scene) -> f64 {
    let half = scene.sun.as_ref().map_or(0.0, |sun| 0.5 * sun.angular_diameter.as_radians());
    2.0 * libm::tan(half.min(1.5))
}

/// The sun's direction, how wide its disk is at a distance of one, and the box of all that may stand before it.
pub(super) struct Light {
    pub(super) toward: DVec3,
    pub(super) width: f64,
    bounds: [DVec3; 2],
}

impl Light {
    /// None without a sun.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let sun = scene.sun.as_ref()?;
        Some(Self {
            toward: sun.toward.normalize_or_zero(),
            width: sun_width(scene),
            bounds: bounds(scene.surfaces.positions.iter().copied()),
        })
    }

    /// The longest way that light goes within the box to a point of a triangle, metres.
    pub(super) fn way_to(&self, corners: [DVec3; 3]) -> f64 {
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
