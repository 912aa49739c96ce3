//! A picture as far as it is, and the rounds that take it on: each gives blocks of pixels more samples.
//!
//! What a block shows depends on its number of samples alone, so a list of these numbers makes the picture again.

use super::allocate::{Block, Forecast};
use super::draw::{TILES_AT_ONCE, TileScratch};
use super::edges;
use super::kept::{self, AREA, Blocks, Half, Kept, Odd};
use super::picture::Picture;
use super::resolve::{BLOCKS, ByBlock, Sum, block_place};
use super::tile_round::{Drawn, TileRound};
use super::uniform::zeroed;
use super::{Counts, Execution, cancelled, done, stopped};
use crate::error::Result;
use crate::picture::{Allocation, BlockSamples, Exposure};
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

/// The picture as far as it is.
pub(super) struct Progressive<'a> {
    pub picture: &'a Picture<'a>,
    /// Tile by tile the sums of even samples, or of all, and of odd ones, and the blocks of which these are apart.
    even: Vec<Half>,
    odd: Vec<Odd>,
    pub apart: Vec<Blocks>,
    pub samples: BlockSamples,
    /// Block by block the sum of squared errors over its pixels and channels.
    pub errors: Vec<f64>,
    /// These by the word of the samples alone, by which forecasts go, and what edges may hide.
    pub plain: Vec<f64>,
    pub hidden: Vec<f64>,
    /// The errors after the first run.
    first: Vec<f64>,
    pub edges: EdgesErr,
    /// Tiles of which some blocks got samples after what edges hide in the others was found.
    stale: Vec<bool>,
    /// What a sample takes in each tile, as its first run found: see [`allocate::cost`].
    costs: Vec<f64>,
    counts: Counts,
}

