//! One tile: its samples through the rasterizer, grouped by what they see, shaded and summed.

use super::pattern::{Splits, pattern};
use super::picture::Picture;
use super::stages::{Stages, Stopwatch};
use crate::raster::setup::TileFilm;
use crate::raster::tile::Geometry;
use crate::raster::view::{Batch, Pattern, from_center};
use crate::raster::visibility::{Group, NOTHING};
use crate::raster::{self, TILE};
use crate::sampling::runs::Run;
use crate::sampling::{self, hash};
use crate::shade::{LaneSums, Look, Place, Rays, Samples};
use glam::{Vec2, Vec3};
use std::cell::RefCell;

/// What one thread reuses from tile to tile.
#[derive(Default)]
pub(super) struct TileScratch {
    raster: raster::tile::TileScratch,
    groups: Vec<Group>,
    /// The same by surface, and where the next of each surface goes.
    runs: Vec<Group>,
    next: Vec<u32>,
    /// By place among the tile's surfaces; made when first asked for.
    looks: RefCell<Vec<Option<Box<Look>>>>,
    /// The sums before the step that is being drawn.
    before: Vec<[Vec3; 2]>,
}

/// What came of one tile beside its sums.
#[derive(Clone, Copy, Default)]
pub(super) struct Tally {
    pub requests: u64,
    /// Blocks that may have missed a light.
    pub unseen_light: u64,
    pub stages: Stages,
}

/// The set bits of a mask, lowest first.
#[derive(Clone, Copy)]
struct Lanes(u16);

impl Iterator for Lanes {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros() as usize;
        (self.0 != 0).then(|| {
            self.0 &= self.0 - 1;
            lane
        })
    }
}

/// A run of samples, how it is sorted into batches, and the regions of the tile that take part (bit `8 row + column`).
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub run: Run,
    pub splits: Splits,
    pub wanted: u64,
}

