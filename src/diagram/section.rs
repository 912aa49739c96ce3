//! The section plane of a figure. In: the optics. Out: a plane through the lens centre with the page's right
//! and up, and what planes and lines leave in it.
//!
//! The section that holds both plane normals shows every plane of the pencil as a line in true angle and the
//! Scheimpflug and hinge lines as points. The viewer stands on the rail's +x side and sees the subject to the
//! right (side view), or above the camera (top view, camera's left up the page).

use crate::geometry::{Line, Plane, Pose};
use crate::optics::Optics;
use glam::DVec3;

/// Which section through the lens centre a figure shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Section {
    /// The plane that holds the normals of lens and film: a side view for tilt, a top view for swing, oblique
    /// for both.
    #[default]
    Auto,
    /// The rail's vertical plane; before a subject, the world's up is up the page.
    Side,
    /// The rail's horizontal plane.
    Top,
}

/// How a section plane stands to the rail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum View {
    Side,
    Top,
    Oblique,
}

impl View {
    /// In words.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Side => "side view",
            Self::Top => "top view",
            Self::Oblique => "oblique section",
        }
    }
}

/// A section plane through the lens centre, in lens space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SectionPlane {
    /// Page right: the rail's way to the subject as the section shows it.
    pub(crate) u: DVec3,
    /// Page up.
    pub(crate) v: DVec3,
    /// Toward the viewer.
    pub(crate) normal: DVec3,
    pub(crate) view: View,
    /// Whether it is a side view that shows the rail level, though the camera looks up or down.
    pub(crate) rail_level: bool,
}

/// What a line leaves in the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pierce {
    /// It is cut in this point (section metres).
    At([f64; 2]),
    /// The line is at infinity.
    AtInfinity,
    /// It runs beside the section and never meets it.
    Parallel,
    /// It lies in the section: a point and a direction.
    Within([f64; 2], [f64; 2]),
}

/// Sines below this are rounding of directions, not angles.
const PARALLEL: f64 = 4.0 * f64::EPSILON;
/// A direction this near to the section counts as within it: over any page that is under 1e-6 mm.
const WITHIN: f64 = 1e-9;

impl SectionPlane {
    pub(crate) fn new(optics: &Optics, choice: Section) -> Self {
        match choice {
            Section::Side => Self::square_to(DVec3::X),
            Section::Top => Self::square_to(DVec3::Y),
            Section::Auto => Self::holding(optics.film_normal(), optics.axis()),
        }
    }

    /// The section that holds two directions, in which what is square to both is a point; where they are parallel, the one
    /// that holds them and the rail.
    pub(crate) fn holding(n: DVec3, a: DVec3) -> Self {
        let square = n.cross(a);
        let s = if square.length() > PARALLEL {
            square / square.length()
        } else {
            let square = n.cross(DVec3::Z);
            if square.length() > PARALLEL { square / square.length() } else { DVec3::X }
        };
        let toward_viewer = if s.x.abs() >= s.y.abs() { s.x } else { s.y };
        Self::square_to(if toward_viewer < 0.0 { -s } else { s })
    }

    /// The section with this unit normal, which is not along the rail.
    fn square_to(normal: DVec3) -> Self {
        // The rail cannot be square to the section: both standards face forward.
        let forward = DVec3::NEG_Z - normal * normal.dot(DVec3::NEG_Z);
        let u = forward / forward.length();
        let v = normal.cross(u);
        let view = if normal.x >= 1.0 - WITHIN {
            View::Side
        } else if normal.y >= 1.0 - WITHIN {
            View::Top
        } else {
            View::Oblique
        };
        Self { u, v, normal, view, rail_level: false }
    }

    /// What it shows and from where, in words.
    pub(crate) fn name(&self) -> &'static str {
        if self.rail_level { "side view, rail level" } else { self.view.name() }
    }

    /// A side view turned in its plane until the world's `up` is up the page: the ground is level, what stands on it
    /// stands. Where the camera looks more up or down than ahead it stays as it is.
    pub(crate) fn upright(self, world_from_lens: &Pose, up: DVec3) -> Self {
        let up = world_from_lens.vector_inverse(up);
        let up = up - self.normal * self.normal.dot(up);
        let v = up / up.length();
        let u = v.cross(self.normal);
        let looks_ahead = u.dot(self.u) > std::f64::consts::FRAC_1_SQRT_2;
        if self.view == View::Side && looks_ahead { Self { u, v, ..self } } else { self }
    }

    /// The same section, told when it shows the rail level and the world's `up` is more than a degree from up the page.
    pub(crate) fn told(self, world_from_lens: &Pose, up: DVec3) -> Self {
        let up = world_from_lens.vector_inverse(up);
        let leans = self.v.dot(up / up.length()) < libm::cos(1f64.to_radians());
        Self { rail_level: self.view == View::Side && leans, ..self }
    }

    /// Page right and up of a vector, its part square to the section dropped.
    pub(crate) fn project(&self, p: DVec3) -> [f64; 2] {
        [self.u.dot(p), self.v.dot(p)]
    }

    /// The trace `(mu, mv, e)` of a plane: the section points with `mu u + mv v + e = 0`.
    pub(crate) fn trace(&self, plane: Plane) -> [f64; 3] {
        [self.u.dot(plane.m), self.v.dot(plane.m), plane.e]
    }

    /// Whether a direction lies in the section.
    pub(crate) fn holds(&self, direction: DVec3) -> bool {
        self.normal.dot(direction).abs() <= WITHIN * direction.length()
    }

    pub(crate) fn pierce(&self, line: Line) -> Pierce {
        let unit = line.normalized();
        if unit.direction == DVec3::ZERO {
            return Pierce::AtInfinity;
        }
        if self.holds(unit.direction) {
            let near = unit.direction.cross(unit.moment);
            let beside = self.normal.dot(near).abs();
            return if beside <= WITHIN * near.length() {
                Pierce::Within(self.project(near), self.project(unit.direction))
            } else {
                Pierce::Parallel
            };
        }
        let at = unit.meet_plane(Plane { m: self.normal, e: 0.0 });
        Pierce::At(self.project(at.to_affine()))
    }
}
