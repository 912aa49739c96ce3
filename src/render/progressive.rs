//! A picture as far as it is, and the rounds that take it on: each gives blocks of pixels more samples.
//!
//! What a block shows depends on its number of samples alone, so a list of these numbers makes the picture again.

use super::allocate::{Block, cost};
use super::draw::{Step, TILES_AT_ONCE, Tally};
use super::pattern::Splits;
use super::picture::Picture;
use super::resolve::{BLOCKS, ByBlock};
use super::stages::Stopwatch;
use super::uniform::zeroed;
use super::{Counts, Execution, cancelled, done, stopped};
use crate::error::Result;
use crate::picture::{Allocation, BLOCK, BlockSamples, Exposure};
use crate::raster::TILE;
use crate::sampling::runs::{FIRST_RUN, Run};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The picture as far as it is.
pub(super) struct Progressive<'a> {
    pub picture: &'a Picture<'a>,
    sums: Vec<Vec<[Vec3; 2]>>,
    pub samples: BlockSamples,
    /// Block by block the sum of squared errors over its pixels and channels.
    pub errors: Vec<f64>,
    /// What a sample takes in each tile, as its first run found: see [`allocate::cost`].
    costs: Vec<f64>,
    counts: Counts,
}

impl<'a> Progressive<'a> {
    pub(super) fn new(picture: &'a Picture<'a>, counts: Counts) -> Result<Self> {
        let samples = BlockSamples::new(picture.view.width, picture.view.height, FIRST_RUN);
        let tiles = picture.tiles();
        // Asked for at once and given back: better a refusal now than an abort half-way.
        zeroed(tiles * (TILE * TILE) as usize, [[0.0f32; 3]; 3])?;
        let (columns, rows) = samples.columns_and_rows();
        let errors = zeroed(columns as usize * rows as usize, 0.0)?;
        let costs = zeroed(tiles, 0.0)?;
        Ok(Self { picture, sums: vec![Vec::new(); tiles], samples, errors, costs, counts })
    }

    /// A number for each block of the picture.
    pub(super) fn by_block<T>(&self, number: impl Fn(u32, u32) -> T) -> Vec<T> {
        let (columns, rows) = self.samples.columns_and_rows();
        (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| number(x, y)).collect()
    }

    pub(super) fn blocks(&self) -> Vec<Block> {
        let (width, height) = self.samples.size();
        let (columns, _) = self.samples.columns_and_rows();
        self.by_block(|x, y| Block {
            pixels: BLOCK.min(width - x * BLOCK) * BLOCK.min(height - y * BLOCK),
            samples: self.samples.get(x, y),
            error: self.errors[(y * columns + x) as usize],
            cost: self.costs[(y / BLOCKS * self.picture.bins.tiles_x + x / BLOCKS) as usize],
        })
    }

    /// The sum of squared errors, block by block in order: the same whatever the threads did.
    pub(super) fn squared_error(&self) -> f64 {
        self.errors.iter().sum()
    }

    /// Those that have samples.
    pub(super) fn seen_blocks(&self) -> Vec<Block> {
        self.blocks().into_iter().filter(|block| block.samples > 0).collect()
    }

