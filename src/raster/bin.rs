//! Binning: the triangles that may be seen, nearest first, and which of them may touch which tile.
//!
//! In: vertices in the lens frame and triangles, from `render::prepared`. Out: the candidates, those that touch the picture
//! ([`super::found`]), in order, and for each tile its own ([`super::tile_lists`]), sixteen at a time, for [`super::waiting`].
//!
//! Where most of what tiles would list is loose ([`super::bunches`]), all is binned once more without quads.

use super::batch::LensCell;
use super::bunches::Bunches;
use super::candidate::{Brief, Candidate};
use super::found::{Found, Triangles, Vertices};
use super::lens_points::LensPoints;
use super::part::Part;
use super::tile_lists::{Cursor, TileLists, Tiles};
use super::vertex_boxes::PixelBox;
use super::view::View;
use super::visibility::EVERYWHERE;
use super::{LANES, TILE};
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;

/// The candidates, and which of them may touch which tile.
pub(crate) struct Bins {
    candidates: Vec<Candidate>,
    /// The fourth corners of quads, candidate by candidate, of triangles the third once more; empty where there are no quads.
    fourths: Vec<u32>,
    /// For each candidate and cell the pixels that it can reach; empty where there is one cell.
    boxes: Vec<PixelBox>,
    cells: usize,
    /// Places in `candidates`, nearest first.
    order: Vec<u32>,
    /// The same for tiles where most are loose.
    briefs: Vec<Brief>,
    /// Places in `order` of those that are far out of focus, where these are most of what tiles would list.
    loose: Bunches,
    /// Places in `order` of the others, by tile.
    lists: TileLists,
    pub tiles_x: u32,
    pub tiles_y: u32,
}

impl Bins {
    /// Bins `triangles` (vertices are places in `positions`, lens frame) for samples in `cells` of the aperture. When `stop`
    /// says so they are soon done, and of no use.
    pub(crate) fn new(
        simd: Level,
        view: &View,
        cells: &[LensCell],
        positions: &[DVec3],
        triangles: &Triangles<'_>,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Self {
        let scene = Vertices { view, cells, positions };
        let (Found { candidates, fourths, boxes, tiles }, order) = Found::all(simd, &scene, triangles, stop);
        let (tiles_x, tiles_y) = (view.width.div_ceil(TILE), view.height.div_ceil(TILE));
        let mut tiles: Vec<Tiles> = order.par_iter().map(|&place| tiles[place as usize]).collect();
        let corners = |place: u32| {
            let candidate = &candidates[place as usize];
            candidate.is_inside().then(|| candidate.vertices.map(|v| positions[v as usize]))
        };
        let loose = Bunches::take(view, &order, &mut tiles, corners);
        if loose.count > 0 && triangles.quad.is_some() {
            // What is far out of focus is drawn by triangles.
            drop((candidates, fourths, boxes));
            let triangles = Triangles { quad: None, ..*triangles };
            return Self::new(simd, view, cells, positions, &triangles, stop);
        }
        let lists = TileLists::new(tiles_x, tiles_y, &tiles);
        let brief = |&number: &u32| {
            let candidate = &candidates[number as usize];
            let (triangle, surface) = (candidate.triangle, candidate.surface());
            Brief { number, triangle, surface, least_z: candidate.least_z }
        };
        let briefs = if loose.count > 0 { order.par_iter().map(brief).collect() } else { Vec::new() };
        let cells = cells.len();
        Self { candidates, fourths, boxes, order, briefs, loose, cells, lists, tiles_x, tiles_y }
    }

    /// How many entries the lists have, and loose triangles there are.
    pub(crate) fn entries(&self) -> usize {
        self.lists.entries() + self.loose.count
    }

    /// How many entries tiles would take as long to go through, about: loose triangles are looked for in all of them.
    pub(crate) fn work(&self) -> usize {
        self.lists.entries() + LOOSE_ENTRIES * self.loose.count
    }

    /// The number of cells of the lens.
    pub(crate) fn cells(&self) -> usize {
        self.cells
    }

