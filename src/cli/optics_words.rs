//! The same answers for people: what is sharp, where lines and planes pass, in words with units.

use glam::DVec3;
use groundglass::camera::{Aperture, Standard};
use groundglass::error::Warning;
use groundglass::geometry::{Line, Plane};
use groundglass::optics::{Optics, Sensitivity};
use groundglass::scene::Scene;
use std::fmt::Write;

/// A length in the unit that reads best.
pub(crate) fn length(metres: f64) -> String {
    match metres.abs() {
        0.0 => "0 mm".to_owned(),
        v if v < 1e-7 => format!("{:.3e} mm", metres * 1e3),
        v if v < 1e-3 => format!("{:.4} mm", metres * 1e3),
        // As they are rounded.
        v if v < 0.999_995 => format!("{:.2} mm", metres * 1e3),
        v if v < 9_999.999_5 => format!("{metres:.3} m"),
        v if v < 9_999_999.5 => format!("{:.3} km", metres / 1e3),
        _ => format!("{metres:.4e} m"),
    }
}

fn degrees(radians: f64) -> String {
    match radians.to_degrees() {
        small if small != 0.0 && small.abs() < 0.005 => format!("{small:.2e} degrees"),
        angle => format!("{angle:.2} degrees"),
    }
}

/// Where a point lies as the photographer sees it: lens space, so `x` right, `y` up, `-z` toward the subject.
fn place(p: DVec3) -> String {
    let size = p.abs().max_element();
    let parts: Vec<String> =
        [(p.y, "above", "below"), (p.x, "right of", "left of"), (-p.z, "in front of", "behind")]
            .iter()
            .filter(|(value, _, _)| value.abs() > 1e-9 * size)
            .map(|&(value, positive, negative)| {
                format!("{} {}", length(value.abs()), if value > 0.0 { positive } else { negative })
            })
            .collect();
    if parts.is_empty() {
        "through the lens centre".to_owned()
    } else {
        format!("{} the lens centre", parts.join(", "))
    }
}

pub(crate) fn movements(standard: &Standard) -> String {
    let parts: Vec<String> = [
        ("tilt", standard.tilt.as_degrees(), "degrees"),
        ("swing", standard.swing.as_degrees(), "degrees"),
        ("rise", standard.rise.as_millimetres(), "mm"),
        ("shift", standard.shift.as_millimetres(), "mm"),
    ]
    .iter()
    .filter(|(_, value, _)| *value != 0.0)
    .map(|(name, value, unit)| format!("{name} {} {unit}", number(*value)))
    .collect();
    if parts.is_empty() { "no movements".to_owned() } else { parts.join(", ") }
}

