//! Binning: the triangles that may be seen, nearest first, and which of them may touch which tile.
//!
//! In: vertices in the lens frame and triangles. Out: the candidates, those that touch the picture, in order, and for
//! each tile its own ([`super::lists`]).

use super::bounds::{Frustum, PixelBox, point_boxes};
use super::lists::{Cursor, TileLists, Tiles};
use super::order::{by_key, key};
use super::view::{LensCell, View};
use super::{LANES, TILE};
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;

/// Triangles and vertices that a parallel task takes at a time; the result does not depend on it.
const CHUNK: usize = 4096;

/// A triangle that may be seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Candidate {
    /// Its number in the scene, and its corners.
    pub triangle: u32,
    pub corners: [u32; 3],
    /// The depth of its nearest corner; 0 behind the lens.
    pub nearest: f32,
}

/// Pixel boxes of vertices and crossing triangles, the order of triangles and the bins.
pub(crate) struct Bins {
    cells: usize,
    vertex_boxes: Vec<PixelBox>,
    /// Triangles that leave the frustum, by number, and their boxes.
    crossing: Vec<u32>,
    crossing_boxes: Vec<PixelBox>,
    candidates: Vec<Candidate>,
    /// Places in `candidates`, by tile.
    lists: TileLists,
    pub tiles_x: u32,
    pub tiles_y: u32,
}

impl Bins {
    /// Bins `triangles` (indices into `positions`, lens frame) for samples in `cells` of the aperture.
    pub(crate) fn new(
        simd: Level,
        view: &View,
        cells: &[LensCell],
        positions: &[DVec3],
        triangles: &[[u32; 3]],
    ) -> Self {
        let frustum = Frustum::new(view);
        let mut vertex_boxes = vec![PixelBox::OUTSIDE; positions.len() * cells.len()];
        vertex_boxes
            .par_chunks_mut(CHUNK * cells.len())
            .zip(positions.par_chunks(CHUNK))
            .for_each(|(boxes, points)| point_boxes(simd, view, Some(&frustum), cells, points, boxes));

        let mut bins = Self {
            cells: cells.len(),
            vertex_boxes,
            crossing: Vec::new(),
            crossing_boxes: Vec::new(),
            candidates: Vec::new(),
            lists: TileLists::default(),
            tiles_x: view.width.div_ceil(TILE),
            tiles_y: view.height.div_ceil(TILE),
        };
        bins.box_crossing(simd, view, &frustum, cells, positions, triangles);
        let tiles = bins.choose(view, positions, triangles);
        bins.lists = TileLists::new(bins.tiles_x, bins.tiles_y, &tiles);
        bins
    }

    /// How many entries the lists have.
    pub(crate) fn entries(&self) -> usize {
        self.lists.entries()
    }

    /// At least the most triangles that a tile has.
    pub(crate) fn fullest(&self) -> usize {
        self.lists.fullest()
    }

    /// The next triangles, at most 16, that may touch tile `(x, y)`, nearest first; fewer at the end.
    pub(crate) fn take(&self, tile: (u32, u32), cursor: &mut Cursor, out: &mut [Candidate; LANES]) -> usize {
        let mut places = [0; LANES];
        let count = self.lists.next(tile, cursor, &mut places);
        for (out, &place) in out.iter_mut().zip(&places[..count]) {
            *out = self.candidates[place as usize];
        }
        count
    }

    /// The pixels that triangle `t` with these corners can reach from the lens points of `cell`.
    pub(crate) fn triangle_box(&self, t: u32, corners: [u32; 3], cell: usize) -> PixelBox {
        let boxes = corners.map(|v| self.vertex_boxes[v as usize * self.cells + cell]);
        if boxes.contains(&PixelBox::OUTSIDE) {
            return match self.crossing.binary_search(&t) {
                Ok(at) => self.crossing_boxes[at * self.cells + cell],
                Err(_) => PixelBox::EMPTY,
            };
        }
        boxes[0].union(boxes[1]).union(boxes[2])
    }

    /// Whether all corners lie in the frustum.
    pub(crate) fn in_front(&self, corners: [u32; 3]) -> bool {
        corners.iter().all(|&v| self.vertex_boxes[v as usize * self.cells] != PixelBox::OUTSIDE)
    }

    /// Finds the triangles that leave the frustum but for a part, and that part's boxes.
    fn box_crossing(
        &mut self,
        simd: Level,
        view: &View,
        frustum: &Frustum,
        cells: &[LensCell],
        positions: &[DVec3],
        triangles: &[[u32; 3]],
    ) {
        let found: Vec<(Vec<u32>, Vec<PixelBox>)> = triangles
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, triangles)| {
                let (mut numbers, mut boxes) = (Vec::new(), Vec::new());
                let mut each = Vec::new();
                for (t, corners) in (chunk * CHUNK..).zip(triangles) {
                    if self.in_front(*corners) {
                        continue;
                    }
                    let clipped = frustum.clip(corners.map(|v| positions[v as usize]));
                    if clipped.is_empty() {
                        continue;
                    }
                    each.clear();
                    each.resize(clipped.len() * cells.len(), PixelBox::EMPTY);
                    point_boxes(simd, view, None, cells, &clipped, &mut each);
                    numbers.push(t as u32);
                    boxes.extend((0..cells.len()).map(|cell| {
                        let of_cell = each.iter().skip(cell).step_by(cells.len());
                        of_cell.fold(PixelBox::EMPTY, |sum, pixels| sum.union(*pixels))
                    }));
                }
                (numbers, boxes)
            })
            .collect();
        for (numbers, boxes) in found {
            self.crossing.extend(numbers);
            self.crossing_boxes.extend(boxes);
        }
    }

    /// Makes the list of triangles that touch the picture, nearest first, and says which tiles each touches.
    fn choose(&mut self, view: &View, positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<Tiles> {
        let chunks: Vec<Vec<(Candidate, Tiles)>> = triangles
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, triangles)| {
                let found = (chunk * CHUNK..).zip(triangles).filter_map(|(t, &corners)| {
                    let triangle = t as u32;
                    let tiles = tiles(
                        view,
                        (0..self.cells)
                            .map(|cell| self.triangle_box(triangle, corners, cell))
                            .fold(PixelBox::EMPTY, PixelBox::union),
                    )?;
                    let depth = corners.map(|v| positions[v as usize].z);
                    let nearest = f32::from_bits(key(depth[0].min(depth[1]).min(depth[2])));
                    Some((Candidate { triangle, corners, nearest }, tiles))
                });
                found.collect()
            })
            .collect();
        let found: Vec<(Candidate, Tiles)> = chunks.concat();
        let keys: Vec<u32> = found.iter().map(|(candidate, _)| candidate.nearest.to_bits()).collect();
        let order = by_key(&keys);
        let (candidates, tiles) = order.par_iter().map(|&place| found[place as usize]).unzip();
        self.candidates = candidates;
        tiles
    }
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
