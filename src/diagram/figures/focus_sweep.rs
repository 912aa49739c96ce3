//! `kind = "focus-sweep"`: one camera at several extensions. In: a camera and the extensions. Out: its section with one
//! film and one focus plane for each, all focus planes through the hinge line.

use super::file::Input;
use super::stage::{self, Stage};
use crate::camera::Camera;
use crate::diagram::Figure;
use crate::diagram::canvas::Label;
use crate::diagram::display_list::Shape;
use crate::diagram::parts::Scene;
use crate::diagram::place::Weight;
use crate::diagram::planes::{Style, trace};
use crate::diagram::theme::{self, solid};
use crate::diagram::words::{self, exact, length};
use crate::error::Result;
use crate::optics::Optics;
use crate::quantity::Length;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// From lens to film along the rail, in millimetres, one focus plane each; by default five about the camera's own.
    #[serde(default)]
    #[schemars(length(max = 12), inner(range(min = 1e-9, max = 1e9)), example = vec![160.0, 170.0, 180.0])]
    extensions_mm: Vec<f64>,
}

const SHOWN: [&str; 8] =
    ["bellows", "caption", "film-parallel", "front-focal-plane", "hinge-line", "label", "lens-board", "axis"];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, stage::height, &SHOWN)?;
    let keys: Keys = input.keys()?;
    let own = *stage.subject.optics.camera();
    let extensions = if keys.extensions_mm.is_empty() {
        let middle = own.extension.as_millimetres();
        // Steps of a twentieth of the focal length, to whole millimetres where that is more than one.
        let step = (own.focal_length.as_millimetres() / 20.0).max(1e-3);
        let step = if step > 1.0 { step.round() } else { step };
        (-2..=2).map(|i| middle + f64::from(i) * step).filter(|&e| e > 0.0).collect()
    } else {
        keys.extensions_mm
    };
    let mut all = Vec::new();
    for &extension in &extensions {
        all.push(Optics::new(&Camera { extension: Length::millimetres(extension), ..own })?);
    }
    let scene = stage.scene();
    // Parallel planes have no hinge line to be near to.
    let least =
        if scene.optics.hinge_distance().is_none() { 80.0 } else { 30.0 } * scene.optics.focal_length();
    let most = stage::reach(all.iter().map(|optics| stage::nearest(&stage.scene_of(optics))), least);
    let mut points: Vec<[f64; 2]> =
        all.iter().filter_map(|optics| stage::on_axis(&scene, optics.focus_plane(), 0.5 * most)).collect();
    points.extend(stage::near_point(&scene, scene.optics.hinge_line(), most));
    for optics in &all {
        points.push(scene.section.project(optics.film_center()));
    }
    let bounds = stage::around_sweep(&scene, &points)?;
    let told = |millimetres: f64| words::extension(Length::millimetres(millimetres));
    let from = extensions.iter().copied().fold(f64::INFINITY, f64::min);
    let to = extensions.iter().copied().fold(0.0, f64::max);
    let rule = match scene.optics.hinge_distance() {
        Some(j) => format!(
            "As the extension {} the focus plane turns about the hinge line, *J* = {} from the lens: \
             film and lens keep their directions.{}",
            if from < to {
                format!("goes from {} to {}", told(from), told(to))
            } else {
                "changes".to_owned()
            },
            length(j),
            stage::slanted(&scene)
        ),
        None => {
            let distances = all.iter().zip(&extensions).map(|(optics, &extension)| {
                let plane = optics.focus_plane();
                // Along the axis itself, whether the section holds it or not.
                let along = -plane.e / plane.m.dot(optics.axis());
                let at = match plane.is_at_infinity() {
                    true => "∞".to_owned(),
                    false if along > 0.0 => length(along),
                    false => "none ahead".to_owned(),
                };
                format!("{}: {at}", told(extension))
            });
            format!(
                "Lens and film are parallel: the hinge line is at infinity, and focusing moves the focus plane along \
                 the axis: {}.",
                distances.collect::<Vec<_>>().join(", ")
            )
        }
    };
    let sentences = [rule, stage::camera_sentence(&scene)];
    stage::single(&stage, scene, bounds, "Focusing", &sentences, |scene, canvas| {
        let hidden = stage::without(&["focus-plane"], &stage.hide);
        for (optics, &extension) in all.iter().zip(&extensions) {
            let one = Scene { hidden: &hidden, ..stage.scene_of(optics) };
            let is_own = extension == own.extension.as_millimetres();
            canvas.data = vec![("data-extension-mm", exact(extension))];
            let stroke = solid(scene.theme.focus.line, if is_own { 0.6 } else { theme::MEDIUM });
            let split = Some(one.section.trace(optics.lens_plane()));
            let style = Style { front: stroke, split, behind_at_most: 4.0, weight: Weight::Heavy };
            if let Some((a, b)) = trace(&one, canvas, "focus-plane", optics.focus_plane(), style, None) {
                let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                let anchors = [0.98, 0.94, 0.9, 0.85, 0.8, 0.75, 0.65, 0.55].map(at).to_vec();
                let words = told(extension);
                canvas.label(
                    Label::new(words, scene.theme.focus.word, anchors)
                        .toward([-0.3, -0.95])
                        .beside((a, b), 0.93),
                );
            }
            if let Some([p, q]) = one.film {
                let (p, q) =
                    (stage::page_of(scene, &canvas.panel, p), stage::page_of(scene, &canvas.panel, q));
                canvas.part("film", vec![Shape::line(p, q, solid(scene.theme.film.line, theme::MEDIUM))]);
                canvas.avoid(p, q, theme::MEDIUM, Weight::Light);
            }
        }
        canvas.data.clear();
    })
}
