//! Files that appear under their name only when they are whole. In: a path and a function that writes; out:
//! the complete file, or none and an error. Written beside the target in the same folder, flushed to the
//! disk, then renamed.

use super::interrupt;
use super::limited::Limited;
use groundglass::error::{Error, ErrorKind, Result};
use std::fs::OpenOptions;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Writes the file `target` with `fill`. An existing regular file is replaced; `read` are the files that were
/// read as input and must not be.
///
/// # Errors
/// [`ErrorKind::Io`] when `target` is a folder or a device, lies in no folder, or cannot be written;
/// [`ErrorKind::Invalid`] when it is one of `read`; and what `fill` returns. The target is then untouched.
pub(super) fn write_whole(
    target: &Path,
    read: &[PathBuf],
    fill: impl FnOnce(&mut BufWriter<Limited>) -> Result<()>,
) -> Result<()> {
    refuse_inputs(target, read)?;
    let (temporary, file) = Temporary::create(target)?;
    let mut writer = BufWriter::new(file);
    fill(&mut writer).map_err(|error| {
        let is_told = error.kind() != ErrorKind::Io || error.remedy_text().is_some();
        let error = error.in_file(target.display().to_string());
        if is_told {
            error
        } else {
            error.remedy("see whether the disk is full or files may not be so long, or name another place")
        }
    })?;
    let failed = |error: io::Error| broken(target, &error);
    let file = writer.into_inner().map_err(|error| failed(error.into_error()))?;
    file.finish().map_err(failed)?;
    temporary.finish()
}

/// Asks before the work whether `target` can be written: a file can be made beside it. `write_whole` asks again.
///
/// # Errors
/// As for [`write_whole`].
pub(super) fn check(target: &Path, read: &[PathBuf]) -> Result<()> {
    refuse_inputs(target, read)?;
    Temporary::create(target).map(drop)
}

/// Refuses a `target` that is one of the files in `read`, under whatever name.
///
/// # Errors
/// [`ErrorKind::Invalid`], naming the file.
pub(super) fn refuse_inputs(target: &Path, read: &[PathBuf]) -> Result<()> {
    if read.iter().any(|path| is_same(path, target)) {
        return Err(Error::invalid("the output would replace a file that was read as input")
            .in_file(target.display().to_string())
            .remedy("give another name"));
    }
    Ok(())
}

/// Whether two paths lead to one file, through links and hard links; or would, when neither is there yet.
pub(super) fn is_same(a: &Path, b: &Path) -> bool {
    match (std::fs::metadata(a), std::fs::metadata(b)) {
        #[cfg(unix)]
        (Ok(a), Ok(b)) => {
            use std::os::unix::fs::MetadataExt;
            (a.dev(), a.ino()) == (b.dev(), b.ino())
        }
        #[cfg(not(unix))]
        (Ok(_), Ok(_)) => a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b)),
        (Err(_), Err(_)) => match (settle(a), settle(b)) {
            (Ok(a), Ok(b)) => a == b,
            _ => a == b,
        },
        _ => false,
    }
}

/// An error of writing, for use inside `fill` too.
pub(super) fn broken(target: &Path, error: &io::Error) -> Error {
    let text = error.to_string();
    let reason = text.split(" (os error").next().unwrap_or_default().to_lowercase();
    let remedy = match error.kind() {
        std::io::ErrorKind::PermissionDenied | std::io::ErrorKind::ReadOnlyFilesystem => {
            "name a place that you may write to"
        }
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => {
            "make room on that disk, or name another"
        }
        std::io::ErrorKind::FileTooLarge => "raise the limit on the length of files, or ask for less",
        _ => "see whether other programs can write there, or name another place",
    };
    Error::new(ErrorKind::Io, format!("cannot be written: {reason}"))
        .in_file(target.display().to_string())
        .remedy(remedy)
}

/// The file to replace or to make. A link to another file of its folder stays one, and that file is replaced; one that
/// leads elsewhere is refused: whoever put it there may mean a file that is not to be written.
fn settle(target: &Path) -> Result<PathBuf> {
    let refused = |message: &str, remedy: &str| {
        Err(Error::new(ErrorKind::Io, message.to_string())
            .in_file(target.display().to_string())
            .remedy(remedy))
    };
    let Some(name) = target.file_name() else {
        return refused("names a folder, not a file", "give a file's name");
    };
    match std::fs::metadata(target) {
        Ok(found) if found.is_dir() => refused("is a folder", "give a file's name"),
        Ok(found) if !found.is_file() => refused("is not a regular file", "give a file's name"),
        // Renaming would replace it all the same.
        Ok(found) if found.permissions().readonly() => refused("is read-only", "give another name"),
        Ok(_) => {
            let found = target.canonicalize().map_err(|error| broken(target, &error))?;
            if target.is_symlink() && found.parent() != folder_of(target).canonicalize().ok().as_deref() {
                return refused(
                    "is a link that leads out of its folder",
                    "name the file itself, or remove the link",
                );
            }
            Ok(found)
        }
        Err(_) if target.is_symlink() => refused("is a link that leads nowhere", "remove it"),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(folder(target)?.join(name)),
        Err(error) => Err(broken(target, &error)),
    }
}

