//! Depth of field as textbooks have it, to be compared with [`Optics::depth_of_field`] and the exact blur: the hinge rule's
//! limits of H. M. Merklinger, and the formula for a camera without movements.

use super::{DepthOfField, Optics};
use crate::geometry::Plane;

impl Optics {
    /// The limits of H. M. Merklinger, *Focusing the View Camera* (1993): planes through the hinge line that lie, measured
    /// parallel to the film, J to either side of the focus plane at the hyperfocal distance f A / c.
    ///
    /// They are [`Self::depth_of_field`] with the film's distance taken for the focal length: too wide a wedge by the ratio
    /// of the two. `None` as there.
    pub fn merklinger_limits(&self, c: f64) -> Option<DepthOfField> {
        if self.radius == 0.0 || !(c >= 0.0 && c.is_finite()) {
            return None;
        }
        let ratio = c / (2.0 * self.radius);
        // At film-normal distance z the offset is J z c / (f A), where the wedge has J z c / (d A).
        let share = ratio * -self.e / self.f;
        let limit = |scale: f64| Plane { m: self.n * scale - (self.e / self.f) * self.a, e: self.e };
        Some(DepthOfField { near: limit(1.0 - share), far: limit(1.0 + share) })
    }

    /// The limits of the formula for lens and film parallel, with the focus plane's distance D on the axis: planes square to
    /// the axis at D (H - f) / (H + D - 2f) and D (H - f) / (H - D), H = f A / c + f.
    ///
    /// `None` for a pinhole, where `c` is not positive and finite, and where the focus plane does not cross the axis beyond the focal length.
    pub fn untilted_limits(&self, c: f64) -> Option<DepthOfField> {
        let focus = self.focus_plane();
        let distance = -focus.e / focus.m.dot(self.a);
        if self.radius == 0.0 || !(c > 0.0 && c.is_finite()) || distance.is_nan() || distance <= self.f {
            return None;
        }
        let hyperfocal = self.f * 2.0 * self.radius / c + self.f;
        if distance.is_infinite() {
            // Focused at infinity: from H - f on.
            let near = Plane { m: self.a, e: -(hyperfocal - self.f) };
            return Some(DepthOfField { near, far: Plane { m: -self.a, e: -(hyperfocal - self.f) } });
        }
        let reach = -distance * (hyperfocal - self.f);
        // Without division, so that a far limit at or beyond infinity is no special case.
        Some(DepthOfField {
            near: Plane { m: self.a * (hyperfocal + distance - 2.0 * self.f), e: reach },
            far: Plane { m: self.a * (hyperfocal - distance), e: reach },
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::camera::{Camera, Standard};
    use crate::optics::Optics;
    use crate::quantity::{Angle, Length};
    use glam::DVec3;

    fn optics(tilt: f64, extension: f64) -> Optics {
        let camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z).unwrap();
        let front = Standard { tilt: Angle::degrees(tilt), ..Standard::default() };
        Optics::new(&Camera { front, extension: Length::millimetres(extension), ..camera }).unwrap()
    }

    #[test]
    fn without_movements_the_formula_is_exact() {
        let optics = optics(0.0, 153.0);
        let (found, exact) = (optics.untilted_limits(1e-4).unwrap(), optics.depth_of_field(1e-4).unwrap());
        for (a, b) in [(found.near, exact.near), (found.far, exact.far)] {
            let (a, b) = (a.normalized(), b.normalized());
            let (a, b) = (a.e / a.m.dot(optics.axis()), b.e / b.m.dot(optics.axis()));
            assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn merklingers_limits_tend_to_the_wedge_and_hold_the_hinge_line() {
        for (extension, within) in [(150.15, 2e-3), (151.5, 2e-2)] {
            let optics = optics(6.0, extension);
            let c = 1e-4;
            let (found, exact) = (optics.merklinger_limits(c).unwrap(), optics.depth_of_field(c).unwrap());
            let hinge = optics.hinge_line().nearest_to_origin();
            for plane in [found.near, found.far] {
                assert!(plane.normalized().evaluate(hinge).abs() / hinge.w < 1e-12);
            }
            // The wedge's half angle, in tangents of the offset from the focus plane.
            let focus = optics.focus_plane().m;
            let (a, b) = ((found.near.m - focus).length(), (exact.near.m - focus).length());
            assert!((a / b - 1.0).abs() < within, "{a} {b}");
        }
        // J to either side at the hyperfocal distance.
        let optics = optics(6.0, 160.0);
        let (c, f) = (1e-4, optics.focal_length());
        let hyperfocal = f * 2.0 * optics.aperture_radius() / c;
        let height = |plane: crate::geometry::Plane| {
            let at = plane.meet_ray(DVec3::NEG_Z * hyperfocal, DVec3::Y).to_affine();
            at.y
        };
        let limits = optics.merklinger_limits(c).unwrap();
        let j = optics.hinge_distance().unwrap();
        assert!(((height(limits.near) - height(optics.focus_plane())).abs() / j - 1.0).abs() < 1e-9);
    }
}
