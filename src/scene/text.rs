//! OBJ and MTL as text: bytes in, statements with their line numbers out.
//!
//! Mended here, because the format allows it or exporters write it: LF, CRLF or CR, also side by side, a UTF-8 byte order mark,
//! a back slash that continues a line (not in comments, nor after a name with a statement below it: Windows paths end in one), bytes
//! that are not UTF-8 (read as Latin-1, so that a name is the same in the OBJ and in its MTL), numbers that are none as C writes them.

use std::borrow::Cow;

use crate::error::{Error, ErrorKind, Result};
use memchr::{memchr, memchr_iter, memchr2};

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
        let end = if rest.contains('#') { comment(rest) } else { rest.len() };
        rest[..end].split(is_space).filter(|word| !word.is_empty())
    }
}

fn is_space(c: char) -> bool {
    c.is_whitespace()
}

/// Where a comment begins: what follows the sign in a number that is none is none.
fn comment(rest: &str) -> usize {
    let word = |at: usize| at - rest[..at].rsplit(is_space).next().unwrap_or_default().len();
    let begins = |&(at, _): &(usize, &str)| !is_not_finite(&rest[word(at)..]);
    rest.match_indices('#').find(begins).map_or(rest.len(), |(at, _)| at)
}

/// Whether words begin with a number that is infinite or none, as Microsoft's C library writes it (`-1.#IND`).
fn is_not_finite(words: &str) -> bool {
    let digits = words.trim_start_matches(['+', '-']).trim_start_matches(|c: char| c.is_ascii_digit());
    digits
        .strip_prefix(".#")
        .is_some_and(|kind| ["QNAN", "SNAN", "IND", "INF"].iter().any(|&one| kind.starts_with(one)))
}

/// A number as Rust and `tobj` read it: one that is infinite or none may be written as C does it (`1.#INF`, `-nan(ind)`). None for
/// what is no number.
pub(crate) fn number(word: &str) -> Option<&str> {
    if word.parse::<f64>().is_ok() {
        return Some(word);
    }
    let unsigned = word.trim_start_matches(['+', '-']);
    if unsigned.starts_with("nan(") && unsigned.ends_with(')') {
        return Some("nan");
    }
    let is_infinite = || word.contains(".#INF");
    is_not_finite(word).then(|| match (is_infinite(), word.starts_with('-')) {
        (false, _) => "nan",
        (true, false) => "inf",
        (true, true) => "-inf",
    })
}

/// A name with a `#` in it, or a name and a comment? Both readings, the longer first, then the shorter if it differs.
pub(crate) fn readings(rest: &str) -> impl Iterator<Item = &str> {
    let comment = rest
        .char_indices()
        .find(|&(at, c)| c == '#' && rest[..at].chars().next_back().is_none_or(char::is_whitespace));
    let short = comment.map(|(at, _)| rest[..at].trim_end());
    // Colours are names too (`#ff0000`).
    let is_comment = rest.strip_prefix('#').is_some_and(|after| after.chars().next().is_none_or(is_space));
    let long = (!is_comment).then_some(rest);
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
    let has_feeds = memchr(b'\n', bytes).is_some();
    let is_alone = |at: usize| !matches!(bytes.get(at + 1), Some(b'\r' | b'\n'));
    let has_returns = memchr_iter(b'\r', bytes).any(is_alone);
    Ok(Statements { bytes, at: 0, line: 0, has_feeds, has_returns, is_counted: true, overlong: None })
}

