//! Progress on a terminal: nothing for the first half second, then a bar with the time left.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// How long work may take before it is worth a line.
const PATIENCE: Duration = Duration::from_millis(500);

/// A bar that appears when the work takes longer than half a second, and only on a terminal.
pub(super) struct Progress {
    started: Instant,
    bar: Option<Mutex<Shown>>,
}

struct Shown {
    bar: ProgressBar,
    what: String,
    visible: bool,
}

impl Progress {
    pub(super) fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::hidden());
            let style = ProgressStyle::with_template("{msg:>12} [{bar:40}] {percent:>3} %  {eta} left");
            if let Ok(style) = style {
                bar.set_style(style.progress_chars("=> "));
            }
            Mutex::new(Shown { bar, what: String::new(), visible: false })
        });
        Self { started: Instant::now(), bar }
    }

    /// `done` of `total` of `what`; may come from any thread.
    pub(super) fn tell(&self, what: &str, done: u64, total: u64) {
        let Some(bar) = &self.bar else { return };
        if self.started.elapsed() < PATIENCE {
            return;
        }
        // Whoever comes while another thread draws can skip a step.
        let Ok(mut shown) = bar.try_lock() else { return };
        if !shown.visible {
            shown.visible = true;
            shown.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        if shown.what != what {
            shown.what = what.to_owned();
            shown.bar.set_message(what.to_owned());
            shown.bar.reset_eta();
        }
        shown.bar.set_length(total);
        shown.bar.set_position(done);
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        if let Some(Ok(shown)) = self.bar.as_ref().map(Mutex::lock) {
            shown.bar.finish_and_clear();
        }
    }
}
