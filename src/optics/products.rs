//! The normal of three points whose products nearly cancel: each component to its last bit.
//!
//! A product of two doubles is the sum of two, found by splitting (T. J. Dekker, "A floating-point technique for extending
//! the available precision", Numerische Mathematik 18, 1971), so a difference of products loses nothing but its own
//! rounding. No fused operation is needed: those are not the same on every processor.

use glam::DVec3;

/// `(q - p) x (r - p)`, each component to about an ulp of what the coordinates as they are make it. Plain where a number
/// is so large or so small that its parts leave the range of doubles.
pub(crate) fn normal_of([p, q, r]: [DVec3; 3]) -> DVec3 {
    let ((a, da), (b, db)) = (apart(q, p), apart(r, p));
    let part = |i: usize, j: usize| {
        let rest = (a[i] * db[j] + da[i] * b[j]) - (a[j] * db[i] + da[j] * b[i]);
        let exact = difference(a[i], b[j], a[j], b[i]) + rest;
        if exact.is_finite() { exact } else { a[i] * b[j] - a[j] * b[i] }
    };
    DVec3::new(part(1, 2), part(2, 0), part(0, 1))
}

/// `q - p` and its rounding error.
fn apart(q: DVec3, p: DVec3) -> (DVec3, DVec3) {
    let error = |i: usize| sum_error(q[i], p[i]);
    (q - p, DVec3::new(error(0), error(1), error(2)))
}

/// `a b - c d`.
fn difference(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let ((p, dp), (q, dq)) = (product(a, b), product(c, d));
    let exact = (p - q) + sum_error(p, q) + (dp - dq);
    if exact.is_finite() { exact } else { a * b - c * d }
}

/// A product and its rounding error: together the product itself.
fn product(a: f64, b: f64) -> (f64, f64) {
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    let p = a * b;
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// The rounding error of `p - q` (O. Moller and D. E. Knuth's sum of two).
fn sum_error(p: f64, q: f64) -> f64 {
    let d = p - q;
    let back = d - p;
    (p - (d - back)) - (q + back)
}

/// Upper and lower half of the digits: 2^27 + 1 cuts 53 bits in two.
fn split(a: f64) -> (f64, f64) {
    let c = 134_217_729.0 * a;
    let high = c - (c - a);
    (high, a - high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_lost_where_products_cancel() {
        let e = f64::EPSILON;
        // (1 + e)(1 - e) - 1 = -e^2, below the last digit of either product.
        assert_eq!(difference(1.0 + e, 1.0 - e, 1.0, 1.0), -e * e);
        assert_eq!(difference(3.0, 5.0, 7.0, 2.0), 1.0);
    }

    #[test]
    fn a_normal_is_that_of_the_coordinates_as_they_are() {
        // p = (1/3, 0, 1e6): q - p and r - p are rounded, and the corner between them is 1e-12.
        let p = DVec3::new(1.0 / 3.0, 0.0, 1e6);
        let (q, r) = (DVec3::new(1.0, 1.0, 1e6), DVec3::new(-1.0, -2.0 + 3e-12, 1e6));
        // z = (2/3)(-2 + 3e-12) + 4/3, about p's own double: exactly, by integers of 2^-60.
        let integer = |x: f64| (x * libm::pow(2.0, 60.0)) as i128;
        let (x, y) = (integer(p.x), integer(r.y));
        let exact = (integer(1.0) - x) * y - integer(1.0) * (integer(-1.0) - x);
        let want = exact as f64 / libm::pow(2.0, 120.0);
        let found = normal_of([p, q, r]);
        assert!(found.x == 0.0 && found.y == 0.0 && (found.z / want - 1.0).abs() < 4e-16, "{found:?} {want}");
    }

    #[test]
    fn numbers_at_the_ends_of_the_range_stay_numbers() {
        assert_eq!(difference(1e308, 1.0, 1e307, 1.0), 1e308 - 1e307);
        assert_eq!(difference(1e305, 0.5, 0.0, 1.0), 5e304);
        assert_eq!(difference(1e-320, 1.0, 0.0, 0.0), 1e-320);
    }
}
