//! `kind = "wedge"`: depth of field. In: a camera and some f-numbers. Out: the near and far planes of each, which all meet in
//! the hinge line, and beside it, greatly enlarged, how the cones of light of the limits cut the film in circles of
//! confusion.

use super::file::Input;
use super::stage::{self, Stage};
use crate::camera::{Aperture, Camera};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::display_list::{Fill, Group, Item, PanelFrame, Shape};
use crate::diagram::extent;
use crate::diagram::facts;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::place::Weight;
use crate::diagram::planes::{self, Style, along, trace};
use crate::diagram::section::{SectionPlane, View};
use crate::diagram::sheet::{GUTTER, STRIP};
use crate::diagram::theme::{self, broken, solid};
use crate::diagram::words::{exact, length, short};
use crate::error::{Error, Result};
use crate::geometry::HomogeneousPoint;
use crate::optics::Optics;
use crate::quantity::FNumber;
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// F-numbers, one wedge each; by default the camera's own, half and twice that.
    #[serde(default)]
    #[schemars(length(max = 6), inner(range(min = 1e-3, max = 1e6)), example = vec![8.0, 16.0, 32.0])]
    f_numbers: Vec<f64>,
}

const SHOWN: [&str; 6] = ["bellows", "caption", "focus-plane", "hinge-line", "label", "lens-board"];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, |width| if width < 110.0 { 1.3 * width } else { 0.55 * width }, &SHOWN)?;
    let keys: Keys = input.keys()?;
    let own = *stage.subject.optics.camera();
    let Aperture::FNumber(number) = own.aperture else {
        return Err(Error::invalid("a pinhole has no depth of field to speak of").at_key("camera.pinhole"));
    };
    let mut numbers = if keys.f_numbers.is_empty() {
        [0.5, 1.0, 2.0].map(|k| k * number.get()).to_vec()
    } else {
        keys.f_numbers
    };
    // The widest wedge first, under the others.
    numbers.sort_by(|a, b| b.total_cmp(a));
    let mut all = Vec::new();
    for &number in &numbers {
        let aperture = Aperture::FNumber(FNumber::new(number)?);
        all.push(Optics::new(&Camera { aperture, ..own })?);
    }
    let scene = stage.scene();
    let optics = scene.optics;
    let circle = stage.subject.circle;
    let depths: Vec<_> = all.iter().filter_map(|optics| stage.scene_of(optics).depth).collect();
    let bounds = stage::around_limits(&scene, &depths)?;
    let meeting = match optics.hinge_distance() {
        Some(j) => {
            let note = stage::slanted(&scene);
            format!("All limits meet in the hinge line, *J* = {} from the lens.{note}", length(j))
        }
        None => "Lens and film are parallel: the limits are parallel too, their hinge line is at infinity."
            .to_owned(),
    };
    let listed: Vec<String> = (numbers.iter().zip(&all).rev())
        .map(|(n, optics)| {
            let how_far =
                if facts::is_sharp_to_infinity(&stage.scene_of(optics)) { " (to infinity)" } else { "" };
            format!("*f*/{}{how_far}", short(*n))
        })
        .collect();
    let sentences = [
        format!(
            "Depth of field at {}, for circles of confusion of *c* = {}. {meeting}",
            listed.join(", "),
            length(circle)
        ),
        stage::camera_sentence(&scene),
    ];
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let [left, top, right, bottom] = frame;
    let upright = stage.page.size[0] < 110.0;
    let (main, beside) = if upright {
        let split = top + 0.6 * (bottom - top);
        ([left, top, right, split - STRIP], [left, split + 2.0, right, bottom])
    } else {
        let split = left + 0.6 * (right - left);
        ([left, top, split, bottom], [split + GUTTER, top, right, bottom])
    };
    let panel = extent::fit(bounds, main, 4.0);
    let mut canvas = Canvas::new(panel, scene.theme);
    limits(&stage, &scene, &mut canvas, &all, &numbers);
    parts::draw(&scene, &mut canvas, Role::Whole);
    sheet.push(parts::close(&scene, canvas, "main")?);
    sheet.strip(&panel, scene.section.name(), false)?;
    let (group, enlarged) = confusion(&scene, circle, beside)?;
    sheet.items.push(Item::Group(group));
    sheet.strip(&enlarged, &format!("at the film, *f*/{}", short(number.get())), false)?;
    stage::end(&stage, sheet, frame, "Depth of field", &sentences)
}

