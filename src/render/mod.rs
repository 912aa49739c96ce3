//! The conductor: scene and camera in, exposure out. The one place where camera side and pixel side meet.
//!
//! The way of the data, file by file; each says at its head what goes in and out:
//!
//! * `asked`: whether such a picture can be.
//! * `frame`, `picture`: the camera and the vertices in the lens frame, and triangles into bins (`raster::bin`).
//! * `pattern`, `diffraction`: the samples of a tile, in batches of 16.
//! * `sharing`: whether samples share look-ups where a texture is smooth.
//! * `covered`: where triangles' pixels reach.
//! * `draw`: a tile, batch by batch: what is seen (`raster::tile`), surfaces (`looks`), their light (`shade`), into the sums; of a
//!   tile at the `border` only what is in the picture.
//! * `resolve`: from sums to means; and their errors, by `differences`, `clipped`, `highlights` (with `lamps`, `lit` and `spread`), `edges` (with
//!   `shown`) and `weights` (falloff).
//! * `uniform`: all tiles with the same number of samples. Or `adaptive`, in rounds: `pilot`, `base` and `allocate` say how many
//!   samples go where, `progressive` draws a round, `tile_round` one tile in it, `kept` holds the sums from round to round, and
//!   `finish` makes the picture. Where there is no time for that, `few` samples.
//! * `room`, `stages`: memory, and time.

mod adaptive;
mod allocate;
mod asked;
mod base;
mod border;
mod clipped;
mod covered;
mod differences;
mod diffraction;
mod draw;
mod edges;
#[cfg(test)]
mod exact_tests;
mod few;
mod finish;
mod frame;
mod highlights;
mod kept;
mod lamps;
mod lit;
mod looks;
mod pattern;
mod pilot;
mod prepared;
mod progressive;
#[cfg(test)]
mod progressive_tests;
mod resolve;
mod room;
mod scratch;
mod sharing;
mod shown;
mod spread;
mod stages;
mod tile_round;
mod uniform;
mod weights;

pub use adaptive::MOST_FOR_ERROR;
pub use stages::Stages;

use adaptive::Timed;
use prepared::{Prepared, Sequence};
use room::Room;
use stages::Stopwatch;

use crate::error::{Error, ErrorKind, Result};
use crate::picture::{Allocation, Exposure};
use crate::sampling::runs::FIRST_RUN;
use crate::scene::{Budget, EffectName, EffectSet, Material, Scene};
pub use crate::simd::SimdLevel;
use crate::threads::on_threads;
use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};

/// How a picture is made; none of it changes a pixel, but where a time is asked for ([`Budget::Seconds`]): there speed decides how many
/// samples there are.
#[derive(Clone, Copy, Default)]
pub struct Execution<'a> {
    /// Worker threads, 1024 at most; `None` for as many as the machine has. Where `rayon` runs already it is its threads that work.
    pub threads: Option<usize>,
    /// Most memory that drawing may take besides the scene, in bytes; `None` for no limit.
    pub memory: Option<u64>,
    /// Vector instructions; `None` for the widest that the machine has.
    pub simd: Option<SimdLevel>,
    /// Set to stop: [`render`] then returns [`ErrorKind::Cancelled`] within a fraction of a tile's time; where much may be a small bright
    /// light, within what it takes to put in order what stands before it: half a second of 600,000 triangles.
    pub cancel: Option<&'a AtomicBool>,
    /// Called from worker threads with the number of tiles done and of all; for an error or a time again from the first with
    /// each round.
    pub progress: Option<&'a (dyn Fn(usize, usize) + Sync)>,
    /// Called once, before the long part of the work, where [`MOST_FOR_ERROR`] samples of each pixel do not seem to reach the error that is
    /// asked for, with the error that they may reach.
    pub beyond_reach: Option<&'a (dyn Fn(f64) + Sync)>,
    /// Seconds from any start, which must go on: the library has no clock of its own. With one, [`Counts::stages`] is measured; a
    /// [`Budget::Seconds`] needs one.
    pub clock: Option<&'a (dyn Fn() -> f64 + Sync)>,
    /// Whether to keep the error of each pixel, [`Exposure::pixel_error`].
    pub error_map: bool,
}

