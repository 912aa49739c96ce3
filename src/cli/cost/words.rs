//! What a study found, in plain words: what half the error costs from its last two numbers of samples on, and how other ways compare.

use super::super::report as tell;
use super::kept::Measured;
use super::report::rows;
use super::study::{BASELINE, Study};
use super::ways::{ADAPTIVE, APPROXIMATION, UNIFORM};
use std::fmt::Write as _;

/// How error and time go on beyond the ladder of uniform samples, from its last two steps: the error as a power of the number of
/// samples, the time as what any picture takes and so much for each sample.
struct Trend {
    /// The error falls as `samples^-power`.
    power: f64,
    samples: f64,
    error: f64,
    /// In the time of the baseline, as ratios are.
    fixed: f64,
    each: f64,
}

/// The slowest that an error may fall with the number of samples for a price to be told of it, as a power: chance alone gives 1/2.
const SLOWEST: f64 = 0.25;

/// From this much on the times of a picture drawn twice in a row are too far apart to be relied on.
const UNSTEADY: f64 = 0.15;

/// From this part of a picture's error on, that of the converged one rules what is measured.
const RULED: f64 = 0.5;

/// An error this small is what single precision rounds.
pub(super) const ROUNDING: f64 = 5e-7;

/// The error of a picture, of which its difference from a converged one is measured that is wrong itself, by so much and by chance.
fn own(difference: f64, converged: f64) -> f64 {
    (difference * difference - converged * converged).max(0.0).sqrt()
}

impl Trend {
    /// From pictures that differ by their `true_rms` from a `converged` one with that error. None where more samples took no more
    /// time, or made the error hardly smaller.
    fn of(before: &Measured, last: &Measured, converged: f64) -> Option<Self> {
        let [more, error] = [before, last].map(|row| own(row.true_rms, converged));
        let power = libm::log(more / error) / libm::log(last.samples / before.samples);
        let each = (last.ratio - before.ratio) / (last.samples - before.samples);
        // More than in proportion is chance, or memory.
        let each = each.min(last.ratio / last.samples);
        let fixed = last.ratio - each * last.samples;
        let is_known = power.is_finite() && power > SLOWEST && each.is_finite() && each > 0.0;
        is_known.then_some(Self { power, samples: last.samples, error, fixed, each })
    }

    /// What a picture with this error takes, as a ratio.
    fn ratio_of(&self, error: f64) -> f64 {
        self.fixed + self.each * self.samples * libm::pow(self.error / error, 1.0 / self.power)
    }
}

/// The last two steps of the ladder, in plain words.
pub(super) fn sentence(study: &Study<'_>) -> String {
    let uniform = rows(study, UNIFORM);
    let [.., before, last] = uniform.as_slice() else {
        return format!(
            "Of uniform samples {} of the two measurements that a price needs {} there, and no time was left for {} more: the same \
             command goes on.",
            uniform.len(),
            if uniform.len() == 1 { "is" } else { "are" },
            study.left
        );
    };
    if last.true_rms <= ROUNDING {
        let few = uniform.iter().rev().take_while(|row| row.true_rms <= ROUNDING).last().unwrap_or(last);
        return format!(
            "A picture of {:.0} samples is the converged one, to the last digit: there is no error to pay for.",
            few.samples
        );
    }
    let converged = study.table.converged_rms.unwrap_or(0.0);
    let is_ruled = converged > RULED * last.true_rms;
    let trend = Trend::of(before, last, converged).filter(|_| !is_ruled);
    let mut words = match &trend {
        Some(trend) => format!(
            "Halving the error from here ({} in {}) costs {:.1} times as long.",
            tell::rms(last.true_rms),
            duration(last.seconds),
            trend.ratio_of(0.5 * trend.error) / last.ratio
        ),
        None if is_ruled => format!(
            "With {:.0} samples the picture differs by {} from the converged one, and takes {}; what half the error costs was not measured.",
            last.samples,
            tell::rms(last.true_rms),
            duration(last.seconds)
        ),
        None if last.ratio <= before.ratio => format!(
            "From {:.0} to {:.0} samples the error goes from {} to {} in no more time: what any picture takes is nearly all of it, and \
             what more samples cost was not measured.",
            before.samples,
            last.samples,
            tell::rms(before.true_rms),
            tell::rms(last.true_rms)
        ),
        None => format!(
            "Up to {:.0} samples more time hardly makes the error of {} smaller; what more for all of the picture would do was not measured.",
            last.samples,
            tell::rms(last.true_rms)
        ),
    };
    if uniform.len() == 2 && trend.is_some() {
        words.push_str(" That is by two numbers of samples alone.");
    }
    let adaptive = rows(study, ADAPTIVE).into_iter().min_by(|a, b| a.true_rms.total_cmp(&b.true_rms));
    if let Some(adaptive) = adaptive.filter(|row| trend.is_some() || row.true_rms < last.true_rms) {
        let same = trend.as_ref().map(|trend| trend.ratio_of(own(adaptive.true_rms, converged)));
        let than = match same.filter(|same| same.is_finite() && *same > 0.0) {
            Some(same) => format!(
                ", {:.0} % of the time that uniform ones take for the same error, each over a picture drawn just before it",
                100.0 * adaptive.ratio / same
            ),
            None => String::new(),
        };
        let reached = match adaptive.true_rms {
            ..=ROUNDING => "the converged picture".to_owned(),
            error => tell::rms(error),
        };
        let _ = write!(
            words,
            " Samples where they help most reach {reached} in {}{than}.",
            duration(adaptive.seconds)
        );
    }
    let itself = uniform.iter().find(|row| row.samples == f64::from(BASELINE));
    if let Some(off) = itself.map(|row| (row.ratio - 1.0).abs()).filter(|off| *off > UNSTEADY) {
        let _ = write!(
            words,
            " The machine was not steady: the same {BASELINE} samples drawn twice in a row took times {:.0} % apart, so times say little.",
            100.0 * off
        );
    }
    if converged > 0.2 * last.true_rms {
        let _ = write!(
            words,
            " The converged picture itself is wrong by about {}: errors that are not far larger are not to be relied on.",
            tell::rms(converged)
        );
    }
    if study.left > 0 {
        let _ = write!(
            words,
            " There was no time for {}; the same command goes on.",
            if study.left == 1 {
                "one more measurement".to_owned()
            } else {
                format!("{} more measurements", study.left)
            }
        );
    }
    words.push_str(&of_a_blurred_pinhole(&rows(study, APPROXIMATION), converged));
    words
}

