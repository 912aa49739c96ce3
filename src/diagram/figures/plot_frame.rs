//! What stands around a chart's lines. In: the chart and its ticks. Out: grid, frame, ticks with their labels, and the titles of the
//! axes, as items of a display list, for [`super::plot`]; and where labels stand, for [`super::heat_map`] too.

use super::plot_axis::{Axis, Range, Tick};
use super::plot_chart::Chart;
use super::plot_keys::{AxisKeys, Keys};
use crate::diagram::display_list::{Group, Item, Run, Shape, Stroke};
use crate::diagram::lettering;
use crate::diagram::sheet::{MARGIN, Sheet};
use crate::diagram::theme::{self, Theme, solid};
use crate::error::{Error, Result};

/// From the frame down to the labels of its ticks: clear of those at its side.
pub(super) const AWAY: f64 = 1.8;

/// Free room between the labels of an axis: from left to right, and upward.
const APART: [f64; 2] = [1.2, 0.4];

/// A tick's label: where the tick stands on the page, half of what the label takes there, what it says, and how wide that is.
pub(super) struct Label {
    pub(super) at: f64,
    half: f64,
    pub(super) runs: Vec<Run>,
    pub(super) wide: f64,
}

/// The labels of an axis from left to right (`is_level`) or upward; where two would touch, the second is left out.
///
/// # Errors
/// When a glyph is missing.
pub(super) fn labels(axis: &Axis, ticks: &[Tick], is_level: bool) -> Result<Vec<Label>> {
    let mut found: Vec<Label> = Vec::new();
    for tick in ticks.iter().filter(|tick| !tick.label.is_empty()) {
        let (at, runs) = (axis.page(tick.value), lettering::runs(&tick.label));
        let wide = lettering::width(&runs)? * theme::LETTER;
        let half = 0.5 * if is_level { wide } else { theme::LETTER };
        let room = |last: &Label| (at - last.at).abs() - last.half - half;
        if found.last().is_none_or(|last| room(last) >= APART[usize::from(!is_level)]) {
            found.push(Label { at, half, runs, wide });
        }
    }
    Ok(found)
}

/// A level axis that leaves room for the labels at its ends, its ticks, and how far labels reach beyond it. `ends` gives its ends on
/// the page by how far that is; `room` is what a label takes.
///
/// # Errors
/// When a glyph is missing.
pub(super) fn fitting(
    range: Range,
    (given, room): (&[f64], f64),
    ends: impl Fn([f64; 2]) -> [f64; 2],
) -> Result<(Axis, Vec<Tick>, [f64; 2])> {
    let mut beyond = [0.0; 2];
    // Which labels there are depends on the axis's length.
    for _ in 0..8 {
        let [left, right] = ends(beyond);
        let ticks = range.ticks((right - left) / room, given);
        let found = overhang(&Axis::new(range, left, right), &ticks)?;
        if found[0] <= beyond[0] && found[1] <= beyond[1] {
            break;
        }
        beyond = [0, 1].map(|end| beyond[end].max(found[end]));
    }
    let [left, right] = ends(beyond);
    Ok((Axis::new(range, left, right), range.ticks((right - left) / room, given), beyond))
}

/// How far the outermost labels of a level axis reach beyond it: at the left, at the right.
fn overhang(axis: &Axis, ticks: &[Tick]) -> Result<[f64; 2]> {
    let (all, [left, right]) = (labels(axis, ticks, true)?, axis.ends);
    Ok([
        all.first().map_or(0.0, |label| left - (label.at - label.half)),
        all.last().map_or(0.0, |label| label.at + label.half - right),
    ])
}

/// What the widest label takes.
///
/// # Errors
/// When a glyph is missing.
pub(super) fn widest(ticks: &[Tick]) -> Result<f64> {
    let mut widest: f64 = 0.0;
    for tick in ticks {
        widest = widest.max(lettering::width(&lettering::runs(&tick.label))? * theme::LETTER);
    }
    Ok(widest)
}

pub(super) fn grid(chart: &Chart, theme: &Theme) -> Item {
    let [left, top, right, bottom] = chart.panel.frame;
    let stroke = Stroke { opacity: 0.5, ..solid(theme.faint, theme::HAIR) };
    let major = |tick: &&Tick| !tick.label.is_empty();
    let mut lines = Vec::new();
    for tick in chart.x_ticks.iter().filter(major) {
        let at = chart.x.page(tick.value);
        lines.push(Item::Shape(Shape::line([at, top], [at, bottom], stroke)));
    }
    for tick in chart.y_ticks.iter().filter(major) {
        let at = chart.y.page(tick.value);
        lines.push(Item::Shape(Shape::line([left, at], [right, at], stroke)));
    }
    Item::Group(Group::of("grid", lines))
}

