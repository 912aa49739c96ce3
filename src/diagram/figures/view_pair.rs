//! `kind = "view-pair"`: a picture and the camera that made it. In: a scene and its picture, rendered before. Out: the picture, with
//! the line in which the focus plane meets the ground and the plane of the section marked in it, and the camera in section.

use super::file::Input;
use super::picture::Picture;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::display_list::{Color, Group, Item, Point, Raster, Shape};
use crate::diagram::extent::{self, Extent};
use crate::diagram::lettering;
use crate::diagram::panel::Panel;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::rays;
use crate::diagram::sheet::{GUTTER, STRIP};
use crate::diagram::theme::{self, broken, solid};
use crate::diagram::words::exact;
use crate::error::{Error, Result};
use crate::geometry::{Line, Plane};
use crate::optics::Optics;
use glam::{DVec3, DVec4};
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// The picture that `groundglass render` made of the scene (PNG, 8 bits), relative to this file.
    #[schemars(length(min = 1), example = &"../examples/pictures/tower.png")]
    picture: String,
    /// How much of the file the picture may take, in thousands of bytes: it is set as a JPEG, at most 300 pixels to the inch,
    /// and with less detail where it must.
    #[serde(default = "picture_kb")]
    #[schemars(range(min = 2, max = 20_000), example = 60)]
    picture_kb: u32,
}

/// With this much picture, which base64 makes longer by a third, an SVG has less than 60 KB.
fn picture_kb() -> u32 {
    18
}

const SHOWN: [&str; 14] = [
    "axis",
    "bellows",
    "caption",
    "far-plane",
    "film-parallel",
    "focus-plane",
    "front-focal-plane",
    "hinge-line",
    "label",
    "lens-board",
    "near-plane",
    "scheimpflug-line",
    "subject",
    "wedge",
];

/// Below this width (mm) the section stands under the picture.
const NARROW: f64 = 110.0;

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage =
        Stage::read(input, |width| if width < NARROW { 1.9 * width } else { 0.45 * width + 12.0 }, &SHOWN)?;
    let keys: Keys = input.keys()?;
    let (bytes, _) = input.read("picture", &keys.picture)?;
    let picture = Picture::read(&bytes).map_err(|why| {
        Error::invalid(format!("`{}` is no such PNG: {why}", keys.picture)).at_key("picture")
    })?;
    let mut scene = stage.scene();
    let film = scene.optics.camera().film;
    let shape = film.width.as_metres() / film.height.as_metres();
    let [wide, high] = picture.size.map(f64::from);
    if ((wide / high) / shape - 1.0).abs() > 1.5 / wide.min(high) {
        return Err(Error::invalid(format!("a picture of {wide} x {high} pixels has not the film's shape"))
            .at_key("picture")
            .remedy("render the scene of this figure: groundglass render"));
    }
    // The ground is there whether or not the section's cut through the subject is drawn.
    let (hides, up) = (stage.hidden.contains("subject"), stage.subject.up);
    let whole = if hides { Some(input.camera(true)?) } else { None };
    let subject = whole.as_ref().unwrap_or(&stage.subject);
    let ground = subject.triangles.iter().flatten().map(|p| p.dot(up)).fold(f64::INFINITY, f64::min);
    let ground = Plane { m: up, e: -ground };
    let focus = scene.optics.world_from_lens().plane(scene.optics.focus_plane());
    let is_ground = ground.e.is_finite() && is_same(focus, ground);
    let meets = ground.e.is_finite() && !is_ground;
    let line = meets.then(|| Line::meet(focus, ground)).filter(|line| !line.is_at_infinity());
    let is_shown = line.is_some_and(|line| shown(scene.optics, line, [0.0, 0.0, shape, 1.0]).is_some());
    let meeting = match line {
        Some(_) if is_shown => "Solid in the picture: where the focus plane meets the ground.",
        Some(_) => "The focus plane meets the ground outside of the picture.",
        None if is_ground => "The focus plane is the ground.",
        None if ground.e.is_finite() => "The focus plane does not meet the ground.",
        None => "",
    };
    let is_stacked = stage.page.size[0] < NARROW;
    let dashed = section_line(&scene, [0.0, 0.0, shape, 1.0]).map_or(String::new(), |_| {
        let where_in = match line {
            Some(_) if is_shown => "",
            Some(_) => " in it",
            None => " in the picture",
        };
        let place = if is_stacked { "below" } else { "beside" };
        format!(" Dashed{where_in}: the plane of the section {place} it.")
    });
    let told = format!("{meeting}{dashed}").trim_start().to_owned();
    let mut sentences = vec![stage::camera_sentence(&scene)];
    if !told.is_empty() {
        sentences.insert(0, told);
    }
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let [left, top, right, bottom] = frame;
    let (view, main) = if is_stacked {
        // No more than the picture takes that is as wide as the page.
        let full = (right - left) / shape + STRIP + 1.0;
        let split = top + full.min(0.58 * (bottom + STRIP - top));
        ([left, top, right, split - STRIP - 1.0], [left, split + 1.0, right, bottom])
    } else {
        // As wide as the picture is at the height there is, and not more than two fifths.
        let across = (shape * (bottom - top)).min(0.4 * (right - left));
        ([left, top, left + across, bottom], [left + across + GUTTER, top, right, bottom])
    };
    let scale = ((view[2] - view[0]) / shape).min(view[3] - view[1]);
    let size = [scale * shape, scale];
    let place = [view[0], view[1], view[0] + size[0], view[1] + size[1]];
    let group = marked(&scene, picture.set(place, 1000 * keys.picture_kb as usize)?, line);
    sheet.items.push(Item::Group(group));
    let item = sheet.caption(
        "caption",
        lettering::runs("on the film, upright"),
        [place[0], place[3] + 3.4],
        theme::LETTER,
    )?;
    sheet.items.push(item);
    let extent = Extent::of(&scene);
    if !extent.is_finite() {
        return Err(Error::invalid("the camera's numbers are too extreme to be drawn").at_key("scene"));
    }
    let panel = extent::fit(extent.scene, main, 4.0);
    scene.bundles = rays::bundles(&scene, &panel);
    sheet.push(parts::panel(&scene, panel, Role::Main, "main", None)?);
    sheet.strip(&panel, scene.section.name(), false)?;
    stage::end(&stage, sheet, frame, "A picture and its camera", &sentences)
}

