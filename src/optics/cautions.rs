//! What a photographer should know before using a camera. In: optics. Out: sentences; and the lens's coverage.

use super::Optics;
use crate::geometry::Plane;

/// A lens that covers more than this from side to side is rare.
const WIDE_DEGREES: f64 = 105.0;

/// The cosine below which a plane is parallel to the axis but for rounding, and the focal lengths beyond which it lies at infinity.
const PARALLEL: f64 = 1e-9;
const INFINITE: f64 = 1e12;

impl Optics {
    /// Where a plane of lens space crosses the lens axis: metres before the lens centre, negative behind it (as a far limit of depth of field
    /// that lies beyond infinity); none where it is parallel to the axis or lies at infinity, but for rounding.
    pub fn axis_crossing(&self, plane: Plane) -> Option<f64> {
        let (along, size) = (plane.m.dot(self.axis()), plane.m.length());
        let is_parallel = along.abs() <= PARALLEL * size;
        let is_infinite = size * self.focal_length() * INFINITE <= plane.e.abs();
        let crossing = -plane.e / along;
        (!is_parallel && !is_infinite && crossing.is_finite()).then_some(crossing)
    }

    /// The largest angle from the lens axis to a film corner, radians, and the diameter of the image circle that the film needs,
    /// metres: of the cone about the axis with that angle, square to the axis where this meets the film; infinite where a corner lies
    /// beside or before the lens, or the axis does not meet the film's plane behind it.
    pub fn coverage(&self) -> (f64, f64) {
        let film = self.camera().film;
        let (w, h) = (0.5 * film.width.as_metres(), 0.5 * film.height.as_metres());
        let back = -self.axis();
        let off_axis = |(x, y): (f64, f64)| {
            let corner = self.film_point(x, y);
            libm::atan2(back.cross(corner).length(), back.dot(corner))
        };
        let angle = [(w, h), (w, -h), (-w, h), (-w, -h)].map(off_axis).into_iter().fold(0.0, f64::max);
        let distance = self.film_plane().e / self.film_normal().dot(self.axis());
        let is_a_circle = angle < std::f64::consts::FRAC_PI_2 && distance > 0.0 && distance.is_finite();
        (angle, if is_a_circle { 2.0 * distance * libm::tan(angle) } else { f64::INFINITY })
    }

    /// What is unusual about this camera, a sentence each: it can be computed, but hardly built or of use.
    pub fn cautions(&self) -> Vec<String> {
        let mut list = Vec::new();
        if self.film_reaches_aperture() {
            list.push("the film plane reaches the aperture: such a scene cannot be rendered".to_owned());
        }
        let (angle, _) = self.coverage();
        if 2.0 * angle.to_degrees() > WIDE_DEGREES {
            list.push(format!(
                "a corner of the film lies {:.2} degrees from the lens axis: hardly any lens has such an image circle",
                angle.to_degrees()
            ));
        }
        // The focus plane crosses the axis behind the lens: what lies before the lens on it is out of focus.
        let is_behind = self.axis_crossing(self.focus_plane()).is_some_and(|along| along < 0.0);
        // No film point has its sharp point before the lens, or at infinity.
        let is_nowhere = matches!(self.far_end(), (None, [least, _]) if least > 0.0);
        let caution = match (is_behind, is_nowhere) {
            (true, true) => {
                "the focus plane crosses the lens axis behind the lens: nothing in the picture is sharp"
            }
            (true, false) => "the focus plane crosses the lens axis behind the lens",
            (false, true) => {
                "nothing in the picture is sharp: the film sees the focus plane behind the lens alone"
            }
            (false, false) => return list,
        };
        list.push(caution.to_owned());
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aperture, Camera, FilmSize, Standard};
    use crate::quantity::{Angle, FNumber, Length};
    use glam::DVec3;

    fn optics(front_rise: f64, [front_tilt, rear_tilt]: [f64; 2]) -> Optics {
        let camera = Camera {
            rail: Camera::rail_frame(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap(),
            front: Standard {
                rise: Length::millimetres(front_rise),
                tilt: Angle::degrees(front_tilt),
                ..Standard::default()
            },
            rear: Standard { tilt: Angle::degrees(rear_tilt), ..Standard::default() },
            extension: Length::millimetres(150.0),
            focal_length: Length::millimetres(150.0),
            aperture: Aperture::FNumber(FNumber::new(5.6).unwrap()),
            film: FilmSize { width: Length::millimetres(120.0), height: Length::millimetres(96.0) },
            near: Length::millimetres(10.0),
        };
        Optics::new(&camera).unwrap()
    }

    #[test]
    fn planes_far_away_cross_the_axis_and_parallel_ones_do_not() {
        let optics = optics(0.0, [0.0; 2]);
        let crossing = |m: DVec3, e: f64| optics.axis_crossing(Plane { m, e });
        assert_eq!(crossing(DVec3::Z, 1e10), Some(1e10));
        assert_eq!(crossing(DVec3::Z * 2.0, -3.0), Some(-1.5));
        assert_eq!(crossing(DVec3::new(0.0, 1.0, 1e-10), 1.0), None);
        assert_eq!(crossing(DVec3::Z * 1e-17, 1.0), None);
        assert_eq!(crossing(DVec3::ZERO, 1.0), None);
    }

    #[test]
    fn the_image_circle_is_measured_square_to_the_lens_axis() {
        let of = |front_rise: f64, tilts: [f64; 2]| optics(front_rise, tilts).coverage();
        let near = |(angle, circle): (f64, f64), off: f64, back: f64| {
            assert!((angle - libm::atan2(off, back)).abs() < 1e-12, "{angle}");
            assert!((circle - 2.0 * 0.15 * off / back).abs() < 1e-12, "{circle}");
        };
        near(of(0.0, [0.0; 2]), libm::hypot(0.060, 0.048), 0.150);
        near(of(20.0, [0.0; 2]), libm::hypot(0.060, 0.068), 0.150);
        // The nearer corners of a leaning film decide: 48 mm along it.
        for tilt in [-30.0f64, 30.0] {
            let (sine, cosine) = libm::sincos(tilt.to_radians().abs());
            near(of(0.0, [0.0, tilt]), libm::hypot(0.060, 0.048 * cosine), 0.150 - 0.048 * sine);
        }
        // A corner before the lens.
        assert_eq!(of(0.0, [80.0, 0.0]).1, f64::INFINITY);
    }
}
