//! Binning: the triangles that may be seen, nearest first, and which of them may touch which tile.
//!
//! In: vertices in the lens frame and triangles, from `render::picture`. Out: the candidates, those that touch the picture, in
//! order ([`super::order`]), and for each tile its own ([`super::lists`]), sixteen at a time, for [`super::tile`].
//!
//! From the box of its pixels ([`super::boxes`]), `x0..=x1`, `y0..=y1`, a triangle touches the tiles `x0 / 32..=x1 / 32`,
//! `y0 / 32..=y1 / 32`. Its depth is the least `z` of its corners.

use super::bounds::PixelBox;
use super::boxes::{Boxes, CHUNK};
use super::bunches::Bunches;
use super::cull::{Cluster, Seen};
use super::lens_points::LensPoints;
use super::lists::{Cursor, TileLists, Tiles};
use super::order::{by_key, key};
use super::part::Part;
use super::view::{LensCell, View};
use super::visibility::EVERYWHERE;
use super::waiting::Waiting;
use super::{LANES, TILE};
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The triangles of a scene.
pub(crate) struct Triangles<'a> {
    /// Their corners, as numbers of vertices.
    pub vertices: &'a [[u32; 3]],
    /// The surface that a triangle is part of, and whether samples may pass through it.
    pub surface: &'a (dyn Fn(u32) -> (u32, bool) + Sync),
    /// The quad that a triangle is half of, if it is; only where quads are drawn as such.
    pub quad: Option<&'a (dyn Fn(u32) -> Option<Quad> + Sync)>,
    /// Those that come one after another, so many to a cluster, or none.
    pub clusters: &'a [Cluster],
    pub cluster_size: usize,
}

/// Two triangles of a surface that no sample passes through, and that together are a convex plane quadrilateral.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quad {
    /// Its corners in turn, as numbers of vertices.
    pub corners: [u32; 4],
    /// Whether it is drawn where this half comes, or the other.
    pub is_first: bool,
}

/// A triangle that may be seen, or a quad, with all that tiles ask of it: they come by in the order of depth, so each place more that
/// they would have to look at is one that memory has to bring. Half a line of the cache, never in two.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(crate) struct Candidate {
    /// Its number in the scene.
    pub triangle: u32,
    /// The depth of its nearest corner; 0 behind the lens.
    pub nearest: f32,
    /// Its corners, as numbers of vertices, of a quad three.
    pub vertices: [u32; 3],
    /// Its surface, and above that [`Candidate::INSIDE`], [`Candidate::CUTOUT`] and [`Candidate::QUAD`].
    surface: u32,
    /// The pixels that it can reach from the first cell of the lens.
    pixels: PixelBox,
}

/// Numbers of surfaces are less than this.
pub(crate) const MOST_SURFACES: usize = 1 << 29;

impl Candidate {
    const INSIDE: u32 = 1 << 31;
    const CUTOUT: u32 = 1 << 30;
    const QUAD: u32 = 1 << 29;

    /// The surface that it is part of. Which surface is seen is all that is told of a sample.
    #[inline(always)]
    pub(crate) fn surface(&self) -> u32 {
        self.surface & !(Self::INSIDE | Self::CUTOUT | Self::QUAD)
    }

    /// Whether all of its corners lie in the frustum.
    #[inline(always)]
    pub(crate) fn is_inside(&self) -> bool {
        self.surface & Self::INSIDE != 0
    }

    /// Whether it has a fourth corner, in [`Waiting::fourths`].
    #[inline(always)]
    pub(crate) fn is_quad(&self) -> bool {
        self.surface & Self::QUAD != 0
    }

    /// Whether samples may pass through it.
    #[inline(always)]
    pub(crate) fn is_cutout(&self) -> bool {
        self.surface & Self::CUTOUT != 0
    }
}

