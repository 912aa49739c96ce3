//! Text as outlines. In: characters, face, size. Out: advance widths and glyph outlines from one embedded font.
//!
//! The font is a renamed subset of DejaVu Sans (`assets/fonts`). A character without a glyph is an error, so no
//! figure ever shows an empty box. There is no kerning: every renderer places the glyphs alike.

use super::display_list::{Color, Face, Point, Run, Script, Segment, Text};
use crate::error::{Error, Result};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};
use std::collections::BTreeMap;
use std::sync::OnceLock;

const REGULAR: &[u8] = include_bytes!("../../assets/fonts/GroundglassSans-Regular.ttf");
const OBLIQUE: &[u8] = include_bytes!("../../assets/fonts/GroundglassSans-Oblique.ttf");

/// Height above and below the base line in which a line of text is kept clear, in ems: those of `b` and `p`.
pub(crate) const ASCENT: f64 = 0.77;
pub(crate) const DESCENT: f64 = 0.24;

/// The font file of a face.
pub(crate) fn file(face: Face) -> &'static [u8] {
    match face {
        Face::Regular => REGULAR,
        Face::Oblique => OBLIQUE,
    }
}

fn font(face: Face) -> Result<FontRef<'static>> {
    FontRef::new(file(face)).map_err(|why| Error::invalid(format!("the embedded font cannot be read: {why}")))
}

/// The advance width of one character, in ems.
///
/// # Errors
/// When the font has no glyph for it.
pub(crate) fn advance(face: Face, character: char) -> Result<f64> {
    // Asked for every letter of every line that is tried, so the font is read once.
    static REGULAR: OnceLock<BTreeMap<char, f64>> = OnceLock::new();
    static OBLIQUE: OnceLock<BTreeMap<char, f64>> = OnceLock::new();
    let table = match face {
        Face::Regular => &REGULAR,
        Face::Oblique => &OBLIQUE,
    };
    if table.get().is_none() {
        // Two threads may both read it; they find the same.
        let _ = table.set(advances(face)?);
    }
    table.get().and_then(|all| all.get(&character)).copied().ok_or_else(|| missing(character))
}

/// The advance widths of all characters of a face, in ems.
fn advances(face: Face) -> Result<BTreeMap<char, f64>> {
    let font = font(face)?;
    let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
    let units = f64::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
    let width = |glyph| f64::from(metrics.advance_width(glyph).unwrap_or(0.0)) / units;
    let all = font.charmap().mappings();
    Ok(all.filter_map(|(code, glyph)| Some((char::from_u32(code)?, width(glyph)))).collect())
}

/// The number of a character's glyph in its face.
///
/// # Errors
/// When the font has none.
pub(crate) fn glyph(face: Face, character: char) -> Result<u16> {
    let id = font(face)?.charmap().map(character).ok_or_else(|| missing(character))?;
    u16::try_from(id.to_u32()).map_err(|_| missing(character))
}

fn missing(character: char) -> Error {
    Error::invalid(format!("the diagrams' font has no glyph for `{}`", character.escape_default()))
        .remedy("use Latin, Greek or Cyrillic letters, digits and common signs")
}

/// The width of some runs, in ems.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn width(runs: &[Run]) -> Result<f64> {
    let mut sum = 0.0;
    for run in runs {
        for character in run.text.chars() {
            sum += advance(run.face, character)? * run.script.size();
        }
    }
    Ok(sum)
}

/// Splits marked text into runs. What stands between asterisks is a variable, set oblique (`*f* = 150 mm`); in it `_`
/// and `^` begin an index or an exponent, of one character or of several in braces. Three variables need no mark where
/// they stand alone: a small Greek letter, a letter with a prime (`f′`), a letter with an index (`y_n`).
pub(crate) fn runs(marked: &str) -> Vec<Run> {
    let (mut runs, mut from) = (Vec::new(), 0);
    for (open, close) in variables(marked) {
        words(&marked[from..open], &mut runs);
        variable(&marked[open + 1..close], &mut runs);
        from = close + 1;
    }
    words(&marked[from..], &mut runs);
    runs
}

