//! `kind = "accumulation"`: how pictures through points of the lens add up. In: a camera, how many points. Out: rays from one
//! film point through lens points to the focus plane and on to a farther plane; beside, where each lens point's
//! picture puts a sharp and an unsharp point on the film.

use super::file::Input;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::display_list::{Fill, Group, Item, Point, Shape};
use crate::diagram::extent;
use crate::diagram::lettering;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::place::Weight;
use crate::diagram::sheet::{GUTTER, STRIP, Sheet};
use crate::diagram::theme::{self, broken, solid};
use crate::diagram::words::{exact, length};
use crate::error::{Error, Result};
use crate::geometry::{HomogeneousPoint, Plane};
use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Keys {
    /// Points on the lens's diameter in the section, the outermost on its rim.
    #[schemars(range(min = 2, max = 16), example = 5)]
    points: u32,
    /// How many times farther than the focus plane the unsharp point lies.
    #[schemars(range(min = 1.01, max = 100.0), example = 1.6)]
    farther: f64,
}

impl Default for Keys {
    fn default() -> Self {
        Self { points: 5, farther: 1.6 }
    }
}

const SHOWN: [&str; 5] = ["bellows", "caption", "focus-plane", "label", "lens-board"];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage =
        Stage::read(input, |width| if width < 110.0 { 1.35 * width } else { 0.36 * width + 25.0 }, &SHOWN)?;
    let keys: Keys = input.keys()?;
    let scene = stage.scene();
    let optics = scene.optics;
    if optics.aperture_radius() == 0.0 {
        return Err(Error::invalid("a pinhole has one point: nothing adds up").at_key("camera.pinhole"));
    }
    // The film point in the middle, what it sees sharply, and a point behind that on the middle ray.
    let film = optics.film_center();
    let seen = optics.object_of(HomogeneousPoint::finite(film));
    let sharp = seen.to_affine();
    if !(seen.w < 0.0 && sharp.is_finite() && sharp.length() < 1e4 * optics.focal_length()) {
        return Err(Error::invalid("the middle of the film sees no sharp point within reach")
            .at_key("camera.extension_mm")
            .remedy("focus nearer: a larger extension_mm"));
    }
    let unsharp = sharp * keys.farther;
    // From rim to rim: what they part is the whole blur.
    let mut lens: Vec<DVec3> = (0..keys.points)
        .map(|i| {
            scene.lens * (optics.aperture_radius() * (2.0 * f64::from(i) / f64::from(keys.points - 1) - 1.0))
        })
        .collect();
    // The uppermost on the page first, as the rows beside come.
    if scene.section.project(scene.lens)[1] > 0.0 {
        lens.reverse();
    }
    let bounds = stage::around(&scene, &[scene.section.project(unsharp * 1.12)])?;
    let spread = spread(&scene, &lens, unsharp);
    let sentences = [
        format!(
            "Each lens point makes a picture of its own. All {} put the point in the focus plane, {} from the lens, in one \
             place; they part the point at {} over {} of film: their sum is its blur.",
            keys.points,
            length(sharp.length()),
            length(unsharp.length()),
            length(spread)
        ),
        stage::camera_sentence(&scene),
    ];
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let [left, top, right, bottom] = frame;
    let (main, beside) = if stage.page.size[0] < 110.0 {
        let split = top + 0.5 * (bottom - top);
        ([left, top, right, split - STRIP], [left, split + 2.0, right, bottom])
    } else {
        let split = left + 0.66 * (right - left);
        ([left, top, split, bottom], [split + GUTTER, top, right, bottom])
    };
    let panel = extent::fit(bounds, main, 4.0);
    let mut canvas = Canvas::new(panel, scene.theme);
    parts::draw(&scene, &mut canvas, Role::Whole);
    seen_through(&scene, &mut canvas, &lens, [film, sharp, unsharp]);
    sheet.push(parts::close(&scene, canvas, "main")?);
    sheet.strip(&panel, scene.section.name(), false)?;
    let group = pictures(&scene, &sheet, beside, &lens, [sharp, unsharp])?;
    sheet.items.push(Item::Group(group));
    let words = if is_upright(&scene) {
        ["by lens point; right is up", "right is up"]
    } else {
        ["on the film, by lens point", "by lens point"]
    };
    let [long, short] = words.map(lettering::runs);
    let fits = lettering::width(&long)? * theme::LETTER <= beside[2] - beside[0];
    let words = if fits { long } else { short };
    sheet.items.push(sheet.caption("caption", words, [beside[0], beside[3] + 3.4], theme::LETTER)?);
    stage::end(&stage, sheet, frame, "How pictures add up", &sentences)
}

