//! What a chart is: its panel, axes, series with their looks, and guides; and what it says in words. From [`super::plot`], for
//! [`super::plot_frame`], [`super::plot_marks`] and [`super::plot_names`].

use super::plot_axis::{Axis, Range, Scale, Tick};
use super::plot_keys::Keys;
use super::plot_series::Series;
use crate::diagram::display_list::{Point, Stroke};
use crate::diagram::panel::Panel;
use crate::diagram::sheet::plain;
use crate::diagram::theme::Hue;
use crate::diagram::words::{exact, short};

/// The width of a series' line in millimetres.
pub(super) const LINE: f64 = 0.45;

/// How a series is drawn.
#[derive(Clone, Copy)]
pub(super) struct Look {
    pub(super) hue: Hue,
    pub(super) stroke: Stroke,
    pub(super) marker: usize,
    pub(super) line: bool,
    pub(super) markers: bool,
}

/// A guide on the page: its ends.
pub(super) struct Guide {
    pub(super) name: Option<String>,
    pub(super) ends: [Point; 2],
}

/// A chart as it is laid out, in page millimetres.
pub(super) struct Chart {
    pub(super) panel: Panel,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) x_ticks: Vec<Tick>,
    pub(super) y_ticks: Vec<Tick>,
    pub(super) series: Vec<(Series, Look)>,
    pub(super) guides: Vec<Guide>,
    /// Whether all that the file names cross the axes' frame.
    pub(super) all_guides: bool,
}

/// A value in words: with all its digits where three would say the same of both ends of the axis.
fn said(axis: &Axis, value: f64) -> String {
    let Range { low, high, .. } = axis.range;
    if high - low < 0.01 * low.abs().max(high.abs()) { exact(value) } else { short(value) }
}

/// The chart in words, with its numbers.
pub(super) fn describe(chart: &Chart, keys: &Keys, name: &str) -> String {
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
        let [low, high] = [axis.range.low, axis.range.high].map(|end| said(axis, end));
        text.push_str(&format!(" {letter} runs from {low} to {high}{unit}."));
    }
    for (series, _) in &chart.series {
        let ends: Vec<String> = [series.points.first(), series.points.last()]
            .into_iter()
            .flatten()
            .map(|p| format!("({}, {})", said(&chart.x, p.x), said(&chart.y, p.y)))
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
