//! The blur of a point: the conic that the whole aperture's images of it fill.

use super::Optics;
use glam::DVec3;

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
