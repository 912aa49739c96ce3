//! Lengths, angles and f-numbers. What formulas take has units here.

use crate::error::{Error, Result};
use std::ops::{Add, Mul, Neg, Sub};

/// A length; metres inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Length(f64);

impl Length {
    /// No length at all.
    pub const ZERO: Self = Self(0.0);

    /// A length of `value` metres.
    pub const fn metres(value: f64) -> Self {
        Self(value)
    }

    /// A length of `value` millimetres.
    pub fn millimetres(value: f64) -> Self {
        // Division is correctly rounded; multiplying by 0.001 is not the nearest metre value.
        Self(value / 1000.0)
    }

    /// In metres.
    pub const fn as_metres(self) -> f64 {
        self.0
    }

    /// In millimetres.
    pub fn as_millimetres(self) -> f64 {
        self.0 * 1000.0
    }
}

/// An angle. It is kept in degrees, so that what a file says is what comes back to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Angle(f64);

impl Angle {
    /// No turn.
    pub const ZERO: Self = Self(0.0);

    /// An angle of `value` degrees.
    pub const fn degrees(value: f64) -> Self {
        Self(value)
    }

    /// An angle of `value` radians.
    pub fn radians(value: f64) -> Self {
        Self(value.to_degrees())
    }

    /// In degrees.
    pub const fn as_degrees(self) -> f64 {
        self.0
    }

    /// In radians.
    pub fn as_radians(self) -> f64 {
        self.0.to_radians()
    }

    /// Sine and cosine, the same bits on every platform; the cosine of 90 degrees is 0.
    pub fn sin_cos(self) -> (f64, f64) {
        // Near a right angle the cosine is what is left of it: that difference has no error in degrees.
        if (45.0..=135.0).contains(&self.0.abs()) && self.0.abs() != 45.0 {
            let (cosine, sine) = libm::sincos((90.0 - self.0.abs()).to_radians());
            return (sine.copysign(self.0), cosine);
        }
        libm::sincos(self.as_radians())
    }
}

/// Sums, differences and multiples keep the unit.
macro_rules! arithmetic {
    ($quantity:ident) => {
        impl Add for $quantity {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }
        impl Sub for $quantity {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }
        impl Neg for $quantity {
            type Output = Self;
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
        impl Mul<f64> for $quantity {
            type Output = Self;
            fn mul(self, factor: f64) -> Self {
                Self(self.0 * factor)
            }
        }
    };
}

arithmetic!(Length);
arithmetic!(Angle);

/// An f-number: focal length over aperture diameter; positive and finite.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct FNumber(f64);

impl FNumber {
    /// The f-number `value`: 5.6 for f/5.6.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] when `value` is not a positive finite number.
    pub fn new(value: f64) -> Result<Self> {
        if value.is_finite() && value > 0.0 {
            Ok(Self(value))
        } else {
            Err(Error::invalid(format!("an f-number is positive and finite, not {value}")))
        }
    }

    /// The number itself: 5.6 for f/5.6.
    pub const fn get(self) -> f64 {
        self.0
    }
}

/// A number in words for a message: as it is, or with an exponent where it would fill the line.
pub(crate) fn short(value: f64) -> String {
    if value.abs() < 1e9 { format!("{value}") } else { format!("{value:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_and_millimetres_come_back() {
        for value in [6.0, 0.1, 1e-12, 89.9, 152.3, 12.7] {
            assert_eq!(Angle::degrees(value).as_degrees(), value);
            assert!((Length::millimetres(value).as_millimetres() / value - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn quantities_add_up() {
        let (a, b) = (Length::metres(0.25), Length::metres(1.5));
        assert_eq!([a + b, a - b, -a, b * 2.0], [1.75, -1.25, -0.25, 3.0].map(Length::metres));
        assert_eq!(Angle::degrees(90.0) - Angle::degrees(45.0) * 2.0, Angle::ZERO);
    }

    #[test]
    fn right_angles_are_exact() {
        assert_eq!(Angle::degrees(90.0).sin_cos(), (1.0, 0.0));
        assert_eq!(Angle::degrees(-90.0).sin_cos(), (-1.0, 0.0));
        let (sine, cosine) = Angle::degrees(90f64.next_down()).sin_cos();
        assert!(sine == 1.0 && (cosine / (90.0 - 90f64.next_down()).to_radians() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn f_numbers_are_checked() {
        assert!(FNumber::new(0.0).is_err() && FNumber::new(f64::NAN).is_err());
        assert_eq!(FNumber::new(5.6).unwrap().get(), 5.6);
    }
}
