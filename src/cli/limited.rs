//! A file that keeps within the longest that the system lets this process write: bytes in, the file or an error out. Past
//! that limit (`ulimit -f`) the system would end the program by a signal, half-way.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// A file to write.
pub(super) struct Limited {
    file: File,
    at: u64,
    most: u64,
}

impl Limited {
    pub(super) fn new(file: File) -> Self {
        Self { file, at: 0, most: longest() }
    }

    /// Flushes it to the disk and closes it.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn finish(self) -> io::Result<()> {
        self.file.sync_all()
    }
}

impl Write for Limited {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.at.saturating_add(bytes.len() as u64) > self.most {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let written = self.file.write(bytes)?;
        self.at += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Limited {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.file.seek(to)?;
        Ok(self.at)
    }
}

/// The longest file that may be written, in bytes.
fn longest() -> u64 {
    #[cfg(unix)]
    {
        rustix::process::getrlimit(rustix::process::Resource::Fsize).current.unwrap_or(u64::MAX)
    }
    #[cfg(not(unix))]
    {
        u64::MAX
    }
}

/// Whether so many more bytes may be written to standard output or standard error, should it be a file.
#[cfg(unix)]
pub(super) fn may_write(stream: impl std::os::fd::AsFd, more: usize) -> bool {
    use rustix::fs::{FileType, OFlags, fcntl_getfl, fstat, tell};
    let most = longest();
    let Ok(found) = fstat(&stream) else { return true };
    if most == u64::MAX || FileType::from_raw_mode(found.st_mode) != FileType::RegularFile {
        return true;
    }
    let appends = fcntl_getfl(&stream).is_ok_and(|flags| flags.contains(OFlags::APPEND));
    let at = if appends { u64::try_from(found.st_size).unwrap_or(0) } else { tell(&stream).unwrap_or(0) };
    at.saturating_add(more as u64) <= most
}

#[cfg(not(unix))]
pub(super) fn may_write<T>(_: T, _: usize) -> bool {
    true
}
