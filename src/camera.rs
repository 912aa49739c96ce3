//! The view camera as a mechanism: standards, rail, lens and film. No optics.
//!
//! Frames (`x` right, `y` up, `-z` toward the subject in the rail frame):
//!
//! ```text
//!        film standard (rear)          lens standard (front)
//!              |                              |
//!     n  <-----|  F = (shift, rise, extension)|-----> a      C = (shift, rise, 0)
//!              |                              |
//!              +------------ rail ------------+   -z: subject
//! ```

use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::quantity::{Angle, FNumber, Length};
use glam::{DMat3, DVec3};

/// The movements of one standard.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standard {
    /// Positive leans the top of the standard toward the subject.
    pub tilt: Angle,
    /// Positive turns the subject side of the standard to the right.
    pub swing: Angle,
    /// Along the rail's +y, before the rotation.
    pub rise: Length,
    /// Along the rail's +x, before the rotation.
    pub shift: Length,
}

impl Standard {
    /// `Ry(-swing) Rx(-tilt)`: columns are the standard's axes in the rail frame.
    pub fn rotation(&self) -> DMat3 {
        let (st, ct) = self.tilt.sin_cos();
        let (ss, cs) = self.swing.sin_cos();
        DMat3::from_cols(
            DVec3::new(cs, 0.0, ss),
            DVec3::new(ss * st, ct, -cs * st),
            DVec3::new(-ss * ct, st, cs * ct),
        )
    }

    /// The same standard turned so that its third axis, which points from subject to film, lies
    /// along `z` (rail frame, any length).
    #[must_use]
    pub fn turned_to(&self, z: DVec3) -> Self {
        Self {
            tilt: Angle::radians(libm::atan2(z.y, libm::hypot(z.x, z.z))),
            swing: Angle::radians(libm::atan2(-z.x, z.z)),
            ..*self
        }
    }

    fn offset(&self) -> DVec3 {
        DVec3::new(self.shift.as_metres(), self.rise.as_metres(), 0.0)
    }
}

/// The size of the film: landscape when `width > height`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmSize {
    /// Along the film's `fx`.
    pub width: Length,
    /// Along the film's `fy`.
    pub height: Length,
}

/// Film formats by name, landscape, width and height in millimetres.
pub const FILM_FORMATS: [(&str, f64, f64); 8] = [
    ("35mm", 36.0, 24.0),
    ("645", 56.0, 41.5),
    ("6x6", 56.0, 56.0),
    ("6x7", 70.0, 56.0),
    ("6x9", 84.0, 56.0),
    ("4x5", 120.0, 96.0),
    ("5x7", 171.0, 121.0),
    ("8x10", 245.0, 194.0),
];

impl FilmSize {
    /// A format by its name, such as `4x5`; `4x5-portrait` is turned by a right angle.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when no such format is known; the error lists those that are.
    pub fn named(name: &str) -> Result<Self> {
        let (base, portrait) = match name.strip_suffix("-portrait") {
            Some(base) => (base, true),
            None => (name, false),
        };
        let Some(&(_, long, short)) = FILM_FORMATS.iter().find(|format| format.0 == base) else {
            let known: Vec<_> = FILM_FORMATS.iter().map(|format| format.0).collect();
            return Err(Error::invalid(format!("unknown film format `{name}`"))
                .remedy(format!("known: {}, each also with -portrait", known.join(", "))));
        };
        let (width, height) = if portrait { (short, long) } else { (long, short) };
        Ok(Self { width: Length::millimetres(width), height: Length::millimetres(height) })
    }

    /// Diameter of the circle of confusion that is usual for it: 1/1500 of the diagonal, metres.
    pub(crate) fn usual_circle(&self) -> f64 {
        self.diagonal() / 1500.0
    }

    /// Length of the diagonal in metres.
    pub fn diagonal(&self) -> f64 {
        libm::hypot(self.width.as_metres(), self.height.as_metres())
    }
}

/// How wide the lens is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aperture {
    /// A point: everything is sharp, and there is no depth of field to speak of.
    Pinhole,
    /// A disk of diameter focal length / f-number.
    FNumber(FNumber),
}

