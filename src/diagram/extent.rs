//! What a figure has to show, and at which scale. In: the scene in the section. Out: boxes in section metres,
//! and panels fitted to them at a customary scale.

use super::panel::Panel;
use super::parts::{Scene, camera_height};
use super::section::{Pierce, SectionPlane};
use super::words::customary_scale;
use crate::geometry::{HomogeneousPoint, Plane};
use crate::optics::Optics;
use glam::DVec3;

/// A rectangle of the section: left, low, right, high, metres.
pub(crate) type Bounds = [f64; 4];

/// What is to be seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Camera, focus, subject, and the lines where they are near enough.
    pub(crate) scene: Bounds,
    /// The camera to its front focal plane.
    pub(crate) camera: Bounds,
    /// Film and lens alone.
    pub(crate) standards: Bounds,
}

/// The ends of the film in the section, lens space; `None` when the section misses the film.
pub(crate) fn film_in_section(optics: &Optics, section: &SectionPlane) -> Option<[DVec3; 2]> {
    let film = optics.camera().film;
    let half = [0.5 * film.width.as_metres(), 0.5 * film.height.as_metres()];
    let (fx, fy) = optics.film_axes();
    let s = section.normal;
    // Film points (x, y) with gx x + gy y + h = 0, within |x| <= half[0], |y| <= half[1].
    let (gx, gy, h) = (s.dot(fx), s.dot(fy), s.dot(optics.film_center()));
    let square = gx * gx + gy * gy;
    let (x0, y0) = (-h * gx / square, -h * gy / square);
    let (dx, dy) = (-gy, gx);
    let (mut t0, mut t1) = (f64::NEG_INFINITY, f64::INFINITY);
    for (at, along, half) in [(x0, dx, half[0]), (y0, dy, half[1])] {
        if along.abs() <= 1e-12 {
            if at.abs() > half || at.is_nan() {
                return None;
            }
        } else {
            let (a, b) = ((-half - at) / along, (half - at) / along);
            t0 = t0.max(a.min(b));
            t1 = t1.min(a.max(b));
        }
    }
    let ends = [t0, t1].map(|t| optics.film_point(x0 + t * dx, y0 + t * dy));
    (t0 < t1 && ends.iter().all(|p| p.is_finite())).then_some(ends)
}

pub(crate) fn grow(bounds: &mut Bounds, p: [f64; 2]) {
    bounds[0] = bounds[0].min(p[0]);
    bounds[1] = bounds[1].min(p[1]);
    bounds[2] = bounds[2].max(p[0]);
    bounds[3] = bounds[3].max(p[1]);
}

impl Extent {
    pub(crate) fn of(scene: &Scene) -> Self {
        let optics = scene.optics;
        let section = &scene.section;
        let mut standards = [0.0; 4];
        for side in [1.0, -1.0] {
            grow(&mut standards, section.project(scene.lens * (side * optics.aperture_radius())));
        }
        match scene.film {
            Some(ends) => ends.iter().for_each(|&p| grow(&mut standards, section.project(p))),
            None => grow(&mut standards, section.project(optics.film_center())),
        }
        let f = optics.focal_length();
        let tall = camera_height(scene);
        let mut camera = standards;
        grow(&mut camera, section.project(optics.axis() * (1.05 * f)));
        grow(&mut camera, [-0.0, 0.5 * tall]);
        grow(&mut camera, [-0.0, -0.5 * tall]);
        for line in [optics.hinge_line(), optics.scheimpflug_line()] {
            if let Pierce::At(p) = section.pierce(line)
                && libm::hypot(p[0], p[1]) < 2.0 * (tall + f)
            {
                grow(&mut camera, p);
            }
        }
        Self { scene: scene_bounds(scene, standards, tall), camera, standards }
    }

    /// The larger side of film and lens, metres.
    pub(crate) fn camera_size(&self) -> f64 {
        let [l, b, r, t] = self.standards;
        (r - l).max(t - b)
    }

    pub(crate) fn is_finite(&self) -> bool {
        let sane = |b: &Bounds| b.iter().all(|x| x.abs() < 1e12) && (b[2] - b[0]).max(b[3] - b[1]) > 1e-12;
        sane(&self.scene) && sane(&self.camera)
    }
}

/// How often the axis, as the section shows it, goes from the lens to where it crosses a plane's trace; when in front and finite.
/// Where the section holds the axis these are metres along it.
pub(crate) fn crossing(scene: &Scene, plane: Plane) -> Option<f64> {
    let [u, v] = scene.section.project(scene.optics.axis());
    let [mu, mv, e] = scene.section.trace(plane);
    let t = -e / (mu * u + mv * v);
    (t > 0.0 && t.is_finite()).then_some(t)
}

