//! OBJ and MTL as text: bytes in, statements with their line numbers out.
//!
//! Mended here, because the format allows it or exporters write it: LF, CRLF or CR, a UTF-8 byte order mark,
//! a back slash that continues a line (not in comments: Windows paths end in one), bytes that are not UTF-8
//! (read as Latin-1, so that a name is the same in the OBJ and in its MTL).

use std::borrow::Cow;

use crate::error::{Error, ErrorKind, Result};
use memchr::memchr;

/// Longest line, continued ones joined, in bytes: a face with a million corners has a third of it.
const LINE_LIMIT: usize = 64 << 20;

/// One statement: its continued lines joined, trimmed, never empty, never a comment.
#[derive(Debug)]
pub(crate) struct Statement<'a> {
    /// Line on which it starts, from 1.
    pub(crate) line: usize,
    text: Cow<'a, str>,
}

impl Statement<'_> {
    /// The first word.
    pub(crate) fn keyword(&self) -> &str {
        self.text.split(is_space).next().unwrap_or_default()
    }

    /// All after the first word, trimmed; may end in a comment.
    pub(crate) fn rest(&self) -> &str {
        self.text[self.keyword().len()..].trim_matches(is_space)
    }

    /// The words after the first, up to a comment.
    pub(crate) fn operands(&self) -> impl Iterator<Item = &str> {
        let rest = self.rest();
        let end = rest.find('#').unwrap_or(rest.len());
        rest[..end].split(is_space).filter(|word| !word.is_empty())
    }
}

fn is_space(c: char) -> bool {
    c.is_whitespace()
}

/// A name with a `#` in it, or a name and a comment? Both readings, the longer first, then the shorter if it differs.
pub(crate) fn readings(rest: &str) -> impl Iterator<Item = &str> {
    let comment = rest
        .char_indices()
        .find(|&(at, c)| c == '#' && rest[..at].chars().next_back().is_none_or(char::is_whitespace));
    let short = comment.map(|(at, _)| rest[..at].trim_end());
    let long = (!rest.starts_with('#')).then_some(rest);
    long.into_iter().chain(short)
}

/// A material's name, runs of white space as one space.
pub(crate) fn squeezed(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The statements of a file.
///
/// # Errors
/// For UTF-16, which no reader of the format takes.
pub(crate) fn statements(bytes: &[u8]) -> Result<Statements<'_>> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(Error::invalid("this is UTF-16 text").remedy("save it as UTF-8"));
    }
    let bytes = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
    // Only a file without any line feed is taken to end its lines with carriage returns, as old Macs did.
    let end = if memchr(b'\n', bytes).is_some() { b'\n' } else { b'\r' };
    Ok(Statements { bytes, at: 0, line: 0, end, overlong: None })
}

/// Iterator over [`Statement`]s.
#[derive(Debug)]
pub(crate) struct Statements<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    end: u8,
    overlong: Option<usize>,
}

impl<'a> Statements<'a> {
    /// Bytes read so far.
    pub(crate) fn position(&self) -> usize {
        self.at
    }

    /// To be asked after the last statement.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] with the line when one was longer than any writer makes it; reading ended there.
    pub(crate) fn finish(&self) -> Result<()> {
        let Some(line) = self.overlong else { return Ok(()) };
        let message = format!("a line is longer than {} MiB", LINE_LIMIT >> 20);
        Err(Error::new(ErrorKind::TooLarge, message)
            .at_line(line)
            .remedy("check that this is the file meant"))
    }

    fn next_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        self.line += 1;
        // Looked for no farther than is taken: the rest of a disk full of zeros need not be read.
        let window = &rest[..rest.len().min(LINE_LIMIT + 1)];
        let end = memchr(self.end, window).unwrap_or(window.len());
        if end > LINE_LIMIT {
            self.overlong = Some(self.line);
            self.at = self.bytes.len();
            return None;
        }
        let line = &rest[..end];
        self.at += end + 1;
        Some(line)
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        loop {
            let first = self.next_line()?.trim_ascii();
            let line = self.line;
            if first.is_empty() || first.starts_with(b"#") {
                continue;
            }
            let text = match continued(first) {
                None => decoded(first),
                Some(begun) => {
                    let mut whole = begun.to_vec();
                    while let Some(next) = self.next_line() {
                        let next = next.trim_ascii();
                        if whole.len() + next.len() > LINE_LIMIT {
                            self.overlong = Some(line);
                            self.at = self.bytes.len();
                            return None;
                        }
                        let end = continued(next);
                        whole.push(b' ');
                        whole.extend_from_slice(end.unwrap_or(next));
                        if end.is_none() {
                            break;
                        }
                    }
                    Cow::Owned(decoded(&whole).into_owned())
                }
            };
            let text = match text {
                Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
                Cow::Owned(text) => Cow::Owned(text.trim().to_owned()),
            };
            if !text.is_empty() && !text.starts_with('#') {
                return Some(Statement { line, text });
            }
        }
    }
}

/// What a line that goes on with the next says itself; none for one that ends with its end, as one with a comment does: Windows paths
/// end in a back slash.
fn continued(line: &[u8]) -> Option<&[u8]> {
    let begun = line.strip_suffix(b"\\")?;
    // Names may hold the sign; numbers do not.
    let keyword = line.split(|byte| byte.is_ascii_whitespace()).next();
    let is_numbers = keyword.is_some_and(|word| [&b"v"[..], b"vt", b"vn", b"f"].contains(&word));
    let is_comment = |at: usize| is_numbers || at == 0 || line[at - 1].is_ascii_whitespace();
    (!memchr::memchr_iter(b'#', line).any(is_comment)).then_some(begun)
}

fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<(usize, String, Vec<String>)> {
        statements(bytes)
            .expect("not UTF-16")
            .map(|s| (s.line, s.keyword().to_owned(), s.operands().map(str::to_owned).collect()))
            .collect()
    }

    #[test]
    fn statements_are_mended_and_keep_their_lines() {
        let text = b"\xef\xbb\xbfv 1 2 3\r\n# c:\\\r\n\tf 1 2 \\\r\n 3 # end\nusemtl caf\xe9\n\\\nf";
        let (v, f) = ("v".to_owned(), "f".to_owned());
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(
            all(text),
            [
                (1, v, words("1 2 3")),
                (3, f.clone(), words("1 2 3")),
                (5, "usemtl".to_owned(), words("caf\u{e9}")),
                (6, f, vec![]),
            ]
        );
        assert_eq!(all(b"# old Mac\rv 1\r"), [(2, "v".to_owned(), vec!["1".to_owned()])]);
        assert!(statements(b"\xff\xfev\0").is_err());
    }

    #[test]
    fn a_name_may_hold_a_hash() {
        assert_eq!(readings("wall #2 # old").collect::<Vec<_>>(), ["wall #2 # old", "wall"]);
        assert_eq!(readings("a#b").collect::<Vec<_>>(), ["a#b"]);
        assert_eq!(readings("# none").collect::<Vec<_>>(), [""]);
        assert_eq!(readings("").collect::<Vec<_>>(), [""]);
    }
}
