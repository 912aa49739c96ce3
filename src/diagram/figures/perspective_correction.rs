//! `kind = "perspective-correction"`: two ways to bring the top of a front into the picture. In: a level camera and an upright
//! front before it. Out: above, the camera that looks up and the one whose lens rises; below, what each has on its
//! film, to scale, with the edges' convergence.

use super::file::Input;
use super::stage;
use crate::camera::{Camera, Standard};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::display_list::{Group, Item, Point, Segment, Shape};
use crate::diagram::extent;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::place::Weight;
use crate::diagram::section::Section;
use crate::diagram::sheet::{self, LEADING, MARGIN, STRIP, Sheet};
use crate::diagram::theme::{self, solid};
use crate::diagram::words::{exact, length, short};
use crate::diagram::{Geometry, lettering};
use crate::error::{Error, Result};
use crate::optics::Optics;
use crate::quantity::Length;
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says beside page and camera.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Keys {
    /// From the camera to the front, metres.
    #[schemars(range(min = 1e-3, max = 1e6), example = 20.0)]
    distance_m: f64,
    /// Width of the front, metres; it stands on the ground, `eye_m`'s height below the camera, square to its view.
    #[schemars(range(min = 1e-3, max = 1e6), example = 8.0)]
    front_width_m: f64,
    /// Height of the front, metres.
    #[schemars(range(min = 1e-3, max = 1e6), example = 14.0)]
    front_height_m: f64,
}

impl Default for Keys {
    fn default() -> Self {
        Self { distance_m: 20.0, front_width_m: 8.0, front_height_m: 14.0 }
    }
}

