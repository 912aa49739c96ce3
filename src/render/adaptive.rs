//! Samples where they help most: rounds of all tiles, each of which gives blocks of pixels the runs of samples that take
//! most from the picture's error, until an error is reached or time is up.
//!
//! What a block shows depends on its number of samples alone, so a list of these numbers makes the picture again.

use super::allocate::{self, Block, Goal, LATER, USUAL_FALL, allocate, cost, fall, first_work};
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

/// The most samples of a pixel on the way to an error: sixty-four times the usual number takes an eighth or less of its
/// error, and a target beyond is told as out of reach.
pub const MOST_FOR_ERROR: u32 = 16_384;

/// The stated error that ends a picture, as a part of the one asked for: what stops early is more often estimated too low
/// than too high. (Without, 11 of 40 small pictures had an error up to 1.1 times the one asked for.)
const MARGIN: f64 = 0.97;

/// What a round aims at, as a part of the squared error that is to be reached: falling short by little costs another round.
const AIM: f64 = 0.97;

/// How many standard deviations of the estimate are kept from the goal. A block's squared error is taken to be as
/// uncertain as it is large.
const DEVIATIONS: f64 = 1.6;

/// What came of a picture within a time.
pub(super) enum Timed {
    Done(Box<(Exposure, Counts)>),
    /// There is only time for so many samples of each pixel, drawn otherwise.
    TooShort(u32),
}

/// One in so many tiles is drawn first, to see how long the picture takes; of a small picture more, so that there are this
/// many.
const PILOT: usize = 11;
const PILOT_TILES: usize = 12;

/// Where so many times the pilot's samples are needed, it goes on to four times as many, to see how the error falls.
const FAR: u32 = 8;

/// What numbers of samples below [`FIRST_RUN`] take of its time, about (Sponza at 1280 x 1024).
const FEWER: [(u32, f64); 4] = [(8, 0.8), (4, 0.65), (2, 0.5), (1, 0.0)];

/// The picture as far as it is.
struct Progressive<'a> {
    picture: &'a Picture<'a>,
    sums: Vec<Vec<[Vec3; 2]>>,
    samples: BlockSamples,
    errors: Vec<f64>,
    /// What a sample takes in each tile, as its first run found: see [`allocate::cost`].
    costs: Vec<f64>,
    counts: Counts,
}

impl<'a> Picture<'a> {
    /// Draws until the error is reached.
    pub(super) fn until_error(
        &'a self,
        error: f64,
        execution: &Execution<'_>,
        counts: Counts,
    ) -> Result<(Exposure, Counts)> {
        let mut progressive = Progressive::new(self, counts)?;
        progressive.until_error(error, execution)?;
        progressive.finish(execution)
    }

    /// Draws from `start` until the time is up. Where there is no time for the first samples of every pixel, only tells how many
    /// there is time for.
    pub(super) fn until_clock(
        &'a self,
        (start, end): (f64, f64),
        execution: &Execution<'_>,
        counts: Counts,
    ) -> Result<Timed> {
        let mut progressive = Progressive::new(self, counts)?;
        match progressive.until_clock(start, end, execution)? {
            Some(samples) => Ok(Timed::TooShort(samples)),
            None => progressive.finish(execution).map(|done| Timed::Done(Box::new(done))),
        }
    }

    /// Draws exactly these numbers of samples.
    pub(super) fn allocated(
        &'a self,
        samples: &BlockSamples,
        execution: &Execution<'_>,
        counts: Counts,
    ) -> Result<(Exposure, Counts)> {
        let mut progressive = Progressive::new(self, counts)?;
        let wanted = progressive.by_block(|x, y| samples.get(x, y));
        let (width, height) = samples.size();
        progressive.samples = BlockSamples::new(width, height, samples.base());
        progressive.round(&wanted, execution, &|| false)?;
        progressive.finish(execution)
    }
}

