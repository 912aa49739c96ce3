//! `kind = "heat-map"`: maps of a number over two axes, side by side and to one scale of colours, from a CSV or JSON file.
//!
//! Each map is a group `chart` whose `data-x` and `data-y` say how its axes run, as in a plot; its `cells` have
//! `data-series`, the map's name. Colours step at the bands: a reader sees which band a cell is in, not a shade.

use super::file::Input;
use super::heat_map_grid::{self, Grid, Map};
use super::heat_map_keys::{AxisKeys, Keys};
use super::plot_axis::{Axis, Range, Scale, Tick};
use super::plot_frame::{self, AWAY, Label};
use crate::diagram::Figure;
use crate::diagram::display_list::{Color, Fill, Geometry, Group, Item, Recoloring, Segment, Shape};
use crate::diagram::lettering;
use crate::diagram::panel::Panel;
use crate::diagram::sheet::{MARGIN, Sheet, plain};
use crate::diagram::theme::{self, Theme, solid};
use crate::diagram::words::{exact, short};
use crate::error::{Error, Result};

/// Height of a line of letters.
const LINE: f64 = (lettering::ASCENT + lettering::DESCENT) * theme::LETTER;
/// Free room between maps, and between the labels of neighbours.
const BETWEEN: f64 = 4.0;
const APART: f64 = 1.2;
/// Page millimetres that a tick's label takes: across, and up.
const ROOM: [f64; 2] = [15.0, 9.0];
/// Height of a colour's sample in the legend.
const SAMPLE: f64 = 3.0;

/// The smallest page, width and height in millimetres.
const LEAST: [f64; 2] = [60.0, 45.0];

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let page = input.page(|width| (0.42 * width).max(LEAST[1]))?;
    let keys: Keys = input.keys()?;
    if !keys.bands.windows(2).all(|pair| pair[0] < pair[1]) {
        return Err(input.document.error("bands", "the bands do not rise").remedy("sort them"));
    }
    let grid = heat_map_grid::read(input, &keys)?;
    for (axis, given, key) in [(&grid.x, &keys.x.ticks, "x.ticks"), (&grid.y, &keys.y.ticks, "y.ticks")] {
        axis.range.check_ticks(given).map_err(|error| error.at(input.document.place(key)))?;
    }
    let mut sheet = Sheet::new(page.size, LEAST, &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let (frames, x_ticks) = frames(&keys, &grid, &sheet, top)?;
    let colors = Colors::new(&page.theme, keys.bands.len() + 1);
    for (i, ((frame, map), panel)) in frames.iter().zip(&grid.maps).zip(&keys.panel).enumerate() {
        let [left, upper, right, bottom] = *frame;
        let (x, y) = (Axis::new(grid.x.range, left, right), Axis::new(grid.y.range, bottom, upper));
        let cells = cells(&grid, map, &keys.bands, &colors, [&x, &y], *frame);
        let mut items = vec![Item::Group(Group {
            part: Some("cells"),
            data: vec![("data-series", plain(&panel.name))],
            items: cells,
            ..Group::default()
        })];
        items.extend(axes(&keys, [&x, &y], &x_ticks, i == 0, &sheet)?);
        let name = lettering::runs(&panel.name);
        let end = frames.get(i + 1).map_or(page.size[0] - MARGIN, |next| next[0] - 1.0);
        if left + lettering::width(&name)? * theme::LETTER > end {
            return Err(input
                .document
                .error(&format!("panel[{i}].name"), "the name is longer than its map is wide")
                .remedy("shorten it, or give a wider page"));
        }
        items.push(sheet.caption("axis-title", name, [left, upper - 1.6], theme::LETTER)?);
        let run = |axis: &Axis| {
            let scale = if axis.range.scale == Scale::Log { "log" } else { "linear" };
            format!("{scale} {} {}", exact(axis.at), exact(axis.per))
        };
        let data = vec![("data-x", run(&x)), ("data-y", run(&y))];
        sheet.push(Group { part: Some("chart"), data, items, ..Group::default() });
    }
    titles(&keys, &frames, &mut sheet)?;
    let has_empty = grid.maps.iter().flatten().flatten().any(Option::is_none);
    legend(&keys, (&colors, has_empty), &frames, &mut sheet)?;
    let title = |axis: &AxisKeys| axis.title.as_deref().map_or(axis.column.clone(), plain);
    let value = keys.value.as_deref().map_or("values".to_owned(), plain);
    let name = format!("{value} over {} and {}", title(&keys.x), title(&keys.y));
    let mut figure = sheet.finish(&name, describe(&keys, &grid, &name))?;
    // On dark pages the scale runs from their paper.
    if let Recoloring::Dark(pairs) = &mut figure.list.recoloring {
        pairs.extend(colors.bands.into_iter().zip(Colors::new(&Theme::DARK, keys.bands.len() + 1).bands));
        pairs.sort_unstable();
        pairs.dedup();
    }
    Ok(figure)
}

