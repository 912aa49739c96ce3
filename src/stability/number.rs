//! What a formula needs of a number, so that one text of it serves single precision and the references.

use super::wide::Wide;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Arithmetic, a root, a sine.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    fn of(value: f64) -> Self;
    fn root(self) -> Self;
    /// Sine and cosine of an angle in degrees.
    fn sin_cos(degrees: f64) -> (Self, Self);
    /// To compare.
    fn wide(self) -> Wide;
}

impl Number for Wide {
    fn of(value: f64) -> Self {
        Self::of(value)
    }

    fn root(self) -> Self {
        self.sqrt()
    }

    fn sin_cos(degrees: f64) -> (Self, Self) {
        Self::sin_cos(degrees)
    }

    fn wide(self) -> Wide {
        self
    }
}

impl Number for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn root(self) -> Self {
        self.sqrt()
    }

    fn sin_cos(degrees: f64) -> (Self, Self) {
        libm::sincos(degrees.to_radians())
    }

    fn wide(self) -> Wide {
        Wide::of(self)
    }
}

impl Number for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }

    fn root(self) -> Self {
        self.sqrt()
    }

    fn sin_cos(degrees: f64) -> (Self, Self) {
        libm::sincosf((degrees as Self).to_radians())
    }

    fn wide(self) -> Wide {
        Wide::of(f64::from(self))
    }
}

/// Three numbers.
#[derive(Clone, Copy)]
pub(crate) struct V<T>(pub(crate) [T; 3]);

impl<T: Number> V<T> {
    pub(crate) fn of(v: [f64; 3]) -> Self {
        Self(v.map(T::of))
    }

    pub(crate) fn dot(self, o: Self) -> T {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }

    pub(crate) fn minus(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }

    pub(crate) fn times(self, k: T) -> Self {
        Self(self.0.map(|x| x * k))
    }

    pub(crate) fn cross(self, o: Self) -> Self {
        let part = |i: usize, j: usize| self.0[i] * o.0[j] - self.0[j] * o.0[i];
        Self([part(1, 2), part(2, 0), part(0, 1)])
    }
}

/// How far one answer lies from another, as a share of the other's size; `None` where it is no number. `projective`
/// answers are the same at any scale of the same sign.
pub(crate) fn error(got: &[Wide], want: &[Wide], projective: bool) -> Option<f64> {
    let length = |v: &[Wide]| v.iter().fold(Wide::ZERO, |sum, &x| sum + x * x).sqrt();
    let (a, b) = (length(got), length(want));
    let scale = if projective { a / b } else { Wide::ONE };
    let gap: Vec<Wide> = got.iter().zip(want).map(|(&x, &y)| x / scale - y).collect();
    let error = (length(&gap) / b).near();
    error.is_finite().then_some(error)
}
