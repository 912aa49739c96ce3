//! A picture as far as it is, and the rounds that take it on: each gives blocks of pixels more samples.
//!
//! In: how many samples each block is to have, from [`super::adaptive`]. Out: sums ([`super::kept`]), and each block's samples
//! and squared error, for the next round or [`super::finish`]. No formula of its own: [`super::tile_round`] draws the tiles.
//!
//! What a block shows depends on its number of samples alone, so a list of these numbers makes the picture again.

use super::allocate::{Block, Forecast};
use super::covered::{Covered, First, first_samples};
use super::draw::TILES_AT_ONCE;
use super::edges;
use super::kept::{self, Blocks, Half, Kept, Odd};
use super::prepared::Prepared;
use super::resolve::{AREA, BLOCKS, Sum, block_place};
use super::room::zeroed;
use super::scratch::TileScratch;
use super::stages::Stopwatch;
use super::tile_round::{Drawn, TileRound};
use super::{Counts, Execution, cancelled, stopped};
use crate::error::Result;
use crate::picture::BlockSamples;
use crate::sampling::runs::FIRST_RUN;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How much edges err by what was seen.
#[derive(Clone, Copy)]
pub(super) struct EdgesErr {
    /// As a part of what they may: see [`edges::share`].
    pub share: f64,
    /// So much that the first round looks for them before it gives out samples.
    pub is_much: bool,
}

impl EdgesErr {
    /// A block's squared error: by the word of its samples, and what edges and lights may hide.
    pub(super) fn error(self, plain: f64, hidden: f64, lights: f64) -> f64 {
        plain.max(self.share * hidden).max(lights)
    }
}

/// The picture as far as it is.
pub(super) struct Progressive<'a> {
    pub picture: &'a Prepared<'a>,
    /// Tile by tile the sums of even samples, or of all, and of odd ones, and the blocks of which these are apart.
    pub even: Vec<Half>,
    pub odd: Vec<Odd>,
    pub apart: Vec<Blocks>,
    pub samples: BlockSamples,
    /// How many samples the sky begins with.
    pub sky: u32,
    /// Block by block the sum of squared errors over its pixels and channels.
    pub errors: Vec<f64>,
    /// These by the word of the samples alone, by which forecasts go, and what edges and lights may hide.
    pub plain: Vec<f64>,
    pub hidden: Vec<f64>,
    lights: Vec<f64>,
    /// The errors after the first run.
    first: Vec<f64>,
    pub edges: EdgesErr,
    pub covered: Covered,
    /// Tiles that show light far brighter than white.
    pub bright: Vec<bool>,
    /// Tiles of which some blocks got samples after what edges hide in the others was found.
    pub stale: Vec<bool>,
    /// What a sample takes in each tile, as its first run found: see [`allocate::cost`].
    costs: Vec<f64>,
    pub counts: Counts,
    /// Runs while no tiles are drawn.
    pub watch: Stopwatch<'a>,
}

impl<'a> Progressive<'a> {
    pub(super) fn new(picture: &'a Prepared<'a>, execution: &Execution<'a>, counts: Counts) -> Result<Self> {
        let watch = Stopwatch::start(execution.clock);
        let samples = BlockSamples::new(picture.view.width, picture.view.height, FIRST_RUN);
        let tiles = picture.tiles();
        let (even, odd) = (zeroed(tiles)?, vec![Odd::new(); tiles]);
        let (columns, rows) = samples.columns_and_rows();
        let errors = zeroed::<f64>(columns as usize * rows as usize)?;
        let [plain, hidden, lights, first] = std::array::from_fn(|_| errors.clone());
        let (costs, stale, apart) = (zeroed(tiles)?, zeroed(tiles)?, zeroed(tiles)?);
        Ok(Self {
            picture,
            even,
            odd,
            apart,
            samples,
            sky: FIRST_RUN,
            errors,
            plain,
            hidden,
            lights,
            first,
            edges: EdgesErr { share: 1.0, is_much: true },
            covered: Covered::new(picture),
            bright: vec![false; tiles],
            stale,
            costs,
            counts,
            watch,
        })
    }