impl Picture<'_> {
    /// Draws the samples of `steps` in one tile and adds them to `sums`: of the even and the odd samples of each pixel, in
    /// the order of the batches. Tells how many steps were done before `stop` said so; of the next nothing is left.
    pub(super) fn draw_tile(
        &self,
        scratch: &mut TileScratch,
        tile: (u32, u32),
        steps: &[Step],
        sums: &mut Vec<[Vec3; 2]>,
        mut watch: Stopwatch<'_>,
        stop: &dyn Fn() -> bool,
    ) -> (Tally, usize) {
        let mut tally = Tally::default();
        let TileScratch { raster, groups, runs, next, looks, before } = scratch;
        let geometry = Geometry {
            positions: &self.positions,
            images: &self.images,
            triangles: &self.surfaces.triangles,
            cutout: &self.cutout,
            surface: &|t| self.patch(t).0,
            surfaces: self.surface_count,
        };
        let block = sampling::block(self.streams);
        let film = raster.prepare(&self.view, &geometry, &self.bins, self.cells.len(), block, tile);
        looks.get_mut().clear();
        looks.get_mut().resize_with(raster.surfaces().len(), || None);
        let rays = Rays {
            p: film.p.as_vec3(),
            dx: film.dx.as_vec3(),
            dy: film.dy.as_vec3(),
            focal_length: self.view.focal_length as f32,
            radius: self.view.radius as f32,
        };
        let falloff = self
            .falloff
            .as_ref()
            .map(|falloff| |place: Place, ray: Vec3| falloff.weight(&self.view, ray.as_dvec3(), place));
        sums.resize((TILE * TILE) as usize, [Vec3::ZERO; 2]);
        for (done, step) in steps.iter().enumerate() {
            before.clone_from(sums);
            let mut pattern = pattern(&self.points, tile, self.streams, step.run, step.splits);
            if self.centred {
                pattern.center();
            }
            watch.lap(&mut tally.stages.setup);
            for batch in &pattern.batches {
                if stop() {
                    sums.clone_from(before);
                    return (tally, done);
                }
                raster.draw(self.level, step.wanted, &geometry, &film, batch, &|visit, block, lanes| {
                    let mut looks = looks.borrow_mut();
                    let Some(slot) = looks.get_mut(visit.id as usize) else { return lanes };
                    let look = slot.get_or_insert_with(|| self.look(&film, visit.setup.triangle));
                    let (corner, key) = self.corner(tile, &pattern, batch, block);
                    self.shader.met(self.level, look, visit.setup.triangle, (batch, corner), lanes, key)
                });
                watch.lap(&mut tally.stages.coverage);
                raster.group(self.level, batch, groups);
                if !self.shared {
                    split(groups, runs);
                }
                sort_by_surface(groups, raster.surfaces().len(), runs, next);
                watch.lap(&mut tally.stages.group);
                tally.requests += runs.len() as u64;
                let samples = Samples {
                    batch,
                    means: &LaneSums::new(batch),
                    rays: &rays,
                    pattern: &pattern,
                    single: !self.shared,
                    falloff: falloff.as_ref().map(|falloff| falloff as &dyn Fn(Place, Vec3) -> f32),
                };
                for run in runs.chunk_by(|a, b| a.id == b.id) {
                    let look = looks.get_mut().get_mut(run[0].id as usize).map(|look| {
                        &**look.get_or_insert_with(|| self.look(&film, raster.surfaces()[run[0].id as usize]))
                    });
                    self.shader.shade(self.level, look, &samples, run, sums);
                }
                watch.lap(&mut tally.stages.shading);
            }
        }
        (tally, steps.len())
    }

    /// The place of a block's corner from the tile's centre, and what names the pixel of each lane there.
    fn corner<'b>(
        &self,
        tile: (u32, u32),
        pattern: &'b Pattern,
        batch: &'b Batch,
        block: usize,
    ) -> (Vec2, impl Fn(usize) -> u64 + use<'b>) {
        let (corner, seed) = (pattern.corner(block as u32), self.points.seed);
        let key = move |lane: usize| {
            let (x, y) = pattern.pixel(corner, batch, lane);
            hash(hash(seed, u64::from(tile.0 * TILE + x)), u64::from(tile.1 * TILE + y))
        };
        (from_center(corner), key)
    }

    /// The number of the surface that a triangle is part of, and the triangle that stands for it.
    fn patch(&self, triangle: u32) -> (u32, u32) {
        if self.shared { self.surfaces.patches.of(triangle) } else { (triangle, triangle) }
    }

    /// The look of the surface that `triangle`, which may be seen in the tile, is part of.
    fn look(&self, film: &TileFilm, triangle: u32) -> Box<Look> {
        let corners = |t: u32| self.surfaces.triangles[t as usize].map(|i| self.positions[i as usize]);
        let (_, reference) = self.patch(triangle);
        let edges = film.scaled_edges(corners(reference));
        Box::new(self.shader.look(reference, &edges, corners(reference), corners(triangle)))
    }
}

/// Makes each sample a group.
fn split(groups: &mut Vec<Group>, spare: &mut Vec<Group>) {
    spare.clear();
    spare.extend(
        groups
            .iter()
            .flat_map(|&group| Lanes(group.lanes).map(move |lane| Group { lanes: 1 << lane, ..group })),
    );
    std::mem::swap(groups, spare);
}

/// Sorts groups by what they see, nothing last, otherwise in order.
fn sort_by_surface(groups: &[Group], surfaces: usize, out: &mut Vec<Group>, next: &mut Vec<u32>) {
    next.clear();
    next.resize(surfaces + 2, 0);
    let slot = |group: &Group| (group.id as usize).min(surfaces);
    for group in groups {
        next[slot(group) + 1] += 1;
    }
    for i in 1..next.len() {
        next[i] += next[i - 1];
    }
    out.clear();
    out.resize(groups.len(), Group { block: 0, lanes: 0, id: NOTHING });
    for group in groups {
        let place = &mut next[slot(group)];
        out[*place as usize] = *group;
        *place += 1;
    }
}