/// Whether the section goes along the film's height, not its width.
fn is_upright(scene: &Scene) -> bool {
    let (x, y) = scene.optics.film_axes();
    let long = |axis| {
        let [right, up] = scene.section.project(axis);
        libm::hypot(right, up)
    };
    long(y) >= long(x)
}

/// A point's image through a lens point, as height on the film along its trace in the section, metres.
fn height(scene: &Scene, lens: DVec3, point: DVec3) -> f64 {
    let image = scene.optics.film_image(lens, point);
    let (fx, fy) = scene.optics.film_axes();
    let at = (fx * image.x + fy * image.y) / image.z;
    // The way of the film in the section: of its axes, the one that shows more of itself there.
    let way = scene.section.project(if is_upright(scene) { fy } else { fx });
    let image = scene.section.project(at);
    (image[0] * way[0] + image[1] * way[1]) / libm::hypot(way[0], way[1])
}

/// How far the images of a point through these lens points lie apart on the film, metres.
fn spread(scene: &Scene, lens: &[DVec3], point: DVec3) -> f64 {
    let image = |&s: &DVec3| {
        let image = scene.optics.film_image(s, point);
        DVec2::new(image.x, image.y) / image.z
    };
    // On the film, which an oblique section shows from the side.
    let all: Vec<DVec2> = lens.iter().map(image).collect();
    all.iter().flat_map(|a| all.iter().map(|b| a.distance(*b))).fold(0.0, f64::max)
}

/// Rays from the film point through the lens points to the sharp point and on to the plane through the unsharp one.
fn seen_through(scene: &Scene, canvas: &mut Canvas, lens: &[DVec3], [film, sharp, unsharp]: [DVec3; 3]) {
    let optics = scene.optics;
    let theme = scene.theme;
    let page = |canvas: &Canvas, p: DVec3| stage::page_of(scene, &canvas.panel, p);
    let wall = Plane::through(unsharp, optics.film_normal());
    for &s in lens {
        let hit = wall.meet_ray(s, sharp - s).to_affine();
        let path = [film, s, hit].map(|p| page(canvas, p));
        let stroke = solid(theme.ray.line, theme::THIN);
        canvas.part("seen-ray", vec![Shape::polyline(&path, false, None, Some(stroke))]);
        canvas.avoid(path[0], path[1], theme::THIN, Weight::Light);
        canvas.avoid(path[1], path[2], theme::THIN, Weight::Light);
    }
    // The wall that the unsharp point stands in, where it is seen.
    let up = scene.section.project(optics.film_normal());
    let (to, half) = (page(canvas, unsharp), 9.0);
    let normal = libm::hypot(up[0], up[1]).max(1e-12);
    let along = [up[1] / normal, up[0] / normal];
    let ends = [half, -half].map(|t| [to[0] + t * along[0], to[1] + t * along[1]]);
    if let Some((a, b)) = canvas.panel.clip_segment(ends[0], ends[1]) {
        let dashes = broken(theme.quiet, theme::THIN, theme::DASHED);
        canvas.part("far-wall", vec![Shape::line(a, b, dashes)]);
        canvas.avoid(a, b, theme::THIN, Weight::Light);
    }
    for (words, p, hue, aside) in [
        ("sharp point", sharp, theme.focus, [0.3, 0.95]),
        ("unsharp|point", unsharp, theme.depth, [0.95, 0.3]),
    ] {
        let at = page(canvas, p);
        let fill = Fill::Flat { color: hue.line, opacity: 1.0 };
        canvas.part("point", vec![Shape::circle(at, 0.9, Some(fill), None)]);
        canvas.avoid_disk(at, 1.1);
        canvas.label(Label::new(words, hue.word, vec![at]).toward(aside));
    }
}

