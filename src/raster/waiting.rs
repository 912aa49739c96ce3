//! Candidates of one tile that wait to be set up, at most sixteen.
//!
//! In: candidates, nearest first, with their pixel boxes, from [`super::bin`]. Out: those that [`super::tile`] wants and [`super::sift`]
//! leaves, in the same order, and their corners side by side, for [`super::setup`].

use super::LANES;
use super::bin::Bins;
use super::candidate::Candidate;
use super::film::TileFilm;
use super::geometry::Geometry;
use super::lens_points::LensPoints;
use super::setup::{Corner, Corners, SetUp};
use super::sift::Sieve;
use super::tile_lists::Cursor;
use super::vertex_boxes::PixelBox;
use super::view::View;
use fearless_simd::Level;
use glam::DVec3;

/// See the module.
#[derive(Default)]
pub(super) struct Waiting {
    /// Their numbers among all candidates, right after they were read: [`Waiting::replace`] does not move them.
    pub numbers: [u32; LANES],
    pub candidates: [Candidate; LANES],
    /// The fourth corners of those that are quads, of triangles the third once more; of no use where there are no quads.
    pub fourths: [u32; LANES],
    /// The boxes of each from the cells of the lens.
    pub boxes: Vec<PixelBox>,
    pub count: usize,
    /// For each the place of its surface among the tile's.
    pub ids: [u32; LANES],
    /// The depth that none of them is nearer than, nor any after them.
    pub least_z: f32,
    /// Whether there are none after them.
    pub is_last: bool,
}

impl Waiting {
    /// Adds the next candidates, nearest first, that may touch tile `(x, y)`, and their boxes from each cell; where most are loose, those
    /// that anything within the lens may see there.
    pub(super) fn fill(
        &mut self,
        level: Level,
        bins: &Bins,
        tile: (u32, u32),
        cursor: &mut Cursor,
        lens: Option<&mut LensPoints>,
    ) {
        let (first, cells) = (self.count, bins.cells());
        self.count += bins.next(level, tile, cursor, lens, &mut self.numbers[first..]);
        let those = first..self.count;
        // They lie anywhere in memory: with nothing to decide in between, it brings many at once.
        for at in those.clone() {
            self.candidates[at] = bins.candidate(self.numbers[at]);
        }
        if bins.has_quads() {
            for at in those.clone() {
                self.fourths[at] = bins.fourth(self.numbers[at]);
            }
        }
        self.boxes.truncate(first * cells);
        if cells == 1 {
            self.boxes.extend(self.candidates[those].iter().map(|candidate| candidate.pixels));
            return;
        }
        for &number in &self.numbers[those] {
            self.boxes.extend_from_slice(bins.boxes(number));
        }
    }

    /// Moves a candidate to a place before it.
    pub(super) fn replace(&mut self, to: usize, from: usize, cells: usize) {
        if to != from {
            self.candidates[to] = self.candidates[from];
            self.fourths[to] = self.fourths[from];
            self.ids[to] = self.ids[from];
            self.boxes.copy_within(from * cells..(from + 1) * cells, to * cells);
        }
    }

    /// The corners of those from `first` on; tells which of them have an image for every lens point.
    pub(super) fn corners(&self, first: usize, view: &View, positions: &[DVec3], out: &mut Corners) -> u16 {
        // Farther from the tile's centre single precision does not place a corner as well as `scatter` assumes.
        let is_narrow = view.displacement.iter().all(|&displacement| displacement < 2000.0);
        let mut imaged = 0;
        for (lane, candidate) in self.candidates.iter().enumerate().take(self.count).skip(first) {
            for (corner, &vertex) in out.iter_mut().zip(&candidate.vertices) {
                let place = positions[vertex as usize];
                corner[0][lane] = place.x;
                corner[1][lane] = place.y;
                corner[2][lane] = place.z;
            }
            imaged |= u16::from(candidate.is_inside() && is_narrow) << lane;
        }
        imaged
    }

    /// The places of the fourth corners of those from `first` on, if any is a quad; and which are.
    fn fourth(&self, first: usize, positions: &[DVec3]) -> (Option<Corner>, u16) {
        let those = self.candidates.iter().enumerate().take(self.count).skip(first);
        let quads = those.fold(0, |quads, (lane, of)| quads | u16::from(of.is_quad()) << lane);
        if quads == 0 {
            return (None, 0);
        }
        let mut out: Corner = [[0.0; LANES]; 3];
        for (lane, &vertex) in self.fourths.iter().enumerate().take(self.count).skip(first) {
            let place = positions[vertex as usize];
            (out[0][lane], out[1][lane], out[2][lane]) = (place.x, place.y, place.z);
        }
        (Some(out), quads)
    }

    /// Sets them up.
    pub(super) fn set_up(&self, level: Level, geometry: &Geometry<'_>, film: &TileFilm, made: &mut SetUp) {
        let (mut corners, mut least_z): (Corners, _) = ([[[0.0; LANES]; 3]; 3], [0.0; LANES]);
        made.imaged = self.corners(0, geometry.view, geometry.positions, &mut corners);
        (made.near, made.cutout) = (0, 0);
        for (lane, candidate) in self.candidates.iter().take(self.count).enumerate() {
            least_z[lane] = candidate.least_z;
            made.triangles[lane] = candidate.triangle;
            let near = geometry.view.may_be_near(f64::from(candidate.least_z));
            made.near |= u16::from(near) << lane;
            made.cutout |= u16::from(candidate.is_cutout()) << lane;
        }
        let fourth;
        (fourth, made.quads) = self.fourth(0, geometry.positions);
        film.set_up(level, (&corners, fourth.as_ref()), &least_z, made);
        made.may_touch &= (0xffff_u32 >> (LANES - self.count)) as u16;
        made.ids = self.ids;
    }

    /// Leaves those from `first` on out that no sample can meet.
    pub(super) fn sift(
        &mut self,
        (level, view, film): (Level, &View, &TileFilm),
        positions: &[DVec3],
        sieve: &Sieve,
        first: usize,
        cells: usize,
    ) {
        let mut corners: Corners = [[[0.0; LANES]; 3]; 3];
        let imaged = self.corners(first, view, positions, &mut corners);
        let (fourth, _) = self.fourth(first, positions);
        let met = sieve.met(level, film, (&corners, fourth.as_ref()), imaged) | !imaged;
        let count = std::mem::replace(&mut self.count, first);
        for lane in (first..count).filter(|lane| met >> lane & 1 == 1) {
            self.replace(self.count, lane, cells);
            self.count += 1;
        }
    }
}
