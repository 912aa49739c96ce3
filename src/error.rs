//! The one error type: what went wrong, where (file, line, column, key) and what to do about it.

use std::fmt;

/// A result with the crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What class of failure an [`Error`] is. The program maps each to an exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A scene, figure or asset is wrong, missing or refused (exit code 2).
    Invalid,
    /// The question has no answer: no movement of the camera does what was asked (exit code 2).
    NoSolution,
    /// More memory is asked for than there is or than was allowed (exit code 2).
    TooLarge,
    /// A file that exists cannot be read, or output cannot be written (exit code 3).
    Io,
    /// Wrong usage: options that exclude each other, or an argument that cannot be read (exit code 64).
    Usage,
    /// Stopped on request before it was done (exit code 75).
    Cancelled,
}

/// What the system says of a failure, without the "(os error 13)" at its end.
pub(crate) fn reason(failure: &impl fmt::Display) -> String {
    let text = failure.to_string();
    text.split(" (os error").next().unwrap_or_default().to_lowercase()
}

/// An amount of memory in words: `350 MB`, `2.9 GB`.
pub(crate) fn memory(bytes: u64) -> String {
    match bytes as f64 {
        bytes if bytes < 9.95e5 => format!("{:.0} kB", bytes / 1e3),
        bytes if bytes < 9.95e8 => format!("{:.0} MB", bytes / 1e6),
        bytes => format!("{:.1} GB", bytes / 1e9),
    }
}

/// The line of a text that an error points at, with the range to mark.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// The whole line, without its end.
    pub line: String,
    /// First byte of the marked range in `line`.
    pub start: usize,
    /// One past the last byte of the marked range in `line`.
    pub end: usize,
}

/// Where in the input an error or warning lies. Every part is optional.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The file as the user named it.
    pub file: Option<String>,
    /// Line, counted from 1.
    pub line: Option<usize>,
    /// Column in characters, counted from 1.
    pub column: Option<usize>,
    /// The key, in dotted form: `camera.front.tilt_deg`.
    pub key: Option<String>,
    /// The offending line itself.
    pub excerpt: Option<Excerpt>,
}

/// The crate's error. It prints as `place: message; remedy`, also as `Debug`: that is what a `main` shows which returns it.
#[derive(Clone)]
pub struct Error(Box<Inner>);

#[derive(Clone)]
struct Inner {
    kind: ErrorKind,
    message: String,
    place: Place,
    remedy: Option<String>,
}

impl Error {
    /// An error of `kind`; `message` is a clause without a full stop.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self(Box::new(Inner { kind, message: message.into(), place: Place::default(), remedy: None }))
    }

    /// Shorthand for [`ErrorKind::Invalid`].
    pub fn invalid(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Invalid, message)
    }

    /// Shorthand for [`ErrorKind::NoSolution`].
    pub fn no_solution(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::NoSolution, message)
    }

    /// Names the file, unless one is named already.
    #[must_use]
    pub fn in_file(mut self, file: impl Into<String>) -> Self {
        self.0.place.file.get_or_insert_with(|| file.into());
        self
    }

    /// Names the line (from 1), unless one is named already.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.0.place.line.get_or_insert(line);
        self
    }

    /// Names the key, unless one is named already.
    #[must_use]
    pub fn at_key(mut self, key: impl Into<String>) -> Self {
        self.0.place.key.get_or_insert_with(|| key.into());
        self
    }

    /// Replaces the whole place.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.0.place = place;
        self
    }

    /// Says what to do about it; a clause without a full stop.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.0.remedy = Some(remedy.into());
        self
    }

    /// The class of the failure.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// What went wrong, without place and remedy.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// Where it went wrong.
    pub fn place(&self) -> &Place {
        &self.0.place
    }

    /// What to do, if the error knows.
    pub fn remedy_text(&self) -> Option<&str> {
        self.0.remedy.as_deref()
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        if let Some(file) = &self.file {
            write!(f, "{file}")?;
            separator = ":";
        }
        if let Some(line) = self.line {
            let word = if self.file.is_some() { "" } else { "line " };
            write!(f, "{separator}{word}{line}")?;
            if let Some(column) = self.column {
                write!(f, ":{column}")?;
            }
            separator = ": ";
        } else if !separator.is_empty() {
            separator = ": ";
        }
        if let Some(key) = &self.key {
            write!(f, "{separator}{key}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.place().to_string();
        if !place.is_empty() {
            write!(f, "{place}: ")?;
        }
        write!(f, "{}", self.message())?;
        if let Some(remedy) = self.remedy_text() {
            write!(f, "; {remedy}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {}

impl From<std::io::Error> for Error {
    fn from(failure: std::io::Error) -> Self {
        Self::new(ErrorKind::Io, reason(&failure))
    }
}

/// Something that the input asks for and that was dropped or replaced; the work goes on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file it concerns, as the user or the naming file wrote it.
    pub file: String,
    /// Line, counted from 1, where there is one.
    pub line: Option<usize>,
    /// What was dropped or replaced, and by what.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_prints_place_message_and_remedy() {
        let error = Error::invalid("unknown key `tillt_deg`")
            .in_file("scene.toml")
            .at_line(3)
            .at_key("camera.front")
            .remedy("did you mean `tilt_deg`?");
        assert_eq!(
            error.to_string(),
            "scene.toml:3: camera.front: unknown key `tillt_deg`; did you mean `tilt_deg`?"
        );
        assert_eq!(format!("{error:?}"), error.to_string());
        assert_eq!(Error::invalid("zero").at_line(2).to_string(), "line 2: zero");
        let failure = Error::from(std::io::Error::from(std::io::ErrorKind::NotFound));
        assert_eq!((failure.kind(), failure.message()), (ErrorKind::Io, "entity not found"));
    }
}
