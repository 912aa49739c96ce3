//! The parts of a camera's section: planes as traces, lines as points, rays, lens, film, wedge, subject.
//! In: the optics in section metres. Out: groups on a [`Canvas`], each with its obstacles and labels.

use super::canvas::{Canvas, Label};
use super::display_list::{Fill, Group, Point, Segment, Shape, Stroke};
use super::panel::{PageLine, Panel, clip_half};
use super::place::Weight;
use super::section::{Pierce, SectionPlane, View};
use super::theme::{self, Hue, Theme, broken, solid};
use super::{subject, words};
use crate::geometry::{HomogeneousPoint, Line, Plane};
use crate::optics::{DepthOfField, Optics};
use glam::DVec3;

/// What all panels of a figure draw from.
pub(crate) struct Scene<'a> {
    pub(crate) optics: &'a Optics,
    pub(crate) section: SectionPlane,
    pub(crate) theme: &'a Theme,
    pub(crate) depth: Option<DepthOfField>,
    /// The ends of the film in the section (lens space), when the section cuts the film.
    pub(crate) film: Option<[DVec3; 2]>,
    /// Along the lens in the section, unit.
    pub(crate) lens: DVec3,
    /// Where the section cuts the subject, section metres.
    pub(crate) subject: Vec<[[f64; 2]; 2]>,
    /// Film points (lens space) that bundles of rays come to.
    pub(crate) bundles: Vec<DVec3>,
}

/// What a panel is for: decides which labels it carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// The only panel.
    Whole,
    /// The scene, the camera small in it.
    Main,
    /// The camera alone.
    Inset,
}

impl Role {
    fn names_camera(self) -> bool {
        self != Self::Main
    }

    fn names_scene(self) -> bool {
        self != Self::Inset
    }
}

/// How a plane's trace is drawn.
#[derive(Clone, Copy)]
struct Style {
    /// In front of the plane `split`, or everywhere.
    front: Stroke,
    /// Behind it: dotted, and at most this long unless nothing is in front.
    split: Option<[f64; 3]>,
    behind_at_most: f64,
    weight: Weight,
}

impl Style {
    fn plain(front: Stroke) -> Self {
        Self { front, split: None, behind_at_most: f64::INFINITY, weight: Weight::Light }
    }
}