/// The frame, the ticks inside it, and their labels outside.
pub(super) fn axes(chart: &Chart, sheet: &Sheet) -> Result<Vec<Item>> {
    let [left, _, _, bottom] = chart.panel.frame;
    let ink = sheet.theme.ink;
    let mut ticks = Vec::new();
    let mut items = Vec::new();
    let stroke = solid(ink, theme::THIN);
    let length = |tick: &Tick| if tick.label.is_empty() { 0.8 } else { 1.5 };
    for tick in &chart.x_ticks {
        let at = chart.x.page(tick.value);
        ticks.push(Item::Shape(Shape::line([at, bottom], [at, bottom - length(tick)], stroke)));
    }
    for tick in &chart.y_ticks {
        let at = chart.y.page(tick.value);
        ticks.push(Item::Shape(Shape::line([left, at], [left + length(tick), at], stroke)));
    }
    for Label { at, half, runs, .. } in labels(&chart.x, &chart.x_ticks, true)? {
        let base = bottom + AWAY + lettering::ASCENT * theme::LETTER;
        items.push(sheet.caption("tick-label", runs, [at - half, base], theme::LETTER)?);
    }
    for Label { at, runs, wide, .. } in labels(&chart.y, &chart.y_ticks, false)? {
        let base = at + 0.36 * theme::LETTER;
        items.push(sheet.caption("tick-label", runs, [left - 1.2 - wide, base], theme::LETTER)?);
    }
    let frame = Shape::polyline(&chart.panel.corners(), true, None, Some(solid(ink, theme::THIN)));
    items.insert(0, Item::Group(Group::of("tick", ticks)));
    items.insert(1, Item::Group(Group::of("frame", vec![Item::Shape(frame)])));
    Ok(items)
}

/// The x axis's title under its middle, that of the y axis over its top, so that both read from left to right.
pub(super) fn titles(chart: &Chart, keys: &Keys, sheet: &Sheet) -> Result<Vec<Item>> {
    let [left, top, right, bottom] = chart.panel.frame;
    let said = |axis: &AxisKeys| match (&axis.title, &axis.unit) {
        (Some(title), Some(unit)) => Some(lettering::runs(&format!("{title} ({unit})"))),
        (Some(alone), None) | (None, Some(alone)) => Some(lettering::runs(alone)),
        (None, None) => None,
    };
    let x = said(&keys.x).map(|runs| title_of_x(runs, [left, right, bottom], sheet));
    let y = said(&keys.y).map(|runs| title_of_y(runs, top - 2.7, sheet));
    x.into_iter().chain(y).collect()
}

/// The title of an x axis under the middle of a frame from `left` to `right` that ends at `bottom`.
///
/// # Errors
/// When it is longer than the page is wide, or a glyph is missing.
pub(super) fn title_of_x(runs: Vec<Run>, [left, right, bottom]: [f64; 3], sheet: &Sheet) -> Result<Item> {
    let wide = title_width(&runs, "x.title", sheet)?;
    let begin = (0.5 * (left + right) - 0.5 * wide).min(sheet.size[0] - MARGIN - wide).max(MARGIN);
    let line = (lettering::ASCENT + lettering::DESCENT) * theme::LETTER;
    let base = bottom + AWAY + line + 0.8 + lettering::ASCENT * theme::LETTER;
    sheet.caption("axis-title", runs, [begin, base], theme::LETTER)
}

/// The title of a y axis at the page's left margin.
///
/// # Errors
/// As [`title_of_x`].
pub(super) fn title_of_y(runs: Vec<Run>, base: f64, sheet: &Sheet) -> Result<Item> {
    title_width(&runs, "y.title", sheet)?;
    sheet.caption("axis-title", runs, [MARGIN, base], theme::LETTER)
}

fn title_width(runs: &[Run], key: &str, sheet: &Sheet) -> Result<f64> {
    let wide = lettering::width(runs)? * theme::LETTER;
    if wide > sheet.size[0] - 2.0 * MARGIN {
        return Err(Error::invalid("the title of an axis is longer than the page is wide")
            .at_key(key)
            .remedy("shorten it"));
    }
    Ok(wide)
}
