//! The Scheimpflug and hinge lines in a panel, and distances. In: a line of the optics. Out: a circle where the section
//! cuts it, or an arrow at the border that says how far off it is; J and f named.

use super::canvas::{Canvas, Label};
use super::display_list::{Fill, Group, Point, Shape};
use super::panel::PageLine;
use super::parts::{Role, Scene, camera_height};
use super::place::Weight;
use super::planes::along;
use super::section::Pierce;
use super::theme::{self, Hue, solid};
use super::whereabouts::{self, Cut};
use super::{extent, words};
use crate::geometry::Line;

/// Page millimetres from the lens within which a panel that shows the camera small does not name these lines.
pub(crate) const NEAR_LENS: f64 = 4.0;

/// The Scheimpflug or hinge line: a circle where the section cuts it, an arrow where that is off the panel.
pub(crate) fn line_point(
    scene: &Scene,
    canvas: &mut Canvas,
    role: Role,
    part: &'static str,
    name: &str,
    line: Line,
    hue: Hue,
) {
    if !scene.shows(part) {
        return;
    }
    let panel = canvas.panel;
    match scene.section.pierce(line) {
        Pierce::AtInfinity => canvas.group(Group::off_page(part, "at-infinity")),
        Pierce::Parallel => canvas.group(Group::off_page(part, "parallel")),
        Pierce::Within(at, to) => {
            let coefficients = [-to[1], to[0], to[1] * at[0] - to[0] * at[1]];
            let ends = panel.line(coefficients).and_then(|l| {
                let reach = 2.0 * panel.reach();
                panel.clip(&l, -reach, reach).map(|(a, b)| (l.point(a), l.point(b)))
            });
            match ends {
                Some((a, b)) => {
                    canvas.part(part, vec![Shape::line(a, b, solid(hue.line, theme::MEDIUM))]);
                    canvas.label(Label::new(name, hue.word, along(a, b)).beside((a, b), 0.75));
                }
                None => canvas.group(Group::off_page(part, "beyond")),
            }
        }
        Pierce::At(p) => {
            let page = panel.page(p);
            let from_lens = libm::hypot(page[0] - panel.origin[0], page[1] - panel.origin[1]);
            if panel.holds(page, 0.0) {
                let radius = 0.75;
                let fill = Some(Fill::Flat { color: scene.theme.paper, opacity: 1.0 });
                let ring = Shape::circle(page, radius, fill, Some(solid(hue.line, theme::HEAVY)));
                canvas.part(part, vec![ring]);
                canvas.avoid_disk(page, radius + 0.3);
                // So near the lens it is told apart in the inset only.
                if role != Role::Main || from_lens > NEAR_LENS {
                    canvas.label(Label::new(name, hue.word, vec![page]).toward([0.6, 0.8]));
                }
            } else {
                canvas.group(Group::off_page(part, "beyond"));
                let Cut { distance, way, .. } = whereabouts::cut(&scene.section, line, p);
                // The arrow shows the way; what lies two ways needs no more room for both.
                let way = if way.contains(" and ") { "away" } else { &way };
                border_arrow(canvas, role, &format!("{name}\n{distance} {way}"), p, hue);
            }
        }
    }
}

/// At the border, the way from the lens centre to a section point that lies off the panel.
fn border_arrow(canvas: &mut Canvas, role: Role, words: &str, p: [f64; 2], hue: Hue) {
    let panel = canvas.panel;
    let length = libm::hypot(p[0], p[1]);
    let to = [p[0] / length, -p[1] / length];
    let ray = PageLine { at: panel.origin, along: to };
    let Some((_, mut border)) = panel.clip(&ray, 0.0, 2.0 * panel.reach()) else { return };
    // Two arrows that would cover each other stand one behind the other.
    if canvas.arrows.iter().any(|&p| distance(p, ray.point(border)) < 2.2) {
        border -= 7.5;
    }
    canvas.arrows.push(ray.point(border));
    let tip = ray.point(border - 0.4);
    let back = ray.point(border - 2.6);
    let tail = ray.point((border - 7.0).max(0.0));
    let side = [-to[1] * 0.85, to[0] * 0.85];
    let head = [tip, [back[0] + side[0], back[1] + side[1]], [back[0] - side[0], back[1] - side[1]]];
    canvas.part(
        "arrow",
        vec![
            Shape::line(tail, back, solid(hue.line, theme::HEAVY)),
            Shape::polyline(&head, true, Some(Fill::Flat { color: hue.line, opacity: 1.0 }), None),
        ],
    );
    canvas.avoid(tail, tip, 1.7, Weight::Heavy);
    let middle = ray.point((border - 3.5).max(0.0));
    let label = Label::new(words, hue.word, vec![middle, tail, back]);
    // The main panel shows the line itself, or says where it is; the inset says it where there is room.
    canvas.label(if role == Role::Inset { label.optional() } else { label });
}

