//! Threads to work on: a number of them in, work done on them out. Nothing is left behind.

use crate::error::{Error, ErrorKind, Result, reason};
use std::thread::JoinHandle;

/// More are refused: starting a million takes minutes.
const MOST: usize = 1024;

/// Runs `work` on `threads` threads of its own (as many as the machine has for `None`), which end with it; where it runs
/// on such threads already, or the platform has none, where it is.
///
/// # Errors
/// [`ErrorKind::TooLarge`] when they cannot be started (`rayon`'s own threads would panic then), or there would be more than 1024.
pub(crate) fn on_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> T + Send) -> Result<T> {
    if cfg!(target_family = "wasm") || rayon::current_thread_index().is_some() {
        return Ok(work());
    }
    let (pool, handles) = started(threads.unwrap_or(0))?;
    let done = pool.install(work);
    drop(pool);
    // Dropping asks them to end, and does not wait until they have.
    for handle in handles {
        let _ = handle.join();
    }
    Ok(done)
}

/// So many threads, and what to wait for once they are asked to end. (Apart from the work: it was compiled once for each kind of that.)
fn started(count: usize) -> Result<(rayon::ThreadPool, Vec<JoinHandle<()>>)> {
    if count > MOST {
        return Err(Error::new(
            ErrorKind::TooLarge,
            format!("{count} threads: {MOST} at most can be started"),
        )
        .remedy("ask for as many as the machine has cores"));
    }
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
    Ok((pool, handles))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_on_as_many_threads_as_asked_for_and_on_those_already_there() -> Result<()> {
        let count = |inner| on_threads(inner, rayon::current_num_threads);
        assert_eq!(count(Some(3))?, 3);
        assert_eq!(on_threads(Some(2), || count(Some(3)))??, 2);
        assert_eq!(count(Some(1_000_000)).map_err(|error| error.kind()), Err(ErrorKind::TooLarge));
        Ok(())
    }
}