    /// A number for each block of the picture.
    pub(super) fn by_block<T>(&self, number: impl Fn(u32, u32) -> T) -> Vec<T> {
        let (columns, rows) = self.samples.columns_and_rows();
        (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| number(x, y)).collect()
    }

    pub(super) fn blocks(&self) -> Vec<Block> {
        self.by_block(|x, y| self.block(x, y))
    }

    /// What is known of the block in this column and row.
    pub(super) fn block(&self, x: u32, y: u32) -> Block {
        let at = (y * self.samples.columns_and_rows().0 + x) as usize;
        Block {
            pixels: self.picture.block_pixels(x, y),
            samples: self.samples.get(x, y),
            error: self.errors[at],
            is_sky: !self.covered.has(x, y),
            cost: self.costs[self.tile_of(at)],
        }
    }

    /// The sum of squared errors, block by block in order: the same whatever the threads did.
    pub(super) fn squared_error(&self) -> f64 {
        self.errors.iter().sum()
    }

    /// Begins again with first runs of `base` samples, unless it has such.
    pub(super) fn clear(&mut self, base: u32) {
        if base != self.samples.base() {
            let (width, height) = self.samples.size();
            self.samples = BlockSamples::new(width, height, base);
            self.errors.fill(0.0);
            self.plain.fill(0.0);
            self.hidden.fill(0.0);
            self.lights.fill(0.0);
            self.costs.fill(0.0);
        }
    }

    /// Says of each block by all that was drawn, as [`super::finish`] does, what edges err and so what it errs.
    fn judge(&mut self) {
        let mut tiles = vec![[0.0; 2]; self.picture.tiles()];
        for (block, (&plain, &hidden)) in self.plain.iter().zip(&self.hidden).enumerate() {
            let tile = &mut tiles[self.tile_of(block)];
            let [found, hides] = edges::found_and_hidden([(plain, hidden)]);
            *tile = [tile[0] + found, tile[1] + hides];
        }
        self.edges.share = edges::share(tiles);
        for (block, error) in self.errors.iter_mut().enumerate() {
            *error = self.edges.error(self.plain[block], self.hidden[block], self.lights[block]);
        }
    }

    /// How many samples the blocks of the picture begin with.
    pub(super) fn first_samples(&self) -> Vec<u32> {
        self.by_block(|x, y| self.covered.first(x, y, self.first_of()))
    }

    pub(super) fn first_of(&self) -> First {
        First { base: self.samples.base(), sky: self.sky }
    }

    /// The tile that a block lies in.
    pub(super) fn tile_of(&self, block: usize) -> usize {
        let (columns, block) = (self.samples.columns_and_rows().0, block as u32);
        (block / columns / BLOCKS * self.picture.bins.tiles_x + block % columns / BLOCKS) as usize
    }

    /// Gives each block the samples `wanted`, as far as `late` allows.
    pub(super) fn round(
        &mut self,
        wanted: &[u32],
        execution: &Execution<'_>,
        late: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        self.draw(wanted, None, execution, late)
    }

    /// Gives each block the first run and, while its tile's triangles are set up, what `forecast` says from there.
    pub(super) fn first_round(&mut self, forecast: &Forecast, execution: &Execution<'_>) -> Result<()> {
        self.draw(&self.first_samples(), Some(forecast), execution, &|| false)
    }

    /// What the blocks were after the first run.
    pub(super) fn after_first(&self) -> Vec<Block> {
        let as_first = |((block, &error), samples)| Block { samples, error, ..block };
        self.blocks().into_iter().zip(&self.first).zip(self.first_samples()).map(as_first).collect()
    }

