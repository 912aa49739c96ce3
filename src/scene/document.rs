//! A TOML text that knows where its keys are. In: bytes or text and the file's name; out: the parsed
//! table, and for any key in dotted form (`camera.front.tilt_deg`, `mesh[1].path`) its place.
//!
//! Places are looked up by parsing again, so nothing that is correct pays for them, and later
//! stages (solver, asset loader) can name a line without carrying spans about.

use crate::error::{Error, ErrorKind, Excerpt, Place, Result};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The largest scene or figure text, in bytes (4 MiB). Geometry belongs in OBJ files.
pub const SIZE_LIMIT: usize = 4 << 20;

/// Longer lines are not shown with an error, only numbered.
const EXCERPT_LIMIT: usize = 240;

/// The text of a TOML file and the name it was given.
#[derive(Clone, Debug)]
pub struct Document {
    name: Arc<str>,
    text: Arc<str>,
}

impl Document {
    /// The document in `bytes`; `name` is what errors call the file.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`] when it is not UTF-8 (with the line), [`ErrorKind::TooLarge`] when it is
    /// larger than [`SIZE_LIMIT`].
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self> {
        if bytes.len() > SIZE_LIMIT {
            return Err(Error::new(
                ErrorKind::TooLarge,
                format!("{} bytes of TOML, and at most {SIZE_LIMIT} are read", bytes.len()),
            )
            .in_file(name)
            .remedy("keep geometry in OBJ files and only name them here"));
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => {
                // A byte order mark says nothing in UTF-8, but some editors write it.
                let text = text.strip_prefix('\u{feff}').unwrap_or(text);
                Ok(Self { name: name.into(), text: text.into() })
            }
            Err(error) => {
                let good = bytes.get(..error.valid_up_to()).unwrap_or_default();
                let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
                Err(Error::invalid("not UTF-8 text")
                    .in_file(name)
                    .at_line(line)
                    .remedy("save the file as UTF-8; a scene is a TOML text"))
            }
        }
    }

