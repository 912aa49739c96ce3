//! The triangles that touch the picture, and how far they reach in it.
//!
//! In: vertices in the lens frame and triangles, by way of [`super::bin`]. Out: a [`Found`], with all that touch the picture in the order
//! of the scene, and their order by depth ([`super::order`]).
//!
//! From the box of its pixels ([`super::triangle_boxes`]), `x0..=x1`, `y0..=y1`, a triangle touches the tiles `x0 / 32..=x1 / 32`,
//! `y0 / 32..=y1 / 32`. Its depth is the least `z` of its corners.

use super::TILE;
use super::batch::LensCell;
use super::candidate::{Candidate, Quad};
use super::cull::{Cluster, Seen};
use super::order::{by_key, key};
use super::tile_lists::Tiles;
use super::triangle_boxes::{Boxes, CHUNK};
use super::vertex_boxes::PixelBox;
use super::view::View;
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

/// What sees them, and where their vertices are.
pub(super) struct Vertices<'a> {
    pub view: &'a View,
    pub cells: &'a [LensCell],
    /// In the lens frame.
    pub positions: &'a [DVec3],
}

impl Vertices<'_> {
    fn depth(&self, vertex: u32) -> f64 {
        self.positions[vertex as usize].z
    }

    /// Whether a quad may be drawn as one: what leaves the frustum or comes near is drawn by triangles.
    fn is_whole(&self, boxes: &Boxes<'_>, quad: &Quad) -> bool {
        let is_far = |&vertex: &u32| self.view.may_have_quads(self.depth(vertex));
        boxes.are_inside(&quad.corners) && quad.corners.iter().all(is_far)
    }
}

/// Candidates, their fourth corners, their boxes from each cell of the lens and the tiles that they touch. Of one task, or of all.
#[derive(Default)]
pub(super) struct Found {
    pub candidates: Vec<Candidate>,
    /// Only where quads are drawn.
    pub fourths: Vec<u32>,
    /// Only where there are several cells.
    pub boxes: Vec<PixelBox>,
    pub tiles: Vec<Tiles>,
}

impl Found {
    /// What touches the picture, in the order of the scene: neighbours there are neighbours in space, and memory. And their numbers,
    /// nearest first.
    pub(super) fn all(
        simd: Level,
        scene: &Vertices<'_>,
        triangles: &Triangles<'_>,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> (Self, Vec<u32>) {
        let &Vertices { view, cells, positions } = scene;
        let counts = (triangles.vertices.len(), positions.len());
        let seen = Seen::new(view, triangles.clusters, triangles.cluster_size, counts);
        let boxes = Boxes::new(simd, view, cells, positions, (triangles.vertices, &seen), stop);
        let found: Vec<Self> = seen
            .triangles
            .par_chunks(CHUNK)
            .filter(|_| !stop())
            .map(|ranges| {
                let mut found = Self::default();
                found.add(scene, &boxes, triangles, ranges);
                found
            })
            .collect();
        drop(boxes);
        // Neither is divided among threads, so side by side.
        let together = || Self {
            candidates: concat(&found, |found| &found.candidates, stop),
            fourths: concat(&found, |found| &found.fourths, stop),
            boxes: concat(&found, |found| &found.boxes, stop),
            tiles: concat(&found, |found| &found.tiles, stop),
        };
        let both = rayon::join(together, || order(&found, stop));
        // What is stopped on the way is not of one length.
        if stop() { (Self::default(), Vec::new()) } else { both }
    }

    /// Adds those of a task.
    fn add(
        &mut self,
        scene: &Vertices<'_>,
        boxes: &Boxes<'_>,
        triangles: &Triangles<'_>,
        ranges: &[Range<usize>],
    ) {
        let count = ranges.iter().map(Range::len).sum();
        self.candidates.reserve(count);
        self.tiles.reserve(count);
        let mut each = vec![PixelBox::EMPTY; scene.cells.len()];
        for t in ranges.iter().cloned().flatten() {
            let (triangle, mut vertices) = (t as u32, triangles.vertices[t]);
            let quad = triangles.quad.and_then(|quad| quad(triangle));
            let quad = quad.filter(|quad| scene.is_whole(boxes, quad));
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
            let Some(tiles) = tiles(scene.view, all) else { continue };
            let [a, b, c] = vertices.map(|vertex| scene.depth(vertex));
            let key = key(a.min(b).min(c).min(scene.depth(fourth)));
            let (surface, is_cutout) = (triangles.surface)(triangle);
            let inside = if boxes.are_inside(&vertices) { Candidate::INSIDE } else { 0 };
            let cutout = if is_cutout { Candidate::CUTOUT } else { 0 };
            let four = if quad.is_some() { Candidate::QUAD } else { 0 };
            self.candidates.push(Candidate {
                triangle,
                least_z: f32::from_bits(key),
                vertices,
                surface: surface | inside | cutout | four,
                pixels: each[0],
            });
            if triangles.quad.is_some() {
                self.fourths.push(fourth);
            }
            if each.len() > 1 {
                self.boxes.extend_from_slice(&each);
            }
            self.tiles.push(tiles);
        }
    }
}

/// The numbers of all candidates, nearest first.
fn order(found: &[Found], stop: &dyn Fn() -> bool) -> Vec<u32> {
    let mut keys = Vec::with_capacity(found.iter().map(|found| found.candidates.len()).sum());
    for found in found.iter().take_while(|_| !stop()) {
        let first = keys.len() as u32;
        keys.extend(found.candidates.iter().map(|found| found.least_z.to_bits()).zip(first..));
    }
    by_key(keys)
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
