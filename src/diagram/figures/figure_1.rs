//! `kind = "figure-1"`: the three panels of figure 1 in B. A. Barsky and E. Pasztor, "Rendering skewed plane of sharp focus and
//! associated depth of field" (SIGGRAPH 2004 sketches). In: scene files, one a panel. Out: their cameras in section, one
//! under the other, to one scale.

use super::file::{Input, Subject};
use super::stage;
use crate::diagram::Figure;
use crate::diagram::extent::{self, Extent};
use crate::diagram::facts;
use crate::diagram::parts::{self, Role, Scene};
use crate::diagram::rays;
use crate::diagram::section::Section;
use crate::diagram::sheet::{MARGIN, STRIP, Sheet};
use crate::error::{Error, Result};
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
        .map(|s| Scene::new(&s.optics, &page.theme, s.circle, Section::Side, &s.triangles, &hidden))
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
    let [width, height] = page.size;
    let each = (height - top - MARGIN) / count;
    if each < 25.0 {
        return Err(Error::invalid("the page leaves no room for the panels").at_key("height_mm"));
    }
    let mut description = Vec::new();
    for (i, scene) in scenes.iter_mut().enumerate() {
        let upper = top + each * i as f64;
        let frame = [MARGIN, upper, width - MARGIN, upper + each - STRIP - 1.5];
        let panel = extent::fit(bounds.unwrap_or([0.0, 0.0, 1.0, 1.0]), frame, 3.0);
        scene.bundles = rays::bundles(scene, &panel);
        let name = NAMES.get(i).copied().unwrap_or("panel");
        sheet.push(parts::panel(scene, panel, Role::Main, name, None)?);
        let moved = facts::moved(scene.optics.camera(), ["lens", "film"]);
        let said = if moved.is_empty() { "nothing tilted".to_owned() } else { moved.join(", ") };
        sheet.strip(&panel, &format!("({name}) {said}"), false)?;
        description
            .push(format!("({name}) {said}: {}.", stage::camera_sentence(scene).trim_end_matches('.')));
    }
    let description = crate::diagram::sheet::plain(&description.join(" "));
    sheet.finish("Three ways to place the focus plane", description)
}
