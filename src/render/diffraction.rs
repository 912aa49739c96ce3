//! Diffraction in a picture: the samples of a tile in, the same with their film points displaced out.
//!
//! From [`super::pattern`] to [`super::draw`]: `(x, y) + M k`, where `k` is a frequency drawn from the aperture's pattern
//! (`sampling::Diffraction`) and `M` says how many pixels a frequency of 1 goes, at the tile's centre.
//!
//! A displaced film point is a place in a batch outside of its own pixel, so nothing else draws differently: boxes are
//! widened by what samples may be displaced. Most go less than a ring and few go fifty, so samples are sorted by how far they
//! go, and batches of three classes have boxes of their own.
//!
//! How a frequency goes to the film is taken at each tile's centre. Along a film on which rays lean by an angle `a` a ring goes as the square
//! of their length, so 16 pixels from there Airy's first dark ring, of `1.22 lambda r / A`, is off by about `40 tan(a) lambda / A`
//! pixels: 0.02 at 45 degrees for an aperture of a millimetre.

use crate::optics::Optics;
use crate::raster::batch::{Batch, LensCell, Pattern};
use crate::raster::view::View;
use crate::raster::{LANES, TILE};
use crate::sampling::{self, ApertureShape, Diffraction};
use glam::{DMat2, DVec2};
use rayon::prelude::*;

/// The shares of the light that classes of samples hold, with those before.
const CLASSES: [f64; 3] = [0.8, 0.97, 1.0];

/// Shares of the light by distance, for lights that samples may miss.
pub(super) const RINGS: [f64; 5] = [0.8, 0.91, 0.97, 0.99, 1.0];

/// The pattern of a picture's aperture on its film.
pub(super) struct FilmDiffraction {
    pattern: Diffraction,
    optics: Optics,
    /// Pixels on a metre of the film, along its x and y, which run against the picture's x and with its y.
    pixels: [f64; 2],
    seed: u64,
    streams: u32,
    /// The farthest that a sample goes anywhere in the picture, right or left and down or up, pixels.
    reach: [f64; 2],
}

/// A disk of even light; several about one centre stand for a pattern.
pub(super) struct Disk {
    /// Its share of all light.
    pub share: f64,
    /// How far it goes, pixels.
    pub reach: DVec2,
}

/// All light in one place: no diffraction.
pub(super) const ONE_PLACE: [Disk; 1] = [Disk { share: 1.0, reach: DVec2::ZERO }];

impl FilmDiffraction {
    pub(super) fn new(optics: &Optics, shape: &ApertureShape, view: &View, seed: u64, streams: u32) -> Self {
        let film = optics.camera().film;
        let mut whole = Self {
            pattern: Diffraction::new(shape),
            optics: optics.clone(),
            pixels: [
                -f64::from(view.width) / film.width.as_metres(),
                f64::from(view.height) / film.height.as_metres(),
            ],
            seed,
            streams,
            reach: [0.0; 2],
        };
        let (columns, rows) = (view.width.div_ceil(TILE), view.height.div_ceil(TILE));
        let rows = (0..rows).into_par_iter().map(|y| {
            let of_tile = |x| whole.stretch(view, (x, y)) * whole.pattern.reach();
            (0..columns).map(of_tile).fold(DVec2::ZERO, DVec2::max)
        });
        // What rounding may add is a small part of it.
        whole.reach = (rows.reduce(|| DVec2::ZERO, DVec2::max) * 1.0001 + 1e-3).to_array();
        whole
    }

    /// The displacement in pixels for each unit of frequency, at a tile's centre.
    fn at(&self, view: &View, (x, y): (u32, u32)) -> DMat2 {
        let middle = |tile: u32, size: u32| f64::from(tile * TILE + TILE / 2) - 0.5 * f64::from(size);
        let [across, down] = self.pixels;
        let matrix =
            self.optics.diffraction_at(middle(x, view.width) / across, middle(y, view.height) / down);
        DMat2::from_diagonal(DVec2::new(across, down)) * matrix
    }

    /// How far a frequency of 1 goes at most, right or left and down or up.
    fn stretch(&self, view: &View, tile: (u32, u32)) -> DVec2 {
        let matrix = self.at(view, tile);
        DVec2::new(matrix.row(0).length(), matrix.row(1).length())
    }

    /// The farthest that a sample goes, right or left and down or up, pixels.
    pub(super) fn reach(&self) -> [f64; 2] {
        self.reach
    }

