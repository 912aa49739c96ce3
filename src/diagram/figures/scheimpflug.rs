//! `kind = "scheimpflug"`: film plane, lens plane and focus plane, and the line that they share. In: a camera. Out: its
//! section with the three planes drawn to the line, and the angles between them there.

use super::file::Input;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::canvas::Canvas;
use crate::diagram::marks;
use crate::diagram::parts::Scene;
use crate::diagram::section::Pierce;
use crate::diagram::words::short;
use crate::error::Result;

const SHOWN: [&str; 9] = [
    "axis",
    "bellows",
    "caption",
    "focus-plane",
    "label",
    "lens-board",
    "ray",
    "ray-bundle",
    "scheimpflug-line",
];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, stage::height, &SHOWN)?;
    let scene = stage.scene();
    let optics = scene.optics;
    let size = 30.0 * optics.focal_length();
    let mut points = Vec::new();
    points.extend(stage::near_point(&scene, optics.scheimpflug_line(), size));
    points.extend(stage::on_axis(&scene, optics.focus_plane(), size));
    let bounds = stage::around(&scene, &points)?;
    let line = optics.scheimpflug_line();
    let rule = match scene.section.pierce(line) {
        Pierce::AtInfinity => {
            "Lens and film are parallel: the line that film plane, lens plane and focus plane \
                               share is at infinity, and the three are parallel."
                .to_owned()
        }
        _ => format!(
            "Film plane, lens plane and focus plane share the Scheimpflug line, {}.",
            stage::whereabouts(&scene, line)
        ),
    };
    let sentences = [rule, stage::camera_sentence(&scene)];
    stage::single(&stage, scene, bounds, "The rule of Scheimpflug", &sentences, angles)
}

/// The angles at the line, from the film plane to the lens plane.
fn angles(scene: &Scene, canvas: &mut Canvas) {
    let optics = scene.optics;
    let (Pierce::At(p), true) = (scene.section.pierce(optics.scheimpflug_line()), stage::shows_angles(scene))
    else {
        return;
    };
    let vertex = canvas.panel.page(p);
    let lens = canvas.panel.page([0.0, 0.0]);
    let film = stage::page_of(scene, &canvas.panel, optics.film_center());
    let to_lens = marks::toward(vertex, lens);
    // The film plane's direction in the section, on the side of the camera.
    let normal = stage::page_way(scene, optics.film_normal());
    let mut to_film = [-normal[1], normal[0]];
    if (film[0] - vertex[0]) * to_film[0] + (film[1] - vertex[1]) * to_film[1] < 0.0 {
        to_film = to_film.map(|x| -x);
    }
    let between = libm::acos(optics.axis().dot(-optics.film_normal()).clamp(-1.0, 1.0)).to_degrees();
    let radius = 0.45 * (marks::far(vertex, lens)).min(60.0);
    let words = format!("θ = {}°", short(between));
    marks::angle(canvas, vertex, to_film, to_lens, radius, &words, scene.theme.ink);
}
