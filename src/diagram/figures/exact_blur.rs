//! `kind = "exact-blur"`: where the blur really is so large. In: a camera and multiples of the circle of confusion. Out: in
//! section, the wedge of depth of field, contours along which the exact blur (the largest diameter of its conic on the
//! film) is so many circles, and by how many per cent it is more than one circle on the wedge's planes.

use super::file::Input;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::contour;
use crate::diagram::display_list::{Fill, Geometry, Group, Point, Segment, Shape, Stroke};
use crate::diagram::marks::far;
use crate::diagram::panel::PageLine;
use crate::diagram::parts::Scene;
use crate::diagram::place::Weight;
use crate::diagram::planes::along;
use crate::diagram::theme::{self, solid};
use crate::diagram::words::{exact, length, short};
use crate::error::{Error, Result};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Keys {
    /// Blurs along whose contours lines are drawn, as multiples of the circle of confusion.
    #[schemars(length(min = 1, max = 6), inner(range(min = 0.01, max = 1000.0)), example = vec![1.0, 2.0])]
    circles: Vec<f64>,
}

impl Default for Keys {
    fn default() -> Self {
        Self { circles: vec![1.0, 2.0] }
    }
}

const SHOWN: [&str; 9] = [
    "bellows",
    "caption",
    "far-plane",
    "focus-plane",
    "hinge-line",
    "label",
    "lens-board",
    "near-plane",
    "wedge",
];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, stage::height, &SHOWN)?;
    let keys: Keys = input.keys()?;
    let scene = stage.scene();
    let optics = scene.optics;
    if optics.aperture_radius() == 0.0 {
        return Err(Error::invalid("a pinhole has no blur").at_key("camera.pinhole"));
    }
    let circle = stage.subject.circle;
    let bounds = stage::around_limits(&scene, scene.depth.as_slice())?;
    let levels: Vec<String> = keys.circles.iter().map(|&level| circles(level)).collect();
    let sentences = [
        format!(
            "Lines: the exact blur is {}, *c* = {}. The wedge's planes take one diameter of the blur for all of it; the \
             signs say by how much the largest is more than *c* there{}.",
            levels.join(", "),
            length(circle),
            if scene.film.is_some() { ", open circles at points beside the picture" } else { "" }
        ),
        stage::camera_sentence(&scene),
    ];
    stage::single(&stage, scene, bounds, "The exact blur and the wedge", &sentences, |scene, canvas| {
        for &level in &keys.circles {
            lines(scene, canvas, (level, circle), &circles(level), (theme::MEDIUM, 0.87));
        }
        view(scene, canvas);
        differences(scene, canvas, circle);
    })
}

/// Rays through the lens centre from the film's ends: between them lies what is in the picture.
fn view(scene: &Scene, canvas: &mut Canvas) {
    let Some(ends) = scene.film else { return };
    let theme = scene.theme;
    for (i, end) in ends.into_iter().enumerate() {
        let way = stage::page_way(scene, -end);
        let line = PageLine { at: canvas.panel.origin, along: way };
        let Some((from, to)) = canvas.panel.clip(&line, 0.0, 2.0 * canvas.panel.reach()) else { continue };
        let (a, b) = (line.point(from), line.point(to));
        canvas.part("picture-edge", vec![Shape::line(a, b, solid(theme.quiet, theme::THIN))]);
        canvas.avoid(a, b, theme::THIN, Weight::Light);
        if i == 0 {
            let label = Label::new("edge of the picture", theme.quiet, along(a, b)).beside((a, b), 0.8);
            canvas.label(label.optional());
        }
    }
}

/// Whether the film sees a point of the section through the lens centre.
fn is_in_picture(scene: &Scene, point: DVec3) -> bool {
    let Some([p, q]) = scene.film else { return true };
    let [p, q, x] = [-p, -q, point].map(|v| scene.section.project(v));
    let side = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    side(p, x) * side(p, q) >= 0.0 && side(q, x) * side(q, p) >= 0.0
}

/// So many circles of confusion, in words.
fn circles(level: f64) -> String {
    if level == 1.0 { "*c*".to_owned() } else { format!("{} *c*", short(level)) }
}

/// The lens-space point of the section at a page point.
fn point(scene: &Scene, canvas: &Canvas, p: Point) -> DVec3 {
    let panel = &canvas.panel;
    let (x, y) = ((p[0] - panel.origin[0]) / panel.scale, (panel.origin[1] - p[1]) / panel.scale);
    scene.section.u * x + scene.section.v * y
}

