//! `kind = "limits-compared"`: four answers to how much is sharp, in one section. In: a camera. Out: the wedge, the exact contour,
//! Merklinger's limits, and the formula for a camera without movements.

use super::exact_blur;
use super::file::Input;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::facts;
use crate::diagram::parts::Scene;
use crate::diagram::place::Weight;
use crate::diagram::planes::{Style, along, stub, trace};
use crate::diagram::theme::{self, broken, solid};
use crate::diagram::words::{length, short};
use crate::error::{Error, Result};
use crate::optics::DepthOfField;

const SHOWN: [&str; 6] = ["bellows", "caption", "focus-plane", "hinge-line", "label", "lens-board"];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, |width| 0.55 * width + 38.0, &SHOWN)?;
    let scene = stage.scene();
    let optics = scene.optics;
    if optics.aperture_radius() == 0.0 {
        return Err(Error::invalid("a pinhole has no depth of field to speak of").at_key("camera.pinhole"));
    }
    let circle = stage.subject.circle;
    let bounds = stage::around_limits(&scene, scene.depth.as_slice())?;
    let extension = -optics.film_plane().e / optics.focal_length();
    let untilted = optics.untilted_limits(circle);
    let sentences = [
        format!(
            "What is sharp to *c* = {}{}: the exact contour; the wedge, exact for one diameter of the blur; {}Merklinger's limits, \
             {}, since they take the film to stand at *f*{}.",
            length(circle),
            if facts::is_sharp_to_infinity(&scene) { ", here to infinity" } else { "" },
            if untilted.is_some() { "" } else { "and " },
            wider(extension),
            if untilted.is_some() {
                "; and the formula without movements, whose planes are square to the axis"
            } else {
                ""
            },
        ),
        stage::camera_sentence(&scene),
    ];
    stage::single(&stage, scene, bounds, "Limits of sharpness compared", &sentences, |scene, canvas| {
        let theme = scene.theme;
        let optics = scene.optics;
        let wedge = solid(theme.depth.line, 1.0);
        let merklinger = broken(theme.hinge.line, theme::MEDIUM, theme::DASHED);
        let untilted = broken(theme.quiet, theme::MEDIUM, theme::AXIS);
        let all = [
            (scene.depth, ["near-plane", "far-plane"], "wedge", wedge, theme.depth.word),
            (
                optics.merklinger_limits(circle),
                ["merklinger-near", "merklinger-far"],
                "Merklinger",
                merklinger,
                theme.hinge.word,
            ),
            (
                optics.untilted_limits(circle),
                ["untilted-near", "untilted-far"],
                "untilted",
                untilted,
                theme.quiet,
            ),
        ];
        for (limits, parts, name, stroke, color) in all {
            let Some(limits) = limits else { continue };
            both(scene, canvas, limits, parts, name, (stroke, color));
        }
        // Fine, over the wedge's broad lines: both are seen also where they are as good as one.
        exact_blur::lines(scene, canvas, (1.0, circle), "exact", (theme::MEDIUM, 0.25));
    })
}

/// How wide Merklinger's limits stand, of the exact ones.
fn wider(times: f64) -> String {
    match short(times) {
        one if one == "1" => "as wide".to_owned(),
        times_wide if times > 1.0 => format!("{times_wide} times as wide"),
        part => format!("only {part} times as wide"),
    }
}

fn both(
    scene: &Scene,
    canvas: &mut Canvas,
    limits: DepthOfField,
    parts: [&'static str; 2],
    name: &str,
    (stroke, color): (crate::diagram::Stroke, crate::diagram::Color),
) {
    let hidden = std::collections::BTreeSet::new();
    let shown = Scene { hidden: &hidden, bundles: Vec::new(), subject: Vec::new(), ..*scene };
    for (part, plane) in [(parts[0], limits.near), (parts[1], limits.far)] {
        let style = Style {
            front: stroke,
            split: Some(scene.section.trace(scene.optics.front_focal_plane())),
            behind_at_most: stub(scene, plane, 2.0),
            weight: if stroke.width < theme::HEAVY { Weight::Light } else { Weight::Heavy },
        };
        if let Some((a, b)) = trace(&shown, canvas, part, plane, style, None) {
            let mut anchors = vec![[a[0] + 0.95 * (b[0] - a[0]), a[1] + 0.95 * (b[1] - a[1])]];
            anchors.extend(along(a, b));
            canvas.label(Label::new(name, color, anchors).beside((a, b), 0.9));
        }
    }
}