/// The maps' frames, as wide as one another, with room for labels at the left and below; and the ticks of their x axes.
fn frames(keys: &Keys, grid: &Grid, sheet: &Sheet, top: f64) -> Result<(Vec<[f64; 4]>, Vec<Tick>)> {
    let [width, height] = sheet.size;
    let titled = |axis: &AxisKeys| if axis.title.is_some() { LINE + 1.0 } else { 0.0 };
    let upper = top + titled(&keys.y) + LINE + 1.8;
    let bottom = height - MARGIN - (SAMPLE + LINE + 2.6) - titled(&keys.x) - LINE - AWAY;
    let widest = plot_frame::widest(&grid.y.range.ticks((bottom - upper) / ROOM[1], &keys.y.ticks))?;
    let count = keys.panel.len() as f64;
    // By how far labels reach beyond the frames: where the first begins, how wide each is, and what lies between them.
    let across = |[before, after]: [f64; 2]| {
        let left = MARGIN + before.max(widest + 2.0);
        let between = BETWEEN.max(before + after + APART);
        let right = width - MARGIN - after.max(0.0);
        [left, (right - left - (count - 1.0) * between) / count, between]
    };
    let ends = |beyond| {
        let [left, wide, _] = across(beyond);
        [left, left + wide]
    };
    let (x, x_ticks, beyond) = plot_frame::fitting(grid.x.range, (&keys.x.ticks, ROOM[0]), ends)?;
    let ([left, right], [_, _, between]) = (x.ends, across(beyond));
    let wide = right - left;
    if wide < 12.0 || bottom - upper < 12.0 {
        return Err(Error::invalid(format!("a page of {width} by {height} mm leaves no room for the maps"))
            .at_key("width_mm")
            .remedy("give a larger page, or fewer maps"));
    }
    let frame = |i: usize| {
        let from = left + i as f64 * (wide + between);
        [from, upper, from + wide, bottom]
    };
    Ok(((0..keys.panel.len()).map(frame).collect(), x_ticks))
}

/// Colours of the bands, from pale to dark, and of nothing.
struct Colors {
    bands: Vec<Color>,
    nothing: Color,
}

impl Colors {
    fn new(theme: &Theme, count: usize) -> Self {
        let mix = |t: f64| {
            let part = |a: u8, b: u8| libm::round(f64::from(a) + (f64::from(b) - f64::from(a)) * t) as u8;
            let (a, b) = (theme.paper, theme.lens.word);
            Color { r: part(a.r, b.r), g: part(a.g, b.g), b: part(a.b, b.b) }
        };
        let last = (count - 1).max(1) as f64;
        let bands = (0..count).map(|i| mix(0.06 + 0.94 * i as f64 / last)).collect();
        Self { bands, nothing: theme.focus.line }
    }

    /// The band of a value, counted from 0; after the last one, nothing.
    fn rank(&self, bands: &[f64], value: Option<f64>) -> usize {
        let band = |value: f64| bands.iter().take_while(|&&end| value >= end).count();
        value.filter(|v| !v.is_nan()).map_or(self.bands.len(), band)
    }
}

