//! The one door to files: a name as somebody wrote it in, bytes out. Nothing else in the crate opens a file to read.
//!
//! Three kinds of names, by who wrote them, and what each may reach:
//!
//! | written by | method | may be |
//! |---|---|---|
//! | the person at the command line | [`Source::argument`] | any regular file |
//! | a scene or figure file | [`Source::named`] | a relative path to a regular file, `..` allowed |
//! | an OBJ or MTL | [`Source::asset`] | a regular file under one of the given folders, links resolved |
//!
//! With a root folder ([`Files::under`]) each of them must lie in that folder besides, links resolved.
//! Folders, devices, pipes and sockets are never opened, URLs are never fetched.
//! What is missing or refused is [`ErrorKind::Invalid`], what is there but cannot be read [`ErrorKind::Io`],
//! what is too long [`ErrorKind::TooLarge`].

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use crate::error::{Error, ErrorKind, Result};

/// Where files come from. Paths that the finding methods return are the files' one true name (links resolved),
/// fit for [`Source::read`], for comparison, and, by [`Path::parent`], as the folder of further names.
pub trait Source: Send + Sync {
    /// Finds the file that the user named.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`] when it is missing or no regular file; [`ErrorKind::Io`] when it cannot be reached.
    fn argument(&self, path: &Path) -> Result<PathBuf>;

    /// Finds the file that a scene or figure file in `folder` names as `written`.
    ///
    /// # Errors
    /// As [`Source::argument`]; also [`ErrorKind::Invalid`] for an absolute path or a URL.
    fn named(&self, folder: &Path, written: &str) -> Result<PathBuf>;

    /// Finds the file that an OBJ or MTL in `folder` names as `written` (back slashes count as slashes);
    /// it must lie under one of `fences`.
    ///
    /// # Errors
    /// As [`Source::argument`]; also [`ErrorKind::Invalid`] outside the fences or for a URL.
    fn asset(&self, folder: &Path, written: &str, fences: &[PathBuf]) -> Result<PathBuf>;

    /// Reads a file that one of the above found.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] when it cannot be read, [`ErrorKind::TooLarge`] above `limit` bytes.
    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>>;
}

/// The file system, all of it or only what lies under one folder.
#[derive(Clone, Debug, Default)]
pub struct Files {
    root: Option<PathBuf>,
}

impl Files {
    /// All files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Only files under `root`, links resolved: for documents that others wrote.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`] when `root` is missing or no folder.
    pub fn under(root: &Path) -> Result<Self> {
        let shown = root.display().to_string();
        let found = fs::canonicalize(root).map_err(|e| explain(&e, &shown))?;
        if !found.is_dir() {
            return Err(Error::invalid(format!("the root `{shown}` is not a folder")));
        }
        Ok(Self { root: Some(found) })
    }

    fn settle(&self, path: &Path, written: &str, fences: Option<&[PathBuf]>) -> Result<PathBuf> {
        let found = fs::canonicalize(path).map_err(|e| explain(&e, written))?;
        if let Some(root) = &self.root
            && !found.starts_with(root)
        {
            return Err(Error::invalid(format!(
                "`{written}` lies outside the root folder, so it is not opened"
            ))
            .remedy(format!("move it under `{}` or choose another root", root.display())));
        }
        if let Some(fences) = fences {
            let inside =
                |fence: &PathBuf| fs::canonicalize(fence).is_ok_and(|fence| found.starts_with(fence));
            if !fences.iter().any(inside) {
                return Err(outside(written));
            }
        }
        let kind = fs::metadata(&found).map_err(|e| explain(&e, written))?;
        regular(&kind, written)?;
        Ok(found)
    }
}

impl Source for Files {
    fn argument(&self, path: &Path) -> Result<PathBuf> {
        self.settle(path, &path.display().to_string(), None)
    }

    fn named(&self, folder: &Path, written: &str) -> Result<PathBuf> {
        let name = relative(written)?;
        self.settle(&joined(folder, &name), written, None)
    }

    fn asset(&self, folder: &Path, written: &str, fences: &[PathBuf]) -> Result<PathBuf> {
        let name = slashed(written)?;
        self.settle(&joined(folder, &name), written, Some(fences))
    }

    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>> {
        let shown = file.display().to_string();
        let open = || -> io::Result<(fs::Metadata, fs::File)> {
            let mut options = fs::OpenOptions::new();
            options.read(true);
            // A pipe put in the file's place since it was found must not hang us before the check below.
            #[cfg(unix)]
            std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK | libc::O_NOCTTY);
            let handle = options.open(file)?;
            Ok((handle.metadata()?, handle))
        };
        let unreadable =
            |e: io::Error| Error::new(ErrorKind::Io, format!("cannot read `{shown}`: {}", reason(&e)));
        regular(&fs::metadata(file).map_err(unreadable)?, &shown)?;
        let (kind, handle) = open().map_err(unreadable)?;
        regular(&kind, &shown)?;
        if kind.len() > limit {
            return Err(too_long(&shown, limit));
        }
        let mut bytes = Vec::new();
        let wanted = usize::try_from(kind.len()).unwrap_or(usize::MAX);
        bytes.try_reserve_exact(wanted).map_err(|_| {
            Error::new(ErrorKind::TooLarge, format!("there is not enough memory to read `{shown}`"))
        })?;
        handle.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() as u64 > limit {
            return Err(too_long(&shown, limit));
        }
        Ok(Cow::Owned(bytes))
    }
}

