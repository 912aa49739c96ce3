//! What stops a solver, drawn. In: the wanted plane and the limit met. Out: the plane, and what it would have to keep to: out of
//! the circle of radius f about the lens with its hinge line, or with itself; off the lens; before the lens's back.

use super::stage;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::display_list::{Point, Shape};
use crate::diagram::marks;
use crate::diagram::parts::Scene;
use crate::diagram::place::Weight;
use crate::diagram::planes::{self, Style, along};
use crate::diagram::section::Pierce;
use crate::diagram::theme::{self, broken};
use crate::diagram::words::length;
use crate::geometry::{Line, Plane};
use crate::optics::{Limit, Unsolvable};
use glam::DVec3;

/// Draws the wanted plane (lens space, unit normal) and the limit.
pub(crate) fn draw(scene: &Scene, canvas: &mut Canvas, wanted: Plane, stopped: &Unsolvable) {
    let theme = scene.theme;
    let style = Style::plain(broken(theme.focus.line, theme::MEDIUM, theme::DASHED));
    let ends = planes::trace(scene, canvas, "wanted-plane", wanted, style, None);
    match stopped.limit {
        Limit::HingeTooNear => {
            circle(scene, canvas, "*J* = *f*");
            hinge(scene, canvas, wanted);
        }
        Limit::NoRealImage => {
            circle(scene, canvas, "*f* about|the lens");
            distance(scene, canvas, wanted);
        }
        Limit::ThroughLens => {
            let lens = canvas.panel.origin;
            cross(scene, canvas, lens, "impossible-point");
            let words = "it passes through|the lens centre";
            canvas.label(Label::new(words, theme.hinge.word, vec![lens]).toward([0.6, 0.8]));
        }
        Limit::Backwards => behind(scene, canvas, "the lens faces|backwards beyond this"),
        Limit::Extension => behind(scene, canvas, "the film stands|behind this"),
        Limit::Camera | Limit::NoPlane | Limit::Upright => {}
    }
    if let Some((a, b)) = ends {
        canvas.label(Label::new("wanted plane", theme.focus.word, along(a, b)).beside((a, b), 0.75));
    }
}

/// The circle of radius f about the lens.
fn circle(scene: &Scene, canvas: &mut Canvas, words: &str) {
    let theme = scene.theme;
    let radius = scene.optics.focal_length() * canvas.panel.scale;
    let stroke = broken(theme.hinge.line, theme::THIN, theme::DOTTED);
    canvas.part("limit-circle", vec![Shape::circle(canvas.panel.origin, radius, None, Some(stroke))]);
    let [x, y] = canvas.panel.origin;
    let around = |i: i32| {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 48.0);
        [x + radius * cosine, y + radius * sine]
    };
    for i in 0..48 {
        canvas.avoid(around(i), around(i + 1), theme::THIN, Weight::Light);
    }
    canvas.label(Label::new(words, theme.hinge.word, [18, 6, 30, 42].map(around).to_vec()));
}

/// The hinge line that the wanted plane would have.
fn hinge(scene: &Scene, canvas: &mut Canvas, wanted: Plane) {
    let line = Line::meet(scene.optics.film_parallel_plane(), wanted);
    let Pierce::At(p) = scene.section.pierce(line) else { return };
    let at = canvas.panel.page(p);
    if canvas.panel.holds(at, 0.0) {
        cross(scene, canvas, at, "impossible-hinge");
        let words = format!("its hinge line,|*J* = {}", length(line.distance_from_origin()));
        canvas.label(Label::new(words, scene.theme.hinge.word, vec![at]).toward([-0.8, 0.5]));
    }
}

/// From the lens to the wanted plane, square to it.
fn distance(scene: &Scene, canvas: &mut Canvas, wanted: Plane) {
    let color = scene.theme.hinge.line;
    let foot = -wanted.e * wanted.m;
    let (from, to) = (canvas.panel.origin, stage::page_of(scene, &canvas.panel, foot));
    let long = marks::far(from, to);
    // Only in a section that holds its normal is the plane so near as it is drawn.
    if long < 2.0 || !scene.section.holds(wanted.m) || !canvas.panel.holds(to, 0.0) {
        return;
    }
    canvas.part("plane-distance", vec![Shape::line(from, to, theme::solid(color, theme::MEDIUM))]);
    canvas.avoid(from, to, theme::MEDIUM, Weight::Light);
    let back = marks::toward(to, from);
    marks::right_angle(canvas, to, back, [-back[1], back[0]], color);
    let at = |t: f64| [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
    let label = Label::new(length(wanted.e.abs()), scene.theme.hinge.word, [0.5, 0.7, 0.3].map(at).to_vec());
    canvas.label(label.beside((from, to), 0.5));
}

/// The plane through the lens square to the rail: lens and film stay on their sides of it.
fn behind(scene: &Scene, canvas: &mut Canvas, words: &str) {
    let stroke = broken(scene.theme.hinge.line, theme::MEDIUM, theme::DOTTED);
    let plane = Plane { m: DVec3::Z, e: 0.0 };
    if let Some((a, b)) = planes::trace(scene, canvas, "limit-plane", plane, Style::plain(stroke), None) {
        canvas.label(Label::new(words, scene.theme.hinge.word, along(a, b)).beside((a, b), 0.8));
    }
}

fn cross(scene: &Scene, canvas: &mut Canvas, at: Point, part: &'static str) {
    let stroke = theme::solid(scene.theme.hinge.line, 0.4);
    let line = |[a, b, c, d]: [f64; 4]| Shape::line([at[0] + a, at[1] + b], [at[0] + c, at[1] + d], stroke);
    canvas.part(part, [[-0.7, -0.7, 0.7, 0.7], [-0.7, 0.7, 0.7, -0.7]].map(line).to_vec());
    canvas.avoid(at, at, 1.6, Weight::Heavy);
}
