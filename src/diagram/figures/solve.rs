//! `kind = "solve"`: the inverse question. In: a camera with a wanted plane, and another plane that cannot be had. Out: the
//! movements found, with the plane; beside, the nearest plane that can be had and the limit that stops the solver.

use super::file::Input;
use super::stage::{self, Stage};
use crate::camera::{Camera, Standard};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::display_list::Shape;
use crate::diagram::extent;
use crate::diagram::facts;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::place::Weight;
use crate::diagram::planes::{self, Style, along};
use crate::diagram::rays;
use crate::diagram::section::Pierce;
use crate::diagram::sheet::{GUTTER, STRIP};
use crate::diagram::theme::{self, broken};
use crate::diagram::words::length;
use crate::error::{Error, Result};
use crate::geometry::{Line, Plane};
use crate::optics::{Adjust, FocusTarget, Limit, Optics, Unsolvable, solve};
use crate::quantity::Angle;
use crate::scene::PlaneTable;
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// A plane that no movement of the front standard makes sharp.
    #[serde(default)]
    impossible: Option<PlaneTable>,
}

const SHOWN: [&str; 11] = [
    "axis",
    "bellows",
    "caption",
    "focus-plane",
    "hinge-line",
    "label",
    "lens-board",
    "ray",
    "ray-bundle",
    "scheimpflug-line",
    "subject",
];

/// Below this width (mm) the panels stand one under the other.
const NARROW: f64 = 110.0;

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage =
        Stage::read(input, |width| if width < NARROW { 1.6 * width } else { 0.5 * width + 20.0 }, &SHOWN)?;
    let keys: Keys = input.keys()?;
    let solved = &stage.subject.optics;
    let camera = solved.camera();
    let all = [("front", camera.front), ("rear", camera.rear)];
    let moved: Vec<String> =
        all.iter().filter_map(|(name, s)| facts::movements(s).map(|m| format!("{name} {m}"))).collect();
    let found = if moved.is_empty() { "no movement".to_owned() } else { moved.join(", ") };
    let upright = stage.page.size[0] < NARROW;
    let [first, second] = if upright { ["Above", "Below"] } else { ["Left", "Right"] };
    let mut sentences = vec![format!(
        "{first}, the wanted plane is sharp with {found}, extension {}.",
        length(camera.extension.as_metres())
    )];
    let failing = match &keys.impossible {
        Some(table) => Some(failing(camera, table)?),
        None => None,
    };
    if let Some((_, stopped, nearest)) = &failing {
        let sentence = match nearest {
            Some((_, miss)) => format!(
                "{second}, a plane that cannot be had: {}. The nearest parallel plane that can lies {} beside it.",
                stopped.message,
                length(*miss)
            ),
            None => format!("{second}, a plane that cannot be had: {}.", stopped.message),
        };
        sentences.push(sentence);
    }
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let [left, top, right, bottom] = frame;
    let frames = match (&failing, upright) {
        (None, _) => [frame, frame],
        (Some(_), true) => {
            let split = top + 0.5 * (bottom + STRIP - top);
            [[left, top, right, split - STRIP - 1.0], [left, split + 1.0, right, bottom]]
        }
        (Some(_), false) => {
            let split = 0.5 * (left + right);
            [[left, top, split - 0.5 * GUTTER, bottom], [split + 0.5 * GUTTER, top, right, bottom]]
        }
    };
    let mut scene = stage.scene();
    let panel = extent::fit(stage::around(&scene, &points(&scene))?, frames[0], 4.0);
    scene.bundles = rays::bundles(&scene, &panel);
    sheet.push(stage::panel(&scene, panel, "solved", |_, _| {})?);
    sheet.strip(&panel, "wanted plane", false)?;
    if let Some((wanted, stopped, nearest)) = &failing {
        // The camera before any movement: that of the nearest plane is bent beyond drawing.
        let level = Standard { tilt: Angle::ZERO, swing: Angle::ZERO, ..camera.front };
        let before = Optics::new(&Camera { front: level, ..*camera })?;
        let hidden = stage::without(&["bellows", "film-parallel", "label", "lens-board"], &[]);
        let scene = Scene { hidden: &hidden, ..stage.scene_of(&before) };
        let wanted = before.world_from_lens().plane_inverse(*wanted);
        let f = before.focal_length();
        let seen = [[0.0, -1.5 * f], [0.0, 1.3 * f], [3.0 * f, 0.0]];
        let panel = extent::fit(stage::around(&scene, &seen)?, frames[1], 4.0);
        let mut canvas = Canvas::new(panel, scene.theme);
        parts::draw(&scene, &mut canvas, Role::Whole);
        if let Some((optics, _)) = nearest {
            let style = Style::plain(theme::solid(scene.theme.focus.line, theme::MEDIUM));
            let ends = planes::trace(&scene, &mut canvas, "nearest-plane", optics.focus_plane(), style, None);
            if let Some((a, b)) = ends {
                canvas.label(Label::new(
                    "nearest plane|that can be had",
                    scene.theme.focus.word,
                    along(a, b),
                ));
            }
        }
        limit(&scene, &mut canvas, wanted, stopped);
        sheet.push(parts::close(&scene, canvas, "stopped")?);
        sheet.strip(&panel, "stopped by a limit", false)?;
    }
    stage::end(&stage, sheet, frame, "Which movements", &sentences)
}

