//! The conductor: scene and camera in, exposure out. The one place where camera side and pixel side meet.

use crate::error::{Error, ErrorKind, Result};
use crate::optics::Optics;
use crate::picture::Exposure;
use crate::raster::bin::Bins;
use crate::raster::tile::{Geometry, TileScratch};
use crate::raster::view::{Batch, LensCell, Pattern, View};
use crate::raster::{LANES, TILE};
use crate::sampling::{self, hash};
use crate::scene::Scene;
use crate::shade::{Place, Shader};
use fearless_simd::Level;
use glam::{DVec3, DVec4, Vec3};
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
    scene: &'a Scene,
    view: View,
    positions: Vec<DVec3>,
    cutout: Vec<bool>,
    shader: Shader<'a>,
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
        let cells = lens_cells(samples, view.radius);
        let bins = Bins::new(&view, &cells, &positions, &surfaces.triangles);
        let cutout_materials: Vec<bool> = surfaces.materials.iter().map(Shader::is_cutout).collect();
        let cutout = surfaces.attributes.iter().map(|a| cutout_materials[a.material as usize]).collect();
        let up = scene.up;
        let shader =
            Shader::new(surfaces, scene.sun.as_ref(), &scene.sky, up, &positions, |v| frame.vector(v));
        let falloff = scene.render.falloff.then(|| Falloff::new(optics, &frame));
        let level = Level::new();
        Self { scene, view, positions, cutout, shader, cells, bins, falloff, samples, level }
    }

    fn draw(&self, execution: &Execution<'_>) -> Result<(Exposure, Counts)> {
        let tiles = (self.bins.tiles_x * self.bins.tiles_y) as usize;
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(tiles * (TILE * TILE) as usize).map_err(|_| {
            Error::new(ErrorKind::TooLarge, "the picture does not fit into memory")
                .remedy("ask for a smaller --width")
        })?;
        pixels.resize(tiles * (TILE * TILE) as usize, [0.0f32; 3]);
        let done = AtomicUsize::new(0);
        let cancelled = || execution.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed));
        let errors: Vec<f64> = pixels
            .par_chunks_mut((TILE * TILE) as usize)
            .enumerate()
            .map_init(TileScratch::new, |scratch, (tile, out)| {
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
            triangles: self.scene.surfaces.triangles.len(),
            bin_entries: self.bins.entries(),
            samples: u64::from(width) * u64::from(height) * u64::from(self.samples),
        };
        Ok((Exposure::new(width, height, pixels, rms), counts))
    }

    /// Draws one tile; returns the sum of the estimated squared errors of its pixels.
    fn draw_tile(
        &self,
        scratch: &mut TileScratch,
        (tx, ty): (u32, u32),
        out: &mut [[f32; 3]],
        cancelled: &dyn Fn() -> bool,
    ) -> f64 {
        let seed = self.scene.render.seed;
        let pattern = pattern(seed, (tx, ty), self.samples, &self.cells);
        let geometry = Geometry {
            positions: &self.positions,
            triangles: &self.scene.surfaces.triangles,
            cutout: &self.cutout,
        };
        let cells = self.cells.len();
        let film = scratch.prepare(&self.view, &geometry, &self.bins, cells, &pattern, (tx, ty));
        let columns = TILE / pattern.block_width;
        let half = 0.5 * TILE as f32;
        let place = |batch: &Batch, block: usize, lane: usize| {
            let corner =
                (block as u32 % columns * pattern.block_width, block as u32 / columns * pattern.block_height);
            let inside = u32::from(batch.pixel[lane]);
            let pixel = (corner.0 + inside % pattern.block_width, corner.1 + inside / pattern.block_width);
            let place = Place {
                u: batch.u[lane],
                v: batch.v[lane],
                x: corner.0 as f32 - half + batch.x[lane],
                y: corner.1 as f32 - half + batch.y[lane],
            };
            (pixel, place)
        };
        let key = |(x, y): (u32, u32)| hash(hash(seed, u64::from(tx * TILE + x)), u64::from(ty * TILE + y));

        // Sums of the even and the odd samples, in the order of the batches.
        let mut sums = vec![[Vec3::ZERO; 2]; (TILE * TILE) as usize];
        for batch in &pattern.batches {
            if cancelled() {
                return 0.0;
            }
            scratch.draw(self.level, &geometry, &film, batch, &|setup, block, lane| {
                let (pixel, place) = place(batch, block, lane);
                self.shader.is_met(setup, place, key(pixel), batch.index[lane])
            });
            for block in 0..(columns * (TILE / pattern.block_height)) as usize {
                for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
                    let (pixel, place) = place(batch, block, lane);
                    if tx * TILE + pixel.0 >= self.view.width || ty * TILE + pixel.1 >= self.view.height {
                        continue;
                    }
                    let ray = self.ray((tx, ty), place);
                    let mut color = match scratch.seen(block, lane) {
                        Some((setup, _)) => self.shader.radiance(setup, place, ray.as_vec3()),
                        None => self.shader.background(ray),
                    };
                    if let Some(falloff) = &self.falloff {
                        color *= falloff.weight(&self.view, ray, place);
                    }
                    sums[(pixel.1 * TILE + pixel.0) as usize][(batch.index[lane] & 1) as usize] += color;
                }
            }
        }
        self.resolve((tx, ty), &sums, out)
    }

    fn resolve(&self, (tx, ty): (u32, u32), sums: &[[Vec3; 2]], out: &mut [[f32; 3]]) -> f64 {
        let (even, odd) = (self.samples.div_ceil(2), self.samples / 2);
        let gain = libm::exp2(self.scene.render.exposure_ev) as f32;
        let mut squared = 0.0;
        for y in 0..TILE.min(self.view.height - ty * TILE) {
            for x in 0..TILE.min(self.view.width - tx * TILE) {
                let at = (y * TILE + x) as usize;
                let [a, b] = sums[at];
                out[at] = ((a + b) / self.samples as f32).to_array();
                if odd > 0 {
                    let shown = |sum: Vec3, n: u32| (sum * (gain / n as f32)).clamp(Vec3::ZERO, Vec3::ONE);
                    // The mean weighs the halves by their sizes; for equal halves this is a quarter.
                    let n = f64::from(self.samples);
                    let share = f64::from(even) * f64::from(odd) / (n * n);
                    squared += share * (shown(a, even) - shown(b, odd)).as_dvec3().length_squared();
                }
            }
        }
        squared
    }

    /// The direction of the ray of a sample, lens frame.
    fn ray(&self, (tx, ty): (u32, u32), place: Place) -> DVec3 {
        let view = &self.view;
        let center = |tile: u32| f64::from(tile * TILE) + 0.5 * f64::from(TILE);
        let (x, y) = (center(tx) + f64::from(place.x), center(ty) + f64::from(place.y));
        let p = view.film + view.film_dx * x + view.film_dy * y;
        let weight = (1.0 + p.z / view.focal_length) * view.radius;
        DVec3::new(weight * f64::from(place.u), weight * f64::from(place.v), 0.0) - p
    }
}