/// Files held in memory, under relative names with slashes: built-in scenes, the web page, tests.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, Cow<'static, [u8]>>,
}

impl Memory {
    /// No files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds or replaces a file; `name` as in `scenes/tower.obj`.
    #[must_use]
    pub fn with(mut self, name: &str, bytes: impl Into<Cow<'static, [u8]>>) -> Self {
        if let Some(path) = flattened(Path::new(name)) {
            self.files.insert(path, bytes.into());
        }
        self
    }

    fn settle(&self, path: &Path, written: &str) -> Result<PathBuf> {
        let path = flattened(path).ok_or_else(|| outside(written))?;
        if self.files.contains_key(&path) {
            return Ok(path);
        }
        if self.files.keys().any(|file| file.starts_with(&path)) {
            return Err(Error::invalid(format!("`{written}` is a folder, not a file")));
        }
        Err(missing(written))
    }
}

impl Source for Memory {
    fn argument(&self, path: &Path) -> Result<PathBuf> {
        self.settle(path, &path.display().to_string())
    }

    fn named(&self, folder: &Path, written: &str) -> Result<PathBuf> {
        let name = relative(written)?;
        self.settle(&joined(folder, &name), written)
    }

    fn asset(&self, folder: &Path, written: &str, fences: &[PathBuf]) -> Result<PathBuf> {
        let name = slashed(written)?;
        let path = flattened(&joined(folder, &name)).ok_or_else(|| outside(written))?;
        let inside = |fence: &PathBuf| flattened(fence).is_some_and(|fence| path.starts_with(fence));
        if !fences.iter().any(inside) {
            return Err(outside(written));
        }
        self.settle(&path, written)
    }

    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>> {
        let shown = file.display().to_string();
        let bytes = self.files.get(file).ok_or_else(|| missing(&shown))?;
        if bytes.len() as u64 > limit {
            return Err(too_long(&shown, limit));
        }
        Ok(Cow::Borrowed(bytes))
    }
}

/// `written` with slashes, if it can be a file's name at all.
fn slashed(written: &str) -> Result<String> {
    let name = written.trim().replace('\\', "/");
    if name.is_empty() {
        return Err(Error::invalid("a file name is empty"));
    }
    if name.contains("://") {
        return Err(Error::invalid(format!("`{written}` is a URL; nothing is fetched from the network"))
            .remedy("save it as a file and name that"));
    }
    Ok(name)
}

/// `written` with slashes, if it is a relative path.
fn relative(written: &str) -> Result<String> {
    let name = slashed(written)?;
    let drive = name.as_bytes().get(1) == Some(&b':') && name.as_bytes()[0].is_ascii_alphabetic();
    if drive || name.starts_with('/') || Path::new(&name).is_absolute() {
        return Err(Error::invalid(format!("`{written}` is an absolute path"))
            .remedy("write it relative to the file that names it"));
    }
    Ok(name)
}

/// `folder/name`, component by component: on Windows a resolved folder takes neither `/` nor `..` as they are.
fn joined(folder: &Path, name: &str) -> PathBuf {
    if !cfg!(windows) || Path::new(name).is_absolute() {
        return folder.join(name);
    }
    let mut path = folder.to_path_buf();
    for part in name.split('/').filter(|part| !part.is_empty() && *part != ".") {
        if part == ".." {
            path.pop();
        } else {
            path.push(part);
        }
    }
    path
}

/// The path without `.` and `..`, or none when it climbs above the top or starts there.
fn flattened(path: &Path) -> Option<PathBuf> {
    let mut flat = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => flat.push(name),
            Component::CurDir => {}
            Component::ParentDir if flat.pop() => {}
            _ => return None,
        }
    }
    Some(flat)
}

fn regular(kind: &fs::Metadata, written: &str) -> Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    let what = if kind.is_dir() { "a folder" } else { "a device, pipe or socket" };
    Err(Error::invalid(format!("`{written}` is {what}, not a file")))
}

/// Missing is the input's fault, unreadable the system's.
fn explain(e: &io::Error, written: &str) -> Error {
    use io::ErrorKind::{InvalidFilename, InvalidInput, NotADirectory, NotFound};
    match e.kind() {
        NotFound | NotADirectory => missing(written),
        InvalidInput | InvalidFilename => Error::invalid(format!("`{written}` cannot be a file name")),
        _ => Error::new(ErrorKind::Io, format!("cannot read `{written}`: {}", reason(e))),
    }
}

/// The system's reason, without the "(os error 13)" at its end.
fn reason(e: &io::Error) -> String {
    let text = e.to_string();
    let end = text.find(" (os error").unwrap_or(text.len());
    text[..end].to_lowercase()
}

fn missing(written: &str) -> Error {
    Error::invalid(format!("there is no file `{written}`"))
}

fn outside(written: &str) -> Error {
    Error::invalid(format!(
        "`{written}` lies outside the folders of the mesh and the scene, so it is not opened"
    ))
    .remedy("copy it beside the mesh")
}

fn too_long(shown: &str, limit: u64) -> Error {
    Error::new(ErrorKind::TooLarge, format!("`{shown}` is longer than the {} MiB allowed", limit >> 20))
}

#[cfg(test)]
#[path = "source_tests.rs"]
mod tests;
