//! The file system as a source of files: names checked, then opened so that what was checked is what is read.

use std::borrow::Cow;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::source::{Source, joined, missing, outside, relative, slashed, too_long};
use crate::error::{Error, ErrorKind, Result, reason};

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
        let found = match fs::canonicalize(root) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return Err(Error::invalid(format!("there is no folder `{shown}`"))
                    .remedy("name the folder under which all files lie"));
            }
            found => found.map_err(|e| explain(&e, &shown))?,
        };
        if !found.is_dir() {
            return Err(Error::invalid(format!("the root `{shown}` is not a folder"))
                .remedy("name the folder under which all files lie"));
        }
        Ok(Self { root: Some(found) })
    }

    fn settle(&self, path: &Path, written: &str, fences: Option<&[PathBuf]>) -> Result<PathBuf> {
        let found = fs::canonicalize(path).map_err(|e| match fs::metadata(path) {
            // A pipe that the system names by a number (`/dev/stdin`) is there, and has no path.
            Ok(kind) => regular(&kind, written).err().unwrap_or_else(|| explain(&e, written)),
            Err(_) => explain(&e, written),
        })?;
        self.check_root(&found, written)?;
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

    fn check_root(&self, found: &Path, written: &str) -> Result<()> {
        match &self.root {
            Some(root) if !found.starts_with(root) => {
                Err(Error::invalid(format!("`{written}` lies outside the root folder, so it is not opened"))
                    .remedy(format!("move it under `{}` or choose another root", root.display())))
            }
            _ => Ok(()),
        }
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

    fn length(&self, file: &Path) -> Result<u64> {
        let shown = file.display().to_string();
        fs::symlink_metadata(file).map(|kind| kind.len()).map_err(|e| explain(&e, &shown))
    }

    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>> {
        let shown = file.display().to_string();
        let unreadable = |e: io::Error| cannot_read(&e, &shown);
        self.check_root(file, &shown)?;
        regular(&fs::symlink_metadata(file).map_err(unreadable)?, &shown)?;
        let handle = open(file).map_err(unreadable)?;
        let before = handle.metadata().map_err(unreadable)?;
        regular(&before, &shown)?;
        if is_the_kernels(&handle) {
            return Err(Error::invalid(format!(
                "`{shown}` is no file on a disk but one that the kernel makes up"
            ))
            .remedy("copy what it holds to a file, and name that"));
        }
        if before.len() > limit {
            return Err(too_long(&shown, limit));
        }
        let mut bytes = Vec::new();
        // One more, so that the end is seen without growing.
        let wanted = usize::try_from(before.len()).unwrap_or(usize::MAX).saturating_add(1);
        bytes.try_reserve_exact(wanted).map_err(|_| {
            Error::new(ErrorKind::TooLarge, format!("there is not enough memory to read `{shown}`"))
        })?;
        // No more than was asked for, should the file grow.
        (&handle).take(wanted as u64).read_to_end(&mut bytes).map_err(unreadable)?;
        let after = handle.metadata().map_err(unreadable)?;
        let kept = before.len() == after.len() && before.modified().ok() == after.modified().ok();
        if !kept || bytes.len() as u64 != before.len() {
            return Err(Error::new(ErrorKind::Io, format!("`{shown}` changed while it was read"))
                .remedy("try again when nothing writes to it"));
        }
        Ok(Cow::Owned(bytes))
    }
}

/// Opens a path that has no links, folder by folder, and follows none that has come in a folder's or the file's place
/// since. A pipe in its place must not hang us, nor a terminal take us.
#[cfg(unix)]
fn open(file: &Path) -> io::Result<fs::File> {
    use rustix::fs::{Mode, OFlags, open, openat};
    use std::path::Component;
    // To pass through a folder needs no right to list it, where the system can open it so.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    const PASS: OFlags = OFlags::PATH;
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    const PASS: OFlags = OFlags::RDONLY;
    let way = PASS | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let last = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let mut folder = open(if file.is_absolute() { "/" } else { "." }, way, Mode::empty())?;
    let mut parts = file.components().peekable();
    while let Some(part) = parts.next() {
        match part {
            Component::Normal(name) if parts.peek().is_none() => {
                return Ok(openat(&folder, name, last, Mode::empty())?.into());
            }
            Component::Normal(name) => folder = openat(&folder, name, way, Mode::empty())?,
            Component::ParentDir => folder = openat(&folder, "..", way, Mode::empty())?,
            _ => {}
        }
    }
    Err(io::ErrorKind::IsADirectory.into())
}

#[cfg(not(unix))]
fn open(file: &Path) -> io::Result<fs::File> {
    fs::File::open(file)
}

/// Whether the file lies on one of the file systems in which the kernel shows its own state: such files have no length,
/// may never end, and tell what no scene should.
#[cfg(target_os = "linux")]
fn is_the_kernels(file: &fs::File) -> bool {
    /// proc, sysfs, debugfs, tracefs, securityfs, cgroup, cgroup2, pstore, bpf, configfs, efivarfs.
    const KINDS: [u32; 11] = [
        0x9fa0,
        0x6265_6572,
        0x6462_6720,
        0x7472_6163,
        0x7363_6673,
        0x0027_e0eb,
        0x6367_7270,
        0x6165_676c,
        0xcafe_4a11,
        0x6265_6570,
        0xde5e_81e4,
    ];
    rustix::fs::fstatfs(file).is_ok_and(|found| KINDS.contains(&(found.f_type as u32)))
}

#[cfg(not(target_os = "linux"))]
fn is_the_kernels(_: &fs::File) -> bool {
    false
}

fn regular(kind: &fs::Metadata, written: &str) -> Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    let (what, remedy) = match () {
        () if kind.is_dir() => ("a folder", "name a file in it"),
        () if kind.is_symlink() => ("a link by now", "try again when nothing writes to it"),
        () => ("a device, pipe or socket", "write what it gives to a file, and name that"),
    };
    Err(Error::invalid(format!("`{written}` is {what}, not a file")).remedy(remedy))
}

/// Missing is the input's fault, unreadable the system's.
fn explain(e: &io::Error, written: &str) -> Error {
    use io::ErrorKind::{InvalidFilename, InvalidInput, NotADirectory, NotFound};
    match e.kind() {
        NotFound | NotADirectory => missing(written),
        InvalidInput | InvalidFilename => Error::invalid(format!("`{written}` cannot be a file name"))
            .remedy("a name has no NUL, and no more than some 255 bytes between slashes"),
        // No fault of the system's: it is the same each time.
        #[cfg(unix)]
        _ if e.raw_os_error() == Some(rustix::io::Errno::LOOP.raw_os_error()) => {
            Error::invalid(format!("`{written}` is a link that leads back to itself"))
                .remedy("put the file in its place")
        }
        _ => cannot_read(e, written),
    }
}

fn cannot_read(e: &io::Error, written: &str) -> Error {
    let remedy = match e.kind() {
        io::ErrorKind::PermissionDenied => "see who may read it, and pass through the folders above it",
        _ => "see whether other programs can read it",
    };
    Error::new(ErrorKind::Io, format!("cannot read `{written}`: {}", reason(e))).remedy(remedy)
}

#[cfg(all(test, unix))]
#[path = "source_files_tests.rs"]
mod tests;