/// Whether two planes are one, but for rounding.
fn is_same(a: Plane, b: Plane) -> bool {
    let (a, b) = (a.normalized(), b.normalized());
    let side = a.m.dot(b.m).signum();
    a.m.cross(b.m).length() < 1e-9 && (a.e - side * b.e).abs() < 1e-9 * (1.0 + a.e.abs())
}

/// The section passes through the lens, so in a picture with these bounds it is a straight line: through two of its points ahead.
fn section_line(scene: &Scene, bounds: [f64; 4]) -> Option<(Point, Point)> {
    let panel = Panel { frame: bounds, scale: 1.0, origin: [bounds[0], bounds[1]] };
    let (world, ahead) = (scene.optics.world_from_lens(), scene.section.u);
    let [a, b] = [0.3, -0.3].map(|t| seen(scene, bounds, world.point(ahead + scene.section.v * t)));
    let (a, b) = (a?, b?);
    let far = |p: Point, q: Point| [p[0] + 50.0 * (p[0] - q[0]), p[1] + 50.0 * (p[1] - q[1])];
    panel.clip_segment(far(a, b), far(b, a))
}

/// Lines in the picture: it does not turn with the page, so neither do they (these are colours of no theme).
const LIGHT: Color = Color::hex(0xFB_FB_FB);
const DARK: Color = Color::hex(0x0B_0B_0B);

/// The picture with the lines that are marked in it.
fn marked(scene: &Scene, raster: Raster, line: Option<Line>) -> Group {
    let theme = scene.theme;
    let bounds = raster.bounds;
    let panel = Panel { frame: bounds, scale: 1.0, origin: [bounds[0], bounds[1]] };
    let (middle, half) = halves(bounds);
    let matrix = [half[0], 0.0, 0.0, -half[1], middle[0], middle[1]].map(exact).join(" ");
    let mut items = vec![Item::Raster(raster)];
    if let Some((a, b)) = section_line(scene, bounds) {
        // Light under dark, so that it shows on any ground.
        let under = solid(LIGHT, 0.5);
        let over = broken(DARK, theme::MEDIUM, theme::DASHED);
        let shapes = [Shape::line(a, b, under), Shape::line(a, b, over)];
        items.push(Item::Group(Group::of("section-line", shapes.into_iter().map(Item::Shape).collect())));
    }
    if let Some((a, b)) = line.and_then(|line| shown(scene.optics, line, bounds)) {
        let shapes = [Shape::line(a, b, solid(LIGHT, 1.0)), Shape::line(a, b, solid(theme.focus.line, 0.6))];
        items.push(Item::Group(Group::of("sharp-line", shapes.into_iter().map(Item::Shape).collect())));
    }
    let border = Shape::polyline(&panel.corners(), true, None, Some(solid(theme.ink, theme::THIN)));
    items.push(Item::Group(Group::of("film-frame", vec![Item::Shape(border)])));
    Group {
        part: Some("film-picture"),
        data: vec![("data-page-from-clip", matrix)],
        items,
        ..Group::default()
    }
}

/// The middle of a picture with these bounds, and half of its sides.
fn halves([left, top, right, bottom]: [f64; 4]) -> (Point, Point) {
    ([0.5 * (left + right), 0.5 * (top + bottom)], [0.5 * (right - left), 0.5 * (bottom - top)])
}

