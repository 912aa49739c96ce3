//! What stands around a chart's lines. In: the chart and its ticks. Out: grid, frame, ticks with their labels, and the titles of the
//! axes, as items of a display list, for [`super::plot`].

use super::plot_axis::Tick;
use super::plot_chart::Chart;
use super::plot_keys::{AxisKeys, Keys};
use crate::diagram::display_list::{Group, Item, Shape, Stroke};
use crate::diagram::lettering;
use crate::diagram::sheet::{MARGIN, Sheet};
use crate::diagram::theme::{self, Theme, solid};
use crate::error::{Error, Result};

/// From the frame down to the labels of its ticks: clear of those at its side.
pub(super) const AWAY: f64 = 1.8;

pub(super) fn grid(chart: &Chart, x_ticks: &[Tick], y_ticks: &[Tick], theme: &Theme) -> Item {
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
pub(super) fn axes(chart: &Chart, sheet: &Sheet, x_ticks: &[Tick], y_ticks: &[Tick]) -> Result<Vec<Item>> {
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
pub(super) fn titles(chart: &Chart, keys: &Keys, sheet: &Sheet) -> Result<Vec<Item>> {
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