/// Draws everything of the section into one panel.
pub(crate) fn draw(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let optics = scene.optics;
    let theme = scene.theme;
    wedge(scene, canvas, role);
    let subject = draw_subject(scene, canvas);
    bellows(scene, canvas);
    for &point in &scene.bundles {
        pencil(scene, canvas, point);
    }
    let hinge = scene.section.pierce(optics.hinge_line());
    let scheimpflug = scene.section.pierce(optics.scheimpflug_line());
    let toward_hinge = camera_span(scene, canvas, hinge);
    let toward_scheimpflug = camera_span(scene, canvas, scheimpflug);
    let thin = |hue: Hue| Style::plain(solid(hue.line, theme::THIN));
    let dashed = |hue: Hue| Style::plain(broken(hue.line, theme::THIN, theme::DASHED));
    let lens_plane =
        trace(scene, canvas, "lens-plane", optics.lens_plane(), thin(theme.lens), Some(&toward_scheimpflug));
    let film_plane =
        trace(scene, canvas, "film-plane", optics.film_plane(), thin(theme.film), Some(&toward_scheimpflug));
    let parallel = trace(
        scene,
        canvas,
        "film-parallel",
        optics.film_parallel_plane(),
        dashed(theme.hinge),
        Some(&toward_hinge),
    );
    let focal = trace(
        scene,
        canvas,
        "front-focal-plane",
        optics.front_focal_plane(),
        dashed(theme.hinge),
        Some(&toward_hinge),
    );
    axis(scene, canvas, role);
    let mut limits = Vec::new();
    for (part, plane) in
        [("near-plane", scene.depth.map(|d| d.near)), ("far-plane", scene.depth.map(|d| d.far))]
    {
        let Some(plane) = plane else { continue };
        let style = Style {
            front: solid(theme.depth.line, theme::MEDIUM),
            split: Some(scene.section.trace(optics.front_focal_plane())),
            behind_at_most: 5.0,
            weight: Weight::Light,
        };
        limits.push((part, trace(scene, canvas, part, plane, style, None)));
    }
    let focus_style = Style {
        front: solid(theme.focus.line, 0.6),
        split: Some(scene.section.trace(optics.lens_plane())),
        behind_at_most: f64::INFINITY,
        weight: Weight::Heavy,
    };
    let focus = trace(scene, canvas, "focus-plane", optics.focus_plane(), focus_style, None);
    for &point in &scene.bundles {
        rays(scene, canvas, point);
    }
    camera(scene, canvas, role);
    // Arrows and points first: they have the least freedom.
    line_point(
        scene,
        canvas,
        role,
        "scheimpflug-line",
        "Scheimpflug|line",
        optics.scheimpflug_line(),
        theme.lens,
    );
    line_point(scene, canvas, role, "hinge-line", "hinge line", optics.hinge_line(), theme.hinge);
    if role.names_scene() {
        match focus {
            Some((a, b)) => canvas.label(Label::new("focus plane", theme.focus.word, along(a, b))),
            None => focus_arrow(scene, canvas, role),
        }
        for (part, ends) in limits {
            if let Some((a, b)) = ends {
                let words = if part == "near-plane" { "near plane" } else { "far plane" };
                canvas.label(Label::new(words, theme.depth.word, along(a, b)));
            }
        }
    }
    if let Some(tops) = subject
        && role.names_scene()
    {
        canvas.label(Label::new("subject", theme.subject.word, tops).toward([0.0, -1.0]).optional());
    }
    if let Pierce::At(p) = hinge
        && role.names_scene()
    {
        distance_j(canvas, p);
    }
    if role.names_camera() {
        dimension_f(scene, canvas);
        let name = |canvas: &mut Canvas, ends: Option<(Point, Point)>, words: &str, hue: Hue, at: f64| {
            if let Some((a, b)) = ends {
                let anchors =
                    [at, 0.15 + 0.7 * at, 1.0 - at, 0.85 - 0.7 * at, 0.3 + 0.4 * at, 0.7 - 0.4 * at, 0.5]
                        .map(|t| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]);
                canvas.label(Label::new(words, hue.word, anchors.to_vec()));
            }
        };
        name(canvas, lens_plane, "lens|plane", theme.lens, 0.95);
        name(canvas, film_plane, "film|plane", theme.film, 0.95);
        let tilted = optics.axis().cross(optics.film_normal()).length() > 1e-3;
        if tilted {
            name(canvas, parallel, "film-parallel|plane", theme.hinge, 0.05);
        }
        name(canvas, focal, "front focal|plane", theme.hinge, 0.05);
    }
}

/// Where the focus plane is when the panel does not show it.
fn focus_arrow(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let optics = scene.optics;
    let ahead = scene.section.project(optics.axis());
    let plane = optics.focus_plane();
    if plane.is_at_infinity() {
        border_arrow(canvas, role, "focus plane\nat infinity", ahead, scene.theme.focus);
    } else if let Some(t) = super::extent::crossing(scene, plane) {
        let words = format!("focus plane\n{} ahead", words::length(t));
        border_arrow(canvas, role, &words, ahead, scene.theme.focus);
    }
}

/// Merklinger's J, from the lens centre to the hinge line, named on the film-parallel plane.
fn distance_j(canvas: &mut Canvas, hinge: [f64; 2]) {
    let panel = canvas.panel;
    let (from, to) = (panel.origin, panel.page(hinge));
    if panel.holds(to, 0.0) && distance(from, to) > 9.0 {
        let at = |t: f64| [from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t];
        let label = Label::new("*J*", canvas.theme.hinge.word, [0.5, 0.65, 0.35, 0.8].map(at).to_vec());
        canvas.label(label.toward([1.0, 0.0]).optional());
    }
}

/// The focal length, dimensioned under the camera from lens to front focal plane.
fn dimension_f(scene: &Scene, canvas: &mut Canvas) {
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

/// Points along a line's visible piece where a label may hang on.
fn along(a: Point, b: Point) -> Vec<Point> {
    [0.8, 0.65, 0.9, 0.5, 0.35, 0.2, 0.1]
        .iter()
        .map(|t| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t])
        .collect()
}

