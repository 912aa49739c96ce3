//! Bundles of rays. In: film points. Out: rays that bend in the lens plane and run to the conjugate of their film point.

use super::canvas::Canvas;
use super::display_list::{Fill, Point, Shape};
use super::panel::{PageLine, Panel};
use super::parts::Scene;
use super::place::Weight;
use super::theme::{self, solid};
use crate::geometry::HomogeneousPoint;
use glam::DVec3;

/// Film points whose bundles are drawn: two far apart, with their sharp points in the panel where there are such.
pub(crate) fn bundles(scene: &Scene, panel: &Panel) -> Vec<DVec3> {
    let Some([p, q]) = scene.film else { return Vec::new() };
    let at = |t: f64| 0.5 * (p + q) + (q - p) * (0.5 * t);
    // No light comes along the lens: a film point near its plane has no bundle to speak of.
    let is_lit = |p: DVec3| -scene.optics.axis().dot(p) > 0.1 * p.length();
    let shown =
        |t: &f64| is_lit(at(*t)) && conjugate(scene, at(*t)).is_some_and(|x| panel.holds(panel.page(x), 3.0));
    let ladder: Vec<f64> = (-7..=7).map(|i| f64::from(i) * 0.1).filter(shown).collect();
    match (ladder.first(), ladder.last()) {
        (Some(&a), Some(&b)) if b - a > 0.25 => vec![at(a), at(b)],
        (Some(&a), Some(_)) => vec![at(a)],
        // Nothing sharp in sight: parallel or diverging bundles show that as well.
        _ => [-0.55, 0.55].map(at).into_iter().filter(|&p| is_lit(p)).collect(),
    }
}

/// Where the bundle through a film point meets the subject side: a page point, or a direction for each lens point.
fn conjugate(scene: &Scene, point: DVec3) -> Option<[f64; 2]> {
    let q = scene.optics.object_of(HomogeneousPoint::finite(point));
    // Behind the lens the film point has a.p < 0; its conjugate is real when the weight is negative.
    (q.w < 0.0).then(|| scene.section.project(q.to_affine())).filter(|p| p[0].is_finite() && p[1].is_finite())
}

/// The page path of one ray: film point, lens point, and the conjugate point or the frame.
fn ray_path(scene: &Scene, canvas: &Canvas, point: DVec3, lens: DVec3) -> Option<[Point; 3]> {
    let panel = canvas.panel;
    let optics = scene.optics;
    let (fx, fy) = optics.film_axes();
    let (ex, ey) = optics.lens_axes();
    let beside = point - optics.film_center();
    let ray = optics.ray(ex.dot(lens), ey.dot(lens), fx.dot(beside), fy.dot(beside));
    let start = panel.page(scene.section.project(point));
    let middle = panel.page(scene.section.project(ray.origin));
    if !panel.holds(start, 0.0) || !panel.holds(middle, 0.0) {
        return None;
    }
    if let Some(p) = conjugate(scene, point).map(|p| panel.page(p))
        && panel.holds(p, 0.0)
    {
        return Some([start, middle, p]);
    }
    let d = scene.section.project(ray.direction);
    let length = libm::hypot(d[0], d[1]);
    let line = PageLine { at: middle, along: [d[0] / length, -d[1] / length] };
    let (_, end) = panel.clip(&line, 0.0, 2.0 * panel.reach())?;
    Some([start, middle, line.point(end)])
}

/// The soft area between the outermost rays of a bundle.
pub(crate) fn pencil(scene: &Scene, canvas: &mut Canvas, point: DVec3) {
    let rim = scene.lens * scene.optics.aperture_radius();
    if rim == DVec3::ZERO {
        return;
    }
    let (Some(one), Some(two)) = (ray_path(scene, canvas, point, rim), ray_path(scene, canvas, point, -rim))
    else {
        return;
    };
    let polygon = canvas.panel.clip_polygon(&[one[0], one[1], one[2], two[2], two[1]]);
    let fill = Fill::Flat { color: scene.theme.ray.line, opacity: 0.2 };
    canvas.part("ray-bundle", vec![Shape::polyline(&polygon, true, Some(fill), None)]);
}

pub(crate) fn rays(scene: &Scene, canvas: &mut Canvas, point: DVec3) {
    let rim = scene.lens * scene.optics.aperture_radius();
    let lens_points = if rim == DVec3::ZERO { vec![rim] } else { vec![rim, DVec3::ZERO, -rim] };
    for lens in lens_points {
        if let Some(path) = ray_path(scene, canvas, point, lens) {
            let stroke = solid(scene.theme.ray.line, theme::THIN);
            canvas.part("ray", vec![Shape::polyline(&path, false, None, Some(stroke))]);
            canvas.avoid(path[0], path[1], theme::THIN, Weight::Light);
            canvas.avoid(path[1], path[2], theme::THIN, Weight::Light);
        }
    }
}
