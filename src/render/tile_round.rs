//! One tile in a round: how many samples its blocks have and are to have in, the runs that lead there drawn, and what that
//! makes of their errors.
//!
//! From [`super::progressive`], and back: `error = max(found, share hidden)`, by [`super::resolve`] and [`super::edges`], raised
//! to what [`super::highlights`] says; the runs are drawn by [`super::draw`].

use super::Execution;
use super::allocate::{Block, Forecast, TileBlocks, cost};
use super::covered::is_covered;
use super::draw::{Tally, TileSums, Work};
use super::kept::{self, Blocks, Half, Odd};
use super::pattern::Splits;
use super::prepared::Prepared;
use super::progressive::EdgesErr;
use super::resolve::{BLOCKS, ByBlock, Sum};
use super::scratch::{Step, TileScratch};
use super::stages::Stopwatch;
use crate::picture::BLOCK;
use crate::sampling::runs::{FIRST_RUN, Run};
use std::collections::BTreeSet;

/// A tile that is taken on.
pub(super) struct TileRound<'a> {
    picture: &'a Prepared<'a>,
    /// Its column and row, its first block, and how many of its blocks lie in the picture, across and down.
    tile: (u32, u32),
    corner: (u32, u32),
    size: (u32, u32),
    covered: Blocks,
    /// How many samples each block begins with.
    first: ByBlock<u32>,
    edges: EdgesErr,
    /// What a sample takes, 0 before the first run: see [`cost`].
    cost: f64,
    scratch: &'a mut TileScratch,
    sums: &'a mut [Sum],
    execution: &'a Execution<'a>,
    stop: &'a dyn Fn() -> bool,
}

/// What was drawn in a tile.
pub(super) struct Drawn {
    pub tally: Tally,
    /// What a sample of its first run takes: see [`cost`].
    pub cost: f64,
    /// The numbers of samples of the blocks that got more, and their errors after the first run.
    pub changed: ByBlock<u32>,
    pub first: ByBlock<f64>,
    /// Their errors by the word of the samples alone, and what edges and lights may hide.
    pub plain: ByBlock<f64>,
    pub hidden: ByBlock<f64>,
    pub lights: ByBlock<f64>,
    /// Some of what it shows is far brighter than white.
    pub is_bright: bool,
}

/// What runs came to: which blocks got how many samples, and their errors by the word of these.
struct Runs {
    tally: Tally,
    changed: ByBlock<u32>,
    plain: ByBlock<f64>,
}

impl Tally {
    /// What a sample takes: see [`cost`].
    fn cost(&self) -> f64 {
        cost(self.samples, self.requests, self.triangles)
    }

    fn add(&mut self, other: &Self) {
        self.requests += other.requests;
        self.samples += other.samples;
        self.triangles += other.triangles;
        self.unseen_light += other.unseen_light;
        self.stages.add(&other.stages);
    }
}

impl Drawn {
    /// The blocks that got more samples.
    pub(super) fn changed_blocks(&self) -> Blocks {
        (0..self.changed.len())
            .fold(0, |blocks, block| blocks | Blocks::from(self.changed[block] > 0) << block)
    }

    /// Whether each of these has so many samples now.
    pub(super) fn is_even(&self, samples: &ByBlock<u32>) -> bool {
        self.changed.iter().zip(samples).all(|(&changed, &samples)| changed == 0 || changed == samples)
    }
}

impl Prepared<'_> {
    /// How many pixels a block has.
    pub(super) fn block_pixels(&self, x: u32, y: u32) -> u32 {
        BLOCK.min(self.view.width - x * BLOCK) * BLOCK.min(self.view.height - y * BLOCK)
    }
}

impl<'a> TileRound<'a> {
    pub(super) fn new(
        picture: &'a Prepared<'a>,
        (tile, cost): (usize, f64),
        (covered, first, edges): (Blocks, ByBlock<u32>, EdgesErr),
        (scratch, sums): (&'a mut TileScratch, &'a mut [Sum]),
        execution: &'a Execution<'a>,
        stop: &'a dyn Fn() -> bool,
    ) -> Self {
        let tile = picture.place(tile);
        let corner = (tile.0 * BLOCKS, tile.1 * BLOCKS);
        let [columns, rows] = [picture.view.width, picture.view.height].map(|pixels| pixels.div_ceil(BLOCK));
        let size = (BLOCKS.min(columns - corner.0), BLOCKS.min(rows - corner.1));
        Self { picture, tile, corner, size, covered, first, edges, cost, scratch, sums, execution, stop }
    }

    /// Takes up what was kept of a tile, where it has samples. (Where each block is drawn to `then` samples from the first on, what
    /// was there before is not looked at.)
    pub(super) fn begin(
        &mut self,
        before: Option<((&Half, &Odd), Blocks)>,
        then: &ByBlock<u32>,
    ) -> &mut Self {
        match before {
            Some((kept, apart)) => kept::load(kept, apart, &self.first, self.sums),
            None if then.contains(&0) => self.sums.fill(Sum::default()),
            None => {}
        }
        self
    }

