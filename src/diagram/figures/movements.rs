//! `kind = "movements"`: the eight movements of a view camera. In: a camera and how far each goes. Out: eight panels to one
//! scale, each with one movement, the way it goes and its sign; where the standard stood before is dashed.

use super::file::Input;
use super::stage;
use crate::camera::{Camera, Standard};
use crate::diagram::Figure;
use crate::diagram::canvas::Canvas;
use crate::diagram::display_list::{Fill, Point, Shape};
use crate::diagram::extent;
use crate::diagram::lettering;
use crate::diagram::marks;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::section::Section;
use crate::diagram::sheet::{self, GUTTER, LEADING, MARGIN, Sheet};
use crate::diagram::theme::{self, broken, solid};
use crate::diagram::words::{ratio, short};
use crate::error::Result;
use crate::optics::Optics;
use crate::quantity::{Angle, Length};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says beside page and camera.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Keys {
    /// How far tilt and swing go in the figure; degrees.
    #[schemars(range(min = 1.0, max = 40.0), example = 15.0)]
    turn_deg: f64,
    /// How far rise and shift go in the figure, in millimetres; a fifth of the focal length by default.
    #[schemars(range(min = 1e-6, max = 1e6), example = 30.0)]
    slide_mm: Option<f64>,
}

impl Default for Keys {
    fn default() -> Self {
        Self { turn_deg: 15.0, slide_mm: None }
    }
}

/// From this width on (mm) four panels stand beside one another, else two.
const WIDE: f64 = 145.0;

/// A movement: its name, what positive means, how it is seen.
const MOVEMENTS: [(&str, &str, Section); 4] = [
    ("rise", "upward", Section::Side),
    ("tilt", "top toward the subject", Section::Side),
    ("shift", "to the right", Section::Top),
    ("swing", "facing right", Section::Top),
];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let page = input.page(|width| if width < WIDE { 1.35 * width + 25.0 } else { 0.62 * width })?;
    let keys: Keys = input.keys()?;
    let own = *input.camera(false)?.optics.camera();
    let slide = keys.slide_mm.map_or(Length::metres(own.focal_length.as_metres() / 5.0), Length::millimetres);
    let level = Camera { front: Standard::default(), rear: Standard::default(), ..own };
    let start = Optics::new(&level)?;
    let hidden = stage::without(&["bellows", "lens-board"], &[]);
    let theme = page.theme;
    let mut sheet = Sheet::new(page.size, [60.0, 60.0], &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let width = page.size[0];
    let wide_of = |columns: usize| (width - 2.0 * MARGIN - GUTTER * (columns - 1) as f64) / columns as f64;
    let senses = MOVEMENTS.iter().map(|(_, sense, _)| lettering::width(&lettering::runs(sense)));
    let longest = senses.collect::<Result<Vec<f64>>>()?.into_iter().fold(0.0, f64::max) * theme::LETTER;
    let columns = if width >= WIDE {
        4
    } else if wide_of(2) >= longest {
        2
    } else {
        1
    };
    let rows = 8 / columns;
    let caption = 2.0 * LEADING + 1.5;
    let footnote = |scale: f64| {
        let all = ratio(1000.0 / scale);
        format!(
            "Front: the lens; rear: the film. Side views for rise and tilt, top views (the camera's left is up) for shift and swing; all {all}."
        )
    };
    // The longest that a scale can be.
    let foot_lines = sheet::broken(&footnote(1000.0 / 125_000.0), width - 2.0 * MARGIN)?.len();
    let foot = LEADING * foot_lines as f64 + 1.0;
    let wide = wide_of(columns);
    let needed = top + MARGIN + foot + rows as f64 * (15.0 + caption);
    let height = page.height_for(&mut sheet, needed, needed)?;
    let high = (height - top - MARGIN - foot) / rows as f64 - caption;
    // Room for the camera in every position, the same in all panels.
    let tall = own.film.width.as_metres().max(own.film.height.as_metres());
    let reach = 0.5 * tall + slide.as_metres();
    let bounds = [-own.extension.as_metres() - 0.3 * tall, -reach, 0.45 * tall, reach];
    let mut scale = 1.0;
    let mut said = Vec::new();
    for (i, front) in [true, false].into_iter().enumerate() {
        for (j, (name, sense, section)) in MOVEMENTS.into_iter().enumerate() {
            let index = 4 * i + j;
            let (column, row) = (index % columns, index / columns);
            let left = MARGIN + (wide + GUTTER) * column as f64;
            let upper = top + (high + caption) * row as f64;
            let panel = extent::fit(bounds, [left, upper, left + wide, upper + high], 1.5);
            scale = panel.scale;
            let standard = moved(name, keys.turn_deg, slide);
            let camera =
                if front { Camera { front: standard, ..level } } else { Camera { rear: standard, ..level } };
            let optics = Optics::new(&camera)?;
            let scene = Scene::new(&optics, &theme, 1e-4, (section, DVec3::Y), &[], &hidden);
            let mut canvas = Canvas::new(panel, &theme);
            // The lens of a moved standard stands elsewhere: the panel is fixed to where it stood.
            let offset = scene.section.project(optics_offset(&camera));
            canvas.panel.origin = panel.page(offset);
            parts::draw(&scene, &mut canvas, Role::Main);
            ghost(
                &Scene::new(&start, &theme, 1e-4, (section, DVec3::Y), &[], &hidden),
                &mut canvas,
                panel.origin,
                front,
            );
            way(&scene, &mut canvas, panel.origin, &camera, front, name);
            sheet.push(parts::close(&scene, canvas, NAMES[index])?);
            let standard = if front { "front" } else { "rear" };
            let amount = match name {
                "rise" | "shift" => format!("+{} mm", short(slide.as_millimetres())),
                _ => format!("+{}°", short(keys.turn_deg)),
            };
            let words = [format!("{standard} {name} {amount}"), sense.to_owned()];
            for (k, line) in words.iter().enumerate() {
                let at = [left, upper + high + 3.4 + LEADING * k as f64];
                let color_item = sheet.caption("caption", lettering::runs(line), at, theme::LETTER)?;
                sheet.items.push(color_item);
            }
            said.push(format!("{standard} {name} {amount}, {sense}"));
        }
    }
    let foot = footnote(scale);
    let lines = sheet::broken(&foot, width - 2.0 * MARGIN)?;
    sheet.block(&lines, [MARGIN, height - MARGIN - LEADING * lines.len() as f64])?;
    let description =
        format!("The eight movements of a view camera, positive as drawn: {}. {foot}", said.join("; "));
    sheet.finish("Movements", description)
}

