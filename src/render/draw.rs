//! One tile: its samples through the rasterizer, grouped by what they see, shaded and summed.
//!
//! In: a tile, the runs of samples that it is to get and in which regions, and its sums so far. Out: the sums with these samples,
//! `sum += light` for the even and for the odd ones of each pixel, for [`super::resolve`]. Run by run: [`super::pattern`],
//! [`super::diffraction`], `raster::tile` for each batch, `raster::group` for up to four at once, [`super::looks`], and
//! `shade::run`, `shade::single` or `shade::shadowed`. The callers are [`super::uniform`] and [`super::tile_round`].

use super::border::{lanes_inside, regions_inside};
use super::looks::Looks;
use super::pattern::{Splits, pattern};
use super::picture::Picture;
use super::resolve::Sum;
use super::stages::{Stages, Stopwatch};
use crate::raster::batch::{Batch, Pattern, from_center};
use crate::raster::film::TileFilm;
use crate::raster::geometry::Geometry;
use crate::raster::group::Groups;
use crate::raster::part::Part;
use crate::raster::visibility::REGION;
use crate::raster::{self, BATCHES, LANES, TILE};
use crate::sampling;
use crate::sampling::runs::Run;
use crate::shade::{LaneSums, LookUps, Rays, Samples, SunSamples};
use glam::Vec4;
use std::cell::RefCell;
use std::sync::Mutex;

/// What one thread reuses from tile to tile.
#[derive(Default)]
pub(super) struct TileScratch {
    raster: raster::tile::TileScratch,
    groups: Groups,
    looks: RefCell<Looks>,
    look_ups: LookUps,
    /// What stood before the sun last.
    last: u32,
    /// The sums with the step that is being drawn, as registers hold them; and those of samples that look by themselves.
    sums: Vec<[Vec4; 2]>,
    beside: Vec<[Vec4; 2]>,
    /// Of long runs those of what was drawn before.
    far: [Vec<[Vec4; 2]>; 2],
}

/// Of runs longer than this so many batches are summed by themselves and then added to the others: of 16,384 additions of one number rounding
/// makes an error of 1e-4 of it, the same in both halves, so that nothing states it.
const LONG: u32 = 1024;
const NEAR: usize = 16;

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

/// A run of samples, how it is sorted into batches, and the regions of the tile that take part (bit `8 row + column`).
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub run: Run,
    pub splits: Splits,
    pub wanted: u64,
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

/// A scratch that goes back to its picture. (Rayon's `map_init` makes its value anew each time that it divides the work, and moves it
/// from function to function: a scratch holds a number for each surface of the scene, and takes 19 KB itself.)
pub(super) struct Borrowed<'a> {
    /// Made when first asked for.
    scratch: Option<Box<TileScratch>>,
    idle: &'a Mutex<Vec<Box<TileScratch>>>,
}

impl Borrowed<'_> {
    pub(super) fn get(&mut self) -> &mut TileScratch {
        self.scratch.get_or_insert_default()
    }
}

impl Drop for Borrowed<'_> {
    fn drop(&mut self) {
        if let (Some(scratch), Ok(mut idle)) = (self.scratch.take(), self.idle.lock()) {
            idle.push(scratch);
        }
    }
}

