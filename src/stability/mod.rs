//! How exact the optics are, as maps of relative errors: the library beside textbook formulas and single precision. In:
//! nothing. Out: for each question a table (CSV) and a figure file that draws it; the same bytes on every machine.
//!
//! The references are the contract's formulas in numbers of twice the digits (`wide`). The tests hold the library to an
//! oracle that is independent of both (`tests/hard_cases.rs`).

mod answers;
mod classic;
mod formulas;
mod maps;
mod number;
mod wide;

pub use answers::{Answer, Asked, answers};

use crate::diagram::{Changes, Figure, FigureFile};
use crate::error::Result;
use crate::scene::{Document, Memory};
use maps::{POINTS, QUESTIONS, Question, Span};
use std::fmt::Write;
use std::path::Path;

/// A map: a table of errors, and a figure file of kind `heat-map` that shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct StabilityMap {
    /// The stem of its files.
    pub name: &'static str,
    /// The table, to be written as `NAME.csv`.
    pub csv: String,
    /// The figure file, to be written beside it as `NAME.toml`.
    pub figure: String,
}

/// All maps.
pub fn maps() -> Vec<StabilityMap> {
    QUESTIONS.iter().chain([&POINTS]).map(StabilityMap::of).collect()
}

impl StabilityMap {
    fn of(question: &Question) -> Self {
        let mut csv = format!(
            "# {}: relative errors; empty where there is no answer. Made by `groundglass stability`.\nx,y,library,textbook,single\n",
            question.title
        );
        for y in question.y.values() {
            for x in question.x.values() {
                let errors = (question.cell)(x, y);
                let cells = errors.map(|error| error.map_or(String::new(), |error| format!("{error:.2e}")));
                // Writing to a string cannot fail.
                let _ = writeln!(csv, "{x:e},{y:e},{}", cells.join(","));
            }
        }
        Self { name: question.name, csv, figure: figure(question) }
    }

    /// Draws it.
    ///
    /// # Errors
    /// As [`FigureFile::draw`]; none is known.
    pub fn draw(&self) -> Result<Figure> {
        let source = Memory::new().with(&format!("{}.csv", self.name), self.csv.clone().into_bytes());
        let document = Document::from_bytes(self.figure.as_bytes(), &format!("{}.toml", self.name))?;
        FigureFile::from_document(document)?.draw(&source, Path::new(""), Changes::default())
    }
}

impl Span {
    /// Its values, evenly spaced in their logarithms, of three digits: what the table says is what was asked.
    fn values(&self) -> impl Iterator<Item = f64> {
        let step = (self.last - self.first) / self.steps as f64;
        let first = self.first;
        (0..=self.steps)
            .filter_map(move |i| format!("{:.2e}", libm::pow(10.0, first + step * i as f64)).parse().ok())
    }

    /// Every fourth decade, or every second of a short span.
    fn ticks(&self) -> String {
        let every = if self.last - self.first > 10.0 { 4 } else { 2 };
        let (first, last) = (libm::ceil(self.first) as i32, libm::floor(self.last) as i32);
        let ticks = (first..=last).filter(|n| n.rem_euclid(every) == 0);
        ticks.map(|n| format!("1e{n}")).collect::<Vec<_>>().join(", ")
    }
}

fn figure(question: &Question) -> String {
    let axis = |name: &str, span: &Span| {
        format!(
            "\n[{name}]\ncolumn = \"{name}\"\ntitle = \"{}\"\nscale = \"log\"\nticks = [{}]\n",
            span.title,
            span.ticks()
        )
    };
    let panel = |name: &str, column: &str| format!("\n[[panel]]\nname = \"{name}\"\ncolumn = \"{column}\"\n");
    format!(
        "# Made by `groundglass stability`.\nkind = \"heat-map\"\ntitle = \"{}\"\nwidth_mm = 180.0\nheight_mm = 72.0\n\
         data = \"{}.csv\"\nvalue = \"relative error\"\nnothing = \"no answer\"\n\
         bands = [1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 1e-1]\n{}{}{}{}{}",
        question.title,
        question.name,
        axis("x", &question.x),
        axis("y", &question.y),
        panel("groundglass", "library"),
        panel(question.textbook, "textbook"),
        panel("groundglass's formula, 32 bits", "single"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest of a column, and how many cells have none.
    fn column(map: &StabilityMap, at: usize) -> (f64, usize) {
        let cells = map.csv.lines().skip(2).map(|line| line.split(',').nth(at).unwrap().parse::<f64>().ok());
        cells.fold((0.0, 0), |(most, none), cell| match cell {
            Some(cell) => (cell.max(most), none),
            None => (most, none + 1),
        })
    }

    #[test]
    fn the_library_keeps_its_digits_where_textbooks_lose_theirs() {
        for map in maps() {
            let [ours, textbook, single] = [2, 3, 4].map(|at| column(&map, at));
            println!("{}: library {ours:?}, textbook {textbook:?}, single {single:?}", map.name);
            // Some of the questions have no answer, or one that no 53 bits decide.
            let (most, none) = match map.name {
                "focus-plane" | "hinge-distance" => (1e-15, 0),
                "lens-for-plane" => (2e-15, 4),
                "double-root" => (1e-15, 4),
                "blur" => (3e-12, 56),
                "three-points" => (1e-9, 170),
                name => panic!("no bound for {name}"),
            };
            assert!(ours.0 <= most && ours.1 <= none, "{}: {ours:?}", map.name);
            assert!(textbook.0 > ours.0 || textbook.1 > ours.1, "{}", map.name);
        }
    }

    #[test]
    fn maps_are_drawn_and_the_same_each_time() {
        let (one, other) = (maps(), maps());
        assert_eq!(one, other);
        for map in one {
            let svg = map.draw().unwrap().to_svg().unwrap();
            assert!(svg.contains("data-series=\"groundglass\""), "{}", map.name);
        }
    }
}