    /// The cells of the lens, each with each class of samples.
    pub(super) fn cells(&self, lens: &[LensCell]) -> Vec<LensCell> {
        let classes = self.classes();
        lens.iter()
            .flat_map(|cell| {
                classes.map(|part| LensCell { displacement: self.reach.map(|reach| part * reach), ..*cell })
            })
            .collect()
    }

    /// How far the samples of each class go at most, as a part of `reach`.
    fn classes(&self) -> [f64; CLASSES.len()] {
        let mut parts = CLASSES.map(|share| self.pattern.radius_of(share) / self.pattern.reach() * 1.0001);
        parts[CLASSES.len() - 1] = 1.0;
        parts
    }

    /// The pattern at the picture's centre, without its finer structure.
    pub(super) fn disks(&self, view: &View) -> [Disk; RINGS.len()] {
        let stretch = self.stretch(view, (view.width / (2 * TILE), view.height / (2 * TILE)));
        let radii = RINGS.map(|within| self.pattern.radius_of(within));
        // Light in the ring that a disk ends, by the square of the radius.
        let ring = |i: usize| -> f64 {
            let (dark, inner) = if i == 0 { (0.0, 0.0) } else { (RINGS[i - 1], radii[i - 1]) };
            let (light, area) = (RINGS[i] - dark, radii[i] * radii[i] - inner * inner);
            if area > 0.0 { light / area } else { 0.0 }
        };
        // Each disk adds what its ring is brighter than the one around it.
        std::array::from_fn(|i| {
            let around = if i + 1 < RINGS.len() { ring(i + 1) } else { 0.0 };
            let share = ((ring(i) - around) * radii[i] * radii[i]).max(0.0);
            Disk { share, reach: stretch * radii[i] }
        })
    }

    /// The samples of `tile` with their film points displaced, in batches by cell of the lens and by how far they go.
    pub(super) fn displace(&self, view: &View, tile: (u32, u32), pattern: &Pattern) -> Pattern {
        let matrix = self.at(view, tile);
        let mut moved: Vec<Moved<'_>> = Vec::with_capacity(pattern.batches.len() * LANES);
        for batch in &pattern.batches {
            for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
                let (x, y) = pattern.pixel((0, 0), batch, lane);
                let stream = sampling::pixel_stream(tile.0 * TILE + x, tile.1 * TILE + y, self.streams);
                let square = sampling::diffraction_square(self.seed, stream, batch.index[lane]);
                let by = matrix * DVec2::from_array(self.pattern.from_square(square));
                let part = (by.x.abs() / self.reach[0]).max(by.y.abs() / self.reach[1]);
                moved.push(Moved { batch, lane, by: [by.x as f32, by.y as f32], part });
            }
        }
        // By name at last, so that the order is one.
        moved.sort_unstable_by(|a, b| {
            let name = |m: &Moved<'_>| (m.batch.index[m.lane], m.batch.pixel[m.lane]);
            let cells = a.batch.cell.cmp(&b.batch.cell);
            cells.then(a.part.total_cmp(&b.part)).then_with(|| name(a).cmp(&name(b)))
        });
        let classes = self.classes();
        let batches = moved
            .chunk_by(|a, b| a.batch.cell == b.batch.cell)
            .flat_map(|of_cell| of_cell.chunks(LANES))
            .map(|chunk| together(chunk, &classes))
            .collect();
        Pattern { batches, ..*pattern }
    }
}

/// A sample with its displacement.
struct Moved<'a> {
    batch: &'a Batch,
    lane: usize,
    /// Pixels.
    by: [f32; 2],
    /// How far it goes, as a part of what samples go at most.
    part: f64,
}

/// A batch of samples of one cell of the lens, the one that goes farthest last.
fn together(chunk: &[Moved<'_>], classes: &[f64; CLASSES.len()]) -> Batch {
    let farthest = chunk.last().map_or(0.0, |moved| moved.part);
    let class = classes.iter().position(|&part| farthest <= part).unwrap_or(CLASSES.len() - 1);
    let cell = chunk.first().map_or(0, |moved| moved.batch.cell);
    let mut out = Batch::of_cell(cell * CLASSES.len() + class);
    for (to, &Moved { batch, lane: from, by, .. }) in chunk.iter().enumerate().take(LANES) {
        out.u[to] = batch.u[from];
        out.v[to] = batch.v[from];
        out.x[to] = batch.x[from] + by[0];
        out.y[to] = batch.y[from] + by[1];
        out.pixel[to] = batch.pixel[from];
        out.index[to] = batch.index[from];
        out.live |= 1 << to;
        out.odd |= (batch.odd >> from & 1) << to;
    }
    out
}