    /// What errors call the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text, without a byte order mark.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The parsed table, every key and value with its byte range.
    pub(crate) fn table(&self) -> Result<Spanned<DeTable<'_>>> {
        DeTable::parse(&self.text).map_err(|error| {
            // The parser's messages have several lines for their own layout; here they are one clause.
            let message = error.message().trim().replace('\n', ", ");
            let mut made = Error::invalid(format!("not TOML: {message}"))
                .remedy("write `key = value`, each key once, under heads such as `[camera]`; see toml.io");
            if let Some(span) = error.span() {
                made = made.at(self.place_of_range(span, None));
            }
            made.in_file(&*self.name)
        })
    }

    /// The keys of a struct, of a table that fits its schema. By way of values without places: each struct that is read straight
    /// from the text costs the build three times as much, and `shape` has said where what is.
    pub(crate) fn keys<T: DeserializeOwned>(&self, table: Spanned<DeTable<'_>>) -> Result<T> {
        let values = toml::Table::deserialize(toml::de::Deserializer::from(table));
        values.and_then(|values| T::deserialize(toml::Value::Table(values))).map_err(|error| {
            // `shape` has found everything that serde could.
            Error::invalid(error.message().replace('\n', ", ")).in_file(&*self.name)
        })
    }

    /// Where `key` stands; when the text does not have it, where the nearest table around it stands.
    pub fn place(&self, key: &str) -> Place {
        let nowhere = Place { file: Some(self.name.to_string()), key: Some(key.into()), ..Place::default() };
        let Ok(table) = DeTable::parse(&self.text) else { return nowhere };
        let mut best: Option<Range<usize>> = None;
        let mut here: Option<&Spanned<DeValue<'_>>> = None;
        for step in key.split(['.', '[']) {
            let next = match (step.strip_suffix(']'), here) {
                (Some(index), Some(value)) => {
                    index.parse::<usize>().ok().and_then(|index| value.get_ref().as_array()?.get(index))
                }
                (None, Some(value)) => value.get_ref().as_table().and_then(|table| table.get(step)),
                (None, None) => table.get_ref().get(step),
                (Some(_), None) => None,
            };
            let Some(next) = next else { break };
            best = Some(next.span());
            here = Some(next);
        }
        match best {
            Some(range) => self.place_of_range(range, Some(key)),
            None => nowhere,
        }
    }

    /// The place of a byte range of the text.
    pub(crate) fn place_of_range(&self, range: Range<usize>, key: Option<&str>) -> Place {
        let mut start = range.start.min(self.text.len());
        while !self.text.is_char_boundary(start) {
            start -= 1;
        }
        let (before, after) = self.text.split_at(start);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let line_end = after.find('\n').map_or(self.text.len(), |at| start + at);
        let line = self.text.get(line_start..line_end).unwrap_or_default().trim_end_matches('\r');
        let from = (start - line_start).min(line.len());
        let mut to = range.end.saturating_sub(line_start).clamp(from, line.len());
        while !line.is_char_boundary(to) {
            to += 1;
        }
        Place {
            file: Some(self.name.to_string()),
            line: Some(1 + before.matches('\n').count()),
            column: Some(1 + before.get(line_start..).unwrap_or_default().chars().count()),
            key: key.map(str::to_string),
            excerpt: (line.len() <= EXCERPT_LIMIT).then(|| Excerpt {
                line: line.into(),
                start: from,
                end: to,
            }),
        }
    }

    /// An [`ErrorKind::Invalid`] at `key`.
    pub fn error(&self, key: &str, message: impl Into<String>) -> Error {
        Error::invalid(message).at(self.place(key))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(text: &str) -> Document {
        Document::from_bytes(text.as_bytes(), "s.toml").unwrap()
    }

    #[test]
    fn keys_have_places() {
        let text = "\u{feff}[a]\r\nb = { c = [1, 2] }\n[[mesh]]\n[[mesh]]\n  path = \"é\" # x\n";
        let document = document(text);
        let place = document.place("a.b.c[1]");
        assert_eq!((place.line, place.column), (Some(2), Some(15)));
        let excerpt = place.excerpt.unwrap();
        assert_eq!(&excerpt.line[excerpt.start..excerpt.end], "2");
        let place = document.place("mesh[1].path");
        assert_eq!((place.line, place.key.as_deref()), (Some(5), Some("mesh[1].path")));
        assert_eq!(document.place("mesh[1].scale").line, Some(4), "the table's header");
        assert_eq!(document.place("a.nothing").line, Some(1));
        assert_eq!(document.place("none").line, None);
        for odd in ["", ".", "[", "]", "mesh[9]", "mesh[x]", "[0]", "a.b.c[1].d"] {
            document.place(odd);
        }
    }

    #[test]
    fn broken_text_is_a_clear_error() {
        let error = document("[camera]\nx = = 1\n").table().unwrap_err();
        assert_eq!(error.place().line, Some(2), "{error}");
        assert!(error.to_string().starts_with("s.toml:2:"), "{error}");
        let error = Document::from_bytes(b"a = 1\nb = \"\xff\"\n", "s.toml").unwrap_err();
        assert!(error.to_string().starts_with("s.toml:2: not UTF-8"), "{error}");
        let error = Document::from_bytes(&vec![b'#'; SIZE_LIMIT + 1], "s.toml").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TooLarge);
    }

    #[test]
    fn depth_and_length_do_not_crash() {
        let million = 1_000_000;
        for text in [
            format!("a = {}", "[".repeat(million)),
            format!("a = {}{}", "[".repeat(million), "]".repeat(million)),
            format!("a = {}", "{a=".repeat(million)),
            format!("{}a = 1", "a.".repeat(million)),
            format!("[{}a]", "a.".repeat(million)),
            format!("[[{}a]]", "a.".repeat(million)),
            format!("a = \"{}", "x".repeat(million)),
            format!("a = {}", "9".repeat(million)),
            "=".repeat(million),
            "\0".repeat(million),
        ] {
            let document = document(&text);
            if let Err(error) = document.table() {
                assert!(error.to_string().len() < 1000, "{error:.200}");
            }
        }
    }
}