/// The wedges, the widest first, and their limits.
fn limits(stage: &Stage, scene: &Scene, canvas: &mut Canvas, all: &[Optics], numbers: &[f64]) {
    let hidden = stage::without(&["near-plane", "far-plane", "wedge"], &stage.hide);
    for (optics, &number) in all.iter().zip(numbers) {
        let one = Scene { hidden: &hidden, ..stage.scene_of(optics) };
        let Some(depth) = one.depth else { continue };
        canvas.data = vec![("data-f-number", exact(number))];
        planes::wedge(&one, canvas, Role::Inset);
        for (part, plane, name) in [("near-plane", depth.near, "near"), ("far-plane", depth.far, "far")] {
            let style = Style {
                front: solid(scene.theme.depth.line, theme::MEDIUM),
                split: Some(scene.section.trace(optics.front_focal_plane())),
                behind_at_most: planes::stub(&one, plane, 3.0),
                weight: Weight::Light,
            };
            if let Some((a, b)) = trace(&one, canvas, part, plane, style, None) {
                let words = format!("{name}, *f*/{}", short(number));
                let toward = if name == "near" { [0.0, -1.0] } else { [0.0, 1.0] };
                let mut anchors = vec![[a[0] + 0.93 * (b[0] - a[0]), a[1] + 0.93 * (b[1] - a[1])]];
                anchors.extend(along(a, b));
                canvas.label(
                    Label::new(words, scene.theme.depth.word, anchors).toward(toward).beside((a, b), 0.88),
                );
            }
        }
    }
    canvas.data.clear();
}

