//! Runs of the sample sequence: the steps in which a block of pixels may go on, so that a picture that stops where
//! it is good enough is made of the same samples, in the same order, however it came to stop there.
//!
//! A run is an aligned stretch of both halves of the sequence, so each is well distributed by itself.

/// Samples `first..first + count` of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The number of the first sample.
    pub first: u32,
    /// How many there are.
    pub count: u32,
}

/// The first run: fewer samples cost hardly less, since 16 are drawn at once.
pub const FIRST_RUN: u32 = 16;

/// The fewest samples of what shows nothing but the sky: they have two halves, by which the error is known.
pub const SKY_RUN: u32 = 2;

/// The only runs of what shows nothing but the sky, where so few are enough. None goes on from them: of 16 samples, all are drawn as
/// everywhere else.
pub const SKY_RUNS: [u32; 3] = [SKY_RUN, 4, 8];

/// The most samples that runs lead to.
pub const MOST_SAMPLES: u32 = 1 << 20;

impl Run {
    /// The run that follows `samples` samples: 16, 16, 32, 64, then two to each doubling. (Two runs of 32 take a quarter
    /// longer than one of 64.)
    ///
    /// `samples` is a number that runs lead to: 0, 16, 32, 64, 128, 192, 256, 384 and so on.
    pub fn after(samples: u32) -> Self {
        let count = match samples {
            0..FIRST_RUN => FIRST_RUN,
            FIRST_RUN..128 => samples,
            _ => 1 << (samples.ilog2() - 1),
        };
        Self { first: samples, count }
    }

    /// How many samples there are after it, as far as a number holds them.
    pub fn end(self) -> u32 {
        self.first.saturating_add(self.count)
    }

    /// All runs that lead from `from` samples to at least `to`.
    pub fn between(from: u32, to: u32) -> impl Iterator<Item = Self> {
        let mut done = from;
        std::iter::from_fn(move || {
            (done < to).then(|| {
                let run = Self::after(done);
                done = run.end();
                run
            })
        })
    }
}

/// Whether runs lead to exactly this many samples.
pub fn is_reached(samples: u32) -> bool {
    samples <= MOST_SAMPLES && Run::between(0, samples).last().is_none_or(|run| run.end() == samples)
}

/// Whether a block may have exactly this many.
pub fn is_of_block(samples: u32) -> bool {
    SKY_RUNS.contains(&samples) || (samples > 0 && is_reached(samples))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_follow_one_another_and_are_aligned() {
        let ends: Vec<u32> = Run::between(0, 1024).map(Run::end).collect();
        assert_eq!(ends, [16, 32, 64, 128, 192, 256, 384, 512, 768, 1024]);
        for run in Run::between(0, MOST_SAMPLES) {
            assert!(run.count.is_power_of_two() && run.first % run.count == 0, "{run:?}");
        }
        assert_eq!(Run::between(0, MOST_SAMPLES).last().map(Run::end), Some(MOST_SAMPLES));
        assert_eq!(Run::between(0, u32::MAX).last().map(Run::end), Some(u32::MAX));
        assert!(is_reached(0) && is_reached(192) && !is_reached(96) && !is_reached(MOST_SAMPLES + 1));
        assert!(
            [2, 4, 8, 16, 192].into_iter().all(is_of_block) && ![0, 1, 3, 96].into_iter().any(is_of_block)
        );
    }
}
