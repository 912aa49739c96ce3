//! One tile: set-up of its triangles, then every batch of samples through the kernel to the shader.

use super::TILE;
use super::bin::Bins;
use super::kernel::{Opaque, Visit, cover};
use super::setup::{Image, Setup, TileFilm};
use super::view::{Batch, View};
use super::visibility::{Group, Visibility, group};
use fearless_simd::Level;
use glam::DVec3;

/// The geometry to draw, in the lens frame.
pub(crate) struct Geometry<'a> {
    pub positions: &'a [DVec3],
    /// Where the lens points see them.
    pub images: &'a [Image],
    pub triangles: &'a [[u32; 3]],
    /// For each triangle, whether samples may pass through it.
    pub cutout: &'a [bool],
    /// The surface that a triangle is part of, and how many surfaces there are. Which surface is seen is all
    /// that is told of a sample.
    pub surface: &'a (dyn Fn(u32) -> u32 + Sync),
    pub surfaces: usize,
}

/// What one thread reuses from tile to tile.
pub(crate) struct TileScratch {
    setups: Vec<Setup>,
    /// Block ranges, cell by cell, of each set-up; empty where `x0 > x1`.
    blocks: Vec<[u8; 4]>,
    crosses_near: Vec<bool>,
    /// For each set-up its place in `surfaces`.
    slots: Vec<u32>,
    /// The surfaces in the tile, each with one of its triangles.
    surfaces: Vec<u32>,
    /// For each surface of the scene the tile that last met it, and its place there.
    met: Vec<(u32, u32)>,
    tiles: u32,
    seen: Visibility,
    cells: usize,
    block: (u32, u32),
}

impl Default for TileScratch {
    fn default() -> Self {
        Self::new()
    }
}

impl TileScratch {
    pub(crate) fn new() -> Self {
        Self {
            setups: Vec::new(),
            blocks: Vec::new(),
            crosses_near: Vec::new(),
            slots: Vec::new(),
            surfaces: Vec::new(),
            met: Vec::new(),
            tiles: 0,
            seen: Visibility::new(),
            cells: 1,
            block: (1, 1),
        }
    }

    /// Sets up tile `(x, y)` for batches that serve `block` pixels across and down.
    pub(crate) fn prepare(
        &mut self,
        view: &View,
        geometry: &Geometry<'_>,
        bins: &Bins,
        cells: usize,
        block: (u32, u32),
        (x, y): (u32, u32),
    ) -> TileFilm {
        let film = TileFilm::new(view, x, y);
        self.cells = cells;
        self.block = block;
        self.setups.clear();
        self.blocks.clear();
        self.crosses_near.clear();
        self.slots.clear();
        self.surfaces.clear();
        self.met.resize(geometry.surfaces, (0, 0));
        self.tiles += 1;
        for &t in bins.tile(x, y) {
            let corners = geometry.triangles[t as usize];
            let v = corners.map(|i| geometry.positions[i as usize]);
            let images = bins.in_front(corners).then(|| corners.map(|i| &geometry.images[i as usize]));
            let Some(setup) = film.setup(t, v, images) else { continue };
            self.setups.push(setup);
            let met = &mut self.met[(geometry.surface)(t) as usize];
            if met.0 != self.tiles {
                *met = (self.tiles, self.surfaces.len() as u32);
                self.surfaces.push(t);
            }
            self.slots.push(met.1);
            self.crosses_near.push(v.iter().any(|p| p.z < view.near * (1.0 + 1e-6)));
            for cell in 0..cells {
                let pixels = bins.triangle_box(t, corners, cell);
                let range = |low: i16, high: i16, tile: u32, block: u32| {
                    let start = i64::from(tile * TILE);
                    let low = (i64::from(low) - start).max(0);
                    let high = (i64::from(high) - start).min(i64::from(TILE) - 1);
                    if low > high { None } else { Some((low as u32 / block, high as u32 / block)) }
                };
                let columns = range(pixels.x0, pixels.x1, x, block.0);
                let rows = range(pixels.y0, pixels.y1, y, block.1);
                self.blocks.push(match (columns, rows) {
                    (Some((x0, x1)), Some((y0, y1))) => [x0, x1, y0, y1].map(|b| b as u8),
                    _ => [1, 0, 1, 0],
                });
            }
        }
        film
    }

    /// Draws one batch of samples of the tile that is set up, in the `wanted` regions of 4 x 4 blocks (see
    /// [`Visibility::clear`]); what is seen stays until the next.
    pub(crate) fn draw(
        &mut self,
        level: Level,
        wanted: u64,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        batch: &Batch,
        opaque: &Opaque<'_>,
    ) {
        let Self { setups, slots, blocks, crosses_near, seen, cells, block, .. } = self;
        seen.clear(block.0, block.1, wanted);
        let visits = setups.iter().enumerate().filter_map(|(at, setup)| {
            let blocks = blocks[at * *cells + batch.cell];
            (blocks[0] <= blocks[1]).then(|| Visit {
                setup,
                id: slots[at],
                blocks,
                near: crosses_near[at].then_some(film.near),
                cutout: geometry.cutout[setup.triangle as usize],
            })
        });
        cover(level, batch, *block, visits, seen, opaque);
    }

    /// Sorts the samples of the batch that was drawn by what they see.
    pub(crate) fn group(&self, level: Level, batch: &Batch, out: &mut Vec<Group>) {
        group(level, batch, &self.seen, out);
    }

    /// The surfaces in the tile, by one triangle of each; a group's or visit's id is a place in them.
    pub(crate) fn surfaces(&self) -> &[u32] {
        &self.surfaces
    }
}
