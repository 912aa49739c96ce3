//! Times too short for the samples that a picture which goes on begins with, [`crate::sampling::runs::FIRST_RUN`]: how many there is
//! time for, and a picture of as many.
//!
//! In: what the rest would take by the word of the pilot ([`super::pilot`]), and when to end. Out: a uniform picture.

use super::{Counts, Execution, replay};
use crate::error::Result;
use crate::picture::{Allocation, Exposure};
use crate::scene::Scene;

/// What numbers of samples below [`crate::sampling::runs::FIRST_RUN`] take of its time, about (Sponza at 1280 x 1024). What it is in a
/// scene, 0.14 to 0.8 for two samples, is not found out: to draw some of its tiles with two took 0.08 s, and a picture of 0.2 s was late.
const FEWER: [(u32, f64); 4] = [(8, 0.8), (4, 0.65), (2, 0.5), (1, 0.0)];

/// Fewer samples than a picture begins with that goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Few {
    pub samples: u32,
    /// Seconds that come before the first sample, of any picture of the scene.
    pub before: f64,
}

/// Numbers of samples that a picture has for which there is no time to begin with [`crate::sampling::runs::FIRST_RUN`].
const FEW: [u32; 6] = [8, 6, 4, 3, 2, 1];

/// Draws so many samples of each pixel, and again more of them as long as there is time for more until `end`: what few samples take is
/// known only when they are drawn. (One sample was all that 1.1 s of a scene brought of which eight take 0.95.)
pub(super) fn as_many_as_fit(
    scene: &Scene,
    mut few: Few,
    end: f64,
    execution: Execution<'_>,
) -> Result<(Exposure, Counts)> {
    let clock = execution.clock.unwrap_or(&|| 0.0);
    loop {
        let begun = clock();
        let done = replay(scene, &Allocation::Uniform(few.samples), execution)?;
        let now = clock();
        match few.more_that_fit(now - begun, end - now) {
            Some(samples) => few.samples = samples,
            None => return Ok(done),
        }
    }
}

impl Few {
    /// As many as there is time for where `left` is left, the first run of a picture that goes on would take `rest`, and what comes
    /// before it takes `before`.
    pub(super) fn that_fit(before: f64, rest: f64, left: f64) -> Self {
        let few = FEWER.iter().find(|(_, part)| before + part * rest <= left);
        Self { samples: few.map_or(1, |&(samples, _)| samples), before }
    }

    /// How many more samples there is time for, where these took so long. Half of what came before the first picture is taken for what
    /// comes before each: memory is touched for the first time there, and the second sample may take longer than the first.
    fn more_that_fit(self, took: f64, left: f64) -> Option<u32> {
        let each = (took - 0.5 * self.before).max(0.0) / f64::from(self.samples);
        let time = |samples: u32| took + each * f64::from(samples - self.samples);
        FEW.into_iter().find(|&more| more > self.samples && time(more) <= left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_samples_are_drawn_only_where_there_is_time_for_all_of_them() {
        let fit = |samples, before, took, left| Few { samples, before }.more_that_fit(took, left);
        assert_eq!(fit(1, 0.0, 0.2, 0.65), Some(3));
        assert_eq!(fit(1, 0.0, 0.2, 0.39), None);
        // 0.075 before the first, 0.125 for each: two take 0.325.
        assert_eq!(fit(1, 0.15, 0.2, 0.37), Some(2));
        assert_eq!(fit(1, 0.15, 0.2, 0.32), None);
        assert_eq!(fit(2, 0.0, 0.2, 10.0), Some(8));
        assert_eq!(fit(8, 0.0, 0.2, 10.0), None);
        assert_eq!(fit(4, 0.0, 0.2, -1.0), None);
        // A clock that ran otherwise: no more than it took.
        assert_eq!(fit(4, 0.5, 0.2, 0.1), None);
    }
}