    /// Begins again with so many samples at once for every pixel.
    pub(super) fn begin(&mut self, base: u32, execution: &Execution<'_>) -> Result<()> {
        if base != self.samples.base() {
            let (width, height) = self.samples.size();
            self.samples = BlockSamples::new(width, height, base);
            self.sums.iter_mut().for_each(Vec::clear);
            self.errors.fill(0.0);
            self.costs.fill(0.0);
        }
        self.round(&vec![base; self.errors.len()], execution, &|| false)
    }

    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.picture.view.width) * f64::from(self.picture.view.height)
    }

    /// Gives each block the samples `wanted`, as far as `late` allows.
    pub(super) fn round(
        &mut self,
        wanted: &[u32],
        execution: &Execution<'_>,
        late: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        let (columns, rows) = self.samples.columns_and_rows();
        let (picture, samples) = (self.picture, &self.samples);
        let finished = AtomicUsize::new(0);
        let tiles = self.sums.len();
        let stop = || cancelled(execution) || late();
        let results: Vec<_> = self
            .sums
            .par_iter_mut()
            .enumerate()
            .with_max_len(TILES_AT_ONCE)
            .map_init(
                || picture.scratch(),
                |scratch, (tile, sums)| {
                    let (tx, ty) = picture.place(tile);
                    let inside = |block: usize| {
                        let (x, y) =
                            (tx * BLOCKS + block as u32 % BLOCKS, ty * BLOCKS + block as u32 / BLOCKS);
                        (x < columns && y < rows).then_some((x, y))
                    };
                    let mut now = ByBlock::<u32>::default();
                    let mut then = now;
                    for block in 0..now.len() {
                        if let Some((x, y)) = inside(block) {
                            now[block] = samples.get(x, y);
                            then[block] = wanted[(y * columns + x) as usize].max(now[block]);
                        }
                    }
                    let steps = steps(samples.base(), now, then);
                    let result = (!steps.is_empty() && !stop()).then(|| {
                        let watch = Stopwatch::start(execution.clock);
                        let (mut tally, count) =
                            picture.draw_tile(scratch.get(), (tx, ty), &steps, sums, watch, &stop);
                        let mut watch = Stopwatch::start(execution.clock);
                        let end = count.checked_sub(1).map_or(0, |last| steps[last].run.end());
                        let reached: ByBlock<u32> =
                            std::array::from_fn(|block| now[block].max(then[block].min(end)));
                        let changed = std::array::from_fn(|block| match reached[block] {
                            reached if reached > now[block] => reached,
                            _ => 0,
                        });
                        let mut resolved = picture.resolve((tx, ty), sums, &changed, None, None);
                        picture.highlights.raise((tx, ty), &changed, &mut resolved);
                        watch.lap(&mut tally.stages.resolve);
                        (tally, changed, resolved.squared)
                    });
                    if let Some(progress) = execution.progress {
                        progress(finished.fetch_add(1, Ordering::Relaxed) + 1, tiles);
                    }
                    result
                },
            )
            .collect();
        if cancelled(execution) {
            return Err(stopped());
        }
        for (tile, result) in results.into_iter().enumerate() {
            let (Some((tally, changed, errors)), (tx, ty)) = (result, picture.place(tile)) else { continue };
            self.add(&tally);
            if self.costs[tile] == 0.0 {
                self.costs[tile] = cost(tally.samples, tally.requests, tally.triangles);
            }
            for block in (0..changed.len()).filter(|&block| changed[block] > 0) {
                let (x, y) = (tx * BLOCKS + block as u32 % BLOCKS, ty * BLOCKS + block as u32 / BLOCKS);
                self.samples.set(x, y, changed[block]);
                self.errors[(y * columns + x) as usize] = errors[block];
            }
        }
        Ok(())
    }

    fn add(&mut self, tally: &Tally) {
        self.counts.shading_requests += tally.requests;
        self.counts.stages.add(&tally.stages);
    }

    pub(super) fn finish(self, execution: &Execution<'_>) -> Result<(Exposure, Counts)> {
        let (area, picture, samples) = ((TILE * TILE) as usize, self.picture, &self.samples);
        let mut pixels = zeroed(self.sums.len() * area, [0.0f32; 3])?;
        let mut errors = zeroed(self.sums.len() * area, 0.0f32)?;
        let tiles = pixels.par_chunks_mut(area).zip(errors.par_chunks_mut(area)).zip(&self.sums).enumerate();
        let unseen: u64 = tiles
            .map(|(tile, ((out, errors), sums))| {
                let (tx, ty) = picture.place(tile);
                let samples = std::array::from_fn(|block| {
                    samples.get(tx * BLOCKS + block as u32 % BLOCKS, ty * BLOCKS + block as u32 / BLOCKS)
                });
                let mut resolved = picture.resolve((tx, ty), sums, &samples, Some(out), Some(errors));
                u64::from(picture.highlights.raise((tx, ty), &samples, &mut resolved))
            })
            .sum();
        let counts = Counts { unseen_light: unseen, ..self.counts };
        let rms = Some((self.squared_error() / picture.values()).sqrt());
        if !execution.error_map {
            errors = Vec::new();
        }
        Ok(done(picture, (pixels, errors), rms, Allocation::Blocks(self.samples), counts))
    }
}

/// The runs that lead each block of a tile from `now` to `then` samples, the first of `base`, each with the regions that
/// take part.
fn steps(base: u32, now: ByBlock<u32>, then: ByBlock<u32>) -> Vec<Step> {
    let going = || now.into_iter().zip(then).filter(|(now, then)| now < then);
    let from = going().map(|(now, _)| now).min().unwrap_or(0);
    let to = going().map(|(_, then)| then).max().unwrap_or(0);
    let first = (from == 0).then_some(Run { first: 0, count: base });
    first
        .into_iter()
        .chain(Run::between(from.max(base), to))
        .map(|run| {
            let takes_part = |&block: &usize| now[block] <= run.first && then[block] >= run.end();
            let wanted = (0..now.len()).filter(takes_part).map(regions).fold(0, |sum, bits| sum | bits);
            Step { run, splits: Splits::of_run(run), wanted }
        })
        .filter(|step| step.wanted != 0)
        .collect()
}

/// The four regions of 4 x 4 pixels of a block.
fn regions(block: usize) -> u64 {
    let (column, row) = (block as u32 % BLOCKS * 2, block as u32 / BLOCKS * 2);
    0b11 << (8 * row + column) | 0b11 << (8 * (row + 1) + column)
}
