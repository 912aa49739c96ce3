//! The optics of a [`Camera`]: thin lens, plane of sharp focus, Scheimpflug and hinge lines, depth of
//! field, blur, projection for one lens point, and the inverse: movements for a wanted plane.
//!
//! Everything is computed in the *lens space*: origin at the lens centre, axes those of the rail,
//! metres. So a camera a million metres from the world's origin loses nothing but what its own
//! coordinates lost, and a tilt of 1e-12 degrees keeps all its digits. Results in world coordinates
//! are made from these at the end.
//!
//! The formulas are those of the thin lens in homogeneous coordinates, in which planes and lines at
//! infinity are ordinary values. With `L(x, w) = (x, w - (a.x)/f)`, film plane `(n, e)`:
//!
//! * focus plane `S = L^T (n, e) = (n - (e/f) a, e)`;
//! * Scheimpflug rule: `S = (n, e) - (e/f) (a, 0)`, so film, lens and focus planes share a line;
//! * hinge rule (H. M. Merklinger, *Focusing the View Camera*, 1993): `S = (n, 0) - (e/f) (a, -f)`,
//!   so the film-parallel plane through the lens, the front focal plane and S share a line.

mod blur;
mod cautions;
mod diffraction;
mod products;
mod projection;
mod sensitivity;
mod solve;
mod textbook;

pub use blur::Blur;
pub use diffraction::WAVELENGTH;
pub use projection::{Projection, Ray};
pub use sensitivity::Sensitivity;
pub use solve::{Adjust, FocusTarget, Limit, Nearest, Unsolvable, solve, upright};

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::{HomogeneousPoint, Line, Plane, Pose};
use crate::quantity::{Angle, Length};
use glam::{DMat3, DVec3};

/// The near and far limits of depth of field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthOfField {
    /// The limit on the lens's side of the focus plane.
    pub near: Plane,
    /// The limit beyond the focus plane.
    pub far: Plane,
}

/// A camera and its optics. Planes, lines and vectors are in lens space unless a name says `world`.
#[derive(Clone, Debug)]
pub struct Optics {
    camera: Camera,
    world: Pose,
    f: f64,
    radius: f64,
    a: DVec3,
    ex: DVec3,
    ey: DVec3,
    n: DVec3,
    fx: DVec3,
    fy: DVec3,
    film_center: DVec3,
    e: f64,
}

/// Whether the numbers of a camera are what solving for extension, tilts and swings, too, needs.
///
/// # Errors
/// [`crate::error::ErrorKind::Invalid`], as [`Optics::new`].
fn check(camera: &Camera) -> Result<()> {
    let f = camera.focal_length.as_metres();
    if !(f > 0.0 && f.is_finite()) {
        return Err(
            Error::invalid("the focal length must be positive and finite").at_key("camera.focal_length_mm")
        );
    }
    let film = [camera.film.width, camera.film.height].map(Length::as_metres);
    if !film.iter().all(|&side| side > 0.0 && side.is_finite()) {
        return Err(
            Error::invalid("the sides of the film must be positive and finite").at_key("camera.film_mm")
        );
    }
    if !camera.aperture_diameter().is_finite() {
        return Err(Error::invalid("the aperture is wider than can be told").at_key("camera.f_number"));
    }
    let near = camera.near.as_metres();
    if !(near > 0.0 && near.is_finite()) {
        return Err(Error::invalid("the near distance must be positive and finite").at_key("camera.near_m"));
    }
    let Pose { origin, axes } = camera.rail;
    // Of what is not finite no such thing holds.
    let is_frame = (axes * axes.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-6);
    if !(origin.is_finite() && is_frame && axes.determinant() > 0.0) {
        return Err(Error::invalid("the rail has no place, or its axes are not a right-handed frame")
            .at_key("camera.eye_m")
            .remedy("make it by Camera::rail_frame"));
    }
    for (name, standard) in [("front", &camera.front), ("rear", &camera.rear)] {
        let slides = [standard.rise, standard.shift].map(Length::as_metres);
        let turns = [standard.tilt, standard.swing].map(Angle::as_degrees);
        if !slides.into_iter().chain(turns).all(f64::is_finite) {
            return Err(Error::invalid(format!("a movement of the {name} standard is no finite number"))
                .at_key(format!("camera.{name}")));
        }
    }
    Ok(())
}