/// The folder that `target` will lie in, links resolved.
///
/// # Errors
/// [`ErrorKind::Io`] where there is none.
pub(super) fn folder(target: &Path) -> Result<PathBuf> {
    folder_of(target).canonicalize().map_err(|_| {
        Error::new(ErrorKind::Io, "its folder does not exist")
            .in_file(target.display().to_string())
            .remedy("make the folder first")
    })
}

/// The folder that a path names the file in.
fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Folders made for output, the outermost first, which go again when nothing comes to lie in them.
pub(super) struct Folder(Vec<PathBuf>);

impl Folder {
    /// Makes the folder, unless it is there.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] when it cannot be made, or a link has its name.
    pub(super) fn make(path: &Path) -> Result<Self> {
        if path.ancestors().any(|part| !part.as_os_str().is_empty() && part.is_symlink()) {
            return Err(Error::new(ErrorKind::Io, "is a link, so nothing is written to where it leads")
                .in_file(path.display().to_string())
                .remedy("remove the link, or name the output with -o"));
        }
        Self::given(path)
    }

    /// Makes the folder that the user named, by way of links or not, unless it is there.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] when it cannot be made.
    pub(super) fn given(path: &Path) -> Result<Self> {
        let missing = path.ancestors().take_while(|part| !part.as_os_str().is_empty() && !part.is_dir());
        let mut missing: Vec<&Path> = missing.collect();
        missing.reverse();
        let mut made = Self(Vec::new());
        for part in missing {
            if std::fs::symlink_metadata(part).is_ok_and(|found| !found.is_symlink()) {
                let message = format!("a folder is to be made there, and `{}` is a file", part.display());
                return Err(Error::new(ErrorKind::Io, message)
                    .in_file(path.display().to_string())
                    .remedy("give another name"));
            }
            interrupt::register(part, || std::fs::create_dir_all(part)).map_err(|error| {
                interrupt::release(part, || ());
                broken(path, &error)
            })?;
            made.0.push(part.to_path_buf());
        }
        Ok(made)
    }
}

/// Does `work` in a folder that is made for it, where there is one to make; out: the folder and what the work gave. Another run
/// that made the folder, and ends without a picture, takes it away at any moment: then it is made again, and the work is done again.
///
/// # Errors
/// As for [`Folder::make`], and those of the work.
pub(super) fn in_made<T>(folder: Option<&Path>, work: impl Fn() -> Result<T>) -> Result<(Option<Folder>, T)> {
    let mut tries = 0;
    loop {
        let made = folder.map(Folder::make).transpose()?;
        let done = work();
        tries += 1;
        if done.is_ok() || folder.is_none_or(Path::is_dir) || tries == NAMES {
            return Ok((made, done?));
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        for path in self.0.iter().rev() {
            // It stays when there is something in it.
            let _ = interrupt::release(path, || std::fs::remove_dir(path));
        }
    }
}

/// A file beside the target that this run made, and that is removed when dropped, unless renamed.
struct Temporary {
    path: PathBuf,
    target: PathBuf,
    /// The target as the user named it, for errors.
    shown: PathBuf,
}

/// Names tried for a temporary file. A run that was killed leaves one behind, and in a container every run may be process 1.
const NAMES: u32 = 1000;

impl Temporary {
    fn create(target: &Path) -> Result<(Self, Limited)> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let settled = settle(target)?;
        let Some(name) = settled.file_name() else {
            return Err(Error::new(ErrorKind::Io, "names no file").in_file(target.display().to_string()));
        };
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        // What nobody else may read nobody else reads while it is written.
        #[cfg(unix)]
        if let Ok(found) = std::fs::metadata(&settled) {
            use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
            options.mode(found.permissions().mode());
        }
        // Long names are cut: the system limits a name's length, and the suffix must fit.
        let stem: String = name.to_string_lossy().chars().take(32).collect();
        for _ in 0..NAMES {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = settled.with_file_name(format!(".{stem}.{}-{count}.part", std::process::id()));
            let open = || options.open(&path).map(Limited::new);
            match interrupt::register(&path, open) {
                Ok(file) => return Ok((Self { path, target: settled, shown: target.to_path_buf() }, file)),
                Err(error) => {
                    // Another's, if it is there.
                    interrupt::release(&path, || ());
                    if error.kind() != io::ErrorKind::AlreadyExists {
                        return Err(broken(target, &error));
                    }
                }
            }
        }
        Err(Error::new(ErrorKind::Io, "cannot be written: its folder is full of unfinished files")
            .in_file(target.display().to_string())
            .remedy(format!("remove the files .{stem}.*.part in it")))
    }

    fn finish(self) -> Result<()> {
        let rename = || {
            if let Ok(found) = std::fs::metadata(&self.target) {
                std::fs::set_permissions(&self.path, found.permissions())?;
            }
            std::fs::rename(&self.path, &self.target)
        };
        interrupt::release(&self.path, rename).map_err(|error| broken(&self.shown, &error))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // After a rename there is nothing of this name.
        let _ = interrupt::release(&self.path, || std::fs::remove_file(&self.path));
    }
}

