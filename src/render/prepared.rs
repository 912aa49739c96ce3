//! A scene prepared for drawing, all that the tiles of a picture share: geometry in the lens frame, bins, the shader.
//!
//! In: a scene: its vertex array, triangles, camera, materials. Out: a [`Prepared`], for [`super::draw`]: vertices in the lens
//! frame and the view ([`super::frame`]), triangles in bins (`raster::bin`) as seen from the cells of the lens
//! ([`super::pattern`], and [`super::diffraction`] where there is some), the shader and the sun (`shade`). No formula of its own:
//! the files named evaluate theirs.

use super::diffraction::{FilmDiffraction, ONE_PLACE};
use super::frame::LensFrame;
use super::highlights::Highlights;
use super::pattern::{Points, Splits};
use super::scratch::TileScratch;
use super::sharing::Asked;
use super::stages::{Stages, Stopwatch};
use super::{cancelled, stopped};
use crate::error::{Error, Result};
use crate::plan::{Decision, RenderPlan};
use crate::quantity::Angle;
use crate::raster::TILE;
use crate::raster::batch::LensCell;
use crate::raster::bin::Bins;
use crate::raster::candidate::Quad;
use crate::raster::cull::Cluster;
use crate::raster::found::Triangles;
use crate::raster::view::View;
use crate::sampling::{self, ApertureShape, runs};
use crate::scene::{Clusters, EffectName, EffectSet, Material, Scene, Sun, Surfaces};
use crate::shade::{Falloff, Shader, ShadowSun};
use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

// Tiles of the rasterizer are the squares that share lens points.
const _: () = assert!(sampling::GRID == TILE);

/// Which samples there are.
#[derive(Clone, Copy)]
pub(super) enum Sequence {
    /// Exactly this many of each pixel, sorted all together.
    Uniform(u32),
    /// Runs of [`sampling::runs`], each sorted by itself, so that any of them may be the last. Memory is asked for one as long as this;
    /// within a time longer ones are drawn where there is more ([`Prepared::longest_run`]).
    Runs(u32),
}

impl Sequence {
    /// The number of samples that the streams of pixels go by, and how the first are sorted into batches.
    fn streams_and_splits(self, has_diffraction: bool) -> (u32, Splits) {
        match self {
            Self::Uniform(samples) => {
                // What is drawn in several steps has the cells that all of them have: one.
                let steps = Splits::steps(samples, has_diffraction);
                (samples, if let [(_, splits)] = steps[..] { splits } else { Splits::new(samples) })
            }
            Self::Runs(_) => (runs::FIRST_RUN, Splits::new(runs::FIRST_RUN)),
        }
    }
}

/// The number of the surface that a triangle is part of, and the triangle that stands for it; where surfaces are not
/// `alike` each is a triangle.
pub(super) fn patch(surfaces: &Surfaces, alike: bool, triangle: u32) -> (u32, u32) {
    if alike { surfaces.patches.of(triangle) } else { (triangle, triangle) }
}

/// Everything that all tiles share.
pub(super) struct Prepared<'a> {
    pub(super) surfaces: &'a Surfaces,
    /// Its materials, without what is to be left out of them.
    pub(super) materials: &'a [Material],
    pub(super) points: Points,
    /// Brightening of the shown picture.
    pub(super) gain: f32,
    /// Samples that see one surface are shaded together.
    pub(super) shared: bool,
    /// Each looks into textures by itself all the same ([`super::sharing`]).
    pub(super) alone: bool,
    /// The longest run of samples that there is memory for.
    pub(super) longest_run: u32,
    /// Tiles that were drawn to find out.
    pub(super) drawn: Vec<Asked>,
    /// Surfaces are patches, not triangles.
    pub(super) alike: bool,
    pub(super) surface_count: usize,
    /// Effects that are asked for and too small to be seen.
    pub(super) left_out: EffectSet,
    pub(super) view: View,
    pub(super) positions: &'a [DVec3],
    pub(super) shader: Shader<'a>,
    pub(super) shadows: Option<ShadowSun<'a>>,
    pub(super) bins: Bins,
    pub(super) falloff: Option<Falloff>,
    pub(super) diffraction: Option<FilmDiffraction>,
    /// The number of samples that the streams of pixels go by: see [`sampling::block`].
    pub(super) streams: u32,
    /// Samples lie at the middle of their pixels.
    pub(super) centred: bool,
    pub(super) highlights: Highlights,
    pub(super) level: Level,
    /// Set to stop; what is made from then on is never seen.
    pub(super) cancel: Option<&'a AtomicBool>,
    /// Scratches that no thread uses.
    pub(super) idle: Mutex<Vec<Box<TileScratch>>>,
}

