//! `kind = "solve"`: the inverse question. In: a camera with a wanted plane, and another plane that cannot be had. Out: the
//! movements found, with the plane; beside, the nearest plane that can be had and the limit that stops the solver.

use super::file::{Input, Subject};
use super::limits;
use super::stage::{self, Stage};
use crate::camera::{Camera, Standard};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::extent;
use crate::diagram::facts;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::planes::{self, Style, along};
use crate::diagram::rays;
use crate::diagram::section::{Section, SectionPlane};
use crate::diagram::theme;
use crate::diagram::words::{self, length};
use crate::error::{Error, Result};
use crate::geometry::Plane;
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
    let moved = facts::moved(camera, ["front", "rear"]);
    let found = if moved.is_empty() { "no movement".to_owned() } else { moved.join(", ") };
    let upright = stage.page.size[0] < NARROW;
    let [first, second] = if upright { ["Above", "Below"] } else { ["Left", "Right"] };
    let failing = match &keys.impossible {
        Some(table) => Some(failing(camera, table)?),
        None => None,
    };
    let plane =
        if failing.is_some() { format!("{first}, the wanted plane") } else { "The wanted plane".to_owned() };
    let mut sentences =
        vec![format!("{plane} is sharp with {found}, extension {}.", words::extension(camera.extension))];
    if let Some((_, stopped, nearest)) = &failing {
        let why = stopped.message.replace("(J < f)", "(*J* < *f*)");
        let sentence = match nearest {
            Some((_, miss)) => format!(
                "{second}, no turn of the lens does it: {why}. The nearest parallel plane that can lies {} beside it.",
                length(*miss)
            ),
            None => format!("{second}, no turn of the lens does it: {why}."),
        };
        sentences.push(sentence);
    }
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let mut frames = stage::split(frame, if failing.is_some() { 2 } else { 1 }, upright).into_iter();
    let mut next = || frames.next().unwrap_or(frame);
    let mut scene = stage.scene();
    let panel = extent::fit(stage::around(&scene, &stage::rule_points(&scene))?, next(), 4.0);
    scene.bundles = rays::bundles(&scene, &panel);
    sheet.push(stage::panel(&scene, panel, "solved", |_, _| {})?);
    sheet.strip(&panel, &stage::seen(&scene, "wanted plane"), false)?;
    if let Some((wanted, stopped, nearest)) = &failing {
        // The camera before any movement: that of the nearest plane is bent beyond drawing.
        let level = Standard { tilt: Angle::ZERO, swing: Angle::ZERO, ..camera.front };
        let before = Optics::new(&Camera { front: level, ..*camera })?;
        let hidden = stage::without(&["bellows", "film-parallel", "label", "lens-board"], &stage.hide);
        let wanted = before.world_from_lens().plane_inverse(*wanted).normalized();
        let mut scene = Scene { hidden: &hidden, ..stage.scene_of(&before) };
        if stage.section == Section::Auto {
            // The hinge line is a point, and distances from the lens are true.
            let section = SectionPlane::holding(before.film_normal(), wanted.m);
            let Subject { circle, triangles, .. } = &stage.subject;
            scene = Scene::cut(&before, &stage.page.theme, *circle, section, triangles, &hidden);
        }
        let f = before.focal_length();
        let left = -1.5 * before.camera().extension.as_metres();
        let mut seen = vec![[0.0, -1.5 * f], [0.0, 1.3 * f], [3.0 * f, 0.0], [left, 0.0]];
        let foot = scene.section.project(-wanted.e * wanted.m);
        seen.extend((libm::hypot(foot[0], foot[1]) < 30.0 * f).then_some(foot));
        let panel = extent::fit(stage::around(&scene, &seen)?, next(), 4.0);
        let mut canvas = Canvas::new(panel, scene.theme);
        parts::draw(&scene, &mut canvas, Role::Whole);
        if let Some((optics, _)) = nearest {
            let style = Style::plain(theme::solid(scene.theme.focus.line, theme::MEDIUM));
            let ends = planes::trace(&scene, &mut canvas, "nearest-plane", optics.focus_plane(), style, None);
            if let Some((a, b)) = ends {
                let label = Label::new("nearest plane|that can be had", scene.theme.focus.word, along(a, b));
                canvas.label(label.beside((a, b), 0.75));
            }
        }
        limits::draw(&scene, &mut canvas, wanted, stopped);
        sheet.push(parts::close(&scene, canvas, "stopped")?);
        sheet.strip(&panel, &stage::seen(&scene, "stopped by a limit"), false)?;
    }
    stage::end(&stage, sheet, frame, "Which movements", &sentences)
}

type Failing = (Plane, Unsolvable, Option<(Optics, f64)>);

/// The plane of the world that cannot be had, why, and what can.
fn failing(camera: &Camera, table: &PlaneTable) -> Result<Failing> {
    let (point, normal) = (DVec3::from_array(table.point_m), DVec3::from_array(table.normal));
    let target = FocusTarget::Plane { point, normal };
    match solve(camera, &target, Adjust::Front) {
        Err(Unsolvable { limit: Limit::NoPlane, message, .. }) => {
            Err(Error::invalid(message).at_key("impossible.normal").remedy("give a direction"))
        }
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
