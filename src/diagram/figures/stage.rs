//! What kinds that show a camera in section share. In: page, camera and section of a figure file. Out: the scene of a
//! panel, boxes around what shall be seen, and panels drawn with marks of the kind's own.

use super::file::{Input, Page, Subject};
use super::keys;
use crate::diagram::Figure;
use crate::diagram::canvas::Canvas;
use crate::diagram::display_list::{Group, Point};
use crate::diagram::extent::{self, Bounds, Extent};
use crate::diagram::facts;
use crate::diagram::panel::Panel;
use crate::diagram::parts::{self, PARTS, Role, Scene};
use crate::diagram::rays;
use crate::diagram::section::{Pierce, Section, View};
use crate::diagram::sheet::{self, GUTTER, LEADING, MARGIN, STRIP, Sheet};
use crate::diagram::whereabouts::{self, Cut, cut};
use crate::diagram::words;
use crate::error::{Error, Result};
use crate::geometry::{Line, Plane};
use crate::optics::{DepthOfField, Optics};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeSet;

/// What a figure file of such a kind says beside page and camera.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct SectionKeys {
    /// The plane of the section: `auto` holds the normals of lens and film, `side` is upright along the rail, `top` level.
    #[schemars(extend("enum" = ["auto", "side", "top"]), example = &"auto")]
    section: String,
    /// Parts left out, by name.
    #[schemars(schema_with = "keys::part_names")]
    hide: Vec<String>,
}

impl Default for SectionKeys {
    fn default() -> Self {
        Self { section: "auto".into(), hide: Vec::new() }
    }
}

/// A figure file of such a kind, read.
pub(crate) struct Stage {
    pub(crate) page: Page,
    pub(crate) subject: Subject,
    pub(crate) section: Section,
    /// What the kind and the file leave out.
    pub(crate) hidden: BTreeSet<String>,
    /// What the file leaves out.
    pub(crate) hide: Vec<String>,
}

impl Stage {
    /// Reads page, camera and section. Of the parts that can be left out, the kind shows those in `shown`.
    ///
    /// # Errors
    /// Those of [`Input::page`] and [`Input::camera`].
    pub(crate) fn read(input: &Input, height: impl Fn(f64) -> f64, shown: &[&str]) -> Result<Self> {
        let keys: SectionKeys = input.keys()?;
        let page = input.page(height)?;
        let hidden = without(shown, &keys.hide);
        let subject = input.camera(!hidden.contains("subject"))?;
        let section = input.changes.section.unwrap_or(match keys.section.as_str() {
            "side" => Section::Side,
            "top" => Section::Top,
            _ => Section::Auto,
        });
        Ok(Self { page, subject, section, hidden, hide: keys.hide })
    }

    /// The scene of the file's own camera.
    pub(crate) fn scene(&self) -> Scene<'_> {
        self.scene_of(&self.subject.optics)
    }

    /// The scene of another camera that stands in the same place.
    pub(crate) fn scene_of<'a>(&'a self, optics: &'a Optics) -> Scene<'a> {
        Scene::new(
            optics,
            &self.page.theme,
            self.subject.circle,
            (self.section, self.subject.up),
            &self.subject.triangles,
            &self.hidden,
        )
    }
}

/// The parts that are not in `shown`, and those in `hide`.
pub(crate) fn without(shown: &[&str], hide: &[String]) -> BTreeSet<String> {
    let left_out = PARTS.iter().filter(|part| !shown.contains(part)).map(|part| (*part).to_owned());
    left_out.chain(hide.iter().cloned()).collect()
}

/// Where the section cuts a line, when it does so within `most` metres of the lens.
pub(crate) fn near_point(scene: &Scene, line: Line, most: f64) -> Option<[f64; 2]> {
    match scene.section.pierce(line) {
        Pierce::At(p) if libm::hypot(p[0], p[1]) <= most => Some(p),
        _ => None,
    }
}

/// Where the axis crosses a plane ahead, section metres, when within `most` metres.
pub(crate) fn on_axis(scene: &Scene, plane: Plane, most: f64) -> Option<[f64; 2]> {
    let t = extent::crossing(scene, plane).filter(|&t| t <= most)?;
    Some(scene.section.project(scene.optics.axis() * t))
}

/// The box around the camera and some points, section metres.
///
/// # Errors
/// When the camera's numbers are too extreme to be drawn.
pub(crate) fn around(scene: &Scene, points: &[[f64; 2]]) -> Result<Bounds> {
    let extent = Extent::of(scene);
    if !extent.is_finite() {
        return Err(Error::invalid("the camera's numbers are too extreme to be drawn")
            .remedy("check extension_mm, film_mm and the rises and shifts"));
    }
    let mut bounds = extent.standards;
    let tall = parts::camera_height(scene);
    for p in points.iter().copied().chain([[0.0, 0.5 * tall], [0.0, -0.5 * tall]]) {
        extent::grow(&mut bounds, p);
    }
    Ok(bounds)
}

