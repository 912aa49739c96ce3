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
        // Homogeneous film points are affine in the lens point: c0 + u cu + v cv over the unit disk.
        let image = |u: f64, v: f64| self.film_image(self.lens_point(u, v) * self.radius, point);
        let c0 = image(0.0, 0.0);
        if c0.z <= 0.0 {
            return None;
        }
        let (px, py) = (c0.x / c0.z, c0.y / c0.z);
        // Relative to the central image, where the small differences keep their digits.
        let relative = |c: DVec3| DVec3::new(c.x - px * c.z, c.y - py * c.z, c.z);
        let cu = relative(image(1.0, 0.0) - c0);
        let cv = relative(image(0.0, 1.0) - c0);
        // The dual conic of the image of the unit circle: cu cu^T + cv cv^T - c0 c0^T.
        let k = cu.z * cu.z + cv.z * cv.z - c0.z * c0.z;
        if k >= 0.0 {
            return None;
        }
        let cx = (cu.x * cu.z + cv.x * cv.z) / k;
        let cy = (cu.y * cu.z + cv.y * cv.z) / k;
        let sxx = cx * cx - (cu.x * cu.x + cv.x * cv.x) / k;
        let sxy = cx * cy - (cu.x * cu.y + cv.x * cv.y) / k;
        let syy = cy * cy - (cu.y * cu.y + cv.y * cv.y) / k;
        let mean = 0.5 * (sxx + syy);
        let spread = libm::hypot(0.5 * (sxx - syy), sxy);
        let large = mean + spread;
        // The product of the roots is the determinant; mean - spread would cancel.
        let small = if large > 0.0 { (sxx * syy - sxy * sxy).max(0.0) / large } else { 0.0 };
        let angle = 0.5 * libm::atan2(2.0 * sxy, sxx - syy);
        Some(Blur {
            center: [px + cx, py + cy],
            largest: 2.0 * large.max(0.0).sqrt(),
            smallest: 2.0 * small.sqrt(),
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
