//! `kind = "hinge"`: the plane through the lens parallel to the film, the front focal plane, and the line where both meet the
//! focus plane. In: a camera. Out: its section with the three planes, J and f.

use super::file::Input;
use super::stage::{self, Stage};
use crate::diagram::Figure;
use crate::diagram::canvas::Canvas;
use crate::diagram::display_list::Point;
use crate::diagram::marks;
use crate::diagram::parts::Scene;
use crate::diagram::section::Pierce;
use crate::diagram::whereabouts;
use crate::diagram::words::{length, short};
use crate::error::Result;

const SHOWN: [&str; 11] = [
    "axis",
    "bellows",
    "caption",
    "film-parallel",
    "focus-plane",
    "front-focal-plane",
    "hinge-line",
    "label",
    "lens-board",
    "ray",
    "ray-bundle",
];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let stage = Stage::read(input, stage::height, &SHOWN)?;
    let scene = stage.scene();
    let optics = scene.optics;
    let most = 30.0 * optics.focal_length();
    let mut points = Vec::new();
    points.extend(stage::near_point(&scene, optics.hinge_line(), most));
    points.extend(stage::on_axis(&scene, optics.focus_plane(), most));
    let ahead = scene.section.project(optics.axis());
    points.push(ahead.map(|x| 1.2 * optics.focal_length() * x));
    let bounds = stage::around(&scene, &points)?;
    let rule = match optics.hinge_distance() {
        None => {
            "Lens and film are parallel: the hinge line is at infinity, and focusing moves the focus plane \
                 along the axis."
                .to_owned()
        }
        Some(j) => format!(
            "The plane through the lens parallel to the film and the front focal plane meet in the hinge line, {}, \
             *J* =\u{a0}*f*\u{a0}/\u{a0}sin\u{a0}θ =\u{a0}{}. Focusing turns the focus plane about it.{}",
            stage::whereabouts(&scene, optics.hinge_line()),
            length(j),
            stage::slanted(&scene)
        ),
    };
    let sentences = [rule, stage::camera_sentence(&scene)];
    stage::single(&stage, scene, bounds, "The hinge rule", &sentences, measures)
}

/// J along the film-parallel plane, f square to the front focal plane, and the angle between the two planes.
pub(crate) fn measures(scene: &Scene, canvas: &mut Canvas) {
    lengths(scene, canvas);
    let optics = scene.optics;
    let (Some(hinge), true) = (hinge_on(scene, canvas), stage::shows_angles(scene)) else { return };
    let lens = canvas.panel.page([0.0, 0.0]);
    let focus = stage::page_of(scene, &canvas.panel, optics.axis() * optics.focal_length());
    let between = libm::acos(optics.axis().dot(-optics.film_normal()).clamp(-1.0, 1.0)).to_degrees();
    let radius = 0.4 * marks::far(hinge, lens).min(60.0);
    let (from, to) = (marks::toward(hinge, lens), marks::toward(hinge, focus));
    marks::angle(canvas, hinge, from, to, radius, &format!("θ = {}°", short(between)), scene.theme.ink);
}

/// Where the section cuts the hinge line, on the page.
fn hinge_on(scene: &Scene, canvas: &Canvas) -> Option<Point> {
    match scene.section.pierce(scene.optics.hinge_line()) {
        Pierce::At(p) => Some(canvas.panel.page(p)),
        _ => None,
    }
}

/// J and f.
pub(crate) fn lengths(scene: &Scene, canvas: &mut Canvas) {
    let optics = scene.optics;
    let theme = scene.theme;
    if !scene.section.holds(optics.axis()) {
        return;
    }
    let lens = canvas.panel.page([0.0, 0.0]);
    let a = stage::page_way(scene, optics.axis());
    let focus = stage::page_of(scene, &canvas.panel, optics.axis() * optics.focal_length());
    let hinge = hinge_on(scene, canvas);
    let side = hinge.unwrap_or(lens);
    // f on the side of the axis where the hinge is not.
    let left = a[0] * (side[1] - lens[1]) - a[1] * (side[0] - lens[0]) >= 0.0;
    let off = 0.62 * crate::diagram::parts::camera_height(scene) * canvas.panel.scale + 2.5;
    marks::dimension(canvas, lens, focus, if left { off } else { -off }, "*f*", theme.quiet);
    marks::right_angle(canvas, focus, a.map(|x| -x), [-a[1], a[0]], theme.quiet);
    if let Some(hinge) = hinge.filter(|_| whereabouts::is_square(&scene.section, optics.hinge_line())) {
        marks::dimension(canvas, lens, hinge, if left { -3.5 } else { 3.5 }, "*J*", theme.hinge.word);
    }
}