impl<'a> Progressive<'a> {
    pub(super) fn new(picture: &'a Picture<'a>, counts: Counts) -> Result<Self> {
        let samples = BlockSamples::new(picture.view.width, picture.view.height, FIRST_RUN);
        let tiles = picture.tiles();
        let (even, odd) = (zeroed(tiles)?, vec![Odd::new(); tiles]);
        let (columns, rows) = samples.columns_and_rows();
        let errors = zeroed::<f64>(columns as usize * rows as usize)?;
        let (plain, hidden, first) = (errors.clone(), errors.clone(), errors.clone());
        let (costs, stale, apart) = (zeroed(tiles)?, zeroed(tiles)?, zeroed(tiles)?);
        Ok(Self {
            picture,
            even,
            odd,
            apart,
            samples,
            errors,
            plain,
            hidden,
            first,
            edges: EdgesErr { share: 1.0, is_much: true },
            stale,
            costs,
            counts,
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
        let (columns, _) = self.samples.columns_and_rows();
        Block {
            pixels: self.picture.block_pixels(x, y),
            samples: self.samples.get(x, y),
            error: self.errors[(y * columns + x) as usize],
            cost: self.costs[(y / BLOCKS * self.picture.bins.tiles_x + x / BLOCKS) as usize],
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
            self.costs.fill(0.0);
        }
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
        self.draw(wanted, None, execution, late)
    }

    /// Gives each block the first run and, while its tile's triangles are set up, what `forecast` says from there.
    pub(super) fn first_round(&mut self, forecast: &Forecast, execution: &Execution<'_>) -> Result<()> {
        let wanted = vec![self.samples.base(); self.errors.len()];
        self.draw(&wanted, Some(forecast), execution, &|| false)
    }

    /// What the blocks were after the first run.
    pub(super) fn after_first(&self) -> Vec<Block> {
        let as_first =
            |(block, &error): (Block, &f64)| Block { samples: self.samples.base(), error, ..block };
        self.blocks().into_iter().zip(&self.first).map(as_first).collect()
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
        let finished = AtomicUsize::new(0);
        let tiles = self.picture.tiles();
        let stop = || cancelled(execution) || late();
        let each =
            |scratch: &mut TileScratch, sums: &mut [Sum], tile, (even, odd): Kept<'_>, apart: &mut Blocks| {
                let mut round = TileRound::new(
                    picture,
                    tile,
                    (samples, edges, costs[tile]),
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
                if forecast.is_some() && !execution.error_map && drawn.is_even(samples.base()) {
                    *apart = 0;
                }
                let size = picture.size_of(picture.place(tile));
                kept::save(sums, *apart, (samples.base(), size), (even, odd))?;
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
        if cancelled(execution) {
            return Err(stopped());
        }
        self.take(drawn?);
        Ok(())
    }

    /// Adds what was drawn of each tile.
    fn take(&mut self, drawn: Vec<Option<Drawn>>) {
        let (columns, rows) = self.samples.columns_and_rows();
        for (tile, drawn) in drawn.into_iter().enumerate() {
            let (Some(drawn), place) = (drawn, self.picture.place(tile)) else { continue };
            let Drawn { tally, cost, changed, errors, first, plain, hidden } = drawn;
            self.counts.shading_requests += tally.requests;
            self.counts.stages.add(&tally.stages);
            let is_first = self.costs[tile] == 0.0;
            if is_first {
                self.costs[tile] = cost;
            }
            self.stale[tile] = (0..changed.len()).any(|block| {
                let (x, y) = block_place(place, block);
                changed[block] == 0 && x < columns && y < rows
            });
            for block in (0..changed.len()).filter(|&block| changed[block] > 0) {
                let (x, y) = block_place(place, block);
                self.samples.set(x, y, changed[block]);
                let at = (y * columns + x) as usize;
                (self.errors[at], self.plain[at], self.hidden[at]) =
                    (errors[block], plain[block], hidden[block]);
                if is_first {
                    self.first[at] = first[block];
                }
            }
        }
    }

    pub(super) fn finish(self, execution: &Execution<'_>) -> Result<(Exposure, Counts)> {
        let (picture, samples) = (self.picture, &self.samples);
        let of_tile = |tile: usize| -> ((u32, u32), ByBlock<u32>) {
            let place = picture.place(tile);
            let of_block = |block: usize| {
                let (x, y) = block_place(place, block);
                samples.get(x, y)
            };
            (place, std::array::from_fn(of_block))
        };
        let (columns, rows) = samples.columns_and_rows();
        let load = |sums: &mut Vec<Sum>, tile: usize| {
            kept::load((&self.even[tile], &self.odd[tile]), self.apart[tile], self.samples.base(), sums);
        };
        // From what there is now, not as it came: an edge goes by the pixels beside it, which may have got more samples since.
        let edges = |sums: &mut Vec<Sum>, tile: usize| {
            let (place, samples) = of_tile(tile);
            let as_found = |all: &[f64]| {
                std::array::from_fn(|block| {
                    let (x, y) = block_place(place, block);
                    let is_inside = x < columns && y < rows;
                    if is_inside { all[(y * columns + x) as usize] } else { 0.0 }
                })
            };
            let hidden = if self.stale[tile] {
                load(sums, tile);
                picture.hidden(place, sums, &samples)
            } else {
                as_found(&self.hidden)
            };
            (as_found(&self.plain), hidden)
        };
        let tiles = || (0..picture.tiles()).into_par_iter();
        let scratch = || vec![Sum::default(); AREA];
        let known: Vec<_> = tiles().map_init(scratch, edges).collect();
        let of_edges = |(found, hidden): &(ByBlock<f64>, ByBlock<f64>)| {
            edges::found_and_hidden(found.iter().copied().zip(hidden.iter().copied()))
        };
        let hides = edges::share(known.iter().map(of_edges));
        let state = |sums: &mut Vec<Sum>, tile: usize, map: Option<&mut [f32]>| -> (f64, u64) {
            let ((place, samples), (found, hidden)) = (of_tile(tile), &known[tile]);
            let mut stated = std::array::from_fn(|block| found[block].max(hides * hidden[block]));
            if map.is_some() || !picture.highlights.are_none() {
                load(sums, tile);
            }
            let unseen = picture.raise_unseen(place, sums, &samples, &mut stated);
            if let Some(map) = map {
                picture.resolve(place, sums, &samples, Some(map));
                picture.spread_all(place, (found, &stated), map);
            }
            (stated.iter().sum(), u64::from(unseen.count_ones()))
        };
        let mut errors = zeroed::<f32>(if execution.error_map { picture.tiles() * AREA } else { 0 })?;
        let stated: Vec<(f64, u64)> = if execution.error_map {
            let maps = tiles().zip(errors.par_chunks_mut(AREA));
            maps.map_init(scratch, |sums, (tile, map)| state(sums, tile, Some(map))).collect()
        } else {
            tiles().map_init(scratch, |sums, tile| state(sums, tile, None)).collect()
        };
        let rms = Some((stated.iter().map(|tile| tile.0).sum::<f64>() / picture.values()).sqrt());
        let counts = Counts { unseen_light: stated.iter().map(|tile| tile.1).sum(), ..self.counts };
        // In the same memory: new pages for a picture of 1280 x 1024 took 2 % of the time of one of 64 samples.
        let mut even = self.even;
        even.par_iter_mut().zip(&self.odd).zip(&self.apart).enumerate().for_each(
            |(tile, ((even, odd), &apart))| {
                let (place, samples) = of_tile(tile);
                kept::means((even, odd), apart, &samples, picture.size_of(place));
            },
        );
        let pixels = even.into_flattened();
        Ok(done(picture, (pixels, errors), rms, Allocation::Blocks(self.samples), counts))
    }
}