/// Iterator over [`Statement`]s.
#[derive(Debug)]
pub(crate) struct Statements<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    /// A lone carriage return ends a statement, and no line of a file that has others, as editors count them.
    has_feeds: bool,
    /// There are lone ones: asked once, since looking for both takes a sixth more of the time of loading.
    has_returns: bool,
    /// What comes next begins a line.
    is_counted: bool,
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
        self.line += usize::from(self.is_counted);
        // Looked for no farther than is taken: the rest of a disk full of zeros need not be read.
        let window = &rest[..rest.len().min(LINE_LIMIT + 1)];
        let end = if self.has_returns { memchr2(b'\n', b'\r', window) } else { memchr(b'\n', window) };
        let end = end.unwrap_or(window.len());
        if end > LINE_LIMIT {
            self.overlong = Some(self.line);
            self.at = self.bytes.len();
            return None;
        }
        let line = &rest[..end];
        if !self.has_returns {
            self.at += end + 1;
            return Some(line);
        }
        // Old Macs ended lines with a carriage return. Before a line feed one belongs to it, or several do.
        let returns = rest[end..].iter().take_while(|&&byte| byte == b'\r').count();
        let is_feed = rest.get(end + returns) == Some(&b'\n');
        self.at += end + if is_feed { returns + 1 } else { 1 };
        self.is_counted = is_feed || !self.has_feeds;
        Some(line)
    }

    /// Whether the next line begins as a statement does.
    fn is_statement_next(&self) -> bool {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let window = &rest[..rest.len().min(256)];
        let line = window.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default();
        let word = line.trim_ascii().split(u8::is_ascii_whitespace).next().unwrap_or_default();
        KEYWORDS.iter().any(|keyword| keyword.as_bytes() == word)
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
            let begun = continued(first).filter(|_| !(is_named(first) && self.is_statement_next()));
            let text = match begun {
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

/// What statements begin with: words that are seldom a part of a name.
const KEYWORDS: [&str; 29] = [
    "v", "vt", "vn", "vp", "f", "fo", "l", "p", "o", "g", "s", "usemtl", "mtllib", "newmtl", "Ka", "Kd",
    "Ks", "Ke", "Ns", "Ni", "Tf", "Tr", "d", "illum", "map_Ka", "map_Kd", "map_Ks", "map_d", "#",
];

/// Whether a statement ends in a name.
fn is_named(line: &[u8]) -> bool {
    let keyword = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    keyword.starts_with(b"map_") || [&b"o"[..], b"g", b"usemtl", b"newmtl", b"mtllib"].contains(&keyword)
}

/// What a line that goes on with the next says itself; none for one that ends with its end, as one with a comment does: Windows paths
/// end in a back slash.
fn continued(line: &[u8]) -> Option<&[u8]> {
    let begun = line.strip_suffix(b"\\")?;
    // Names may hold the sign; numbers do not.
    let keyword = line.split(|byte| byte.is_ascii_whitespace()).next();
    let is_numbers = keyword.is_some_and(|word| [&b"v"[..], b"vt", b"vn", b"f"].contains(&word));
    let is_comment = |at: usize| is_numbers || at == 0 || line[at - 1].is_ascii_whitespace();
    (!memchr_iter(b'#', line).any(is_comment)).then_some(begun)
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
    fn line_ends_may_differ_from_line_to_line() {
        let lines =
            |bytes: &[u8]| all(bytes).into_iter().map(|(line, word, _)| (line, word)).collect::<Vec<_>>();
        let of = |list: &[(usize, &str)]| {
            list.iter().map(|&(line, word)| (line, word.to_owned())).collect::<Vec<_>>()
        };
        assert_eq!(
            lines(b"# red\rusemtl r\nv 1\r\nf 1\r\r\nl 1"),
            of(&[(1, "usemtl"), (2, "v"), (3, "f"), (4, "l")])
        );
        assert_eq!(lines(b"v 1\r\rf 1\r\n\r\nl 1\n"), of(&[(1, "v"), (1, "f"), (3, "l")]));
    }

    #[test]
    fn a_name_that_ends_in_a_back_slash_swallows_no_statement() {
        let words = |bytes: &[u8]| {
            let list = statements(bytes).expect("not UTF-16");
            list.map(|s| format!("{}:{}", s.line, s.rest())).collect::<Vec<_>>()
        };
        assert_eq!(words(b"o C:\\models\\\nusemtl r\n"), ["1:C:\\models\\", "2:r"]);
        assert_eq!(words(b"usemtl \x95\\\r\n  f 1 2 3"), ["1:\u{95}\\", "2:1 2 3"]);
        // One that goes on does so.
        assert_eq!(words(b"g one \\\ntwo\nf 1 \\\nv 2"), ["1:one  two", "3:1  v 2"]);
    }

    #[test]
    fn numbers_that_are_none_are_read_as_c_writes_them() {
        let spelled = ["1.#QNAN", "-1.#IND", "1.#IND00", "-nan(ind)", "nan(snan)", "1.#INF", "-1.#INF00"];
        assert_eq!(spelled.map(number), ["nan", "nan", "nan", "nan", "nan", "inf", "-inf"].map(Some));
        assert_eq!(
            ["1.5", "nan", "0#c", "1.#", "1.#X", "x"].map(number),
            [Some("1.5"), Some("nan"), None, None, None, None]
        );
        let v = "v".to_owned();
        let words = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>();
        assert_eq!(
            all(b"v 0 1.#QNAN -1.#IND # c\nv 0#c 1.#INF\nv 1.# 2"),
            [
                (1, v.clone(), words(&["0", "1.#QNAN", "-1.#IND"])),
                (2, v.clone(), words(&["0"])),
                (3, v, words(&["1."]))
            ]
        );
    }

    #[test]
    fn a_name_may_hold_a_hash() {
        assert_eq!(readings("wall #2 # old").collect::<Vec<_>>(), ["wall #2 # old", "wall"]);
        assert_eq!(readings("a#b").collect::<Vec<_>>(), ["a#b"]);
        assert_eq!(readings("# none").collect::<Vec<_>>(), [""]);
        assert_eq!(readings("#").collect::<Vec<_>>(), [""]);
        assert_eq!(readings("#ff0000").collect::<Vec<_>>(), ["#ff0000", ""]);
        assert_eq!(readings("").collect::<Vec<_>>(), [""]);
    }
}
