//! One tile in a round: how many samples its blocks have and are to have in, the runs that lead there drawn, and what that
//! makes of their errors.

use super::Execution;
use super::allocate::{Block, Forecast, TileBlocks, cost};
use super::draw::{SetUp, Step, Tally, TileScratch};
use super::pattern::Splits;
use super::picture::Picture;
use super::resolve::{BLOCKS, ByBlock};
use super::stages::Stopwatch;
use crate::picture::{BLOCK, BlockSamples};
use crate::sampling::runs::Run;
use glam::Vec3;

/// A tile that is taken on.
pub(super) struct TileRound<'a> {
    picture: &'a Picture<'a>,
    /// Its column and row, its first block, and how many of its blocks lie in the picture, across and down.
    tile: (u32, u32),
    corner: (u32, u32),
    size: (u32, u32),
    /// The samples of the first run.
    base: u32,
    /// How much edges err, as a part of what they may.
    hides: f64,
    scratch: &'a mut TileScratch,
    sums: &'a mut Vec<[Vec3; 2]>,
    execution: &'a Execution<'a>,
    stop: &'a dyn Fn() -> bool,
}

/// What was drawn in a tile.
pub(super) struct Drawn {
    pub tally: Tally,
    /// The numbers of samples of the blocks that got more, and their errors.
    pub changed: ByBlock<u32>,
    pub errors: ByBlock<f64>,
    /// These by the word of the samples alone, and what edges may hide.
    pub plain: ByBlock<f64>,
    pub hidden: ByBlock<f64>,
}

impl Tally {
    /// What a sample takes: see [`cost`].
    pub(super) fn cost(&self) -> f64 {
        cost(self.samples, self.requests, self.triangles)
    }
}

impl Picture<'_> {
    /// How many pixels a block has.
    pub(super) fn block_pixels(&self, x: u32, y: u32) -> u32 {
        BLOCK.min(self.view.width - x * BLOCK) * BLOCK.min(self.view.height - y * BLOCK)
    }
}

impl<'a> TileRound<'a> {
    pub(super) fn new(
        picture: &'a Picture<'a>,
        tile: usize,
        (samples, hides): (&BlockSamples, f64),
        (scratch, sums): (&'a mut TileScratch, &'a mut Vec<[Vec3; 2]>),
        execution: &'a Execution<'a>,
        stop: &'a dyn Fn() -> bool,
    ) -> Self {
        let tile = picture.place(tile);
        let corner = (tile.0 * BLOCKS, tile.1 * BLOCKS);
        let (columns, rows) = samples.columns_and_rows();
        let size = (BLOCKS.min(columns - corner.0), BLOCKS.min(rows - corner.1));
        Self { picture, tile, corner, size, base: samples.base(), hides, scratch, sums, execution, stop }
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

    /// Draws the runs that lead the blocks from `now` to `then` samples, as far as there is time.
    pub(super) fn draw(&mut self, now: ByBlock<u32>, then: ByBlock<u32>, set_up: SetUp) -> Option<Drawn> {
        let steps = steps(self.base, now, then);
        if steps.is_empty() || (self.stop)() {
            return None;
        }
        let (picture, clock) = (self.picture, self.execution.clock);
        let watch = Stopwatch::start(clock);
        let (mut tally, count) =
            picture.draw_tile(self.scratch, self.tile, (&steps, set_up), self.sums, watch, self.stop);
        let mut watch = Stopwatch::start(clock);
        let end = count.checked_sub(1).map_or(0, |last| steps[last].run.end());
        let changed = std::array::from_fn(|block| match then[block].min(end) {
            reached if reached > now[block] => reached,
            _ => 0,
        });
        let plain = picture.resolve(self.tile, self.sums, &changed, None);
        let reached: ByBlock<u32> = std::array::from_fn(|block| now[block].max(changed[block]));
        let hidden = picture.hidden(self.tile, self.sums, (&reached, &changed));
        let mut errors = std::array::from_fn(|block| plain[block].max(self.hides * hidden[block]));
        picture.raise_unseen(self.tile, self.sums, &changed, &mut errors);
        watch.lap(&mut tally.stages.resolve);
        Some(Drawn { tally, changed, errors, plain, hidden })
    }

    /// Goes on from what was drawn as far as `forecast` says, with the triangles that were set up for that.
    pub(super) fn go_on(&mut self, first: &Drawn, forecast: &Forecast) -> Option<Drawn> {
        let cost = first.tally.cost();
        let of_block = |(block, (x, y)): (usize, (u32, u32))| Block {
            pixels: self.picture.block_pixels(x, y),
            samples: first.changed[block],
            error: first.errors[block],
            cost,
        };
        let tile = TileBlocks::new(self.blocks().map(of_block).collect(), self.size.0 as usize);
        let mut then = first.changed;
        self.blocks().zip(forecast.wanted(&tile)).for_each(|((block, _), wanted)| then[block] = wanted);
        self.draw(first.changed, then, SetUp::Before)
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
