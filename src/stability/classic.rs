//! The same questions as textbooks answer them, in double precision: angles by their cosines, J = f / sin, lengths by
//! 1/so + 1/si = 1/f, roots by the school's formula.

use super::formulas::FOCAL;
use glam::DVec3;

fn finite<const N: usize>(values: [f64; N]) -> Option<[f64; N]> {
    values.iter().all(|x| x.is_finite()).then_some(values)
}

fn axis(tilt: f64) -> DVec3 {
    let (s, c) = libm::sincos(tilt.to_radians());
    DVec3::new(0.0, -s, -c)
}

/// The angle between lens and film, by the cosine that a dot product gives.
fn angle(a: DVec3) -> f64 {
    libm::acos((-a.dot(DVec3::Z)).clamp(-1.0, 1.0))
}

/// Through the hinge line at J = f / sin, at tan(psi) = sin / (cos - f/d).
pub(super) fn focus_plane(tilt: f64, extension: f64) -> Option<[f64; 4]> {
    let angle = angle(axis(tilt));
    let psi = libm::atan2(libm::sin(angle), libm::cos(angle) - FOCAL / extension);
    let j = FOCAL / libm::sin(angle);
    finite([0.0, -libm::sin(psi), -libm::cos(psi), -libm::sin(psi) * j / FOCAL])
}

pub(super) fn hinge_distance(tilt: f64) -> Option<[f64; 1]> {
    finite([FOCAL / libm::sin(angle(axis(tilt)))])
}

/// The distance of the images through opposite points of the rim, each traced by itself.
pub(super) fn blur(tilt: f64, extension: f64, number: f64, point: [f64; 3]) -> Option<[f64; 1]> {
    let (a, x) = (axis(tilt), DVec3::from_array(point));
    let si = 1.0 / (1.0 / FOCAL - 1.0 / a.dot(x));
    let image = -x * (si / a.dot(x));
    let film = |s: DVec3| s + (image - s) * ((extension - s.z) / (image.z - s.z));
    let radius = 0.5 * FOCAL / number;
    let size = |s: DVec3| (film(s) - film(-s)).length();
    finite([size(DVec3::X * radius).max(size(DVec3::new(0.0, -a.z, a.y) * radius))])
}

/// J from the plane's lean and distance, the tilt by an arc sine, the extension by f / (cos - sin / tan(psi)).
pub(super) fn lens_for(normal: [f64; 3], distance: f64) -> Option<[f64; 2]> {
    let m = DVec3::from_array(normal).normalize();
    let psi = libm::acos(m.z.clamp(-1.0, 1.0));
    let j = distance * m.z / libm::sin(psi);
    let tilt = libm::asin(FOCAL / j);
    let extension = FOCAL / (libm::cos(tilt) - libm::sin(tilt) / libm::tan(psi));
    finite([libm::sin(tilt), extension])
}

/// The contract's quadratic by (-b + sqrt(b^2 - 4ac)) / 2a.
pub(super) fn film_for_level(tilt: f64, height: f64) -> Option<[f64; 1]> {
    let (m, g) = (DVec3::Y, -height);
    let (s, c) = libm::sincos(tilt.to_radians());
    let n = DVec3::new(0.0, s, c);
    let (square, half) = (1.0 - g * g / (FOCAL * FOCAL), n.dot(m));
    let root = (4.0 * half * half - 4.0 * square).sqrt();
    [root, -root].into_iter().find_map(|root| {
        let k = (2.0 * half + root) / (2.0 * square);
        let a = (n - k * m) * FOCAL / (k * g);
        let e = k * g;
        (a.dot(n) < 0.0 && e < 0.0).then(|| finite([-e])).flatten()
    })
}

/// A plain cross product.
pub(super) fn normal(points: [[f64; 3]; 3]) -> Option<[f64; 3]> {
    let [p, q, r] = points.map(DVec3::from_array);
    let n = (q - p).cross(r - p);
    let n = if n.z < 0.0 { -n } else { n };
    (n != DVec3::ZERO).then(|| finite(n.to_array())).flatten()
}