/// Where the focus plane is when the panel does not show it.
pub(crate) fn focus_arrow(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let optics = scene.optics;
    let ahead = scene.section.project(optics.axis());
    let plane = optics.focus_plane();
    if plane.is_at_infinity() {
        border_arrow(canvas, role, "focus plane\nat infinity", ahead, scene.theme.focus);
    } else if let Some(t) = extent::crossing(scene, plane) {
        // Along the axis, or what the section shows of it.
        let words = format!("focus plane\n{} ahead", words::length(t * libm::hypot(ahead[0], ahead[1])));
        border_arrow(canvas, role, &words, ahead, scene.theme.focus);
    }
}

/// Merklinger's J, from the lens centre to the hinge line, named on the film-parallel plane; where it can be measured there.
pub(crate) fn distance_j(scene: &Scene, canvas: &mut Canvas, hinge: [f64; 2]) {
    if !whereabouts::is_square(&scene.section, scene.optics.hinge_line()) {
        return;
    }
    let panel = canvas.panel;
    let (from, to) = (panel.origin, panel.page(hinge));
    if panel.holds(to, 0.0) && distance(from, to) > 9.0 {
        let at = |t: f64| [from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t];
        let label = Label::new("*J*", canvas.theme.hinge.word, [0.5, 0.65, 0.35, 0.8].map(at).to_vec());
        canvas.label(label.toward([1.0, 0.0]).adjacent());
    }
}

/// The focal length, dimensioned under the camera from lens to front focal plane.
pub(crate) fn dimension_f(scene: &Scene, canvas: &mut Canvas) {
    let panel = canvas.panel;
    let a = scene.optics.axis();
    if !scene.section.holds(a) {
        return;
    }
    let along = scene.section.project(a);
    let (along, down) = ([along[0], -along[1]], [along[1], along[0]]);
    let off = 0.62 * camera_height(scene) * panel.scale + 1.2;
    let long = scene.optics.focal_length() * panel.scale;
    let from = [panel.origin[0] + off * down[0], panel.origin[1] + off * down[1]];
    let at = |t: f64| [from[0] + t * along[0], from[1] + t * along[1]];
    let to = at(long);
    if !(long > 7.0 && panel.holds(from, 1.5) && panel.holds(to, 1.5)) {
        return;
    }
    let color = scene.theme.quiet;
    let mut shapes = vec![Shape::line(from, to, solid(color, theme::HAIR))];
    for (tip, back) in [(from, at(1.6)), (to, at(long - 1.6))] {
        let side = [0.45 * down[0], 0.45 * down[1]];
        let head = [tip, [back[0] + side[0], back[1] + side[1]], [back[0] - side[0], back[1] - side[1]]];
        shapes.push(Shape::polyline(&head, true, Some(Fill::Flat { color, opacity: 1.0 }), None));
    }
    canvas.part("dimension", shapes);
    canvas.avoid(from, to, theme::THIN, Weight::Light);
    let anchors = [0.5, 0.4, 0.6, 0.3, 0.7].map(|t| at(t * long));
    canvas.label(Label::new("*f*", scene.theme.ink, anchors.to_vec()).toward(down).optional());
}

pub(crate) fn distance(p: Point, q: Point) -> f64 {
    libm::hypot(p[0] - q[0], p[1] - q[1])
}
