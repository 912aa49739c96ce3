//! Names in charts. In: the chart as drawn. Out: the series' names at their lines' ends, or in a legend that touches
//! nothing (in the frame where there is room, else beside it), and the guides' names along them.

use super::plot_chart::{Chart, LINE, Look};
use super::plot_marks::{MARK, bar_ends, marker};
use super::plot_series::Series;
use crate::diagram::canvas;
use crate::diagram::display_list::{Fill, Group, Item, Point, Shape};
use crate::diagram::lettering;
use crate::diagram::place::{self, Obstacle, Request, Weight};
use crate::diagram::room::Room;
use crate::diagram::theme::{self, Theme, solid};
use crate::error::{Error, Result};

/// Where names stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Names {
    /// At the ends where the lines end at the right, else in a legend.
    Auto,
    /// In a column at the right, each at the height of its line's end.
    Ends,
    /// In the frame where nothing is, else beside it.
    Legend,
    /// In a column at the right, with samples.
    Beside,
    None,
}

/// From the frame to a column of names.
const AWAY: f64 = 2.4;
/// Length of a legend's sample, and from it to the name.
const SAMPLE: f64 = 7.0;
const GAP: f64 = 1.5;
/// Distance of the lines of a legend.
const LEADING: f64 = 4.0;
/// Free room around a legend.
const CLEAR: f64 = 1.0;

impl Names {
    /// What the key `names` says.
    pub(crate) fn wanted(word: &str) -> Self {
        match word {
            "ends" => Self::Ends,
            "legend" => Self::Legend,
            "none" => Self::None,
            _ => Self::Auto,
        }
    }

    /// Whether a column of them is too high for the frame, and how high it is.
    fn too_high(self, chart: &Chart) -> Option<f64> {
        let [_, top, _, bottom] = chart.panel.frame;
        let high = LEADING * chart.series.len() as f64;
        (matches!(self, Self::Ends | Self::Beside) && high > bottom - top).then_some(high)
    }

    /// Refuses what leaves the page.
    ///
    /// # Errors
    /// When there are more names beside the chart than have room.
    pub(crate) fn fit(self, chart: &Chart, height: f64) -> Result<()> {
        let [_, top, _, bottom] = chart.panel.frame;
        match self.too_high(chart) {
            Some(high) => {
                let needed = libm::ceil(height + high - (bottom - top));
                Err(Error::invalid(format!("{} names have no room beside the chart", chart.series.len()))
                    .at_key("height_mm")
                    .remedy(format!("give a height of {needed} mm or more, or names = \"none\"")))
            }
            None => Ok(()),
        }
    }

    /// The room at the right that the names take.
    ///
    /// # Errors
    /// When a glyph is missing.
    pub(crate) fn room(self, series: &[Series]) -> Result<f64> {
        let widest = widest(series.iter())?;
        Ok(match self {
            Self::Auto | Self::Ends => AWAY + widest,
            Self::Beside => AWAY + SAMPLE + GAP + widest,
            Self::Legend | Self::None => 0.0,
        })
    }

    /// What it comes to for a chart drawn so: names at the ends only where the ends are at the right, a legend in the
    /// frame only where it fits.
    ///
    /// # Errors
    /// When a glyph is missing.
    pub(crate) fn settled(self, chart: &Chart) -> Result<Self> {
        let [left, _, right, _] = chart.panel.frame;
        Ok(match self {
            Self::Auto => {
                let at_right = chart.series.iter().all(|(series, _)| {
                    end(chart, series).is_some_and(|p| p[0] > left + 0.8 * (right - left))
                });
                let fits = Self::Ends.too_high(chart).is_none();
                let column = AWAY + widest(chart.series.iter().map(|(series, _)| series))?;
                if at_right && fits && column < 0.6 * (right - left) { Self::Ends } else { Self::Legend }
            }
            Self::Legend if legend_box(chart)?.is_none() => Self::Beside,
            settled => settled,
        })
    }
}

fn widest<'a>(series: impl Iterator<Item = &'a Series>) -> Result<f64> {
    let mut widest: f64 = 0.0;
    for series in series {
        widest = widest.max(canvas::size(&series.name)?[0]);
    }
    Ok(widest)
}

/// The page point of a series' last point from left to right, when it is in the frame.
fn end(chart: &Chart, series: &Series) -> Option<Point> {
    let last = series.points.iter().max_by(|p, q| p.x.total_cmp(&q.x))?;
    let p = [chart.x.page(last.x), chart.y.page(last.y)];
    chart.panel.holds(p, -1e-9).then_some(p)
}

/// The names in their places.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn place(chart: &Chart, names: Names, theme: &Theme) -> Result<Vec<Item>> {
    let mut items = Vec::new();
    let mut taken = None;
    match names {
        Names::Ends => items.extend(at_ends(chart)?),
        Names::Legend => {
            taken = legend_box(chart)?;
            if let Some(at) = taken {
                items.push(legend(chart, [at[0], at[1]], theme)?);
            }
        }
        Names::Beside => {
            items.push(legend(chart, [chart.panel.frame[2] + AWAY, chart.panel.frame[1]], theme)?)
        }
        Names::Auto | Names::None => {}
    }
    items.extend(guides(chart, taken, theme)?);
    Ok(items)
}