/// One row for each lens point: where its picture has the sharp and the unsharp point; under them, the sum.
fn pictures(
    scene: &Scene,
    sheet: &Sheet,
    frame: [f64; 4],
    lens: &[DVec3],
    points: [DVec3; 2],
) -> Result<Group> {
    let theme = scene.theme;
    let [left, top, right, bottom] = frame;
    let sharp = height(scene, DVec3::ZERO, points[0]);
    let most =
        lens.iter().map(|&s| (height(scene, s, points[1]) - sharp).abs()).fold(0.0, f64::max).max(1e-9);
    let middle = 0.5 * (left + right);
    let word = lettering::runs("sum");
    let wide = lettering::width(&word)? * theme::LETTER;
    // Room for the name of the sum at the left.
    let per = (0.31 * (right - left)).min(0.5 * (right - left) - wide - 2.5) / most;
    let rows = lens.len() as f64 + 1.0;
    let row = (bottom - top) / (rows + 0.6);
    let mut items: Vec<Item> = Vec::new();
    let mut rules = Vec::new();
    let mut marks = Vec::new();
    let at = |h: f64| middle + per * (h - sharp);
    let dot = |center: Point, color| {
        Item::Shape(Shape::circle(center, 0.9, Some(Fill::Flat { color, opacity: 1.0 }), None))
    };
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for (i, &s) in lens.iter().enumerate() {
        let y = top + row * (i as f64 + 0.7);
        rules.push(Item::Shape(Shape::line(
            [left + 1.0, y],
            [right - 1.0, y],
            solid(theme.faint, theme::HAIR),
        )));
        let heights = points.map(|p| height(scene, s, p));
        let x = heights.map(at);
        ends = [ends[0].min(x[1]), ends[1].max(x[1])];
        let data = vec![("data-sharp", exact(heights[0])), ("data-unsharp", exact(heights[1]))];
        let dots = vec![dot([x[1], y], theme.depth.line), dot([x[0], y], theme.focus.line)];
        marks.push(Item::Group(Group { part: Some("film-images"), data, items: dots, ..Group::default() }));
    }
    let y = top + row * (rows - 0.2);
    let sum = Fill::Flat { color: theme.depth.line, opacity: 0.55 };
    let blur = [[ends[0], y - 0.8], [ends[1], y - 0.8], [ends[1], y + 0.8], [ends[0], y + 0.8]];
    let line = top + row * (rows - 0.7);
    rules.push(Item::Shape(Shape::line([left, line], [right, line], solid(theme.ink, theme::THIN))));
    items.push(Item::Group(Group::of("rows", rules)));
    items.push(Item::Group(Group::of(
        "sum",
        vec![Item::Shape(Shape::polyline(&blur, true, Some(sum), None)), dot([middle, y], theme.focus.line)],
    )));
    items.extend(marks);
    let border = [[left, top], [right, top], [right, bottom], [left, bottom]];
    let edge = Shape::polyline(&border, true, None, Some(solid(theme.faint, theme::THIN)));
    items.push(Item::Group(Group::of("frame", vec![Item::Shape(edge)])));
    items.push(sheet.caption("caption", word, [left + 1.5, y + 0.36 * theme::LETTER], theme::LETTER)?);
    Ok(Group {
        part: Some("film-rows"),
        data: vec![("data-page-per-metre", exact(per))],
        items,
        ..Group::default()
    })
}