    /// The blocks that lie in the picture, row by row: their numbers in the tile, and their columns and rows in the picture.
    fn blocks(&self) -> impl Iterator<Item = (usize, (u32, u32))> + use<> {
        let ((left, top), (across, down)) = (self.corner, self.size);
        let places = (0..down).flat_map(move |y| (0..across).map(move |x| (x, y)));
        places.map(move |(x, y)| ((y * BLOCKS + x) as usize, (left + x, top + y)))
    }

    /// A number for each block by its column and row in the picture, 0 outside of it.
    pub(super) fn by_block(&self, number: impl Fn(u32, u32) -> u32) -> ByBlock<u32> {
        let mut all = ByBlock::default();
        self.blocks().for_each(|(block, (x, y))| all[block] = number(x, y));
        all
    }

    /// Draws the runs that lead the blocks from `now` to `then` samples, as far as there is time; with a `forecast` also those
    /// that it says from there, with the triangles that were set up for the first.
    pub(super) fn draw(
        &mut self,
        now: ByBlock<u32>,
        then: ByBlock<u32>,
        forecast: Option<&Forecast>,
    ) -> Option<Drawn> {
        // What is set up is only what the first run wanted.
        let had = |first: &Runs| (0..now.len()).any(|block| now[block] > 0 && first.changed[block] == 0);
        let (first, is_set_up) = match self.runs(now, then, false) {
            // Blocks of the pilot that had theirs go on from it as well, and no triangles are set up for them.
            Some(first) if forecast.is_some() && had(&first) => {
                let reached = std::array::from_fn(|block| now[block].max(first.changed[block]));
                (Runs { tally: first.tally, ..self.seen(reached) }, false)
            }
            Some(first) => (first, true),
            // Tiles of the pilot have their first run.
            None if forecast.is_some() && now == then && self.cost > 0.0 => (self.seen(now), false),
            None => return None,
        };
        let Runs { mut tally, changed: begun, plain: first } = first;
        let (mut changed, mut plain) = (begun, first);
        let cost = if self.cost > 0.0 { self.cost } else { tally.cost() };
        let (mut known, mut begun_lights) = (None, None);
        if let Some(forecast) = forecast {
            let picture = self.picture;
            known = self
                .edges
                .is_much
                .then(|| picture.contrasts(self.tile, self.sums, (&begun, &begun), self.covered));
            let hidden = known.map(|contrasts| picture.all_missed(&begun, &contrasts)).unwrap_or_default();
            let lights = begun_lights.insert(self.lights(&begun));
            let found = self.errors(&first, &hidden, lights);
            let wanted = self.forecast(forecast, &begun, &found, cost);
            if let Some(more) = self.runs(begun, wanted, is_set_up) {
                tally.add(&more.tally);
                known = None;
                for block in (0..changed.len()).filter(|&block| more.changed[block] > 0) {
                    (changed[block], plain[block]) = (more.changed[block], more.plain[block]);
                }
            }
        }
        // From all that is there now. (Found after the first run of every picture it took 2 % of the city's time.)
        let mut watch = Stopwatch::start(self.execution.clock);
        let reached = std::array::from_fn(|block| now[block].max(changed[block]));
        let all = || self.picture.contrasts(self.tile, self.sums, (&reached, &changed), self.covered);
        let contrasts = known.unwrap_or_else(all);
        let hidden = |samples: &ByBlock<u32>| self.picture.all_missed(samples, &contrasts);
        let lights = self.lights(&changed);
        let first = self.errors(&first, &hidden(&begun), begun_lights.as_ref().unwrap_or(&lights));
        let hidden = hidden(&changed);
        watch.lap(&mut tally.stages.resolve);
        Some(Drawn { tally, cost, changed, first, plain, hidden, lights, is_bright: contrasts.are_bright })
    }

    /// The errors of blocks: by the word of their samples, and what edges and lights may hide.
    fn errors(&self, plain: &ByBlock<f64>, hidden: &ByBlock<f64>, lights: &ByBlock<f64>) -> ByBlock<f64> {
        std::array::from_fn(|block| self.edges.error(plain[block], hidden[block], lights[block]))
    }

    /// What lights may hide in blocks with `samples`, which are all that the sums have.
    fn lights(&self, samples: &ByBlock<u32>) -> ByBlock<f64> {
        let mut lights = ByBlock::default();
        self.picture.raise_unseen(self.tile, self.sums, samples, &mut lights);
        lights
    }

