//! `kind = "plot"`: a line chart of numbers from a CSV or JSON file, or in the figure file itself; linear or logarithmic
//! axes, error bars, guides, and names at the lines' ends or in a legend that touches nothing.
//!
//! The chart is a group `chart` whose `data-x` and `data-y` say how the axes run: `log a b` is page = a + b log10(value),
//! `linear a b` page = a + b value. Each `series` group has its name and its values, in the order they are drawn.

use super::file::{Input, Page};
use super::plot_axis::{Axis, Range, Scale, Tick};
use super::plot_keys::{AxisKeys, GuideKeys, Keys, SeriesKeys};
use super::plot_names::{self, Names};
use super::plot_series::{self, DataPoint, Series};
use crate::diagram::display_list::{Fill, Group, Item, Point, Segment, Shape, Stroke};
use crate::diagram::lettering;
use crate::diagram::panel::Panel;
use crate::diagram::sheet::{MARGIN, Sheet, plain};
use crate::diagram::theme::{self, Hue, Theme, solid};
use crate::diagram::words::{exact, short};
use crate::diagram::{Figure, Geometry};
use crate::error::{Error, Result};

/// Widths in millimetres.
pub(crate) const LINE: f64 = 0.45;
const BAR: f64 = 0.25;
/// Half the size of a marker.
pub(crate) const MARK: f64 = 0.95;
/// Points nearer than this are not marked unless asked for.
const APART: f64 = 2.2;
/// Page millimetres that a tick's label takes: across, and up.
const ROOM: [f64; 2] = [17.0, 9.0];
/// From the frame down to the labels of its ticks: clear of those at its side.
const AWAY: f64 = 1.8;
/// Dashes of the series in turn.
const DASHES: [&[f64]; 6] =
    [&[], &[2.4, 0.9], &[0.8, 0.7], &[3.2, 0.7, 0.7, 0.7], &[1.4, 0.6], &[4.0, 0.8, 0.7, 0.6, 0.7, 0.8]];

/// How a series is drawn.
#[derive(Clone, Copy)]
pub(crate) struct Look {
    pub(crate) hue: Hue,
    pub(crate) stroke: Stroke,
    marker: usize,
    pub(crate) line: bool,
    pub(crate) markers: bool,
}

/// A guide on the page: its ends.
pub(crate) struct Guide {
    pub(crate) name: Option<String>,
    pub(crate) ends: [Point; 2],
}

/// All that the names must keep clear of and belong to.
pub(crate) struct Chart {
    pub(crate) panel: Panel,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<(Series, Look)>,
    pub(crate) guides: Vec<Guide>,
}

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let page = input.page(|width| 0.68 * width)?;
    let keys: Keys = input.keys()?;
    let mut all = Vec::new();
    for (i, series) in keys.series.iter().enumerate() {
        all.push(plot_series::read(input, i, series, keys.data.as_deref(), keys.table.as_deref())?);
    }
    let mut sheet = Sheet::new(page.size, [50.0, 35.0], &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let mut names = Names::wanted(&keys.names);
    let mut chart = settle(input, &keys, &all, &page, &sheet, top, names)?;
    // Where names do not fit as wanted, the chart is laid out again: twice at most.
    for _ in 0..2 {
        let settled = names.settled(&chart)?;
        if settled != names {
            names = settled;
            chart = settle(input, &keys, &all, &page, &sheet, top, names)?;
        }
    }
    paint(&keys, chart, sheet, names)
}