/// The lens frame in the world: `x` along `ex`, `y` along `ey`, `z` along the lens axis. Left-handed, which
/// no formula of the rasterizer minds.
struct LensFrame<'a> {
    optics: &'a Optics,
    axes: [DVec3; 3],
}

impl<'a> LensFrame<'a> {
    fn new(optics: &'a Optics) -> Self {
        let (ex, ey) = optics.lens_axes();
        Self { optics, axes: [ex, ey, optics.axis()] }
    }

    fn turn(&self, v: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|axis| axis.dot(v)))
    }

    fn vector(&self, world: DVec3) -> DVec3 {
        self.turn(self.optics.world_from_lens().vector_inverse(world))
    }

    fn point(&self, world: DVec3) -> DVec3 {
        self.turn(self.optics.world_from_lens().point_inverse(world))
    }

    fn view(&self, scene: &Scene) -> View {
        let optics = self.optics;
        let (width, height) = (scene.render.width, scene.render.height);
        let film = optics.camera().film;
        let (fx, fy) = optics.film_axes();
        // Pixel (0, 0) is the film's corner at +x, -y: the picture is the film turned by half a turn.
        let (film_width, film_height) = (film.width.as_metres(), film.height.as_metres());
        let corner = optics.film_point(0.5 * film_width, -0.5 * film_height);
        let (dx, dy) = (fx * (-film_width / f64::from(width)), fy * (film_height / f64::from(height)));
        let radius = optics.aperture_radius();
        let family = |u: f64, v: f64| {
            let [x, y, _, w] = optics
                .projection(u * radius, v * radius)
                .rows
                .map(|row| self.turn(row.truncate()).extend(row.w));
            [(x + w) * (0.5 * f64::from(width)), (w - y) * (0.5 * f64::from(height)), w]
        };
        let c0 = family(0.0, 0.0);
        let less = |c: [DVec4; 3]| [c[0] - c0[0], c[1] - c0[1], c[2] - c0[2]];
        let corners = [(0, 0), (width, 0), (0, height), (width, height)]
            .map(|(x, y)| -self.turn(corner + dx * f64::from(x) + dy * f64::from(y)).z);
        let deepest = corners.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let near = optics.camera().near.as_metres();
        let slope = libm::hypot(
            optics.film_normal().dot(optics.lens_axes().0),
            optics.film_normal().dot(optics.lens_axes().1),
        );
        View {
            width,
            height,
            film: self.turn(corner),
            film_dx: self.turn(dx),
            film_dy: self.turn(dy),
            focal_length: optics.focal_length(),
            radius,
            near,
            pixel_from_lens: [c0, less(family(1.0, 0.0)), less(family(0.0, 1.0))],
            // Along a ray, w = t (-(n.s + e)) and z = t (-p.z).
            least_w: near * (-optics.film_plane().e - radius * slope) / deepest,
        }
    }
}

