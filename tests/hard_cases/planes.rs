//! Cases of planes and lines: small tilts, and standards that are nearly parallel.

use super::cases::{Case, FOCUS, HINGE, J, LIMITS, SCHEIMPFLUG};
use super::input::Input;
use super::input::Key::*;

pub fn all() -> Vec<Case> {
    let b = Input::base;
    let tilt = |degrees: f64| b().with(FrontTilt, degrees);
    let case = |name, why, problem, input| Case { name, why, problem, input };
    vec![
        case("tilt 0", "film and lens parallel: all rules divide by sin 0", FOCUS, tilt(0.0)),
        case("tilt 0, line", "the Scheimpflug line lies at infinity", SCHEIMPFLUG, tilt(0.0)),
        case("tilt 0, hinge", "the hinge line lies at infinity", HINGE, tilt(0.0)),
        case("tilt 0, limits", "the wedge has no edge", LIMITS, tilt(0.0)),
        case(
            "tilt 1e-15",
            "cos is 1 to the last digit: the angle is lost to an arc cosine",
            FOCUS,
            tilt(1e-15),
        ),
        case("tilt 1e-15, hinge", "the hinge line 8.6e15 m away", HINGE, tilt(1e-15)),
        case("tilt 1e-15, J", "J = f / sin with a sine of 1.7e-17", J, tilt(1e-15)),
        case("tilt 1e-12, line", "planes that meet at 8.7e12 m", SCHEIMPFLUG, tilt(1e-12)),
        case("tilt 1e-12, J", "J from a cross product of nearly equal vectors", J, tilt(1e-12)),
        case("tilt 1e-12, limits", "a wedge of 1e-16 degrees", LIMITS, tilt(1e-12)),
        case("tilt 1e-6", "half of the digits of cos are gone", FOCUS, tilt(1e-6)),
        case("tilt 1e-6, J", "1 - cos = 1.5e-16", J, tilt(1e-6)),
        case("tilt 1e-160", "sines whose squares underflow", J, tilt(1e-160)),
        case("tilt 1e-145", "sines whose squares overflow once scaled by the least number", J, tilt(1e-145)),
        case(
            "tilt 1e-300, plane",
            "products of sines underflow",
            FOCUS,
            tilt(1e-300).with(FrontSwing, 1e-300),
        ),
        case(
            "swing 1e-9 on rear tilt 40",
            "a small angle between two standards turned about different axes",
            J,
            b().tilts(40.0, 40.0).with(RearSwing, 1e-9),
        ),
        case(
            "both at 45",
            "parallel: every product cancels to the last digit",
            FOCUS,
            b().tilts(45.0, 45.0).with(Extension, 215.3),
        ),
        case(
            "both at 45, hinge",
            "the hinge line of parallel standards at 45 degrees",
            HINGE,
            b().tilts(45.0, 45.0).with(Extension, 215.3),
        ),
        case(
            "45 and 45 + 1e-12",
            "nearly parallel at a large angle",
            HINGE,
            b().tilts(45.0, 45.0 + 1e-12).with(Extension, 215.3),
        ),
        case(
            "60 and 60 - 1e-9, line",
            "the line of planes that differ by 1e-9 degrees",
            SCHEIMPFLUG,
            b().tilts(60.0, 60.0 - 1e-9).with(Extension, 305.0),
        ),
    ]
}
