//! An OBJ as people write it in; out, the same geometry in the plain dialect that `tobj` reads without fault.
//!
//! `tobj` is quick (0.12 s for the 22 MB of sponza) but takes bad indices for good ones or overflows on them, makes up
//! coordinates that a corner lacks, gives lines as faces, and says neither which line is wrong nor why. So it is
//! given only `v`, `vt`, `vn` and `f` records, each checked here, with absolute indices in range and the same
//! parts on all corners of a face. The text goes to it piece by piece, so that both work at the same time; a record for each
//! face with what `tobj` cannot carry stays.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::sync::mpsc::Sender;

use super::mesh::NONE;
use super::records::Counts;
use super::text::{Statement, number, statements};
use super::warnings::Warnings;
use crate::error::{Error, Result};

/// Most memory that reading one OBJ may ask for, in bytes.
const WORKING_LIMIT: u64 = 16 << 30;

/// Bytes of text that go to `tobj` at a time, about.
const PIECE: usize = 1 << 18;

/// What is known of a face before its geometry is.
#[derive(Debug)]
pub(crate) struct Face {
    /// Line, from 1.
    pub(crate) line: usize,
    /// Number of corners, at least 3.
    pub(crate) corners: usize,
    /// Index into [`Normalized::materials`], or [`NONE`] before the first `usemtl`.
    pub(crate) material: u32,
    /// Every corner names a texture coordinate.
    pub(crate) texcoords: bool,
    /// Every corner names a normal.
    pub(crate) normals: bool,
}

/// What goes with the plain OBJ.
#[derive(Debug, Default)]
pub(crate) struct Normalized {
    /// One for each `f` in the text.
    pub(crate) faces: Vec<Face>,
    /// What `usemtl` statements say after the keyword (a comment may follow the name), each once, with its line.
    pub(crate) materials: Vec<(String, usize)>,
    /// What `mtllib` statements say after the keyword, with their lines.
    pub(crate) libraries: Vec<(String, usize)>,
    /// Bytes that building the geometry takes at its peak, this included.
    pub(crate) working: u64,
}

/// Normalises an OBJ in at most `most` bytes; `file` names it in warnings, `progress` gets the bytes done, `out` its `v`, `vt`,
/// `vn` and `f` records in the file's order, some at a time, and ends with them.
///
/// # Errors
/// [`crate::error::ErrorKind::Invalid`], with the line, for a number or vertex index that cannot be;
/// [`crate::error::ErrorKind::TooLarge`] when reading it would take more memory than there is, than `most` or than [`WORKING_LIMIT`].
pub(crate) fn normalize(
    bytes: &[u8],
    file: &str,
    warnings: &mut Warnings,
    most: u64,
    progress: &dyn Fn(u64),
    out: Sender<String>,
) -> Result<Normalized> {
    let most = most.min(WORKING_LIMIT);
    let total = Counts::of_file(bytes, most)?;
    total.check_memory(bytes.len() as u64, most)?;
    let mut work = Work {
        file,
        warnings,
        total,
        so_far: Counts::default(),
        out: Normalized::default(),
        text: String::new(),
    };
    work.out.working = bytes.len() as u64 + total.memory();

    let mut material = NONE;
    let mut known = HashMap::new();
    let mut corners = Vec::new();
    let mut list = statements(bytes)?;
    let mut step = 0u32;
    while let Some(statement) = list.next() {
        step = step.wrapping_add(1);
        if step.is_multiple_of(1 << 15) {
            progress(list.position() as u64);
        }
        if work.text.len() >= PIECE {
            let piece = std::mem::replace(&mut work.text, String::with_capacity(PIECE + PIECE / 8));
            // Where nobody listens any more, the reader says why.
            let _ = out.send(piece);
        }
        match statement.keyword() {
            "v" => work.vertex(&statement)?,
            "vt" => work.texcoord(&statement)?,
            "vn" => work.normal(&statement)?,
            "f" => work.face(&statement, material, &mut corners)?,
            "usemtl" => {
                let materials = &mut work.out.materials;
                material = *known.entry(statement.rest().to_owned()).or_insert_with(|| {
                    materials.push((statement.rest().to_owned(), statement.line));
                    materials.len() as u32 - 1
                });
            }
            "mtllib" => {
                let (rest, libraries) = (statement.rest(), &mut work.out.libraries);
                // One more than are followed, to be told of.
                if libraries.len() <= LIBRARIES
                    && libraries.iter().rev().take(64).all(|(known, _)| known != rest)
                {
                    libraries.push((rest.to_owned(), statement.line));
                }
            }
            keyword => work.other(&statement, keyword),
        }
    }
    let _ = out.send(work.text);
    Ok(work.out)
}

