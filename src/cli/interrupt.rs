//! INT, TERM and HUP. A verb that can stop by itself calls [`install`] and looks at the flag; every other
//! verb ends at once. Either way the exit code is 75 and nothing half written stays: unfinished
//! files are registered here by `output` and removed.

use super::report::INTERRUPTED;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

static POLLED: AtomicBool = AtomicBool::new(false);
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn flag() -> &'static Arc<AtomicBool> {
    static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    FLAG.get_or_init(Arc::default)
}

/// Starts to listen; called once, first.
pub(super) fn watch() {
    // Fails only where signals cannot be caught; then the system's own ending must do.
    let _ = ctrlc::set_handler(|| {
        let asked_before = flag().swap(true, Ordering::SeqCst);
        if asked_before || !POLLED.load(Ordering::SeqCst) {
            // Held until the process ends, so that no file is begun or renamed meanwhile.
            let unfinished = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
            for path in unfinished.iter() {
                let _ = std::fs::remove_file(path);
            }
            std::process::exit(i32::from(INTERRUPTED));
        }
    });
}

/// From now on the first signal only sets the flag that is returned: the verb stops by itself, and reports
/// [`Cancelled`](groundglass::error::ErrorKind::Cancelled). A second signal ends the program at once.
pub(super) fn install() -> Arc<AtomicBool> {
    POLLED.store(true, Ordering::SeqCst);
    Arc::clone(flag())
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