/// What a render counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Surfaces that these make up: triangles that continue one another's plane and texture are one.
    pub surfaces: usize,
    /// Entries of the bins: one for each triangle and tile that it may touch or, where these are many, square of tiles.
    pub bin_entries: usize,
    /// Samples that the picture is made of; what was drawn for a forecast and drawn again is not among them.
    pub samples: u64,
    /// Groups of samples of a pixel that were shaded together, of all that was drawn; each by itself where none share.
    pub shading_requests: u64,
    /// Blocks of 8 x 8 pixels whose samples may have missed a small bright light; their part of the stated error is what
    /// such a light may add.
    pub unseen_light: u64,
    /// Effects that the scene asks for and the [plan](crate::plan::RenderPlan) left out as too small to be seen.
    pub left_out: EffectSet,
    /// Where the time went.
    pub stages: Stages,
}

/// Renders `scene` as its [`Budget`] says. With a number of samples or an error, the same bytes come out on any machine and
/// with any number of threads; with a time, [`replay`] with the exposure's [`samples`](Exposure::samples) gives them.
///
/// # Errors
/// [`ErrorKind::Invalid`] when the film reaches the aperture, or light would be bent to where it does, for a picture without pixels, for
/// apertures of other than 3 to 1000 blades or turned by no finite angle, for light of other than 0 to 1e9 a channel, a sun and an up
/// without a direction, a sun's disk of other than 0 to 180 degrees, an exposure beyond 100 stops, for budgets that are none (no samples,
/// more than [`MOST_SAMPLES`](crate::sampling::runs::MOST_SAMPLES), an error or a time that is not positive and finite), when a time is
/// asked for and there is no clock that tells a finite time, for surfaces that [`Surfaces::check`](crate::scene::Surfaces::check) refuses,
/// and when the machine lacks the SIMD level; [`ErrorKind::TooLarge`] when picture and geometry would not fit, a side has more than
/// [`MAX_PICTURE_SIDE`](crate::scene::MAX_PICTURE_SIDE) pixels, or threads cannot be started, of which there are 1024 at most;
/// [`ErrorKind::Cancelled`] when stopped.
pub fn render(scene: &Scene, execution: Execution<'_>) -> Result<(Exposure, Counts)> {
    asked::check(scene)?;
    let start = execution.clock.map_or(0.0, |clock| clock());
    match scene.render.budget {
        Budget::Samples(samples) => draw(scene, Sequence::Uniform(samples), &execution, |picture, counts| {
            picture.uniform(samples, &execution, counts)
        }),
        Budget::MaxError(error) => {
            draw(scene, Sequence::Runs(MOST_FOR_ERROR), &execution, |picture, counts| {
                picture.until_error(error, &execution, counts)
            })
        }
        Budget::Seconds(_) if execution.clock.is_none() || !start.is_finite() => {
            Err(Error::invalid("a time was asked for, and there is no clock that tells it")
                .at_key("render.time_budget_s")
                .remedy("lend one in Execution::clock"))
        }
        Budget::Seconds(seconds) => {
            let times = (start, start + seconds);
            // More where there is memory for it.
            let timed = draw(scene, Sequence::Runs(FIRST_RUN), &execution, |picture, counts| {
                picture.until_clock(times, &execution, counts)
            })?;
            match timed {
                Timed::Done(done) => Ok(*done),
                Timed::TooShort(few) => few::as_many_as_fit(scene, few, times.1, execution),
            }
        }
    }
}

