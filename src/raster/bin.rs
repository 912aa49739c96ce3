//! Binning: the order of triangles, nearest first, and which of them may touch which tile.

use super::TILE;
use super::bounds::{Frustum, PixelBox, point_box};
use super::view::{LensCell, View};
use glam::DVec3;
use rayon::prelude::*;

/// Triangles a parallel task takes at a time; the result does not depend on it.
const CHUNK: usize = 8192;

/// Pixel boxes of vertices and crossing triangles, the order of triangles and the bins.
pub(crate) struct Bins {
    cells: usize,
    vertex_boxes: Vec<PixelBox>,
    /// Boxes of triangles that leave the frustum, by position in `crossing`.
    crossing: Vec<u32>,
    crossing_boxes: Vec<PixelBox>,
    /// For each tile the range of its entries.
    starts: Vec<usize>,
    entries: Vec<u32>,
    pub tiles_x: u32,
    pub tiles_y: u32,
}

/// `u32::MAX` stands for a vertex outside of the frustum.
const OUTSIDE: PixelBox = PixelBox { x0: 1, x1: 0, y0: 1, y1: 0 };

impl Bins {
    /// Bins `triangles` (indices into `positions`, lens frame) for samples in `cells` of the aperture.
    pub(crate) fn new(view: &View, cells: &[LensCell], positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let frustum = Frustum::new(view);
        let mut vertex_boxes = vec![OUTSIDE; positions.len() * cells.len()];
        vertex_boxes.par_chunks_mut(cells.len()).zip(positions).for_each(|(boxes, &position)| {
            if frustum.contains(position) {
                for (out, &cell) in boxes.iter_mut().zip(cells) {
                    *out = point_box(view, cell, position);
                }
            }
        });

        let order = nearest_first(positions, triangles);
        let crosses =
            |t: u32| triangles[t as usize].iter().any(|&v| vertex_boxes[v as usize * cells.len()] == OUTSIDE);
        let mut crossing: Vec<u32> = order
            .par_iter()
            .copied()
            .filter(|&t| crosses(t))
            .filter(|&t| {
                let corners = triangles[t as usize].map(|v| positions[v as usize]);
                !frustum.clip(corners).is_empty()
            })
            .collect();
        crossing.sort_unstable();
        let crossing_boxes: Vec<PixelBox> = crossing
            .par_iter()
            .flat_map_iter(|&t| {
                let clipped = frustum.clip(triangles[t as usize].map(|v| positions[v as usize]));
                cells.iter().map(move |&cell| {
                    clipped.iter().fold(PixelBox::EMPTY, |sum, &p| sum.union(point_box(view, cell, p)))
                })
            })
            .collect();

        let mut bins = Self {
            cells: cells.len(),
            vertex_boxes,
            crossing,
            crossing_boxes,
            starts: Vec::new(),
            entries: Vec::new(),
            tiles_x: view.width.div_ceil(TILE),
            tiles_y: view.height.div_ceil(TILE),
        };
        bins.fill(view, triangles, &order);
        bins
    }

    /// The triangles that may touch tile `(x, y)`, nearest first.
    pub(crate) fn tile(&self, x: u32, y: u32) -> &[u32] {
        let tile = (y * self.tiles_x + x) as usize;
        &self.entries[self.starts[tile]..self.starts[tile + 1]]
    }

    /// How many (triangle, tile) pairs there are.
    pub(crate) fn entries(&self) -> usize {
        self.entries.len()
    }

    /// The pixels that triangle `t` with these corners can reach from the lens points of `cell`.
    pub(crate) fn triangle_box(&self, t: u32, corners: [u32; 3], cell: usize) -> PixelBox {
        let boxes = corners.map(|v| self.vertex_boxes[v as usize * self.cells + cell]);
        if boxes.contains(&OUTSIDE) {
            return match self.crossing.binary_search(&t) {
                Ok(at) => self.crossing_boxes[at * self.cells + cell],
                Err(_) => PixelBox::EMPTY,
            };
        }
        boxes[0].union(boxes[1]).union(boxes[2])
    }

    /// Whether all corners lie in the frustum.
    pub(crate) fn in_front(&self, corners: [u32; 3]) -> bool {
        corners.iter().all(|&v| self.vertex_boxes[v as usize * self.cells] != OUTSIDE)
    }

    fn fill(&mut self, view: &View, triangles: &[[u32; 3]], order: &[u32]) {
        let tiles = self.tiles_x as usize * self.tiles_y as usize;
        // Each chunk of the order lists its (tile, triangle) pairs; chunks are then laid out in order, so the
        // bins hold the order whatever the threads did.
        let chunks: Vec<Vec<(u32, u32)>> = order
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut pairs = Vec::new();
                for &t in chunk {
                    let sum = (0..self.cells)
                        .map(|cell| self.triangle_box(t, triangles[t as usize], cell))
                        .fold(PixelBox::EMPTY, PixelBox::union);
                    let Some((tx, ty)) = tile_range(view, sum) else { continue };
                    for y in ty.clone() {
                        pairs.extend(tx.clone().map(|x| (y * self.tiles_x + x, t)));
                    }
                }
                pairs
            })
            .collect();
        let mut starts = vec![0usize; tiles + 1];
        for (tile, _) in chunks.iter().flatten() {
            starts[*tile as usize + 1] += 1;
        }
        for tile in 0..tiles {
            starts[tile + 1] += starts[tile];
        }
        let mut next = starts.clone();
        let mut entries = vec![0u32; starts[tiles]];
        for (tile, t) in chunks.iter().flatten() {
            let place = &mut next[*tile as usize];
            entries[*place] = *t;
            *place += 1;
        }
        self.starts = starts;
        self.entries = entries;
    }
}

/// The tiles that a box touches, if it touches the picture.
fn tile_range(view: &View, pixels: PixelBox) -> Option<(std::ops::Range<u32>, std::ops::Range<u32>)> {
    let range = |low: i16, high: i16, size: u32| {
        let (low, high) = (i64::from(low).max(0), i64::from(high).min(i64::from(size) - 1));
        (low <= high).then(|| (low as u32 / TILE)..(high as u32 / TILE + 1))
    };
    if pixels.is_empty() {
        return None;
    }
    Some((range(pixels.x0, pixels.x1, view.width)?, range(pixels.y0, pixels.y1, view.height)?))
}

/// Triangle numbers by the depth of their nearest vertex, then by number. Depth decides which of two
/// surfaces is seen; this order decides between surfaces at exactly the same depth.
fn nearest_first(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut keyed: Vec<(u32, u32)> = triangles
        .par_iter()
        .enumerate()
        .map(|(t, corners)| {
            let z = corners.iter().map(|&v| positions[v as usize].z).fold(f64::INFINITY, f64::min);
            // Positive floats order as their bits do.
            ((z.max(0.0) as f32).to_bits(), t as u32)
        })
        .collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, t)| t).collect()
}