/// Greatly enlarged, the film and the images of the points at which the middle ray meets the limits, in the plane of that
/// ray and of the aperture's diameter that is parallel to lens and film: there the circle is cut exactly.
fn confusion(scene: &Scene, circle: f64, frame: [f64; 4]) -> Result<(Group, crate::diagram::panel::Panel)> {
    let optics = scene.optics;
    let theme = scene.theme;
    let center = optics.film_center();
    let across = optics.film_normal().cross(optics.axis());
    // Parallel planes: any diameter.
    let across = if across.length() > 1e-9 { across / across.length() } else { scene.lens };
    let u = -center / center.length();
    let v = across - u * u.dot(across);
    let v = v / v.length();
    let section = SectionPlane { u, v, normal: u.cross(v), view: View::Oblique, rail_level: false };
    let images: Vec<(&str, DVec3)> = scene
        .depth
        .into_iter()
        .flat_map(|depth| [("near", depth.near), ("far", depth.far)])
        .filter_map(|(name, plane)| {
            let image = optics.image_of(plane.meet_ray(DVec3::ZERO, -center));
            let at = image.to_affine();
            (image.w != 0.0 && at.is_finite() && (at - center).length() < center.length())
                .then_some((name, at))
        })
        .collect();
    let mut bounds = [section.project(center)[0], -1.5 * circle, section.project(center)[0], 1.5 * circle];
    for (_, image) in &images {
        extent::grow(&mut bounds, section.project(*image));
    }
    let room = 0.12 * (bounds[2] - bounds[0]).max(circle);
    let panel = extent::fit([bounds[0] - room, bounds[1], bounds[2] + room, bounds[3]], frame, 3.0);
    let mut canvas = Canvas::new(panel, theme);
    let page = |p: DVec3| panel.page(section.project(p));
    let rim = across * optics.aperture_radius();
    let film = |lens: DVec3, image: DVec3| {
        // Where the ray through a lens point and the image meets the film.
        let at: HomogeneousPoint = optics.film_plane().meet_ray(lens, image - lens);
        page(at.to_affine())
    };
    let mut cut = None;
    for (name, image) in &images {
        let ends = [rim, -rim].map(|lens| film(lens, *image));
        cut = cut.or(Some(ends));
        let tip = page(*image);
        let fill = Fill::Flat { color: theme.ray.line, opacity: 0.16 };
        // The cone from the lens to its tip and on to the film, within the panel.
        let from = [rim, -rim].map(page);
        let polygon = panel.clip_polygon(&[from[0], tip, from[1]]);
        canvas.part("ray-bundle", vec![Shape::polyline(&polygon, true, Some(fill), None)]);
        for lens in [rim, -rim] {
            let (start, hit) = (page(lens), film(lens, *image));
            // To the tip, or through it to the film.
            let end = if *name == "far" { hit } else { tip };
            if let Some((a, b)) = panel.clip_segment(start, end) {
                let shape = Shape::line(a, b, solid(theme.ray.line, theme::THIN));
                canvas.part("limit-ray", vec![shape]);
                canvas.avoid(a, b, theme::THIN, Weight::Light);
            }
        }
        let dot = Fill::Flat { color: theme.depth.line, opacity: 1.0 };
        canvas.part("limit-image", vec![Shape::circle(tip, 0.6, Some(dot), None)]);
        canvas.avoid_disk(tip, 0.8);
        let side = if *name == "far" { 1.0 } else { -1.0 };
        let label = Label::new(format!("image|of the|{name} limit"), theme.depth.word, vec![tip]);
        canvas.label(label.toward([0.3 * side, -0.95]));
    }
    let along_axis = [panel.frame[0], panel.frame[2]].map(|x| [x, page(center)[1]]);
    canvas.part(
        "chief-ray",
        vec![Shape::line(along_axis[0], along_axis[1], broken(theme.quiet, theme::THIN, theme::AXIS))],
    );
    // Where the film cuts the section: aslant, where the middle ray meets it so.
    let along_film = section.normal.cross(optics.film_normal());
    let reach = (bounds[2] - bounds[0] + bounds[3] - bounds[1] + room) * along_film / along_film.length();
    let ends = [center + reach, center - reach].map(page);
    let (upper, lower) = if ends[0][1] < ends[1][1] { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
    if let Some((upper, lower)) = panel.clip_segment(upper, lower) {
        canvas.part("film", vec![Shape::line(upper, lower, solid(theme.film.line, theme::HEAVY))]);
        canvas.avoid(upper, lower, theme::HEAVY, Weight::Heavy);
        let part = 4.0 / libm::hypot(lower[0] - upper[0], lower[1] - upper[1]).max(4.0);
        let inside = |a: [f64; 2], b: [f64; 2]| [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])];
        canvas.label(Label::new("film", theme.ink, vec![inside(upper, lower), inside(lower, upper)]));
    }
    if let Some([p, q]) = cut {
        let stroke = solid(theme.focus.line, 1.0);
        canvas.part("circle-of-confusion", vec![Shape::line(p, q, stroke)]);
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        let words = format!("*c* =|{}", length(circle));
        canvas.label(
            Label::new(words, theme.focus.word, vec![[middle[0], p[1].max(q[1])], p, q]).toward([0.8, 0.6]),
        );
    }
    let world = optics.world_from_lens();
    let (o, u, v) = (world.origin, world.vector(section.u), world.vector(section.v));
    let (s, [x, y]) = (panel.scale, panel.origin);
    let group = canvas.finish(PanelFrame {
        name: "film",
        section: [o.x, o.y, o.z, u.x, u.y, u.z, v.x, v.y, v.z],
        page_from_section: [s, 0.0, 0.0, -s, x, y],
    })?;
    Ok((group, panel))
}