/// Each name at the height of its line's end, moved apart where they would touch, with a leader where moved.
fn at_ends(chart: &Chart) -> Result<Vec<Item>> {
    let [_, top, right, bottom] = chart.panel.frame;
    let mut wanted: Vec<(f64, Point, &Series, &Look)> = chart
        .series
        .iter()
        .filter_map(|(series, look)| end(chart, series).map(|p| (p[1], p, series, look)))
        .collect();
    wanted.sort_by(|p, q| p.0.total_cmp(&q.0));
    let half = 0.5 * LEADING;
    let heights = apart(
        &wanted.iter().map(|w| w.0).collect::<Vec<_>>(),
        LEADING,
        [top + half - 1.5, bottom - half + 1.5],
    );
    let mut leaders = Vec::new();
    let mut labels = Vec::new();
    for ((_, from, series, look), height) in wanted.into_iter().zip(heights) {
        let base = height + 0.36 * theme::LETTER;
        let text = lettering::text(&series.name, [right + AWAY, base], theme::LETTER, look.hue.word)?;
        labels.push(Item::Group(Group::of("label", vec![Item::Text(text)])));
        let reach = right + AWAY - 0.5 - from[0];
        if (height - from[1]).abs() > 0.5 || reach > AWAY + MARK {
            let start = [from[0] + 1.5 * MARK, from[1]];
            let stroke = solid(look.hue.word, theme::HAIR);
            leaders.push(Item::Shape(Shape::line(start, [right + AWAY - 0.5, height], stroke)));
        }
    }
    let mut items = Vec::new();
    if !leaders.is_empty() {
        items.push(Item::Group(Group::of("leader", leaders)));
    }
    items.extend(labels);
    Ok(items)
}

/// Heights nearest to the wanted ones (sorted) that are at least `step` apart and within the range: neighbours that
/// would touch are pooled, and a pool lies about its mean.
fn apart(wanted: &[f64], step: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    // Pools: how many, and where the first stands.
    let mut pools: Vec<(usize, f64)> = Vec::new();
    for &height in wanted {
        pools.push((1, height));
        while let [.., before, last] = pools.as_slice()
            && before.1 + before.0 as f64 * step > last.1
        {
            let (before, last) = (*before, *last);
            let count = before.0 + last.0;
            // Each member's wish for the first's place, averaged.
            let sum = before.1 * before.0 as f64 + (last.1 - before.0 as f64 * step) * last.0 as f64;
            pools.truncate(pools.len() - 2);
            pools.push((count, sum / count as f64));
        }
    }
    let mut heights: Vec<f64> =
        pools.iter().flat_map(|&(count, first)| (0..count).map(move |i| first + i as f64 * step)).collect();
    // Into the range, from the top and from the bottom.
    let mut least = low;
    for height in &mut heights {
        *height = height.max(least);
        least = *height + step;
    }
    let mut most = high;
    for height in heights.iter_mut().rev() {
        *height = height.min(most);
        most = *height - step;
    }
    heights
}

fn legend_size(chart: &Chart) -> Result<[f64; 2]> {
    let widest = widest(chart.series.iter().map(|(series, _)| series))?;
    Ok([SAMPLE + GAP + widest, LEADING * chart.series.len() as f64])
}

/// The free place of a legend in the frame that is nearest to a corner.
fn legend_box(chart: &Chart) -> Result<Option<[f64; 4]>> {
    let [left, top, right, bottom] = chart.panel.frame;
    let [wide, high] = legend_size(chart)?;
    let obstacles = obstacles(chart);
    let edge = 2.6;
    let (mut best, mut least): (Option<[f64; 4]>, f64) = (None, f64::INFINITY);
    let steps = |room: f64| if room < 0.0 { 0 } else { 1 + (room / 1.5) as usize };
    let (columns, rows) = (steps(right - left - wide - 2.0 * edge), steps(bottom - top - high - 2.0 * edge));
    for i in 0..columns * rows {
        let (dx, dy) = (1.5 * (i % columns) as f64, 1.5 * (i / columns) as f64);
        // Rightmost first, then downward.
        let place = [right - edge - wide - dx, top + edge + dy, right - edge - dx, top + edge + dy + high];
        let cost = dx.min(place[0] - left) + dy.min(bottom - place[3]);
        if cost < least && !obstacles.iter().any(|o| room_of(place).is_crossed(o.a, o.b, o.half + CLEAR)) {
            (best, least) = (Some(place), cost);
        }
    }
    Ok(best)
}