fn bent_too_far() -> Error {
    Error::invalid("diffraction bends light to where the film's plane meets the lens's")
        .at_key("render.diffraction")
        .remedy("use a larger aperture or less tilt, or set diffraction = false")
}

/// The sun, where it casts shadows: without its disk, where that is left out.
fn sun_with_shadows(scene: &Scene, active: EffectSet) -> Option<Sun> {
    let sun = scene.sun.as_ref().filter(|_| active.has(EffectName::Shadows))?;
    let has_disk = active.has(EffectName::SoftShadows);
    Some(Sun { angular_diameter: if has_disk { sun.angular_diameter } else { Angle::ZERO }, ..*sun })
}

/// The triangles in bins, as these cells of the lens see them; two as a quad, where surfaces are `alike` ([`patch`]).
fn bins(
    (level, view, cells): (Level, &View, &[LensCell]),
    (surfaces, materials): (&Surfaces, &[Material]),
    (frame, positions): (&LensFrame, &[DVec3]),
    alike: bool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Bins {
    let cutout: Vec<bool> = materials.iter().map(Material::is_cutout).collect();
    let clusters: Vec<Cluster> = surfaces
        .clusters
        .0
        .iter()
        .map(|cluster| Cluster {
            corners: cluster.corners().map(|corner| frame.point(corner)),
            vertices: cluster.vertices.clone(),
        })
        .collect();
    let has_quads = alike && !surfaces.patches.quads.is_empty();
    let lets_through = |t: u32| cutout[surfaces.attributes[t as usize].material as usize];
    let quad = |t: u32| {
        let (corners, is_first) = surfaces.patches.quads.of(t, surfaces.triangles[t as usize])?;
        // Of the materials that are shown, which need not be those that patches were found by.
        (!lets_through(t)).then_some(Quad { corners, is_first })
    };
    let triangles = Triangles {
        clusters: &clusters,
        cluster_size: Clusters::SIZE,
        vertices: &surfaces.triangles,
        quad: has_quads.then_some(&quad),
        surface: &|t| (patch(surfaces, alike, t).0, lets_through(t)),
    };
    Bins::new(level, view, cells, positions, &triangles, stop)
}

/// Vertices in the lens frame.
pub(super) fn positions(scene: &Scene) -> Vec<DVec3> {
    let frame = LensFrame::new(&scene.optics);
    scene.surfaces.positions.par_iter().map(|&p| frame.point(p)).collect()
}

impl<'a> Prepared<'a> {
    /// `positions` are those of the vertices in the lens frame, `materials` those that are shown.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] where diffraction would spread light to where the film meets the lens's plane;
    /// [`crate::error::ErrorKind::Cancelled`] when stopped.
    pub(super) fn new(
        (scene, materials): (&'a Scene, &'a [Material]),
        positions: &'a [DVec3],
        sequence: Sequence,
        level: Level,
        cancel: Option<&'a AtomicBool>,
        mut watch: Stopwatch<'_>,
        stages: &mut Stages,
    ) -> Result<Self> {
        let optics = &scene.optics;
        let surfaces = &scene.surfaces;
        let frame = LensFrame::new(optics);
        watch.lap(&mut stages.transform);
        let stop = || cancelled(cancel);
        let go_on = || if stop() { Err(stopped()) } else { Ok(()) };
        let Decision { active, left_out } = RenderPlan::decide(scene, &stop);
        watch.lap(&mut stages.plan);
        go_on()?;
        let radius = if active.has(EffectName::Defocus) { optics.aperture_radius() } else { 0.0 };
        let mut view = frame.view(scene, radius);
        let has_shape = active.has(EffectName::ApertureShape);
        let shape = if has_shape { scene.aperture_shape() } else { ApertureShape::Disk };
        let seed = scene.render.seed;
        let has_diffraction = active.has(EffectName::Diffraction);
        let (streams, splits) = sequence.streams_and_splits(has_diffraction);
        let mut cells = splits.lens_cells(&shape, view.radius);
        let diffraction = has_diffraction.then(|| FilmDiffraction::new(optics, &shape, &view, seed, streams));
        if let Some(diffraction) = &diffraction {
            cells = diffraction.cells(&cells);
            view = view.widened(diffraction.reach()).ok_or_else(bent_too_far)?;
        }
        let sun = sun_with_shadows(scene, active);
        // Places on a surface must be exact for its shadows: patches that are not flat do not do.
        let alike = scene.render.share_shading && (sun.is_none() || surfaces.patches.are_flat());
        let bins = bins((level, &view, &cells), (surfaces, materials), (&frame, positions), alike, &stop);
        watch.lap(&mut stages.bin);
        go_on()?;
        let shown = (surfaces, materials);
        let shadows = sun.and_then(|sun| ShadowSun::new(shown, positions, &sun, |v| frame.vector(v)));
        go_on()?;
        // Below 16 samples a pixel hardly any would share, and displaced ones lie too far from each other.
        let shared = scene.render.share_shading && streams >= 16 && diffraction.is_none();
        let shader = Shader::new(shown, scene.sun.as_ref(), &scene.sky, scene.up, |v| frame.vector(v));
        let falloff = active.has(EffectName::Falloff).then(|| frame.falloff());
        let gain = libm::exp2(scene.render.exposure_ev) as f32;
        let disks = diffraction.as_ref().map(|diffraction| diffraction.disks(&view));
        let disks = disks.as_ref().map_or(&ONE_PLACE[..], |disks| &disks[..]);
        go_on()?;
        let (lens, shown) = ((&view, &shape), (scene, materials));
        let highlights =
            Highlights::new(shown, lens, positions, (streams, gain), disks, shadows.as_ref(), (level, &stop));
        go_on()?;
        watch.lap(&mut stages.prepare);
        Ok(Self {
            surfaces,
            materials,
            points: Points { set: scene.render.points, shape, seed },
            gain,
            shared,
            alone: false,
            longest_run: 0,
            drawn: Vec::new(),
            alike,
            left_out,
            surface_count: if alike && !surfaces.patches.is_empty() {
                surfaces.patches.parts()
            } else {
                surfaces.triangles.len()
            },
            view,
            positions,
            shader,
            shadows,
            bins,
            falloff,
            diffraction,
            streams,
            centred: !active.has(EffectName::Antialiasing),
            highlights,
            level,
            cancel,
            idle: Mutex::default(),
        })
    }

    /// Whether the picture is no longer wanted.
    pub(super) fn stopped(&self) -> bool {
        cancelled(self.cancel)
    }

    pub(super) fn tiles(&self) -> usize {
        (self.bins.tiles_x * self.bins.tiles_y) as usize
    }

    /// Column and row of a tile.
    pub(super) fn place(&self, tile: usize) -> (u32, u32) {
        (tile as u32 % self.bins.tiles_x, tile as u32 / self.bins.tiles_x)
    }

    /// How many pixels the picture has.
    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.view.width) * f64::from(self.view.height)
    }

    /// How many values it has: pixels times channels.
    pub(super) fn values(&self) -> f64 {
        3.0 * self.pixels()
    }
}
