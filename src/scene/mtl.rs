//! Material libraries: an MTL's bytes in, its materials as written out, read by `tobj` from a mended text.
//!
//! `tobj` panics on `Kd 0.5`, gives up on one bad statement and takes map options for part of the name. So it gets only
//! the statements that shading uses, one material number in place of each name, colours of three good numbers, and
//! maps without options. What a material's text says besides stands in a [`Entry`] at the same number.

use std::fmt::Write as _;

use super::material::Mapping;
use super::normalize::{in_other_case, miswritten, shown};
use super::surfaces::BRIGHTEST;
use super::text::{Statement, number, readings, squeezed, statements};
use super::warnings::Warnings;
use crate::error::{Error, Result};
use glam::DVec2;

/// A picture that a material names.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Map {
    /// The name, which may end in a comment.
    pub(crate) name: String,
    /// Line, from 1.
    pub(crate) line: usize,
    /// Where it lies by the model's coordinates.
    pub(crate) mapping: Mapping,
}

/// One material as written, its numbers checked.
#[derive(Clone, Debug, Default)]
pub(crate) struct Entry {
    /// Its name, with single spaces; if that may end in a comment, without it too.
    pub(crate) names: Vec<String>,
    /// Line of its `newmtl`, from 1.
    pub(crate) line: usize,
    pub(crate) diffuse: Option<[f32; 3]>,
    pub(crate) emission: [f32; 3],
    pub(crate) coverage: Option<f32>,
    pub(crate) diffuse_map: Option<Map>,
    pub(crate) opacity_map: Option<Map>,
    /// Names of pictures of what is not drawn: bumps, gloss and the like.
    pub(crate) unread: Vec<String>,
}

impl Entry {
    /// Whether it looks otherwise than one in the same folder.
    pub(crate) fn differs(&self, other: &Self) -> bool {
        let colours = |entry: &Self| (entry.diffuse, entry.emission, entry.coverage);
        let map = |map: &Option<Map>| map.as_ref().map(|map| (map.name.clone(), map.mapping));
        let maps = |entry: &Self| [map(&entry.diffuse_map), map(&entry.opacity_map)];
        colours(self) != colours(other) || maps(self) != maps(other)
    }
}

/// Reads an MTL; `file` names it in warnings.
///
/// # Errors
/// When it is no text at all, or `tobj` finds fault with the mended text.
pub(crate) fn read(bytes: &[u8], file: &str, warnings: &mut Warnings) -> Result<Vec<Entry>> {
    let mut work = Work { file, warnings, text: String::new(), entries: Vec::new() };
    for statement in statements(bytes)? {
        work.statement(&statement);
    }
    let Work { text, mut entries, .. } = work;
    if entries.is_empty() && statements(bytes)?.next().is_some() {
        return Err(Error::invalid("it holds no material (`newmtl`)"));
    }
    let (read, _) = tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|e| Error::invalid(e.to_string()))?;
    for (entry, read) in entries.iter_mut().zip(read) {
        let narrow = |colour: [f64; 3]| colour.map(|value| value as f32);
        entry.diffuse = read.diffuse.map(narrow);
        entry.emission = read.emissive.map(narrow).unwrap_or_default();
        // Where both are given they often contradict each other, and `d` is the format's own.
        let from_tr =
            || read.unknown_param.get("Tr").and_then(|text| text.parse().ok()).map(|tr: f64| 1.0 - tr);
        entry.coverage = read.dissolve.or_else(from_tr).map(|value| value as f32);
        for (map, name) in
            [(&mut entry.diffuse_map, read.diffuse_texture), (&mut entry.opacity_map, read.dissolve_texture)]
        {
            if let (Some(map), Some(name)) = (map, name) {
                map.name = name;
            }
        }
    }
    Ok(entries)
}

/// Most of a scale or an offset of texture coordinates.
const FARTHEST: f64 = 1e9;

struct Work<'a> {
    file: &'a str,
    warnings: &'a mut Warnings,
    text: String,
    entries: Vec<Entry>,
}