/// Contours along which the exact blur is so many circles of confusion, so wide; their name best stands at a share of the way
/// along the last piece of one.
pub(crate) fn lines(
    scene: &Scene,
    canvas: &mut Canvas,
    (level, circle): (f64, f64),
    words: &str,
    (width, share): (f64, f64),
) {
    let excess = |p: Point| {
        let blur = scene.optics.blur_of(point(scene, canvas, p))?;
        Some(blur.largest / (level * circle) - 1.0)
    };
    let chains = contour::contours(canvas.panel.frame, excess);
    if chains.is_empty() {
        let data = contour_data(level, circle);
        canvas.group(Group { data, ..Group::off_page("blur-contour", "beyond") });
        return;
    }
    let mut path = Vec::new();
    let mut anchors = Vec::new();
    for chain in &chains {
        for (i, &p) in chain.iter().enumerate() {
            path.push(if i == 0 { Segment::Move(p) } else { Segment::Line(p) });
        }
        for pair in chain.windows(2) {
            canvas.avoid(pair[0], pair[1], width, Weight::Light);
        }
        // Where labels may hang: at the right, where the contours are apart.
        let mut ends: Vec<Point> = chain.iter().copied().step_by(5).collect();
        ends.sort_by(|p, q| q[0].total_cmp(&p[0]));
        anchors.extend(ends.into_iter().take(8));
    }
    anchors.sort_by(|p, q| q[0].total_cmp(&p[0]));
    canvas.data = contour_data(level, circle);
    let stroke = Stroke { round: true, ..solid(scene.theme.lens.line, width) };
    let shape = Shape { geometry: Geometry::Path(path), fill: None, stroke: Some(stroke) };
    canvas.part("blur-contour", vec![shape]);
    canvas.data.clear();
    let label = Label::new(words, scene.theme.lens.word, anchors).toward([0.0, 1.0]);
    // Along the lowest end at the right.
    let ends = chains.iter().flat_map(|chain| end_pieces(chain));
    let end = ends.max_by(|(_, p), (_, q)| (p[0] + p[1]).total_cmp(&(q[0] + q[1])));
    canvas.label(match end {
        Some(piece) => label.beside(piece, share),
        None => label,
    });
}

/// What a contour is of: metres, and circles of confusion.
fn contour_data(level: f64, circle: f64) -> Vec<(&'static str, String)> {
    vec![("data-blur", exact(level * circle)), ("data-circles", exact(level))]
}

/// The last 45 mm of a chain at either end, which are as good as straight.
fn end_pieces(chain: &[Point]) -> Vec<(Point, Point)> {
    let piece = |way: &mut dyn Iterator<Item = &Point>| {
        let end = *way.next()?;
        let start = way.take_while(|p| far(**p, end) <= 45.0).last()?;
        (far(*start, end) > 5.0).then_some((*start, end))
    };
    [piece(&mut chain.iter()), piece(&mut chain.iter().rev())].into_iter().flatten().collect()
}

/// Where along a plane's trace the difference is told: the far end is left to the names.
const SHARES: [f64; 3] = [0.3, 0.5, 0.7];

/// On the near and far planes, how much more than a circle the blur is.
fn differences(scene: &Scene, canvas: &mut Canvas, circle: f64) {
    let Some(depth) = scene.depth else { return };
    let front = scene.section.trace(scene.optics.front_focal_plane());
    for plane in [depth.near, depth.far] {
        let Some(line) = canvas.panel.line(scene.section.trace(plane.normalized())) else { continue };
        let reach = 2.0 * canvas.panel.reach();
        let Some((t0, t1)) = canvas.panel.clip(&line, -reach, reach) else { continue };
        for share in SHARES {
            // From the end nearer to the lens outward.
            let (from, to) = if line.point(t0)[0] < line.point(t1)[0] { (t0, t1) } else { (t1, t0) };
            let p = line.point(from + share * (to - from));
            if canvas.panel.evaluate(front, p) <= 0.0 {
                continue;
            }
            let object = point(scene, canvas, p);
            let Some(blur) = scene.optics.blur_of(object) else { continue };
            let percent = 100.0 * (blur.largest / circle - 1.0);
            let percent = if percent.abs() < 1e-6 { 0.0 } else { percent };
            let color = scene.theme.depth.line;
            let mark = if is_in_picture(scene, object) {
                Shape::circle(p, 0.6, Some(Fill::Flat { color, opacity: 1.0 }), None)
            } else {
                Shape::circle(p, 0.5, None, Some(solid(color, theme::MEDIUM)))
            };
            canvas.data = vec![("data-percent", exact(percent))];
            canvas.part("difference", vec![mark]);
            canvas.data.clear();
            canvas.avoid_disk(p, 0.7);
            let sign = if percent > 0.0 { "+" } else { "" };
            let label =
                Label::new(format!("{sign}{} %", short_percent(percent)), scene.theme.depth.word, vec![p]);
            canvas.label(label.toward([0.0, -1.0]).optional());
        }
    }
}

/// Per cent with one decimal where there is room for meaning, none above ten.
fn short_percent(percent: f64) -> String {
    let text =
        if percent.abs() < 9.95 { format!("{:.1}", percent.abs()) } else { format!("{:.0}", percent.abs()) };
    if percent < 0.0 { format!("−{text}") } else { text }
}
