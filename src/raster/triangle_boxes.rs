//! The pixels that triangles can reach: vertices and triangles in, a box for each triangle and cell of the lens out.
//!
//! For [`super::bin`]. A triangle's box is that around those of its corners ([`super::vertex_boxes`]), `[min x0, max x1] x
//! [min y0, max y1]`, or of the corners that the frustum leaves it.

use super::batch::LensCell;
use super::cull::{Seen, VERTEX_CHUNK};
use super::vertex_boxes::{Frustum, PixelBox, point_boxes};
use super::view::View;
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;

/// Ranges of triangles, and blocks of vertices, that a parallel task takes at a time; the result does not depend on it.
pub(super) const CHUNK: usize = 16;

/// Pixel boxes of vertices, and of triangles that leave the frustum.
pub(super) struct Boxes<'a> {
    cells: usize,
    seen: &'a Seen,
    /// By their places in what is seen.
    vertices: Vec<PixelBox>,
    /// Triangles that leave the frustum but for a part, by number, and that part's boxes.
    crossing: Vec<u32>,
    crossing_boxes: Vec<PixelBox>,
}

impl<'a> Boxes<'a> {
    pub(super) fn new(
        simd: Level,
        view: &View,
        cells: &[LensCell],
        positions: &[DVec3],
        (triangles, seen): (&[[u32; 3]], &'a Seen),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Self {
        let frustum = Frustum::new(view);
        let blocks: Vec<&[DVec3]> = seen.blocks().map(|block| &positions[block]).collect();
        let mut vertices = vec![PixelBox::OUTSIDE; seen.vertices * cells.len()];
        vertices
            .par_chunks_mut(VERTEX_CHUNK * cells.len())
            .zip(blocks)
            .with_min_len(CHUNK)
            .filter(|_| !stop())
            .for_each(|(boxes, points)| point_boxes(simd, view, Some(&frustum), cells, points, boxes));
        let mut boxes =
            Self { cells: cells.len(), seen, vertices, crossing: Vec::new(), crossing_boxes: Vec::new() };
        if !stop() {
            boxes.cross(simd, view, &frustum, cells, positions, triangles);
        }
        boxes
    }

    /// The pixels that a vertex can reach from the lens points of `cell`.
    #[inline(always)]
    fn vertex(&self, vertex: u32, cell: usize) -> PixelBox {
        // Where clusters are not of these triangles, vertices may have no place.
        let at = self.seen.place(vertex).saturating_mul(self.cells);
        self.vertices.get(at.saturating_add(cell)).copied().unwrap_or(PixelBox::OUTSIDE)
    }

    /// The pixels that triangle `t` with these corners can reach from the lens points of `cell`.
    pub(super) fn of(&self, t: u32, corners: [u32; 3], cell: usize) -> PixelBox {
        let boxes = corners.map(|v| self.vertex(v, cell));
        if boxes.contains(&PixelBox::OUTSIDE) {
            return match self.crossing.binary_search(&t) {
                Ok(at) => self.crossing_boxes[at * self.cells + cell],
                Err(_) => PixelBox::EMPTY,
            };
        }
        boxes[0].union(boxes[1]).union(boxes[2])
    }

    /// The pixels that what has these corners, all of them in the frustum, can reach from the lens points of `cell`.
    pub(super) fn around(&self, corners: &[u32], cell: usize) -> PixelBox {
        corners.iter().fold(PixelBox::EMPTY, |sum, &corner| sum.union(self.vertex(corner, cell)))
    }

    /// Whether these vertices all lie in the frustum.
    pub(super) fn are_inside(&self, corners: &[u32]) -> bool {
        corners.iter().all(|&v| self.vertex(v, 0) != PixelBox::OUTSIDE)
    }

    /// Finds the triangles that leave the frustum but for a part, and that part's boxes.
    fn cross(
        &mut self,
        simd: Level,
        view: &View,
        frustum: &Frustum,
        cells: &[LensCell],
        positions: &[DVec3],
        triangles: &[[u32; 3]],
    ) {
        let found: Vec<(Vec<u32>, Vec<PixelBox>)> = self
            .seen
            .triangles
            .par_chunks(CHUNK)
            .map(|ranges| {
                let (mut numbers, mut boxes) = (Vec::new(), Vec::new());
                let mut each = Vec::new();
                for t in ranges.iter().cloned().flatten() {
                    let corners = triangles[t];
                    if self.are_inside(&corners) {
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
}
