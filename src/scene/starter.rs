//! A first scene for a model. In: statistics of its triangles, in the model's own units; out: the text of a
//! commented scene file whose camera has the whole model in the frame.
//!
//! Three kinds of model are told apart by how much of its bounding box has faces near it that face inward:
//! an object or a landscape (the camera stands in front, a little above and to the right), a room open
//! on one side (the camera looks in), and a closed room (the camera stands inside, at one end).
//! The front is +z, up is +y, as most OBJ files have it.

use crate::camera::unit;
use glam::DVec3;
use std::fmt::Write as _;

/// How much of one side of the bounding box is covered by faces within 15% of the box from it, as seen square to
/// the side; more than 1 where they lie behind each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cover {
    /// By faces that look into the box.
    pub inward: f64,
    /// By faces that look out of it.
    pub outward: f64,
}

/// What [`scene_for`] needs to know of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Least and greatest corner of the triangles, in the model's units.
    pub bounds: [DVec3; 2],
    /// For x, y, z: the lower and the upper side of the box.
    pub cover: [[Cover; 2]; 3],
}

/// Measures triangles (corners in the model's units, counter-clockwise seen from outside); `None` without any
/// or with a corner that is not finite.
pub fn measure(triangles: impl Iterator<Item = [DVec3; 3]> + Clone) -> Option<Statistics> {
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for corner in triangles.clone().flatten() {
        if !corner.is_finite() {
            return None;
        }
        bounds = [bounds[0].min(corner), bounds[1].max(corner)];
    }
    let size = bounds[1] - bounds[0];
    if !size.is_finite() {
        return None;
    }
    let mut cover = [[Cover::default(); 2]; 3];
    for [a, b, c] in triangles {
        let area = (b - a).cross(c - a) / 2.0;
        for (axis, sides) in cover.iter_mut().enumerate() {
            let whole = size[(axis + 1) % 3] * size[(axis + 2) % 3];
            if whole <= 0.0 {
                continue;
            }
            for (side, (cover, sign)) in sides.iter_mut().zip([-1.0, 1.0]).enumerate() {
                let near = |p: DVec3| (p[axis] - bounds[side][axis]).abs() <= 0.15 * size[axis];
                if near(a) && near(b) && near(c) {
                    let out = sign * area[axis] / whole;
                    cover.outward += out.max(0.0);
                    cover.inward += (-out).max(0.0);
                }
            }
        }
    }
    Some(Statistics { bounds, cover })
}

/// Film of the generated camera: 4x5 inch.
const FILM_M: [f64; 2] = [0.120, 0.096];
/// Room left around the model.
const MARGIN: f64 = 1.2;

/// What the camera shall be, in metres.
struct View {
    eye: DVec3,
    look_at: DVec3,
    focal_mm: f64,
    near: f64,
    focus: String,
    why: &'static str,
    sun: DVec3,
}

/// The text of a scene with the model `model_path` (as the scene file shall name it) in the frame.
///
/// It reads as a valid scene for every `statistics` and every relative path.
pub fn scene_for(statistics: &Statistics, model_path: &str) -> String {
    let finite = statistics.bounds.iter().all(|corner| corner.is_finite());
    let [lo, hi] = if finite { statistics.bounds } else { [DVec3::ZERO, DVec3::ONE] };
    let size = (hi - lo).max_element();
    let (scale, why_scale) = plausible_scale(size);
    let [lo, hi] = [lo * scale, hi * scale];
    let wall = |axis: usize, side: usize| statistics.cover[axis][side].inward > 0.6;
    let open = |axis: usize, side: usize| {
        let cover = statistics.cover[axis][side];
        cover.inward + cover.outward < 0.25
    };
    let walls: Vec<(usize, usize)> = [(2, 1), (0, 1), (0, 0), (2, 0)].into();
    let opening = walls.iter().find(|&&(axis, side)| {
        open(axis, side) && walls.iter().all(|&(a, s)| (a, s) == (axis, side) || wall(a, s))
    });
    let floor = wall(1, 0);
    let view = match opening {
        Some(&(axis, side)) if floor => into_room(lo, hi, axis, side),
        _ if floor && walls.iter().all(|&(axis, side)| wall(axis, side)) => inside_room(lo, hi),
        _ => outside(lo, hi),
    };
    text(&view, model_path, scale, &why_scale, hi - lo)
}