/// What a tile asks of a candidate when it lists it: they come by in the order of depth, and lie in it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Brief {
    /// Its number among the candidates.
    pub number: u32,
    pub triangle: u32,
    pub surface: u32,
    pub nearest: f32,
}

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
        let counts = (triangles.vertices.len(), positions.len());
        let seen = Seen::new(view, triangles.clusters, triangles.cluster_size, counts);
        let boxes = Boxes::new(simd, view, cells, positions, (triangles.vertices, &seen), stop);
        let (tiles_x, tiles_y) = (view.width.div_ceil(TILE), view.height.div_ceil(TILE));
        // What touches the picture, in the order of the scene: neighbours there are neighbours in space, and memory.
        let found: Vec<Found> = seen
            .triangles
            .par_chunks(CHUNK)
            .filter(|_| !stop())
            .map(|ranges| {
                let mut found = Found::default();
                let count = ranges.iter().map(Range::len).sum();
                found.candidates.reserve(count);
                found.tiles.reserve(count);
                let mut each = vec![PixelBox::EMPTY; cells.len()];
                let depth = |vertex: u32| positions[vertex as usize].z;
                // What leaves the frustum or comes near is drawn by triangles.
                let is_whole = |quad: &Quad| {
                    let near = view.near * NEAR;
                    boxes.are_inside(&quad.corners) && quad.corners.iter().all(|&v| depth(v) > near)
                };
                for t in ranges.iter().cloned().flatten() {
                    let (triangle, mut vertices) = (t as u32, triangles.vertices[t]);
                    let quad = triangles.quad.and_then(|quad| quad(triangle)).filter(is_whole);
                    let mut fourth = vertices[2];
                    if let Some(Quad { corners: [a, b, c, d], is_first }) = quad {
                        if !is_first {
                            continue;
                        }
                        (vertices, fourth) = ([a, b, c], d);
                    }
                    for (cell, pixels) in each.iter_mut().enumerate() {
                        *pixels = match &quad {
                            Some(quad) => boxes.around(&quad.corners, cell),
                            None => boxes.of(triangle, vertices, cell),
                        };
                    }
                    let all = each.iter().copied().fold(PixelBox::EMPTY, PixelBox::union);
                    let Some(tiles) = tiles(view, all) else { continue };
                    let [a, b, c] = vertices.map(depth);
                    let key = key(a.min(b).min(c).min(depth(fourth)));
                    let (surface, is_cutout) = (triangles.surface)(triangle);
                    let inside = if boxes.are_inside(&vertices) { Candidate::INSIDE } else { 0 };
                    let cutout = if is_cutout { Candidate::CUTOUT } else { 0 };
                    let four = if quad.is_some() { Candidate::QUAD } else { 0 };
                    found.candidates.push(Candidate {
                        triangle,
                        nearest: f32::from_bits(key),
                        vertices,
                        surface: surface | inside | cutout | four,
                        pixels: each[0],
                    });
                    if triangles.quad.is_some() {
                        found.fourths.push(fourth);
                    }
                    if each.len() > 1 {
                        found.boxes.extend_from_slice(&each);
                    }
                    found.tiles.push(tiles);
                }
                found
            })
            .collect();
        drop(boxes);
        let order = || {
            let mut keys = Vec::with_capacity(found.iter().map(|found| found.candidates.len()).sum());
            for found in found.iter().take_while(|_| !stop()) {
                let first = keys.len() as u32;
                keys.extend(found.candidates.iter().map(|found| found.nearest.to_bits()).zip(first..));
            }
            by_key(keys)
        };
        // Neither is divided among threads, so side by side.
        let (together, order) = rayon::join(
            || Found {
                candidates: concat(&found, |found| &found.candidates, stop),
                fourths: concat(&found, |found| &found.fourths, stop),
                boxes: concat(&found, |found| &found.boxes, stop),
                tiles: concat(&found, |found| &found.tiles, stop),
            },
            order,
        );
        drop(found);
        // What is stopped on the way is not of one length.
        let (together, order) = if stop() { (Found::default(), Vec::new()) } else { (together, order) };
        let Found { candidates, fourths, boxes, tiles } = together;
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
            Brief { number, triangle, surface, nearest: candidate.nearest }
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
        let part = Part { tile, block: (side, side), wanted: EVERYWHERE };
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

    /// The pixels that it can reach from a cell of the lens.
    pub(super) fn pixels(&self, number: u32, cell: usize) -> PixelBox {
        let number = number as usize;
        if self.cells == 1 { self.candidates[number].pixels } else { self.boxes[number * self.cells + cell] }
    }

    /// Fills `out` with the next candidates, nearest first, that may touch tile `(x, y)`, and with their boxes from each cell; where most
    /// are loose, that anything within the lens may see there.
    pub(super) fn next(
        &self,
        level: Level,
        tile: (u32, u32),
        cursor: &mut Cursor,
        lens: Option<&mut LensPoints>,
        out: &mut Waiting,
    ) {
        let first = out.count;
        let numbers = &mut out.numbers[first..];
        out.count += match lens {
            Some(lens) => {
                let next = || Some(lens.next(level, (&self.lists, &self.loose), tile, cursor)?.0);
                numbers.iter_mut().zip(std::iter::from_fn(next)).map(|(out, place)| *out = place).count()
            }
            None => self.lists.next(tile, cursor, numbers),
        };
        // They lie anywhere in memory: with nothing to decide in between, it brings many at once.
        for number in &mut out.numbers[first..out.count] {
            *number = self.order[*number as usize];
        }
        for at in first..out.count {
            out.candidates[at] = self.candidates[out.numbers[at] as usize];
        }
        if !self.fourths.is_empty() {
            for at in first..out.count {
                out.fourths[at] = self.fourths[out.numbers[at] as usize];
            }
        }
        out.boxes.truncate(first * self.cells);
        if self.cells == 1 {
            out.boxes.extend(out.candidates[first..out.count].iter().map(|candidate| candidate.pixels));
            return;
        }
        for number in &out.numbers[first..out.count] {
            let start = *number as usize * self.cells;
            out.boxes.extend_from_slice(&self.boxes[start..start + self.cells]);
        }
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

/// What is farther than so many times the nearest that is drawn is so wherever single precision puts it.
const NEAR: f64 = 1.0 + 2e-6;

/// Entries that the search for a loose triangle takes as long as.
const LOOSE_ENTRIES: usize = 8;

/// What one task finds: candidates, their fourth corners, their boxes and the tiles that they touch.
#[derive(Default)]
struct Found {
    candidates: Vec<Candidate>,
    fourths: Vec<u32>,
    boxes: Vec<PixelBox>,
    tiles: Vec<Tiles>,
}

fn concat<T: Copy>(found: &[Found], part: impl Fn(&Found) -> &Vec<T>, stop: &dyn Fn() -> bool) -> Vec<T> {
    let mut all = Vec::with_capacity(found.iter().map(|found| part(found).len()).sum());
    for found in found.iter().take_while(|_| !stop()) {
        all.extend_from_slice(part(found));
    }
    all
}

/// The tiles that a box touches, if it touches the picture.
fn tiles(view: &View, pixels: PixelBox) -> Option<Tiles> {
    let range = |low: i16, high: i16, size: u32| {
        let (low, high) = (i64::from(low).max(0), i64::from(high).min(i64::from(size) - 1));
        (low <= high).then_some((low as u32 / TILE, high as u32 / TILE))
    };
    if pixels.is_empty() {
        return None;
    }
    let (x, y) = (range(pixels.x0, pixels.x1, view.width)?, range(pixels.y0, pixels.y1, view.height)?);
    Some(Tiles { x0: x.0 as u16, x1: x.1 as u16, y0: y.0 as u16, y1: y.1 as u16 })
}