/// Axes, frame and looks. The frame leaves room for tick labels and titles, and for names at the right.
fn settle(
    input: &Input,
    keys: &Keys,
    all: &[Series],
    page: &Page,
    sheet: &Sheet,
    top: f64,
    names: Names,
) -> Result<Chart> {
    let [width, height] = sheet.size;
    let line = (lettering::ASCENT + lettering::DESCENT) * theme::LETTER;
    let room_across = [(width - 2.0 * MARGIN) / ROOM[0], (height - top) / ROOM[1]];
    let range = |axis: &AxisKeys, name: &str, values: Vec<f64>, room: f64| {
        let scale = if axis.scale.as_deref() == Some("log") { Scale::Log } else { Scale::Linear };
        // What the error is about: a bad value of a series, or an end of the axis.
        Range::holding(&values, scale, [axis.min, axis.max], room)
            .map_err(|error| error.at(input.document.place(name)))
    };
    let is_log = |axis: &AxisKeys| axis.scale.as_deref() == Some("log");
    let points = || all.iter().flat_map(|series| &series.points);
    // An error bar that reaches below zero leaves a logarithmic axis at its lower end; a point there is an error.
    let values = |axis: &AxisKeys, value: fn(&DataPoint) -> f64, bar: fn(&DataPoint) -> Option<[f64; 2]>| {
        let fits = |value: &f64| !is_log(axis) || *value > 0.0;
        let ends = points().filter_map(bar).flatten().filter(fits);
        points().map(value).chain(ends).collect::<Vec<f64>>()
    };
    let x = range(&keys.x, "x", values(&keys.x, |p| p.x, |p| p.level_bar), room_across[0])?;
    let y = range(&keys.y, "y", values(&keys.y, |p| p.y, |p| p.bar), room_across[1])?;

    let ticks = y.ticks(room_across[1], &keys.y.ticks);
    let mut widest: f64 = 0.0;
    for tick in &ticks {
        widest = widest.max(lettering::width(&lettering::runs(&tick.label))? * theme::LETTER);
    }
    let title_room = |axis: &AxisKeys| if axis.title.is_some() { line + 1.2 } else { 0.0 };
    let left = MARGIN + widest + 2.0;
    // Half of the uppermost tick's label stands over the frame.
    let frame_top = top + title_room(&keys.y) + 1.4;
    let bottom = height - MARGIN - line - AWAY - title_room(&keys.x);
    let right = width - MARGIN - names.room(all)?.max(4.0);
    let frame = [left, frame_top, right, bottom];
    if right - left < 20.0 || bottom - frame_top < 15.0 {
        return Err(Error::invalid(format!("a page of {width} by {height} mm leaves no room for the chart"))
            .at_key("width_mm")
            .remedy("give a larger page, or names = \"legend\""));
    }
    let panel = Panel { frame, scale: 1.0, origin: [left, bottom] };
    let x = Axis::new(x, left, right);
    let y = Axis::new(y, bottom, frame_top);
    let mut guides = Vec::new();
    for (i, guide) in keys.guide.iter().enumerate() {
        let ends = guide_ends(guide, &x, &y)
            .map_err(|error| error.at(input.document.place(&format!("guide[{i}]"))))?;
        if let Some((a, b)) = panel.clip_segment(ends[0], ends[1]) {
            guides.push(Guide { name: guide.name.clone(), ends: [a, b] });
        }
    }
    let series = all
        .iter()
        .zip(&keys.series)
        .enumerate()
        .map(|(i, (series, keys))| (series.clone(), look(&page.theme, i, keys, series, &x, &y)))
        .collect();
    Ok(Chart { panel, x, y, series, guides })
}

fn look(theme: &Theme, i: usize, keys: &SeriesKeys, series: &Series, x: &Axis, y: &Axis) -> Look {
    let hues = theme.series();
    let hue = hues.get(i % hues.len()).copied().unwrap_or(theme.lens);
    let dash = DASHES.get((i + i / hues.len()) % DASHES.len()).copied().unwrap_or_default();
    let at = |p: &DataPoint| [x.page(p.x), y.page(p.y)];
    let apart = series.points.windows(2).all(|w| distance(at(&w[0]), at(&w[1])) >= APART);
    Look {
        hue,
        stroke: Stroke { dash, round: true, ..solid(hue.line, LINE) },
        marker: i % 12,
        line: keys.line,
        markers: keys.markers.unwrap_or(apart || !keys.line),
    }
}

fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Two far points of a guide on the page.
fn guide_ends(guide: &GuideKeys, x: &Axis, y: &Axis) -> Result<[Point; 2]> {
    let corners =
        [[x.range.low, y.range.low], [x.range.high, y.range.high]].map(|[u, v]| [x.page(u), y.page(v)]);
    let positive = |scale: Scale, value: f64| {
        if scale == Scale::Log && value <= 0.0 {
            return Err(Error::invalid(format!("{value} cannot stand on a logarithmic axis")));
        }
        Ok(value)
    };
    let [[left, bottom], [right, top]] = corners;
    match (guide.slope, guide.through, guide.x, guide.y) {
        (None, None, Some(at), None) => {
            let at = x.page(positive(x.range.scale, at)?);
            Ok([[at, bottom], [at, top]])
        }
        (None, None, None, Some(at)) => {
            let at = y.page(positive(y.range.scale, at)?);
            Ok([[left, at], [right, at]])
        }
        (Some(slope), Some([u, v]), None, None) => {
            if x.range.scale != y.range.scale {
                return Err(Error::invalid("a slope has a meaning only where both axes have one scale")
                    .remedy("give x or y instead"));
            }
            let (u, v) = (positive(x.range.scale, u)?, positive(y.range.scale, v)?);
            let (pu, pv) = (x.page(u), y.page(v));
            // From the values' slope to the page's.
            let slope = slope * y.per / x.per;
            Ok([[left, pv + slope * (left - pu)], [right, pv + slope * (right - pu)]])
        }
        _ => {
            Err(Error::invalid("a guide has `slope` and `through`, or `x`, or `y`")
                .remedy("keep one of them"))
        }
    }
}