impl Picture<'_> {
    /// What a thread needs to draw tiles.
    pub(super) fn scratch(&self) -> Borrowed<'_> {
        let scratch = self.idle.lock().ok().and_then(|mut idle| idle.pop());
        Borrowed { scratch, idle: &self.idle }
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
        let TileScratch { raster, groups, looks, look_ups, last, sums: drawn, beside: drawn_beside, far } =
            scratch;
        let geometry = Geometry {
            view: &self.view,
            bins: &self.bins,
            positions: self.positions,
            surfaces: self.surface_count,
            clock: watch.clock(),
            stop: &|| self.stopped(),
        };
        let block = sampling::block(self.streams);
        let film = TileFilm::new(&self.view, tile.0, tile.1);
        let rays = Rays {
            p: film.p.as_vec3(),
            dx: film.dx.as_vec3(),
            dy: film.dy.as_vec3(),
            focal_length: self.view.focal_length as f32,
            radius: self.view.radius as f32,
        };
        let size = self.size_of(tile);
        let is_whole = size == [TILE; 2];
        let inside = regions_inside(size, block);
        let wanted = steps.iter().fold(0, |wanted, step| wanted | step.wanted);
        let part = Part { tile, block, wanted: wanted & inside };
        // What earlier steps drew is still there.
        let mut held = 0;
        for (done, step) in steps.iter().enumerate() {
            take_up(step, held, sums, drawn);
            if let Some(beside) = &mut beside {
                take_up(step, held, beside, drawn_beside);
            }
            held |= step.wanted;
            let is_long = step.run.count > LONG;
            if is_long {
                for (drawn, far) in [&mut *drawn, &mut *drawn_beside].into_iter().zip(&mut *far) {
                    far.clear();
                    far.resize(drawn.len(), [Vec4::ZERO; 2]);
                    move_on(drawn, far);
                }
            }
            let mut pattern =
                pattern(&self.points, tile, self.streams, step.run, step.splits, &|| self.stopped());
            if self.centred {
                pattern.center();
            }
            if let Some(diffraction) = &self.diffraction {
                pattern = diffraction.displace(&self.view, tile, &pattern);
            }
            // What is set up serves all steps, but not where it is what this step's lens points see.
            if (done == 0 && !is_set_up) || raster.serves_one_pattern() {
                raster.prepare(self.level, &geometry, &film, part.clone(), &pattern);
                looks.get_mut().clear();
            }
            watch.lap(&mut tally.stages.setup);
            // Shadows weigh each sample by itself.
            let together = if self.shared && self.shadows.is_none() { BATCHES } else { 1 };
            for (bundle, batches) in pattern.batches.chunks(together).enumerate() {
                for (at, batch) in batches.iter().enumerate() {
                    if stop() {
                        return (tally, done);
                    }
                    let number = bundle * together + at;
                    let wanted = step.wanted & inside;
                    tally.samples += REGION_SAMPLES * u64::from(wanted.count_ones());
                    tally.triangles +=
                        raster.draw(self.level, wanted, &geometry, &film, (number, batch), &|visit, hits| {
                            let mut looks = looks.borrow_mut();
                            self.make_look(&film, visit.id, visit.first, &mut looks);
                            let Some(look) = looks.get(visit.id) else { return };
                            let corner = |block: u16| from_center(pattern.corner(u32::from(block)));
                            let key = |block: u16, lane: usize| {
                                self.pixel_key(tile, &pattern, batch, u32::from(block))(lane)
                            };
                            self.shader.meet(self.level, (look, visit.triangle), batch, hits, corner, key);
                        });
                    raster.keep(at);
                    watch.lap(&mut tally.stages.coverage);
                    let setup = std::mem::take(&mut raster.seconds);
                    tally.stages.setup += setup;
                    tally.stages.coverage -= setup;
                }
                let batch = &batches[0];
                if self.shared {
                    raster.group(self.level, batches, groups);
                } else {
                    raster.singles(batch, groups);
                }
                if !is_whole {
                    groups.clip(|group| lanes_inside(size, &pattern, batches, group));
                }
                watch.lap(&mut tally.stages.group);
                let samples = Samples {
                    batches,
                    means: &LaneSums::new(batches),
                    rays: &rays,
                    pattern: &pattern,
                    single: !self.shared,
                    alone,
                    falloff: self.falloff.as_ref(),
                };
                let pixel = |block: u32, lane: usize| self.pixel_key(tile, &pattern, batch, block)(lane);
                let sun = self.shadows.as_ref().map(|sun| {
                    let soft = sun.is_soft().then(|| self.sun_squares(tile, &pattern, batch));
                    SunSamples { batch, sun, square: soft.unwrap_or_default(), pixel: &pixel }
                });
                let looks = looks.get_mut();
                self.make_looks(&film, raster.surfaces(), groups.runs().map(|run| run[0].id), looks);
                let mut shade = |samples: &Samples<'_>, drawn: &mut [[Vec4; 2]]| {
                    for run in groups.runs() {
                        match (looks.get(run[0].id), &sun) {
                            (Some(look), Some(sun)) => {
                                self.shader.shade_shadowed(
                                    self.level,
                                    look,
                                    (samples, sun),
                                    run,
                                    last,
                                    drawn,
                                );
                            }
                            (look, _) => self.shader.shade(self.level, look, samples, run, look_ups, drawn),
                        }
                    }
                };
                shade(&samples, drawn);
                if beside.is_some() {
                    shade(&Samples { alone: true, ..samples }, drawn_beside);
                }
                if is_long && (bundle + 1) * together % NEAR == 0 {
                    move_on(drawn, &mut far[0]);
                    move_on(drawn_beside, &mut far[1]);
                }
                tally.requests += groups.runs().map(|run| run.len() as u64).sum::<u64>();
                watch.lap(&mut tally.stages.shading);
            }
            if is_long {
                move_on(&mut far[0], drawn);
                move_on(&mut far[1], drawn_beside);
            }
            put_down(step, sums, drawn);
            if let Some(beside) = &mut beside {
                put_down(step, beside, drawn_beside);
            }
        }
        (tally, steps.len())
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

/// Adds sums to others, and begins them again.
fn move_on(from: &mut [[Vec4; 2]], to: &mut [[Vec4; 2]]) {
    for (from, to) in from.iter_mut().zip(to) {
        *to = [to[0] + from[0], to[1] + from[1]];
        *from = [Vec4::ZERO; 2];
    }
}

/// Makes `drawn` the sums that a step goes on from, except where earlier steps drew.
fn take_up(step: &Step, held: u64, sums: &mut [Sum], drawn: &mut Vec<[Vec4; 2]>) {
    drawn.resize(sums.len(), [Vec4::ZERO; 2]);
    each_wanted(step.wanted & !held, sums, drawn, |sums, drawn| {
        *drawn =
            if step.run.first == 0 { [Vec4::ZERO; 2] } else { sums.map(|[r, g, b]| Vec4::new(r, g, b, 0.0)) };
    });
}

/// Makes what a step drew the sums.
fn put_down(step: &Step, sums: &mut [Sum], drawn: &mut [[Vec4; 2]]) {
    each_wanted(step.wanted, sums, drawn, |sums, drawn| {
        *sums = drawn.map(|half| half.truncate().to_array());
    });
}

/// Does something with each pixel's sums in the regions of 4 x 4 pixels that are `wanted`: of pictures whose blocks are single pixels.
fn each_wanted<A, B>(wanted: u64, sums: &mut [A], drawn: &mut [B], with: impl Fn(&mut A, &mut B)) {
    let row = (TILE * REGION as u32) as usize;
    for (y, (sums, drawn)) in sums.chunks_exact_mut(row).zip(drawn.chunks_exact_mut(row)).enumerate() {
        let columns = wanted >> (8 * y) & 0xff;
        let pixels = sums.chunks_exact_mut(REGION).zip(drawn.chunks_exact_mut(REGION)).enumerate();
        for (_, (sums, drawn)) in pixels.filter(|(x, _)| columns >> (x % 8) & 1 == 1) {
            sums.iter_mut().zip(drawn).for_each(|(sums, drawn)| with(sums, drawn));
        }
    }
}
