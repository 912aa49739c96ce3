//! The blur of a point: the conic that the whole aperture's images of it fill.

use super::Optics;
use glam::{DVec2, DVec3};

/// The ellipse on the film in which the disk of the aperture images one object point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blur {
    /// Centre of the ellipse in the film frame, metres.
    pub center: [f64; 2],
    /// Largest diameter, metres.
    pub largest: f64,
    /// Smallest diameter, metres.
    pub smallest: f64,
    /// Unit direction of the largest diameter in the film frame.
    pub direction: [f64; 2],
}

impl Optics {
    /// The blur of an object point in lens space, in metres on the film.
    ///
    /// `None` where it is not an ellipse: the point is not in front of every lens point, so that some
    /// of the aperture's images of it are at infinity.
    pub fn blur_of(&self, point: DVec3) -> Option<Blur> {
        if self.a.dot(point) <= 0.0 {
            return None;
        }
        let (along, axis) = (self.n.dot(point), self.a.dot(point));
        if along >= 0.0 {
            return None;
        }
        // Homogeneous film points are affine in the lens point s. Less the central image P, of weight -n.x, they are
        //     Q_s - P w_s = sigma ((n.s) x / (n.x) - s),   sigma = S.x: 0 on the plane of focus,
        // so that a blur far smaller than its place on the film keeps its digits: nothing is subtracted.
        let focus = self.focus_plane();
        let sigma = (focus.m.dot(point) + focus.e) / -along;
        let edge = |s: DVec3| {
            let ns = self.n.dot(s);
            let p = point * (ns / along) - s;
            DVec3::new(self.fx.dot(p), self.fy.dot(p), ns * (1.0 - axis / self.f) / -along)
        };
        let (u, v) = (edge(self.ex * self.radius), edge(self.ey * self.radius));
        // The dual conic of the image of the unit circle, u u^T + v v^T - (0, 0, 1) (0, 0, 1)^T; sigma is a scale.
        let slope = libm::hypot(u.z, v.z);
        let k = (1.0 - slope) * (1.0 + slope);
        if k.is_nan() || k <= 0.0 {
            return None;
        }
        let (cx, cy) = (-(u.x * u.z + v.x * v.z) / k, -(u.y * u.z + v.y * v.z) / k);
        let sxx = cx * cx + (u.x * u.x + v.x * v.x) / k;
        let sxy = cx * cy + (u.x * u.y + v.x * v.y) / k;
        let syy = cy * cy + (u.y * u.y + v.y * v.y) / k;
        let large = 0.5 * (sxx + syy) + libm::hypot(0.5 * (sxx - syy), sxy);
        // The product of the roots is the determinant, which is that of u, v and (0, 0, 1) squared over k^3.
        let area = (u.x * v.y - u.y * v.x).abs() / (k * k.sqrt());
        let largest = large.max(0.0).sqrt();
        let smallest = if largest > 0.0 { area / largest } else { 0.0 };
        let angle = 0.5 * libm::atan2(2.0 * sxy, sxx - syy);
        let center = point * (self.e / -along) - self.film_center;
        Some(Blur {
            center: [self.fx.dot(center) + sigma * cx, self.fy.dot(center) + sigma * cy],
            largest: 2.0 * sigma.abs() * largest,
            smallest: 2.0 * sigma.abs() * smallest,
            direction: [libm::cos(angle), libm::sin(angle)],
        })
    }

    /// For many points: see [`BlurBound::at`].
    pub(crate) fn blur_bound(&self) -> BlurBound {
        let focus = self.focus_plane();
        let edge = |s: DVec3| DVec3::new(self.fx.dot(s), self.fy.dot(s), self.n.dot(s));
        BlurBound {
            normal: self.n,
            axis: self.a,
            power: 1.0 / self.f,
            film: [self.fx, self.fy],
            focus: (focus.m, focus.e),
            edges: [edge(self.ex * self.radius), edge(self.ey * self.radius)],
        }
    }

