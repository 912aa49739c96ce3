//! The lens points of a tile, and which of them see a small triangle far out of focus ([`super::loose`]) there: one or two, or none.
//!
//! In: a tile's samples, loose triangles in bunches ([`super::bunches`]), and the others that are listed with the tile
//! ([`super::tile_lists`]). Out: those that a lens point may see, nearest first, each with these lens points as bits, for [`super::bin`]. The
//! lens points that see a triangle in the tile lie in a rectangle: for each axis a table holds the lens points before each of 255
//! places, so two look-ups an axis are all that is asked. Rectangles are made for 16 triangles at once, a bunch, of which the tile
//! may see something.
//!
//! The middle of a triangle, seen through the lens centre at `x_1`, `y_1`, is seen at `a`, `b` from the lens point `t / (1 - p.t)` with
//! `t = g^-1 (a - x_1, b - y_1)`, in the terms of [`super::loose`]. With `a` and `b` the tile, widened by the triangle's reach, that is a
//! rectangle about the tile's middle.

use super::batch::Pattern;
use super::bunches::{Bunches, SLICE, Slice};
use super::loose::Sixteen;
use super::tile_lists::{Cursor, TileLists};
use super::{LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16, mask32x16};

/// Places along an axis of the lens that are told apart.
const STEPS: usize = 255;

/// For each place along an axis the lens points before it, 64 to a word.
type Before = [u64; 256];

/// See the module.
#[derive(Default)]
pub(super) struct LensPoints {
    /// For each axis, word by word; no words where there are too many lens points to tell them apart.
    before: [Vec<Before>; 2],
    /// Places of triangles that are not loose.
    listed: Vec<u32>,
    seen: Seen,
}

/// The triangles of a slice that are seen.
#[derive(Default)]
struct Seen {
    /// The first place of the slice.
    start: usize,
    /// Place by place a bit for each that is seen, of those that were not taken yet.
    places: Vec<u64>,
    /// The first of these that is not all zeros.
    word: usize,
    /// For each place that is seen where its lens points begin.
    first: Vec<u32>,
    points: Vec<u64>,
}

impl Seen {
    /// For the triangles of another slice.
    fn clear(&mut self, slice: usize) {
        self.start = slice * SLICE;
        self.places.clear();
        self.places.resize(SLICE / 64, 0);
        self.first.resize(SLICE, 0);
        self.word = 0;
        self.points.clear();
    }

    /// Adds the triangle at a place, whose lens points were put at `first`, if there are `any`.
    #[inline(always)]
    fn add(&mut self, place: u32, first: usize, any: bool) {
        let at = place as usize % SLICE;
        self.places[at / 64] |= u64::from(any) << (at % 64);
        self.first[at] = first as u32;
    }

    /// The first that was not taken yet: its place, and where its lens points begin.
    fn take(&mut self) -> Option<(u32, usize)> {
        while let Some(bits) = self.places.get_mut(self.word) {
            if *bits != 0 {
                let at = self.word * 64 + bits.trailing_zeros() as usize;
                *bits &= *bits - 1;
                return Some(((self.start + at) as u32, self.first[at] as usize));
            }
            self.word += 1;
        }
        None
    }
}

impl LensPoints {
    /// Batches that there is room for.
    const MOST: usize = 64;