/// The cells: the whole in the first colour, over it in one path the cells of the second colour and of all that follow, and so
/// on. Edges of one path leave no seam between neighbours, and no paper shows, whatever draws them.
fn cells(
    grid: &Grid,
    map: &Map,
    bands: &[f64],
    colors: &Colors,
    [x, y]: [&Axis; 2],
    [left, top, right, bottom]: [f64; 4],
) -> Vec<Item> {
    let all: Vec<Color> = colors.bands.iter().copied().chain([colors.nothing]).collect();
    let whole = [[left, top], [right, top], [right, bottom], [left, bottom]];
    let first = all.first().map(|&color| Fill::Flat { color, opacity: 1.0 });
    let mut items = vec![Item::Shape(Shape::polyline(&whole, true, first, None))];
    for (rank, &color) in all.iter().enumerate().skip(1) {
        let mut path = Vec::new();
        for (row, ends) in map.iter().zip(grid.y.borders.windows(2)) {
            let [low, high] = [ends[0], ends[1]].map(|border| y.page(border));
            let mut from = None;
            let past = row.iter().map(|&value| colors.rank(bands, value) >= rank).chain([false]);
            for (painted, &border) in past.zip(&grid.x.borders) {
                match (from, painted) {
                    (None, true) => from = Some(x.page(border)),
                    (Some(begin), false) => {
                        let end = x.page(border);
                        path.push(Segment::Move([begin, high]));
                        path.extend([[end, high], [end, low], [begin, low]].map(Segment::Line));
                        path.push(Segment::Close);
                        from = None;
                    }
                    _ => {}
                }
            }
        }
        if !path.is_empty() {
            let fill = Some(Fill::Flat { color, opacity: 1.0 });
            items.push(Item::Shape(Shape { geometry: Geometry::Path(path), fill, stroke: None }));
        }
    }
    items
}

/// Frame, ticks and their labels; those upward at the first map alone.
fn axes(
    keys: &Keys,
    [x, y]: [&Axis; 2],
    x_ticks: &[Tick],
    is_first: bool,
    sheet: &Sheet,
) -> Result<Vec<Item>> {
    let ([left, right], [bottom, top]) = (x.ends, y.ends);
    let frame = [left, top, right, bottom];
    let stroke = solid(sheet.theme.ink, theme::THIN);
    let mut marks = Vec::new();
    let mut items = Vec::new();
    for Label { at, runs, wide, .. } in plot_frame::labels(x, x_ticks, true)? {
        marks.push(Item::Shape(Shape::line([at, bottom], [at, bottom + 1.0], stroke)));
        let base = bottom + AWAY + lettering::ASCENT * theme::LETTER;
        items.push(sheet.caption("tick-label", runs, [at - 0.5 * wide, base], theme::LETTER)?);
    }
    for Label { at, runs, wide, .. } in
        plot_frame::labels(y, &y.range.ticks((bottom - top) / ROOM[1], &keys.y.ticks), false)?
    {
        marks.push(Item::Shape(Shape::line([left - 1.0, at], [left, at], stroke)));
        if is_first {
            let base = at + 0.36 * theme::LETTER;
            items.push(sheet.caption("tick-label", runs, [left - 1.6 - wide, base], theme::LETTER)?);
        }
    }
    let panel = Panel { frame, scale: 1.0, origin: [left, bottom] };
    let border = Shape::polyline(&panel.corners(), true, None, Some(stroke));
    items.insert(0, Item::Group(Group::of("tick", marks)));
    items.insert(1, Item::Group(Group::of("frame", vec![Item::Shape(border)])));
    Ok(items)
}

/// The axes' titles: x under the middle of all maps, y over the first.
fn titles(keys: &Keys, frames: &[[f64; 4]], sheet: &mut Sheet) -> Result<()> {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Ok(()) };
    if let Some(title) = &keys.x.title {
        let item = plot_frame::title_of_x(lettering::runs(title), [first[0], last[2], first[3]], sheet)?;
        sheet.items.push(item);
    }
    if let Some(title) = &keys.y.title {
        let item = plot_frame::title_of_y(lettering::runs(title), first[1] - LINE - 2.4, sheet)?;
        sheet.items.push(item);
    }
    Ok(())
}

