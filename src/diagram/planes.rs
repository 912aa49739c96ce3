//! Planes in a panel. In: a plane of the optics. Out: its trace, in front solid and behind dotted; the lens axis; the
//! wedge of depth of field between its limits.

use super::canvas::{Canvas, Label};
use super::display_list::{Fill, Group, Point, Shape, Stroke};
use super::lines::distance;
use super::panel::{PageLine, clip_half};
use super::parts::{Role, Scene, camera_height};
use super::place::Weight;
use super::section::Pierce;
use super::theme::{self, broken};
use crate::geometry::Plane;

/// How a plane's trace is drawn.
#[derive(Clone, Copy)]
pub(crate) struct Style {
    /// In front of the plane `split`, or everywhere.
    pub(crate) front: Stroke,
    /// Behind it: dotted, and at most this long unless nothing is in front.
    pub(crate) split: Option<[f64; 3]>,
    pub(crate) behind_at_most: f64,
    pub(crate) weight: Weight,
}

impl Style {
    pub(crate) fn plain(front: Stroke) -> Self {
        Self { front, split: None, behind_at_most: f64::INFINITY, weight: Weight::Light }
    }
}

/// Points along a line's visible piece where a label may hang on.
pub(crate) fn along(a: Point, b: Point) -> Vec<Point> {
    [0.8, 0.65, 0.9, 0.5, 0.35, 0.2, 0.1]
        .iter()
        .map(|t| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t])
        .collect()
}

/// So long (mm) that its name has room along a plane that is drawn for the hinge rule alone.
const NAMED: f64 = 35.0;

/// The span with a point added, so far behind the lens as seen from the hinge, that the plane's name has room along it.
pub(crate) fn long_enough(canvas: &Canvas, span: &[Point]) -> Vec<Point> {
    let mut span = span.to_vec();
    if let [top, bottom, .., end] = span[..] {
        let far = if distance(top, end) > distance(bottom, end) { top } else { bottom };
        let short = NAMED - distance(far, end);
        let away = [far[0] - end[0], far[1] - end[1]];
        let length = libm::hypot(away[0], away[1]).max(1e-12);
        if short > 0.0 && canvas.panel.holds(end, 0.0) {
            span.push([far[0] + away[0] * short / length, far[1] + away[1] * short / length]);
        }
    }
    span
}

/// What the camera's planes shall reach: the standards, and the line they run to (or the border on its side).
pub(crate) fn camera_span(scene: &Scene, canvas: &Canvas, line: Pierce) -> Vec<Point> {
    let half = 0.62 * camera_height(scene);
    let mut span = Vec::new();
    let normal = scene.section.project(scene.optics.axis());
    let length = libm::hypot(normal[0], normal[1]).max(1e-12);
    let up = [-normal[1] / length * half, normal[0] / length * half];
    span.push(canvas.panel.page(up));
    span.push(canvas.panel.page([-up[0], -up[1]]));
    if let Pierce::At(p) = line {
        let length = libm::hypot(p[0], p[1]);
        // Far points only need their direction.
        let most = 4.0 * canvas.panel.reach() / canvas.panel.scale;
        let shrink = if length > most { most / length } else { 1.0 };
        span.push(canvas.panel.page([p[0] * shrink, p[1] * shrink]));
    }
    span
}

/// How long (mm) a limit of sharpness goes on behind the front focal plane: `most`, and not at all where that could not be
/// told from the focus plane.
pub(crate) fn stub(scene: &Scene, limit: Plane, most: f64) -> f64 {
    let [a, b, _] = scene.section.trace(limit.normalized());
    let [c, d, _] = scene.section.trace(scene.optics.focus_plane().normalized());
    let sine = (a * d - b * c).abs() / (libm::hypot(a, b) * libm::hypot(c, d)).max(1e-12);
    if most * sine < 0.8 { 0.0 } else { most }
}

