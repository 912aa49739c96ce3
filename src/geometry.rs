//! Planes as covectors, Plücker lines and poses: projective values in which infinity is ordinary.
//!
//! A plane `(m, e)` holds the points with `m.x + e = 0`; a line `(d, p x d)` those along `d` through
//! `p`. The plane at infinity is `(0, 1)`, a line at infinity has `d = 0`.

use glam::{DMat3, DVec3};

/// A homogeneous point `(x, w)`; `w = 0` is a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomogeneousPoint {
    /// The first three coordinates.
    pub xyz: DVec3,
    /// The weight.
    pub w: f64,
}

impl HomogeneousPoint {
    /// The finite point `x`.
    pub const fn finite(x: DVec3) -> Self {
        Self { xyz: x, w: 1.0 }
    }

    /// The affine point; not finite where the weight is 0.
    pub fn to_affine(self) -> DVec3 {
        self.xyz / self.w
    }
}

/// The plane of the points `x` with `m.x + e = 0`. Any non-zero scale is the same plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The normal, of any length; zero for the plane at infinity.
    pub m: DVec3,
    /// The offset.
    pub e: f64,
}

impl Plane {
    /// The plane at infinity.
    pub const AT_INFINITY: Self = Self { m: DVec3::ZERO, e: 1.0 };

    /// The plane through `point` with the given `normal` (any length).
    pub fn through(point: DVec3, normal: DVec3) -> Self {
        Self { m: normal, e: -normal.dot(point) }
    }

    /// `m.x + e w`: 0 on the plane.
    pub fn evaluate(self, point: HomogeneousPoint) -> f64 {
        self.m.dot(point.xyz) + self.e * point.w
    }

    /// Signed distance of `point`, positive on the side the normal points to.
    pub fn distance(self, point: DVec3) -> f64 {
        (self.m.dot(point) + self.e) / self.m.length()
    }

    /// Scaled to a unit normal; the plane at infinity becomes `(0, 0, 0, 1)`.
    ///
    /// A plane farther away than the largest double from the origin is the plane at infinity too.
    #[must_use]
    pub fn normalized(self) -> Self {
        // Scaled first, so that neither squares nor quotients overflow or vanish.
        let scale = self.m.abs().max_element();
        if scale == 0.0 {
            return Self::AT_INFINITY;
        }
        let (m, e) = (self.m / scale, self.e / scale);
        let length = m.length();
        let unit = Self { m: m / length, e: e / length };
        if unit.e.is_finite() { unit } else { Self::AT_INFINITY }
    }

    /// Where the line from `origin` along `direction` meets the plane, as a homogeneous point.
    pub fn meet_ray(self, origin: DVec3, direction: DVec3) -> HomogeneousPoint {
        let along = self.m.dot(direction);
        let at = self.m.dot(origin) + self.e;
        HomogeneousPoint { xyz: origin * along - direction * at, w: along }
    }

    /// Whether the plane is the one at infinity.
    pub fn is_at_infinity(self) -> bool {
        self.normalized().m == DVec3::ZERO
    }
}

/// A Plücker line: direction `d` and moment `p x d` for any of its points `p`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Along the line; zero for a line at infinity.
    pub direction: DVec3,
    /// `p x direction`; for a line at infinity, normal to all planes that hold it.
    pub moment: DVec3,
}

impl Line {
    /// The line in which two planes meet; all zero when they are one plane.
    pub fn meet(a: Plane, b: Plane) -> Self {
        Self { direction: a.m.cross(b.m), moment: a.e * b.m - b.e * a.m }
    }

    /// Scaled to a unit direction, or to a unit moment for a line at infinity.
    #[must_use]
    pub fn normalized(self) -> Self {
        let scale = self.direction.abs().max_element();
        if scale > 0.0 {
            let (d, m) = (self.direction / scale, self.moment / scale);
            let length = d.length();
            let unit = Self { direction: d / length, moment: m / length };
            if unit.moment.is_finite() {
                return unit;
            }
        }
        let scale = self.moment.abs().max_element();
        let m = if scale > 0.0 { self.moment / scale } else { self.moment };
        Self { direction: DVec3::ZERO, moment: if scale > 0.0 { m / m.length() } else { m } }
    }

    /// Whether the line lies in the plane at infinity.
    pub fn is_at_infinity(self) -> bool {
        self.normalized().direction == DVec3::ZERO
    }

