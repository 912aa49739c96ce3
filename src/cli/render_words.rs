//! What `groundglass render` says of a picture: a line of what was made, and what to know of it.

use super::report;
use super::stats::{Samples, Stats};
use groundglass::error::Warning;
use groundglass::render::MOST_FOR_ERROR;
use groundglass::sampling::runs::MOST_SAMPLES;
use groundglass::scene::Budget;
use std::path::Path;

/// False convergence, told.
pub(super) fn unseen_light(file: &str, blocks: u64) -> Warning {
    Warning {
        file: file.to_owned(),
        line: None,
        message: format!(
            "a light is so small and bright that the samples may have missed it in {blocks} blocks of 8 x 8 pixels; the stated \
             error counts what it could add there, and more samples would tell"
        ),
    }
}

/// One sample a pixel has no halves to compare.
pub(super) fn no_error_map(file: &str, target: &Path) -> Warning {
    Warning {
        file: file.to_owned(),
        line: None,
        message: format!(
            "the error of one sample a pixel is unknown, so {} is not written{}; give more time, or --samples",
            target.display(),
            if target.exists() { ", and what stands there is of another picture" } else { "" }
        ),
    }
}

/// Samples that a picture in a time takes at least, on the mean, where it has the time to look for errors.
const LEAST: f64 = 16.0;

/// An error or a time that was asked for and is not what came of it.
pub(super) fn missed(file: &str, budget: Budget, stats: &Stats) -> Option<Warning> {
    match budget {
        Budget::MaxError(wanted) => {
            let reached = stats.estimated_rms_error.filter(|reached| *reached > wanted)?;
            Some(beyond_reach(file, wanted, reached))
        }
        Budget::Seconds(wanted) => {
            let (took, leeway) = (stats.render_seconds, (0.05 * wanted).max(0.05));
            if took > wanted + leeway {
                return Some(too_late(file, wanted, stats));
            }
            let is_full = stats.samples_per_pixel.min == MOST_SAMPLES;
            (took < wanted - leeway && is_full).then(|| no_more(file, wanted, stats))
        }
        Budget::Samples(_) => None,
    }
}

/// A time that was not kept.
fn too_late(file: &str, wanted: f64, stats: &Stats) -> Warning {
    let why = if stats.samples_per_pixel.mean > LEAST {
        "the machine was slower at the end than before, as when other programs run"
    } else {
        "fewer samples would not tell its error; make it smaller, give it more time, or ask for --samples 1"
    };
    let took = stats.render_seconds;
    Warning {
        file: file.to_owned(),
        line: None,
        message: format!("the picture took {took:.2} s, and {wanted} s were asked for: {why}"),
    }
}

/// That a picture has all samples that it may have before its time is up.
fn no_more(file: &str, wanted: f64, stats: &Stats) -> Warning {
    Warning {
        file: file.to_owned(),
        line: None,
        message: format!(
            "the picture took {:.2} s of {wanted} s: pixels have {MOST_SAMPLES} samples at most",
            stats.render_seconds
        ),
    }
}

/// What an error takes that so many samples do not reach.
struct Take {
    wanted: String,
    samples: String,
    /// What else to ask for.
    more: &'static str,
}

impl Take {
    fn new(wanted: f64, reached: f64) -> Self {
        // An error falls about as the number of samples to the power 0.6.
        let samples = f64::from(MOST_FOR_ERROR) * libm::pow(reached / wanted, 1.0 / 0.6);
        let is_few = samples <= f64::from(MOST_SAMPLES);
        Self {
            wanted: if wanted < 1e-4 { format!("{wanted:e}") } else { wanted.to_string() },
            samples: if samples < 1e15 {
                format!("about {samples:.1e}")
            } else {
                "more than 1e15".to_owned()
            },
            more: if is_few { ", or for that many --samples" } else { "" },
        }
    }
}

/// The same as [`beyond_reach`] while there is time to stop, by the word of a few tiles.
pub(super) fn seems_beyond_reach(file: &str, wanted: f64, expected: f64) -> Warning {
    let Take { wanted, samples, more } = Take::new(wanted, expected);
    Warning {
        file: file.to_owned(),
        line: None,
        message: format!(
            "an error of {wanted} seems out of reach: {MOST_FOR_ERROR} samples a pixel, the most that --max-error takes, may reach \
             {expected:.1e}, and it would take {samples}; the picture goes on to what they reach, which takes long: stop it to ask for a \
             larger --max-error{more}"
        ),
    }
}

/// An error that no reasonable number of samples reaches.
fn beyond_reach(file: &str, wanted: f64, reached: f64) -> Warning {
    let Take { wanted, samples, more } = Take::new(wanted, reached);
    Warning {
        file: file.to_owned(),
        line: None,
        message: format!(
            "an error of {wanted} was asked for and {reached:.2e} is reached with up to {MOST_FOR_ERROR} samples a pixel, the most \
             that --max-error takes: it would take {samples} samples a pixel; ask for a larger --max-error{more}"
        ),
    }
}

/// One line: what was made, how long it took, its error.
pub(super) fn summary(path: &Path, stats: &Stats) -> String {
    let error = match stats.estimated_rms_error {
        Some(error) => format!("RMS error about {}", report::rms(error)),
        None => "one sample a pixel: its error is unknown".to_owned(),
    };
    let samples = match stats.samples_per_pixel {
        Samples { min: 1, max: 1, .. } => "1 sample each".to_owned(),
        Samples { min, max, .. } if min == max => format!("{max} samples each"),
        Samples { mean, min, max } => format!("{mean:.0} samples on average ({min} to {max})"),
    };
    format!(
        "{}: {} x {} pixels, {samples}, {:.2} s ({:.2} s loading); {error}\n",
        path.display(),
        stats.width,
        stats.height,
        stats.render_seconds,
        stats.load_seconds,
    )
}