/// Renders `scene` with the numbers of samples of another picture of it, whose bytes then come out again. Its [`Budget`] is to be that
/// of the other: by it the [plan](crate::plan::RenderPlan) leaves out what is too small to be seen.
///
/// # Errors
/// As [`render`]; [`ErrorKind::Invalid`] when the numbers are for a picture of another size, or fewer than a picture of this scene
/// begins with.
pub fn replay(scene: &Scene, samples: &Allocation, execution: Execution<'_>) -> Result<(Exposure, Counts)> {
    asked::check(scene)?;
    asked::check_allocation(samples)?;
    match samples {
        Allocation::Uniform(samples) => {
            draw(scene, Sequence::Uniform(*samples), &execution, |picture, counts| {
                picture.uniform(*samples, &execution, counts)
            })
        }
        Allocation::Blocks(blocks) => {
            let (width, height) = blocks.size();
            if (width, height) != (scene.render.width, scene.render.height) {
                return Err(Error::invalid(format!(
                    "these are samples for {width} x {height} pixels, and the picture has {} x {}",
                    scene.render.width, scene.render.height
                )));
            }
            draw(scene, Sequence::Runs(blocks.longest_run()), &execution, |picture, counts| {
                picture.allocated(blocks, &execution, counts)
            })
        }
    }
}

/// Prepares what all tiles share and lets `make` draw them, in a pool of threads.
fn draw<T: Send>(
    scene: &Scene,
    sequence: Sequence,
    execution: &Execution<'_>,
    make: impl FnOnce(&Prepared<'_>, Counts) -> Result<T> + Send,
) -> Result<T> {
    let materials = materials(scene);
    let optics = &scene.optics;
    if optics.film_reaches_aperture() {
        return Err(Error::invalid(
            "the film plane reaches the aperture: part of the lens has no film behind it",
        )
        .at_key("camera")
        .remedy("use a smaller aperture, a longer extension or less tilt"));
    }
    let simd = execution.simd.unwrap_or_else(SimdLevel::best);
    if !simd.is_available() {
        return Err(Error::invalid(format!("this machine has no {}", simd.name()))
            .remedy("leave the SIMD level to the program"));
    }
    on_threads(execution.threads, || {
        scene.surfaces.check()?;
        let room = Room::new(scene, sequence, execution)?;
        let mut counts = Counts::default();
        let watch = Stopwatch::start(execution.clock);
        let positions = prepared::positions(scene);
        let cancel = execution.cancel;
        let (level, stages) = (simd.level(), &mut counts.stages);
        let shown = (scene, &materials[..]);
        let mut picture = Prepared::new(shown, &positions, sequence, level, cancel, watch, stages)?;
        if picture.stopped() {
            return Err(stopped());
        }
        picture.longest_run = room.check_tiles(&picture.bins)?;
        (picture.alone, picture.drawn) = picture.shows_sharing(sequence, execution, &mut counts.stages);
        make(&picture, counts)
    })?
}

/// The materials of a scene without what the user wants left out.
fn materials(scene: &Scene) -> Cow<'_, [Material]> {
    let without = scene.render.effects.without;
    let [textures, holes, coverage] =
        [EffectName::Textures, EffectName::Holes, EffectName::Coverage].map(|effect| without.has(effect));
    let mut materials = Cow::Borrowed(&scene.surfaces.materials[..]);
    if textures || holes || coverage {
        for material in materials.to_mut() {
            material.leave_out(textures, holes, coverage);
        }
    }
    materials
}

/// Whether the picture is no longer wanted.
fn cancelled(cancel: Option<&AtomicBool>) -> bool {
    cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
}

fn stopped() -> Error {
    Error::new(ErrorKind::Cancelled, "stopped before the picture was done")
}

fn too_large() -> Error {
    Error::new(ErrorKind::TooLarge, "the picture does not fit into memory")
        .remedy("ask for a smaller --width")
}

/// The finished exposure, and the last counts.
fn done(
    picture: &Prepared<'_>,
    (pixels, errors): (Vec<[f32; 3]>, Vec<f32>),
    rms: Option<f64>,
    samples: Allocation,
    counts: Counts,
) -> (Exposure, Counts) {
    let (width, height) = (picture.view.width, picture.view.height);
    let errors = if rms.is_some() { errors } else { Vec::new() };
    let counts = Counts {
        triangles: picture.surfaces.triangles.len(),
        surfaces: picture.surface_count,
        bin_entries: picture.bins.entries(),
        left_out: picture.left_out,
        samples: (f64::from(width) * f64::from(height) * samples.mean()).round() as u64,
        ..counts
    };
    (Exposure::new((width, height), pixels, errors, rms, samples), counts)
}