const NAMES: [&str; 8] = [
    "front-rise",
    "front-tilt",
    "front-shift",
    "front-swing",
    "rear-rise",
    "rear-tilt",
    "rear-shift",
    "rear-swing",
];

fn moved(name: &str, turn: f64, slide: Length) -> Standard {
    let zero = Standard::default();
    match name {
        "rise" => Standard { rise: slide, ..zero },
        "shift" => Standard { shift: slide, ..zero },
        "tilt" => Standard { tilt: Angle::degrees(turn), ..zero },
        _ => Standard { swing: Angle::degrees(turn), ..zero },
    }
}

/// From where the lens stood to where it stands, in rail axes.
fn optics_offset(camera: &Camera) -> DVec3 {
    DVec3::new(camera.front.shift.as_metres(), camera.front.rise.as_metres(), 0.0)
}

/// The standard that moves, where it stood.
fn ghost(scene: &Scene, canvas: &mut Canvas, origin: Point, front: bool) {
    let panel = crate::diagram::panel::Panel { origin, ..canvas.panel };
    let page = |p: DVec3| panel.page(scene.section.project(p));
    let half = scene.lens * (0.5 * parts::camera_height(scene));
    let ends = match scene.film {
        Some(ends) if !front => ends.map(page),
        _ => [page(half), page(-half)],
    };
    let stroke = broken(scene.theme.quiet, theme::MEDIUM, theme::DOTTED);
    canvas.part("before", vec![Shape::line(ends[0], ends[1], stroke)]);
}

/// The way that the standard went: a straight arrow, or an arc with a head.
fn way(scene: &Scene, canvas: &mut Canvas, origin: Point, camera: &Camera, front: bool, name: &str) {
    let color = scene.theme.focus.line;
    let panel = crate::diagram::panel::Panel { origin, ..canvas.panel };
    let page = |p: DVec3| panel.page(scene.section.project(p));
    let standard = if front { camera.front } else { camera.rear };
    let center = if front { DVec3::ZERO } else { DVec3::Z * camera.extension.as_metres() };
    let half = 0.5 * parts::camera_height(scene);
    match name {
        "rise" | "shift" => {
            let along = DVec3::new(standard.shift.as_metres(), standard.rise.as_metres(), 0.0);
            // Beside the standard, on the outer side.
            let aside = DVec3::Z * if front { -0.35 * half } else { 0.35 * half };
            let (from, to) = (page(center + aside), page(center + aside + along));
            canvas.part("movement", arrow(from, to, color));
        }
        _ => {
            let turn = standard.rotation();
            let up = if name == "tilt" { DVec3::Y } else { DVec3::NEG_X };
            let (from, to) = (scene.section.project(up), scene.section.project(turn * up));
            let (from, to) = ([from[0], -from[1]], [to[0], -to[1]]);
            let radius = 1.12 * half * panel.scale;
            canvas.part("movement", marks::arc_arrow(page(center), radius, from, to, color));
        }
    }
}

fn arrow(from: Point, to: Point, color: crate::diagram::display_list::Color) -> Vec<Shape> {
    let along = marks::toward(from, to);
    let back = [to[0] - 1.8 * along[0], to[1] - 1.8 * along[1]];
    let head = [
        to,
        [back[0] - 0.7 * along[1], back[1] + 0.7 * along[0]],
        [back[0] + 0.7 * along[1], back[1] - 0.7 * along[0]],
    ];
    vec![
        Shape::line(from, back, solid(color, 0.4)),
        Shape::polyline(&head, true, Some(Fill::Flat { color, opacity: 1.0 }), None),
    ]
}
