//! What the program says. Errors and warnings go to standard error, with the offending line where there is
//! one; text goes to standard output. A reader that has closed its end is no error.

use super::limited::may_write;
use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use groundglass::error::{Error, ErrorKind, Result, Warning};
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

/// Something is stale.
pub(super) const STALE: u8 = 1;
/// Wrong usage.
const USAGE: u8 = 64;
/// Stopped by INT or TERM.
pub(super) const INTERRUPTED: u8 = 75;

/// Prints lines of words to standard output, all of them or as many as the reader wants.
///
/// # Errors
/// [`ErrorKind::Io`] when they cannot be written, a closed pipe excepted.
pub(super) fn print(text: &str) -> Result<()> {
    let words: String =
        text.chars().map(|c| if matches!(c, '\n' | '\t') { c } else { harmless(c) }).collect();
    write(&words)
}

fn write(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    if !may_write(&out, text.len()) {
        return Err(full(&io::ErrorKind::FileTooLarge.into()));
    }
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(full(&error)),
        _ => Ok(()),
    }
}

/// An error of a picture in words: four decimals, or two digits where these would show hardly any.
pub(super) fn rms(error: f64) -> String {
    if error == 0.0 || error >= 0.001 { format!("{error:.4}") } else { format!("{error:.1e}") }
}

/// Prints a value as JSON, every number so that it reads back exactly.
///
/// # Errors
/// As [`print`].
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Error::new(ErrorKind::Io, format!("cannot be written as JSON: {error}")))?;
    text.push('\n');
    write(&text)
}

/// Reports an error and gives its exit code.
pub(super) fn failure(error: &Error) -> ExitCode {
    say(&rendered(error, is_colourful()));
    ExitCode::from(code(error.kind()))
}

/// Reports what the argument parser has to say: an error, or the help or version that was asked for.
pub(super) fn usage(error: &clap::Error) -> ExitCode {
    let printed = error.print().and_then(|()| io::stdout().flush());
    if error.use_stderr() {
        // Nobody can be told that standard error is closed.
        return ExitCode::from(USAGE);
    }
    match printed {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => failure(&full(&error)),
        _ => ExitCode::SUCCESS,
    }
}

fn full(error: &io::Error) -> Error {
    Error::new(
        ErrorKind::Io,
        format!(
            "cannot write to standard output: {}",
            error.to_string().split(" (os error").next().unwrap_or_default()
        ),
    )
    .remedy("see what it leads to: a full disk, or a program that has ended")
}

/// Reports warnings, one line each.
pub(super) fn warnings(warnings: &[Warning]) {
    for warning in warnings {
        say(&printable(&format!("warning: {warning}")));
    }
}

/// The exit code for a class of failure.
pub(super) fn code(kind: ErrorKind) -> u8 {
    match kind {
        ErrorKind::Io => 3,
        ErrorKind::Usage => USAGE,
        ErrorKind::Cancelled => INTERRUPTED,
        // Invalid, NoSolution, TooLarge, and what may come: the input is at fault.
        _ => 2,
    }
}

fn is_colourful() -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    io::stderr().is_terminal() && !refused && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// A line on standard error.
pub(super) fn say(text: &str) {
    let mut out = io::stderr().lock();
    // Standard error may be closed or full; there is nobody left to tell.
    if may_write(&out, text.len() + 1) {
        let _ = writeln!(out, "{text}");
    }
}

/// `error: place: message`, the line with the range marked, and the remedy.
fn rendered(error: &Error, colour: bool) -> String {
    let place = error.place();
    let (Some(excerpt), Some(line)) = (&place.excerpt, place.line) else {
        return printable(&format!("error: {error}"));
    };
    let mut title = place.to_string();
    title.push_str(": ");
    title.push_str(error.message());
    let start = excerpt.start.min(excerpt.line.len());
    let end = excerpt.end.clamp(start, excerpt.line.len());
    // The range counts bytes of the line, so each character is replaced by one of the same length.
    let source: String = excerpt.line.chars().map(|c| if c == '\t' { c } else { harmless(c) }).collect();
    let range =
        if source.is_char_boundary(start) && source.is_char_boundary(end) { start..end } else { 0..0 };
    let snippet = Snippet::source(source).line_start(line).annotation(AnnotationKind::Primary.span(range));
    let mut group = Group::with_title(Level::ERROR.primary_title(printable(&title))).element(snippet);
    if let Some(remedy) = error.remedy_text() {
        group = group.element(Level::HELP.message(printable(remedy)));
    }
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    renderer.decor_style(DecorStyle::Ascii).render(&[group])
}

/// Without control characters: names and texts of files must not drive the terminal.
fn printable(text: &str) -> String {
    text.chars().map(harmless).collect()
}

/// The character, or one of the same length in UTF-8 for a control character or one that reorders text.
fn harmless(c: char) -> char {
    match c {
        '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => '\u{fffd}',
        _ if c.is_control() && c.is_ascii() => '?',
        _ if c.is_control() => '\u{b7}',
        _ => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> String {
        rendered(&groundglass::scene::parse(text, "s.toml").unwrap_err(), false)
    }

    #[test]
    fn the_line_is_shown_and_marked() {
        let shown = parsed("[camera]\n\ttillt = \"é\"\n");
        assert!(shown.starts_with("error: s.toml:2:2: camera.tillt: unknown key `tillt`"), "{shown}");
        assert!(
            shown.contains("tillt = \"é\"") && shown.contains("^^^^^") && shown.contains("help: "),
            "{shown}"
        );
        assert!(!shown.contains('\u{1b}'), "{shown}");
    }

    #[test]
    fn control_characters_do_not_reach_the_terminal() {
        for text in
            ["\u{1b}[31m = 1\n", "a = \"\u{7}\"\n", "\"\\u001b[31m\" = 1\n", "\u{9b}x = 1", "\u{202e}x = 1"]
        {
            let shown = parsed(text);
            assert!(!shown.contains(|c: char| (c.is_control() && c != '\n') || c == '\u{202e}'), "{shown:?}");
        }
    }

    #[test]
    fn each_class_has_the_contracts_exit_code() {
        let codes = [
            (ErrorKind::Invalid, 2),
            (ErrorKind::NoSolution, 2),
            (ErrorKind::TooLarge, 2),
            (ErrorKind::Io, 3),
            (ErrorKind::Usage, 64),
            (ErrorKind::Cancelled, 75),
        ];
        for (kind, expected) in codes {
            assert_eq!(code(kind), expected);
        }
    }
}