fn legend(chart: &Chart, [left, top]: Point, theme: &Theme) -> Result<Item> {
    let [wide, high] = legend_size(chart)?;
    let corners = [[left, top], [left + wide, top], [left + wide, top + high], [left, top + high]];
    let paper = Fill::Flat { color: theme.paper, opacity: 1.0 };
    let mut items = vec![Item::Shape(Shape::polyline(&corners, true, Some(paper), None))];
    for (i, (series, look)) in chart.series.iter().enumerate() {
        let middle = top + LEADING * (i as f64 + 0.5);
        if look.line {
            items.push(Item::Shape(Shape::line([left, middle], [left + SAMPLE, middle], look.stroke)));
        }
        if look.markers {
            items.push(Item::Shape(marker([left + 0.5 * SAMPLE, middle], *look, theme)));
        }
        let at = [left + SAMPLE + GAP, middle + 0.36 * theme::LETTER];
        let text = lettering::text(&series.name, at, theme::LETTER, theme.ink)?;
        items.push(Item::Group(Group::of("label", vec![Item::Text(text)])));
    }
    Ok(Item::Group(Group::of("legend", items)))
}

fn room_of([l, t, r, b]: [f64; 4]) -> Room {
    Room::level([0.5 * (l + r), 0.5 * (t + b)], [0.5 * (r - l), 0.5 * (b - t)])
}

/// What names keep clear of: lines, markers, error bars, guides.
fn obstacles(chart: &Chart) -> Vec<Obstacle> {
    let mut all = Vec::new();
    let mut add = |a: Point, b: Point, half: f64, weight: Weight| all.push(Obstacle { a, b, half, weight });
    for (series, look) in &chart.series {
        let at = |x: f64, y: f64| [chart.x.page(x), chart.y.page(y)];
        for pair in series.points.windows(2) {
            let ends = chart.panel.clip_segment(at(pair[0].x, pair[0].y), at(pair[1].x, pair[1].y));
            if let Some((a, b)) = ends.filter(|_| look.line) {
                add(a, b, 0.5 * LINE, Weight::Heavy);
            }
        }
        for point in &series.points {
            let p = at(point.x, point.y);
            add(p, p, MARK, Weight::Heavy);
            for (a, b) in bar_ends(chart, point) {
                add(a, b, 0.8, Weight::Heavy);
            }
        }
    }
    for guide in &chart.guides {
        add(guide.ends[0], guide.ends[1], 0.5 * theme::THIN, Weight::Heavy);
    }
    all
}

/// The guides' names, along them, and what is written beside points.
fn guides(chart: &Chart, legend: Option<[f64; 4]>, theme: &Theme) -> Result<Vec<Item>> {
    let legend: Vec<Room> = legend.map(room_of).into_iter().collect();
    let named: Vec<_> =
        chart.guides.iter().filter_map(|g| g.name.as_ref().map(|name| (name, g.ends))).collect();
    let mut requests = Vec::new();
    for (name, [a, b]) in &named {
        let at = |t: f64| [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
        requests.push(Request {
            sizes: vec![canvas::size(name)?],
            anchors: [0.85, 0.7, 0.5, 0.3, 0.15, 0.95, 0.05].map(at).to_vec(),
            toward: [0.0, -1.0],
            area: None,
            line: Some((*a, *b, 0.85)),
            worth: f64::INFINITY,
        });
    }
    let mut named: Vec<_> = named.into_iter().map(|(name, _)| (name, theme.quiet)).collect();
    for (series, look) in &chart.series {
        for point in &series.points {
            let at = [chart.x.page(point.x), chart.y.page(point.y)];
            let Some(label) = point.label.as_ref().filter(|_| chart.panel.holds(at, -1e-9)) else { continue };
            requests.push(Request {
                sizes: vec![canvas::size(label)?],
                anchors: vec![at],
                toward: [0.7, -0.7],
                area: None,
                line: None,
                worth: f64::INFINITY,
            });
            named.push((label, look.hue.word));
        }
    }
    let mut items = Vec::new();
    let placed = place::place_around(&chart.panel, &legend, &obstacles(chart), &requests);
    for ((name, color), place) in named.into_iter().zip(placed) {
        let Some(place) = place else {
            items.push(Item::Group(canvas::without_room(name)));
            continue;
        };
        if let Some((a, b)) = place.leader {
            let line = Shape::line(a, b, solid(theme.quiet, theme::HAIR));
            items.push(Item::Group(Group::of("leader", vec![Item::Shape(line)])));
        }
        let texts = canvas::lines(name, &place.room, color)?;
        items.push(Item::Group(Group::of("label", texts.into_iter().map(Item::Text).collect())));
    }
    Ok(items)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_come_apart_and_stay_in_order() {
        let found = apart(&[10.0, 10.5, 30.0, 59.0, 60.0], 4.0, [0.0, 60.0]);
        assert!(found.windows(2).all(|w| w[1] - w[0] > 3.999), "{found:?}");
        assert!((found[0] - 8.25).abs() < 1e-9 && (found[1] - 12.25).abs() < 1e-9 && found[2] == 30.0);
        assert!(found[4] <= 60.0);
        assert!(apart(&[1.0; 5], 4.0, [0.0, 60.0])[0] >= 0.0);
    }
}
