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
//! With a root folder ([`Files::under`](super::Files::under)) each of them must lie in that folder besides, links
//! resolved. Folders, devices, pipes and sockets are never opened, nor the kernel's own files (`/proc`, `/sys`); URLs are
//! never fetched. A link that takes the place of a file or folder after it was found is not followed.
//! What is missing or refused is [`ErrorKind::Invalid`], what is there but cannot be read [`ErrorKind::Io`],
//! what is too long [`ErrorKind::TooLarge`].

use std::borrow::Cow;
use std::collections::BTreeMap;
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

    /// How long a file is that one of the above found, in bytes.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] when it cannot be reached.
    fn length(&self, file: &Path) -> Result<u64> {
        self.read(file, u64::MAX).map(|bytes| bytes.len() as u64)
    }

    /// Bytes of memory that what is loaded from here may take from now on; `None` for no limit.
    fn room(&self) -> Option<u64> {
        None
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

    /// Adds or replaces a file; `name` as in `scenes/tower.obj` (or with back slashes), relative and within: one such as `/tower.obj` or
    /// `../tower.obj` is not added, since nothing could name it.
    #[must_use]
    pub fn with(mut self, name: &str, bytes: impl Into<Cow<'static, [u8]>>) -> Self {
        if let Some(path) = flattened(Path::new(&name.replace('\\', "/"))) {
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

/// `written` with slashes and without blanks around it, which lines of OBJ and MTL files may have, if it can be a file's name at
/// all.
pub(super) fn slashed(written: &str) -> Result<String> {
    name(written.trim())
}

fn name(written: &str) -> Result<String> {
    let name = written.replace('\\', "/");
    if name.trim().is_empty() {
        return Err(Error::invalid("a file name is empty"));
    }
    if name.contains("://") {
        return Err(Error::invalid(format!("`{written}` is a URL; nothing is fetched from the network"))
            .remedy("save it as a file and name that"));
    }
    Ok(name)
}

/// `written` with slashes, blanks and all, if it is a relative path.
pub(super) fn relative(written: &str) -> Result<String> {
    let name = name(written)?;
    let drive = name.as_bytes().get(1) == Some(&b':') && name.as_bytes()[0].is_ascii_alphabetic();
    if drive || name.starts_with('/') || Path::new(&name).is_absolute() {
        return Err(Error::invalid(format!("`{written}` is an absolute path"))
            .remedy("write it relative to the file that names it"));
    }
    Ok(name)
}

/// `folder/name`, component by component: on Windows a resolved folder takes neither `/` nor `..` as they are.
pub(super) fn joined(folder: &Path, name: &str) -> PathBuf {
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

pub(super) fn missing(written: &str) -> Error {
    Error::invalid(format!("there is no file `{written}`"))
        .remedy("check the name, and the folder it is meant from")
}

pub(super) fn outside(written: &str) -> Error {
    Error::invalid(format!(
        "`{written}` lies outside the folders of the mesh and the scene, so it is not opened"
    ))
    .remedy("copy it beside the mesh")
}

pub(super) fn too_long(shown: &str, limit: u64) -> Error {
    let most = if limit >> 20 > 0 { format!("{} MiB", limit >> 20) } else { format!("{limit} bytes") };
    Error::new(ErrorKind::TooLarge, format!("`{shown}` is longer than the {most} allowed"))
        .remedy("check that it is the file that is meant, or make it smaller")
}

#[cfg(test)]
#[path = "source_tests.rs"]
mod tests;