/// `cos(lens) cos(film) / r^2`, relative to lens centre and film centre.
struct Falloff {
    normal: DVec3,
    center: f64,
}

impl Falloff {
    fn new(optics: &Optics, frame: &LensFrame<'_>) -> Self {
        let normal = frame.turn(optics.film_normal());
        let mut falloff = Self { normal, center: 1.0 };
        falloff.center = falloff.raw(frame.turn(optics.film_center()));
        falloff
    }

    /// For the vector from lens point to film point.
    fn raw(&self, r: DVec3) -> f64 {
        let square = r.length_squared();
        r.z.abs() * self.normal.dot(r).abs() / (square * square)
    }

    fn weight(&self, view: &View, ray: DVec3, place: Place) -> f32 {
        // ray = q_w s - p, so p - s = (q_w - 1) s - ray.
        let s = DVec3::new(f64::from(place.u), f64::from(place.v), 0.0) * view.radius;
        let weight = -ray.z / view.focal_length;
        (self.raw(s * weight - ray) / self.center) as f32
    }
}

/// The cells that the samples of every tile are sorted into: elementary intervals of the square, mapped to
/// the lens, each with a circle around it.
fn lens_cells(samples: u32, radius: f64) -> Vec<LensCell> {
    let cells = cell_count(samples);
    if cells == 1 || radius == 0.0 {
        return vec![LensCell { u: 0.0, v: 0.0, radius: 1.0 }; cells as usize];
    }
    let across = 1u32 << cells.trailing_zeros().div_ceil(2);
    let down = cells / across;
    let map = |x: f64, y: f64| {
        let [u, v] = sampling::disk_from_square([x as f32, y as f32]);
        (f64::from(u), f64::from(v))
    };
    (0..cells)
        .map(|cell| {
            let (column, row) = (f64::from(cell % across), f64::from(cell / across));
            let at = |x: f64, y: f64| map((column + x) / f64::from(across), (row + y) / f64::from(down));
            let (u, v) = at(0.5, 0.5);
            // The map is smooth inside a cell, so the farthest point lies on its border.
            let steps = 64;
            let border = (0..=steps).flat_map(|i| {
                let t = f64::from(i) / f64::from(steps);
                [at(t, 0.0), at(t, 1.0), at(0.0, t), at(1.0, t)]
            });
            let radius = border.map(|(bu, bv)| libm::hypot(bu - u, bv - v)).fold(0.0, f64::max);
            LensCell { u, v, radius: radius * 1.001 + 1e-4 }
        })
        .collect()
}

/// One cell for each batch of 16, up to 16 cells: more would cost more in boxes than they save in visits.
fn cell_count(samples: u32) -> u32 {
    let batches = (samples / LANES as u32).max(1);
    (1 << batches.ilog2()).min(16)
}

/// The samples of tile `(tx, ty)`, sorted into batches of 16 lens points of one cell.
fn pattern(seed: u64, (tx, ty): (u32, u32), samples: u32, cells: &[LensCell]) -> Pattern {
    // Below 16 samples a batch serves several pixels, so that no lane is idle.
    let (block_width, block_height) = sampling::block(samples);
    let mut by_cell: Vec<Vec<(u32, u32)>> = vec![Vec::new(); cells.len()];
    let pixels = block_width * block_height;
    let stream = |pixel: u32| {
        sampling::pixel_stream(tx * TILE + pixel % block_width, ty * TILE + pixel / block_width, samples)
    };
    for index in 0..samples {
        for pixel in 0..pixels {
            let square = sampling::sample(seed, stream(pixel), index).square;
            by_cell[sampling::square_cell(square, cells.len() as u32)].push((index, pixel));
        }
    }
    let mut batches = Vec::new();
    for (cell, members) in by_cell.iter().enumerate() {
        for chunk in members.chunks(LANES) {
            let mut batch = Batch {
                cell,
                u: [0.0; LANES],
                v: [0.0; LANES],
                x: [0.0; LANES],
                y: [0.0; LANES],
                pixel: [0; LANES],
                index: [0; LANES],
                live: 0,
            };
            for (lane, &(index, pixel)) in chunk.iter().enumerate() {
                let sample = sampling::sample(seed, stream(pixel), index);
                batch.u[lane] = sample.lens[0];
                batch.v[lane] = sample.lens[1];
                batch.x[lane] = (pixel % block_width) as f32 + sample.pixel[0];
                batch.y[lane] = (pixel / block_width) as f32 + sample.pixel[1];
                batch.pixel[lane] = pixel as u8;
                batch.index[lane] = index;
                batch.live |= 1 << lane;
            }
            batches.push(batch);
        }
    }
    Pattern { block_width, block_height, batches }
}
