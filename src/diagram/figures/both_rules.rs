//! `kind = "both-rules"`: the focus plane found without measuring it. In: a camera. Out: three panels to one scale: film and
//! lens planes meet; the film-parallel and front focal planes meet; the focus plane holds both lines.

use super::file::Input;
use super::hinge;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::canvas::Canvas;
use crate::diagram::extent;
use crate::diagram::parts::Scene;
use crate::diagram::rays;
use crate::error::Result;

/// What each step shows.
const STEPS: [&[&str]; 3] = [
    &["bellows", "caption", "label", "lens-board", "scheimpflug-line"],
    &["axis", "bellows", "film-parallel", "front-focal-plane", "hinge-line", "label", "lens-board"],
    &[
        "axis",
        "bellows",
        "focus-plane",
        "hinge-line",
        "label",
        "lens-board",
        "ray",
        "ray-bundle",
        "scheimpflug-line",
    ],
];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, |width| if width < 120.0 { 2.4 * width } else { 0.62 * width }, STEPS[0])?;
    let whole = stage.scene();
    let optics = whole.optics;
    let mut points = stage::rule_points(&whole);
    // To the front focal plane, also where nothing else is near.
    points.push(whole.section.project(optics.axis()).map(|x| 1.2 * optics.focal_length() * x));
    let bounds = stage::around(&whole, &points)?;
    let is_parallel = optics.hinge_distance().is_none();
    let sentences = if is_parallel {
        vec![
            "Lens and film are parallel: both lines are at infinity, and the focus plane is parallel to lens and \
             film, where the lens equation puts it."
                .to_owned(),
            stage::camera_sentence(&whole),
        ]
    } else {
        vec![
            format!(
                "1  Film plane and lens plane meet in the Scheimpflug line, {}.",
                stage::whereabouts(&whole, optics.scheimpflug_line())
            ),
            format!(
                "2  The plane through the lens parallel to the film and the front focal plane meet in the hinge \
                 line, {}.",
                stage::whereabouts(&whole, optics.hinge_line())
            ),
            "3  The focus plane holds both lines, and so is fixed.".to_owned(),
            stage::camera_sentence(&whole),
        ]
    };
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let frames = stage::split(frame, STEPS.len(), stage.page.size[0] < 120.0);
    for (i, (shown, box_of_step)) in STEPS.iter().zip(frames).enumerate() {
        let hidden = stage::without(shown, &stage.hide);
        let mut scene = Scene { hidden: &hidden, ..stage.scene() };
        let panel = extent::fit(bounds, box_of_step, 4.0);
        scene.bundles = rays::bundles(&scene, &panel);
        let name = ["step-1", "step-2", "step-3"][i];
        let is_wide = panel.width() > 45.0;
        let marks = |scene: &Scene, canvas: &mut Canvas| match i {
            1 if is_wide => hinge::measures(scene, canvas),
            1 => hinge::lengths(scene, canvas),
            _ => {}
        };
        sheet.push(stage::panel(&scene, panel, name, marks)?);
        sheet.strip(&panel, &stage::seen(&scene, &format!("step {}", i + 1)), false)?;
    }
    stage::end(&stage, sheet, frame, "Both rules", &sentences)
}