/// What the camera's planes shall reach: the standards, and the line they run to (or the border on its side).
fn camera_span(scene: &Scene, canvas: &Canvas, line: Pierce) -> Vec<Point> {
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

/// The larger of film and lens in the section, metres.
pub(crate) fn camera_height(scene: &Scene) -> f64 {
    let film = scene.film.map_or(0.0, |[p, q]| (q - p).length());
    film.max(2.0 * scene.optics.aperture_radius()).max(0.2 * scene.optics.focal_length())
}

/// Draws a plane's trace; gives the ends of its piece in front.
fn trace(
    scene: &Scene,
    canvas: &mut Canvas,
    part: &'static str,
    plane: Plane,
    style: Style,
    span: Option<&[Point]>,
) -> Option<(Point, Point)> {
    let unit = plane.normalized();
    let coefficients = scene.section.trace(unit);
    let panel = canvas.panel;
    let Some(line) = panel.line(coefficients) else {
        let flat = coefficients[0].abs().max(coefficients[1].abs()) == 0.0;
        let why = match (unit.is_at_infinity(), flat) {
            (true, _) => "at-infinity",
            (false, true) => "parallel",
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
        canvas.group(Group::off_page(part, "beyond"));
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
        let stroke = Stroke { width: theme::THIN, dash: theme::DOTTED, ..style.front };
        shapes.push(Shape::line(line.point(b0), line.point(b1), stroke));
        canvas.avoid(line.point(b0), line.point(b1), theme::THIN, Weight::Light);
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

fn distance(p: Point, q: Point) -> f64 {
    libm::hypot(p[0] - q[0], p[1] - q[1])
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

/// The Scheimpflug or hinge line: a circle where the section cuts it, an arrow where that is off the panel.
fn line_point(
    scene: &Scene,
    canvas: &mut Canvas,
    role: Role,
    part: &'static str,
    name: &str,
    line: Line,
    hue: Hue,
) {
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
                    canvas.label(Label::new(name, hue.word, along(a, b)));
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
                if role != Role::Main || from_lens > 4.0 {
                    canvas.label(Label::new(name, hue.word, vec![page]).toward([0.6, 0.8]));
                }
            } else {
                canvas.group(Group::off_page(part, "beyond"));
                let way =
                    format!("{} {}", words::length(line.distance_from_origin()), whither(&scene.section, p));
                border_arrow(canvas, role, &format!("{name}\n{way}"), p, hue);
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

/// The way to a section point in words.
pub(crate) fn whither(section: &SectionPlane, p: [f64; 2]) -> &'static str {
    let upright = section.view != View::Top && section.v.y.abs() >= 0.5;
    match (p[1].abs() >= p[0].abs(), upright) {
        (true, true) => {
            if p[1] * section.v.y >= 0.0 {
                "above"
            } else {
                "below"
            }
        }
        // Without a clear up the section's own up is the camera's left or right.
        (true, false) => {
            if p[1] * section.v.x <= 0.0 {
                "to the left"
            } else {
                "to the right"
            }
        }
        (false, _) => {
            if p[0] >= 0.0 {
                "ahead"
            } else {
                "behind"
            }
        }
    }
}

fn axis(scene: &Scene, canvas: &mut Canvas, role: Role) {
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
        canvas.label(Label::new("lens axis", scene.theme.quiet, at.to_vec()).optional());
    }
}

fn wedge(scene: &Scene, canvas: &mut Canvas, role: Role) {
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
        canvas.group(Group::off_page("wedge", "beyond"));
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

fn draw_subject(scene: &Scene, canvas: &mut Canvas) -> Option<Vec<Point>> {
    if scene.subject.is_empty() {
        return None;
    }
    let chains = subject::chains(&scene.subject, &canvas.panel);
    if chains.is_empty() {
        canvas.group(Group::off_page("subject", "beyond"));
        return None;
    }
    let mut path = Vec::new();
    for chain in &chains {
        for (i, &p) in chain.iter().enumerate() {
            path.push(if i == 0 { Segment::Move(p) } else { Segment::Line(p) });
        }
        for pair in chain.windows(2) {
            canvas.avoid(pair[0], pair[1], theme::MEDIUM, Weight::Soft);
        }
    }
    let stroke = Stroke { round: true, ..solid(scene.theme.subject.line, 0.25) };
    let shape =
        Shape { geometry: super::display_list::Geometry::Path(path), fill: None, stroke: Some(stroke) };
    canvas.part("subject", vec![shape]);
    // Its highest points name it best.
    let mut tops: Vec<Point> = chains.iter().flatten().copied().collect();
    tops.sort_by(|p, q| p[1].total_cmp(&q[1]).then(p[0].total_cmp(&q[0])));
    tops.truncate(6);
    Some(tops)
}

/// Where the bundle through a film point meets the subject side: a page point, or a direction for each lens point.
fn conjugate(scene: &Scene, point: DVec3) -> Option<[f64; 2]> {
    let q = scene.optics.object_of(HomogeneousPoint::finite(point));
    // Behind the lens the film point has a.p < 0; its conjugate is real when the weight is negative.
    (q.w < 0.0).then(|| scene.section.project(q.to_affine())).filter(|p| p[0].is_finite() && p[1].is_finite())
}

/// Film points whose bundles are drawn: two far apart, with their sharp points in the panel where there are such.
pub(crate) fn bundles(scene: &Scene, panel: &Panel) -> Vec<DVec3> {
    let Some([p, q]) = scene.film else { return Vec::new() };
    let at = |t: f64| 0.5 * (p + q) + (q - p) * (0.5 * t);
    let shown = |t: &f64| conjugate(scene, at(*t)).is_some_and(|x| panel.holds(panel.page(x), 3.0));
    let ladder: Vec<f64> = (-7..=7).map(|i| f64::from(i) * 0.1).filter(shown).collect();
    match (ladder.first(), ladder.last()) {
        (Some(&a), Some(&b)) if b - a > 0.25 => vec![at(a), at(b)],
        (Some(&a), Some(_)) => vec![at(a)],
        // Nothing sharp in sight: parallel or diverging bundles show that as well.
        _ => vec![at(-0.55), at(0.55)],
    }
}

/// The page path of one ray: film point, lens point, and the conjugate point or the frame.
fn ray_path(scene: &Scene, canvas: &Canvas, point: DVec3, lens: DVec3) -> Option<[Point; 3]> {
    let panel = canvas.panel;
    let optics = scene.optics;
    let (fx, fy) = optics.film_axes();
    let (ex, ey) = optics.lens_axes();
    let beside = point - optics.film_center();
    let ray = optics.ray(ex.dot(lens), ey.dot(lens), fx.dot(beside), fy.dot(beside));
    let start = panel.page(scene.section.project(point));
    let middle = panel.page(scene.section.project(ray.origin));
    if !panel.holds(start, 0.0) || !panel.holds(middle, 0.0) {
        return None;
    }
    if let Some(p) = conjugate(scene, point).map(|p| panel.page(p))
        && panel.holds(p, 0.0)
    {
        return Some([start, middle, p]);
    }
    let d = scene.section.project(ray.direction);
    let length = libm::hypot(d[0], d[1]);
    let line = PageLine { at: middle, along: [d[0] / length, -d[1] / length] };
    let (_, end) = panel.clip(&line, 0.0, 2.0 * panel.reach())?;
    Some([start, middle, line.point(end)])
}

/// The soft area between the outermost rays of a bundle.
fn pencil(scene: &Scene, canvas: &mut Canvas, point: DVec3) {
    let rim = scene.lens * scene.optics.aperture_radius();
    if rim == DVec3::ZERO {
        return;
    }
    let (Some(one), Some(two)) = (ray_path(scene, canvas, point, rim), ray_path(scene, canvas, point, -rim))
    else {
        return;
    };
    let polygon = canvas.panel.clip_polygon(&[one[0], one[1], one[2], two[2], two[1]]);
    let fill = Fill::Flat { color: scene.theme.ray.line, opacity: 0.2 };
    canvas.part("ray-bundle", vec![Shape::polyline(&polygon, true, Some(fill), None)]);
}

fn rays(scene: &Scene, canvas: &mut Canvas, point: DVec3) {
    let rim = scene.lens * scene.optics.aperture_radius();
    let lens_points = if rim == DVec3::ZERO { vec![rim] } else { vec![rim, DVec3::ZERO, -rim] };
    for lens in lens_points {
        if let Some(path) = ray_path(scene, canvas, point, lens) {
            let stroke = solid(scene.theme.ray.line, theme::THIN);
            canvas.part("ray", vec![Shape::polyline(&path, false, None, Some(stroke))]);
            canvas.avoid(path[0], path[1], theme::THIN, Weight::Light);
            canvas.avoid(path[1], path[2], theme::THIN, Weight::Light);
        }
    }
}

/// Half the length of the lens board in the section, metres: a symbol, not a size of the camera.
fn board(scene: &Scene) -> f64 {
    (0.36 * camera_height(scene)).max(1.3 * scene.optics.aperture_radius())
}

fn bellows(scene: &Scene, canvas: &mut Canvas) {
    let Some([p, q]) = scene.film else { return };
    let page = |v: DVec3| canvas.panel.page(scene.section.project(v));
    let b = scene.lens * board(scene);
    // Top to top.
    let (p, q) = if (p - q).dot(b) >= 0.0 { (p, q) } else { (q, p) };
    let polygon = canvas.panel.clip_polygon(&[page(p), page(b), page(-b), page(q)]);
    let fill = Fill::Flat { color: scene.theme.body, opacity: 0.14 };
    canvas.part("bellows", vec![Shape::polyline(&polygon, true, Some(fill), None)]);
}

fn camera(scene: &Scene, canvas: &mut Canvas, role: Role) {
    let panel = canvas.panel;
    let theme = scene.theme;
    let page = |v: DVec3| panel.page(scene.section.project(v));
    let (radius, board) = (scene.optics.aperture_radius(), board(scene));
    let size = camera_height(scene) * panel.scale;
    let weight = (0.05 * size).clamp(0.2, 0.6);
    let mut shapes = Vec::new();
    for side in [1.0, -1.0] {
        let (a, b) = (page(scene.lens * (side * radius)), page(scene.lens * (side * board)));
        shapes.push(Shape::line(a, b, solid(theme.body, weight)));
        canvas.avoid(a, b, weight, Weight::Heavy);
    }
    canvas.part("lens-board", shapes);
    if radius > 0.0 {
        // The sag of each face is an eighth of the aperture; the glass is drawn in the section at its true height.
        let axis = scene.section.project(scene.optics.axis());
        let length = libm::hypot(axis[0], axis[1]).max(1e-12);
        let sag = 0.34 * radius * panel.scale;
        let (top, bottom) = (page(scene.lens * radius), page(scene.lens * -radius));
        let bulge = |sign: f64| {
            let c = panel.origin;
            [c[0] + sign * 2.0 * sag * axis[0] / length, c[1] - sign * 2.0 * sag * axis[1] / length]
        };
        let path = vec![
            Segment::Move(top),
            Segment::Quad(bulge(1.0), bottom),
            Segment::Quad(bulge(-1.0), top),
            Segment::Close,
        ];
        let glass = Fill::Flat { color: theme.glass, opacity: 0.75 };
        let stroke =
            Stroke { round: true, ..solid(theme.lens.line, (0.08 * radius * panel.scale).clamp(0.15, 0.35)) };
        let shape = Shape {
            geometry: super::display_list::Geometry::Path(path),
            fill: Some(glass),
            stroke: Some(stroke),
        };
        canvas.part("lens", vec![shape]);
        canvas.avoid(top, bottom, 2.0 * sag + 0.3, Weight::Heavy);
    } else {
        let dot = Shape::circle(panel.origin, 0.5, None, Some(solid(theme.lens.line, theme::MEDIUM)));
        canvas.part("lens", vec![dot]);
        canvas.avoid_disk(panel.origin, 0.7);
    }
    match scene.film {
        Some([p, q]) => {
            let (a, b) = (page(p), page(q));
            let weight = (0.08 * size).clamp(0.3, 0.9);
            canvas.part("film", vec![Shape::line(a, b, solid(theme.ink, weight))]);
            canvas.avoid(a, b, weight, Weight::Heavy);
            if role.names_camera() {
                let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
                canvas.label(Label::new("film", theme.ink, vec![middle, a, b]).toward([-1.0, 0.0]));
            }
        }
        None => canvas.group(Group::off_page("film", "not-cut")),
    }
    if role.names_camera() {
        let words = if radius > 0.0 { "lens" } else { "pinhole" };
        canvas.label(
            Label::new(words, theme.lens.word, vec![page(scene.lens * radius), page(scene.lens * -radius)])
                .toward([0.7, -0.7]),
        );
    }
}