/// A panel whose parts are drawn by [`parts::draw`] with marks of the kind over them.
///
/// # Errors
/// When a label has a character without a glyph.
pub(crate) fn panel(
    scene: &Scene,
    panel: Panel,
    name: &'static str,
    marks: impl FnOnce(&Scene, &mut Canvas),
) -> Result<Group> {
    let mut canvas = Canvas::new(panel, scene.theme);
    parts::draw(scene, &mut canvas, Role::Whole);
    marks(scene, &mut canvas);
    parts::close(scene, canvas, name)
}

/// Where the hinge and Scheimpflug lines are cut and the axis crosses the focus plane, as far as they are near; the nearest of what the
/// focus plane goes through also where it is far, unless the camera would be a dot.
pub(crate) fn rule_points(scene: &Scene) -> Vec<[f64; 2]> {
    let optics = scene.optics;
    let f = optics.focal_length();
    let most = reach(std::iter::once(nearest(scene)).filter(|&d| d < 240.0 * f), 30.0 * f);
    let lines = [optics.hinge_line(), optics.scheimpflug_line()];
    let near = lines.into_iter().filter_map(|line| near_point(scene, line, most));
    near.chain(on_axis(scene, optics.focus_plane(), most)).collect()
}

/// How far (metres) a sweep is shown, of the nearest that each of its cameras has to show: `least`, or to the last of them where the
/// first of them would not be lost in it.
pub(crate) fn reach(nearest: impl Iterator<Item = f64>, least: f64) -> f64 {
    let (first, last) = nearest
        .filter(|distance| distance.is_finite())
        .fold((f64::INFINITY, 0.0_f64), |(first, last), distance| (first.min(distance), last.max(distance)));
    if first.is_finite() { least.max(1.01 * last.min(5.0 * first)) } else { least }
}

/// How far from the lens the first of a camera's focus plane, along the axis, and its hinge line is, section metres.
pub(crate) fn nearest(scene: &Scene) -> f64 {
    let points = [
        on_axis(scene, scene.optics.focus_plane(), f64::INFINITY),
        near_point(scene, scene.optics.hinge_line(), f64::INFINITY),
    ];
    points.into_iter().flatten().map(|[x, y]| libm::hypot(x, y)).fold(f64::INFINITY, f64::min)
}

/// The box in which limits of sharpness are seen: the camera, the hinge line, and half as far again as the focus, or as the
/// near limits of a focus that is far.
///
/// # Errors
/// Those of [`around`].
pub(crate) fn around_limits(scene: &Scene, limits: &[DepthOfField]) -> Result<Bounds> {
    let optics = scene.optics;
    let most = 120.0 * optics.focal_length();
    let mut points = Vec::from_iter(near_point(scene, optics.hinge_line(), most));
    let mut seen = Vec::from_iter(on_axis(scene, optics.focus_plane(), most));
    if seen.is_empty() {
        // Of a focus too far to be shown, the near limits are what there is to see.
        seen.extend(limits.iter().filter_map(|one| on_axis(scene, one.near, f64::INFINITY)));
        let within = reach(seen.iter().map(|p| libm::hypot(p[0], p[1])), 0.0);
        seen.retain(|p| libm::hypot(p[0], p[1]) <= within);
    }
    points.extend(seen.iter().map(|p| p.map(|x| 1.5 * x)));
    around(scene, &points)
}

/// A box as [`around`], with the rest of a broad page ahead of the camera.
///
/// # Errors
/// Those of [`around`].
pub(crate) fn around_sweep(scene: &Scene, points: &[[f64; 2]]) -> Result<Bounds> {
    let [left, low, right, high] = around(scene, points)?;
    Ok([left, low, right.max(left + 1.5 * (high - low)), high])
}

/// The frames of panels that share one: beside one another, or one under the other, each over a strip of its own.
pub(crate) fn split([left, top, right, bottom]: [f64; 4], count: usize, upright: bool) -> Vec<[f64; 4]> {
    let part = |low: f64, high: f64, gap: f64, i: usize| {
        let one = (high - low - gap * (count as f64 - 1.0)) / count as f64;
        let begin = low + i as f64 * (one + gap);
        [begin, begin + one]
    };
    let one = |i| {
        if upright {
            let [t, b] = part(top, bottom + STRIP, 2.0, i);
            [left, t, right, b - STRIP]
        } else {
            let [l, r] = part(left, right, GUTTER, i);
            [l, top, r, bottom]
        }
    };
    (0..count).map(one).collect()
}

/// The page point of a point in lens space.
pub(crate) fn page_of(scene: &Scene, panel: &Panel, point: DVec3) -> Point {
    panel.page(scene.section.project(point))
}

/// A page direction of a vector in lens space, unit.
pub(crate) fn page_way(scene: &Scene, vector: DVec3) -> Point {
    let [x, y] = scene.section.project(vector);
    let length = libm::hypot(x, y).max(1e-12);
    [x / length, -y / length]
}

/// The least height of panels, page millimetres.
const LEAST_HIGH: f64 = 25.0;

/// What a panel shows, and from where it is seen, unless that is from the side.
pub(crate) fn seen(scene: &Scene, words: &str) -> String {
    let section = &scene.section;
    match section.name() {
        _ if section.view == View::Side && !section.rail_level => words.to_owned(),
        name if words.is_empty() => name.to_owned(),
        name => format!("{words}, {name}"),
    }
}

