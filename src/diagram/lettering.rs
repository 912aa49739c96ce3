//! Text as outlines. In: characters, face, size. Out: advance widths and glyph outlines from one embedded font.
//!
//! The font is a renamed subset of DejaVu Sans (`assets/fonts`). A character without a glyph is an error, so no
//! figure ever shows an empty box. There is no kerning: every renderer places the glyphs alike.

use super::display_list::{Color, Face, Point, Run, Segment, Text};
use crate::error::{Error, Result};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};

const REGULAR: &[u8] = include_bytes!("../../assets/fonts/GroundglassSans-Regular.ttf");
const OBLIQUE: &[u8] = include_bytes!("../../assets/fonts/GroundglassSans-Oblique.ttf");

/// Height above and below the base line in which a line of text is kept clear, in ems: those of `b` and `p`.
pub(crate) const ASCENT: f64 = 0.77;
pub(crate) const DESCENT: f64 = 0.24;

fn font(face: Face) -> Result<FontRef<'static>> {
    let bytes = match face {
        Face::Regular => REGULAR,
        Face::Oblique => OBLIQUE,
    };
    FontRef::new(bytes).map_err(|why| Error::invalid(format!("the embedded font cannot be read: {why}")))
}

/// The advance width of one character, in ems.
///
/// # Errors
/// When the font has no glyph for it.
pub(crate) fn advance(face: Face, character: char) -> Result<f64> {
    let font = font(face)?;
    let glyph = font.charmap().map(character).ok_or_else(|| missing(character))?;
    let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
    let units = f64::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
    Ok(f64::from(metrics.advance_width(glyph).unwrap_or(0.0)) / units)
}

fn missing(character: char) -> Error {
    Error::invalid(format!("the diagrams' font has no glyph for `{}`", character.escape_default()))
        .remedy("use Latin letters, Greek letters, digits and common signs")
}

/// The width of some runs, in ems.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn width(runs: &[Run]) -> Result<f64> {
    let mut sum = 0.0;
    for run in runs {
        for character in run.text.chars() {
            sum += advance(run.face, character)?;
        }
    }
    Ok(sum)
}

/// Splits marked text into runs: what stands between asterisks is a variable, set oblique (`*f* = 150 mm`).
pub(crate) fn runs(marked: &str) -> Vec<Run> {
    let faces = [Face::Regular, Face::Oblique];
    marked
        .split('*')
        .enumerate()
        .filter(|(_, text)| !text.is_empty())
        .map(|(i, text)| Run { text: text.to_owned(), face: faces[i % 2] })
        .collect()
}

/// A line of text whose base line begins at `at`.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn text(marked: &str, at: Point, size: f64, color: Color) -> Result<Text> {
    let runs = runs(marked);
    let width = width(&runs)? * size;
    let bounds = [at[0], at[1] - ASCENT * size, at[0] + width, at[1] + DESCENT * size];
    Ok(Text { at, size, color, runs, bounds })
}

/// Each character of a text with the pen position of its glyph.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn place(text: &Text) -> Result<Vec<(Face, char, Point)>> {
    let mut placed = Vec::new();
    let mut x = text.at[0];
    for run in &text.runs {
        for character in run.text.chars() {
            placed.push((run.face, character, [x, text.at[1]]));
            x += advance(run.face, character)? * text.size;
        }
    }
    Ok(placed)
}

/// The outline of a character at a size, its pen position at the origin, y down, millimetres. Blank ones are empty.
///
/// # Errors
/// When the glyph is missing.
pub(crate) fn outline(face: Face, character: char, size: f64) -> Result<Vec<Segment>> {
    let font = font(face)?;
    let id = font.charmap().map(character).ok_or_else(|| missing(character))?;
    let glyph = font.outline_glyphs().get(id).ok_or_else(|| missing(character))?;
    let units = f64::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
    let mut pen = Pen { scale: size / units, segments: Vec::new() };
    glyph
        .draw(DrawSettings::unhinted(Size::unscaled(), LocationRef::default()), &mut pen)
        .map_err(|why| Error::invalid(format!("the embedded font cannot be drawn: {why}")))?;
    Ok(pen.segments)
}

struct Pen {
    scale: f64,
    segments: Vec<Segment>,
}

impl Pen {
    fn point(&self, x: f32, y: f32) -> Point {
        [f64::from(x) * self.scale, -f64::from(y) * self.scale]
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
        let signs = "ABCxyz0123456789αβγθφωΔΣΩ′″₀₁₂₃₄₅₆₇₈₉⁰¹²³⁴⁵⁶⁷⁸⁹⁻−±×÷°∞≤≥≈µ∥⊥√·…–—()[]/.,:;+=%&'\"!?";
        for face in [Face::Regular, Face::Oblique] {
            for sign in signs.chars() {
                assert!(advance(face, sign).unwrap() > 0.1, "{sign}");
                assert!(!outline(face, sign, 3.0).unwrap().is_empty(), "{sign}");
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
    }
}