fn points(scene: &Scene) -> Vec<[f64; 2]> {
    let optics = scene.optics;
    let most = 30.0 * optics.focal_length();
    let mut points = Vec::new();
    for line in [optics.hinge_line(), optics.scheimpflug_line()] {
        points.extend(stage::near_point(scene, line, most));
    }
    points.extend(stage::on_axis(scene, optics.focus_plane(), most));
    points
}

type Failing = (Plane, Unsolvable, Option<(Optics, f64)>);

/// The plane of the world that cannot be had, why, and what can.
fn failing(camera: &Camera, table: &PlaneTable) -> Result<Failing> {
    let (point, normal) = (DVec3::from_array(table.point_m), DVec3::from_array(table.normal));
    let target = FocusTarget::Plane { point, normal };
    match solve(camera, &target, Adjust::Front) {
        Ok(_) => Err(Error::invalid("this plane can be had: nothing stops the solver")
            .at_key("impossible")
            .remedy("give one nearer to the lens")),
        Err(stopped) => {
            let nearest = match &stopped.nearest {
                Some(nearest) => Some((Optics::new(&nearest.camera)?, nearest.miss)),
                None => None,
            };
            Ok((Plane::through(point, normal), stopped, nearest))
        }
    }
}

/// The wanted plane, and the circle about the lens that its hinge line would have to stay out of.
fn limit(scene: &Scene, canvas: &mut Canvas, wanted: Plane, stopped: &Unsolvable) {
    let theme = scene.theme;
    let style = Style::plain(broken(theme.focus.line, theme::MEDIUM, theme::DASHED));
    let ends = planes::trace(scene, canvas, "wanted-plane", wanted, style, None);
    if let Some((a, b)) = ends {
        canvas.label(Label::new("wanted plane", theme.focus.word, along(a, b)));
    }
    if stopped.limit != Limit::HingeTooNear {
        return;
    }
    let radius = scene.optics.focal_length() * canvas.panel.scale;
    let circle = Shape::circle(
        canvas.panel.origin,
        radius,
        None,
        Some(broken(theme.hinge.line, theme::THIN, theme::DOTTED)),
    );
    canvas.part("limit-circle", vec![circle]);
    let slant = std::f64::consts::FRAC_1_SQRT_2 * radius;
    let [x, y] = canvas.panel.origin;
    let around = |i: i32| {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 48.0);
        [x + radius * cosine, y + radius * sine]
    };
    for i in 0..48 {
        canvas.avoid(around(i), around(i + 1), theme::THIN, Weight::Light);
    }
    let anchors = vec![[x - slant, y + slant], [x + slant, y + slant], [x - slant, y - slant]];
    canvas.label(Label::new("*J* = *f*", theme.hinge.word, anchors));
    let hinge = Line::meet(scene.optics.film_parallel_plane(), wanted);
    if let Pierce::At(p) = scene.section.pierce(hinge) {
        let at = canvas.panel.page(p);
        if canvas.panel.holds(at, 0.0) {
            let cross = [[-0.7, -0.7, 0.7, 0.7], [-0.7, 0.7, 0.7, -0.7]]
                .map(|[a, b, c, d]| {
                    let stroke = theme::solid(theme.hinge.line, 0.4);
                    Shape::line([at[0] + a, at[1] + b], [at[0] + c, at[1] + d], stroke)
                })
                .to_vec();
            canvas.part("impossible-hinge", cross);
            canvas.avoid(at, at, 1.6, Weight::Heavy);
            canvas.label(Label::new("its hinge line", theme.hinge.word, vec![at]).toward([-0.8, 0.5]));
        }
    }
}