/// Metres per model unit that make a model between 0.3 m and 100 m large, and the reason in words.
fn plausible_scale(size: f64) -> (f64, String) {
    if !(size > 0.0 && size.is_finite()) {
        return (1.0, "metres per unit of the model".into());
    }
    let found = format!("the model is {} units large", short(size));
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

/// The least distance from `centre` along `back` from which a box fits into the frame, focused there.
fn distance_to_fit(half: DVec3, back: DVec3, focal: f64) -> f64 {
    let Some(right) = unit(DVec3::Y.cross(back)) else { return 4.0 * focal };
    let up = back.cross(right);
    let mut distance = 4.0 * focal;
    // The extension grows as the camera comes nearer, which narrows the field; each round starts from a
    // better distance, and the change falls by at least f / distance < 1/4 each time.
    for _ in 0..20 {
        let extension = focal * distance / (distance - focal);
        let mut needed = 4.0 * focal;
        for corner in 0..8 {
            let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let p = half * DVec3::new(sign(0), sign(1), sign(2));
            let across = (p.dot(right).abs() / FILM_M[0]).max(p.dot(up).abs() / FILM_M[1]);
            needed = f64::max(needed, p.dot(back) + 2.0 * MARGIN * extension * across);
        }
        distance = needed;
    }
    distance
}

fn outside(lo: DVec3, hi: DVec3) -> View {
    let (centre, half) = ((lo + hi) / 2.0, (hi - lo) / 2.0);
    let back = unit(DVec3::new(0.35, 0.45, 1.0)).unwrap_or(DVec3::Z);
    let distance = distance_to_fit(half, back, 0.150);
    let eye = centre + back * distance;
    let flat = half.y < 0.35 * half.x.max(half.z);
    let (focus, why) = if flat {
        (
            plane(DVec3::new(centre.x, lo.y, centre.z), DVec3::Y, (hi - lo).max_element()),
            "the ground: the lens tilts forward until all of it is sharp",
        )
    } else {
        let toward = unit(DVec3::new(back.x, 0.0, back.z)).unwrap_or(DVec3::Z);
        (
            plane(centre, toward, (hi - lo).max_element()),
            "an upright plane through the model's middle, facing the camera",
        )
    };
    let nearest = distance - half.length();
    View {
        eye,
        look_at: centre,
        focal_mm: 150.0,
        near: (nearest / 2.0).max(distance / 100.0),
        focus,
        why,
        sun: DVec3::new(-0.4, 1.0, 0.7),
    }
}

fn into_room(lo: DVec3, hi: DVec3, axis: usize, side: usize) -> View {
    let (centre, half) = ((lo + hi) / 2.0, (hi - lo) / 2.0);
    let mut back = DVec3::ZERO;
    back[axis] = if side == 1 { 1.0 } else { -1.0 };
    let distance = distance_to_fit(half, back, 0.150);
    View {
        eye: centre + back * distance,
        look_at: centre,
        focal_mm: 150.0,
        near: ((distance - half[axis]) / 2.0).max(0.015),
        focus: plane(centre, back, (hi - lo).max_element()),
        why: "a plane across the middle of the room, facing the camera",
        sun: back + DVec3::new(0.2, 0.6, 0.1),
    }
}

fn inside_room(lo: DVec3, hi: DVec3) -> View {
    let size = hi - lo;
    let axis = if size.x >= size.z { 0 } else { 2 };
    let centre = (lo + hi) / 2.0;
    let height = lo.y + (0.4 * size.y).min(1.7);
    let (mut eye, mut look_at) = (centre, centre);
    eye[axis] = lo[axis] + 0.2 * size[axis];
    look_at[axis] = hi[axis];
    (eye.y, look_at.y) = (height, height);
    // The floor's hinge lies a camera's height below the lens, which must be more than the focal length.
    let focal = (0.090_f64).min((height - lo.y) / 3.0).max(0.001);
    let back = if axis == 0 { DVec3::NEG_X } else { DVec3::NEG_Z };
    View {
        eye,
        look_at,
        focal_mm: focal * 1000.0,
        near: 0.05_f64.min(0.05 * size[axis]),
        focus: plane(DVec3::new(centre.x, lo.y, centre.z), DVec3::Y, (hi - lo).max_element()),
        why: "the floor: the lens tilts forward until all of it is sharp",
        sun: back * 0.3 + DVec3::new(0.2, 1.0, 0.2),
    }
}

fn plane(through: DVec3, normal: DVec3, size: f64) -> String {
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
f_number = 5.6
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
color = [0.8, 0.77, 0.7]
shadows = true

[sky]
ambient = [0.25, 0.28, 0.33]
horizon = [0.75, 0.82, 0.9]
zenith = [0.25, 0.45, 0.8]

[render]
width = 960
samples = 64                    # more is smoother and slower
",
        short(size.x),
        short(size.y),
        short(size.z),
        point(view.eye, size.max_element()),
        point(view.look_at, size.max_element()),
        number(view.focal_mm),
        number(view.near),
        view.why,
        view.focus,
        number(scale),
        why_scale.trim_end(),
        direction(view.sun),
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

fn short(value: f64) -> String {
    number(value)
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