/// A view camera set up: where its rail stands and how its standards are moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The rail frame in the world: origin at the eye, `-z` toward the subject.
    pub rail: Pose,
    /// The standard that carries the lens.
    pub front: Standard,
    /// The standard that carries the film.
    pub rear: Standard,
    /// From lens to film along the rail; positive.
    pub extension: Length,
    /// Focal length; positive.
    pub focal_length: Length,
    /// The aperture.
    pub aperture: Aperture,
    /// Size of the film.
    pub film: FilmSize,
    /// Nearest distance, along the lens axis, that the lens sees.
    pub near: Length,
}

impl Camera {
    /// A camera at `eye` whose rail points at `target` (world, metres; +y is up): 4x5 inch film, a 150 mm lens at
    /// f/5.6 focused at infinity, no movements. Change what should differ; every field is public.
    ///
    /// # Errors
    /// As [`Camera::rail_frame`].
    ///
    /// # Example
    /// ```
    /// use groundglass::{Angle, Camera, Standard, glam::DVec3};
    ///
    /// let mut camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 1.6, 0.0))?;
    /// camera.front = Standard { tilt: Angle::degrees(6.0), ..Standard::default() };
    /// # Ok::<(), groundglass::Error>(())
    /// ```
    pub fn looking_at(eye: DVec3, target: DVec3) -> Result<Self> {
        let focal_length = Length::millimetres(150.0);
        Ok(Self {
            rail: Self::rail_frame(eye, target, DVec3::Y)?,
            front: Standard::default(),
            rear: Standard::default(),
            extension: focal_length,
            focal_length,
            aperture: Aperture::FNumber(FNumber::new(5.6)?),
            film: FilmSize::named("4x5")?,
            near: Length::millimetres(15.0),
        })
    }

    /// The rail frame of a camera at `eye` that looks at `look_at`, world coordinates in metres; `up` need not be unit or square
    /// to the view.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when `eye` and `look_at` coincide, `up` is zero or parallel to the view, or a number is not finite.
    pub fn rail_frame(eye: DVec3, look_at: DVec3, up: DVec3) -> Result<Pose> {
        for (name, value) in [("eye_m", eye), ("look_at_m", look_at), ("up", up)] {
            if !value.is_finite() {
                return Err(Error::invalid("not a finite number").at_key(name));
            }
        }
        let apart = eye - look_at;
        // The difference of two of the largest doubles is none.
        let apart = if apart.is_finite() { apart } else { 0.5 * eye - 0.5 * look_at };
        let back = unit(apart).ok_or_else(|| {
            Error::invalid("the camera looks at its own place")
                .at_key("look_at_m")
                .remedy("give look_at_m another point than eye_m")
        })?;
        let up = unit(up).ok_or_else(|| {
            Error::invalid("a zero direction").at_key("up").remedy("for example up = [0, 1, 0]")
        })?;
        let across = up.cross(back);
        // Below this the direction of `right` is rounding noise.
        let right = if across.length() < 1e-12 { None } else { unit(across) };
        let right = right.ok_or_else(|| {
            Error::invalid("up is parallel to the view").at_key("up").remedy(
                "choose an up that is not along look_at_m - eye_m, for example [0, 0, -1] when looking down",
            )
        })?;
        Ok(Pose { origin: eye, axes: DMat3::from_cols(right, back.cross(right), back) })
    }

    /// Aperture diameter in metres; 0 for a pinhole.
    pub fn aperture_diameter(&self) -> f64 {
        match self.aperture {
            Aperture::Pinhole => 0.0,
            Aperture::FNumber(number) => self.focal_length.as_metres() / number.get(),
        }
    }

    /// The lens frame in the world: `ex`, `ey` and, third, `-a`.
    pub fn lens_frame(&self) -> Pose {
        Pose { origin: self.rail.point(self.front.offset()), axes: self.rail.axes * self.front.rotation() }
    }