impl<'a> Progressive<'a> {
    fn new(picture: &'a Picture<'a>, counts: Counts) -> Result<Self> {
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
    fn by_block<T>(&self, number: impl Fn(u32, u32) -> T) -> Vec<T> {
        let (columns, rows) = self.samples.columns_and_rows();
        (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| number(x, y)).collect()
    }

    fn blocks(&self) -> Vec<Block> {
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
    fn squared_error(&self) -> f64 {
        self.errors.iter().sum()
    }

    /// How uncertain the sum of squared errors is, as a part of it.
    fn uncertainty(&self) -> f64 {
        let sum = self.squared_error();
        let squares: f64 = self.errors.iter().map(|error| error * error).sum();
        if sum > 0.0 { DEVIATIONS * squares.sqrt() / sum } else { 0.0 }
    }

    fn until_error(&mut self, error: f64, execution: &Execution<'_>) -> Result<()> {
        let columns = self.samples.columns_and_rows().0 as usize;
        let entries = self.entries_per_pixel();
        let mut pilot = self.pilot(execution)?;
        let seen: f64 = pilot.iter().map(|block| f64::from(block.pixels)).sum();
        let goal = Goal::Error(MARGIN * MARGIN * error * error * 3.0 * seen);
        let mut falling = USUAL_FALL;
        let mut base = allocate::base(&pilot, goal, falling, MOST_FOR_ERROR, entries);
        if base >= FAR * FIRST_RUN {
            let wanted: Vec<u32> = self.blocks().iter().map(|block| 4 * block.samples).collect();
            self.round(&wanted, execution, &|| false)?;
            let more = self.seen_blocks();
            falling = fall(&pilot, &more);
            pilot = more;
            base = allocate::base(&pilot, goal, falling, MOST_FOR_ERROR, entries);
        }
        self.begin(base, execution)?;
        let mut before = Vec::<Block>::new();
        loop {
            let goal = MARGIN * MARGIN * error * error * self.picture.values() / (1.0 + self.uncertainty());
            if self.squared_error() <= goal {
                return Ok(());
            }
            let blocks = self.blocks();
            if !before.is_empty() {
                falling = fall(&before, &blocks);
            }
            let mut wanted = allocate(&blocks, columns, Goal::Error(AIM * goal), falling, MOST_FOR_ERROR);
            if wanted.iter().zip(&blocks).all(|(&wanted, block)| wanted <= block.samples) {
                // What was predicted is there and was not enough: ask for less, or be at the limit.
                wanted = allocate(&blocks, columns, Goal::Error(0.8 * goal), falling, MOST_FOR_ERROR);
                if wanted.iter().zip(&blocks).all(|(&wanted, block)| wanted <= block.samples) {
                    return Ok(());
                }
            }
            self.round(&wanted, execution, &|| false)?;
            before = blocks;
        }
    }

    /// Draws the first run in some tiles, which tell how long the picture takes and where its error is.
    fn pilot(&mut self, execution: &Execution<'_>) -> Result<Vec<Block>> {
        let tiles_x = self.picture.bins.tiles_x as usize;
        let stride = (self.sums.len() / PILOT_TILES).clamp(1, PILOT);
        let is_pilot =
            |x: u32, y: u32| ((y / BLOCKS) as usize * tiles_x + (x / BLOCKS) as usize).is_multiple_of(stride);
        let wanted = self.by_block(|x, y| if is_pilot(x, y) { FIRST_RUN } else { 0 });
        self.round(&wanted, execution, &|| false)?;
        Ok(self.seen_blocks())
    }

    /// Those that have samples.
    fn seen_blocks(&self) -> Vec<Block> {
        self.blocks().into_iter().filter(|block| block.samples > 0).collect()
    }

    /// Begins again with so many samples at once for every pixel.
    fn begin(&mut self, base: u32, execution: &Execution<'_>) -> Result<()> {
        if base != self.samples.base() {
            let (width, height) = self.samples.size();
            self.samples = BlockSamples::new(width, height, base);
            self.sums.iter_mut().for_each(Vec::clear);
            self.errors.fill(0.0);
            self.costs.fill(0.0);
        }
        self.round(&vec![base; self.errors.len()], execution, &|| false)
    }

    /// Entries of the tiles' bins for each pixel: how dear it is to begin a tile again.
    fn entries_per_pixel(&self) -> f64 {
        self.picture.bins.entries() as f64 / self.pixels()
    }

    fn pixels(&self) -> f64 {
        f64::from(self.picture.view.width) * f64::from(self.picture.view.height)
    }

    /// Draws until the time is up; where there is no time for the first run, the number of samples that there is time for.
    fn until_clock(&mut self, start: f64, end: f64, execution: &Execution<'_>) -> Result<Option<u32>> {
        let clock = execution.clock.unwrap_or(&|| 0.0);
        let late = || clock() >= end;
        let columns = self.samples.columns_and_rows().0 as usize;
        let pixels = self.pixels();
        let begun = clock();
        let entries = self.entries_per_pixel();
        let pilot = self.pilot(execution)?;
        let seen: f64 = pilot.iter().map(|block| f64::from(block.pixels)).sum();
        let took = (clock() - begun).max(1e-9);
        let left = end - clock();
        let rest = took * (pixels - seen) / seen;
        if rest > left {
            let few = FEWER.iter().find(|(_, part)| part * rest <= left);
            return Ok(Some(few.map_or(1, |&(samples, _)| samples)));
        }
        // Of a larger first run more samples are drawn in a time; what is left over goes into rounds.
        let goal = Goal::Work(left / took * first_work(&pilot, FIRST_RUN) * seen / pixels);
        let base = allocate::base(&pilot, goal, USUAL_FALL, allocate::MOST_FOR_TIME, entries);
        let begun = clock();
        self.begin(base, execution)?;
        let mut rate = first_work(&self.blocks(), base) / (clock() - begun).max(1e-9) / LATER;
        // A round takes what its predecessor's speed says, the first no more than a third of what is left: its errors
        // tell better where the rest should go.
        let mut share = 0.35;
        loop {
            let left = end - clock();
            if left <= 0.004 * (end - start) {
                return Ok(None);
            }
            let blocks = self.blocks();
            let goal = Goal::Work(share * left * rate);
            let wanted = allocate(&blocks, columns, goal, USUAL_FALL, allocate::MOST_FOR_TIME);
            let more = |(wanted, block): (&u32, &Block)| block.work(wanted - block.samples);
            let planned: f64 = wanted.iter().zip(&blocks).map(more).sum();
            if planned == 0.0 {
                if share >= 1.0 {
                    return Ok(None);
                }
                share = 1.0;
                continue;
            }
            let begun = clock();
            self.round(&wanted, execution, &late)?;
            rate = planned / (clock() - begun).max(1e-9);
            share = 0.9;
        }
    }

    /// Gives each block the samples `wanted`, as far as `late` allows.
    fn round(
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

    fn finish(self, execution: &Execution<'_>) -> Result<(Exposure, Counts)> {
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
