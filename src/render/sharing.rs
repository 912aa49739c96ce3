//! Whether samples share look-ups in this picture: some of its tiles drawn both ways in, yes or no out.
//!
//! Where a texture is smooth one look-up stands for the samples of a group (`shade::texels`), and passes over what bends it there and over
//! its steps of 8 bits. That changes a picture by a hundredth of its noise, as long as anything ends in it. Of one smooth wall that
//! fills the picture the samples have next to no noise, and the change would show. So both are measured, in a few tiles evenly spread:
//! `change^2 = sum (mean_shared - mean_alone)^2`, `noise^2 = (n_e n_o / n^2) sum (even / n_e - odd / n_o)^2` of samples that look
//! by themselves. What is found goes by the scene and the number of samples alone.

use super::Execution;
use super::draw::{Step, Work};
use super::pattern::Splits;
use super::picture::{Picture, Sequence};
use super::resolve::Sum;
use super::stages::{Stages, Stopwatch};
use crate::raster::TILE;
use crate::sampling::runs::{FIRST_RUN, Run};
use glam::Vec3;
use rayon::prelude::*;

/// One tile in so many is asked, but at least `LEAST` and at most `MOST`. (Of the city eight told the ratio of change and noise to a
/// factor of two, four to a factor of four.)
const ONE_IN: usize = 160;
const LEAST: usize = 8;
const MOST: usize = 16;

/// Every other square of 4 x 4 pixels of a tile.
const SOME: u64 = 0xaa55_aa55_aa55_aa55;

/// How many times the change the noise has to be: three is the bound, and few tiles do not tell all. (All tiles of the city: 13 to 56.)
const TIMES: f64 = 5.0;

/// The same where only the first run is asked, and others may follow: from 16 samples to 256 the noise of all of the city's tiles falls 2.6
/// to 4.2 times as far as the change, that of smooth walls farther, which are quiet from the start.
const TIMES_IN_RUNS: f64 = 15.0;

impl Picture<'_> {
    /// Whether samples are to look by themselves, since sharing would show.
    pub(super) fn shows_sharing(
        &self,
        sequence: Sequence,
        execution: &Execution<'_>,
        stages: &mut Stages,
    ) -> bool {
        let mut maps = self.surfaces.materials.iter().filter_map(|material| material.diffuse_map.as_ref());
        if !self.shared || maps.all(|map| map.smooth.is_empty()) {
            return false;
        }
        let (samples, steps, times) = match sequence {
            Sequence::Uniform(samples) => {
                (samples, Splits::steps(samples, self.diffraction.is_some()), TIMES)
            }
            Sequence::Runs => {
                let first = Run { first: 0, count: FIRST_RUN };
                (FIRST_RUN, vec![(first, Splits::new(FIRST_RUN))], TIMES_IN_RUNS)
            }
        };
        let steps: Vec<_> =
            steps.into_iter().map(|(run, splits)| Step { run, splits, wanted: SOME }).collect();
        let asked = (self.tiles() / ONE_IN).clamp(LEAST, MOST).min(self.tiles());
        let found: Vec<_> = (0..asked)
            .into_par_iter()
            .with_max_len(1)
            .map_init(
                || self.scratch(),
                |scratch, at| {
                    let tile = self.place((2 * at + 1) * self.tiles() / (2 * asked));
                    let mut times = Stages::default();
                    let mut draw = |alone: bool| {
                        let mut sums = vec![Sum::default(); (TILE * TILE) as usize];
                        let watch = Stopwatch::start(execution.clock);
                        let work = Work { steps: &steps, is_set_up: alone, alone };
                        let (tally, _) =
                            self.draw_tile(scratch.get(), tile, work, &mut sums, watch, &|| self.stopped());
                        times.add(&tally.stages);
                        sums
                    };
                    let [shared, alone] = [false, true].map(&mut draw);
                    (noise_and_change(&alone, &shared, samples), times)
                },
            )
            .collect();
        found.iter().for_each(|(_, times)| stages.add(times));
        let [noise, change] = [0, 1].map(|i| found.iter().map(|(found, _)| found[i]).sum::<f64>());
        noise < times * times * change
    }
}

/// The squares of the noise of samples that look by themselves, and of what sharing changes, summed over the same pixels.
fn noise_and_change(alone: &[Sum], shared: &[Sum], samples: u32) -> [f64; 2] {
    let [n_even, n_odd] = [samples.div_ceil(2), samples / 2].map(|n| n as f32);
    let n = n_even + n_odd;
    let (mut noise, mut change) = (0.0, 0.0);
    for (&alone, &shared) in alone.iter().zip(shared) {
        let [[even, odd], [shared_even, shared_odd]] = [alone, shared].map(|halves| halves.map(Vec3::from));
        noise += f64::from((even / n_even - odd / n_odd).length_squared() * (n_even * n_odd / (n * n)));
        change += f64::from((((even + odd) - (shared_even + shared_odd)) / n).length_squared());
    }
    [noise, change]
}