    /// The film frame in the world: `fx`, `fy` and the normal `n`, which points away from the subject.
    pub fn film_frame(&self) -> Pose {
        Pose {
            origin: self.rail.point(self.rear.offset() + DVec3::Z * self.extension.as_metres()),
            axes: self.rail.axes * self.rear.rotation(),
        }
    }

    /// From the lens centre to the film centre, in rail axes (metres). Exact where the world's origin is far.
    pub fn film_from_lens(&self) -> DVec3 {
        self.rear.offset() - self.front.offset() + DVec3::Z * self.extension.as_metres()
    }
}

/// `v` scaled to length 1, without overflow; `None` for zero or a non-finite vector.
pub(crate) fn unit(v: DVec3) -> Option<DVec3> {
    let scale = v.abs().max_element();
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    // Twice, because the reciprocal of a denormal scale overflows.
    let scaled = v / scale;
    Some(scaled / scaled.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standard(tilt: f64, swing: f64) -> Standard {
        Standard { tilt: Angle::degrees(tilt), swing: Angle::degrees(swing), ..Standard::default() }
    }

    #[test]
    fn signs_are_those_of_the_contract() {
        let tilted = standard(10.0, 0.0).rotation() * DVec3::NEG_Z;
        assert!(tilted.y < 0.0 && tilted.z < 0.0, "the lens looks down");
        let swung = standard(0.0, 10.0).rotation() * DVec3::NEG_Z;
        assert!(swung.x > 0.0 && swung.z < 0.0, "the lens faces right");
        assert!((standard(10.0, 0.0).rotation() * DVec3::Z).y > 0.0, "the film's normal turns up");
    }

    #[test]
    fn turning_to_an_axis_is_the_inverse_of_rotation() {
        for (tilt, swing) in [(0.0, 0.0), (6.0, -8.0), (-45.0, 30.0), (89.9, 0.0), (1e-12, 0.0)] {
            let turned = standard(0.0, 0.0).turned_to(standard(tilt, swing).rotation().z_axis);
            assert!((turned.tilt.as_degrees() - tilt).abs() < 1e-11 * (1.0 + tilt.abs()));
            assert!((turned.swing.as_degrees() - swing).abs() < 1e-11 * (1.0 + swing.abs()));
        }
    }

    #[test]
    fn rail_frame_refuses_what_has_no_frame() {
        let frame = |eye, at, up| Camera::rail_frame(eye, at, up);
        assert!(frame(DVec3::ZERO, DVec3::ZERO, DVec3::Y).is_err());
        assert!(frame(DVec3::ZERO, DVec3::Y, DVec3::Y).is_err());
        assert!(frame(DVec3::ZERO, DVec3::Z, DVec3::ZERO).is_err());
        assert!(frame(DVec3::NAN, DVec3::Z, DVec3::Y).is_err());
        let rail = frame(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 1.6, 0.0), DVec3::Y).unwrap();
        assert_eq!(rail.axes, DMat3::IDENTITY);
    }

    #[test]
    fn films_have_names() {
        let film = FilmSize::named("4x5-portrait").unwrap();
        assert_eq!((film.width, film.height), (Length::millimetres(96.0), Length::millimetres(120.0)));
        // Picture areas as makers give them: 4x5 holders show 120 x 96 mm.
        for (name, width, height) in [
            ("35mm", 36.0, 24.0),
            ("645", 56.0, 41.5),
            ("6x6", 56.0, 56.0),
            ("6x7", 70.0, 56.0),
            ("6x9", 84.0, 56.0),
            ("4x5", 120.0, 96.0),
            ("5x7", 171.0, 121.0),
            ("8x10", 245.0, 194.0),
        ] {
            let film = FilmSize::named(name).unwrap();
            assert_eq!(
                (film.width.as_millimetres(), film.height.as_millimetres()),
                (width, height),
                "{name}"
            );
            let turned = FilmSize::named(&format!("{name}-portrait")).unwrap();
            assert_eq!((turned.width, turned.height), (film.height, film.width), "{name}");
        }
        assert!(FilmSize::named("4x6").unwrap_err().to_string().contains("4x5"));
    }
}