    /// Distance from the origin; infinite for a line at infinity.
    pub fn distance_from_origin(self) -> f64 {
        let unit = self.normalized();
        if unit.direction == DVec3::ZERO { f64::INFINITY } else { unit.moment.length() }
    }

    /// The point nearest to the origin, as a homogeneous point.
    pub fn nearest_to_origin(self) -> HomogeneousPoint {
        HomogeneousPoint { xyz: self.direction.cross(self.moment), w: self.direction.length_squared() }
    }

    /// Where the line pierces `plane`; all zero when it lies in it.
    pub fn meet_plane(self, plane: Plane) -> HomogeneousPoint {
        HomogeneousPoint {
            xyz: plane.m.cross(self.moment) - plane.e * self.direction,
            w: plane.m.dot(self.direction),
        }
    }
}

/// An orthonormal frame in a parent space: `parent = origin + x X + y Y + z Z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where the frame's origin lies in the parent.
    pub origin: DVec3,
    /// The frame's axes as columns, in the parent.
    pub axes: DMat3,
}

impl Pose {
    /// A point of the frame, in the parent.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.origin + self.axes * p
    }

    /// A direction of the frame, in the parent.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.axes * v
    }

    /// A point of the parent, in the frame.
    pub fn point_inverse(&self, p: DVec3) -> DVec3 {
        self.axes.transpose() * (p - self.origin)
    }

    /// A direction of the parent, in the frame.
    pub fn vector_inverse(&self, v: DVec3) -> DVec3 {
        self.axes.transpose() * v
    }

    /// A plane of the frame, in the parent.
    pub fn plane(&self, plane: Plane) -> Plane {
        let m = self.axes * plane.m;
        Plane { m, e: plane.e - m.dot(self.origin) }
    }

    /// A plane of the parent, in the frame.
    pub fn plane_inverse(&self, plane: Plane) -> Plane {
        Plane { m: self.vector_inverse(plane.m), e: plane.e + plane.m.dot(self.origin) }
    }

    /// A line of the frame, in the parent.
    pub fn line(&self, line: Line) -> Line {
        let direction = self.axes * line.direction;
        Line { direction, moment: self.axes * line.moment + self.origin.cross(direction) }
    }
}

/// The part of a convex polygon where an affine function is not negative.
pub(crate) fn clip(polygon: Vec<DVec3>, side: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_meet_in_a_line_that_lies_in_both() {
        let a = Plane::through(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.2, 1.0, -0.4));
        let b = Plane::through(DVec3::new(-2.0, 0.5, 1.0), DVec3::new(1.0, 0.1, 0.3));
        let line = Line::meet(a, b);
        let point = line.nearest_to_origin();
        assert!(a.evaluate(point).abs() < 1e-12 && b.evaluate(point).abs() < 1e-12);
        assert!(line.direction.dot(line.moment).abs() < 1e-12);
        let pierced = line.meet_plane(Plane { m: DVec3::Z, e: -5.0 }).to_affine();
        assert!((pierced.z - 5.0).abs() < 1e-12 && a.distance(pierced).abs() < 1e-12);
    }

    #[test]
    fn parallel_planes_meet_at_infinity() {
        let line = Line::meet(Plane { m: DVec3::Z, e: 1.0 }, Plane { m: DVec3::Z, e: -2.0 });
        assert!(line.is_at_infinity());
        assert_eq!(line.normalized().moment.length(), 1.0);
        assert_eq!(line.distance_from_origin(), f64::INFINITY);
    }

    #[test]
    fn poses_carry_planes_and_lines_both_ways() {
        let axes = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
        let pose = Pose { origin: DVec3::new(1.0, -2.0, 0.5), axes };
        let plane = Plane::through(DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, 2.0, 2.0));
        let back = pose.plane_inverse(pose.plane(plane));
        assert!((back.m - plane.m).length() < 1e-14 && (back.e - plane.e).abs() < 1e-14);
        let line = Line::meet(plane, Plane { m: DVec3::Z, e: 0.0 });
        let moved = pose.line(line).nearest_to_origin().to_affine();
        assert!(pose.plane(plane).distance(moved).abs() < 1e-14);
    }

    #[test]
    fn extreme_scales_survive_normalising() {
        let huge = Plane { m: DVec3::new(1e300, 1e300, 0.0), e: 1e300 }.normalized();
        assert!((huge.m.length() - 1.0).abs() < 1e-15);
        assert!(Plane { m: DVec3::new(0.0, 1e-310, 0.0), e: 1.0 }.is_at_infinity());
    }
}
