//! The oracle: the contract's camera in 320 bits, built from points and joins, not from the library's formulas.
//! Each answer is a list of groups; a group is a vector whose error is judged as a whole.

use super::input::{Input, Key};
use super::wide::{Big, V3, angle, big, is_zero, near, plane_through, positive, root, sin_cos, unit};

pub type Groups = Vec<Vec<Big>>;

pub struct Camera {
    pub f: Big,
    pub radius: Big,
    pub a: V3,
    pub ex: V3,
    pub ey: V3,
    pub n: V3,
    pub fx: V3,
    pub fy: V3,
    pub center: V3,
    pub e: Big,
}

fn metres(mm: f64) -> Big {
    big(mm) / big(1000.0)
}

/// Ry(-swing) Rx(-tilt): the images of x, y and z.
fn turned(tilt: f64, swing: f64) -> [V3; 3] {
    let ((st, ct), (ss, cs)) = (sin_cos(tilt), sin_cos(swing));
    let zero = || big(0.0);
    // Rx(-t): y -> (0, c, -s), z -> (0, s, c); Ry(-s): (x, y, z) -> (c x - s z, y, s x + c z).
    [[big(1.0), zero(), zero()], [zero(), ct.clone(), zero() - st.clone()], [zero(), st, ct]].map(
        |[x, y, z]| V3([cs.clone() * x.clone() - ss.clone() * z.clone(), y, ss.clone() * x + cs.clone() * z]),
    )
}

impl Camera {
    pub fn new(input: &Input) -> Self {
        let get = |key| input.get(key);
        let [ex, ey, back] = turned(get(Key::FrontTilt), get(Key::FrontSwing));
        let [fx, fy, n] = turned(get(Key::RearTilt), get(Key::RearSwing));
        let center = V3([
            metres(get(Key::RearShift)) - metres(get(Key::FrontShift)),
            metres(get(Key::RearRise)) - metres(get(Key::FrontRise)),
            metres(get(Key::Extension)),
        ]);
        let f = metres(get(Key::Focal));
        let radius = f.clone() / big(get(Key::Number)) / big(2.0);
        let e = big(0.0) - n.dot(&center);
        Self { f, radius, a: back.times(&big(-1.0)), ex, ey, n, fx, fy, center, e }
    }

    /// The plane conjugate to the film-parallel plane at `1 / scale` of the film's distance: through the objects of
    /// three of its points.
    pub fn conjugate(&self, scale: &Big) -> (V3, Big) {
        let unit = self.center.length();
        let points = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| {
            let p = self.center.plus(&self.fx.times(&(big(x) * unit.clone())));
            let p = p.plus(&self.fy.times(&(big(y) * unit.clone())));
            let w = scale.clone() + self.a.dot(&p) / self.f.clone();
            (p, w)
        });
        let (m, e) = plane_through(points);
        // The film lies behind the lens: e < 0.
        let sign = if positive(&e) { big(-1.0) } else { big(1.0) };
        (m.times(&sign), e * sign)
    }

    pub fn lens_point(&self, u: f64, v: f64) -> V3 {
        let r = &self.radius;
        self.ex.times(&(big(u) * r.clone())).plus(&self.ey.times(&(big(v) * r.clone())))
    }

    /// Where the ray from the lens point to the image of `x` meets the film: (x w, y w, w).
    pub fn film_image(&self, s: &V3, x: &V3) -> [Big; 3] {
        let weight = big(1.0) - self.a.dot(x) / self.f.clone();
        // Film plane evaluated at the lens point and at the image point.
        let (at_s, at_l) = (self.n.dot(s) + self.e.clone(), self.n.dot(x) + self.e.clone() * weight.clone());
        let p = x.times(&at_s).minus(&s.times(&at_l));
        let w = weight * at_s - at_l;
        let from = p.minus(&self.center.times(&w));
        [self.fx.dot(&from), self.fy.dot(&from), w]
    }
}

fn four((m, e): (V3, Big), f: &Big) -> Vec<Big> {
    let [x, y, z] = m.0;
    unit(vec![x, y, z, e / f.clone()])
}

fn meet(a: &(V3, Big), b: &(V3, Big), f: &Big) -> Vec<Big> {
    let moment = b.0.times(&a.1).minus(&a.0.times(&b.1)).times(&(big(1.0) / f.clone()));
    let [x, y, z] = a.0.cross(&b.0).0;
    let [p, q, r] = moment.0;
    unit(vec![x, y, z, p, q, r])
}

