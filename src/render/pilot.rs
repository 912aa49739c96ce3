//! The pilot: tiles all over the picture that are drawn first, to see how long it takes and where its error is.
//!
//! In: one tile in how many, and a number of samples. Out: what the blocks of these tiles are then, for [`super::base`] and
//! [`super::allocate`]. Tile `(x, y)` is one of them where `x + y shift` is a multiple of `stride`, `shift` being about
//! `0.382 stride`.

use super::Execution;
use super::allocate::{self, Block, TileBlocks};
use super::progressive::Progressive;
use super::resolve::BLOCKS;
use crate::error::Result;

/// Which tiles these are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Pilot {
    /// One in so many.
    stride: u32,
}

impl Pilot {
    /// One tile in 41, of smaller pictures more: sixteen, of small ones a tenth, eight at least. What it sees is a forecast. (By eight a
    /// table top 640 pixels wide ended with 0.68 of the error asked for and 1.27 times the samples of a uniform picture; by sixteen
    /// with 0.9 and 0.9.)
    pub(super) fn for_error(tiles: usize) -> Self {
        Self::new(tiles, 41, (tiles / 10).clamp(8, 16))
    }

    /// Of a small picture a tenth, four at least: what they show of numbers of samples that are not the first run's in the end is thrown
    /// away. (Of 20 tiles eight took up to half as much as the picture; with four, 0.72 to 1.07 of the instructions on seven scenes. Of
    /// 80 tiles four say too little of a picture half of which is sky: all began with 64 or 512 samples, 1.6 and 1.7 to 1.9
    /// times what a perfect allocation takes; with eight 1.2 and 1.3.)
    pub(super) fn to_choose(tiles: usize) -> Self {
        Self::new(tiles, 41, (tiles / 10).clamp(4, 8))
    }

    /// More: how long a few tiles take at the start says little of the others. (Of eight it did on the tower, 640 pixels wide, as
    /// if there were time for 8 samples where there was for 100.)
    pub(super) fn for_time(tiles: usize) -> Self {
        Self::new(tiles, 11, 12)
    }

    /// One in `most`, or more if they would be fewer than `least`.
    fn new(tiles: usize, most: usize, least: usize) -> Self {
        Self { stride: (tiles / least).clamp(1, most) as u32 }
    }

    /// Whether it has the tile in this column and row.
    fn contains(self, x: u32, y: u32) -> bool {
        // Each row begins elsewhere (by the golden section), or they might all lie below one another.
        let shift = (self.stride * 382 + 500) / 1000;
        (x + y * shift).is_multiple_of(self.stride)
    }
}

/// Where edges raise the squared error of the pilot by less than this, samples are given out before they are looked for. (Ten
/// scenes have 1.0 to 1.004; a table top 1.2 to 1.4, white rectangles from 1.1 on.)
const MUCH: f64 = 1.03;

/// The tiles that a pilot saw.
pub(super) struct Seen {
    pub tiles: Vec<TileBlocks>,
}

impl Seen {
    /// How many pixels these have.
    pub(super) fn pixels(&self) -> f64 {
        self.tiles.iter().flat_map(TileBlocks::blocks).map(|block| f64::from(block.pixels)).sum()
    }

    /// The blocks that may show more than the sky.
    pub(super) fn covered(&self) -> impl Iterator<Item = Block> {
        self.tiles.iter().flat_map(TileBlocks::blocks).filter(|block| !block.is_sky)
    }
}