/// Samples of the colours in a row, the bands' ends under their borders, and what an empty cell means where there is one.
fn legend(
    keys: &Keys,
    (colors, has_empty): (&Colors, bool),
    frames: &[[f64; 4]],
    sheet: &mut Sheet,
) -> Result<()> {
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Ok(()) };
    let [_, height] = sheet.size;
    let top = height - MARGIN - LINE - SAMPLE - 0.6;
    let base = top + 0.5 * SAMPLE + 0.36 * theme::LETTER;
    let nothing = lettering::runs(&keys.nothing);
    let value = keys.value.as_ref().map(|value| lettering::runs(value)).unwrap_or_default();
    let named = lettering::width(&value)? * theme::LETTER;
    let empty = lettering::width(&nothing)? * theme::LETTER;
    let from = first[0] + if value.is_empty() { 0.0 } else { named + 2.0 };
    let to = last[2] - if has_empty { empty + 1.2 + 6.0 + 5.0 } else { 0.0 };
    let step = (to - from) / colors.bands.len() as f64;
    if step < 3.0 {
        return Err(Error::invalid("the page is too narrow for the legend of this heat map")
            .at_key("width_mm")
            .remedy("give a larger page, fewer bands, or shorter words"));
    }
    let stroke = Some(solid(sheet.theme.ink, theme::HAIR));
    let sample = |left: f64, right: f64, color: Color| {
        let corners = [[left, top], [right, top], [right, top + SAMPLE], [left, top + SAMPLE]];
        Item::Shape(Shape::polyline(&corners, true, Some(Fill::Flat { color, opacity: 1.0 }), stroke))
    };
    let mut items = Vec::new();
    if !value.is_empty() {
        items.push(sheet.caption("label", value, [first[0], base], theme::LETTER)?);
    }
    for (i, &color) in colors.bands.iter().enumerate() {
        let left = from + i as f64 * step;
        items.push(sample(left, left + step, color));
    }
    let mut end = f64::NEG_INFINITY;
    // Written all alike.
    let (low, high) = (keys.bands.first().copied(), keys.bands.last().copied());
    let range = Range { scale: Scale::Log, low: low.unwrap_or(1.0), high: high.unwrap_or(1.0) };
    let written = range.ticks(1.0, &keys.bands);
    for (i, &band) in keys.bands.iter().enumerate() {
        let text = written
            .iter()
            .find(|tick| tick.value == band)
            .map_or_else(|| short(band), |tick| tick.label.clone());
        let runs = lettering::runs(&text);
        let half = 0.5 * lettering::width(&runs)? * theme::LETTER;
        let at = from + (i + 1) as f64 * step;
        if at - half > end + 1.0 {
            let base = top + SAMPLE + 0.6 + lettering::ASCENT * theme::LETTER;
            items.push(sheet.caption("label", runs, [at - half, base], theme::LETTER)?);
            end = at + half;
        }
    }
    if has_empty {
        items.push(sample(to + 5.0, to + 11.0, colors.nothing));
        items.push(sheet.caption("label", nothing, [to + 12.2, base], theme::LETTER)?);
    }
    sheet.push(Group::of("legend", items));
    Ok(())
}

/// The maps in words, with their numbers.
fn describe(keys: &Keys, grid: &Grid, name: &str) -> String {
    let mut text = format!("Heat maps: {name}.");
    for (axis, letter) in [(&grid.x, "x"), (&grid.y, "y")] {
        let scale = if axis.range.scale == Scale::Log { "logarithmic" } else { "linear" };
        text.push_str(&format!(
            " {letter} runs from {} to {}, {scale}.",
            short(axis.range.low),
            short(axis.range.high)
        ));
    }
    for (panel, map) in keys.panel.iter().zip(&grid.maps) {
        let all = || map.iter().flatten();
        let (count, empty) = (all().count(), all().filter(|cell| cell.is_none()).count());
        let most = all().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let most = if most.is_finite() { format!("at most {}", short(most)) } else { "nothing".to_owned() };
        let name = plain(&panel.name);
        text.push_str(&format!(" {name}: {most}; {} in {empty} of {count} cells.", plain(&keys.nothing)));
    }
    text
}