    /// Takes the lens points of `pattern`; tells whether there is room for all of its batches. If not, triangles are told without
    /// the lens points that see them.
    pub(super) fn set(&mut self, pattern: &Pattern) -> bool {
        let has_room = pattern.batches.len() <= Self::MOST;
        let batches = if has_room { &pattern.batches[..] } else { &[] };
        self.seen.clear(0);
        for before in &mut self.before {
            before.clear();
            before.resize(batches.len().div_ceil(4), [0; 256]);
        }
        for (number, batch) in batches.iter().enumerate() {
            for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
                let bit = 1 << (number % 4 * LANES + lane);
                for (before, at) in self.before.iter_mut().zip([batch.u[lane], batch.v[lane]]) {
                    let step = (step(at).max(0.0) as usize).min(STEPS - 1);
                    before[number / 4][step + 1] |= bit;
                }
            }
        }
        for before in self.before.iter_mut().flatten() {
            for i in 1..=STEPS {
                before[i] |= before[i - 1];
            }
        }
        has_room
    }

    /// Words of lens points, 64 each, those of four batches.
    pub(super) fn words(&self) -> usize {
        self.before[0].len()
    }

    /// The place of the next triangle that a lens point may see in `tile`, and which may.
    pub(super) fn next(
        &mut self,
        level: Level,
        (lists, bunches): (&TileLists, &Bunches),
        tile: (u32, u32),
        cursor: &mut Cursor,
    ) -> Option<(u32, &[u64])> {
        let (place, first) = loop {
            if let Some(found) = self.seen.take() {
                break found;
            }
            let slice = bunches.slices.get(cursor.slices)?;
            self.seen.clear(cursor.slices);
            cursor.slices += 1;
            at_level!(level, simd => find(simd, self, slice, bunches.is_level, tile));
            lists.until((cursor.slices * SLICE) as u32, tile, cursor, &mut self.listed);
            // Whatever is not loose may be seen from anywhere.
            for &place in &self.listed {
                let first = self.seen.points.len();
                self.seen.points.extend(self.before[0].iter().map(|before| before[STEPS]));
                self.seen.add(place, first, true);
            }
        };
        Some((place, &self.seen.points[first..first + self.words()]))
    }
}

/// Finds those of a slice that are seen.
#[inline(always)]
fn find<S: Simd>(simd: S, lens: &mut LensPoints, slice: &Slice, is_level: bool, tile: (u32, u32)) {
    let LensPoints { before: [across, down], seen, .. } = lens;
    let words = across.len();
    let mut count = 0;
    for (wholes, bunches) in slice.wholes.iter().zip(slice.bunches.chunks(LANES)) {
        let these = Rectangles::new(simd, wholes, is_level, tile);
        for (lane, bunch) in bunches.iter().enumerate().filter(|(lane, _)| these.some >> lane & 1 == 1) {
            let mut all = across.iter().zip(&*down);
            if words > 0 && all.all(|(across, down)| these.points(lane, across, down) == 0) {
                continue;
            }
            let each = Rectangles::new(simd, &bunch.images, is_level, tile);
            seen.points.resize(words * (count + LANES), 0);
            let mut rest = each.some;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                // One in three is seen, which no branch foresees: what is not is written over by the next.
                let (first, mut any) = (count * words, u64::from(words == 0));
                let out = &mut seen.points[first..first + words];
                for ((across, down), out) in across.iter().zip(&*down).zip(out) {
                    *out = each.points(lane, across, down);
                    any |= *out;
                }
                seen.add(bunch.places[lane], first, any != 0);
                count += usize::from(any != 0);
            }
        }
    }
    seen.points.truncate(words * count);
}

/// The lens points that may see each of 16 in a tile.
struct Rectangles {
    /// Their first and last places along both axes: left, right, top, bottom.
    sides: [[i32; LANES]; 4],
    /// Those of which any place may see something.
    some: u16,
}

impl Rectangles {
    #[inline(always)]
    fn new<S: Simd>(simd: S, images: &Sixteen, is_level: bool, tile: (u32, u32)) -> Self {
        let Self { sides, some } =
            if is_level { level(simd, images, tile) } else { tilted(simd, images, tile) };
        Self { sides, some: some & images.live }
    }

    /// Those of 64 lens points, in the tables of both axes, that may see one of the 16.
    #[inline(always)]
    fn points(&self, lane: usize, across: &Before, down: &Before) -> u64 {
        let [left, right, top, bottom] = self.sides.each_ref().map(|side| usize::from(side[lane] as u8));
        across[right] & !across[left] & down[bottom] & !down[top]
    }
}

