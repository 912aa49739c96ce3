//! `kind = "film-tilt-vs-lens-tilt"`: one focus plane reached both ways. In: a camera whose lens is turned. Out: two panels to
//! one scale: that camera, and one whose film is turned instead until the same plane is sharp.

use super::file::Input;
use super::stage::{self, Stage};
use crate::camera::{Camera, Standard};
use crate::diagram::Figure;
use crate::diagram::extent;
use crate::diagram::facts;
use crate::diagram::rays;
use crate::diagram::words;
use crate::error::{Error, Result};
use crate::optics::{Adjust, FocusTarget, Optics, solve};
use crate::quantity::Angle;

const SHOWN: [&str; 10] = [
    "axis",
    "bellows",
    "caption",
    "focus-plane",
    "hinge-line",
    "label",
    "lens-board",
    "ray",
    "ray-bundle",
    "scheimpflug-line",
];

/// Below this width (mm) the panels stand one under the other.
const NARROW: f64 = 110.0;

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, |width| if width < NARROW { 1.6 * width } else { 0.55 * width }, &SHOWN)?;
    let own = &stage.subject.optics;
    let world = own.world_from_lens().plane(own.focus_plane()).normalized();
    if world.is_at_infinity() {
        return Err(Error::invalid("the focus plane is at infinity: no film tilt is asked for")
            .at_key("camera")
            .remedy("focus nearer: a larger extension_mm"));
    }
    let own = *own.camera();
    let level = |standard: Standard| Standard { tilt: Angle::ZERO, swing: Angle::ZERO, ..standard };
    let start = Camera { front: level(own.front), rear: level(own.rear), ..own };
    let target = FocusTarget::Plane { point: world.m * -world.e, normal: world.m };
    let is_straight = |standard: Standard| standard.tilt == Angle::ZERO && standard.swing == Angle::ZERO;
    let solved = |adjust| Optics::new(&solve(&start, &target, adjust).map_err(Error::from)?);
    // Of a camera whose film is turned the lens is turned instead.
    let is_of_film = is_straight(own.front) && !is_straight(own.rear);
    let turned_lens = if is_of_film { solved(Adjust::Front)? } else { stage.subject.optics.clone() };
    let (lens, film) = (&turned_lens, solved(Adjust::Rear)?);

    let mut bounds = None;
    for optics in [lens, &film] {
        let scene = stage.scene_of(optics);
        let own = stage::around(&scene, &stage::rule_points(&scene))?;
        let all = bounds.get_or_insert(own);
        extent::grow(all, [own[0], own[1]]);
        extent::grow(all, [own[2], own[3]]);
    }
    let bounds = bounds.unwrap_or([0.0, 0.0, 1.0, 1.0]);
    let turned = |optics: &Optics| {
        let camera = optics.camera();
        let mut settings = facts::moved(camera, ["front", "rear"]);
        settings.push(format!("extension {}", words::extension(camera.extension)));
        settings.join(", ")
    };
    let upright = stage.page.size[0] < NARROW;
    let [first, second] = if upright { ["Above", "Below"] } else { ["Left", "Right"] };
    // Both turned alike are parallel too, and there one of them does not do.
    let is_parallel = lens.hinge_distance().is_none() && is_straight(own.front) && is_straight(own.rear);
    let sentences = if is_parallel {
        vec![
            "Lens and film are parallel, and the plane to be sharp is parallel to both: nothing is to be turned.".to_owned(),
            stage::camera_sentence(&stage.scene_of(lens)),
        ]
    } else {
        vec![
            format!("One plane is sharp in both. {first}, the lens is turned: {}.", turned(lens)),
            format!(
                "{second}, the film: {}. Turning the film changes the shape of the picture, turning the lens does not.",
                turned(&film)
            ),
        ]
    };
    let (mut sheet, frame) = stage::begin(&stage, &sentences)?;
    let words = if is_parallel { ["", ""] } else { ["lens turned", "film turned"] };
    let both = [(lens, "lens-tilt", words[0]), (&film, "film-tilt", words[1])];
    for ((optics, name, words), frame) in both.into_iter().zip(stage::split(frame, 2, upright)) {
        let mut scene = stage.scene_of(optics);
        let panel = extent::fit(bounds, frame, 4.0);
        scene.bundles = rays::bundles(&scene, &panel);
        sheet.push(stage::panel(&scene, panel, name, |_, _| {})?);
        sheet.strip(&panel, &stage::seen(&scene, words), false)?;
    }
    stage::end(&stage, sheet, frame, "Film tilt and lens tilt", &sentences)
}
