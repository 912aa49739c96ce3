//! Threads to work on: a number of them in, work done on them out. Nothing is left behind.

use crate::error::{Error, ErrorKind, Result, reason};

/// Runs `work` on `threads` threads of its own (as many as the machine has for `None`), which end with it; where it runs
/// on such threads already, or the platform has none, where it is.
///
/// # Errors
/// [`ErrorKind::TooLarge`] when they cannot be started: `rayon`'s own threads would panic then.
pub(crate) fn on_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> T + Send) -> Result<T> {
    if cfg!(target_family = "wasm") || rayon::current_thread_index().is_some() {
        return Ok(work());
    }
    let count = threads.unwrap_or(0);
    let mut handles = Vec::new();
    let builder = rayon::ThreadPoolBuilder::new().num_threads(count).spawn_handler(|thread| {
        handles.push(std::thread::Builder::new().spawn(|| thread.run())?);
        Ok(())
    });
    let pool = builder.build().map_err(|error| {
        let (wanted, remedy) = match count {
            0 => ("threads".to_owned(), ""),
            1 => ("a thread".to_owned(), ""),
            _ => (format!("{count} threads"), "ask for fewer threads, "),
        };
        Error::new(ErrorKind::TooLarge, format!("cannot start {wanted}: {}", reason(&error)))
            .remedy(format!("{remedy}end other programs, or raise the limits on processes and memory"))
    })?;
    let done = pool.install(work);
    drop(pool);
    // Dropping asks them to end, and does not wait until they have.
    for handle in handles {
        let _ = handle.join();
    }
    Ok(done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_on_as_many_threads_as_asked_for_and_on_those_already_there() -> Result<()> {
        let count = |inner| on_threads(inner, rayon::current_num_threads);
        assert_eq!(count(Some(3))?, 3);
        assert_eq!(on_threads(Some(2), || count(Some(3)))??, 2);
        Ok(())
    }
}
