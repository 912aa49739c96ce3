//! `kind = "plot"`: a line chart of numbers from a CSV or JSON file, or in the figure file itself; linear or logarithmic
//! axes, error bars, guides, and names at the lines' ends or in a legend that touches nothing.
//!
//! The chart is a group `chart` whose `data-x` and `data-y` say how the axes run: `log a b` is page = a + b log10(value),
//! `linear a b` page = a + b value. Each `series` group has its name and its values, in the order they are drawn.

use super::file::{Input, Page};
use super::plot_axis::{Axis, Range, Scale};
use super::plot_chart::{Chart, Guide, LINE, Look, describe};
use super::plot_frame::{self, AWAY, axes, grid, titles};
use super::plot_keys::{AxisKeys, GuideKeys, Keys, SeriesKeys};
use super::plot_marks::series_group;
use super::plot_names::{self, Names};
use super::plot_series::{self, DataPoint, Series};
use crate::diagram::Figure;
use crate::diagram::display_list::{Group, Item, Point, Shape, Stroke};
use crate::diagram::lettering;
use crate::diagram::panel::Panel;
use crate::diagram::sheet::{MARGIN, Sheet, plain};
use crate::diagram::theme::{self, Theme, solid};
use crate::diagram::words::exact;
use crate::error::{Error, Result};

/// Points nearer than this are not marked unless asked for.
const APART: f64 = 2.2;
/// Page millimetres that a tick's label takes: across, and up.
const ROOM: [f64; 2] = [17.0, 9.0];
/// The least frame: across, and up.
const LEAST: [f64; 2] = [20.0, 15.0];
/// Dashes of the series in turn.
const DASHES: [&[f64]; 6] =
    [&[], &[2.4, 0.9], &[0.8, 0.7], &[3.2, 0.7, 0.7, 0.7], &[1.4, 0.6], &[4.0, 0.8, 0.7, 0.6, 0.7, 0.8]];

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
    names.fit(&chart, page.size[1])?;
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
    let is_log = |axis: &AxisKeys| axis.scale.as_deref() == Some("log");
    let range = |axis: &AxisKeys, name: &str, mut values: Vec<f64>, room: f64| {
        let scale = if is_log(axis) { Scale::Log } else { Scale::Linear };
        // An end that is not given is as far out as ticks are. (Of a logarithmic axis those are refused that it cannot have.)
        values.extend(axis.ticks.iter().filter(|&&tick| {
            (scale == Scale::Linear || tick > 0.0)
                && axis.min.is_none_or(|min| tick >= min)
                && axis.max.is_none_or(|max| tick <= max)
        }));
        // What the error is about: a bad value of a series, or an end of the axis.
        let range = Range::holding(&values, scale, [axis.min, axis.max], room)
            .map_err(|error| error.at(input.document.place(name)))?;
        range
            .check_ticks(&axis.ticks)
            .map_err(|error| error.at(input.document.place(&format!("{name}.ticks"))))?;
        Ok::<Range, Error>(range)
    };
    let points = || all.iter().flat_map(|series| &series.points);
    // An error bar that reaches below zero leaves a logarithmic axis at its lower end; a point there is an error.
    let values = |axis: &AxisKeys, value: fn(&DataPoint) -> f64, bar: fn(&DataPoint) -> Option<[f64; 2]>| {
        let fits = |value: &f64| !is_log(axis) || *value > 0.0;
        let ends = points().filter_map(bar).flatten().filter(fits);
        points().map(value).chain(ends).collect::<Vec<f64>>()
    };
    let x = range(&keys.x, "x", values(&keys.x, |p| p.x, |p| p.level_bar), room_across[0])?;
    let y = range(&keys.y, "y", values(&keys.y, |p| p.y, |p| p.bar), room_across[1])?;

    let title_room =
        |axis: &AxisKeys| if axis.title.is_some() || axis.unit.is_some() { line + 1.2 } else { 0.0 };
    // Half of the uppermost tick's label stands over the frame.
    let frame_top = top + title_room(&keys.y) + 1.4;
    let bottom = height - MARGIN - line - AWAY - title_room(&keys.x);
    let y = Axis::new(y, bottom, frame_top);
    let y_ticks = y.range.ticks((bottom - frame_top) / ROOM[1], &keys.y.ticks);
    let side = [plot_frame::widest(&y_ticks)? + 2.0, names.room(all)?.max(4.0)];
    let ends = |beyond: [f64; 2]| [MARGIN + side[0].max(beyond[0]), width - MARGIN - side[1].max(beyond[1])];
    let (x, x_ticks, _) = plot_frame::fitting(x, (&keys.x.ticks, ROOM[0]), ends)?;
    let [left, right] = x.ends;
    let frame = [left, frame_top, right, bottom];
    if right - left < LEAST[0] || bottom - frame_top < LEAST[1] {
        return Err(Error::invalid(format!("a page of {width} by {height} mm leaves no room for the chart"))
            .at_key("width_mm")
            .remedy(match names {
                Names::Legend | Names::Beside => "give a larger page, or shorter names",
                _ => "give a larger page, shorter names, or names = \"legend\"",
            }));
    }
    let panel = Panel { frame, scale: 1.0, origin: [left, bottom] };
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
    Ok(Chart { panel, x, y, x_ticks, y_ticks, series, all_guides: guides.len() == keys.guide.len(), guides })
}

fn look(theme: &Theme, i: usize, keys: &SeriesKeys, series: &Series, x: &Axis, y: &Axis) -> Look {
    let hues = theme.series();
    let hue = hues.get(i % hues.len()).copied().unwrap_or(theme.lens);
    let dash = DASHES.get((i + i / hues.len()) % DASHES.len()).copied().unwrap_or_default();
    let at = |p: &DataPoint| [x.page(p.x), y.page(p.y)];
    let apart = series.points.windows(2).all(|w| distance(at(&w[0]), at(&w[1])) >= APART);
    // Of a line that goes nowhere nothing would be seen.
    let first = series.points.first().map(at);
    let still = first.is_some_and(|first| series.points.iter().all(|p| distance(at(p), first) < APART));
    Look {
        hue,
        stroke: Stroke { dash, round: true, ..solid(hue.line, LINE) },
        marker: i % 12,
        line: keys.line,
        markers: keys.markers.unwrap_or(apart || still || !keys.line),
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
    items.push(grid(&chart, &theme));
    if !chart.all_guides {
        items.push(Item::Group(Group::off_page("some-guides", "beyond")));
    }
    for guide in &chart.guides {
        let stroke = Stroke { dash: theme::DASHED, ..solid(theme.quiet, theme::THIN) };
        let [a, b] = guide.ends;
        items.push(Item::Group(Group::of("guide", vec![Item::Shape(Shape::line(a, b, stroke))])));
    }
    for (series, look) in &chart.series {
        items.push(Item::Group(series_group(&chart, series, *look, &theme)));
    }
    items.extend(axes(&chart, &sheet)?);
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