/// The height that a page of one panel and some sentences takes.
pub(crate) fn height(width: f64) -> f64 {
    0.5 * width + 30.0
}

/// A page with one panel, its scale, and sentences under it.
///
/// # Errors
/// When the page is too small, or a glyph is missing.
pub(crate) fn single(
    stage: &Stage,
    mut scene: Scene,
    bounds: Bounds,
    title: &str,
    sentences: &[String],
    marks: impl FnOnce(&Scene, &mut Canvas),
) -> Result<Figure> {
    let (mut sheet, frame) = begin(stage, sentences)?;
    let fitted = extent::fit(bounds, frame, 5.0);
    scene.bundles = rays::bundles(&scene, &fitted);
    sheet.push(panel(&scene, fitted, "main", marks)?);
    sheet.strip(&fitted, scene.section.name(), false)?;
    end(stage, sheet, frame, title, sentences)
}

/// The page with its title, and the room for panels between title and sentences.
///
/// # Errors
/// When the page is too small, or a glyph is missing.
pub(crate) fn begin<'a>(stage: &'a Stage, sentences: &[String]) -> Result<(Sheet<'a>, [f64; 4])> {
    let width = stage.page.size[0];
    let mut sheet = Sheet::new(stage.page.size, [60.0, 40.0], &stage.page.theme)?;
    sheet.background = stage.page.background;
    sheet.with_scale = !stage.hide.iter().any(|part| part == "scale");
    let top = sheet.heading(stage.page.title.as_deref())?;
    let foot = LEADING * wrapped(stage, sentences)?.len() as f64 + 1.0;
    let around = top + MARGIN + STRIP + foot;
    // A narrow page breaks sentences into many lines.
    let wanted = around + LEAST_HIGH.max(0.5 * width);
    let height = stage.page.height_for(&mut sheet, around + LEAST_HIGH, wanted)?;
    let frame = [MARGIN, top, width - MARGIN, height - MARGIN - STRIP - foot];
    Ok((sheet, frame))
}

/// The sentences in lines that fit the page.
fn wrapped(stage: &Stage, sentences: &[String]) -> Result<Vec<String>> {
    if stage.hidden.contains("caption") {
        return Ok(Vec::new());
    }
    let mut all = Vec::new();
    for sentence in sentences {
        all.extend(sheet::broken(sentence, stage.page.size[0] - 2.0 * MARGIN)?);
    }
    Ok(all)
}

/// Writes the sentences under the panels and closes the page.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn end(
    stage: &Stage,
    mut sheet: Sheet,
    frame: [f64; 4],
    title: &str,
    sentences: &[String],
) -> Result<Figure> {
    sheet.block(&wrapped(stage, sentences)?, [MARGIN, frame[3] + STRIP + 1.0])?;
    let description: Vec<String> = sentences.iter().map(|sentence| sheet::plain(sentence)).collect();
    sheet.finish(title, description.join(" "))
}

/// Whether the angle between lens and film is seen in the section as it is.
pub(crate) fn shows_angles(scene: &Scene) -> bool {
    scene.section.holds(scene.optics.axis()) && scene.section.holds(scene.optics.film_normal())
}

/// What is to be said beside a distance of the hinge line that cannot be measured in the section.
pub(crate) fn slanted(scene: &Scene) -> &'static str {
    let hinge = scene.optics.hinge_line();
    match scene.section.pierce(hinge) {
        Pierce::At(_) if whereabouts::is_square(&scene.section, hinge) => "",
        Pierce::At(_) => " (This section is not square to the hinge line, and cuts it farther off.)",
        Pierce::Parallel => " (The hinge line runs beside this section, parallel to it.)",
        Pierce::AtInfinity | Pierce::Within(..) => "",
    }
}

/// The camera's settings as a sentence.
pub(crate) fn camera_sentence(scene: &Scene) -> String {
    let optics = scene.optics;
    let camera = optics.camera();
    let mut parts = vec![format!("*f* = {}", words::length(optics.focal_length()))];
    parts.extend(facts::moved(camera, ["front", "rear"]));
    parts.push(format!("extension {}", words::extension(camera.extension)));
    format!("{}.", parts.join(", "))
}

/// Where a line lies, in words that can follow "the line is".
pub(crate) fn whereabouts(scene: &Scene, line: Line) -> String {
    match scene.section.pierce(line) {
        Pierce::AtInfinity => "at infinity".to_owned(),
        Pierce::At(p) => {
            let Cut { distance, way, is_square } = cut(&scene.section, line, p);
            let is_of = ["right", "left", "ahead"].iter().any(|word| way.ends_with(word));
            let of = if is_of { " of" } else { "" };
            let here = if is_square { "" } else { " in this section" };
            format!("{distance} {way}{of} the lens{here}")
        }
        Pierce::Parallel | Pierce::Within(..) => {
            format!("{} from the lens", words::length(line.distance_from_origin()))
        }
    }
}
