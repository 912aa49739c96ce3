//! The conductor: scene and camera in, exposure out. The one place where camera side and pixel side meet.

mod draw;
mod frame;
mod pattern;

use draw::{Tally, TileScratch};
use frame::{Falloff, LensFrame};
use pattern::Splits;

use crate::error::{Error, ErrorKind, Result};
use crate::picture::Exposure;
use crate::raster::TILE;
use crate::raster::bin::Bins;
use crate::raster::setup::{Image, images};
use crate::raster::view::{LensCell, View};
use crate::sampling;
use crate::scene::{Material, Scene, Surfaces};
use crate::shade::Shader;
pub use crate::simd::SimdLevel;
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

// Tiles of the rasterizer are the squares that share lens points.
const _: () = assert!(sampling::GRID == TILE);

/// How a picture is made; none of it changes a pixel.
#[derive(Clone, Copy, Default)]
pub struct Execution<'a> {
    /// Worker threads; `None` for as many as the machine has.
    pub threads: Option<usize>,
    /// Vector instructions; `None` for the widest that the machine has.
    pub simd: Option<SimdLevel>,
    /// Set to stop: [`render`] then returns [`ErrorKind::Cancelled`] within a fraction of a tile's time.
    pub cancel: Option<&'a AtomicBool>,
    /// Called from worker threads with the number of tiles done and of all.
    pub progress: Option<&'a (dyn Fn(usize, usize) + Sync)>,
    /// Seconds from any start: the library has no clock of its own. With one, [`Counts::stages`] is measured.
    pub clock: Option<&'a (dyn Fn() -> f64 + Sync)>,
}

/// What a render counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Surfaces that these make up: triangles that continue one another's plane and texture are one.
    pub surfaces: usize,
    /// (triangle, tile) pairs after binning.
    pub bin_entries: usize,
    /// Samples taken.
    pub samples: u64,
    /// Groups of samples of a pixel that were shaded together.
    pub shading_requests: u64,
    /// Where the time went.
    pub stages: Stages,
}

/// Seconds that the stages took, summed over the threads; all 0 without [`Execution::clock`].
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Stages {
    /// Vertices into the lens frame.
    pub transform: f64,
    /// Boxes, order and bins of triangles.
    pub bin: f64,
    /// The samples of each tile, and the edge functions of its triangles.
    pub setup: f64,
    /// Coverage and depth, holes included.
    pub coverage: f64,
    /// Samples sorted by what they see.
    pub group: f64,
    /// Light and texture.
    pub shading: f64,
    /// Sums to means, and the error.
    pub resolve: f64,
}

impl Stages {
    fn add(&mut self, more: &Self) {
        let Self { transform, bin, setup, coverage, group, shading, resolve } = more;
        self.transform += transform;
        self.bin += bin;
        self.setup += setup;
        self.coverage += coverage;
        self.group += group;
        self.shading += shading;
        self.resolve += resolve;
    }
}

/// Measures stages where there is a clock.
#[derive(Clone, Copy)]
struct Stopwatch<'a> {
    clock: Option<&'a (dyn Fn() -> f64 + Sync)>,
    last: f64,
}

impl<'a> Stopwatch<'a> {
    fn start(clock: Option<&'a (dyn Fn() -> f64 + Sync)>) -> Self {
        Self { clock, last: clock.map_or(0.0, |clock| clock()) }
    }

    /// Adds the time since the last call.
    fn lap(&mut self, stage: &mut f64) {
        if let Some(clock) = self.clock {
            let now = clock();
            *stage += now - self.last;
            self.last = now;
        }
    }
}

/// Renders `scene` with exactly `scene.render.samples` samples a pixel.
///
/// # Errors
/// [`ErrorKind::Invalid`] when the film reaches the aperture, [`ErrorKind::TooLarge`] when picture and
/// geometry would not fit, [`ErrorKind::Cancelled`] when stopped.
pub fn render(scene: &Scene, execution: Execution<'_>) -> Result<(Exposure, Counts)> {
    let optics = &scene.optics;
    if optics.film_reaches_aperture() {
        return Err(Error::invalid(
            "the film plane reaches the aperture: part of the lens has no film behind it",
        )
        .at_key("camera")
        .remedy("use a smaller aperture, a longer extension or less tilt"));
    }
    let threads = execution.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| {
        Error::new(ErrorKind::TooLarge, format!("cannot start {threads} threads: {error}"))
            .remedy("ask for fewer --threads")
    })?;
    let simd = execution.simd.unwrap_or_else(SimdLevel::best);
    if !simd.is_available() {
        return Err(Error::invalid(format!("this machine has no {}", simd.name()))
            .remedy("leave the SIMD level to the program"));
    }
    pool.install(|| {
        let mut counts = Counts::default();
        let watch = Stopwatch::start(execution.clock);
        Picture::new(scene, simd.level(), watch, &mut counts.stages).draw(&execution, counts)
    })
}

