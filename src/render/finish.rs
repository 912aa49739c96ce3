//! The end of a picture that was drawn in rounds: sums in, the picture and its stated error out.
//!
//! From [`super::progressive`]. Block by block `mean = (even + odd) / n` ([`super::kept`]), and the error
//! `max(found, share hidden)` as in [`super::tile_round`], now by the edges of the whole picture, raised to what
//! [`super::highlights`] says; stated is `sqrt(sum of squared errors / (3 width height))`.

use super::covered::first_samples;
use super::edges;
use super::kept;
use super::progressive::Progressive;
use super::resolve::{AREA, ByBlock, Sum, block_place};
use super::room::zeroed;
use super::{Counts, Execution, done};
use crate::error::Result;
use crate::picture::{Allocation, Exposure};
use rayon::prelude::*;

impl Progressive<'_> {
    /// The picture as far as it is.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::TooLarge`] where there is no memory left for the errors of pixels.
    pub(super) fn finish(self, execution: &Execution<'_>) -> Result<(Exposure, Counts)> {
        let (picture, samples, first_of, mut watch) =
            (self.picture, &self.samples, self.first_of(), self.watch);
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
            let first = first_samples(self.covered.of_tile(picture.place(tile)), first_of);
            kept::load((&self.even[tile], &self.odd[tile]), self.apart[tile], &first, sums);
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
                picture.hidden(place, sums, &samples, self.covered.of_tile(place))
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
                picture.raise_errors(place, (found, &stated), map);
            }
            (stated.iter().sum(), u64::from(unseen.blocks.count_ones()))
        };
        let mut errors = zeroed::<f32>(if execution.error_map { picture.tiles() * AREA } else { 0 })?;
        let stated: Vec<(f64, u64)> = if execution.error_map {
            let maps = tiles().zip(errors.par_chunks_mut(AREA));
            maps.map_init(scratch, |sums, (tile, map)| state(sums, tile, Some(map))).collect()
        } else {
            tiles().map_init(scratch, |sums, tile| state(sums, tile, None)).collect()
        };
        let rms = Some((stated.iter().map(|tile| tile.0).sum::<f64>() / picture.values()).sqrt());
        // In the same memory: new pages for a picture of 1280 x 1024 took 2 % of the time of one of 64 samples.
        let mut even = self.even;
        even.par_iter_mut().zip(&self.odd).zip(&self.apart).enumerate().for_each(
            |(tile, ((even, odd), &apart))| {
                let (_, samples) = of_tile(tile);
                kept::means((even, odd), apart, &samples);
            },
        );
        let pixels = even.into_flattened();
        let mut counts = Counts { unseen_light: stated.iter().map(|tile| tile.1).sum(), ..self.counts };
        watch.lap(&mut counts.stages.rounds);
        Ok(done(picture, (pixels, errors), rms, Allocation::Blocks(self.samples), counts))
    }
}
