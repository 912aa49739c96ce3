//! One tile: its samples through the rasterizer, grouped by what they see, shaded and summed.
//!
//! In: a tile, the runs of samples that it is to get and in which regions, and its sums so far. Out: the sums with these samples,
//! `sum += light` for the even and for the odd ones of each pixel, for [`super::resolve`]. Run by run: [`super::pattern`],
//! [`super::diffraction`], `raster::tile` for each batch, `raster::group` for up to four at once, [`super::looks`], and
//! `shade::run`, `shade::single` or `shade::shadowed`. The callers are [`super::uniform`] and [`super::tile_round`].

use super::border::{lanes_inside, regions_inside};
use super::pattern::pattern;
use super::prepared::Prepared;
use super::resolve::Sum;
use super::scratch::{Borrowed, Step, TileScratch, put_down, take_up};
use super::stages::{Stages, Stopwatch};
use crate::raster::batch::{Batch, Pattern, from_center};
use crate::raster::film::TileFilm;
use crate::raster::geometry::Geometry;
use crate::raster::part::Part;
use crate::raster::visibility::REGION;
use crate::raster::visit::{Hit, Visit};
use crate::raster::{BATCHES, LANES, TILE};
use crate::sampling;
use crate::shade::{LaneSums, Rays, Samples, SunSamples};
use glam::Vec4;

/// Of runs longer than this [`BATCHES_APART`] batches are summed by themselves and then added to the others: of 16,384 additions of one
/// number rounding makes an error of 1e-4 of it, the same in both halves, so that nothing states it.
const LONG: u32 = 1024;
const BATCHES_APART: usize = 16;

/// What all of a tile's samples share.
struct TileView<'a> {
    tile: (u32, u32),
    geometry: Geometry<'a>,
    film: TileFilm,
    rays: Rays,
    /// Columns and rows of it that are in the picture, and the regions that have some.
    size: [u32; 2],
    inside: u64,
}

/// What came of one tile beside its sums.
#[derive(Clone, Copy, Default)]
pub(super) struct Tally {
    pub requests: u64,
    /// Samples that were drawn, and triangles that batches of 16 of them went through.
    pub samples: u64,
    pub triangles: u64,
    /// Blocks that may have missed a light.
    pub unseen_light: u64,
    pub stages: Stages,
}

/// What is to be drawn of a tile.
#[derive(Clone, Copy)]
pub(super) struct Work<'a> {
    pub steps: &'a [Step],
    /// The last call with the same scratch drew the same tile, and all regions that these steps want: triangles elsewhere are gone.
    pub is_set_up: bool,
    /// Samples share no look-up.
    pub alone: bool,
}

/// The sums of a tile and, where these are asked for besides, of the same samples without shared look-ups.
pub(super) struct TileSums<'a> {
    pub sums: &'a mut [Sum],
    pub beside: Option<&'a mut [Sum]>,
}

impl<'a> From<&'a mut [Sum]> for TileSums<'a> {
    fn from(sums: &'a mut [Sum]) -> Self {
        Self { sums, beside: None }
    }
}

/// Samples of a batch in a region of 4 x 4 blocks, which are pixels where there are 16 samples or more.
const REGION_SAMPLES: u64 = (LANES * REGION * REGION) as u64;

/// Tiles that a thread takes at a time. Left alone, rayon divides the work into a few parts, and one thread ends long after
/// the others: rounds that draw in a part of the picture took as long on two threads as on one.
pub(super) const TILES_AT_ONCE: usize = 4;