/// Draws a plane's trace; gives the ends of its piece in front.
pub(crate) fn trace(
    scene: &Scene,
    canvas: &mut Canvas,
    part: &'static str,
    plane: Plane,
    style: Style,
    span: Option<&[Point]>,
) -> Option<(Point, Point)> {
    if !scene.shows(part) {
        return None;
    }
    let unit = plane.normalized();
    let coefficients = scene.section.trace(unit);
    let panel = canvas.panel;
    let is_behind = style.split.is_some_and(|split| lies_behind(coefficients, split));
    let Some(line) = panel.line(coefficients) else {
        let flat = coefficients[0].abs().max(coefficients[1].abs()) == 0.0;
        let why = match (unit.is_at_infinity(), flat) {
            (true, _) => "at-infinity",
            (false, true) => "parallel",
            (false, false) if is_behind => "behind",
            (false, false) => "beyond",
        };
        canvas.group(Group::off_page(part, why));
        return None;
    };
    let reach = 2.0 * panel.reach();
    let (mut t0, mut t1) = (-reach, reach);
    if let Some(span) = span {
        let ts = span.iter().map(|&p| line.parameter(p));
        let overshoot = 3.0_f64.min(0.04 * panel.reach());
        t0 = t0.max(ts.clone().fold(f64::INFINITY, f64::min) - overshoot);
        t1 = t1.min(ts.fold(f64::NEG_INFINITY, f64::max) + overshoot);
    }
    let Some((t0, t1)) = panel.clip(&line, t0, t1) else {
        canvas.group(Group::off_page(part, if is_behind { "behind" } else { "beyond" }));
        return None;
    };
    let (front, behind) = match style.split {
        Some(split) => split_at(canvas, &line, t0, t1, split),
        None => (Some((t0, t1)), None),
    };
    let mut shapes = Vec::new();
    if let Some((b0, b1)) = behind {
        // A stub that shows where the line goes on, next to the piece in front.
        let (b0, b1) = match front {
            Some((f0, _)) if f0 >= b1 => (b0.max(b1 - style.behind_at_most), b1),
            Some(_) => (b0, b1.min(b0 + style.behind_at_most)),
            None => (b0, b1),
        };
        if b1 > b0 {
            let stroke = Stroke { width: theme::THIN, dash: theme::DOTTED, ..style.front };
            shapes.push(Shape::line(line.point(b0), line.point(b1), stroke));
            canvas.avoid(line.point(b0), line.point(b1), theme::THIN, Weight::Light);
        }
    }
    let ends = front.map(|(f0, f1)| (line.point(f0), line.point(f1)));
    if let Some((a, b)) = ends {
        shapes.push(Shape::line(a, b, style.front));
        canvas.avoid(a, b, style.front.width, style.weight);
    }
    canvas.part(part, shapes);
    // Labels prefer the far end.
    ends.map(|(a, b)| if far_from(canvas, a) > far_from(canvas, b) { (b, a) } else { (a, b) })
}

fn far_from(canvas: &Canvas, p: Point) -> f64 {
    distance(p, canvas.panel.origin)
}

/// Whether a trace runs along another, on its negative side: so does a far limit beyond infinity.
fn lies_behind([a, b, c]: [f64; 3], [p, q, r]: [f64; 3]) -> bool {
    let (along, across) = (a * p + b * q, a * q - b * p);
    across.abs() <= 1e-9 * along.abs() && r - c * along / (a * a + b * b) < 0.0
}

type Piece = Option<(f64, f64)>;

/// Parts a piece of a line at a plane's trace: what is on its positive side, and the rest.
fn split_at(canvas: &Canvas, line: &PageLine, t0: f64, t1: f64, split: [f64; 3]) -> (Piece, Piece) {
    let value = |t: f64| canvas.panel.evaluate(split, line.point(t));
    let (v0, v1) = (value(t0), value(t1));
    match (v0 > 0.0, v1 > 0.0) {
        (true, true) => (Some((t0, t1)), None),
        (false, false) => (None, Some((t0, t1))),
        (first, _) => {
            let t = t0 + (t1 - t0) * (v0 / (v0 - v1));
            if first { (Some((t0, t)), Some((t, t1))) } else { (Some((t, t1)), Some((t0, t))) }
        }
    }
}