/// From where the lens centre sees each of 16 triangles to the middle of a tile, and how far the tile goes from there, right and down.
#[inline(always)]
fn ways<S: Simd>(simd: S, images: &Sixteen, tile: (u32, u32)) -> [[f32x16<S>; 2]; 2] {
    let half = 0.5 * TILE as f32;
    let way = |axis: usize, tile: u32| {
        let middle = f32x16::splat(simd, (tile * TILE) as f32 + half);
        let way = middle - f32x16::load_array_ref(simd, &images.place[axis]);
        [way, f32x16::load_array_ref(simd, &images.reach[axis]) + half]
    };
    [way(0, tile.0), way(1, tile.1)]
}

/// Where nothing is tilted.
#[inline(always)]
fn level<S: Simd>(simd: S, images: &Sixteen, tile: (u32, u32)) -> Rectangles {
    let [[dx, half_x], [dy, half_y]] = ways(simd, images, tile);
    let [ux, vy] = images.per_pixel.each_ref().map(|row| f32x16::load_array_ref(simd, row));
    let (u, v) = (ux * dx, vy * dy);
    let (half_u, half_v) = (ux.abs() * half_x, vy.abs() * half_y);
    let is_known = ux.simd_ne(f32x16::splat(simd, 0.0));
    rectangles(simd, is_known, [u - half_u, u + half_u], [v - half_v, v + half_v])
}

/// Where the film leans or is turned.
#[inline(always)]
fn tilted<S: Simd>(simd: S, images: &Sixteen, tile: (u32, u32)) -> Rectangles {
    let [[dx, half_x], [dy, half_y]] = ways(simd, images, tile);
    let load = |rows: &[[f32; LANES]; 2]| rows.each_ref().map(|row| f32x16::load_array_ref(simd, row));
    let ([ux, vy], [uy, vx], [pu, pv]) = (load(&images.per_pixel), load(&images.across), load(&images.p));
    let (u, v) = (ux * dx + uy * dy, vx * dx + vy * dy);
    let (half_u, half_v) = (ux.abs() * half_x + uy.abs() * half_y, vx.abs() * half_x + vy.abs() * half_y);
    let (middle, swing) = (pu * u + pv * v, pu.abs() * half_u + pv.abs() * half_v);
    let one = f32x16::splat(simd, 1.0);
    let (least, most) = (one - (middle + swing), one - (middle - swing));
    let zero = f32x16::splat(simd, 0.0);
    let is_known = least.simd_gt(f32x16::splat(simd, LEAST)) & (ux.simd_ne(zero) | uy.simd_ne(zero));
    let (larger, smaller) = (one / least, one / most);
    let (low_u, high_u, low_v, high_v) = (u - half_u, u + half_u, v - half_v, v + half_v);
    let low_u = (low_u * larger).min(low_u * smaller);
    let low_v = (low_v * larger).min(low_v * smaller);
    let high_u = (high_u * larger).max(high_u * smaller);
    let high_v = (high_v * larger).max(high_v * smaller);
    rectangles(simd, is_known, [low_u, high_u], [low_v, high_v])
}

/// The least `1 - p.t` that is not taken for nothing.
const LEAST: f32 = 0.01;

/// What rounding may do to a lens point, as a part of the lens.
const ROUNDING: f32 = 1e-4;