/// Writes text whole.
///
/// # Errors
/// As for [`write_whole`].
pub(super) fn write_text(target: &Path, read: &[PathBuf], text: &str) -> Result<()> {
    write_whole(target, read, |file| file.write_all(text.as_bytes()).map_err(|error| broken(target, &error)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_whole_or_untouched() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        write_text(&target, &[], "one").unwrap();
        let failed = write_whole(&target, &[], |file| {
            file.write_all(b"tw").unwrap();
            Err(Error::new(ErrorKind::Cancelled, "stopped"))
        });
        assert_eq!(failed.unwrap_err().kind(), ErrorKind::Cancelled);
        assert_eq!(std::fs::read_to_string(&target).unwrap(), "one");
        write_text(&target, &[], "two").unwrap();
        assert_eq!(std::fs::read_to_string(&target).unwrap(), "two");
        assert_eq!(files(folder.path()), ["a.txt"]);
        let failed = write_whole(&target, &[], |_| Err(Error::new(ErrorKind::Io, "broken"))).unwrap_err();
        assert!(failed.to_string().contains("a.txt") && failed.remedy_text().is_some(), "{failed}");
    }

    #[test]
    fn unfinished_files_of_other_runs_are_passed_over_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let left: Vec<PathBuf> = (0..NAMES / 2)
            .map(|count| folder.path().join(format!(".a.txt.{}-{count}.part", std::process::id())))
            .collect();
        left.iter().for_each(|path| std::fs::write(path, "another's").unwrap());
        write_text(&folder.path().join("a.txt"), &[], "one").unwrap();
        assert_eq!(std::fs::read_to_string(folder.path().join("a.txt")).unwrap(), "one");
        assert!(left.iter().all(|path| std::fs::read_to_string(path).unwrap() == "another's"));
    }

    #[test]
    fn folders_missing_folders_and_inputs_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("scene.toml");
        std::fs::write(&input, "x").unwrap();
        let write = |path: &Path| write_text(path, std::slice::from_ref(&input), "y").unwrap_err();
        assert_eq!(write(folder.path()).kind(), ErrorKind::Io);
        assert_eq!(write(&folder.path().join("none/a.png")).kind(), ErrorKind::Io);
        assert_eq!(write(Path::new("")).kind(), ErrorKind::Io);
        assert_eq!(write(Path::new("..")).kind(), ErrorKind::Io);
        let error =
            write(&folder.path().join("../").join(folder.path().file_name().unwrap()).join("scene.toml"));
        assert_eq!(error.kind(), ErrorKind::Invalid);
        assert_eq!(write(&folder.path().join("x".repeat(5000))).kind(), ErrorKind::Io);
        assert_eq!(std::fs::read_to_string(&input).unwrap(), "x");
        assert_eq!(files(folder.path()), ["scene.toml"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_devices_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.txt"), folder.path().join("link.txt"));
        std::fs::write(&real, "x").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_text(&link, &[], "y").unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read_to_string(&real).unwrap(), "y");
        assert_eq!(write_text(&link, &[real], "z").unwrap_err().kind(), ErrorKind::Invalid);
        assert_eq!(write_text(Path::new("/dev/null"), &[], "z").unwrap_err().kind(), ErrorKind::Io);
    }
}