pub(crate) fn axis(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let panel = canvas.panel;
    let a = scene.optics.axis();
    let along = scene.section.project(a);
    let length = libm::hypot(along[0], along[1]);
    let line = PageLine { at: panel.origin, along: [along[0] / length, -along[1] / length] };
    let behind = (0.25 * scene.optics.camera().extension.as_metres() * panel.scale).min(8.0);
    let ends =
        panel.clip(&line, -behind, 2.0 * panel.reach()).map(|(t0, t1)| (line.point(t0), line.point(t1)));
    let stroke = broken(scene.theme.quiet, theme::THIN, theme::AXIS);
    let Some((a_end, b_end)) = ends else {
        canvas.group(Group::off_page("axis", "beyond"));
        return;
    };
    if scene.section.holds(a) {
        canvas.part("axis", vec![Shape::line(a_end, b_end, stroke)]);
    } else {
        // The section cuts the axis in the lens centre alone; its image square to the section is another part.
        canvas.part("axis-projected", vec![Shape::line(a_end, b_end, stroke)]);
        let dot = Fill::Flat { color: scene.theme.quiet, opacity: 1.0 };
        canvas.part("axis", vec![Shape::circle(panel.origin, 0.35, Some(dot), None)]);
    }
    canvas.avoid(a_end, b_end, theme::THIN, Weight::Light);
    if role.names_scene() {
        let at = [0.88, 0.7, 0.55]
            .map(|t| [a_end[0] + (b_end[0] - a_end[0]) * t, a_end[1] + (b_end[1] - a_end[1]) * t]);
        let label = Label::new("lens axis", scene.theme.quiet, at.to_vec()).optional();
        canvas.label(label.beside((a_end, b_end), 0.85));
    }
}

pub(crate) fn wedge(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let Some(depth) = scene.depth else { return };
    let panel = canvas.panel;
    let near = scene.section.trace(depth.near);
    let far = scene.section.trace(depth.far);
    let front = scene.section.trace(scene.optics.front_focal_plane());
    // A point before the front focal plane is within the limits when its image lies between theirs; the
    // planes' covectors are scaled so that this is a sign (see `Optics::depth_of_field`).
    let mut polygon = panel.corners().to_vec();
    polygon = clip_half(&polygon, |p| panel.evaluate(front, p));
    polygon = clip_half(&polygon, |p| panel.evaluate(near, p));
    polygon = clip_half(&polygon, |p| -panel.evaluate(far, p));
    if polygon.len() < 3 || area(&polygon) < 0.01 {
        let is_behind = [near, far].iter().all(|&limit| lies_behind(limit, front));
        let why = match polygon.len() {
            _ if is_behind => "behind",
            0..3 => "beyond",
            // On the page, and narrower than a line.
            _ => "thin",
        };
        canvas.group(Group::off_page("wedge", why));
        return;
    }
    let fade = Fill::Fade {
        color: scene.theme.depth.line,
        from: panel.origin,
        to: [panel.frame[2], panel.origin[1]],
        from_opacity: 0.34,
        to_opacity: 0.1,
    };
    canvas.part("wedge", vec![Shape::polyline(&polygon, true, Some(fade), None)]);
    if role.names_scene() && area(&polygon) > 30.0 {
        let n = polygon.len() as f64;
        let middle = polygon.iter().fold([0.0, 0.0], |m, p| [m[0] + p[0] / n, m[1] + p[1] / n]);
        let mut anchors = vec![middle];
        for p in &polygon {
            anchors.push([0.5 * (middle[0] + p[0]), 0.5 * (middle[1] + p[1])]);
        }
        let label = Label::new("depth|of field", scene.theme.depth.word, anchors).within(polygon);
        canvas.label(label.optional());
    }
}

fn area(polygon: &[Point]) -> f64 {
    let mut twice = 0.0;
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        twice += p[0] * q[1] - p[1] * q[0];
    }
    0.5 * twice.abs()
}
