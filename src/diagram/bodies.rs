//! What has a body: lens, film, bellows and subject. In: the scene. Out: their sections, true to scale but for the
//! bellows and the lens board, which are symbols.

use super::canvas::{Canvas, Label};
use super::display_list::{Fill, Geometry, Group, Point, Segment, Shape, Stroke};
use super::parts::{Role, Scene, camera_height};
use super::place::Weight;
use super::subject;
use super::theme::{self, solid};
use glam::DVec3;

pub(crate) fn draw_subject(scene: &Scene, canvas: &mut Canvas) -> Option<Vec<Point>> {
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
    let shape = Shape { geometry: Geometry::Path(path), fill: None, stroke: Some(stroke) };
    canvas.part("subject", vec![shape]);
    // Its highest points name it best.
    let mut tops: Vec<Point> = chains.iter().flatten().copied().collect();
    tops.sort_by(|p, q| p[1].total_cmp(&q[1]).then(p[0].total_cmp(&q[0])));
    tops.truncate(6);
    Some(tops)
}

/// Half the length of the lens board in the section, metres: a symbol, not a size of the camera.
fn board(scene: &Scene) -> f64 {
    (0.36 * camera_height(scene)).max(1.3 * scene.optics.aperture_radius())
}

pub(crate) fn bellows(scene: &Scene, canvas: &mut Canvas) {
    let Some([p, q]) = scene.film else { return };
    let page = |v: DVec3| canvas.panel.page(scene.section.project(v));
    let b = scene.lens * board(scene);
    // Top to top, unless the standards are turned so far that the walls would cross.
    let (p, q) = if (p - q).dot(b) >= 0.0 { (p, q) } else { (q, p) };
    let flat = |v| scene.section.project(v);
    let (p, q) = if cross([flat(p), flat(b)], [flat(q), flat(-b)]) { (q, p) } else { (p, q) };
    let polygon = canvas.panel.clip_polygon(&[page(p), page(b), page(-b), page(q)]);
    let fill = Fill::Flat { color: scene.theme.body, opacity: 0.14 };
    canvas.part("bellows", vec![Shape::polyline(&polygon, true, Some(fill), None)]);
}

/// Whether two segments meet.
fn cross([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let side =
        |a: Point, b: Point, c: Point| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
    side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b)
}

pub(crate) fn camera(scene: &Scene, canvas: &mut Canvas, role: Role) {
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
        if scene.shows("lens-board") {
            canvas.avoid(a, b, weight, Weight::Heavy);
        }
    }
    if scene.shows("lens-board") {
        canvas.part("lens-board", shapes);
    }
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
        let shape = Shape { geometry: Geometry::Path(path), fill: Some(glass), stroke: Some(stroke) };
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