/// An upright front in the world: its lower left corner, then along its sides.
struct Front {
    corner: DVec3,
    across: DVec3,
    up: DVec3,
}

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let page = input.page(|width| 0.72 * width + 32.0)?;
    let keys: Keys = input.keys()?;
    let subject = input.camera(false)?;
    let (given, upward) = (*subject.optics.camera(), subject.up);
    let level = Camera { front: Standard::default(), rear: Standard::default(), ..given };
    let rail = level.rail;
    let eye = rail.origin.dot(upward);
    let ahead = -rail.axes.z_axis;
    let flat = ahead - upward * ahead.dot(upward);
    if flat.length() < 1e-6 {
        return Err(Error::invalid("the camera looks straight up or down").at_key("camera.look_at_m"));
    }
    let flat = flat / flat.length();
    let right = flat.cross(upward);
    let foot = rail.origin + flat * keys.distance_m - upward * eye;
    let front = Front {
        corner: foot - right * (0.5 * keys.front_width_m),
        across: right * keys.front_width_m,
        up: upward * keys.front_height_m,
    };
    let middle = foot + upward * (0.5 * keys.front_height_m);
    let upright = Camera { rail: Camera::rail_frame(rail.origin, rail.origin + flat, upward)?, ..level };
    let pitched = Camera { rail: Camera::rail_frame(rail.origin, middle, upward)?, ..level };
    // The lens rises until the line from the film's middle through it meets the front's middle.
    let (high, far) = (middle.dot(upward) - eye, keys.distance_m);
    let behind = level.extension.as_metres();
    let rise = Length::metres(high * behind / (far + behind));
    let risen = Camera { front: Standard { rise, ..Standard::default() }, ..upright };
    let pitch = libm::atan2(high, far).to_degrees();
    let way = if pitch < 0.0 { "down" } else { "up" };

    let cameras = [Optics::new(&pitched)?, Optics::new(&risen)?];
    let edges = [converge(&cameras[0], &front), converge(&cameras[1], &front)];
    let sentences = [
        match edges[0] {
            Some(angle) => format!(
                "Left, the camera looks {way} by {}°: on its film the upright edges converge by {}°.",
                short(pitch.abs()),
                short(angle)
            ),
            None => format!(
                "Left, the camera looks {way} by {}°: part of the front lies behind it.",
                short(pitch.abs())
            ),
        },
        format!(
            "Right, it stays level and the lens {} by {}: the edges stay parallel.",
            if pitch < 0.0 { "falls" } else { "rises" },
            length(rise.as_metres().abs())
        ),
    ];
    let mut sheet = Sheet::new(page.size, [70.0, 70.0], &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let width = page.size[0];
    let mut lines = Vec::new();
    for sentence in &sentences {
        lines.extend(sheet::broken(sentence, width - 2.0 * MARGIN)?);
    }
    let below = MARGIN + LEADING * lines.len() as f64 + 1.0;
    let needed = top + 50.0 + below;
    let bottom = page.height_for(&mut sheet, needed, needed)? - below;
    let split = top + 0.5 * (bottom - top);
    let columns = stage::split([MARGIN, top, width - MARGIN, bottom], 2, false);
    let hidden = stage::without(&["axis", "bellows", "label", "lens-board"], &[]);
    let reach = keys.distance_m;
    for (i, (optics, [left, _, right, _])) in cameras.iter().zip(columns).enumerate() {
        let mut scene = Scene::new(optics, &page.theme, 1e-4, (Section::Side, upward), &[], &hidden);
        // The world stands upright on the page, also where the camera looks up.
        scene.section.u = optics.world_from_lens().vector_inverse(flat);
        scene.section.v = optics.world_from_lens().vector_inverse(upward);
        let local = |p: DVec3| scene.section.project(optics.world_from_lens().point_inverse(p));
        let (low, tip) = (local(foot), local(foot + front.up));
        let room = 0.06 * reach;
        let bounds = [low, tip, local(rail.origin), local(rail.origin - upward * eye)].iter().fold(
            [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY],
            |mut all, p| {
                extent::grow(&mut all, *p);
                all
            },
        );
        let bounds = [bounds[0] - room, bounds[1] - 0.3 * room, bounds[2] + room, bounds[3] + 0.3 * room];
        let panel = extent::fit(bounds, [left, top, right, split - STRIP - 1.5], 2.0);
        let mut canvas = Canvas::new(panel, &page.theme);
        parts::draw(&scene, &mut canvas, Role::Main);
        front_in_section(&mut canvas, panel.page(low), panel.page(tip), &scene);
        sheet.push(parts::close(&scene, canvas, ["pitched", "risen"][i])?);
        let lens = if pitch < 0.0 { "lens lowered" } else { "lens risen" };
        sheet.strip(&panel, [&format!("looking {way}"), lens][i], false)?;
        let frame = [left, split, right, bottom - STRIP];
        let group = picture(optics, &front, frame, &page.theme);
        sheet.items.push(Item::Group(group));
        let corners =
            [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(u, v)| seen(optics, &front, u, v));
        if !corners.iter().all(|p| p.is_some_and(|p| p.iter().all(|x| x.abs() <= 1.0))) {
            sheet.push(Group::off_page("some-of-front", "beyond"));
        }
        let words = match edges[i] {
            Some(angle) if angle < 0.005 => "on the film: parallel".to_owned(),
            Some(angle) => format!("on the film: {}°", short(angle)),
            None => "on the film: a part".to_owned(),
        };
        let item =
            sheet.caption("caption", lettering::runs(&words), [left, bottom - STRIP + 3.4], theme::LETTER)?;
        sheet.items.push(item);
    }
    sheet.block(&lines, [MARGIN, bottom + 1.0])?;
    sheet.finish("Perspective correction", sentences.join(" "))
}

fn front_in_section(canvas: &mut Canvas, low: Point, tip: Point, scene: &Scene) {
    let theme = scene.theme;
    let lens = canvas.panel.page([0.0, 0.0]);
    let stroke = solid(theme.ray.line, theme::THIN);
    for end in [low, tip] {
        canvas.part("sight", vec![Shape::line(lens, end, stroke)]);
        canvas.avoid(lens, end, theme::THIN, Weight::Light);
    }
    canvas.part("subject", vec![Shape::line(low, tip, solid(theme.subject.line, 0.9))]);
    canvas.avoid(low, tip, 0.9, Weight::Heavy);
    let middle = [0.5 * (low[0] + tip[0]), 0.5 * (low[1] + tip[1])];
    canvas.label(Label::new("front", theme.subject.word, vec![middle, tip]).toward([-1.0, 0.0]));
    let dot = Shape::circle(lens, 0.5, None, Some(solid(theme.lens.line, theme::MEDIUM)));
    canvas.part("camera-place", vec![dot]);
    canvas.avoid_disk(lens, 0.8);
    canvas.label(Label::new("camera", theme.ink, vec![lens]).toward([0.5, 0.8]));
}

