//! What textbooks give, in double precision: angles by arc cosines, distances by 1/so + 1/si = 1/f, lines by
//! dividing by a sine or a tangent. Only the camera's rotations are made as the library makes them.

use super::input::{Input, Key};
use super::oracle::Groups;
use super::wide::{Big, big, unit};
use glam::DVec3;
use groundglass::camera::Standard;
use groundglass::quantity::Angle;

struct Camera {
    f: f64,
    radius: f64,
    a: DVec3,
    ex: DVec3,
    ey: DVec3,
    n: DVec3,
    fx: DVec3,
    fy: DVec3,
    center: DVec3,
    /// Film distance along its normal.
    d: f64,
}

fn camera(input: &Input) -> Camera {
    let get = |key| input.get(key);
    let turn = |tilt, swing| {
        let (tilt, swing) = (Angle::degrees(get(tilt)), Angle::degrees(get(swing)));
        Standard { tilt, swing, ..Standard::default() }.rotation()
    };
    let (front, rear) = (turn(Key::FrontTilt, Key::FrontSwing), turn(Key::RearTilt, Key::RearSwing));
    let rise = get(Key::RearRise) - get(Key::FrontRise);
    let shift = get(Key::RearShift) - get(Key::FrontShift);
    let center = DVec3::new(shift, rise, get(Key::Extension)) * 0.001;
    let f = get(Key::Focal) * 0.001;
    Camera {
        f,
        radius: 0.5 * f / get(Key::Number),
        a: -front.z_axis,
        ex: front.x_axis,
        ey: front.y_axis,
        n: rear.z_axis,
        fx: rear.x_axis,
        fy: rear.y_axis,
        center,
        d: rear.z_axis.dot(center),
    }
}

fn bigs(values: &[f64]) -> Option<Vec<Big>> {
    values.iter().map(|&x| x.is_finite().then(|| big(x))).collect()
}

impl Camera {
    /// The angle between the standards by the arc cosine, and the direction in the film in which it opens.
    fn angle(&self) -> (f64, DVec3) {
        let cosine = -self.n.dot(self.a);
        let angle = libm::acos(cosine.clamp(-1.0, 1.0));
        (angle, (self.a + self.n * cosine) / libm::sin(angle))
    }

    /// The plane at tan(psi) = sin / (cos - f/d) through the hinge line at J = f / sin.
    fn plane(&self, d: f64) -> (DVec3, f64) {
        let (angle, along) = self.angle();
        let j = self.f / libm::sin(angle);
        let psi = libm::atan2(libm::sin(angle), libm::cos(angle) - self.f / d);
        (self.n * -libm::cos(psi) + along * libm::sin(psi), -libm::sin(psi) * j)
    }

    /// The image of a point by 1/so + 1/si = 1/f.
    fn image(&self, x: DVec3) -> DVec3 {
        let so = self.a.dot(x);
        let si = 1.0 / (1.0 / self.f - 1.0 / so);
        -x * (si / so)
    }

    /// Where the line from a lens point to the image meets the film.
    fn film(&self, s: DVec3, x: DVec3) -> [f64; 2] {
        let image = self.image(x);
        let along = (self.d - self.n.dot(s)) / self.n.dot(image - s);
        let from = s + (image - s) * along - self.center;
        [self.fx.dot(from), self.fy.dot(from)]
    }
}

fn four((m, e): (DVec3, f64), f: f64) -> Option<Vec<Big>> {
    Some(unit(bigs(&[m.x, m.y, m.z, e / f])?))
}

/// The line of two planes by their cross product.
fn meet(a: (DVec3, f64), b: (DVec3, f64), f: f64) -> Option<Vec<Big>> {
    let (d, m) = (a.0.cross(b.0), (b.0 * a.1 - a.0 * b.1) / f);
    Some(unit(bigs(&[d.x, d.y, d.z, m.x, m.y, m.z])?))
}

pub fn focus_plane(input: &Input) -> Option<Groups> {
    let c = camera(input);
    Some(vec![four(c.plane(c.d), c.f)?])
}

pub fn scheimpflug(input: &Input) -> Option<Groups> {
    let c = camera(input);
    Some(vec![meet(c.plane(c.d), (c.n, -c.d), c.f)?])
}

pub fn hinge(input: &Input) -> Option<Groups> {
    let c = camera(input);
    Some(vec![meet(c.plane(c.d), (c.n, 0.0), c.f)?])
}

pub fn hinge_distance(input: &Input) -> Option<Groups> {
    let c = camera(input);
    Some(vec![bigs(&[c.f / libm::sin(c.angle().0)])?])
}

pub fn limits(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let ratio = input.get(Key::C) / (2.0 * c.radius);
    let plane = |d: f64| four(c.plane(d), c.f);
    Some(vec![plane(c.d / (1.0 - ratio))?, plane(c.d / (1.0 + ratio))?])
}

fn lens_point(input: &Input, c: &Camera) -> DVec3 {
    c.ex * (input.get(Key::U) * c.radius) + c.ey * (input.get(Key::V) * c.radius)
}

