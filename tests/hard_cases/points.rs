//! Cases of points: their images, their blur.

use super::cases::{BLUR, CLIP, Case, IMAGE, POINT, WORLD};
use super::input::Input;
use super::input::Key::*;

pub fn all() -> Vec<Case> {
    let b = Input::base;
    let tilt = |degrees: f64| b().with(FrontTilt, degrees);
    let macro_at =
        |m: f64| b().with(Extension, 150.0 * (1.0 + m)).at(Px, [0.02, -0.01, -0.15 * (1.0 + 1.0 / m)]);
    let case = |name, why, problem, input| Case { name, why, problem, input };
    vec![
        case("macro 1:1", "extension 2 f, object at 2 f", POINT, macro_at(1.0)),
        case(
            "macro 1:1, blur",
            "a point 1e-9 m from the focus plane",
            BLUR,
            macro_at(1.0).with(Pz, -0.300_000_001),
        ),
        case("macro 10:1", "object nearly in the front focal plane", POINT, macro_at(10.0)),
        case(
            "macro 10:1, blur",
            "and its blur, magnified ten times",
            BLUR,
            macro_at(10.0).with(Pz, -0.165_000_1),
        ),
        case(
            "focal length 0.1 mm, blur",
            "blur of micrometres",
            BLUR,
            tilt(6.0).with(Focal, 0.1).with(Extension, 0.101),
        ),
        case("f/0.5", "the aperture is wider than the film's distance", BLUR, b().with(Number, 0.5)),
        case(
            "f/0.5 through the rim",
            "the lens point as far off as the image",
            POINT,
            tilt(8.0).with(Number, 0.5).with(U, 1.0).with(V, 0.0),
        ),
        case(
            "f/1000",
            "an aperture of 0.15 mm: differences between lens points are small",
            BLUR,
            b().with(Number, 1000.0),
        ),
        case(
            "f/1000, tilted, at the focus",
            "blur of 1e-9 of its terms",
            BLUR,
            tilt(6.0).with(Number, 1000.0).at(Px, [0.0, -1.427, -10.0]),
        ),
        case(
            "camera 1e9 m away",
            "world coordinates have 1e-7 m left",
            WORLD,
            b().at(EyeX, [1e9, -1e9, 1e9])
                .at(AtX, [1e9 + 3.0, -1e9, 1e9 - 8.0])
                .at(Px, [1e9 + 3.0, -1e9 + 0.5, 1e9 - 8.0]),
        ),
        case(
            "scene of 1e-6 m",
            "a microscope: the object 1e-6 m across",
            POINT,
            macro_at(10.0).at(Px, [1e-6, -3e-7, -0.165]),
        ),
        case(
            "scene of 1e7 m",
            "an object at 1e7 m: the image within 2e-9 m of f",
            POINT,
            b().at(Px, [3e6, 1e6, -1e7]).with(Extension, 150.0),
        ),
        case(
            "scene of 1e7 m, blur",
            "blur against the aperture's own size",
            BLUR,
            b().at(Px, [3e6, 1e6, -1e7]).with(Extension, 150.001),
        ),
        case("w near 0", "a point almost beside the lens point", CLIP, b().at(Px, [0.1, 0.05, -1e-12])),
        case(
            "w near 0, tilted",
            "the weight is what two terms of 1e-2 leave",
            CLIP,
            tilt(8.0).at(Px, [0.0100446, -0.0066, -1e-9]),
        ),
        case("a point at the lens centre", "all three coordinates vanish", CLIP, b().at(Px, [0.0, 0.0, 0.0])),
        case(
            "a point 1e-15 m before the lens",
            "through the lens itself",
            POINT,
            b().with(U, 0.0).with(V, 0.0).at(Px, [1e-16, 2e-16, -1e-15]),
        ),
        case(
            "movements of 45, film point",
            "through the rim",
            POINT,
            b().tilts(45.0, 0.0).with(FrontSwing, 30.0).at(Px, [3.0, -4.0, -5.0]).with(Number, 4.0),
        ),
        case(
            "aperture reaching the film",
            "n.s + e = 1e-12 m",
            POINT,
            b().with(Number, 0.5).with(RearTilt, 45.0).with(U, 0.0).with(V, -0.999).with(Extension, 150.0),
        ),
        case("image of a point at f", "its image is at infinity", IMAGE, b().at(Px, [0.02, 0.01, -0.15])),
        case(
            "image of a point near f",
            "a weight of 1e-13",
            IMAGE,
            tilt(10.0).at(Px, [0.0, 0.0, -0.15 / libm::cos(10.0f64.to_radians()) * (1.0 + 1e-13)]),
        ),
        case(
            "blur in focus",
            "1e-12 m from the plane of focus",
            BLUR,
            b().with(Extension, 200.0).at(Px, [0.01, 0.0, -0.600_000_000_001]),
        ),
        case(
            "blur in focus, tilted",
            "1e-9 of the distance from the focus plane",
            BLUR,
            tilt(30.0).with(Extension, 190.0).at(Px, [0.05, -0.3, -0.25]).with(Number, 64.0),
        ),
    ]
}