/// Everything that all tiles share.
struct Picture<'a> {
    surfaces: &'a Surfaces,
    seed: u64,
    /// Brightening of the shown picture.
    gain: f32,
    shared: bool,
    surface_count: usize,
    view: View,
    positions: Vec<DVec3>,
    images: Vec<Image>,
    cutout: Vec<bool>,
    shader: Shader<'a>,
    splits: Splits,
    cells: Vec<LensCell>,
    bins: Bins,
    falloff: Option<Falloff>,
    samples: u32,
    level: Level,
}

impl<'a> Picture<'a> {
    fn new(scene: &'a Scene, level: Level, mut watch: Stopwatch<'_>, stages: &mut Stages) -> Self {
        let optics = &scene.optics;
        let surfaces = &scene.surfaces;
        let frame = LensFrame::new(optics);
        let positions: Vec<DVec3> = surfaces.positions.par_iter().map(|&p| frame.point(p)).collect();
        let view = frame.view(scene);
        let images = images(&view, &positions);
        watch.lap(&mut stages.transform);
        let samples = scene.render.samples;
        let splits = Splits::new(samples);
        let cells = splits.lens_cells(view.radius);
        let bins = Bins::new(&view, &cells, &positions, &surfaces.triangles);
        watch.lap(&mut stages.bin);
        let cutout_materials: Vec<bool> = surfaces.materials.iter().map(Material::is_cutout).collect();
        let cutout = surfaces.attributes.iter().map(|a| cutout_materials[a.material as usize]).collect();
        let up = scene.up;
        // Below 16 samples a pixel hardly any would share.
        let shared = scene.render.share_shading && samples >= 16;
        let shader = Shader::new(surfaces, scene.sun.as_ref(), &scene.sky, up, |v| frame.vector(v));
        let falloff = scene.render.falloff.then(|| Falloff::new(optics, &frame));
        Self {
            surfaces,
            seed: scene.render.seed,
            gain: libm::exp2(scene.render.exposure_ev) as f32,
            shared,
            surface_count: if shared && !surfaces.patches.of.is_empty() {
                surfaces.patches.reference.len()
            } else {
                surfaces.triangles.len()
            },
            view,
            positions,
            images,
            cutout,
            shader,
            splits,
            cells,
            bins,
            falloff,
            samples,
            level,
        }
    }

    fn draw(&self, execution: &Execution<'_>, mut counts: Counts) -> Result<(Exposure, Counts)> {
        let tiles = (self.bins.tiles_x * self.bins.tiles_y) as usize;
        let count = tiles * (TILE * TILE) as usize;
        Vec::<[f32; 3]>::new().try_reserve_exact(count).map_err(|_| {
            Error::new(ErrorKind::TooLarge, "the picture does not fit into memory")
                .remedy("ask for a smaller --width")
        })?;
        // Zeroed by the system page by page: filling a large picture here would take seconds.
        let mut pixels = vec![[0.0f32; 3]; count];
        let done = AtomicUsize::new(0);
        let cancelled = || execution.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed));
        let tallies: Vec<Tally> = pixels
            .par_chunks_mut((TILE * TILE) as usize)
            .enumerate()
            .map_init(TileScratch::default, |scratch, (tile, out)| {
                if cancelled() {
                    return Tally::default();
                }
                let place = (tile as u32 % self.bins.tiles_x, tile as u32 / self.bins.tiles_x);
                let watch = Stopwatch::start(execution.clock);
                let tally = self.draw_tile(scratch, place, out, watch, &cancelled);
                if let Some(progress) = execution.progress {
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1, tiles);
                }
                tally
            })
            .collect();
        if cancelled() {
            return Err(Error::new(ErrorKind::Cancelled, "stopped before the picture was done"));
        }
        let (width, height) = (self.view.width, self.view.height);
        let values = 3.0 * f64::from(width) * f64::from(height);
        // Tile by tile in order: the same sum whatever the threads did.
        let rms = (self.samples > 1)
            .then(|| (tallies.iter().map(|tally| tally.squared_error).sum::<f64>() / values).sqrt());
        counts.triangles = self.surfaces.triangles.len();
        counts.surfaces = self.surface_count;
        counts.bin_entries = self.bins.entries();
        counts.samples = u64::from(width) * u64::from(height) * u64::from(self.samples);
        for tally in &tallies {
            counts.shading_requests += tally.requests;
            counts.stages.add(&tally.stages);
        }
        Ok((Exposure::new(width, height, pixels, rms), counts))
    }
}
