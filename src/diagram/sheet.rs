//! The page around the panels. In: a page size and a theme. Out: title, captions, scale strips and blocks of text in
//! their places, and the finished [`Figure`].

use super::Figure;
use super::canvas;
use super::display_list::{DisplayList, Group, Item, Point, Run, Shape, Text};
use super::lettering;
use super::panel::Panel;
use super::theme::{self, Theme};
use super::words;
use crate::error::{Error, Result};
use crate::quantity::short;

/// Free room at the page's border.
pub(crate) const MARGIN: f64 = 2.5;
/// Height of the strip under a panel that says its scale.
pub(crate) const STRIP: f64 = 5.0;
/// Free room between panels.
pub(crate) const GUTTER: f64 = 4.5;
/// Distance of the base lines of captions.
pub(crate) const LEADING: f64 = 3.9;

/// A page being filled.
pub(crate) struct Sheet<'a> {
    pub(crate) size: [f64; 2],
    pub(crate) theme: &'a Theme,
    /// Whether the page is painted.
    pub(crate) background: bool,
    /// Whether panels say their scale.
    pub(crate) with_scale: bool,
    pub(crate) items: Vec<Item>,
    title: Option<String>,
}

impl<'a> Sheet<'a> {
    /// # Errors
    /// When the page is smaller than `least` or larger than 2000 mm.
    pub(crate) fn new(size: [f64; 2], least: [f64; 2], theme: &'a Theme) -> Result<Self> {
        let fits = (0..2).all(|axis| (least[axis]..=2000.0).contains(&size[axis]));
        if !fits {
            let message =
                format!("a page of {} by {} mm cannot hold this figure", short(size[0]), short(size[1]));
            let [width, height] = least;
            return Err(Error::invalid(message)
                .at_key("width_mm")
                .remedy(format!("choose {width} to 2000 mm by {height} to 2000 mm")));
        }
        Ok(Self { size, theme, background: true, with_scale: true, items: Vec::new(), title: None })
    }

    /// Writes the title, if there is one; gives the height at which the rest begins.
    ///
    /// # Errors
    /// When a glyph is missing.
    pub(crate) fn heading(&mut self, title: Option<&str>) -> Result<f64> {
        let Some(title) = title else { return Ok(MARGIN) };
        let room = self.size[0] - 2.0 * MARGIN;
        let mut base = MARGIN + theme::TITLE;
        for line in broken(title, room * theme::LETTER / theme::TITLE)? {
            let runs = lettering::runs(&line);
            if lettering::width(&runs)? * theme::TITLE > room {
                return Err(Error::invalid("the title is longer than the page is wide")
                    .at_key("title")
                    .remedy("shorten it, or give a larger width_mm"));
            }
            let item = self.caption("title", runs, [MARGIN, base], theme::TITLE)?;
            self.items.push(item);
            base += 1.3 * theme::TITLE;
        }
        self.title = Some(title.to_owned());
        Ok(base - 0.6 * theme::TITLE)
    }

    pub(crate) fn push(&mut self, group: Group) {
        self.items.push(Item::Group(group));
    }

    /// A line of text as a group of its own.
    ///
    /// # Errors
    /// When a glyph is missing.
    pub(crate) fn caption(&self, part: &'static str, runs: Vec<Run>, at: Point, size: f64) -> Result<Item> {
        let width = lettering::width(&runs)? * size;
        let bounds =
            [at[0], at[1] - lettering::ASCENT * size, at[0] + width, at[1] + lettering::DESCENT * size];
        let text = Text { at, along: [1.0, 0.0], size, color: self.theme.ink, runs, bounds };
        Ok(Item::Group(Group::of(part, vec![Item::Text(text)])))
    }

    /// Under a panel: what it shows, its scale in numbers and as a bar.
    ///
    /// # Errors
    /// When a glyph is missing.
    pub(crate) fn strip(&mut self, panel: &Panel, words: &str, to_right: bool) -> Result<()> {
        let [left, _, right, bottom] = panel.frame;
        let base = bottom + 3.4;
        if !self.with_scale {
            let runs = lettering::runs(words);
            let wide = lettering::width(&runs)? * theme::LETTER;
            let x = if to_right { right - wide } else { left };
            let item = self.caption("panel-title", runs, [x, base], theme::LETTER)?;
            self.items.push(item);
            return Ok(());
        }
        let scale = words::ratio(1000.0 / panel.scale);
        let metres = words::round_length((0.3 * panel.width()).min(22.0) / panel.scale);
        let long = metres * panel.scale;
        let label = lettering::runs(&words::length(metres));
        let at = right - long - 1.5 - lettering::width(&label)? * theme::LETTER;
        // All of it where there is room, else without the number that the bar says too.
        let both = if words.is_empty() { scale } else { format!("{words}, {scale}") };
        let (mut said, mut wide) = (Vec::new(), f64::INFINITY);
        for text in [&*both, words] {
            if left + wide + 2.0 > at {
                said = lettering::runs(text);
                wide = lettering::width(&said)? * theme::LETTER;
            }
        }
        let begin = if to_right { at - 6.0 - wide } else { left };
        let has_bar = begin + wide + 2.0 <= at;
        if !has_bar {
            // The number instead of the bar.
            let runs = lettering::runs(&both);
            if left + lettering::width(&runs)? * theme::LETTER <= right {
                said = runs;
            }
        }
        let captions = [(said, begin), (label, at)];
        for (runs, x) in captions.into_iter().take(if has_bar { 2 } else { 1 }) {
            let item = self.caption("scale", runs, [x, base], theme::LETTER)?;
            self.items.push(item);
        }
        if !has_bar {
            return Ok(());
        }
        let stroke = theme::solid(self.theme.ink, theme::MEDIUM);
        let y = base - 0.9;
        let bar = [
            Shape::line([right - long, y], [right, y], stroke),
            Shape::line([right - long + 0.15, y - 0.9], [right - long + 0.15, y + 0.9], stroke),
            Shape::line([right - 0.15, y - 0.9], [right - 0.15, y + 0.9], stroke),
        ];
        self.push(Group::of("scale-bar", bar.into_iter().map(Item::Shape).collect()));
        Ok(())
    }