/// Four decimals, or an exponent where they would show nothing.
fn number(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 {
        format!("{value:.3e}")
    } else {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

/// The matrices of these lens points, in fractions of the aperture's radius, four rows each; every number reads back exactly.
pub(crate) fn matrices(optics: &Optics, points: &[[f64; 2]]) -> String {
    let radius = optics.aperture_radius();
    let mut text = String::new();
    for [u, v] in points {
        let rows = optics.projection_from_world(u * radius, v * radius).rows;
        for (i, row) in rows.iter().enumerate() {
            let name = if i == 0 { format!("matrix ({u}, {v})") } else { String::new() };
            let numbers: Vec<String> = row.to_array().iter().map(|number| format!("{number:>24e}")).collect();
            let _ = writeln!(text, "{name:<19}{}", numbers.join(" ").trim_end());
        }
    }
    text
}

fn line_words(line: Line, optics: &Optics, up: DVec3) -> String {
    if line.is_at_infinity() {
        return "at infinity (lens and film are parallel)".to_owned();
    }
    let unit = line.normalized();
    let nearest = unit.nearest_to_origin().to_affine();
    let up = optics.world_from_lens().vector_inverse(up);
    let slope = libm::asin(unit.direction.dot(up).abs().min(1.0));
    let lie = if slope < 1e-6 {
        "level".to_owned()
    } else if std::f64::consts::FRAC_PI_2 - slope < 1e-6 {
        "vertical".to_owned()
    } else {
        format!("{} from the horizontal", degrees(slope))
    };
    format!("{}, {lie}; distance {}", place(nearest), length(nearest.length()))
}

fn plane_words(plane: Plane, optics: &Optics, up: DVec3) -> String {
    let unit = plane.normalized();
    if unit.m == DVec3::ZERO {
        return "at infinity".to_owned();
    }
    let cuts = match optics.axis_crossing(plane) {
        None if unit.m.dot(optics.axis()).abs() > 1e-6 => return "at infinity".to_owned(),
        None => "runs parallel to the lens axis".to_owned(),
        Some(along) if along < 0.0 => format!("cuts the lens axis {} behind the lens", length(-along)),
        Some(along) => format!("cuts the lens axis {} in front of the lens", length(along)),
    };
    let world = optics.world_from_lens().vector(unit.m);
    let from_vertical = libm::acos(world.dot(up).abs().min(1.0));
    let stands = if from_vertical < 1e-6 {
        "horizontal".to_owned()
    } else if (from_vertical - std::f64::consts::FRAC_PI_2).abs() < 1e-6 {
        "vertical".to_owned()
    } else {
        format!("{} from the horizontal", degrees(from_vertical))
    };
    let turned = libm::acos(unit.m.dot(optics.axis()).abs().min(1.0));
    let facing = if turned < 1e-6 {
        "square to the lens axis".to_owned()
    } else {
        format!("turned {} from square to the lens axis", degrees(turned))
    };
    format!("{cuts}; {stands}, {facing}")
}

/// The report of `optics` without `--json`; `up` is the world's upward direction.
pub(crate) fn optics_words(optics: &Optics, circle_of_confusion: f64, up: DVec3) -> String {
    let camera = optics.camera();
    let aperture = match camera.aperture {
        Aperture::Pinhole => "pinhole".to_owned(),
        Aperture::FNumber(n) => {
            format!("f/{} ({} wide)", number(n.get()), length(camera.aperture_diameter()))
        }
    };
    let film = camera.film;
    let mut out = String::new();
    let mut say = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<18} {text}");
    };
    say(
        "camera",
        format!(
            "{} lens, {aperture}, on {} x {} mm film",
            length(optics.focal_length()),
            number(film.width.as_millimetres()),
            number(film.height.as_millimetres())
        ),
    );
    say("front standard", movements(&camera.front));
    say("rear standard", movements(&camera.rear));
    say(
        "extension",
        format!("{} mm from lens to film along the rail", number(camera.extension.as_millimetres())),
    );
    say("image circle", image_circle(optics));
    say("sharp", plane_words(optics.focus_plane(), optics, up));
    say("Scheimpflug line", line_words(optics.scheimpflug_line(), optics, up));
    say("hinge line", line_words(optics.hinge_line(), optics, up));
    say("sensitivity", sensitivity(optics));
    match optics.depth_of_field(circle_of_confusion) {
        None => say("depth of field", "without limit: a pinhole".to_owned()),
        Some(dof) => {
            say("circle of conf.", format!("{} on the film", length(circle_of_confusion)));
            say("near limit", plane_words(dof.near, optics, up));
            let far = plane_words(dof.far, optics, up);
            let [n, f] = [dof.near, dof.far].map(|limit| optics.axis_crossing(limit));
            let is_beyond = n.is_some_and(|n| n > 0.0) && f.is_some_and(|f| f < 0.0);
            say(
                "far limit",
                if is_beyond { format!("beyond infinity on the lens axis: its plane {far}") } else { far },
            );
            let (near, far) = (dof.near.m, dof.far.m);
            // Both face the same way, so an angle of more than 90 degrees is one.
            let angle = libm::atan2(near.cross(far).length(), near.dot(far));
            if optics.hinge_line().is_at_infinity() {
                say("wedge", "near and far limits are parallel".to_owned());
            } else {
                say(
                    "wedge",
                    format!("{} between near and far limits, which meet in the hinge line", degrees(angle)),
                );
            }
        }
    }
    out
}

/// What must be set how exactly.
fn sensitivity(optics: &Optics) -> String {
    let Some(found) = optics.sensitivity() else {
        return "no sharp point in the picture is at a finite distance before the lens".to_owned();
    };
    let (name, moves) = found.largest_angle();
    let far = length(found.far_end.length());
    let place = if found.runs_out {
        format!("{far} from the lens, the farthest of nine points of the picture, where it runs out of sight")
    } else {
        format!("its far end, {far} from the lens")
    };
    format!(
        "a change of {} degrees in {name} moves the plane by {} at {place}; {} mm of extension by {}",
        Sensitivity::ANGLE,
        length(moves),
        number(Sensitivity::LENGTH * 1e3),
        length(found.extension),
    )
}

fn image_circle(optics: &Optics) -> String {
    let (angle, diameter) = optics.coverage();
    if diameter == f64::INFINITY {
        let why = if angle < std::f64::consts::FRAC_PI_2 {
            "the lens axis does not meet the film's plane behind the lens: no circle about it holds the film"
        } else {
            "no lens covers the film"
        };
        return format!("{why} ({} of coverage)", degrees(2.0 * angle));
    }
    format!("the film needs {} about the lens axis ({} of coverage)", length(diameter), degrees(2.0 * angle))
}

/// What a photographer should know before using this camera.
pub(crate) fn warnings(optics: &Optics, file: &str) -> Vec<Warning> {
    let warn = |message: String| Warning { file: file.to_owned(), line: None, message };
    optics.cautions().into_iter().map(warn).collect()
}

/// The same of a whole scene: of its camera, and of what that sees of it.
pub(crate) fn scene_warnings(scene: &Scene, file: &str) -> Vec<Warning> {
    let optics = &scene.optics;
    let mut all = warnings(optics, file);
    let near = optics.camera().near.as_metres();
    let is_seen = |corner: DVec3| optics.axis().dot(optics.world_from_lens().point_inverse(corner)) >= near;
    // A mesh of which no corner of the box is seen is not seen either.
    let any_seen = scene.meshes.iter().any(|mesh| {
        (0..8).any(|i| {
            let pick = |axis: usize| mesh.bounds[(i >> axis) & 1][axis];
            is_seen(DVec3::new(pick(0), pick(1), pick(2)))
        })
    });
    if !scene.meshes.is_empty() && !any_seen {
        let message = format!(
            "every mesh lies behind the lens or nearer than near_m ({}): the picture shows the background alone",
            length(near)
        );
        all.push(Warning { file: file.to_owned(), line: None, message });
    }
    all
}