    fn draw(
        &mut self,
        wanted: &[u32],
        forecast: Option<&Forecast>,
        execution: &Execution<'_>,
        late: &(dyn Fn() -> bool + Sync),
    ) -> Result<()> {
        let (columns, _) = self.samples.columns_and_rows();
        let (picture, samples, edges, costs) = (self.picture, &self.samples, self.edges, &self.costs);
        let (covered, first_of) = (&self.covered, self.first_of());
        let finished = AtomicUsize::new(0);
        let tiles = self.picture.tiles();
        let stop = || cancelled(execution.cancel) || late();
        self.watch.lap(&mut self.counts.stages.rounds);
        let each =
            |scratch: &mut TileScratch, sums: &mut [Sum], tile, (even, odd): Kept<'_>, apart: &mut Blocks| {
                let covered = covered.of_tile(picture.place(tile));
                let first = first_samples(covered, first_of);
                let mut round = TileRound::new(
                    picture,
                    (tile, costs[tile]),
                    (covered, first, edges),
                    (scratch, sums),
                    execution,
                    &stop,
                );
                let mut now = round.by_block(|x, y| samples.get(x, y));
                let then = round.by_block(|x, y| wanted[(y * columns + x) as usize].max(samples.get(x, y)));
                for (block, now) in now.iter_mut().enumerate() {
                    // Of what was kept as a total the halves are not known.
                    if then[block] > *now && *apart >> block & 1 == 0 {
                        *now = 0;
                    }
                }
                if now == then && forecast.is_none() {
                    return Ok(None);
                }
                // What was never touched is not looked at: that would be a page for nothing.
                let before = now.iter().any(|&samples| samples > 0).then_some(((&*even, &*odd), *apart));
                let Some(drawn) = round.begin(before, &then).draw(now, then, forecast) else {
                    return Ok(None);
                };
                *apart |= drawn.changed_blocks();
                if forecast.is_some() && !execution.error_map && drawn.is_even(&first) {
                    *apart = 0;
                }
                kept::save(sums, *apart, &first, (even, odd))?;
                Ok(Some(drawn))
            };
        let drawn: Result<Vec<Option<Drawn>>> = self
            .even
            .par_iter_mut()
            .zip(&mut self.odd)
            .zip(&mut self.apart)
            .enumerate()
            .with_max_len(TILES_AT_ONCE)
            .map_init(
                || (picture.scratch(), vec![Sum::default(); AREA]),
                |(scratch, sums), (tile, (kept, apart))| {
                    let drawn = each(scratch.get(), sums, tile, kept, apart);
                    if let Some(progress) = execution.progress {
                        progress(finished.fetch_add(1, Ordering::Relaxed) + 1, tiles);
                    }
                    drawn
                },
            )
            .collect();
        self.watch.skip();
        if cancelled(execution.cancel) {
            return Err(stopped());
        }
        self.take(drawn?);
        self.judge();
        Ok(())
    }

    /// Adds what was drawn of each tile.
    fn take(&mut self, drawn: Vec<Option<Drawn>>) {
        let (columns, rows) = self.samples.columns_and_rows();
        for (tile, drawn) in drawn.into_iter().enumerate() {
            let (Some(drawn), place) = (drawn, self.picture.place(tile)) else { continue };
            let Drawn { tally, cost, changed, first, plain, hidden, lights, is_bright } = drawn;
            self.bright[tile] = is_bright;
            self.counts.shading_requests += tally.requests;
            self.counts.stages.add(&tally.stages);
            let is_first = self.costs[tile] == 0.0;
            self.stale[tile] = (0..changed.len()).any(|block| {
                let (x, y) = block_place(place, block);
                changed[block] == 0 && x < columns && y < rows
            });
            // What was stopped on its way tells too little.
            if is_first && !self.stale[tile] {
                self.costs[tile] = cost;
            }
            for block in (0..changed.len()).filter(|&block| changed[block] > 0) {
                let (x, y) = block_place(place, block);
                self.samples.set(x, y, changed[block]);
                let at = (y * columns + x) as usize;
                (self.plain[at], self.hidden[at], self.lights[at]) =
                    (plain[block], hidden[block], lights[block]);
                if is_first {
                    self.first[at] = first[block];
                }
            }
        }
    }
}