pub fn focus_plane(input: &Input) -> Option<Groups> {
    let camera = Camera::new(input);
    Some(vec![four(camera.conjugate(&big(1.0)), &camera.f)])
}

pub fn scheimpflug(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    Some(vec![meet(&(c.n.clone(), c.e.clone()), &(c.a.clone(), big(0.0)), &c.f)])
}

pub fn hinge(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    Some(vec![meet(&c.conjugate(&big(1.0)), &(c.n.clone(), big(0.0)), &c.f)])
}

/// The distance of the hinge line, where it is finite.
pub fn hinge_distance(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let sine = c.n.cross(&c.a).length();
    (!is_zero(&sine)).then(|| vec![vec![c.f / sine]])
}

pub fn limits(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let ratio = big(input.get(Key::C)) / c.radius.clone() / big(2.0);
    let limit = |scale: Big| four(c.conjugate(&scale), &c.f);
    Some(vec![limit(big(1.0) - ratio.clone()), limit(big(1.0) + ratio)])
}

/// Film point of P through the lens point (U, V): x and y in metres.
pub fn film_point(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let s = c.lens_point(input.get(Key::U), input.get(Key::V));
    let [x, y, w] = c.film_image(&s, &V3::of(input.three(Key::Px)));
    (!is_zero(&w)).then(|| vec![vec![x / w.clone(), y / w]])
}

/// The same, homogeneous.
pub fn clip(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let s = c.lens_point(input.get(Key::U), input.get(Key::V));
    let [x, y, w] = c.film_image(&s, &V3::of(input.three(Key::Px)));
    Some(vec![vec![x, y], vec![w]])
}

/// The largest and smallest diameter of the blur.
pub fn blur(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let x = V3::of(input.three(Key::Px));
    let [c0, u, v] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| c.film_image(&c.lens_point(u, v), &x));
    let [u, v] = [u, v].map(|p| [0, 1, 2].map(|i| p[i].clone() - c0[i].clone()));
    // Dual conic of the unit circle's image.
    let entry = |i: usize, j: usize| {
        u[i].clone() * u[j].clone() + v[i].clone() * v[j].clone() - c0[i].clone() * c0[j].clone()
    };
    let k = entry(2, 2);
    if !positive(&c0[2]) || !positive(&(big(0.0) - k.clone())) {
        return None;
    }
    let (cx, cy) = (entry(0, 2) / k.clone(), entry(1, 2) / k.clone());
    let sxx = cx.clone() * cx.clone() - entry(0, 0) / k.clone();
    let sxy = cx.clone() * cy.clone() - entry(0, 1) / k.clone();
    let syy = cy.clone() * cy - entry(1, 1) / k;
    let (mean, half) = ((sxx.clone() + syy.clone()) / big(2.0), (sxx - syy) / big(2.0));
    let spread = root(&(half.clone() * half + sxy.clone() * sxy));
    let size = |square: Big| if positive(&square) { big(2.0) * root(&square) } else { big(0.0) };
    Some(vec![vec![size(mean.clone() + spread.clone())], vec![size(mean - spread)]])
}

/// The image of P: homogeneous, in focal lengths.
pub fn image(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let x = V3::of(input.three(Key::Px));
    let w = big(1.0) - c.a.dot(&x) / c.f.clone();
    let [p, q, r] = x.times(&(big(1.0) / c.f)).0;
    Some(vec![unit(vec![p, q, r, w])])
}

/// Rail frame: right, up and back.
pub fn rail(input: &Input) -> Option<[V3; 3]> {
    let [eye, at, up] = [Key::EyeX, Key::AtX, Key::UpX].map(|key| V3::of(input.three(key)));
    let back = eye.minus(&at).unit()?;
    let right = up.cross(&back).unit()?;
    Some([right.clone(), back.cross(&right), back])
}

pub fn rail_frame(input: &Input) -> Option<Groups> {
    Some(rail(input)?.map(|axis| axis.0.to_vec()).to_vec())
}

