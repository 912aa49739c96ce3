//! Pictures of a study's own making, row by row on as many threads as the renderer has: a function of a row in, pixels out, or the
//! news that the study was stopped.

use groundglass::error::{Error, ErrorKind, Result};
use groundglass::render::Execution;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// The pixels of `height` rows, one after the other.
///
/// # Errors
/// As [`go_on`].
pub(super) fn pixels(
    height: u32,
    execution: &Execution<'_>,
    row: impl Fn(u32) -> Vec<[f32; 3]> + Sync,
) -> Result<Vec<[f32; 3]>> {
    let row = |j: u32| go_on(execution).map(|()| row(j));
    let rows: Vec<Vec<[f32; 3]>> = (0..height).into_par_iter().map(row).collect::<Result<_>>()?;
    Ok(rows.concat())
}

/// Whether the study goes on.
///
/// # Errors
/// [`ErrorKind::Cancelled`] when it does not.
pub(super) fn go_on(execution: &Execution<'_>) -> Result<()> {
    match execution.cancel {
        Some(flag) if flag.load(Ordering::Relaxed) => {
            Err(Error::new(ErrorKind::Cancelled, "the study was stopped"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::machine;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn rows_come_in_order_until_the_study_is_stopped() -> Result<()> {
        let flag = AtomicBool::new(false);
        let execution = Execution { threads: Some(2), cancel: Some(&flag), ..Execution::default() };
        let draw = |stop: bool| {
            machine::on_threads(execution.threads, || {
                pixels(100, &execution, |j| {
                    flag.fetch_or(stop && j == 50, Ordering::Relaxed);
                    vec![[j as f32; 3]; 2]
                })
            })?
        };
        assert!(draw(false)?.iter().enumerate().all(|(at, pixel)| *pixel == [(at / 2) as f32; 3]));
        assert_eq!(draw(true).map_err(|error| error.kind()), Err(ErrorKind::Cancelled));
        Ok(())
    }
}
