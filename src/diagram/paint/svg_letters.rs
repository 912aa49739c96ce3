//! Outlines of letters in few bytes: they are most of a figure's file. In: segments. Out: path data of relative commands.

use crate::diagram::display_list::{Point, Segment};
use crate::diagram::words::coordinate;

/// Where a letter stands: to a hundredth of a millimetre.
pub(crate) fn pen(x: f64) -> String {
    coordinate((x * 100.0).round() / 100.0)
}

/// Path data that grows letter by letter. Places are whole thousandths of a millimetre, so nothing adds up.
#[derive(Default)]
pub(crate) struct Letters {
    pub(crate) data: String,
    /// Where the path stands, and where its piece began.
    last: [i64; 2],
    first: [i64; 2],
    /// Where the next control point lies when a curve goes on smoothly.
    smooth: Option<[i64; 2]>,
}

impl Letters {
    /// Adds an outline, moved.
    pub(crate) fn add(&mut self, outline: &[Segment], [dx, dy]: Point) {
        let grid = |p: Point| [p[0] + dx, p[1] + dy].map(|x| (x * 1000.0).round() as i64);
        for segment in outline {
            match *segment {
                Segment::Move(p) => {
                    self.put('m', &[grid(p)]);
                    self.first = self.last;
                }
                Segment::Line(p) => self.put('l', &[grid(p)]),
                Segment::Quad(c, p) => {
                    let (c, p) = (grid(c), grid(p));
                    // Most curves of a font go on smoothly: their control points need not be said.
                    let is_smooth =
                        self.smooth.filter(|s| (s[0] - c[0]).abs() <= 1 && (s[1] - c[1]).abs() <= 1);
                    match is_smooth {
                        Some(_) => self.put('t', &[p]),
                        None => self.put('q', &[c, p]),
                    }
                    let c = is_smooth.unwrap_or(c);
                    self.smooth = Some([2 * p[0] - c[0], 2 * p[1] - c[1]]);
                }
                Segment::Cubic(c, e, p) => self.put('c', &[grid(c), grid(e), grid(p)]),
                Segment::Close => {
                    self.put('z', &[]);
                    self.last = self.first;
                }
            }
        }
    }

    fn put(&mut self, command: char, points: &[[i64; 2]]) {
        self.data.push(command);
        self.smooth = None;
        let from = self.last;
        let mut has_point = None;
        for p in points {
            for (to, from) in p.iter().zip(from) {
                let text = number(to - from);
                // Numbers are parted by a minus, or by a point where the one before has its own.
                let runs_on = text.starts_with('-') || (text.starts_with('.') && has_point == Some(true));
                if has_point.is_some() && !runs_on {
                    self.data.push(' ');
                }
                has_point = Some(text.contains('.'));
                self.data.push_str(&text);
            }
            self.last = *p;
        }
    }
}

/// A number of thousandths, without needless zeros.
fn number(value: i64) -> String {
    let text = coordinate(value as f64 / 1000.0);
    if value.abs() < 1000 { text.replacen("0.", ".", 1) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagram::display_list::Face;
    use crate::diagram::lettering;

    /// The path read back as absolute segments: what a reader of SVG makes of it.
    fn read(data: &str) -> Vec<Segment> {
        let (mut segments, mut last, mut first, mut control) = (Vec::new(), [0.0; 2], [0.0; 2], [0.0; 2]);
        let mut rest = data;
        while let Some(command) = rest.chars().next() {
            let end =
                rest.get(1..).and_then(|r| r.find(|c: char| c.is_alphabetic())).map_or(rest.len(), |i| i + 1);
            let mut numbers: Vec<f64> = Vec::new();
            let mut word = String::new();
            for c in rest[1..end].chars().chain([' ']) {
                if !word.is_empty() && (c == ' ' || c == '-' || (c == '.' && word.contains('.'))) {
                    numbers.push(word.parse().unwrap());
                    word.clear();
                }
                if c != ' ' {
                    word.push(c);
                }
            }
            let p: Vec<Point> = numbers.chunks(2).map(|n| [last[0] + n[0], last[1] + n[1]]).collect();
            let before = last;
            last = p.last().copied().unwrap_or(first);
            match command {
                'm' => {
                    first = last;
                    segments.push(Segment::Move(last));
                }
                'l' => segments.push(Segment::Line(last)),
                'q' => segments.push(Segment::Quad(p[0], last)),
                't' => segments
                    .push(Segment::Quad([2.0 * before[0] - control[0], 2.0 * before[1] - control[1]], last)),
                _ => segments.push(Segment::Close),
            }
            if let Some(Segment::Quad(c, _)) = segments.last() {
                control = *c;
            }
            rest = &rest[end..];
        }
        segments
    }

    #[test]
    fn short_outlines_are_the_outlines() {
        let near = |p: Point, q: Point| (p[0] - q[0]).abs() < 0.0021 && (p[1] - q[1]).abs() < 0.0021;
        let slant = [0.8, -0.6];
        for (face, along) in
            [(Face::Regular, [1.0, 0.0]), (Face::Oblique, [1.0, 0.0]), (Face::Regular, slant)]
        {
            for character in ('!'..='~').chain("αθ′°−∞".chars()) {
                let outline = lettering::outline(face, character, 2.8, along).unwrap();
                let mut letters = Letters::default();
                letters.add(&outline, [0.0; 2]);
                let found = read(&letters.data);
                assert_eq!(found.len(), outline.len(), "{character}");
                for (one, two) in found.iter().zip(&outline) {
                    let same = match (*one, *two) {
                        (Segment::Move(p), Segment::Move(q)) | (Segment::Line(p), Segment::Line(q)) => {
                            near(p, q)
                        }
                        (Segment::Quad(c, p), Segment::Quad(d, q)) => near(c, d) && near(p, q),
                        (Segment::Close, Segment::Close) => true,
                        _ => false,
                    };
                    assert!(same, "{character}: {one:?} is not {two:?}");
                }
            }
        }
    }
}
