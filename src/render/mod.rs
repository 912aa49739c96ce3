//! The conductor: scene and camera in, exposure out. The one place where camera side and pixel side meet.

mod draw;
mod frame;
mod pattern;

use draw::TileScratch;
use frame::{Falloff, LensFrame};
use pattern::Splits;

use crate::error::{Error, ErrorKind, Result};
use crate::picture::Exposure;
use crate::raster::TILE;
use crate::raster::bin::Bins;
use crate::raster::view::{LensCell, View};
use crate::sampling;
use crate::scene::{Material, Scene, Surfaces};
use crate::shade::Shader;
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

// Tiles of the rasterizer are the squares that share lens points.
const _: () = assert!(sampling::GRID == TILE);

/// How a picture is made; none of it changes a pixel.
#[derive(Clone, Copy, Default)]
pub struct Execution<'a> {
    /// Worker threads; `None` for as many as the machine has.
    pub threads: Option<usize>,
    /// Set to stop: [`render`] then returns [`ErrorKind::Cancelled`] within a fraction of a tile's time.
    pub cancel: Option<&'a AtomicBool>,
    /// Called from worker threads with the number of tiles done and of all.
    pub progress: Option<&'a (dyn Fn(usize, usize) + Sync)>,
}

/// What a render counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Triangles of the scene.
    pub triangles: usize,
    /// (triangle, tile) pairs after binning.
    pub bin_entries: usize,
    /// Samples taken.
    pub samples: u64,
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
    pool.install(|| Picture::new(scene).draw(&execution))
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
    fn new(scene: &'a Scene) -> Self {
        let optics = &scene.optics;
        let surfaces = &scene.surfaces;
        let frame = LensFrame::new(optics);
        let positions: Vec<DVec3> = surfaces.positions.par_iter().map(|&p| frame.point(p)).collect();
        let samples = scene.render.samples;
        let view = frame.view(scene);
        let splits = Splits::new(samples);
        let cells = splits.lens_cells(view.radius);
        let bins = Bins::new(&view, &cells, &positions, &surfaces.triangles);
        let cutout_materials: Vec<bool> = surfaces.materials.iter().map(Material::is_cutout).collect();
        let cutout = surfaces.attributes.iter().map(|a| cutout_materials[a.material as usize]).collect();
        let up = scene.up;
        // Below 16 samples a pixel hardly any would share.
        let shared = scene.render.share_shading && samples >= 16;
        let level = Level::new();
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

    fn draw(&self, execution: &Execution<'_>) -> Result<(Exposure, Counts)> {
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
        let errors: Vec<f64> = pixels
            .par_chunks_mut((TILE * TILE) as usize)
            .enumerate()
            .map_init(TileScratch::default, |scratch, (tile, out)| {
                if cancelled() {
                    return 0.0;
                }
                let place = (tile as u32 % self.bins.tiles_x, tile as u32 / self.bins.tiles_x);
                let error = self.draw_tile(scratch, place, out, &cancelled);
                if let Some(progress) = execution.progress {
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1, tiles);
                }
                error
            })
            .collect();
        if cancelled() {
            return Err(Error::new(ErrorKind::Cancelled, "stopped before the picture was done"));
        }
        let (width, height) = (self.view.width, self.view.height);
        let values = 3.0 * f64::from(width) * f64::from(height);
        // Tile by tile in order: the same sum whatever the threads did.
        let rms = (self.samples > 1).then(|| (errors.iter().sum::<f64>() / values).sqrt());
        let counts = Counts {
            triangles: self.surfaces.triangles.len(),
            bin_entries: self.bins.entries(),
            samples: u64::from(width) * u64::from(height) * u64::from(self.samples),
        };
        Ok((Exposure::new(width, height, pixels, rms), counts))
    }
}