fn paint(keys: &Keys, chart: Chart, mut sheet: Sheet, names: Names) -> Result<Figure> {
    let theme = *sheet.theme;
    let mut items = Vec::new();
    let room = [chart.panel.width() / ROOM[0], chart.panel.height() / ROOM[1]];
    let x_ticks = chart.x.range.ticks(room[0], &keys.x.ticks);
    let y_ticks = chart.y.range.ticks(room[1], &keys.y.ticks);
    items.push(grid(&chart, &x_ticks, &y_ticks, &theme));
    for guide in &chart.guides {
        let stroke = Stroke { dash: theme::DASHED, ..solid(theme.quiet, theme::THIN) };
        let [a, b] = guide.ends;
        items.push(Item::Group(Group::of("guide", vec![Item::Shape(Shape::line(a, b, stroke))])));
    }
    for (series, look) in &chart.series {
        items.push(Item::Group(series_group(&chart, series, *look, &theme)));
    }
    items.extend(axes(&chart, &sheet, &x_ticks, &y_ticks)?);
    items.extend(titles(&chart, keys, &sheet)?);
    items.extend(plot_names::place(&chart, names, &theme)?);
    let data = |axis: &Axis| {
        let scale = if axis.range.scale == Scale::Log { "log" } else { "linear" };
        format!("{scale} {} {}", exact(axis.at), exact(axis.per))
    };
    let data = vec![("data-x", data(&chart.x)), ("data-y", data(&chart.y))];
    sheet.push(Group { part: Some("chart"), data, items, ..Group::default() });
    let title = |axis: &AxisKeys, name: &str| axis.title.as_deref().map_or(name.to_owned(), plain);
    let name = format!("{} against {}", title(&keys.y, "y"), title(&keys.x, "x"));
    sheet.finish(&name, describe(&chart, keys, &name))
}

fn grid(chart: &Chart, x_ticks: &[Tick], y_ticks: &[Tick], theme: &Theme) -> Item {
    let [left, top, right, bottom] = chart.panel.frame;
    let stroke = Stroke { opacity: 0.5, ..solid(theme.faint, theme::HAIR) };
    let major = |tick: &&Tick| !tick.label.is_empty();
    let mut lines = Vec::new();
    for tick in x_ticks.iter().filter(major) {
        let at = chart.x.page(tick.value);
        lines.push(Item::Shape(Shape::line([at, top], [at, bottom], stroke)));
    }
    for tick in y_ticks.iter().filter(major) {
        let at = chart.y.page(tick.value);
        lines.push(Item::Shape(Shape::line([left, at], [right, at], stroke)));
    }
    Item::Group(Group::of("grid", lines))
}

/// The frame, the ticks inside it, and their labels outside.
fn axes(chart: &Chart, sheet: &Sheet, x_ticks: &[Tick], y_ticks: &[Tick]) -> Result<Vec<Item>> {
    let [left, _, _, bottom] = chart.panel.frame;
    let ink = sheet.theme.ink;
    let mut ticks = Vec::new();
    let mut items = Vec::new();
    let stroke = solid(ink, theme::THIN);
    let mut last = f64::NEG_INFINITY;
    for tick in x_ticks {
        let at = chart.x.page(tick.value);
        let long = if tick.label.is_empty() { 0.8 } else { 1.5 };
        ticks.push(Item::Shape(Shape::line([at, bottom], [at, bottom - long], stroke)));
        if !tick.label.is_empty() {
            let runs = lettering::runs(&tick.label);
            let half = 0.5 * lettering::width(&runs)? * theme::LETTER;
            // Where labels would touch, every other is left out.
            if at - half < last + 1.2 {
                continue;
            }
            last = at + half;
            let base = bottom + AWAY + lettering::ASCENT * theme::LETTER;
            items.push(sheet.caption("tick-label", runs, [at - half, base], theme::LETTER)?);
        }
    }
    for tick in y_ticks {
        let at = chart.y.page(tick.value);
        let long = if tick.label.is_empty() { 0.8 } else { 1.5 };
        ticks.push(Item::Shape(Shape::line([left, at], [left + long, at], stroke)));
        if !tick.label.is_empty() {
            let runs = lettering::runs(&tick.label);
            let wide = lettering::width(&runs)? * theme::LETTER;
            let base = at + 0.36 * theme::LETTER;
            items.push(sheet.caption("tick-label", runs, [left - 1.2 - wide, base], theme::LETTER)?);
        }
    }
    let frame = Shape::polyline(&chart.panel.corners(), true, None, Some(solid(ink, theme::THIN)));
    items.insert(0, Item::Group(Group::of("tick", ticks)));
    items.insert(1, Item::Group(Group::of("frame", vec![Item::Shape(frame)])));
    Ok(items)
}