/// From the least and the most `u` and `v`; the whole lens where these are not known.
#[inline(always)]
fn rectangles<S: Simd>(simd: S, is_known: mask32x16<S>, u: [f32x16<S>; 2], v: [f32x16<S>; 2]) -> Rectangles {
    let one = f32x16::splat(simd, 1.0);
    let (scale, margin) = (0.5 * STEPS as f32, one + ROUNDING);
    let (zero, last) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, STEPS as f32));
    // The first step that lens points from `low` to `high` lie in, and the one after the last.
    let steps = |[low, high]: [f32x16<S>; 2]| {
        let first = (low + (1.0 - ROUNDING)) * scale;
        let end = (high + margin) * scale + one;
        let first = is_known.select(first.max(zero).min(last - one), zero);
        let end = is_known.select(end.max(zero).min(last), last);
        [simd.cvt_i32_f32x16(first.floor()).to_array(), simd.cvt_i32_f32x16(end.floor()).to_array()]
    };
    let misses = |[low, high]: [f32x16<S>; 2]| low.simd_gt(margin) | high.simd_lt(-margin);
    let ([left, right], [top, bottom]) = (steps(u), steps(v));
    let some = !is_known | !(misses(u) | misses(v));
    Rectangles { sides: [left, right, top, bottom], some: some.to_bitmask() as u16 }
}