/// Film point, x and y in metres, of the world point P.
pub fn world_point(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let axes = rail(input)?;
    let world = V3::of(input.three(Key::Px)).minus(&V3::of(input.three(Key::EyeX)));
    let lens = V3([metres(input.get(Key::FrontShift)), metres(input.get(Key::FrontRise)), big(0.0)]);
    let x = V3(axes.map(|axis| axis.dot(&world))).minus(&lens);
    let s = c.lens_point(input.get(Key::U), input.get(Key::V));
    let [x, y, w] = c.film_image(&s, &x);
    (!is_zero(&w)).then(|| vec![vec![x / w.clone(), y / w]])
}

/// Extension, in metres, that focuses at the distance C.
pub fn distance(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let d = big(input.get(Key::C));
    // The image of the axis point stands at distance f D / (D - f) behind the lens.
    let behind = c.a.times(&(big(0.0) - c.f.clone() * d.clone() / (d - c.f.clone())));
    let beside = c.center.minus(&V3([big(0.0), big(0.0), c.center.0[2].clone()]));
    let extension = (c.n.dot(&behind) - c.n.dot(&beside)) / c.n.0[2].clone();
    Some(vec![vec![extension]])
}

/// The wanted plane in lens space, unit normal: through P with normal Q, or through P, Q and R.
fn wanted(input: &Input, points: bool) -> Option<(V3, Big)> {
    let [p, q, r] = [Key::Px, Key::Qx, Key::Rx].map(|key| V3::of(input.three(key)));
    let lens = V3([metres(input.get(Key::FrontShift)), metres(input.get(Key::FrontRise)), big(0.0)]);
    let m = if points { q.minus(&p).cross(&r.minus(&p)).unit()? } else { q.unit()? };
    let e = big(0.0) - m.dot(&p.minus(&lens));
    Some((m, e))
}

/// Tilt and swing (degrees) that turn the z axis to `z`; and the extension for the film plane (n, e), metres.
fn movements(c: &Camera, z: &V3, n: &V3, e: &Big) -> Groups {
    let [x, y, w] = &z.0;
    let across = root(&(x.clone() * x.clone() + w.clone() * w.clone()));
    let (tilt, swing) = (angle(y, &across), angle(&(big(0.0) - x.clone()), w));
    let beside = V3([c.center.0[0].clone(), c.center.0[1].clone(), big(0.0)]);
    let extension = (big(0.0) - e.clone() - n.dot(&beside)) / n.0[2].clone();
    vec![vec![tilt, swing], vec![extension]]
}

/// The lens turned: of the contract's quadratic both roots, and the one with a.n < 0 and e < 0.
pub fn front(input: &Input, points: bool) -> Option<Groups> {
    let c = Camera::new(input);
    let (m, g) = wanted(input, points)?;
    let ratio = g.clone() / c.f.clone();
    let square = big(1.0) - ratio.clone() * ratio.clone();
    let along = c.n.dot(&m);
    let inside = along.clone() * along.clone() - square;
    if inside < Big::ZERO || is_zero(&ratio) {
        return None;
    }
    for sign in [1.0, -1.0] {
        // 1/k, so that no root is at infinity.
        let inverse = along.clone() + big(sign) * root(&inside);
        let e_over = g.clone();
        if is_zero(&inverse) {
            continue;
        }
        let e = e_over / inverse.clone();
        let a = c.n.times(&inverse).minus(&m).times(&(big(1.0) / ratio.clone()));
        if positive(&(big(0.0) - a.dot(&c.n))) && positive(&(big(0.0) - e.clone())) {
            let z = a.times(&big(-1.0));
            return positive(&z.0[2]).then(|| movements(&c, &z, &c.n, &e));
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

/// The film turned: through the images of three of the plane's points.
pub fn rear_plane(input: &Input) -> Option<Groups> {
    let c = Camera::new(input);
    let (m, g) = wanted(input, false)?;
    // The film plane holds the images of all points of S: (m + (g/f) a, g).
    let normal = m.plus(&c.a.times(&(g.clone() / c.f.clone())));
    let length = normal.length();
    if is_zero(&length) || is_zero(&g) {
        return None;
    }
    let sign = if positive(&g) { big(-1.0) } else { big(1.0) };
    let n = normal.times(&(sign.clone() / length.clone()));
    let e = g * sign / length;
    positive(&n.0[2]).then(|| movements(&c, &n, &n, &e))
}

/// The largest of a group, as f64.
pub fn size(group: &[Big]) -> f64 {
    group.iter().map(|x| near(x).abs()).fold(0.0, f64::max)
}
