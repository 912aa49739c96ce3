//! What a series draws in a chart. In: its points and its look. Out: error bars, line and markers as a group of a display list, and
//! the shapes that a legend shows of them, for [`super::plot`] and [`super::plot_names`].

use super::plot_axis::{Axis, Scale};
use super::plot_chart::{Chart, Look};
use super::plot_series::{DataPoint, Series};
use crate::diagram::Geometry;
use crate::diagram::display_list::{Fill, Group, Item, Point, Segment, Shape};
use crate::diagram::sheet::plain;
use crate::diagram::theme::{Theme, solid};
use crate::diagram::words::exact;

/// The width of an error bar in millimetres.
const BAR: f64 = 0.25;
/// Half the size of a marker.
pub(super) const MARK: f64 = 0.95;

/// A series: error bars under the line, markers over it. What lies beyond a given end of an axis is cut off.
pub(super) fn series_group(chart: &Chart, series: &Series, look: Look, theme: &Theme) -> Group {
    let panel = &chart.panel;
    let at = |p: &DataPoint| [chart.x.page(p.x), chart.y.page(p.y)];
    let mut items = Vec::new();
    let (mut bars, mut is_cut) = (Vec::new(), false);
    let ends = series
        .points
        .iter()
        .flat_map(|point| bar_ends(chart, point).into_iter().map(move |ends| (point, ends)));
    for (point, (a, b)) in ends {
        // One that lies on the frame is not cut off.
        let is_on_frame = [a, b].into_iter().all(|end| panel.holds(end, -1e-9));
        is_cut |= !is_on_frame && panel.holds(at(point), -1e-9);
        let piece = if is_on_frame { Some((a, b)) } else { panel.clip_segment(a, b) };
        if let Some((from, to)) = piece {
            let stroke = solid(look.hue.line, BAR);
            bars.push(Shape::line(from, to, stroke));
            // Caps lie across the bar.
            let [dx, dy] = if a[0] == b[0] { [0.7, 0.0] } else { [0.0, 0.7] };
            for [x, y] in [a, b].into_iter().filter(|&end| panel.holds(end, -1e-9)) {
                bars.push(Shape::line([x - dx, y - dy], [x + dx, y + dy], stroke));
            }
        }
    }
    if !bars.is_empty() {
        items.push(Item::Group(Group::of("error-bar", bars.into_iter().map(Item::Shape).collect())));
    }
    if look.line && series.points.len() > 1 {
        let mut path = Vec::new();
        let mut end: Option<Point> = None;
        for pair in series.points.windows(2) {
            let Some((a, b)) = panel.clip_segment(at(&pair[0]), at(&pair[1])) else {
                end = None;
                continue;
            };
            if end != Some(a) {
                path.push(Segment::Move(a));
            }
            path.push(Segment::Line(b));
            end = Some(b);
        }
        let shape = Shape { geometry: Geometry::Path(path), fill: None, stroke: Some(look.stroke) };
        items.push(Item::Group(Group::of("line", vec![Item::Shape(shape)])));
    }
    let shown: Vec<_> = series.points.iter().filter(|p| panel.holds(at(p), -1e-9)).collect();
    if look.markers {
        let marks = shown.iter().map(|p| Item::Shape(marker(at(p), look, theme))).collect();
        items.push(Item::Group(Group::of("marker", marks)));
    }
    if shown.len() < series.points.len() {
        items.push(Item::Group(Group::off_page("some-points", "beyond")));
    }
    if is_cut {
        items.push(Item::Group(Group::off_page("some-bars", "beyond")));
    }
    let list = |value: &dyn Fn(&DataPoint) -> f64| {
        shown.iter().map(|p| exact(value(p))).collect::<Vec<_>>().join(" ")
    };
    let data =
        vec![("data-series", plain(&series.name)), ("data-x", list(&|p| p.x)), ("data-y", list(&|p| p.y))];
    Group { part: Some("series"), data, items, ..Group::default() }
}

/// The ends of a point's error bars on the page. One that leaves a logarithmic axis ends beyond the frame.
pub(super) fn bar_ends(chart: &Chart, point: &DataPoint) -> Vec<(Point, Point)> {
    let [left, _, _, bottom] = chart.panel.frame;
    let page = |axis: &Axis, value: f64, beyond: f64| {
        if axis.range.scale == Scale::Log && value <= 0.0 { beyond } else { axis.page(value) }
    };
    let [x, y] = [chart.x.page(point.x), chart.y.page(point.y)];
    let upright = point.bar.map(|ends| ends.map(|value| [x, page(&chart.y, value, bottom + 9.0)]));
    let level = point.level_bar.map(|ends| ends.map(|value| [page(&chart.x, value, left - 9.0), y]));
    [upright, level].into_iter().flatten().map(|[a, b]| (a, b)).collect()
}

/// Six shapes, filled, then the same hollow.
pub(super) fn marker(at: Point, look: Look, theme: &Theme) -> Shape {
    let hollow = look.marker >= 6;
    let color = if hollow { theme.paper } else { look.hue.line };
    let fill = Some(Fill::Flat { color, opacity: 1.0 });
    let stroke = Some(solid(look.hue.line, if hollow { 0.3 } else { 0.12 }));
    let around = |corners: &[Point]| {
        let points: Vec<Point> = corners.iter().map(|c| [at[0] + MARK * c[0], at[1] + MARK * c[1]]).collect();
        Shape::polyline(&points, true, fill, stroke)
    };
    // The corners' mean is the point itself.
    match look.marker % 6 {
        0 => Shape::circle(at, 0.9 * MARK, fill, stroke),
        1 => around(&[[-0.8, -0.8], [0.8, -0.8], [0.8, 0.8], [-0.8, 0.8]]),
        2 => around(&[[0.0, -1.2], [1.05, 0.6], [-1.05, 0.6]]),
        3 => around(&[[0.0, -1.15], [1.15, 0.0], [0.0, 1.15], [-1.15, 0.0]]),
        4 => around(&[[0.0, 1.2], [1.05, -0.6], [-1.05, -0.6]]),
        _ => {
            let (a, b) = (0.35, 1.1);
            around(&[
                [-a, -b],
                [a, -b],
                [a, -a],
                [b, -a],
                [b, a],
                [a, a],
                [a, b],
                [-a, b],
                [-a, a],
                [-b, a],
                [-b, -a],
                [-a, -a],
            ])
        }
    }
}