/// A point of the front through the lens centre: place in the picture, -1 to 1 across and up, as `render` has it.
fn seen(optics: &Optics, front: &Front, u: f64, v: f64) -> Option<Point> {
    let clip = optics.projection_from_world(0.0, 0.0).project(front.corner + front.across * u + front.up * v);
    (clip.w > 0.0).then(|| [clip.x / clip.w, clip.y / clip.w])
}

/// The angle between the upright edges on the film, degrees; none where a corner of the front lies behind the camera.
fn converge(optics: &Optics, front: &Front) -> Option<f64> {
    let film = optics.camera().film;
    let way = |u: f64| {
        let (a, b) = (seen(optics, front, u, 0.0)?, seen(optics, front, u, 1.0)?);
        Some(libm::atan2((b[0] - a[0]) * film.width.as_metres(), (b[1] - a[1]) * film.height.as_metres()))
    };
    let angle = (way(0.0)? - way(1.0)?).to_degrees().abs();
    // What rounding leaves of a right angle is none.
    Some(if angle < 1e-9 { 0.0 } else { angle })
}

/// The film as the picture shows it, upright, with the front's edges, storeys and columns on it.
fn picture(
    optics: &Optics,
    front: &Front,
    [left, top, right, bottom]: [f64; 4],
    theme: &theme::Theme,
) -> Group {
    let film = optics.camera().film;
    let (w, h) = (film.width.as_metres(), film.height.as_metres());
    let scale = ((right - left) / w).min((bottom - top) / h);
    let (middle, center) = (0.5 * (left + right), 0.5 * (top + bottom));
    let half = [0.5 * w * scale, 0.5 * h * scale];
    let panel = crate::diagram::panel::Panel {
        frame: [middle - half[0], center - half[1], middle + half[0], center + half[1]],
        scale,
        origin: [middle, center],
    };
    let at = |u: f64, v: f64| {
        seen(optics, front, u, v).map(|p| [middle + half[0] * p[0], center - half[1] * p[1]])
    };
    let line = |from: (f64, f64), to: (f64, f64), path: &mut Vec<Segment>| {
        if let (Some(a), Some(b)) = (at(from.0, from.1), at(to.0, to.1))
            && let Some((a, b)) = panel.clip_segment(a, b)
        {
            path.extend([Segment::Move(a), Segment::Line(b)]);
        }
    };
    let (mut thin, mut edges) = (Vec::new(), Vec::new());
    for k in 1..6 {
        let t = f64::from(k) / 6.0;
        line((0.0, t), (1.0, t), &mut thin);
        if k < 4 {
            let t = f64::from(k) / 4.0;
            line((t, 0.0), (t, 1.0), &mut thin);
        }
    }
    for (from, to) in [
        ((0.0, 0.0), (0.0, 1.0)),
        ((1.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (1.0, 0.0)),
        ((0.0, 1.0), (1.0, 1.0)),
    ] {
        line(from, to, &mut edges);
    }
    let shape = |path: Vec<Segment>, stroke| {
        Item::Shape(Shape { geometry: Geometry::Path(path), fill: None, stroke: Some(stroke) })
    };
    let border = Shape::polyline(&panel.corners(), true, None, Some(solid(theme.ink, theme::MEDIUM)));
    let items = vec![
        Item::Group(Group::of("front-lines", vec![shape(thin, solid(theme.subject.line, theme::HAIR))])),
        Item::Group(Group::of("front-edges", vec![shape(edges, solid(theme.focus.line, 0.45))])),
        Item::Group(Group::of("film-frame", vec![Item::Shape(border)])),
    ];
    let matrix = [half[0], 0.0, 0.0, -half[1], middle, center].map(exact).join(" ");
    Group {
        part: Some("film-picture"),
        data: vec![("data-page-from-clip", matrix)],
        items,
        ..Group::default()
    }
}