fn scene_bounds(scene: &Scene, standards: Bounds, tall: f64) -> Bounds {
    let optics = scene.optics;
    let section = &scene.section;
    let f = optics.focal_length();
    let size = (standards[2] - standards[0]).max(tall);
    let focus = crossing(scene, optics.focus_plane());
    let hinge = optics.hinge_distance();
    let subject = subject_distance(scene);
    // How far the drawing reaches: to the focus, unless that is so far that nothing else could be told apart.
    let most = hinge.map_or(400.0 * f, |j| (14.0 * j).min(400.0 * f)).max(subject.unwrap_or(0.0) * 1.3);
    let near = scene.depth.and_then(|d| crossing(scene, d.near)).filter(|&t| t < 400.0 * f);
    let reach = match (focus, hinge, near) {
        (Some(t), _, _) if t <= most => t,
        (_, Some(j), _) if j < 200.0 * f => (5.0 * j).max(10.0 * f).min(most),
        (_, _, Some(near)) => 1.8 * near,
        _ => 30.0 * f,
    };
    // The subject is in the picture, unless it would make the rest small.
    let seen = subject.filter(|&s| s < 1e4 * f);
    let reach = match seen {
        Some(s) if focus.is_none_or(|t| t > most) => reach.max(s),
        Some(s) => reach.max(1.15 * s.min(1.5 * reach)),
        None => reach,
    };
    let mut bounds = standards;
    let ahead = section.project(optics.axis());
    grow(&mut bounds, [ahead[0] * 1.12 * reach, ahead[1] * 1.12 * reach]);
    grow(&mut bounds, [0.0, 0.16 * reach]);
    grow(&mut bounds, [0.0, -0.16 * reach]);
    if let Some(far) = scene.depth.and_then(|d| crossing(scene, d.far))
        && far < 1.7 * reach
    {
        grow(&mut bounds, [ahead[0] * 1.05 * far, ahead[1] * 1.05 * far]);
    }
    for line in [optics.hinge_line(), optics.scheimpflug_line()] {
        if let Pierce::At(p) = section.pierce(line) {
            // Shown where it is near, or costs little of the scale.
            let mut with = bounds;
            grow(&mut with, [p[0] * 1.06, p[1] * 1.06]);
            let larger = |b: Bounds| (b[2] - b[0]).max(1.15 * (b[3] - b[1]));
            let near = libm::hypot(p[0], p[1]) < (0.5 * reach).max(2.2 * size);
            if near || larger(with) < 1.3 * larger(bounds) {
                bounds = with;
            }
        }
    }
    for point in seen_points(scene, reach * 1.4) {
        grow(&mut bounds, point);
    }
    // The subject where the figure reaches anyway.
    let high = 0.75 * reach;
    for p in scene.subject.iter().flatten() {
        if p[0] > 0.0 && p[0] < 1.25 * reach && p[1].abs() < high {
            grow(&mut bounds, *p);
        }
    }
    bounds
}

/// Sharp points that the middle of the film sees, within a distance.
fn seen_points(scene: &Scene, within: f64) -> Vec<[f64; 2]> {
    let Some([p, q]) = scene.film else { return Vec::new() };
    let mut points = Vec::new();
    for t in [-0.5, 0.5] {
        let x = 0.5 * (p + q) + (q - p) * (0.5 * t);
        let seen = scene.optics.object_of(HomogeneousPoint::finite(x));
        if seen.w < 0.0 {
            let at = scene.section.project(seen.to_affine());
            if libm::hypot(at[0], at[1]) < within {
                points.push(at);
            }
        }
    }
    points
}

/// The distance beyond which three quarters lie of what the camera sees of the subject, metres along the axis.
fn subject_distance(scene: &Scene) -> Option<f64> {
    let [p, q] = scene.film?;
    let a = scene.optics.axis();
    let ahead = scene.section.project(a);
    // Slopes of the film's ends through the lens centre.
    let slopes = [p, q].map(|x| scene.section.project(-x)).map(|d| (d[0], d[1]));
    let mut seen: Vec<f64> = Vec::new();
    for [b, c] in &scene.subject {
        let m = [0.5 * (b[0] + c[0]), 0.5 * (b[1] + c[1])];
        let sides = slopes.map(|(dx, dy)| dx * m[1] - dy * m[0]);
        if m[0] > 0.0 && sides[0] * sides[1] < 0.0 {
            seen.push(m[0] * ahead[0] + m[1] * ahead[1]);
        }
    }
    seen.sort_by(f64::total_cmp);
    seen.get(seen.len() / 4).copied().filter(|&d| d > 0.0)
}

/// A panel in `frame` that shows `bounds` at the largest customary scale, `pad` millimetres inside the frame.
pub(crate) fn fit(bounds: Bounds, frame: [f64; 4], pad: f64) -> Panel {
    let (w, h) = (frame[2] - frame[0] - 2.0 * pad, frame[3] - frame[1] - 2.0 * pad);
    let (bw, bh) = (bounds[2] - bounds[0], bounds[3] - bounds[1]);
    let least = 1000.0 * (bw / w).max(bh / h);
    let scale = 1000.0 / customary_scale(least);
    let middle = [0.5 * (bounds[0] + bounds[2]), 0.5 * (bounds[1] + bounds[3])];
    let center = [0.5 * (frame[0] + frame[2]), 0.5 * (frame[1] + frame[3])];
    // To whole tenths, so that files stay short.
    let tenth = |x: f64| (x * 10.0).round() / 10.0;
    Panel {
        frame,
        scale,
        origin: [tenth(center[0] - scale * middle[0]), tenth(center[1] + scale * middle[1])],
    }
}
