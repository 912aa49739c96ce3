//! Cases of planes and lines: infinity, large movements, numbers at the ends of their range.

use super::cases::{Case, FOCUS, HINGE, LIMITS};
use super::input::Input;
use super::input::Key::*;

pub fn all() -> Vec<Case> {
    let b = Input::base;
    let tilt = |degrees: f64| b().with(FrontTilt, degrees);
    let case = |name, why, problem, input| Case { name, why, problem, input };
    vec![
        case(
            "focus at infinity",
            "extension = f: the focus plane is the one at infinity",
            FOCUS,
            b().with(Extension, 150.0),
        ),
        case(
            "focus nearly at infinity",
            "extension - f is an ulp",
            FOCUS,
            b().with(Extension, 150.0 * (1.0 + 2.0 * f64::EPSILON)),
        ),
        case(
            "beyond infinity",
            "extension < f: the focus plane lies behind the lens",
            FOCUS,
            b().with(Extension, 149.999),
        ),
        case(
            "infinity, tilted",
            "d cos = f: the focus plane parallel to the axis",
            FOCUS,
            tilt(6.0).with(Extension, 150.0 / libm::cos(6.0f64.to_radians())),
        ),
        case(
            "focal length 0.1 mm",
            "a scale 1500 times smaller",
            FOCUS,
            tilt(6.0).with(Focal, 0.1).with(Extension, 0.101),
        ),
        case(
            "focal length 100 m",
            "a scale 667 times larger",
            FOCUS,
            tilt(6.0).with(Focal, 1e5).with(Extension, 1.01e5),
        ),
        case(
            "focal length 100 m, limits",
            "a wedge of 1e-6 of its angle",
            LIMITS,
            tilt(6.0).with(Focal, 1e5).with(Extension, 1.01e5),
        ),
        case("c = A", "the near limit's image at infinity", LIMITS, tilt(6.0).with(Number, 1.5).with(C, 0.1)),
        case(
            "c nearly A",
            "1 - c/A is two ulps",
            LIMITS,
            tilt(6.0).with(Number, 1.5).with(C, 0.1 * (1.0 - 2.0 * f64::EPSILON)),
        ),
        case(
            "c = 3 A",
            "the near limit's image before the lens",
            LIMITS,
            tilt(6.0).with(Number, 1.5).with(C, 0.3),
        ),
        case(
            "far limit at infinity",
            "focused at the hyperfocal distance",
            LIMITS,
            b().with(Extension, 150.0 * (1.0 + 5.6e-4 / 0.84)).with(C, 1e-4),
        ),
        case(
            "movements of 45",
            "front and rear against each other",
            FOCUS,
            b().tilts(45.0, -44.0).with(FrontSwing, 30.0).with(RearSwing, -30.0),
        ),
        case("tilt 89", "the lens nearly in the rail", FOCUS, tilt(89.0).with(RearTilt, 89.0)),
        case("tilt 89.999999999, hinge", "cos of nearly a right angle", HINGE, tilt(89.999_999_999)),
        case(
            "denormal focal length",
            "f = 1e-308 m is no normal number",
            FOCUS,
            tilt(6.0).with(Focal, 1e-305).with(Extension, 1.01e-305),
        ),
        case(
            "extension 1e160, f 1e-160",
            "e/f overflows",
            FOCUS,
            tilt(6.0).with(Focal, 1e-160).with(Extension, 1e160),
        ),
        case(
            "the largest doubles",
            "an extension of 1e308 mm",
            FOCUS,
            tilt(6.0).with(Extension, 1e308).with(Focal, 1e307),
        ),
    ]
}
