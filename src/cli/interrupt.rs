//! INT, TERM and HUP, but those that were to be ignored when the program began: by `nohup`, or by a shell that starts it in the background.
//! Work that can stop by itself runs in [`polled`] and looks at the flag; everything else ends at once. Either way the exit code is 75 and
//! nothing half written stays: unfinished files, and folders made for them, are registered here by `output` and removed.

use super::report::INTERRUPTED;
use groundglass::error::{Error, ErrorKind, Result};
#[cfg(unix)]
use signal_hook::{
    consts::{SIGHUP, SIGINT, SIGTERM},
    iterator::Signals,
};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

static POLLED: AtomicBool = AtomicBool::new(false);
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn flag() -> &'static AtomicBool {
    static FLAG: AtomicBool = AtomicBool::new(false);
    &FLAG
}

/// Starts to listen; called once, first. Where signals cannot be caught the system's own ending must do.
#[cfg(unix)]
pub(super) fn watch() {
    let all = [SIGINT, SIGTERM, SIGHUP];
    // The thread first: signals that are caught and that nobody looks at would be lost.
    let (send, receive) = std::sync::mpsc::channel::<Signals>();
    let listen = move || {
        for mut signals in receive {
            signals.forever().for_each(|_| stop());
        }
    };
    if std::thread::Builder::new().spawn(listen).is_ok()
        && let Ok(signals) = Signals::new(all.into_iter().filter(|&signal| !is_ignored(signal)))
    {
        let _ = send.send(signals);
    }
}

/// Starts to listen; called once, first. Where signals cannot be caught the system's own ending must do.
#[cfg(not(unix))]
pub(super) fn watch() {
    let _ = ctrlc::set_handler(stop);
}

/// Whether a signal is ignored, where the system says so in a file.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// A signal has come.
fn stop() {
    let asked_before = flag().swap(true, Ordering::SeqCst);
    if asked_before || !POLLED.load(Ordering::SeqCst) {
        // Held until the process ends, so that no file is begun or renamed meanwhile.
        let unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
        for path in unfinished.iter().rev() {
            // A folder goes only when it is empty.
            let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
        }
        std::process::exit(i32::from(INTERRUPTED));
    }
}

/// Runs `work`, which looks at the flag it is given: meanwhile the first signal only sets the flag, and a second
/// one ends the program at once.
///
/// # Errors
/// Those of `work`; [`ErrorKind::Cancelled`] when a signal came, even after the last look at the flag, with the remedy of the
/// work that was stopped.
pub(super) fn polled<T>(work: impl FnOnce(&AtomicBool) -> Result<T>) -> Result<T> {
    POLLED.store(true, Ordering::SeqCst);
    let done = work(flag());
    // In this order a signal either ends the program itself or is seen here.
    POLLED.store(false, Ordering::SeqCst);
    if flag().load(Ordering::SeqCst) {
        let stopped = Error::new(ErrorKind::Cancelled, "stopped before it was done");
        let error = done.err().filter(|error| error.kind() == ErrorKind::Cancelled);
        return Err(match error.as_ref().and_then(Error::remedy_text) {
            Some(remedy) => stopped.remedy(remedy),
            None => stopped,
        });
    }
    done
}

/// Runs `begin`, which creates `path`, so that an interrupt removes the file.
pub(super) fn register<T>(path: &Path, begin: impl FnOnce() -> T) -> T {
    let mut unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    unfinished.push(path.to_path_buf());
    begin()
}

/// Runs `finish`, which renames or removes `path`, and forgets it.
pub(super) fn release<T>(path: &Path, finish: impl FnOnce() -> T) -> T {
    let mut unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    unfinished.retain(|other| other != path);
    finish()
}