impl Work<'_> {
    fn warn(&mut self, statement: &Statement<'_>, kind: &str, message: impl FnOnce() -> String) {
        let keyword = statement.keyword();
        self.warnings.add(self.file, Some(statement.line), &format!("{keyword} {kind}"), message);
    }

    fn statement(&mut self, statement: &Statement<'_>) {
        let keyword = statement.keyword();
        if keyword == "newmtl" {
            let names = readings(statement.rest()).map(squeezed).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(self.text, "newmtl m{}", self.entries.len());
            self.entries.push(Entry { names, line: statement.line, ..Entry::default() });
            return;
        }
        let is_map =
            keyword.starts_with("map_") || matches!(keyword, "bump" | "disp" | "norm" | "refl" | "decal");
        if is_map && !matches!(keyword, "map_Kd" | "map_d") {
            let name = statement.operands().last().map(str::to_owned);
            if let Some(entry) = self.entries.last_mut() {
                entry.unread.extend(name);
            }
        }
        if let Some(meant) =
            in_other_case(keyword, &["newmtl", "Kd", "Ke", "d", "Tr", "map_Kd", "map_d", "map_Ke", "decal"])
        {
            self.warn(statement, "case", || miswritten(keyword, meant));
        }
        if !matches!(keyword, "Kd" | "Ke" | "d" | "Tr" | "map_Kd" | "map_d" | "map_Ke" | "decal") {
            return;
        }
        if self.entries.is_empty() {
            self.warn(statement, "before", || format!("`{keyword}` before the first `newmtl` is left out"));
            return;
        }
        match keyword {
            "Kd" | "Ke" => self.colour(statement),
            "d" | "Tr" => self.opacity(statement),
            "map_Kd" | "map_d" => self.map(statement),
            _ if !statement.rest().is_empty() => {
                self.warn(statement, "", || format!("`{keyword}` is not supported and is left out"));
            }
            _ => {}
        }
    }

    fn colour(&mut self, statement: &Statement<'_>) {
        let keyword = statement.keyword();
        let words: Vec<&str> = statement.operands().collect();
        let numbers: Option<Vec<f64>> = words.iter().take(3).map(|word| parsed(word)).collect();
        let colour = match numbers.as_deref() {
            Some(&[grey]) => [grey; 3],
            Some(&[r, g, b]) => [r, g, b],
            _ => {
                let said = shown(words.first().copied().unwrap_or_default());
                self.warn(statement, "unread", || {
                    format!("`{keyword} {said}` cannot be read as one or three numbers; it is left out")
                });
                return;
            }
        };
        if colour.iter().any(|&value| !(value as f32).is_finite()) {
            self.warn(statement, "infinite", || format!("`{keyword}` is not finite; it is left out"));
            return;
        }
        if colour.iter().any(|&value| value < 0.0) {
            self.warn(statement, "negative", || format!("`{keyword}` is negative; 0 is used"));
        }
        let most = f64::from(BRIGHTEST);
        if colour.iter().any(|&value| value > most) {
            self.warn(statement, "bright", || format!("`{keyword}` is more than {most:e}; that is used"));
        }
        let [r, g, b] = colour.map(|value| value.clamp(0.0, most));
        let _ = writeln!(self.text, "{keyword} {r} {g} {b}");
    }

    fn opacity(&mut self, statement: &Statement<'_>) {
        let keyword = statement.keyword();
        let mut words = statement.operands().peekable();
        if words.next_if_eq(&"-halo").is_some() {
            self.warn(statement, "halo", || {
                "`-halo` is not supported; the opacity is the same everywhere".to_owned()
            });
        }
        match words.next().and_then(parsed) {
            Some(value) if value.is_finite() => {
                if !(0.0..=1.0).contains(&value) {
                    self.warn(statement, "range", || {
                        format!("`{keyword}` is not from 0 to 1; the nearer is used")
                    });
                }
                let _ = writeln!(self.text, "{keyword} {}", value.clamp(0.0, 1.0));
            }
            _ => self.warn(statement, "unread", || format!("`{keyword}` cannot be read; it is left out")),
        }
    }

    fn map(&mut self, statement: &Statement<'_>) {
        let keyword = statement.keyword();
        let mut map = Map { name: String::new(), line: statement.line, mapping: Mapping::IDENTITY };
        let mut rest = statement.rest();
        while let Some((option, after)) = rest.starts_with('-').then(|| first_word(rest)) {
            let most = match option {
                "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-bm" | "-boost" | "-imfchan"
                | "-type" => 1,
                "-mm" => 2,
                "-s" | "-o" | "-t" => 3,
                // A name may begin with a dash.
                _ => break,
            };
            let numeric = matches!(option, "-s" | "-o" | "-t" | "-mm");
            let mut values = Vec::new();
            rest = after;
            while values.len() < most {
                let (word, after) = first_word(rest);
                // The last word is the name, even if it looks like a number.
                if word.is_empty() || numeric && (parsed(word).is_none() || after.is_empty()) {
                    break;
                }
                values.push(word);
                rest = after;
            }
            self.option(statement, option, &values, &mut map);
        }
        if readings(rest).all(str::is_empty) {
            self.warn(statement, "nameless", || format!("`{keyword}` names no file; it is left out"));
            return;
        }
        let _ = writeln!(self.text, "{keyword} {rest}");
        if let Some(entry) = self.entries.last_mut() {
            let slot = if keyword == "map_d" { &mut entry.opacity_map } else { &mut entry.diffuse_map };
            *slot = Some(map);
        }
    }

    /// Takes `-s` and `-o`; warns of others that would show.
    fn option(&mut self, statement: &Statement<'_>, option: &str, values: &[&str], map: &mut Map) {
        let near = |word: &&str| parsed(word).filter(|v| v.abs() <= FARTHEST);
        let number = |at: usize, default: f64| values.get(at).and_then(near).unwrap_or(default);
        if matches!(option, "-s" | "-o") && values.iter().take(2).any(|word| near(word).is_none()) {
            let keyword = statement.keyword();
            self.warn(statement, "far", || {
                format!("a number of option `{option}` of `{keyword}` is not finite or beyond {FARTHEST:e}; it is left out")
            });
        }
        let shows = match option {
            "-s" => {
                map.mapping.scale = DVec2::new(number(0, 1.0), number(1, 1.0));
                false
            }
            "-o" => {
                map.mapping.offset = DVec2::new(number(0, 0.0), number(1, 0.0));
                false
            }
            "-t" => (0..3).any(|at| number(at, 0.0) != 0.0),
            "-mm" => number(0, 0.0) != 0.0 || number(1, 1.0) != 1.0,
            "-clamp" | "-cc" => values == ["on"],
            // By its matte, its alpha, an opacity map is read anyway.
            "-imfchan" => statement.keyword() != "map_d" || values != ["m"],
            _ => false,
        };
        if shows {
            let keyword = statement.keyword();
            self.warn(statement, option, || {
                format!("option `{option}` of `{keyword}` is not supported and is left out")
            });
        }
    }
}

