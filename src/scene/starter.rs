//! A first scene for a model. In: statistics of its triangles, in the model's own units; out: the text of a
//! commented scene file whose camera has the model well in the frame.
//!
//! Four kinds of model are told apart: a room open on one side (the camera looks in), a closed room (the camera
//! stands inside, at one end), a flat sheet (the camera faces it), and anything else, an object or a landscape
//! (the camera stands in front, a little above and to the right). The front is +z, up is +y, as most OBJ
//! files have it. Size and f-number are chosen so that the blur can be seen, and not much more.

use super::starter_view::{STOPS, View, view_of};
use glam::DVec3;
use std::fmt::Write as _;

pub use super::starter_measure::{Cover, Statistics, measure};

/// The text of a scene with the model `model_path` (as the scene file shall name it) in the frame.
///
/// It reads as a valid scene for every relative path without control characters, and all bounds that a scene can have its camera before
/// (1e12 m).
pub fn scene_for(statistics: &Statistics, model_path: &str) -> String {
    let finite = statistics.bounds.iter().all(|corner| corner.is_finite());
    let [lo, hi] = if finite { statistics.bounds } else { [DVec3::ZERO, DVec3::ONE] };
    let size = (hi - lo).max_element();
    let (mut scale, mut why_scale) = plausible_scale(size);
    let mut view = view_of(statistics, [lo, hi], scale);
    // A lens blurs a model as it never blurs a town: by 1, 2, 5 the largest at which blur shows. The scene file
    // takes 1e-12 and more.
    let first = scale;
    for part in [2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0] {
        let smaller = first / part;
        if view.inside || view.f_number >= STOPS[0] || size * smaller < 0.25 || smaller < 1e-12 {
            break;
        }
        scale = smaller;
        why_scale =
            format!("metres per unit: the model is {} units large; so small, its blur shows", number(size));
        view = view_of(statistics, [lo, hi], scale);
    }
    text(&view, model_path, scale, &why_scale, (hi - lo) * scale)
}

/// Metres per model unit that make a model between 0.3 m and 100 m large, and the reason in words.
fn plausible_scale(size: f64) -> (f64, String) {
    if !(size > 0.0 && size.is_finite()) {
        return (1.0, "metres per unit of the model".into());
    }
    let found = format!("the model is {} units large", number(size));
    for (scale, unit) in [(1.0, "metres"), (0.01, "centimetres"), (0.001, "millimetres")] {
        if size * scale <= 100.0 && size * scale >= 0.3 {
            let guess = if scale == 1.0 { "taken as metres" } else { "more likely" };
            return (
                scale,
                format!("metres per unit: {found}, {guess} {}", if scale == 1.0 { "" } else { unit }),
            );
        }
    }
    // Nothing usual fits: bring it to between 1 m and 10 m. Bounded: f64 has some 630 powers of ten.
    let mut scale = 1.0;
    for _ in 0..700 {
        if size * scale > 10.0 {
            scale /= 10.0;
        } else if size * scale < 1.0 {
            scale *= 10.0;
        } else {
            break;
        }
    }
    // The scene file takes 1e-12 to 1e12.
    (
        scale.clamp(1e-12, 1e12),
        format!("metres per unit: {found}, brought to a size that a view camera meets"),
    )
}

fn plane([through, normal]: [DVec3; 2], size: f64) -> String {
    format!("plane = {{ point_m = {}, normal = {} }}", point(through, size), direction(normal))
}

fn text(view: &View, model_path: &str, scale: f64, why_scale: &str, size: DVec3) -> String {
    let mut out = String::new();
    let path = toml::Value::String(model_path.into());
    let _ = write!(
        out,
        "# A first scene, written by `groundglass new`; change whatever you like.
# Lengths of the camera are in millimetres (_mm), those of the world in metres (_m), angles in degrees.
# With the scale below the model is {} x {} x {} m. `groundglass schema` lists every key.

[camera]
eye_m = {}
look_at_m = {}
# up = [0.0, 0.0, 1.0]          # for a model whose z is up: this line, and a new place for the camera
focal_length_mm = {}
f_number = {}
film = \"4x5\"                    # 120 x 96 mm; 35mm, 645, 6x6, 6x7, 6x9, 5x7, 8x10, each also with -portrait
near_m = {}                    # nothing nearer to the lens is seen

[focus]                         # what is sharp; the lens standard and the extension are solved for
# {}
{}
adjust = \"front\"                # the standard that turns: front (lens) or rear (film)

[[mesh]]
path = {path}
scale = {}
# {}

[sun]
toward = {}
color = [0.72, 0.68, 0.6]
shadows = false

[sky]
ambient = [0.25, 0.28, 0.33]
horizon = [0.5, 0.62, 0.78]
zenith = [0.12, 0.27, 0.6]

[render]
width = 960
samples = 64                    # more is smoother and slower
exposure_ev = {}               # brighter by so many stops
",
        number(size.x),
        number(size.y),
        number(size.z),
        point(view.eye, size.max_element()),
        point(view.look_at, size.max_element()),
        number(view.focal * 1000.0),
        number(view.stop()),
        number(coarse(view.near)),
        view.why,
        plane(view.focus, size.max_element()),
        number(scale),
        why_scale.trim_end(),
        direction(view.sun),
        if view.inside { "1.0" } else { "0.0" },
    );
    out
}

/// A direction, rounded so that people can read it.
fn direction(v: DVec3) -> String {
    point(v, v.abs().max_element())
}

/// A point, rounded to a ten thousandth of `size` or finer: a model may stand far from the origin.
fn point(v: DVec3, size: f64) -> String {
    let step = step_below(size);
    let [x, y, z] = v.to_array().map(|value| float((value / step).round() * step));
    format!("[{x}, {y}, {z}]")
}

/// Rounded to four digits or more.
fn number(value: f64) -> String {
    let step = step_below(value.abs());
    float((value / step).round() * step)
}

/// Rounded down to two digits.
fn coarse(value: f64) -> f64 {
    let step = 1000.0 * step_below(value.abs());
    ((value / step).floor() * step).max(value / 2.0)
}

/// A power of ten, 1e-4 to 1e-5 of `value`.
fn step_below(value: f64) -> f64 {
    let mut step = 1e-4;
    for _ in 0..400 {
        if step * 1e5 < value {
            step *= 10.0;
        } else if step * 1e4 > value && step > 1e-300 {
            step /= 10.0;
        } else {
            break;
        }
    }
    step
}

/// A TOML float of at most 15 digits: a rounded value times its step shows the step's own rounding.
fn float(value: f64) -> String {
    let rounded: f64 = format!("{value:.14e}").parse().unwrap_or(value);
    format!("{:?}", rounded + 0.0)
}

#[cfg(test)]
#[path = "starter_tests.rs"]
mod tests;