pub fn film_point(input: &Input) -> Option<Groups> {
    let c = camera(input);
    Some(vec![bigs(&c.film(lens_point(input, &c), DVec3::from_array(input.three(Key::Px))))?])
}

/// Homogeneous coordinates are not of the textbooks: the ordinary point, with the depth along the axis as weight.
pub fn clip(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let p = DVec3::from_array(input.three(Key::Px));
    let [x, y] = c.film(lens_point(input, &c), p);
    let s = lens_point(input, &c);
    let w = c.n.dot(s - p) - c.n.dot(s) * c.a.dot(p) / c.f;
    Some(vec![bigs(&[x * w, y * w])?, bigs(&[w])?])
}

/// The largest and smallest distance of the images through opposite points of the rim.
pub fn blur(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let x = DVec3::from_array(input.three(Key::Px));
    let (mut large, mut small) = (0.0, f64::INFINITY);
    for i in 0..720 {
        let (sine, cosine) = libm::sincos(f64::from(i) * std::f64::consts::PI / 720.0);
        let s = (c.ex * cosine + c.ey * sine) * c.radius;
        let ([px, py], [qx, qy]) = (c.film(s, x), c.film(-s, x));
        let size = libm::hypot(px - qx, py - qy);
        (large, small) = (size.max(large), size.min(small));
    }
    Some(vec![bigs(&[large])?, bigs(&[small])?])
}

pub fn image(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let p = c.image(DVec3::from_array(input.three(Key::Px))) / c.f;
    Some(vec![unit(bigs(&[p.x, p.y, p.z, 1.0])?)])
}

fn axes(input: &Input) -> [DVec3; 3] {
    let vector = |key| DVec3::from_array(input.three(key));
    let back = (vector(Key::EyeX) - vector(Key::AtX)).normalize();
    let right = vector(Key::UpX).normalize().cross(back).normalize();
    [right, back.cross(right), back]
}

pub fn rail_frame(input: &Input) -> Option<Groups> {
    axes(input).map(|axis| bigs(&axis.to_array())).into_iter().collect()
}

/// One matrix from world to film, in world coordinates.
pub fn world_point(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let [right, up, back] = axes(input);
    let (p, eye) = (DVec3::from_array(input.three(Key::Px)), DVec3::from_array(input.three(Key::EyeX)));
    let x = DVec3::new(
        right.dot(p) - right.dot(eye) - 0.001 * input.get(Key::FrontShift),
        up.dot(p) - up.dot(eye) - 0.001 * input.get(Key::FrontRise),
        back.dot(p) - back.dot(eye),
    );
    Some(vec![bigs(&c.film(lens_point(input, &c), x))?])
}

pub fn distance(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let si = 1.0 / (1.0 / c.f - 1.0 / input.get(Key::C));
    let d = -c.n.dot(c.a) * si;
    let beside = DVec3::new(c.center.x, c.center.y, 0.0);
    Some(vec![bigs(&[(d - c.n.dot(beside)) / c.n.z])?])
}

fn wanted(input: &Input, points: bool) -> (DVec3, f64) {
    let [p, q, r] = [Key::Px, Key::Qx, Key::Rx].map(|key| DVec3::from_array(input.three(key)));
    let lens = DVec3::new(input.get(Key::FrontShift), input.get(Key::FrontRise), 0.0) * 0.001;
    let m = if points { (q - p).cross(r - p).normalize() } else { q.normalize() };
    (m, -m.dot(p - lens))
}

fn movements(c: &Camera, z: DVec3, n: DVec3, e: f64) -> Option<Groups> {
    let tilt = libm::asin(z.y).to_degrees();
    let swing = libm::atan(-z.x / z.z).to_degrees();
    let beside = DVec3::new(c.center.x, c.center.y, 0.0);
    Some(vec![bigs(&[tilt, swing])?, bigs(&[(-e - n.dot(beside)) / n.z])?])
}

/// The school's formula for the roots of the contract's quadratic.
fn front(input: &Input, points: bool) -> Option<Groups> {
    let c = camera(input);
    let (m, g) = wanted(input, points);
    let (square, half) = (m.length_squared() - g * g / (c.f * c.f), c.n.dot(m));
    for sign in [1.0, -1.0] {
        let k = (2.0 * half + sign * (4.0 * half * half - 4.0 * square).sqrt()) / (2.0 * square);
        let (a, e) = ((c.n - k * m) * c.f / (k * g), k * g);
        if a.dot(c.n) < 0.0 && e < 0.0 {
            return movements(&c, -a, c.n, e);
        }
    }
    None
}

pub fn front_plane(input: &Input) -> Option<Groups> {
    front(input, false)
}

pub fn front_points(input: &Input) -> Option<Groups> {
    front(input, true)
}

/// The film through the images of three points of the plane.
pub fn rear_plane(input: &Input) -> Option<Groups> {
    let c = camera(input);
    let (m, g) = wanted(input, false);
    let foot = m * -g;
    let (u, v) = m.any_orthonormal_pair();
    let [p, q, r] = [foot, foot + u, foot + v].map(|x| c.image(x));
    let mut n = (q - p).cross(r - p).normalize();
    if n.z < 0.0 {
        n = -n;
    }
    movements(&c, n, n, -n.dot(p))
}
