//! Progress: on a terminal nothing for the first half second, then a bar with the time left; elsewhere nothing, or a line now and
//! then for work that takes minutes.

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
    /// When the last line was written, for what is no terminal.
    lines: Option<Mutex<Instant>>,
}

/// How often a line is written.
const LINES: Duration = Duration::from_secs(10);

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
        Self { started: Instant::now(), bar, lines: None }
    }

    /// As [`Progress::new`], and where there is no terminal, a line every ten seconds.
    pub(super) fn with_lines() -> Self {
        let progress = Self::new();
        let lines = progress.bar.is_none().then(|| Mutex::new(Instant::now()));
        Self { lines, ..progress }
    }

    /// `done` of `total` of `what`; may come from any thread.
    pub(super) fn tell(&self, what: &str, done: u64, total: u64) {
        if let Some(Ok(mut last)) = self.lines.as_ref().map(Mutex::try_lock)
            && last.elapsed() >= LINES
        {
            *last = Instant::now();
            let part = done as f64 / total.max(1) as f64;
            let left = self.started.elapsed().as_secs_f64() * (1.0 - part) / part.max(1e-3);
            super::report::say(&format!("{what}: {:.0} %, about {left:.0} s left", 100.0 * part));
        }
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

    /// Does what writes lines of its own, the bar taken away meanwhile.
    pub(super) fn pause(&self, write: impl FnOnce()) {
        match self.bar.as_ref().map(Mutex::lock) {
            Some(Ok(shown)) => shown.bar.suspend(write),
            _ => write(),
        }
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        if let Some(Ok(shown)) = self.bar.as_ref().map(Mutex::lock) {
            shown.bar.finish_and_clear();
        }
    }
}
