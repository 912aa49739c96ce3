//! One tile: set-up of its triangles, then every batch of samples through the kernel to the shader.

use super::TILE;
use super::bin::Bins;
use super::kernel::{Group, Opaque, Visibility, Visit, cover, group};
use super::setup::{Setup, TileFilm};
use super::view::{Batch, Pattern, View};
use fearless_simd::Level;
use glam::DVec3;

/// The geometry to draw, in the lens frame.
pub(crate) struct Geometry<'a> {
    pub positions: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
    /// For each triangle, whether samples may pass through it.
    pub cutout: &'a [bool],
}

/// What one thread reuses from tile to tile.
pub(crate) struct TileScratch {
    setups: Vec<Setup>,
    /// Block ranges, cell by cell, of each set-up; empty where `x0 > x1`.
    blocks: Vec<[u8; 4]>,
    crosses_near: Vec<bool>,
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
            seen: Visibility::new(),
            cells: 1,
            block: (1, 1),
        }
    }

    /// Sets up tile `(x, y)`.
    pub(crate) fn prepare(
        &mut self,
        view: &View,
        geometry: &Geometry<'_>,
        bins: &Bins,
        cells: usize,
        pattern: &Pattern,
        (x, y): (u32, u32),
    ) -> TileFilm {
        let film = TileFilm::new(view, x, y);
        self.cells = cells;
        self.block = (pattern.block_width, pattern.block_height);
        self.setups.clear();
        self.blocks.clear();
        self.crosses_near.clear();
        for &t in bins.tile(x, y) {
            let corners = geometry.triangles[t as usize];
            let v = corners.map(|i| geometry.positions[i as usize]);
            let Some(setup) = film.setup(t, v, bins.in_front(corners)) else { continue };
            self.setups.push(setup);
            self.crosses_near.push(v.iter().any(|p| p.z < view.near * (1.0 + 1e-6)));
            for cell in 0..cells {
                let pixels = bins.triangle_box(t, corners, cell);
                let range = |low: i16, high: i16, tile: u32, block: u32| {
                    let start = i64::from(tile * TILE);
                    let low = (i64::from(low) - start).max(0);
                    let high = (i64::from(high) - start).min(i64::from(TILE) - 1);
                    if low > high { None } else { Some((low as u32 / block, high as u32 / block)) }
                };
                let columns = range(pixels.x0, pixels.x1, x, pattern.block_width);
                let rows = range(pixels.y0, pixels.y1, y, pattern.block_height);
                self.blocks.push(match (columns, rows) {
                    (Some((x0, x1)), Some((y0, y1))) => [x0, x1, y0, y1].map(|b| b as u8),
                    _ => [1, 0, 1, 0],
                });
            }
        }
        film
    }

    /// Draws one batch of samples of the tile that is set up; what is seen stays until the next.
    pub(crate) fn draw(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        batch: &Batch,
        opaque: &Opaque<'_>,
    ) {
        let Self { setups, blocks, crosses_near, seen, cells, block } = self;
        seen.clear(block.0, block.1);
        let visits = setups.iter().enumerate().filter_map(|(at, setup)| {
            let blocks = blocks[at * *cells + batch.cell];
            (blocks[0] <= blocks[1]).then(|| Visit {
                setup,
                id: at as u32,
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

    /// The set-ups of the tile's triangles; a group's or visit's id is a place in them.
    pub(crate) fn setups(&self) -> &[Setup] {
        &self.setups
    }
}