/// What pinhole pictures with a blur are wrong by, and what of it no time takes away: with so many times the samples chance's square
/// falls by as much at least, and the rest stays, less what the converged picture is wrong by.
fn of_a_blurred_pinhole(rows: &[&Measured], converged: f64) -> String {
    let [first, .., last] = rows else { return String::new() };
    let (seconds, wrong) = (duration(last.seconds), last.true_rms);
    let more = last.samples / first.samples;
    let stays = (more * wrong * wrong - first.true_rms * first.true_rms).max(0.0) / (more - 1.0);
    match own(stays.sqrt(), converged) {
        stays if stays > 0.5 * wrong => {
            format!(
                " A pinhole picture of {:.0} samples with a blur is done in {seconds}, and stays wrong by {} or more, whatever the time.",
                last.samples,
                tell::rms(stays)
            )
        }
        _ => format!(
            " A pinhole picture of {:.0} samples with a blur is done in {seconds}, and wrong by {}, which may be chance.",
            last.samples,
            tell::rms(wrong)
        ),
    }
}

/// A time as words give it.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        1.0.. => format!("{seconds:.1} s"),
        0.01.. => format!("{:.0} ms", 1e3 * seconds),
        _ => format!("{:.2} ms", 1e3 * seconds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(samples: f64, true_rms: f64, ratio: f64) -> Measured {
        Measured {
            way: UNIFORM.to_owned(),
            setting: format!("N = {samples}"),
            samples,
            true_rms,
            stated_rms: None,
            seconds: ratio,
            seconds_low: ratio,
            seconds_high: ratio,
            ratio,
        }
    }

    #[test]
    fn what_stays_of_a_blurred_pinhole_is_neither_chance_nor_the_converged_pictures_own() {
        let said = |few: f64, many: f64, converged| {
            of_a_blurred_pinhole(&[&row(16.0, few, 1.0), &row(256.0, many, 2.0)], converged)
        };
        // 0.3 that stays, and 0.4 of chance with 16 samples.
        assert!(said(0.5, (0.09_f64 + 0.16 / 16.0).sqrt(), 0.0).contains("stays wrong by 0.3000"));
        assert!(said(0.4, 0.1, 0.0).contains("may be chance"));
        assert!(said(0.001, 0.0006, 0.0005).contains("may be chance"));
        assert_eq!(of_a_blurred_pinhole(&[], 0.0), "");
    }

    #[test]
    fn the_price_of_half_the_error_has_no_fixed_cost_in_it_twice() {
        // Pure chance: an error of N^-1/2, so four times the samples. What any picture takes is 0.9 of the time of 64 samples.
        let at = |n: f64| row(n, 0.1 / n.sqrt(), 0.9 + 0.1 * n / 64.0);
        let trend = Trend::of(&at(64.0), &at(256.0), 0.0).unwrap();
        let want = at(1024.0).ratio;
        assert!((trend.ratio_of(0.5 * at(256.0).true_rms) / want - 1.0).abs() < 1e-12);
        assert!((trend.ratio_of(at(16.0).true_rms) / at(16.0).ratio - 1.0).abs() < 1e-12);
        // What the converged picture is wrong by is in all differences.
        let with = |row: Measured| Measured { true_rms: libm::hypot(row.true_rms, 0.003), ..row };
        let found = Trend::of(&with(at(64.0)), &with(at(256.0)), 0.003).unwrap();
        assert!((found.power - 0.5).abs() < 1e-9 && (found.error - trend.error).abs() < 1e-12);
        // More than in proportion counts as in proportion; no more time, or no less error, tells nothing.
        let dear = Trend::of(&at(64.0), &row(256.0, 0.1 / 16.0, 8.0), 0.0).unwrap();
        assert!((dear.ratio_of(0.1 / 32.0) / 32.0 - 1.0).abs() < 1e-12);
        assert!(Trend::of(&at(64.0), &row(256.0, 0.1 / 16.0, 1.0), 0.0).is_none());
        assert!(Trend::of(&at(64.0), &row(256.0, 0.1 / 8.0, 4.0), 0.0).is_none());
    }
}