/// Where a point of the world is seen on the plane of a picture with these bounds, if it lies before the camera.
fn seen(scene: &Scene, bounds: [f64; 4], p: DVec3) -> Option<Point> {
    on_page(bounds, scene.optics.projection_from_world(0.0, 0.0).project(p))
}

fn on_page(bounds: [f64; 4], clip: DVec4) -> Option<Point> {
    let (middle, half) = halves(bounds);
    (clip.w > 0.0).then(|| [middle[0] + half[0] * clip.x / clip.w, middle[1] - half[1] * clip.y / clip.w])
}

/// What of a line of the world lies in a picture with these bounds: clipped before it is divided by `w`, so that a line that
/// runs to the horizon ends there.
fn shown(optics: &Optics, line: Line, bounds: [f64; 4]) -> Option<(Point, Point)> {
    let unit = line.normalized();
    let eye = optics.world_from_lens().origin;
    let foot = unit.direction.cross(unit.moment);
    // From the point of the line nearest to the camera, in steps of its distance.
    let near = foot + unit.direction * unit.direction.dot(eye - foot);
    let step = unit.direction * (near - eye).length().max(1e-6);
    let projection = optics.projection_from_world(0.0, 0.0);
    let way = DVec4::from_array(projection.rows.map(|row| row.truncate().dot(step)));
    let start = projection.project(near);
    let (low, high) = inside(start, way)?;
    // Where it lies in the picture as far as it goes, its end is where its direction is seen.
    let at = |t: f64| if t.is_finite() { start + way * t } else { way * t.signum() };
    on_page(bounds, at(low)).zip(on_page(bounds, at(high)))
}

/// Between which `t` the point `start + way t` of clip space lies in the picture: `|x| <= w` and `|y| <= w`.
fn inside(start: DVec4, way: DVec4) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for side in [DVec4::X, DVec4::NEG_X, DVec4::Y, DVec4::NEG_Y].map(|axis| axis + DVec4::W) {
        let (value, slope) = (side.dot(start), side.dot(way));
        let limit = -value / slope;
        if slope > 0.0 {
            low = low.max(limit);
        } else if slope < 0.0 {
            high = high.min(limit);
        } else if value < 0.0 {
            return None;
        }
    }
    (low < high).then_some((low, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aperture, Camera, FilmSize, Standard};
    use crate::quantity::{FNumber, Length};

    /// A camera that looks level along -z from 1.6 m, and lines on the ground.
    #[test]
    fn a_line_to_the_horizon_ends_there() -> crate::error::Result<()> {
        let camera = Camera {
            rail: Camera::rail_frame(DVec3::Y * 1.6, DVec3::new(0.0, 1.6, -1.0), DVec3::Y)?,
            front: Standard::default(),
            rear: Standard::default(),
            extension: Length::millimetres(705.0),
            focal_length: Length::millimetres(700.0),
            aperture: Aperture::FNumber(FNumber::new(8.0)?),
            film: FilmSize { width: Length::millimetres(36.0), height: Length::millimetres(24.0) },
            near: Length::millimetres(10.0),
        };
        let optics = Optics::new(&camera)?;
        let meet = |m: DVec3, e: f64| Line::meet(Plane { m, e }, Plane { m: DVec3::Y, e: 0.0 });
        let bounds = [0.0, 0.0, 36.0, 24.0];
        // x = 3, away from the camera: to the vanishing point, in the middle of the picture.
        let ends = shown(&optics, meet(DVec3::X, -3.0), bounds).map(|(a, b)| [a, b]);
        let horizon = |p: &Point| (p[0] - 18.0).abs() < 1e-9 && (p[1] - 12.0).abs() < 1e-9;
        assert!(ends.is_some_and(|ends| ends.iter().filter(|p| horizon(p)).count() == 1), "{ends:?}");
        // Across, 200 m away: from edge to edge; behind the camera: not at all.
        let ends = shown(&optics, meet(DVec3::Z, 200.0), bounds).map(|(a, b)| [a[0], b[0]]);
        assert!(ends.is_some_and(|[a, b]| (a - b).abs() > 36.0 - 1e-9), "{ends:?}");
        assert!(shown(&optics, meet(DVec3::Z, -200.0), bounds).is_none());
        Ok(())
    }

    #[test]
    fn planes_are_one_whichever_side_they_show() {
        let plane = |y: f64, e: f64| Plane { m: DVec3::new(1e-17, y, 0.0), e };
        assert!(is_same(plane(1.0, 0.0), plane(-2.0, 1e-16)));
        assert!(is_same(plane(1.0, -3.0), plane(-2.0, 6.0)));
        assert!(!is_same(plane(1.0, -3.0), plane(2.0, 6.0)));
        assert!(!is_same(plane(1.0, 0.0), Plane { m: DVec3::new(1e-3, 1.0, 0.0), e: 0.0 }));
    }
}
