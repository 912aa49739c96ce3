//! `kind = "figure-1"`: the three panels of figure 1 in B. A. Barsky and E. Pasztor, "Rendering skewed plane of sharp focus and
//! associated depth of field" (SIGGRAPH 2004 sketches). In: scene files, one a panel. Out: their cameras in section, one
//! under the other, to one scale.

use super::file::{Input, Subject};
use super::stage;
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::extent::{self, Extent};
use crate::diagram::facts;
use crate::diagram::lines::{NEAR_LENS, distance};
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::rays;
use crate::diagram::section::{Pierce, Section};
use crate::diagram::sheet::{MARGIN, STRIP, Sheet};
use crate::error::{Error, Result};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeSet;

/// What a figure file of this kind says beside the page.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// Scene files, one a panel, relative to this file.
    #[schemars(length(min = 1, max = 6), example = vec!["a.toml", "b.toml", "c.toml"])]
    scenes: Vec<String>,
}

const NAMES: [&str; 6] = ["a", "b", "c", "d", "e", "f"];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let keys: Keys = input.keys()?;
    let count = keys.scenes.len() as f64;
    let page = input.page(|width| (0.32 * width + 6.0) * count + 10.0)?;
    let mut subjects: Vec<Subject> = Vec::new();
    for (i, written) in keys.scenes.iter().enumerate() {
        subjects.push(input.scene(&format!("scenes[{i}]"), written, true)?);
    }
    let hidden: BTreeSet<String> = ["caption".to_owned(), "dimension".to_owned()].into();
    let mut scenes: Vec<Scene> = subjects
        .iter()
        .map(|s| Scene::new(&s.optics, &page.theme, s.circle, (Section::Side, s.up), &s.triangles, &hidden))
        .collect();
    let mut bounds: Option<[f64; 4]> = None;
    for scene in &scenes {
        let extent = Extent::of(scene);
        if !extent.is_finite() {
            return Err(Error::invalid("the camera's numbers are too extreme to be drawn").at_key("scenes"));
        }
        let own = bounds.get_or_insert(extent.scene);
        extent::grow(own, [extent.scene[0], extent.scene[1]]);
        extent::grow(own, [extent.scene[2], extent.scene[3]]);
    }
    let mut sheet = Sheet::new(page.size, [60.0, 60.0], &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let width = page.size[0];
    let needed = top + MARGIN + 25.0 * count;
    let height = page.height_for(&mut sheet, needed, needed)?;
    let each = (height - top - MARGIN) / count;
    let mut description = Vec::new();
    for (i, scene) in scenes.iter_mut().enumerate() {
        let upper = top + each * i as f64;
        let frame = [MARGIN, upper, width - MARGIN, upper + each - STRIP - 1.5];
        let panel = extent::fit(bounds.unwrap_or([0.0, 0.0, 1.0, 1.0]), frame, 3.0);
        scene.bundles = rays::bundles(scene, &panel);
        let name = NAMES.get(i).copied().unwrap_or("panel");
        let mut canvas = Canvas::new(panel, scene.theme);
        parts::draw(scene, &mut canvas, Role::Main);
        names(scene, &mut canvas);
        sheet.push(parts::close(scene, canvas, name)?);
        let moved = facts::moved(scene.optics.camera(), ["lens", "film"]);
        let said = if moved.is_empty() { "nothing tilted".to_owned() } else { moved.join(", ") };
        sheet.strip(&panel, &format!("({name}) {said}"), false)?;
        description
            .push(format!("({name}) {said}: {}.", stage::camera_sentence(scene).trim_end_matches('.')));
    }
    let description = crate::diagram::sheet::plain(&description.join(" "));
    sheet.finish("Three ways to place the focus plane", description)
}

/// Names for the camera's parts, from afar: it is small here, and no other panel shows it larger.
fn names(scene: &Scene, canvas: &mut Canvas) {
    let (optics, theme, panel) = (scene.optics, scene.theme, canvas.panel);
    let lines = [
        ("Scheimpflug line", optics.scheimpflug_line(), theme.lens, [-0.8, 0.6]),
        ("hinge line", optics.hinge_line(), theme.hinge, [0.6, 0.8]),
    ];
    for (words, line, hue, toward) in lines {
        if let Pierce::At(p) = scene.section.pierce(line)
            && panel.holds(panel.page(p), 0.0)
            && distance(panel.page(p), panel.origin) <= NEAR_LENS
        {
            canvas.label(Label::new(words, hue.word, vec![panel.page(p)]).toward(toward).optional());
        }
    }
    let page = |p| panel.page(scene.section.project(p));
    let top = |ends: [DVec3; 2]| ends.map(page).into_iter().min_by(|p, q| p[1].total_cmp(&q[1]));
    let lens = [1.0, -1.0].map(|side| scene.lens * (side * optics.aperture_radius()));
    for (words, at, color, toward) in [
        ("film", scene.film.and_then(top), theme.ink, [-0.7, -0.7]),
        ("lens", top(lens), theme.lens.word, [0.7, -0.7]),
    ] {
        canvas.label(Label::new(words, color, Vec::from_iter(at)).toward(toward).optional());
    }
}