/// The x axis's title under its middle, that of the y axis over its top, so that both read from left to right.
fn titles(chart: &Chart, keys: &Keys, sheet: &Sheet) -> Result<Vec<Item>> {
    let [left, top, right, bottom] = chart.panel.frame;
    let said = |axis: &AxisKeys| {
        let unit = axis.unit.as_ref().map_or(String::new(), |unit| format!(" ({unit})"));
        axis.title.as_ref().map(|title| lettering::runs(&format!("{title}{unit}")))
    };
    let mut items = Vec::new();
    for (axis, is_x) in [(&keys.x, true), (&keys.y, false)] {
        let Some(runs) = said(axis) else { continue };
        let wide = lettering::width(&runs)? * theme::LETTER;
        if wide > sheet.size[0] - 2.0 * MARGIN {
            return Err(Error::invalid("the title of an axis is longer than the page is wide")
                .at_key(if is_x { "x.title" } else { "y.title" })
                .remedy("shorten it"));
        }
        let line = (lettering::ASCENT + lettering::DESCENT) * theme::LETTER;
        let at = if is_x {
            let middle = 0.5 * (left + right) - 0.5 * wide;
            let begin = middle.min(sheet.size[0] - MARGIN - wide).max(MARGIN);
            [begin, bottom + AWAY + line + 0.8 + lettering::ASCENT * theme::LETTER]
        } else {
            [MARGIN, top - 2.7]
        };
        items.push(sheet.caption("axis-title", runs, at, theme::LETTER)?);
    }
    Ok(items)
}

/// A series: error bars under the line, markers over it. What lies beyond a given end of an axis is cut off.
fn series_group(chart: &Chart, series: &Series, look: Look, theme: &Theme) -> Group {
    let panel = &chart.panel;
    let at = |p: &DataPoint| [chart.x.page(p.x), chart.y.page(p.y)];
    let mut items = Vec::new();
    let mut bars = Vec::new();
    for (a, b) in series.points.iter().flat_map(|point| bar_ends(chart, point)) {
        // One that lies on the frame is not cut off.
        let is_on_frame = [a, b].into_iter().all(|end| panel.holds(end, -1e-9));
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
    let list = |value: &dyn Fn(&DataPoint) -> f64| {
        shown.iter().map(|p| exact(value(p))).collect::<Vec<_>>().join(" ")
    };
    let data =
        vec![("data-series", plain(&series.name)), ("data-x", list(&|p| p.x)), ("data-y", list(&|p| p.y))];
    Group { part: Some("series"), data, items, ..Group::default() }
}

/// The ends of a point's error bars on the page. One that leaves a logarithmic axis ends beyond the frame.
pub(crate) fn bar_ends(chart: &Chart, point: &DataPoint) -> Vec<(Point, Point)> {
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
pub(crate) fn marker(at: Point, look: Look, theme: &Theme) -> Shape {
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

/// The chart in words, with its numbers.
fn describe(chart: &Chart, keys: &Keys, name: &str) -> String {
    let is_log = |axis: &Axis| axis.range.scale == Scale::Log;
    let kind = match (is_log(&chart.x), is_log(&chart.y)) {
        (true, true) => "Chart with logarithmic axes",
        (true, false) => "Chart with a logarithmic x axis",
        (false, true) => "Chart with a logarithmic y axis",
        (false, false) => "Chart",
    };
    let mut text = format!("{kind}: {name}.");
    for (axis, keys, letter) in [(&chart.x, &keys.x, "x"), (&chart.y, &keys.y, "y")] {
        let unit = keys.unit.as_ref().map_or(String::new(), |unit| format!(" {}", plain(unit)));
        text.push_str(&format!(
            " {letter} runs from {} to {}{unit}.",
            short(axis.range.low),
            short(axis.range.high)
        ));
    }
    for (series, _) in &chart.series {
        let ends: Vec<String> = [series.points.first(), series.points.last()]
            .into_iter()
            .flatten()
            .map(|p| format!("({}, {})", short(p.x), short(p.y)))
            .collect();
        let count = series.points.len();
        let points = if count == 1 { "point".to_owned() } else { format!("{count} points from") };
        let ends = if count == 1 { ends.first().cloned().unwrap_or_default() } else { ends.join(" to ") };
        text.push_str(&format!(" {}: {points} {ends}.", plain(&series.name)));
    }
    for guide in keys.guide.iter().filter_map(|guide| guide.name.as_deref()) {
        text.push_str(&format!(" Guide: {}.", plain(guide)));
    }
    text
}