impl Prepared<'_> {
    /// What a thread needs to draw tiles.
    pub(super) fn scratch(&self) -> Borrowed<'_> {
        Borrowed::of(&self.idle)
    }

    /// Draws the samples of `steps` in one tile and adds them to `sums`, in the order of the batches; whatever these were
    /// before the first sample. Where the last call drew the same tile, its triangles may be set up already. Tells how many
    /// steps were done before `stop` said so; of the next nothing is left.
    pub(super) fn draw_tile(
        &self,
        scratch: &mut TileScratch,
        tile: (u32, u32),
        Work { steps, is_set_up, alone }: Work<'_>,
        TileSums { sums, mut beside }: TileSums<'_>,
        mut watch: Stopwatch<'_>,
        stop: &dyn Fn() -> bool,
    ) -> (Tally, usize) {
        let mut tally = Tally::default();
        let stopped = || self.stopped();
        let view = self.tile_view(tile, watch.clock(), &stopped);
        let wanted = steps.iter().fold(0, |wanted, step| wanted | step.wanted);
        let part = Part { tile, block_size: sampling::block(self.streams), wanted: wanted & view.inside };
        // Shadows weigh each sample by itself.
        let together = if self.shared && self.shadows.is_none() { BATCHES } else { 1 };
        // What earlier steps drew is still there.
        let mut held = 0;
        for (done, step) in steps.iter().enumerate() {
            take_up(step, held, sums, &mut scratch.sums);
            if let Some(beside) = &mut beside {
                take_up(step, held, beside, &mut scratch.beside);
            }
            held |= step.wanted;
            let is_long = step.run.count > LONG;
            if is_long {
                scratch.keep_far();
            }
            let pattern = self.step_pattern(tile, step);
            // What is set up serves all steps, but not where it is what this step's lens points see.
            if (done == 0 && !is_set_up) || scratch.raster.serves_one_pattern() {
                scratch.raster.prepare(self.level, &view.geometry, &view.film, part.clone(), &pattern);
                scratch.looks.get_mut().clear();
            }
            watch.lap(&mut tally.stages.setup);
            for (bundle, batches) in pattern.batches.chunks(together).enumerate() {
                let first = bundle * together;
                let wanted = step.wanted & view.inside;
                let bundle = (&pattern, first, batches);
                if !self.cover(scratch, &view, bundle, wanted, (&mut tally, &mut watch), stop) {
                    return (tally, done);
                }
                let ways = (alone, beside.is_some());
                self.shade(scratch, &view, (&pattern, batches), ways, (&mut tally, &mut watch));
                if is_long && (first + together).is_multiple_of(BATCHES_APART) {
                    scratch.move_far();
                }
                watch.lap(&mut tally.stages.shading);
            }
            if is_long {
                scratch.join_far();
            }
            put_down(step, sums, &mut scratch.sums);
            if let Some(beside) = &mut beside {
                put_down(step, beside, &mut scratch.beside);
            }
        }
        (tally, steps.len())
    }

    fn tile_view<'a>(
        &'a self,
        tile: (u32, u32),
        clock: Option<&'a (dyn Fn() -> f64 + Sync)>,
        stop: &'a dyn Fn() -> bool,
    ) -> TileView<'a> {
        let film = TileFilm::new(&self.view, tile.0, tile.1);
        let size = self.size_of(tile);
        TileView {
            tile,
            geometry: Geometry {
                view: &self.view,
                bins: &self.bins,
                positions: self.positions,
                surfaces: self.surface_count,
                clock,
                stop,
            },
            rays: Rays {
                p: film.p.as_vec3(),
                dx: film.dx.as_vec3(),
                dy: film.dy.as_vec3(),
                focal_length: self.view.focal_length as f32,
                radius: self.view.radius as f32,
            },
            film,
            size,
            inside: regions_inside(size, sampling::block(self.streams)),
        }
    }

    /// The samples of a step.
    fn step_pattern(&self, tile: (u32, u32), step: &Step) -> Pattern {
        let stop = || self.stopped();
        let mut pattern = pattern(&self.points, tile, self.streams, step.run, step.splits, &stop);
        if self.centred {
            pattern.center();
        }
        match &self.diffraction {
            Some(diffraction) => diffraction.displace(&self.view, tile, &pattern),
            None => pattern,
        }
    }

    /// What some batches of a pattern, the first of which has the number `first`, see in the `wanted` regions: kept in the rasterizer.
    /// Tells whether it was done before `stop` said so.
    fn cover(
        &self,
        scratch: &mut TileScratch,
        view: &TileView<'_>,
        (pattern, first, batches): (&Pattern, usize, &[Batch]),
        wanted: u64,
        (tally, watch): (&mut Tally, &mut Stopwatch<'_>),
        stop: &dyn Fn() -> bool,
    ) -> bool {
        let TileScratch { raster, looks, .. } = scratch;
        for (at, batch) in batches.iter().enumerate() {
            if stop() {
                return false;
            }
            tally.samples += REGION_SAMPLES * u64::from(wanted.count_ones());
            let alpha_test = |visit: &Visit, hits: &mut [Hit]| {
                let mut looks = looks.borrow_mut();
                self.make_look(&view.film, visit.id, visit.first, &mut looks);
                let Some(look) = looks.get(visit.id) else { return };
                let corner = |block: u16| from_center(pattern.corner(u32::from(block)));
                let key = |block: u16, lane: usize| {
                    self.pixel_key(view.tile, pattern, batch, u32::from(block))(lane)
                };
                self.shader.alpha_test(self.level, (look, visit.triangle), batch, hits, corner, key);
            };
            let numbered = (first + at, batch);
            tally.triangles +=
                raster.draw(self.level, wanted, &view.geometry, &view.film, numbered, &alpha_test);
            raster.keep(at);
            watch.lap(&mut tally.stages.coverage);
            let setup = std::mem::take(&mut raster.seconds);
            tally.stages.setup += setup;
            tally.stages.coverage -= setup;
        }
        true
    }

    /// Groups and shades what these batches see, and adds their light to the scratch's sums: of samples that share no look-up if they
    /// are to be `alone`, or of both if the others are wanted besides.
    fn shade(
        &self,
        scratch: &mut TileScratch,
        view: &TileView<'_>,
        (pattern, batches): (&Pattern, &[Batch]),
        (alone, has_beside): (bool, bool),
        (tally, watch): (&mut Tally, &mut Stopwatch<'_>),
    ) {
        let TileScratch { raster, groups, looks, look_ups, last_occluder, sums, beside, .. } = scratch;
        let batch = &batches[0];
        if self.shared {
            raster.group(self.level, batches, groups);
        } else {
            raster.singles(batch, groups);
        }
        if view.size != [TILE; 2] {
            groups.clip(|group| lanes_inside(view.size, pattern, batches, group));
        }
        watch.lap(&mut tally.stages.group);
        let samples = Samples {
            batches,
            means: &LaneSums::new(batches),
            rays: &view.rays,
            pattern,
            single: !self.shared,
            alone,
            falloff: self.falloff.as_ref(),
        };
        let pixel = |block: u32, lane: usize| self.pixel_key(view.tile, pattern, batch, block)(lane);
        let sun = self.shadows.as_ref().map(|sun| {
            let soft = sun.is_soft().then(|| self.sun_squares(view.tile, pattern, batch));
            SunSamples { batch, sun, square: soft.unwrap_or_default(), pixel: &pixel }
        });
        let looks = looks.get_mut();
        self.make_looks(&view.film, raster.surfaces(), groups.runs().map(|run| run[0].id), looks);
        let mut shade = |samples: &Samples<'_>, sums: &mut [[Vec4; 2]]| {
            for run in groups.runs() {
                match (looks.get(run[0].id), &sun) {
                    (Some(look), Some(sun)) => {
                        let shown = (samples, sun);
                        self.shader.shade_shadowed(self.level, look, shown, run, last_occluder, sums);
                    }
                    (look, _) => self.shader.shade(self.level, look, samples, run, look_ups, sums),
                }
            }
        };
        shade(&samples, sums);
        if has_beside {
            shade(&Samples { alone: true, ..samples }, beside);
        }
        tally.requests += groups.runs().map(|run| run.len() as u64).sum::<u64>();
    }

    /// What names the pixel of each lane at a block.
    fn pixel_key<'b>(
        &self,
        tile: (u32, u32),
        pattern: &'b Pattern,
        batch: &'b Batch,
        block: u32,
    ) -> impl Fn(usize) -> u64 + use<'b> {
        let (corner, seed) = (pattern.corner(block), self.points.seed);
        move |lane: usize| {
            let (x, y) = pattern.pixel(corner, batch, lane);
            sampling::pixel_key(seed, tile.0 * TILE + x, tile.1 * TILE + y)
        }
    }

    /// Where in the sun's disk each lane looks, but for the pixels' shifts.
    fn sun_squares(&self, tile: (u32, u32), pattern: &Pattern, batch: &Batch) -> [[u32; LANES]; 2] {
        let mut squares = [[0; LANES]; 2];
        for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
            let (x, y) = pattern.pixel((0, 0), batch, lane);
            let stream = sampling::pixel_stream(tile.0 * TILE + x, tile.1 * TILE + y, self.streams);
            let square = sampling::sun_square(self.points.seed, stream, batch.index[lane]);
            [squares[0][lane], squares[1][lane]] = square;
        }
        squares
    }
}