    /// `Q_s(X)` in the film frame: homogeneous `(x w, y w, w)`, for the lens point `s` and the object
    /// point `x`, both in lens space.
    pub(crate) fn film_image(&self, s: DVec3, x: DVec3) -> DVec3 {
        let focus = self.focus_plane();
        let ns = self.n.dot(s);
        let w = ns - self.n.dot(x) - ns * self.a.dot(x) / self.f;
        let q = (ns + self.e) * x - s * (focus.m.dot(x) + focus.e);
        let from_center = q - self.film_center * w;
        DVec3::new(self.fx.dot(from_center), self.fy.dot(from_center), w)
    }
}

/// What [`Optics::blur_of`] needs of a camera, ready for many points.
pub(crate) struct BlurBound {
    normal: DVec3,
    axis: DVec3,
    power: f64,
    film: [DVec3; 2],
    focus: (DVec3, f64),
    /// Of both half-axes of the aperture: along the film, and along its normal.
    edges: [DVec3; 2],
}

impl BlurBound {
    /// How far before the lens a point in lens space is, metres.
    pub(crate) fn depth(&self, point: DVec3) -> f64 {
        self.axis.dot(point)
    }

    /// No less than the largest diameter of [`Optics::blur_of`], nor more than `sqrt 2` times that, in a fraction of the time;
    /// infinite where there is no ellipse. In the terms used there, `2 |sigma| sqrt(sxx + syy)`.
    pub(crate) fn at(&self, point: DVec3) -> f64 {
        let (along, axis) = (self.normal.dot(point), self.axis.dot(point));
        let place = DVec2::new(self.film[0].dot(point), self.film[1].dot(point)) / along;
        let slope = (1.0 - axis * self.power) / -along;
        let [u, v] = self.edges.map(|edge| (place * edge.z - edge.truncate(), edge.z * slope));
        let k = 1.0 - (u.1 * u.1 + v.1 * v.1);
        if axis <= 0.0 || along >= 0.0 || k.is_nan() || k <= 0.0 {
            return f64::INFINITY;
        }
        let center = (u.0 * u.1 + v.0 * v.1) / k;
        let spread = (u.0.length_squared() + v.0.length_squared()) / k;
        let (m, e) = self.focus;
        2.0 * ((m.dot(point) + e) / along).abs() * (center.length_squared() + spread).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aperture, Camera, FilmSize, Standard};
    use crate::quantity::{Angle, FNumber, Length};

    #[test]
    fn a_bound_of_blur_is_none_too_small_nor_half_too_large() {
        let standard = |tilt: f64, swing: f64| Standard {
            tilt: Angle::degrees(tilt),
            swing: Angle::degrees(swing),
            ..Standard::default()
        };
        for (front, rear, f_number) in [((0.0, 0.0), (0.0, 0.0), 2.8), ((8.0, -3.0), (-12.0, 5.0), 1.2)] {
            let camera = Camera {
                rail: Camera::rail_frame(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap(),
                front: standard(front.0, front.1),
                rear: standard(rear.0, rear.1),
                extension: Length::millimetres(155.0),
                focal_length: Length::millimetres(150.0),
                aperture: Aperture::FNumber(FNumber::new(f_number).unwrap()),
                film: FilmSize { width: Length::millimetres(120.0), height: Length::millimetres(96.0) },
                near: Length::millimetres(10.0),
            };
            let optics = Optics::new(&camera).unwrap();
            let bound = optics.blur_bound();
            let mut seen = 0;
            for i in 0..3000 {
                let at = |step: f64| libm::fmod(f64::from(i) * step, 1.0) - 0.5;
                let point = DVec3::new(8.0 * at(0.618), 6.0 * at(0.413), -10.0 * (at(0.731) + 0.49));
                let most = bound.at(point);
                match optics.blur_of(point) {
                    Some(blur) => {
                        seen += 1;
                        assert!(most >= blur.largest * (1.0 - 1e-9), "{point}: {most} and {}", blur.largest);
                        assert!(most <= 1.415 * blur.largest + 1e-15, "{point}: {most} and {}", blur.largest);
                    }
                    None => assert_eq!(most, f64::INFINITY, "{point}"),
                }
            }
            assert!(seen > 1000);
        }
    }
}
