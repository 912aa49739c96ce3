//! The same number of samples for every pixel: tile by tile, each drawn once and resolved at once.
//!
//! In: a [`Prepared`] and a number of samples. Out: the exposure: means and, of two samples or more, the stated error
//! `sqrt(sum of squared errors / (3 width height))`. Each tile goes through [`super::draw`], [`super::resolve`] and
//! [`super::highlights`].

use super::draw::{TILES_AT_ONCE, TileSums, Work};
use super::highlights::Raised;
use super::pattern::Splits;
use super::prepared::Prepared;
use super::resolve::{AREA, Sum, means_of};
use super::room::zeroed;
use super::scratch::{Borrowed, Step};
use super::stages::Stopwatch;
use super::{Counts, Execution, cancelled, done};
use crate::error::Result;
use crate::picture::{Allocation, Exposure};
use crate::raster::visibility::EVERYWHERE;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

impl Prepared<'_> {
    /// Draws `samples` samples of every pixel.
    pub(super) fn uniform(
        &self,
        samples: u32,
        execution: &Execution<'_>,
        mut counts: Counts,
    ) -> Result<(Exposure, Counts)> {
        let tiles = self.tiles();
        let mut pixels = zeroed::<[f32; 3]>(tiles * AREA)?;
        let mut errors = zeroed::<f32>(if execution.error_map { tiles * AREA } else { 0 })?;
        let finished = AtomicUsize::new(0);
        let stop = || cancelled(execution.cancel);
        let steps: Vec<Step> = Splits::steps(samples, self.diffraction.is_some())
            .into_iter()
            .map(|(run, splits)| Step { run, splits, wanted: EVERYWHERE })
            .collect();
        let work = Work { steps: &steps, is_set_up: false, alone: self.alone };
        let draw = |(scratch, sums): &mut (Borrowed<'_>, Vec<Sum>),
                    tile,
                    out: &mut [[f32; 3]],
                    mut errors: Option<&mut [f32]>| {
            if stop() {
                return Default::default();
            }
            let watch = Stopwatch::start(execution.clock);
            let (mut tally, done) = match self.drawn.iter().find(|drawn| drawn.tile == tile) {
                Some(drawn) => {
                    sums.copy_from_slice(&drawn.sums);
                    (drawn.tally, steps.len())
                }
                None => {
                    let sums = TileSums::from(&mut sums[..]);
                    self.draw_tile(scratch.get(), self.place(tile), work, sums, watch, &stop)
                }
            };
            let mut watch = Stopwatch::start(execution.clock);
            let (squared, raised) = if done < steps.len() {
                Default::default()
            } else {
                let place = self.place(tile);
                let samples = [samples; 16];
                let found = self.resolve(place, sums, &samples, errors.as_deref_mut());
                let mut stated = found;
                let raised = self.raise_unseen(place, sums, &samples, &mut stated);
                if let Some(errors) = errors {
                    self.raise_errors(place, (&found, &stated), errors);
                }
                tally.unseen_light = u64::from(raised.blocks.count_ones());
                means_of(sums, samples[0], out);
                (stated.iter().sum::<f64>(), raised)
            };
            watch.lap(&mut tally.stages.resolve);
            if let Some(progress) = execution.progress {
                progress(finished.fetch_add(1, Ordering::Relaxed) + 1, tiles);
            }
            (tally, squared, raised)
        };
        let scratch = || (self.scratch(), vec![Sum::default(); AREA]);
        let each = pixels.par_chunks_mut(AREA).enumerate().with_max_len(TILES_AT_ONCE);
        let tallies: Vec<_> = if execution.error_map {
            each.zip(errors.par_chunks_mut(AREA))
                .map_init(scratch, |scratch, ((tile, out), errors)| draw(scratch, tile, out, Some(errors)))
                .collect()
        } else {
            each.map_init(scratch, |scratch, (tile, out)| draw(scratch, tile, out, None)).collect()
        };
        if stop() {
            return Err(super::stopped());
        }
        // Tile by tile in order: the same sum whatever the threads did.
        let raised = tallies.iter().fold(Raised::default(), |all, (_, _, raised)| all.and(raised));
        let stated = tallies.iter().map(|(_, squared, _)| squared).sum::<f64>();
        let squared = stated - if self.spreads_lights() { raised.too_much() } else { 0.0 };
        if squared < stated {
            // The map adds up to the picture's error.
            let less = (squared / stated).sqrt() as f32;
            errors.par_iter_mut().for_each(|error| *error *= less);
        }
        for (tally, ..) in &tallies {
            counts.shading_requests += tally.requests;
            counts.unseen_light += tally.unseen_light;
            counts.stages.add(&tally.stages);
        }
        let allocation = Allocation::Uniform(samples);
        let rms = (samples > 1).then(|| (squared / self.values()).sqrt());
        Ok(done(self, (pixels, errors), rms, allocation, counts))
    }
}