    /// Lines of text from a height on.
    ///
    /// # Errors
    /// When a glyph is missing.
    pub(crate) fn block(&mut self, lines: &[String], at: Point) -> Result<()> {
        let mut base = at[1] + lettering::ASCENT * theme::LETTER;
        for line in lines {
            let item = self.caption("caption", lettering::runs(line), [at[0], base], theme::LETTER)?;
            self.items.push(item);
            base += LEADING;
        }
        Ok(())
    }

    /// The finished figure; `title` is its name where it has no heading.
    ///
    /// # Errors
    /// When something is drawn too far away.
    pub(crate) fn finish(self, title: &str, description: String) -> Result<Figure> {
        let title = self.title.as_deref().unwrap_or(title);
        Figure::new(DisplayList {
            page: self.size,
            background: self.background.then_some(self.theme.paper),
            recoloring: self.theme.recoloring(),
            title: storable(&plain(title)),
            description: storable(&description),
            items: self.items,
        })
    }
}

/// Text as every kind of file can hold it: what XML cannot is left out. (What is drawn has passed the lettering, which knows no such
/// characters.)
fn storable(text: &str) -> String {
    let is_storable =
        |c: &char| matches!(c, '\n' | '\t') || !(c.is_control() || ('\u{fffe}'..='\u{ffff}').contains(c));
    text.chars().filter(is_storable).collect()
}

/// Marked text without its marks.
pub(crate) fn plain(marked: &str) -> String {
    lettering::runs(marked).into_iter().map(|run| run.text).collect()
}

/// Facts joined to lines of at most this width (mm); what is longer is broken between words.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn flow(facts: &[String], width: f64) -> Result<Vec<String>> {
    let mut lines: Vec<String> = Vec::new();
    for fact in facts {
        if let Some(last) = lines.last_mut() {
            let joined = format!("{last} · {fact}");
            if canvas::size(&joined)?[0] <= width {
                *last = joined;
                continue;
            }
        }
        lines.extend(broken(fact, width)?);
    }
    Ok(lines)
}

/// Text broken into lines of at most this width (mm), between words.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn broken(text: &str, width: f64) -> Result<Vec<String>> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split(' ') {
        // A number and its unit, and the two sides of an equation, stay together.
        let holds =
            |word: &str| matches!(word.trim_end_matches(['.', ',', ';', ':']), "mm" | "m" | "km" | "=" | "/");
        match words.last_mut() {
            Some(last) if holds(word) || last.ends_with(" =") || last.ends_with(" /") => {
                last.push(' ');
                last.push_str(word);
            }
            _ => words.push(word.to_owned()),
        }
    }
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        if let Some(last) = lines.last_mut() {
            let joined = format!("{last} {word}");
            if canvas::size(&joined)?[0] <= width {
                *last = joined;
                continue;
            }
        }
        lines.push(word);
    }
    // What stands between asterisks goes on in the next line.
    for i in 1..lines.len() {
        let (before, after) = lines.split_at_mut(i);
        let (rest, at) = (after.join(" "), before.last().map_or(0, String::len));
        let is_within = |last: &str| {
            let pairs = lettering::variables(&format!("{last} {rest}"));
            pairs.iter().any(|&(open, close)| open < at && at < close)
        };
        if let (Some(last), Some(next)) = (before.last_mut(), after.first_mut())
            && is_within(last)
        {
            last.push('*');
            next.insert(0, '*');
        }
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variable_of_several_words_stays_one_in_broken_lines() {
        let lines = broken("the *plane of sharp focus* is where 2 * 3", 15.0).unwrap();
        assert!(lines.len() > 2, "{lines:?}");
        let oblique: Vec<String> = lines
            .iter()
            .flat_map(|line| lettering::runs(line))
            .filter(|run| run.face == crate::diagram::Face::Oblique)
            .map(|run| run.text)
            .collect();
        assert_eq!(oblique.join(" "), "plane of sharp focus");
        assert!(plain(&lines.join(" ")).ends_with("2 * 3"), "{lines:?}");
    }
}