/// Where the pairs of asterisks stand, in bytes. One before a blank opens none, one after a blank closes none (`2 * 3`), and one
/// without its pair is an asterisk.
pub(crate) fn variables(marked: &str) -> Vec<(usize, usize)> {
    let (mut pairs, mut from) = (Vec::new(), 0);
    while let Some(open) = marked[from..].find('*').map(|at| from + at) {
        let inside = &marked[open + 1..];
        let opens = !inside.starts_with(|c: char| c.is_whitespace() || c == '*');
        let closes = |&(at, _): &(usize, &str)| at > 0 && !inside[..at].ends_with(char::is_whitespace);
        let close = inside.match_indices('*').find(closes).filter(|_| opens);
        from = match close {
            Some((at, _)) => {
                pairs.push((open, open + 1 + at));
                open + at + 2
            }
            None => open + 1,
        };
    }
    pairs
}

fn push(runs: &mut Vec<Run>, text: &str, face: Face, script: Script) {
    match runs.last_mut() {
        _ if text.is_empty() => {}
        Some(last) if last.face == face && last.script == script => last.text.push_str(text),
        _ => runs.push(Run { text: text.to_owned(), face, script }),
    }
}

/// The inside of a pair of asterisks.
fn variable(text: &str, runs: &mut Vec<Run>) {
    let mut rest = text;
    while let Some(at) = rest.find(['_', '^']) {
        let (before, mark) = rest.split_at(at);
        push(runs, before, Face::Oblique, Script::Normal);
        let script = if mark.starts_with('_') { Script::Sub } else { Script::Super };
        let after = mark.get(1..).unwrap_or_default();
        let (inside, left) = match after.strip_prefix('{').and_then(|inside| inside.split_once('}')) {
            Some(braced) => braced,
            None => after.split_at(after.chars().next().map_or(0, char::len_utf8)),
        };
        // Numbers stand upright, also as indices.
        let upright = inside.chars().all(|c| !c.is_alphabetic());
        push(runs, inside, if upright { Face::Regular } else { Face::Oblique }, script);
        rest = left;
    }
    push(runs, rest, Face::Oblique, Script::Normal);
}

/// Words, with the variables that need no mark.
fn words(text: &str, runs: &mut Vec<Run>) {
    let characters: Vec<char> = text.chars().collect();
    let mut at = 0;
    while let Some(&c) = characters.get(at) {
        let stands_alone =
            at == 0 || characters.get(at - 1).is_none_or(|p| !p.is_alphanumeric() && *p != '_');
        let index: usize = match characters.get(at + 1) {
            Some('_') => characters.iter().skip(at + 2).take_while(|c| c.is_alphanumeric()).count(),
            _ => 0,
        };
        // `a_file_name` is a name.
        let index = if characters.get(at + 2 + index) == Some(&'_') { 0 } else { index };
        let next = characters.get(at + 1).copied().unwrap_or(' ');
        let mut one = [0; 4];
        let letter: &str = c.encode_utf8(&mut one);
        if stands_alone && c.is_alphabetic() && index > 0 {
            let inside: String = characters.iter().skip(at + 2).take(index).collect();
            variable(&format!("{c}_{{{inside}}}"), runs);
            at += 2 + index;
            continue;
        }
        let greek = ('α'..='ω').contains(&c) || matches!(c, 'ϕ' | 'ϑ');
        let is_variable = stands_alone
            && ((greek && !next.is_alphanumeric()) || (c.is_alphabetic() && matches!(next, '′' | '″')));
        push(runs, letter, if is_variable { Face::Oblique } else { Face::Regular }, Script::Normal);
        at += 1;
    }
}

/// A line of text whose base line begins at `at`.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn text(marked: &str, at: Point, size: f64, color: Color) -> Result<Text> {
    let runs = runs(marked);
    let width = width(&runs)? * size;
    let bounds = [at[0], at[1] - ASCENT * size, at[0] + width, at[1] + DESCENT * size];
    Ok(Text { at, along: [1.0, 0.0], size, color, runs, bounds })
}

/// A character of a text: its run, its face, the size of its em, and where its pen stands on the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(crate) run: usize,
    pub(crate) face: Face,
    pub(crate) character: char,
    pub(crate) size: f64,
    pub(crate) at: Point,
}

/// The characters of a text in their places.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn place(text: &Text) -> Result<Vec<Placed>> {
    let mut placed = Vec::new();
    let mut x = text.at[0];
    for (index, run) in text.runs.iter().enumerate() {
        let size = text.size * run.script.size();
        let at = text.at[1] + text.size * run.script.drop();
        for character in run.text.chars() {
            placed.push(Placed { run: index, face: run.face, character, size, at: text.turned([x, at]) });
            x += advance(run.face, character)? * size;
        }
    }
    Ok(placed)
}