/// Whether no standard faces backwards.
fn check_facing(camera: &Camera) -> Result<()> {
    for (name, standard) in [("front", &camera.front), ("rear", &camera.rear)] {
        let ahead = standard.rotation().z_axis.z;
        if ahead.is_nan() || ahead <= 0.0 {
            return Err(Error::no_solution(format!("the {name} standard faces backwards"))
                .at_key(format!("camera.{name}"))
                .remedy("keep tilt and swing within 90 degrees"));
        }
    }
    Ok(())
}

impl Optics {
    /// The optics of `camera`.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::NoSolution`] when a standard faces backwards, or the extension is not positive and finite;
    /// [`crate::error::ErrorKind::Invalid`] when the focal length, a side of the film or the near distance is not, the aperture is not
    /// finite, when a movement is not finite, and when the rail has no place or its axes are not those of a right-handed frame.
    pub fn new(camera: &Camera) -> Result<Self> {
        check(camera)?;
        let f = camera.focal_length.as_metres();
        let extension = camera.extension.as_metres();
        if !(extension > 0.0 && extension.is_finite()) {
            return Err(Error::no_solution(format!(
                "the film stands {} mm behind the lens: it must stand behind it, at a finite distance",
                camera.extension.as_millimetres()
            ))
            .at_key("camera.extension_mm")
            .remedy("give a positive extension_mm"));
        }
        check_facing(camera)?;
        let (front, rear) = (camera.front.rotation(), camera.rear.rotation());
        let film_center = camera.film_from_lens();
        let n = rear.z_axis;
        Ok(Self {
            world: Pose { origin: camera.lens_frame().origin, axes: camera.rail.axes },
            f,
            radius: 0.5 * camera.aperture_diameter(),
            a: -front.z_axis,
            ex: front.x_axis,
            ey: front.y_axis,
            n,
            fx: rear.x_axis,
            fy: rear.y_axis,
            film_center,
            e: -n.dot(film_center),
            camera: *camera,
        })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Lens space in the world.
    pub fn world_from_lens(&self) -> &Pose {
        &self.world
    }

    /// Focal length in metres.
    pub fn focal_length(&self) -> f64 {
        self.f
    }

    /// Radius of the aperture in metres; 0 for a pinhole.
    pub fn aperture_radius(&self) -> f64 {
        self.radius
    }

    /// The lens axis `a`: unit, toward the subject.
    pub fn axis(&self) -> DVec3 {
        self.a
    }

    /// The axes `ex`, `ey` of the lens plane.
    pub fn lens_axes(&self) -> (DVec3, DVec3) {
        (self.ex, self.ey)
    }

    /// The film's unit normal `n`, away from the subject.
    pub fn film_normal(&self) -> DVec3 {
        self.n
    }

    /// The axes `fx`, `fy` of the film.
    pub fn film_axes(&self) -> (DVec3, DVec3) {
        (self.fx, self.fy)
    }

    /// The centre of the film.
    pub fn film_center(&self) -> DVec3 {
        self.film_center
    }

    /// The film plane `(n, e)`; `e < 0` with the film behind the lens.
    pub fn film_plane(&self) -> Plane {
        Plane { m: self.n, e: self.e }
    }

    /// The lens plane `(a, 0)`.
    pub fn lens_plane(&self) -> Plane {
        Plane { m: self.a, e: 0.0 }
    }

    /// The plane parallel to the film through the lens centre, `(n, 0)`.
    pub fn film_parallel_plane(&self) -> Plane {
        Plane { m: self.n, e: 0.0 }
    }

    /// The front focal plane `(a, -f)`: its points have their images at infinity.
    pub fn front_focal_plane(&self) -> Plane {
        Plane { m: self.a, e: -self.f }
    }

    /// The plane of sharp focus `S = (n - (e/f) a, e)`.
    pub fn focus_plane(&self) -> Plane {
        self.pull_back(self.film_plane())
    }

    /// The Scheimpflug line: lens plane, film plane and focus plane share it.
    pub fn scheimpflug_line(&self) -> Line {
        Line { direction: self.n.cross(self.a), moment: self.e * self.a }
    }

    /// The hinge line: film-parallel plane, front focal plane and focus plane share it; focusing turns
    /// the focus plane about it.
    pub fn hinge_line(&self) -> Line {
        // (n, 0) meets (a, -f): no subtraction, so a tilt of 1e-12 degrees keeps its digits.
        Line { direction: self.n.cross(self.a), moment: self.f * self.n }
    }

    /// The distance from lens centre to hinge line, in metres; `None` when it is at infinity.
    pub fn hinge_distance(&self) -> Option<f64> {
        let across = self.n.cross(self.a);
        // Squares of sines below 1e-154 underflow.
        let largest = across.abs().max_element();
        let scale = if largest > 0.0 && largest < 1e-140 { largest } else { 1.0 };
        let sine = (across / scale).length();
        let distance = self.f / sine / scale;
        (sine > 0.0 && distance.is_finite()).then_some(distance)
    }

    /// Near and far planes, in lens space, for a circle of confusion of diameter `c` (metres, on the film), both the plane of sharp focus for
    /// 0; `None` for a pinhole, and where `c` is negative or not finite. How far they are from the lens, in metres along its axis, tells
    /// [`Optics::axis_crossing`]: a far limit beyond infinity crosses it behind the lens.
    ///
    /// They are conjugate to the film-parallel planes at `d / (1 -+ c/A)`, with `d` the distance of the film's plane from the lens centre
    /// and `A` the aperture's diameter, and exact for the image of that diameter of the aperture which is parallel to the film.
    pub fn depth_of_field(&self, c: f64) -> Option<DepthOfField> {
        if self.radius == 0.0 || !(c >= 0.0 && c.is_finite()) {
            return None;
        }
        let ratio = c / (2.0 * self.radius);
        // Scaled by 1 -+ c/A: no division, so c >= A (far limit beyond infinity) is no special case.
        let limit = |scale: f64| self.pull_back(Plane { m: self.n * scale, e: self.e });
        Some(DepthOfField { near: limit(1.0 - ratio), far: limit(1.0 + ratio) })
    }

    /// The thin lens as a collineation: the image point of an object point (both in lens space).
    pub fn image_of(&self, point: HomogeneousPoint) -> HomogeneousPoint {
        HomogeneousPoint { xyz: point.xyz, w: point.w - self.a.dot(point.xyz) / self.f }
    }

    /// The inverse of [`Self::image_of`]: the object point whose image lies at `point`.
    pub fn object_of(&self, point: HomogeneousPoint) -> HomogeneousPoint {
        HomogeneousPoint { xyz: point.xyz, w: point.w + self.a.dot(point.xyz) / self.f }
    }

    /// The plane of the object points whose images lie in `plane`.
    pub fn pull_back(&self, plane: Plane) -> Plane {
        let ratio = plane.e / self.f;
        if ratio.is_finite() {
            let m = plane.m - ratio * self.a;
            // Parallel to the lens and in its focal plane: turned standards leave a last bit, and a plane at 1e15 m that faces anywhere.
            let is_parallel = plane.m.cross(self.a) == DVec3::ZERO;
            let is_noise = m.length() <= 4.0 * f64::EPSILON * ratio.abs();
            return Plane { m: if is_parallel && is_noise { DVec3::ZERO } else { m }, e: plane.e };
        }
        // Any scale is the same plane: this one when the quotient overflows.
        let sign = 1f64.copysign(plane.e);
        Plane { m: plane.m * (self.f / plane.e.abs()) - sign * self.a, e: sign * self.f }
    }

    /// Whether the film plane reaches the aperture: some lens point has no film behind it.
    pub fn film_reaches_aperture(&self) -> bool {
        let slope = libm::hypot(self.n.dot(self.ex), self.n.dot(self.ey));
        let nearest = self.e + self.radius * slope;
        // A film that is nowhere is behind no lens point either.
        nearest.is_nan() || nearest >= 0.0
    }

    /// A lens point as a vector; `u`, `v` in metres along `ex`, `ey`.
    pub fn lens_point(&self, u: f64, v: f64) -> DVec3 {
        u * self.ex + v * self.ey
    }

    /// A film point; `x`, `y` in metres in the film frame.
    pub fn film_point(&self, x: f64, y: f64) -> DVec3 {
        self.film_center + x * self.fx + y * self.fy
    }
}
