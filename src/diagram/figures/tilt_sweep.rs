//! `kind = "tilt-sweep"`: one camera at several tilts of its lens. In: a camera and the tilts. Out: its section with one lens
//! plane, one focus plane and one hinge line for each.

use super::file::Input;
use super::stage::{self, Stage};
use crate::camera::{Camera, Standard};
use crate::diagram::Figure;
use crate::diagram::canvas::Label;
use crate::diagram::display_list::{Fill, Shape};
use crate::diagram::parts::Scene;
use crate::diagram::place::Weight;
use crate::diagram::planes::{Style, trace};
use crate::diagram::section::{Pierce, Section};
use crate::diagram::theme::{self, solid};
use crate::diagram::words::{exact, length, short};
use crate::error::Result;
use crate::optics::Optics;
use crate::quantity::Angle;
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says besides.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// Tilts of the lens in degrees, one focus plane each; by default 10, 15, 20 and 30.
    #[serde(default)]
    #[schemars(length(max = 12), inner(range(min = -89.0, max = 89.0)), example = vec![10.0, 20.0, 30.0])]
    tilts_deg: Vec<f64>,
}

const SHOWN: [&str; 4] = ["bellows", "caption", "film-parallel", "label"];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let mut stage = Stage::read(input, stage::height, &SHOWN)?;
    if stage.section == Section::Auto {
        // The one section that stays when only the tilt changes.
        stage.section = Section::Side;
    }
    let keys: Keys = input.keys()?;
    let own = *stage.subject.optics.camera();
    let tilts = if keys.tilts_deg.is_empty() { vec![10.0, 15.0, 20.0, 30.0] } else { keys.tilts_deg };
    let mut all = Vec::new();
    for &tilt in &tilts {
        let front = Standard { tilt: Angle::degrees(tilt), ..own.front };
        all.push(Optics::new(&Camera { front, ..own })?);
    }
    let scene = stage.scene();
    let nearest = all.iter().map(|optics| stage::nearest(&stage.scene_of(optics)));
    let most = stage::reach(nearest, 16.0 * scene.optics.focal_length());
    let mut points: Vec<[f64; 2]> = Vec::new();
    for optics in &all {
        points.extend(stage::on_axis(&stage.scene_of(optics), optics.focus_plane(), 0.5 * most));
        points.extend(stage::near_point(&scene, optics.hinge_line(), most));
    }
    let bounds = stage::around_sweep(&scene, &points)?;
    let journey: Vec<String> = tilts
        .iter()
        .zip(&all)
        .map(|(tilt, optics)| {
            let j = optics.hinge_distance().map_or("at infinity".to_owned(), length);
            format!("{}°: {j}", short(*tilt))
        })
        .collect();
    // θ is the angle between lens and film: the tilt, where nothing else is turned.
    let is_tilt = |(tilt, optics): (&f64, &Optics)| {
        let sine = optics.hinge_distance().map_or(0.0, |j| optics.focal_length() / j);
        (sine - libm::sin(tilt.to_radians()).abs()).abs() < 1e-9
    };
    // Without what the sweep changes.
    let own = scene.optics.camera();
    let still = Optics::new(&Camera { front: Standard { tilt: Angle::ZERO, ..own.front }, ..*own })?;
    let sizes = || tilts.iter().map(|tilt| tilt.abs());
    let differ = sizes().fold(0.0, f64::max) > sizes().fold(f64::INFINITY, f64::min);
    let rear = own.rear;
    let is_lens_alone = rear.tilt == Angle::ZERO && rear.swing == Angle::ZERO;
    let rule = if is_lens_alone && differ && tilts.iter().zip(&all).all(is_tilt) {
        "The more the lens is tilted, the nearer the hinge line, *J* = *f* / sin θ"
    } else {
        "The hinge line's distance where lens and film stand at the angle θ, *J* = *f* / sin θ, by the tilt of the lens"
    };
    let sentences = [
        format!(
            "{rule}: {}.{}",
            journey.join(", "),
            all.iter()
                .map(|optics| stage::slanted(&stage.scene_of(optics)))
                .find(|note| !note.is_empty())
                .unwrap_or("")
        ),
        stage::camera_sentence(&stage.scene_of(&still)),
    ];
    stage::single(&stage, scene, bounds, "Tilting", &sentences, |scene, canvas| {
        let hidden = stage::without(&["focus-plane"], &stage.hide);
        let theme = scene.theme;
        for (optics, &tilt) in all.iter().zip(&tilts) {
            let one = Scene { hidden: &hidden, ..stage.scene_of(optics) };
            canvas.data = vec![("data-tilt-deg", exact(tilt))];
            let half = one.lens * (0.4 * crate::diagram::parts::camera_height(scene));
            let ends = [half, -half].map(|p| stage::page_of(&one, &canvas.panel, p));
            canvas
                .part("lens-plane", vec![Shape::line(ends[0], ends[1], solid(theme.lens.line, theme::THIN))]);
            canvas.avoid(ends[0], ends[1], theme::THIN, Weight::Light);
            let style = Style {
                front: solid(theme.focus.line, 0.5),
                split: Some(one.section.trace(optics.lens_plane())),
                behind_at_most: 4.0,
                weight: Weight::Heavy,
            };
            if let Some((a, b)) = trace(&one, canvas, "focus-plane", optics.focus_plane(), style, None) {
                let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                let anchors = [0.98, 0.94, 0.9, 0.85, 0.8, 0.75].map(at).to_vec();
                let label = Label::new(format!("{}°", short(tilt)), theme.focus.word, anchors);
                canvas.label(label.toward([-0.3, -0.95]).beside((a, b), 0.93));
            }
            if let Pierce::At(p) = one.section.pierce(optics.hinge_line()) {
                let page = canvas.panel.page(p);
                if canvas.panel.holds(page, 0.0) {
                    let fill = Some(Fill::Flat { color: theme.paper, opacity: 1.0 });
                    let ring = Shape::circle(page, 0.65, fill, Some(solid(theme.hinge.line, 0.4)));
                    canvas.part("hinge-line", vec![ring]);
                    canvas.avoid_disk(page, 0.9);
                    let label = Label::new(format!("{}°", short(tilt)), theme.hinge.word, vec![page]);
                    canvas.label(label.toward([-1.0, 0.0]));
                }
            }
        }
        canvas.data.clear();
    })
}