/// The outline of a character at a size, its pen position at the origin and its base line along a unit direction, y down,
/// millimetres. Blank ones are empty.
///
/// # Errors
/// When the glyph is missing.
pub(crate) fn outline(face: Face, character: char, size: f64, along: Point) -> Result<Vec<Segment>> {
    let font = font(face)?;
    let id = font.charmap().map(character).ok_or_else(|| missing(character))?;
    let glyph = font.outline_glyphs().get(id).ok_or_else(|| missing(character))?;
    let units = f64::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
    let scale = size / units;
    let mut pen = Pen { across: along.map(|x| x * scale), segments: Vec::new() };
    glyph
        .draw(DrawSettings::unhinted(Size::unscaled(), LocationRef::default()), &mut pen)
        .map_err(|why| Error::invalid(format!("the embedded font cannot be drawn: {why}")))?;
    Ok(pen.segments)
}

struct Pen {
    /// The base line's direction, one unit of the font long.
    across: Point,
    segments: Vec<Segment>,
}

impl Pen {
    fn point(&self, x: f32, y: f32) -> Point {
        let ([c, s], x, y) = (self.across, f64::from(x), -f64::from(y));
        [x * c - y * s, x * s + y * c]
    }
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.segments.push(Segment::Move(self.point(x, y)));
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.segments.push(Segment::Line(self.point(x, y)));
    }
    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        self.segments.push(Segment::Quad(self.point(cx, cy), self.point(x, y)));
    }
    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        self.segments.push(Segment::Cubic(self.point(ax, ay), self.point(bx, by), self.point(x, y)));
    }
    fn close(&mut self) {
        self.segments.push(Segment::Close);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_the_diagrams_use_has_a_glyph_in_both_faces() {
        let signs = "ABCxyz0123456789αβγθφωΔΣΩ′″₀₁₂₃₄₅₆₇₈₉⁰¹²³⁴⁵⁶⁷⁸⁹⁻−±×÷°∞≤≥≈µ∥⊥√·…–—()[]/.,:;+=%&'\"!?*";
        for face in [Face::Regular, Face::Oblique] {
            for sign in signs.chars() {
                assert!(advance(face, sign).unwrap() > 0.1, "{sign}");
                assert!(!outline(face, sign, 3.0, [1.0, 0.0]).unwrap().is_empty(), "{sign}");
            }
        }
    }

    #[test]
    fn a_missing_glyph_is_an_error_that_names_it() {
        let error = text("focus \u{4e2d}", [0.0, 0.0], 3.0, Color::hex(0)).unwrap_err();
        assert!(error.to_string().contains("4e2d"), "{error}");
    }

    #[test]
    fn asterisks_mark_variables() {
        let marked = runs("*f* = 150 mm");
        assert_eq!((marked[0].face, marked[0].text.as_str()), (Face::Oblique, "f"));
        assert_eq!((marked[1].face, marked[1].text.as_str()), (Face::Regular, " = 150 mm"));
        let alone = runs("*f* of the lens *");
        assert_eq!((alone[1].face, alone[1].text.as_str()), (Face::Regular, " of the lens *"));
    }

    #[test]
    fn indices_and_plain_variables_need_little_markup() {
        let shown = |marked: &str| {
            let face = |f: Face| if f == Face::Oblique { "i" } else { "r" };
            let script = |s: Script| match s {
                Script::Normal => "",
                Script::Sub => "_",
                Script::Super => "^",
            };
            let all: Vec<String> = runs(marked)
                .iter()
                .map(|r| format!("{}{}{}", face(r.face), script(r.script), r.text))
                .collect();
            all.join("|")
        };
        assert_eq!(shown("angle θ of y_n"), "rangle |iθ|r of |iy|i_n");
        assert_eq!(shown("f′ = 2"), "if|r′ = 2");
        assert_eq!(shown("2 * 3 * 4 and ** of *N*"), "r2 * 3 * 4 and ** of |iN");
        assert_eq!(shown("*N^{-1/2}* and *x_0*"), "iN|r^-1/2|r and |ix|r_0");
        assert_eq!(shown("a_file_name, Δx, 5 µm, αβ"), "ra_file_name, Δx, 5 µm, αβ");
    }
}
