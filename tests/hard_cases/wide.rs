//! Vectors of 320-bit numbers: the arithmetic of the oracle, on `dashu-float` alone.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;

pub type Big = FBig<HalfEven, 2>;

/// Twice the digits of the 100 bits that would do, and room for what cancels.
pub const BITS: usize = 320;

/// An f64, exactly.
pub fn big(value: f64) -> Big {
    Big::try_from(value).expect("finite").with_precision(BITS).value()
}

/// The nearest f64.
pub fn near(value: &Big) -> f64 {
    value.to_f64().value()
}

pub fn root(value: &Big) -> Big {
    if is_zero(value) { big(0.0) } else { value.sqrt() }
}

pub fn is_zero(value: &Big) -> bool {
    *value == Big::ZERO
}

pub fn positive(value: &Big) -> bool {
    *value > Big::ZERO
}

/// Sine and cosine of an angle in degrees.
pub fn sin_cos(degrees: f64) -> (Big, Big) {
    if degrees == 0.0 { (big(0.0), big(1.0)) } else { big(degrees).sin_cos_unit(360) }
}

/// The angle of (x, y) in degrees.
pub fn angle(y: &Big, x: &Big) -> Big {
    if is_zero(y) && positive(x) { big(0.0) } else { y.atan2_unit(x, 360) }
}

#[derive(Clone)]
pub struct V3(pub [Big; 3]);

impl V3 {
    pub fn of(v: [f64; 3]) -> Self {
        Self(v.map(big))
    }

    pub fn dot(&self, o: &Self) -> Big {
        (0..3).fold(big(0.0), |sum, i| sum + self.0[i].clone() * o.0[i].clone())
    }

    pub fn cross(&self, o: &Self) -> Self {
        let term =
            |i: usize, j: usize| self.0[i].clone() * o.0[j].clone() - self.0[j].clone() * o.0[i].clone();
        Self([term(1, 2), term(2, 0), term(0, 1)])
    }

    pub fn plus(&self, o: &Self) -> Self {
        Self([0, 1, 2].map(|i| self.0[i].clone() + o.0[i].clone()))
    }

    pub fn minus(&self, o: &Self) -> Self {
        Self([0, 1, 2].map(|i| self.0[i].clone() - o.0[i].clone()))
    }

    pub fn times(&self, k: &Big) -> Self {
        Self([0, 1, 2].map(|i| self.0[i].clone() * k.clone()))
    }

    pub fn length(&self) -> Big {
        root(&self.dot(self))
    }

    /// None for a zero vector.
    pub fn unit(&self) -> Option<Self> {
        let length = self.length();
        (!is_zero(&length)).then(|| self.times(&(big(1.0) / length)))
    }
}

/// The plane (m, e) through three homogeneous points (x, w).
pub fn plane_through(points: [(V3, Big); 3]) -> (V3, Big) {
    let [(p, wp), (q, wq), (r, wr)] = points;
    // (m, e) is square to all three: cofactors of the 3 x 4 matrix of the points.
    let m = q.cross(&r).times(&wp).plus(&r.cross(&p).times(&wq)).plus(&p.cross(&q).times(&wr));
    let e = big(0.0) - p.dot(&q.cross(&r));
    (m, e)
}

/// A vector of any length made unit; as it is when it is zero.
pub fn unit(v: Vec<Big>) -> Vec<Big> {
    let length = root(&v.iter().fold(big(0.0), |sum, x| sum + x.clone() * x.clone()));
    if is_zero(&length) { v } else { v.into_iter().map(|x| x / length.clone()).collect() }
}