    /// At least the most triangles that a tile has, but for those that are loose.
    pub(crate) fn fullest(&self) -> usize {
        self.lists.fullest()
    }

    /// How many are loose, where most of what tiles would list is: at least as many as a tile lists.
    pub(crate) fn loose(&self) -> usize {
        self.loose.count
    }

    /// In which of a tile's squares of `side` pixels triangles may be seen, row by row, one bit each: in all where some are loose.
    pub(crate) fn squares(&self, tile: (u32, u32), side: u32) -> u64 {
        let across = TILE / side;
        let all = u64::MAX >> (64 - across * across);
        if self.are_loose() {
            return all;
        }
        let part = Part { tile, block_size: (side, side), wanted: EVERYWHERE };
        let (mut found, mut cursor, mut places) = (0, Cursor::default(), [0; LANES]);
        loop {
            let count = self.lists.next(tile, &mut cursor, &mut places);
            for &place in &places[..count] {
                let number = self.order[place as usize];
                let boxes = (0..self.cells).map(|cell| self.pixels(number, cell));
                if let Some([x0, x1, y0, y1]) = part.blocks(boxes.fold(PixelBox::EMPTY, PixelBox::union)) {
                    let row = (2u64 << x1) - (1 << x0);
                    found |= (y0..=y1).fold(0, |rows, y| rows | row << (u32::from(y) * across));
                }
            }
            if count < LANES || found == all {
                return found;
            }
        }
    }

    /// How many triangles a tile has, but for those that touch many.
    pub(super) fn crowd(&self, tile: (u32, u32)) -> usize {
        self.lists.crowd(tile)
    }

    /// Whether most of what the tiles list are triangles that few of a tile's lens points see.
    pub(crate) fn are_loose(&self) -> bool {
        self.loose() > 0
    }

    /// The candidate of that number.
    pub(super) fn candidate(&self, number: u32) -> Candidate {
        self.candidates[number as usize]
    }

    /// Its fourth corner, of a triangle the third once more.
    pub(super) fn fourth(&self, number: u32) -> u32 {
        self.fourths[number as usize]
    }

    /// Whether any are quads.
    pub(super) fn has_quads(&self) -> bool {
        !self.fourths.is_empty()
    }

    /// The pixels that it can reach from each cell of the lens, where there are several.
    pub(super) fn boxes(&self, number: u32) -> &[PixelBox] {
        let start = number as usize * self.cells;
        &self.boxes[start..start + self.cells]
    }

    /// The pixels that it can reach from a cell of the lens.
    pub(super) fn pixels(&self, number: u32, cell: usize) -> PixelBox {
        let number = number as usize;
        if self.cells == 1 { self.candidates[number].pixels } else { self.boxes[number * self.cells + cell] }
    }

    /// Fills `out` with the numbers of the next candidates, nearest first, that may touch tile `(x, y)`; where most are loose, that
    /// anything within the lens may see there. Tells how many there were.
    pub(super) fn next(
        &self,
        level: Level,
        tile: (u32, u32),
        cursor: &mut Cursor,
        lens: Option<&mut LensPoints>,
        out: &mut [u32],
    ) -> usize {
        let count = match lens {
            Some(lens) => {
                let next = || Some(lens.next(level, (&self.lists, &self.loose), tile, cursor)?.0);
                out.iter_mut().zip(std::iter::from_fn(next)).map(|(out, place)| *out = place).count()
            }
            None => self.lists.next(tile, cursor, out),
        };
        for number in &mut out[..count] {
            *number = self.order[*number as usize];
        }
        count
    }

    /// The next candidate, nearest first, that lens points may see in tile `(x, y)`, and which may; only where most are loose.
    pub(super) fn next_seen<'a>(
        &self,
        level: Level,
        tile: (u32, u32),
        cursor: &mut Cursor,
        lens: &'a mut LensPoints,
    ) -> Option<(Brief, &'a [u64])> {
        let (place, points) = lens.next(level, (&self.lists, &self.loose), tile, cursor)?;
        Some((self.briefs[place as usize], points))
    }
}

/// Entries that the search for a loose triangle takes as long as.
const LOOSE_ENTRIES: usize = 8;
