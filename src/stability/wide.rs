//! Numbers of twice the digits: an unevaluated sum of two doubles, about 31 decimal digits.
//!
//! T. J. Dekker, "A floating-point technique for extending the available precision", Numerische Mathematik 18 (1971). Only
//! what the references of the maps need; within the range in which halves of products do not vanish.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `hi + lo`, with `lo` at most half an ulp of `hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wide {
    hi: f64,
    lo: f64,
}

impl Wide {
    pub(crate) const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    pub(crate) const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    /// A degree in radians.
    const DEGREE: Self = Self { hi: 0.017_453_292_519_943_295, lo: 2.948_652_270_870_168_7e-19 };

    pub(crate) const fn of(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }

    /// The nearest double.
    pub(crate) fn near(self) -> f64 {
        self.hi
    }

    pub(crate) fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        // One step of Newton's from the double's root doubles its digits.
        let root = Self::of(self.hi.sqrt());
        (root + self / root) * Self::of(0.5)
    }

    /// Sine and cosine of an angle in degrees, up to 90 or so.
    pub(crate) fn sin_cos(degrees: f64) -> (Self, Self) {
        const HALVINGS: i32 = 6;
        let x = Self::of(degrees) * Self::DEGREE * Self::of(1.0 / 64.0);
        let square = x * x;
        // sin x / x and the versine 1 - cos x, by their series; the versine keeps small angles' digits when doubled.
        let (mut sine, mut versine) = (Self::ZERO, Self::ZERO);
        let mut term = Self::ONE;
        for k in 1..=12 {
            sine = sine + term;
            let even = term * square / Self::of(f64::from(2 * k));
            versine = versine + even;
            // Divided by 1, 2, 3, ... in turn; both series alternate.
            term = -even / Self::of(f64::from(2 * k + 1));
        }
        let mut sine = sine * x;
        for _ in 0..HALVINGS {
            // sin 2x = 2 sin x (1 - v), 1 - cos 2x = 2 sin^2 x.
            let double = Self::of(2.0) * sine * (Self::ONE - versine);
            versine = Self::of(2.0) * sine * sine;
            sine = double;
        }
        (sine, Self::ONE - versine)
    }
}

/// A sum and its rounding error (D. E. Knuth).
fn two_sum(a: f64, b: f64) -> Wide {
    let s = a + b;
    let t = s - a;
    Wide { hi: s, lo: (a - (s - t)) + (b - t) }
}

/// A sum whose first part is the larger.
fn quick_sum(a: f64, b: f64) -> Wide {
    let s = a + b;
    Wide { hi: s, lo: b - (s - a) }
}

/// A product and its rounding error.
fn two_product(a: f64, b: f64) -> Wide {
    let split = |x: f64| {
        let c = 134_217_729.0 * x;
        let high = c - (c - x);
        (high, x - high)
    };
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    let p = a * b;
    Wide { hi: p, lo: ((ah * bh - p) + ah * bl + al * bh) + al * bl }
}

impl Add for Wide {
    type Output = Self;

    fn add(self, o: Self) -> Self {
        let (s, t) = (two_sum(self.hi, o.hi), two_sum(self.lo, o.lo));
        let s = quick_sum(s.hi, s.lo + t.hi);
        quick_sum(s.hi, s.lo + t.lo)
    }
}

impl Neg for Wide {
    type Output = Self;

    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Wide {
    type Output = Self;

    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Wide {
    type Output = Self;

    fn mul(self, o: Self) -> Self {
        let p = two_product(self.hi, o.hi);
        quick_sum(p.hi, p.lo + (self.hi * o.lo + self.lo * o.hi))
    }
}

impl Div for Wide {
    type Output = Self;

    fn div(self, o: Self) -> Self {
        // Long division, three digits of 53 bits.
        let first = self.hi / o.hi;
        let rest = self - o * Self::of(first);
        let second = rest.hi / o.hi;
        let rest = rest - o * Self::of(second);
        quick_sum(first, second) + Self::of(rest.hi / o.hi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_near(a: Wide, b: Wide, within: f64) -> bool {
        (a - b).near().abs() <= within
    }

    #[test]
    fn arithmetic_has_thirty_digits() {
        let third = Wide::ONE / Wide::of(3.0);
        assert!(is_near(third * Wide::of(3.0), Wide::ONE, 1e-31));
        let root = Wide::of(2.0).sqrt();
        assert!(is_near(root * root, Wide::of(2.0), 1e-30));
        assert_eq!((Wide::of(1e16) + Wide::ONE - Wide::of(1e16)).near(), 1.0);
    }

    #[test]
    fn sines_obey_their_laws() {
        for degrees in [1e-16, 1e-5, 0.3, 6.0, 30.0, 45.0, 60.0, 89.0] {
            let (s, c) = Wide::sin_cos(degrees);
            assert!(is_near(s * s + c * c, Wide::ONE, 1e-29), "{degrees}");
            assert!((s.near() / libm::sin(degrees.to_radians()) - 1.0).abs() < 1e-15, "{degrees}");
        }
        assert!(is_near(Wide::sin_cos(30.0).0, Wide::of(0.5), 1e-29));
        let (s, c) = Wide::sin_cos(45.0);
        assert!(is_near(s, c, 1e-29));
        // The small one to its own digits: sin x = x - x^3/6.
        let x = Wide::of(1e-12) * Wide::DEGREE;
        assert!(((Wide::sin_cos(1e-12).0 - (x - x * x * x / Wide::of(6.0))) / x).near().abs() < 1e-29);
    }
}
