//! Marks of a drawing: angles with arcs, dimension lines, right angles. In: page points and directions. Out: groups on a
//! [`Canvas`], each with its label.

use super::canvas::{Canvas, Label};
use super::display_list::{Color, Fill, Geometry, Point, Segment, Shape};
use super::lines::distance;
pub(crate) use super::lines::distance as far;
use super::place::Weight;
use super::theme::{self, solid};

/// The unit direction from one page point to another.
pub(crate) fn toward(from: Point, to: Point) -> Point {
    let length = distance(from, to).max(1e-12);
    [(to[0] - from[0]) / length, (to[1] - from[1]) / length]
}

/// An arc from one direction to another (both unit), the short way round.
fn arc(center: Point, radius: f64, from: Point, to: Point) -> Vec<Segment> {
    let start = libm::atan2(from[1], from[0]);
    let sweep = libm::atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
    let pieces = libm::ceil(sweep.abs() / 0.5).max(1.0);
    let step = sweep / pieces;
    let k = 4.0 / 3.0 * libm::tan(step / 4.0) * radius;
    let at = |t: f64| {
        let (s, c) = libm::sincos(t);
        ([center[0] + radius * c, center[1] + radius * s], [-k * s, k * c])
    };
    let (first, _) = at(start);
    let mut path = vec![Segment::Move(first)];
    for i in 0..pieces as usize {
        let (p, u) = at(start + step * i as f64);
        let (q, v) = at(start + step * (i + 1) as f64);
        path.push(Segment::Cubic([p[0] + u[0], p[1] + u[1]], [q[0] - v[0], q[1] - v[1]], q));
    }
    path
}

/// An arc about a centre from one unit direction to another, with a head at its end.
pub(crate) fn arc_arrow(center: Point, radius: f64, from: Point, to: Point, color: Color) -> Vec<Shape> {
    let turn = if from[0] * to[1] - from[1] * to[0] >= 0.0 { 1.0 } else { -1.0 };
    let tip = [center[0] + radius * to[0], center[1] + radius * to[1]];
    // Along the circle at the tip.
    let along = [-turn * to[1], turn * to[0]];
    let back = [tip[0] - 1.8 * along[0], tip[1] - 1.8 * along[1]];
    let head =
        [tip, [back[0] + 0.7 * to[0], back[1] + 0.7 * to[1]], [back[0] - 0.7 * to[0], back[1] - 0.7 * to[1]]];
    let end = toward(center, back);
    let path = arc(center, radius, from, end);
    vec![
        Shape { geometry: Geometry::Path(path), fill: None, stroke: Some(solid(color, 0.4)) },
        Shape::polyline(&head, true, Some(Fill::Flat { color, opacity: 1.0 }), None),
    ]
}

/// An angle at a vertex between two directions, with its arc and name; nothing where it is too flat to be seen.
pub(crate) fn angle(
    canvas: &mut Canvas,
    vertex: Point,
    from: Point,
    to: Point,
    radius: f64,
    words: &str,
    color: Color,
) {
    let chord = radius * distance(from, to);
    if chord < 1.2 || !canvas.panel.holds(vertex, 0.0) {
        return;
    }
    let path = arc(vertex, radius, from, to);
    let shape = Shape { geometry: Geometry::Path(path), fill: None, stroke: Some(solid(color, theme::THIN)) };
    canvas.part("angle", vec![shape]);
    let middle = toward([0.0; 2], [from[0] + to[0], from[1] + to[1]]);
    let at = [vertex[0] + radius * middle[0], vertex[1] + radius * middle[1]];
    let ends = [from, to].map(|d| [vertex[0] + radius * d[0], vertex[1] + radius * d[1]]);
    canvas.avoid(ends[0], at, theme::THIN, Weight::Light);
    canvas.avoid(at, ends[1], theme::THIN, Weight::Light);
    canvas.label(Label::new(words, color, vec![at]).toward(middle));
}

/// A right angle at a vertex between two unit directions.
pub(crate) fn right_angle(canvas: &mut Canvas, vertex: Point, from: Point, to: Point, color: Color) {
    let size = 1.6;
    let at = |a: f64, b: f64| [vertex[0] + a * from[0] + b * to[0], vertex[1] + a * from[1] + b * to[1]];
    if !canvas.panel.holds(at(size, size), 0.0) || !canvas.panel.holds(vertex, 0.0) {
        return;
    }
    let points = [at(size, 0.0), at(size, size), at(0.0, size)];
    let shape = Shape::polyline(&points, false, None, Some(solid(color, theme::HAIR)));
    canvas.part("right-angle", vec![shape]);
}

/// A dimension line between two points, moved aside by `off` millimetres (to the left of the way from one to the other;
/// negative: to the right), with the lines that lead to it, arrow heads, and its name.
pub(crate) fn dimension(canvas: &mut Canvas, from: Point, to: Point, off: f64, words: &str, color: Color) {
    let along = toward(from, to);
    let long = distance(from, to);
    // Left of the way, as the page is seen.
    let side = [along[1], -along[0]];
    let moved = |p: Point, by: f64| [p[0] + by * side[0], p[1] + by * side[1]];
    let (a, b) = (moved(from, off), moved(to, off));
    if long < 5.0 || !canvas.panel.holds(a, 0.8) || !canvas.panel.holds(b, 0.8) {
        return;
    }
    let hair = solid(color, theme::HAIR);
    let mut shapes = Vec::new();
    if off.abs() > 1.0 {
        let sign = off.signum();
        for p in [from, to] {
            shapes.push(Shape::line(moved(p, 0.8 * sign), moved(p, off + 0.8 * sign), hair));
        }
    }
    shapes.push(Shape::line(a, b, hair));
    for (tip, way) in [(a, 1.0), (b, -1.0)] {
        let back = [tip[0] + 1.6 * way * along[0], tip[1] + 1.6 * way * along[1]];
        let head = [tip, moved(back, 0.45), moved(back, -0.45)];
        shapes.push(Shape::polyline(&head, true, Some(Fill::Flat { color, opacity: 1.0 }), None));
    }
    canvas.part("dimension", shapes);
    canvas.avoid(a, b, theme::THIN, Weight::Light);
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    let anchors = [0.5, 0.4, 0.6, 0.3, 0.7].map(at).to_vec();
    let sign = if off < 0.0 { -1.0 } else { 1.0 };
    canvas.label(Label::new(words, color, anchors).toward([sign * side[0], sign * side[1]]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_go_the_short_way_and_end_where_they_should() {
        for (from, to) in [([1.0, 0.0], [0.0, 1.0]), ([0.0, -1.0], [-1.0, 0.0]), ([1.0, 0.0], [-0.6, 0.8])] {
            let path = arc([10.0, 20.0], 5.0, from, to);
            let Some(Segment::Cubic(_, _, end)) = path.last() else { panic!("an arc is curved") };
            assert!(distance(*end, [10.0 + 5.0 * to[0], 20.0 + 5.0 * to[1]]) < 1e-9);
            for segment in &path {
                if let Segment::Cubic(_, _, p) = segment {
                    assert!((distance(*p, [10.0, 20.0]) - 5.0).abs() < 1e-9);
                }
            }
        }
    }
}
