//! What a first camera needs to know of a model. In: its triangles, in the model's own units; out: bounds, how
//! much of each side of the box is wall, the ground, and the outline of what stands on it.

use glam::DVec3;

/// How much of one side of the bounding box is covered by faces within 15% of the box from it, as seen square to
/// the side; more than 1 where they lie behind each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cover {
    /// By faces that look into the box.
    pub inward: f64,
    /// By faces that look out of it.
    pub outward: f64,
}

/// What [`scene_for`](super::starter::scene_for) needs to know of a model; lengths in the model's units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Least and greatest corner of the triangles.
    pub bounds: [DVec3; 2],
    /// For x, y, z: the lower and the upper side of the box.
    pub cover: [[Cover; 2]; 3],
    /// Height of the level ground or floor, where something stands on one.
    pub ground: Option<f64>,
    /// The model's plane, where all of it lies near one: a point and a unit normal.
    pub sheet: Option<[DVec3; 2]>,
    /// Outermost corners, in many directions, of what stands on the ground; of everything without one.
    pub outline: Vec<DVec3>,
}

/// Measures triangles (corners in the model's units, counter-clockwise seen from outside); `None` without any
/// or with a corner that is not finite.
pub fn measure(triangles: impl Iterator<Item = [DVec3; 3]> + Clone) -> Option<Statistics> {
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for corner in triangles.clone().flatten() {
        if !corner.is_finite() {
            return None;
        }
        bounds = [bounds[0].min(corner), bounds[1].max(corner)];
    }
    let size = bounds[1] - bounds[0];
    if !size.is_finite() {
        return None;
    }
    let mut cover = [[Cover::default(); 2]; 3];
    for corners in triangles.clone() {
        add_cover(&mut cover, corners, bounds);
    }
    let mut ground = ground(triangles.clone(), bounds);
    let mut outline = Outline::new();
    if let Some(level) = ground {
        let above = level + 0.01 * size.y;
        for corner in triangles.clone().filter(|t| t.iter().any(|p| p.y > above)).flatten() {
            outline.add(corner);
        }
    }
    if outline.points.is_empty() {
        ground = None;
        triangles.clone().flatten().for_each(|corner| outline.add(corner));
    }
    // The ground of a thin wall is its own edge.
    let is_sheet = |[_, normal]: &[DVec3; 2]| ground.is_none() || normal.y.abs() < 0.5;
    let sheet = sheet(triangles, bounds, &outline.points).filter(is_sheet);
    let ground = ground.filter(|_| sheet.is_none());
    Some(Statistics { bounds, cover, ground, sheet, outline: outline.points })
}

fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a) / 2.0
}

fn add_cover(cover: &mut [[Cover; 2]; 3], corners: [DVec3; 3], bounds: [DVec3; 2]) {
    let (area, size) = (area_vector(corners), bounds[1] - bounds[0]);
    for (axis, sides) in cover.iter_mut().enumerate() {
        let whole = size[(axis + 1) % 3] * size[(axis + 2) % 3];
        if whole <= 0.0 {
            continue;
        }
        for (side, (cover, sign)) in sides.iter_mut().zip([-1.0, 1.0]).enumerate() {
            if corners.iter().all(|p| (p[axis] - bounds[side][axis]).abs() <= 0.15 * size[axis]) {
                let out = sign * area[axis] / whole;
                cover.outward += out.max(0.0);
                cover.inward += (-out).max(0.0);
            }
        }
    }
}

/// The highest level in the lower third whose horizontal faces cover more than a third of the model's plan.
fn ground(triangles: impl Iterator<Item = [DVec3; 3]>, [lo, hi]: [DVec3; 2]) -> Option<f64> {
    const BINS: usize = 128;
    let size = hi - lo;
    let plan = size.x * size.z;
    // Covered area, and area and height of the largest face: a height that the file itself has.
    let mut levels = [(0.0, 0.0, lo.y); BINS];
    for corners in triangles {
        let area = area_vector(corners);
        if area.y.abs() < 0.9 * area.length() {
            continue;
        }
        let height = (corners[0].y + corners[1].y + corners[2].y) / 3.0;
        let bin = if size.y > 0.0 { (height - lo.y) / size.y * BINS as f64 } else { 0.0 };
        let level = &mut levels[(bin as usize).min(BINS - 1)];
        level.0 += area.y.abs();
        if area.y.abs() > level.1 {
            (level.1, level.2) = (area.y.abs(), corners[0].y);
        }
    }
    let low = &levels[..BINS / 3];
    low.iter().rev().find(|level| plan > 0.0 && level.0 > plan / 3.0).map(|level| level.2)
}

/// Centre and normal when nine tenths of the area look one way, or one way and the opposite in a model that is thin that way.
fn sheet(
    triangles: impl Iterator<Item = [DVec3; 3]> + Clone,
    [lo, hi]: [DVec3; 2],
    outline: &[DVec3],
) -> Option<[DVec3; 2]> {
    let scale = (hi - lo).max_element();
    let areas = triangles.map(|corners| area_vector(corners.map(|p| (p - lo) / scale)));
    let larger = |a: DVec3, b: DVec3| if b.length() > a.length() { b } else { a };
    let largest = areas.clone().fold(DVec3::ZERO, larger);
    let (mut sum, mut folded, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for area in areas {
        sum += area;
        folded += if area.dot(largest) < 0.0 { -area } else { area };
        total += area.length();
    }
    let of = |sum: DVec3| {
        let normal = sum / sum.length();
        (sum.length() > 0.9 * total && normal.is_finite()).then_some(normal)
    };
    let is_thin = |normal: &DVec3| {
        let along = outline.iter().map(|&p| normal.dot((p - lo) / scale));
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min) < THIN
    };
    let normal = of(sum).or_else(|| of(folded).filter(is_thin))?;
    Some([(lo + hi) / 2.0, normal])
}

/// Of the model's length, along the normal of a sheet whose faces look both ways.
const THIN: f64 = 0.02;

/// Outermost points along directions that cover the sphere evenly enough for a frame.
struct Outline {
    directions: Vec<DVec3>,
    points: Vec<DVec3>,
}

impl Outline {
    fn new() -> Self {
        let steps = || (-2..=2).map(f64::from);
        let all = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))));
        Self { directions: all.filter(|d| d.abs().max_element() == 2.0).collect(), points: Vec::new() }
    }

    fn add(&mut self, corner: DVec3) {
        if self.points.is_empty() {
            self.points = vec![corner; self.directions.len()];
        }
        for (direction, point) in self.directions.iter().zip(&mut self.points) {
            if direction.dot(corner) > direction.dot(*point) {
                *point = corner;
            }
        }
    }
}
