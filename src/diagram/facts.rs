//! The figure's numbers in words. In: the scene. Out: caption lines and the description of the file.

use super::parts::Scene;
use super::section::{Pierce, View};
use super::whereabouts::cut;
use super::words::{length, length_among, short};
use crate::camera::{Camera, Standard};
use crate::geometry::Line;
use crate::optics::DepthOfField;

/// Short facts for the caption; variables between asterisks.
pub(crate) fn lines(scene: &Scene, circle: f64) -> Vec<String> {
    let optics = scene.optics;
    let camera = optics.camera();
    let f = length(optics.focal_length());
    let mut facts = Vec::new();
    let radius = optics.aperture_radius();
    facts.push(if radius > 0.0 {
        format!("*f* = {f}, *f*/{}, *c* = {}", short(optics.focal_length() / (2.0 * radius)), length(circle))
    } else {
        format!("*f* = {f}, pinhole")
    });
    facts.extend(moved(camera, ["front:", "rear:"]));
    facts.push(focus(scene));
    if let Some(depth) = depth(scene) {
        facts.push(depth);
    }
    facts.extend(rules(scene));
    facts
}

/// The description of the file: whole sentences, no markup.
pub(crate) fn describe(scene: &Scene, circle: f64) -> String {
    let view = match scene.section.view {
        View::Side if scene.section.rail_level => "Side view, rail level,",
        View::Side => "Side view",
        View::Top => "Top view",
        View::Oblique => "Oblique section",
    };
    let mut text =
        format!("{view} of a view camera through the centre of its lens, the subject to the right.");
    for fact in lines(scene, circle) {
        text.push(' ');
        let plain = fact.replace('*', "");
        text.push_str(&plain);
        text.push(';');
    }
    text.pop();
    text.push('.');
    text
}

/// The movements of the standards that have any, under the names given to front and rear.
pub(crate) fn moved(camera: &Camera, names: [&str; 2]) -> Vec<String> {
    let both = names.into_iter().zip([&camera.front, &camera.rear]);
    both.filter_map(|(name, standard)| movements(standard).map(|m| format!("{name} {m}"))).collect()
}

/// A standard's movements, when it has any.
fn movements(standard: &Standard) -> Option<String> {
    let mut parts = Vec::new();
    for (name, angle) in [("tilt", standard.tilt), ("swing", standard.swing)] {
        if angle.as_degrees() != 0.0 {
            parts.push(format!("{name} {}°", short(angle.as_degrees())));
        }
    }
    for (name, way) in [("rise", standard.rise), ("shift", standard.shift)] {
        if way.as_metres() != 0.0 {
            parts.push(format!("{name} {} mm", short(way.as_millimetres())));
        }
    }
    (!parts.is_empty()).then(|| parts.join(", "))
}

fn focus(scene: &Scene) -> String {
    match scene.optics.axis_crossing(scene.optics.focus_plane()) {
        Some(t) if t > 0.0 => {
            let limits = scene.depth.and_then(|depth| limits(scene, &depth));
            let apart = limits.map_or(f64::INFINITY, |[near, far]| far - near);
            format!("focused at {} on the axis", length_among(t, apart))
        }
        Some(_) => "focus plane does not cross the axis ahead".to_owned(),
        None if scene.optics.hinge_line().is_at_infinity() => "focused at infinity".to_owned(),
        None => "focus plane parallel to the axis".to_owned(),
    }
}

fn depth(scene: &Scene) -> Option<String> {
    let depth = scene.depth?;
    let [near, far] = limits(scene, &depth)?;
    if far == f64::INFINITY {
        return Some(format!("sharp from {} to infinity", length(near)));
    }
    Some(match [near, far].map(|limit| length_among(limit, far - near)) {
        // Closer together than is written.
        [from, to] if from == to => format!("sharp at {from} alone"),
        [from, to] => format!("sharp from {from} to {to}"),
    })
}

/// Where sharpness begins and ends along the axis, metres; it may end at infinity.
fn limits(scene: &Scene, depth: &DepthOfField) -> Option<[f64; 2]> {
    let crossing = |plane| scene.optics.axis_crossing(plane).filter(|&t| t > 0.0);
    let near = crossing(depth.near)?;
    Some(crossing(depth.far).map_or([near, f64::INFINITY], |far| [near.min(far), near.max(far)]))
}

/// Whether all is sharp along the axis from somewhere on.
pub(crate) fn is_sharp_to_infinity(scene: &Scene) -> bool {
    let limits = scene.depth.and_then(|depth| limits(scene, &depth));
    limits.is_some_and(|[_, far]| far == f64::INFINITY)
}

fn rules(scene: &Scene) -> Vec<String> {
    let optics = scene.optics;
    let lines = [("Scheimpflug line", optics.scheimpflug_line()), ("hinge line", optics.hinge_line())];
    if lines.iter().all(|(_, line)| line.is_at_infinity()) {
        return vec!["Scheimpflug line and hinge line at infinity".to_owned()];
    }
    lines
        .iter()
        .map(|(name, line)| format!("{name} {}", where_is(scene, *line, *name == "hinge line")))
        .collect()
}

fn where_is(scene: &Scene, line: Line, hinge: bool) -> String {
    let distance = length(line.distance_from_origin());
    let j = if hinge { "*J* = " } else { "" };
    match scene.section.pierce(line) {
        Pierce::AtInfinity => "at infinity".to_owned(),
        Pierce::At(p) => {
            let cut = cut(&scene.section, line, p);
            match (cut.is_square, hinge) {
                (true, _) => format!("{j}{distance} {}", cut.way),
                (false, true) => format!("{j}{distance}, cut {} {}", cut.distance, cut.way),
                (false, false) => format!("cut {} {}", cut.distance, cut.way),
            }
        }
        Pierce::Parallel | Pierce::Within(..) => format!("{j}{distance} away, parallel to this section"),
    }
}