/// Most `mtllib` statements that are followed.
pub(super) const LIBRARIES: usize = 256;

/// One corner: vertex, texture coordinate and normal, from 0, if named and in range.
type Corner = [Option<i64>; 3];

struct Work<'a> {
    file: &'a str,
    warnings: &'a mut Warnings,
    total: Counts,
    so_far: Counts,
    out: Normalized,
    /// Records that have not gone out yet.
    text: String,
}

impl Work<'_> {
    fn warn(&mut self, line: usize, kind: &str, message: impl FnOnce() -> String) {
        self.warnings.add(self.file, Some(line), kind, message);
    }

    fn record(&mut self, keyword: &str, words: &[&str]) {
        self.text.push_str(keyword);
        for word in words {
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
    }

    /// Further numbers (a weight, a colour) mean nothing for a polygon without vertex colours.
    fn vertex(&mut self, statement: &Statement<'_>) -> Result<()> {
        self.so_far.positions += 1;
        let [x, y, z] = numbers(statement, ["vertex", "three"], [None; 3])?;
        self.record("v", &[x, y, z]);
        Ok(())
    }

    /// The second number may be missing, a third means nothing for a picture.
    fn texcoord(&mut self, statement: &Statement<'_>) -> Result<()> {
        self.so_far.texcoords += 1;
        let [u, v] = numbers(statement, ["texture coordinate", "one or two"], [None, Some("0")])?;
        self.record("vt", &[u, v]);
        Ok(())
    }

    fn normal(&mut self, statement: &Statement<'_>) -> Result<()> {
        self.so_far.normals += 1;
        let [x, y, z] = numbers(statement, ["normal", "three"], [None; 3])?;
        self.record("vn", &[x, y, z]);
        Ok(())
    }

    fn face(&mut self, statement: &Statement<'_>, material: u32, corners: &mut Vec<Corner>) -> Result<()> {
        corners.clear();
        for word in statement.operands() {
            let corner = self.corner(word, statement.line).map_err(|e| e.at_line(statement.line))?;
            corners.push(corner);
        }
        if corners.len() < 3 {
            self.warn(statement.line, "short face", || {
                "a face of fewer than three corners is skipped".to_owned()
            });
            return Ok(());
        }
        if corners.iter().any(|corner| corner[0].is_none()) {
            return Err(Error::invalid("a face names a vertex that there is not")
                .remedy(format!("the file has {} vertices, counted from 1", self.total.positions))
                .at_line(statement.line));
        }
        let mut has = [true; 3];
        for (part, name) in [(1, "texture coordinate"), (2, "normal")] {
            let with = corners.iter().filter(|corner| corner[part].is_some()).count();
            has[part] = with == corners.len();
            if 0 < with && with < corners.len() {
                let message = || format!("a face has a {name} on some corners only; they are dropped");
                self.warn(statement.line, name, message);
            }
        }
        self.text.push('f');
        for (word, corner) in statement.operands().zip(corners.iter()) {
            let number = |part: usize| corner[part].filter(|_| has[part]).map(|index| index + 1);
            self.text.push(' ');
            // As it stands: most of a file.
            if is_plain(word, has) {
                self.text.push_str(word);
                continue;
            }
            // Writing to a string cannot fail.
            let _ = match (number(0), number(1), number(2)) {
                (Some(v), None, None) => write!(self.text, "{v}"),
                (Some(v), Some(vt), None) => write!(self.text, "{v}/{vt}"),
                (Some(v), None, Some(vn)) => write!(self.text, "{v}//{vn}"),
                (Some(v), Some(vt), Some(vn)) => write!(self.text, "{v}/{vt}/{vn}"),
                (None, ..) => Ok(()),
            };
        }
        self.text.push('\n');
        let face = Face {
            line: statement.line,
            corners: corners.len(),
            material,
            texcoords: has[1],
            normals: has[2],
        };
        self.out.faces.push(face);
        Ok(())
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn` (empty parts count as absent). A part out of range is none.
    fn corner(&mut self, word: &str, line: usize) -> Result<Corner> {
        let mut corner = [None; 3];
        let totals = [self.total.positions, self.total.texcoords, self.total.normals];
        let so_far = [self.so_far.positions, self.so_far.texcoords, self.so_far.normals];
        let bad = || {
            Error::invalid(format!("`{}` is not a corner of a face", shown(word)))
                .remedy("write `f` with numbers of vertices, as 7 or 7/4 or 7//2 or 7/4/2")
        };
        for (part, digits) in word.split('/').enumerate() {
            let (Some(slot), Some(&total), Some(&so_far)) =
                (corner.get_mut(part), totals.get(part), so_far.get(part))
            else {
                return Err(bad().remedy("a corner has at most three parts: vertex/texture/normal"));
            };
            if digits.is_empty() && part > 0 {
                continue;
            }
            let index = match digits.parse::<i64>() {
                Ok(index) if index > 0 => index - 1,
                Ok(index) if index < 0 => so_far.checked_add(index).unwrap_or(-1),
                Ok(_) => -1,
                Err(e)
                    if matches!(
                        e.kind(),
                        std::num::IntErrorKind::PosOverflow | std::num::IntErrorKind::NegOverflow
                    ) =>
                {
                    -1
                }
                Err(_) => return Err(bad()),
            };
            if (0..total).contains(&index) {
                *slot = Some(index);
            } else if part == 0 {
                return Err(Error::invalid(format!("a face names vertex {digits}, which there is not"))
                    .remedy(format!("the file has {total} vertices, counted from 1")));
            } else {
                let name = ["vertex", "texture coordinate", "normal"][part];
                // Counted backwards, from those that the file has had so far.
                let of = if digits.starts_with('-') { so_far } else { total };
                self.warn(line, name, || format!("a face names {name} {digits} of {of}; it is dropped"));
            }
        }
        Ok(corner)
    }

    /// Statements besides geometry: quiet unless they ask for something that a picture would show.
    fn other(&mut self, statement: &Statement<'_>, keyword: &str) {
        let asks_for = match keyword {
            "call" => "another file",
            "csh" => "a command, which is never run",
            "curv" | "curv2" | "surf" | "bzp" | "bsp" | "cdc" | "cdp" => "a free-form curve or surface",
            "maplib" | "usemap" if statement.rest() != "off" => "a texture outside a material",
            _ if keyword.starts_with('!') => "a command, which is never run",
            _ => {
                if let Some(meant) = in_other_case(keyword, &["v", "vt", "vn", "f", "usemtl", "mtllib"]) {
                    self.warn(statement.line, keyword, || miswritten(keyword, meant));
                }
                return;
            }
        };
        self.warn(statement.line, keyword, || {
            format!("`{}` asks for {asks_for}; it is left out", shown(keyword))
        });
    }
}

/// Whether a corner is written with digits, and names just the parts that it has.
fn is_plain(word: &str, [_, texcoord, normal]: [bool; 3]) -> bool {
    let mut parts = word.split('/');
    let is_number = |part: Option<&str>| {
        part.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
    };
    let is_as = |part: Option<&str>, named: bool| if named { is_number(part) } else { part == Some("") };
    is_number(parts.next())
        && (!(texcoord || normal) || is_as(parts.next(), texcoord))
        && (!normal || is_number(parts.next()))
        && parts.next().is_none()
}

/// The first words of a record, each a number that `tobj` reads (it may be infinite or not a number), or a default.
fn numbers<'s, const N: usize>(
    statement: &'s Statement<'_>,
    [what, how_many]: [&str; 2],
    mut defaults: [Option<&'s str>; N],
) -> Result<[&'s str; N]> {
    for (slot, word) in defaults.iter_mut().zip(statement.operands()) {
        *slot = Some(number(word).ok_or_else(|| {
            Error::invalid(format!("`{}` is not a number", shown(word)))
                .at_line(statement.line)
                .remedy("write a decimal number, such as -0.25 or 1e-3")
        })?);
    }
    if defaults.contains(&None) {
        let message = format!("a {what} (`{}`) needs {how_many} numbers", shown(statement.keyword()));
        let error = Error::invalid(message).at_line(statement.line);
        return Err(error.remedy("complete the line, or export the model again"));
    }
    Ok(defaults.map(Option::unwrap_or_default))
}

/// The keyword of these that a file writes with other capitals.
pub(crate) fn in_other_case(keyword: &str, known: &[&'static str]) -> Option<&'static str> {
    known.iter().copied().find(|meant| keyword != *meant && keyword.eq_ignore_ascii_case(meant))
}

/// What is said of such a keyword.
pub(crate) fn miswritten(keyword: &str, meant: &str) -> String {
    format!("`{keyword}` is left out: the keyword is written `{meant}`")
}

/// A word of the file for a message: no longer than a line, nothing that a terminal would obey.
pub(crate) fn shown(word: &str) -> String {
    let escaped = |c: char| match c {
        '\\' | '\'' | '"' => c.to_string(),
        // Behind a letter, so that accents and vowel signs that stand on one stay.
        c => format!("a{c}").escape_debug().skip(1).collect(),
    };
    let mut text: String = word.chars().take(40).map(escaped).collect();
    if word.chars().nth(40).is_some() {
        text.push_str("...");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use std::sync::mpsc::channel;

    fn run(text: &str) -> Result<(Normalized, String, Vec<crate::error::Warning>)> {
        let mut warnings = Warnings::default();
        let (send, receive) = channel();
        let out = normalize(text.as_bytes(), "a.obj", &mut warnings, u64::MAX, &|_| (), send)?;
        Ok((out, receive.iter().collect(), warnings.finish("a.obj")))
    }

    #[test]
    fn indices_become_absolute_and_parts_uniform() -> Result<()> {
        let (out, text, warnings) =
            run("v 0 0 0 1\nv 1 0 0 # c\nv 0 1 0\nvt .5\nl 1 2\nf -3/1 -2/-1 3/1/\nf 1/9 2/1 3/1\n")?;
        assert_eq!(text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .5 0\nf 1/1 2/1 3/1\nf 1 2 3\n");
        assert_eq!((warnings.len(), warnings[0].line), (1, Some(7)));
        assert_eq!(out.faces.len(), 2);
        Ok(())
    }

    #[test]
    fn a_corner_is_plain_that_would_be_written_so() {
        let parts = [[false, false], [true, false], [false, true], [true, true]];
        let plain = [["7", "70"], ["7/4", "1/007"], ["7//2", "9//9"], ["7/4/2", "1/1/1"]];
        let others =
            ["", "/", "7/", "7//", "7/4/", "/4", "//2", "-7", "+7", "7.", "7/4/2/1", "7//-2", "7/ 4"];
        for (named, [a, b]) in parts.iter().zip(plain) {
            let has = |word: &str| is_plain(word, [true, named[0], named[1]]);
            assert!(has(a) && has(b), "{a} {b}");
            assert_eq!(plain.iter().flatten().chain(&others).filter(|word| has(word)).count(), 2, "{a}");
        }
    }

    #[test]
    fn what_cannot_be_is_an_error_with_its_line() {
        let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for bad in [
            "f 1 2 4",
            "f 1 2 0",
            "f -4 1 2",
            "f 1 2 99999999999999999999",
            "f 1 2 3j",
            "f /1 2 3",
            "f 1/1/1/1 2 3",
            "v 1 2",
            "v 1 2 1,5",
            "vn 1 2",
            "vt",
            "vt 0 x",
        ] {
            let error = run(&format!("{v}{bad}\n")).expect_err(bad);
            assert_eq!((error.kind(), error.place().line), (ErrorKind::Invalid, Some(4)), "{bad}: {error}");
        }
    }
}