impl Progressive<'_> {
    /// One that sees as many tiles with triangles as if the picture had no others.
    pub(super) fn pilot_of(&self, kind: impl Fn(usize) -> Pilot) -> Pilot {
        let columns = self.picture.bins.tiles_x;
        let covered: Vec<u32> =
            (0..).zip(self.covered.tiles()).filter(|(_, any)| *any).map(|(at, _)| at).collect();
        let (usual, wanted) =
            (kind(self.picture.tiles()), covered.len() / kind(covered.len()).stride as usize);
        if covered.len() == self.picture.tiles() {
            return usual;
        }
        let sees = |pilot: &Pilot| {
            covered.iter().filter(|&at| pilot.contains(at % columns, at / columns)).count() >= wanted
        };
        let strides = (1..=usual.stride).rev().map(|stride| Pilot { stride });
        strides.clone().find(sees).unwrap_or(usual)
    }

    /// Draws the first run of the tiles of a pilot, as far as `late` allows, and tells what those that have it are then.
    pub(super) fn pilot(
        &mut self,
        pilot: Pilot,
        execution: &Execution<'_>,
        late: &(dyn Fn() -> bool + Sync),
    ) -> Result<Seen> {
        let (columns, rows) = self.samples.columns_and_rows();
        let (tiles_x, tiles_y) = (columns.div_ceil(BLOCKS), rows.div_ceil(BLOCKS));
        let tiles = (0..tiles_y).flat_map(|y| (0..tiles_x).map(move |x| (x, y)));
        let tiles: Vec<(u32, u32)> = tiles.filter(|&(x, y)| pilot.contains(x, y)).collect();
        // Row by row, all as long.
        let places = |(tx, ty): (u32, u32)| {
            let (right, bottom) = ((tx * BLOCKS + BLOCKS).min(columns), (ty * BLOCKS + BLOCKS).min(rows));
            (ty * BLOCKS..bottom).flat_map(move |y| (tx * BLOCKS..right).map(move |x| (x, y)))
        };
        let at = |(x, y): (u32, u32)| (y * columns + x) as usize;
        let mut wanted = vec![0; self.errors.len()];
        let first = self.first_samples();
        tiles.iter().copied().flat_map(places).map(at).for_each(|block| wanted[block] = first[block]);
        self.round(&wanted, execution, late)?;
        let of_tile = |&tile: &(u32, u32)| {
            let block = |(x, y): (u32, u32)| Block { error: self.plain[at((x, y))], ..self.block(x, y) };
            let blocks = places(tile).map(block).collect();
            TileBlocks::new(blocks, (columns - tile.0 * BLOCKS).min(BLOCKS) as usize)
        };
        let is_drawn =
            |tile: &&(u32, u32)| places(**tile).all(|(x, y)| self.samples.get(x, y) >= first[at((x, y))]);
        let seen = Seen { tiles: tiles.iter().filter(is_drawn).map(of_tile).collect() };
        let by_edges =
            self.plain.iter().zip(&self.hidden).map(|(&plain, &hidden)| self.edges.error(plain, hidden, 0.0));
        self.edges.is_much = by_edges.sum::<f64>() > MUCH * self.plain.iter().sum::<f64>();
        Ok(seen)
    }
}

/// How errors fell in these tiles: see [`allocate::fall`].
pub(super) fn fall(before: &[TileBlocks], after: &[TileBlocks]) -> Option<f64> {
    let blocks = |tiles: &[TileBlocks]| tiles.iter().flat_map(TileBlocks::blocks).collect::<Vec<_>>();
    allocate::fall(&blocks(before), &blocks(after))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pilot_sees_every_part_of_the_picture() {
        for (columns, rows) in [(1, 1), (3, 2), (10, 8), (20, 16), (40, 32), (41, 41), (82, 30), (375, 300)] {
            let all = || (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
            let of = |x: u32, y: u32| Pilot::for_error((columns * rows) as usize).contains(x, y);
            let count = all().filter(|&(x, y)| of(x, y)).count() as u32;
            assert!(count >= 1 && count <= (columns * rows / 30).max(20), "{columns} {rows}: {count}");
            // None is farther from one than an eighth of all, laid out in a square, is wide, nor than seven tiles.
            let far = (f64::from(columns * rows) / 8.0).sqrt().clamp(1.0, 6.4).ceil() as i64;
            for (x, y) in all() {
                let near = |at: u32| (i64::from(at) - far).max(0) as u32..=(i64::from(at) + far) as u32;
                let found = near(y).any(|y| near(x).any(|x| x < columns && y < rows && of(x, y)));
                assert!(found || columns * rows < 8, "{columns} {rows}: {x} {y}");
            }
        }
    }
}