    /// Draws such runs, where the last ones were drawn in the same tile with its triangles as they are set up; resolves what
    /// they change.
    fn runs(&mut self, now: ByBlock<u32>, then: ByBlock<u32>, is_set_up: bool) -> Option<Runs> {
        let steps = steps(&self.first, now, then);
        if steps.is_empty() || (self.stop)() {
            return None;
        }
        let (picture, clock) = (self.picture, self.execution.clock);
        let watch = Stopwatch::start(clock);
        let (mut tally, count) = picture.draw_tile(
            self.scratch,
            self.tile,
            Work { steps: &steps, is_set_up, alone: picture.alone },
            TileSums::from(&mut *self.sums),
            watch,
            self.stop,
        );
        let mut watch = Stopwatch::start(clock);
        let changed = std::array::from_fn(|block| {
            let its = steps[..count].iter().filter(|step| step.wanted & regions(block) != 0);
            its.map(|step| step.run.end()).max().unwrap_or(0)
        });
        let Runs { plain, .. } = self.seen(changed);
        watch.lap(&mut tally.stages.resolve);
        Some(Runs { tally, changed, plain })
    }

    /// What was found of blocks that have `samples`.
    fn seen(&self, samples: ByBlock<u32>) -> Runs {
        let plain = self.picture.resolve(self.tile, self.sums, &samples, None);
        Runs { tally: Tally::default(), changed: samples, plain }
    }

    /// How many samples the forecast gives the blocks, by what was found of them.
    fn forecast(
        &self,
        forecast: &Forecast,
        samples: &ByBlock<u32>,
        errors: &ByBlock<f64>,
        cost: f64,
    ) -> ByBlock<u32> {
        let of_block = |(block, (x, y)): (usize, (u32, u32))| Block {
            pixels: self.picture.block_pixels(x, y),
            samples: samples[block],
            error: errors[block],
            cost,
            is_sky: !is_covered(self.covered, block),
        };
        let tile = TileBlocks::new(self.blocks().map(of_block).collect(), self.size.0 as usize);
        let mut wanted = *samples;
        self.blocks().zip(forecast.wanted(&tile)).for_each(|((block, _), then)| wanted[block] = then);
        wanted
    }
}

/// The runs that lead each block of a tile from `now` to `then` samples, of which the first has as many as in `first`, each with the
/// regions that take part. Of the sky, fewer than [`FIRST_RUN`] are no part of more.
fn steps(first: &ByBlock<u32>, mut now: ByBlock<u32>, then: ByBlock<u32>) -> Vec<Step> {
    let mut first = *first;
    for ((first, now), then) in
        first.iter_mut().zip(&mut now).zip(then).filter(|((_, now), then)| **now < *then)
    {
        *now = if *now < FIRST_RUN { 0 } else { *now };
        *first = if then < FIRST_RUN { then } else { (*first).max(FIRST_RUN) };
    }
    let going = || (0..now.len()).filter(|&block| now[block] < then[block]);
    let on = || going().filter(|&block| first[block] < then[block]);
    let from = on().map(|block| now[block].max(first[block])).min().unwrap_or(0);
    let to = on().map(|block| then[block]).max().unwrap_or(0);
    let counts: BTreeSet<u32> = going().filter(|&block| now[block] == 0).map(|block| first[block]).collect();
    counts
        .into_iter()
        .map(|count| Run { first: 0, count })
        .chain(Run::between(from, to))
        .map(|run| {
            let takes_part = |&block: &usize| match run.first {
                0 => now[block] == 0 && then[block] > 0 && run.count == first[block],
                done => now[block].max(first[block]) <= done && then[block] >= run.end(),
            };
            let wanted = (0..now.len()).filter(takes_part).map(regions).fold(0, |sum, bits| sum | bits);
            Step { run, splits: Splits::new(run.count), wanted }
        })
        .filter(|step| step.wanted != 0)
        .collect()
}

/// The four regions of 4 x 4 pixels of a block.
fn regions(block: usize) -> u64 {
    let (column, row) = (block as u32 % BLOCKS * 2, block as u32 / BLOCKS * 2);
    0b11 << (8 * row + column) | 0b11 << (8 * (row + 1) + column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_lead_each_block_to_exactly_what_it_is_to_have() {
        // What blocks begin with, have, and are to have: the first four show nothing but the sky.
        let of = |numbers: [u32; 8]| std::array::from_fn(|block| numbers[block % 8]);
        let (first, now) = (of([2, 2, 2, 2, 64, 64, 64, 64]), of([0, 2, 2, 16, 0, 64, 64, 192]));
        for then in [
            [2, 8, 16, 64, 64, 64, 128, 192],
            [8, 4, 192, 16, 256, 128, 64, 256],
            [2, 2, 2, 16, 64, 64, 64, 192],
        ] {
            let then = of(then);
            let steps = steps(&first, now, then);
            for block in 0..8 {
                let its = steps.iter().filter(|step| step.wanted & regions(block) == regions(block));
                let mut reached = now[block];
                for step in its {
                    // From the start, or on from what there is.
                    assert!(
                        step.run.first == 0 || step.run.first == reached,
                        "{then:?}: {block}, {:?}",
                        step.run
                    );
                    reached = step.run.end();
                }
                assert_eq!(reached, then[block], "{then:?}: {block}");
            }
        }
    }
}
