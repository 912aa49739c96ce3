//! Cases of the inverse, and of the frame that all stands in.

use super::cases::{Case, DISTANCE, FRONT, POINTS, RAIL, REAR};
use super::input::Input;
use super::input::Key::*;

pub fn all() -> Vec<Case> {
    let b = Input::base;
    let tilt = |degrees: f64| b().with(FrontTilt, degrees);
    let square = |degrees: f64| {
        let (s, c) = libm::sincos(degrees.to_radians());
        [0.0, s, c]
    };
    let case = |name, why, problem, input| Case { name, why, problem, input };
    vec![
        case(
            "a plane 1e-12 m from the lens",
            "every number of it but one vanishes",
            REAR,
            b().at(Px, [0.0, -1e-12, 0.0]).at(Qx, square(-80.0)),
        ),
        case(
            "points nearly on one line",
            "corners of 1e-9 radians",
            POINTS,
            b().at(Px, [-1.0, -1.0, -10.0]).at(Qx, [1.0, 1.0 + 1e-9, -12.0]).at(Rx, [0.0, 1e-9, -11.0]),
        ),
        case(
            "points far apart, nearly on one line",
            "a triangle 1e6 m long and 1 mm high",
            POINTS,
            b().at(Px, [-1e6, -1.0, -10.0]).at(Qx, [1e6, -1.0, -10.0]).at(Rx, [0.0, -0.999, -10.001]),
        ),
        case(
            "points 1e6 m away",
            "differences of large coordinates",
            POINTS,
            b().at(Px, [1e6, -1.5, -1e6]).at(Qx, [1e6 + 1.0, -1.5, -1e6]).at(Rx, [1e6, -1.5, -1e6 - 1.0]),
        ),
        case(
            "focus plane nearly through the lens",
            "a plane at 2 mm from it, by the film",
            REAR,
            b().at(Px, [0.0, -0.002, 0.0]).at(Qx, square(-85.0)),
        ),
        case(
            "J = f (1 + 1e-12)",
            "the two roots of the inverse nearly coincide",
            FRONT,
            b().at(Px, [0.0, -0.15 * (1.0 + 1e-12), 0.0]).at(Qx, [0.0, 1.0, -1e-3]),
        ),
        case(
            "J = f (1 + 1e-6)",
            "the lens nearly along the film",
            FRONT,
            b().at(Px, [0.0, -0.15 * (1.0 + 1e-6), 0.0]).at(Qx, [0.0, 1.0, -1e-2]),
        ),
        case(
            "a plane at f from the lens",
            "the quadratic loses its first coefficient",
            FRONT,
            b().at(Px, [0.0, 0.15, 0.0]).at(Qx, [0.0, 1.0, 0.0]).with(RearTilt, 10.0),
        ),
        case(
            "wanted tilt 1e-12",
            "the plane is 1e-10 of its distance off square",
            FRONT,
            b().at(Px, [0.0, 0.0, -10.0]).at(Qx, [0.0, 1.1636e-12, 1.0]),
        ),
        case(
            "wanted plane at 1e9 m",
            "g/f = 7e9: roots of very different size",
            FRONT,
            b().at(Px, [0.0, 0.0, -1e9]).at(Qx, [0.3, 0.2, 1.0]),
        ),
        case(
            "wanted: level ground",
            "the plane parallel to the axis",
            FRONT,
            b().at(Px, [0.0, -1.6, 0.0]).at(Qx, [0.0, 1.0, 0.0]),
        ),
        case(
            "wanted: a plane 1e-6 short of the front focal plane",
            "its image is at 1e4 m",
            REAR,
            b().at(Px, [0.0, 0.0, -0.150_001]).at(Qx, [0.0, 0.0, 1.0]),
        ),
        case(
            "distance f (1 + 1e-12)",
            "1/f - 1/D loses 12 digits",
            DISTANCE,
            b().with(C, 0.15 * (1.0 + 1e-12)),
        ),
        case("distance 1e12 m", "the film 2e-14 m behind f", DISTANCE, tilt(5.0).with(C, 1e12)),
        case(
            "rear tilt 89, distance",
            "the film nearly along the rail: extension = d / cos",
            DISTANCE,
            b().tilts(80.0, 89.0).with(C, 3.0),
        ),
        case(
            "up nearly along the view",
            "a sine of 1e-9 between them",
            RAIL,
            b().at(AtX, [0.0, -10.0, 1e-8]).at(UpX, [0.0, 1.0, 0.0]),
        ),
        case(
            "up nearly along a slanted view",
            "and no number is 0",
            RAIL,
            b().at(EyeX, [0.3, 1.7, 10.0]).at(AtX, [1.3, 3.7, 7.0]).at(UpX, [1.0, 2.0 + 1e-8, -3.0]),
        ),
        case(
            "the largest doubles, rail",
            "eye - look_at overflows",
            RAIL,
            b().at(EyeX, [1.5e308, 0.0, 0.0]).at(AtX, [-1.5e308, 0.0, 1e307]),
        ),
        case(
            "a view of denormals",
            "eye and look_at 1e-320 m apart",
            RAIL,
            b().at(EyeX, [0.0, 0.0, 0.0]).at(AtX, [1e-320, 0.0, -2e-320]),
        ),
    ]
}