/// The step that a lens point's coordinate lies in, not rounded.
fn step(at: f32) -> f32 {
    (at + 1.0) * (0.5 * STEPS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::batch::Batch;
    use crate::raster::bunches::Bunches;
    use crate::raster::tile_lists::Tiles;
    use crate::raster::view::{View, test_view};
    use crate::simd::SimdLevel;
    use glam::{DVec3, DVec4};

    /// Tiles in a row of the picture.
    const TILES: u32 = 16;

    #[test]
    fn no_lens_point_that_sees_a_triangle_is_left_out() {
        let mut view = test_view();
        // A wide lens.
        (view.width, view.height) = (TILES * TILE, TILES * TILE);
        view.pixel_from_lens[1][0] *= 20.0;
        view.pixel_from_lens[2][1] *= -25.0;
        view.pixel_from_lens[1][1] = DVec4::ZERO;
        view.pixel_from_lens[2][0] = DVec4::ZERO;
        view.pixel_from_lens[1][2] = DVec4::ZERO;
        view.pixel_from_lens[2][2] = DVec4::ZERO;
        every_lens_point_is_kept(&view, true, 2);
        // A film that leans, and is turned: w changes with the lens point, and x with v.
        view.pixel_from_lens[1][1] = 0.2 * view.pixel_from_lens[1][0];
        view.pixel_from_lens[2][0] = 0.1 * view.pixel_from_lens[2][1];
        view.pixel_from_lens[1][2] = DVec4::new(0.0, 0.0, 0.04, -0.03);
        view.pixel_from_lens[2][2] = DVec4::new(0.0, 0.0, -0.02, 0.05);
        every_lens_point_is_kept(&view, false, 2);
        // The same, lying on its side, and leaning four times as far.
        for part in &mut view.pixel_from_lens[1..] {
            part.swap(0, 1);
            part[2] *= 4.0;
        }
        every_lens_point_is_kept(&view, false, 4);
    }

    /// Five batches, of which the first lens point of each is not in use.
    fn batches(random: &mut Random) -> Vec<Batch> {
        let batch = |_| {
            let mut batch = Batch { live: 0xfffe, ..Batch::of_cell(0) };
            for lane in 0..LANES {
                let (sine, cosine) = libm::sincos(3.2 * random.signed());
                let r = libm::sqrt(random.signed().abs());
                (batch.u[lane], batch.v[lane]) = ((r * cosine) as f32, (r * sine) as f32);
            }
            batch
        };
        (0..5).map(batch).collect()
    }

    /// And not `most` times as many.
    fn every_lens_point_is_kept(view: &View, is_level: bool, most: u32) {
        let mut random = Random(7);
        let pattern = Pattern { block_bits: [0; 2], batches: batches(&mut random) };
        // Small triangles in heaps, and in the middle one that is not loose.
        let (count, large) = (600, 300);
        let mut corners = Vec::new();
        for at in 0..count {
            let z = 0.5 + 0.1 * random.signed();
            let heap = f64::from(at % 20) / 20.0;
            let middle = DVec3::new(z * (heap + 0.1 * random.signed()), z * random.signed(), z);
            let size = if at == large { 1.0 } else { 2e-3 };
            let corner = |_| middle + size * DVec3::from_array([0; 3].map(|_| random.signed()));
            corners.push([0; 3].map(corner));
        }
        let all = Tiles { x0: 0, x1: TILES as u16 - 1, y0: 0, y1: TILES as u16 - 1 };
        let mut tiles = vec![all; count as usize];
        let order: Vec<u32> = (0..count).collect();
        let bunches = Bunches::take(view, &order, &mut tiles, |at| Some(corners[at as usize]));
        assert_eq!(bunches.is_level, is_level);
        assert!(bunches.count > 300 && bunches.count < count as usize, "{}", bunches.count);
        let lists = TileLists::new(TILES, TILES, &tiles);
        let mut points = LensPoints::default();
        let mut told = |level: SimdLevel, pattern: &Pattern, tile: (u32, u32)| {
            let mut cursor = Cursor::default();
            assert_eq!(points.set(pattern), pattern.batches.len() == 5);
            std::iter::from_fn(|| {
                let next = points.next(level.level(), (&lists, &bunches), tile, &mut cursor);
                next.map(|(place, points)| (place, points.to_vec()))
            })
            .collect::<Vec<_>>()
        };
        let too_many = Pattern { batches: vec![Batch::of_cell(0); LensPoints::MOST + 1], ..pattern.clone() };
        let levels: Vec<SimdLevel> =
            SimdLevel::ALL.into_iter().filter(|level| level.is_available()).collect();
        let (mut seen, mut kept) = (0, 0);
        for tile in (0..TILES).flat_map(|y| (0..TILES).map(move |x| (x, y))) {
            let found = told(SimdLevel::Scalar, &pattern, tile);
            assert!(found.is_sorted_by_key(|(place, _)| *place));
            assert!(levels.iter().all(|&level| told(level, &pattern, tile) == found), "levels differ");
            // Where they are not told apart no triangle is left out either.
            let any = told(SimdLevel::Scalar, &too_many, tile);
            assert!(found.iter().all(|(place, _)| any.contains(&(*place, Vec::new()))), "{tile:?}");
            for (at, corners) in corners.iter().enumerate() {
                let points = found.iter().find(|(place, _)| *place as usize == at);
                let points = points.map_or(&[0; 2][..], |(_, points)| points);
                if tiles[at].count() > 0 {
                    // From anywhere.
                    assert_eq!(points, [0xfffe_fffe_fffe_fffe, 0xfffe], "{at} is not loose");
                    continue;
                }
                kept += points[0].count_ones() + points[1].count_ones();
                for (number, batch) in pattern.batches.iter().enumerate() {
                    for lane in 1..LANES {
                        let sees = sees(view, corners, (batch.u[lane], batch.v[lane]), tile);
                        let is_kept = points[number / 4] >> (LANES * (number % 4) + lane) & 1 == 1;
                        assert!(!sees || is_kept, "tile {tile:?}, batch {number}, lens point {lane}");
                        seen += u32::from(sees);
                    }
                }
            }
        }
        assert!(seen > 1000, "{seen}");
        assert!(kept < most * seen, "{kept} kept, {seen} seen");
    }

    /// Whether a lens point may see a triangle in a tile, by the box of what it sees.
    fn sees(view: &View, corners: &[DVec3; 3], (u, v): (f32, f32), tile: (u32, u32)) -> bool {
        let images = corners.map(|corner| {
            let row = |row: usize| {
                let [c0, cu, cv] = &view.pixel_from_lens;
                (c0[row] + cu[row] * f64::from(u) + cv[row] * f64::from(v)).dot(corner.extend(1.0))
            };
            [row(0) / row(2), row(1) / row(2)]
        });
        [(0, tile.0), (1, tile.1)].into_iter().all(|(axis, tile)| {
            let low = images.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min);
            let high = images.iter().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max);
            let start = f64::from(tile * TILE);
            low <= start + f64::from(TILE) && high >= start
        })
    }
}