fn parsed(word: &str) -> Option<f64> {
    number(word)?.parse().ok()
}

fn first_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(text: &str) -> (Vec<Entry>, usize) {
        let mut warnings = Warnings::default();
        let entries = read(text.as_bytes(), "a.mtl", &mut warnings).expect("an MTL");
        (entries, warnings.finish("a.mtl").len())
    }

    #[test]
    fn colours_and_opacity_are_read_and_mended() {
        let (list, warnings) =
            run("newmtl a  b\nKd 0.5\nTr 0.25\nnewmtl\nKd 1 0 0 # red\nd 0.75\nTr 0.5\nKe 2 2 2\n");
        assert_eq!(warnings, 0);
        assert_eq!(
            (list[0].names[0].as_str(), list[0].diffuse, list[0].coverage),
            ("a b", Some([0.5; 3]), Some(0.75))
        );
        assert_eq!((list[1].names[0].as_str(), list[1].diffuse), ("", Some([1.0, 0.0, 0.0])));
        assert_eq!((list[1].coverage, list[1].emission), (Some(0.75), [2.0; 3]));
    }

    #[test]
    fn what_cannot_be_is_replaced_with_a_warning() {
        for bad in [
            "Kd nan 0 0",
            "Kd 1e39",
            "Kd spectral a.rfl",
            "Kd 1 2",
            "Kd",
            "d 2",
            "d",
            "Tr inf",
            "map_Kd",
            "map_Ke a.png",
            "Ke -1",
            "map_Kd -s nan a.png",
            "map_Kd -o 0 1e30 a.png",
            "Kd 1.#QNAN 0 0",
            "d 0.#IND",
            "map_d -imfchan l a.png",
        ] {
            let (list, warnings) = run(&format!("newmtl a\n{bad}\n"));
            assert_eq!(warnings, 1, "{bad}");
            assert!(list[0].diffuse.is_none() && list[0].emission == [0.0; 3], "{bad}");
            assert!(list[0].coverage.is_none_or(|d| d == 1.0), "{bad}");
        }
    }

    #[test]
    fn map_options_are_not_part_of_the_name() {
        let options = "newmtl a\nmap_Kd -s 2 3 1 -o 0.5 -clamp off -mm 0 1 -texres 512 my tex.png\nmap_d -imfchan m -s 2 4k.png";
        let (list, warnings) = run(options);
        assert_eq!(warnings, 0);
        let map = list[0].diffuse_map.as_ref().expect("a map");
        assert_eq!(
            (map.name.as_str(), map.line, map.mapping.scale, map.mapping.offset),
            ("my tex.png", 2, DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0))
        );
        let map = list[0].opacity_map.as_ref().expect("a map");
        assert_eq!((map.name.as_str(), map.mapping.scale), ("4k.png", DVec2::new(2.0, 1.0)));
    }
}
