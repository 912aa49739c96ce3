//! The lens points of a tile, and which of them see a small triangle far out of focus ([`super::loose`]) there: one or two, or none.
//!
//! In: a tile's samples, and the triangles that are listed with it ([`super::lists`]). Out: those that a lens point may see, nearest
//! first, each with these lens points as bits, for [`super::bin`]. The lens points that see a triangle in the tile lie in a rectangle:
//! for each axis a table holds the lens points before each of 255 places, so two look-ups an axis are all that is asked. Rectangles
//! are made for 16 triangles at once.
//!
//! The middle of a triangle, seen through the lens centre at `x_1`, `y_1`, is seen at `a`, `b` from the lens point `t / (1 - p.t)` with
//! `t = g^-1 (a - x_1, b - y_1)`, in the terms of [`super::loose`]. With `a` and `b` the tile, widened by the triangle's reach, that is a
//! rectangle about the tile's middle.

use super::lists::{Cursor, TileLists};
use super::loose::{Loose, LooseTriangles, Tilt};
use super::view::Pattern;
use super::{LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, f32x16, mask32x16};

/// Places along an axis of the lens that are told apart.
const STEPS: usize = 255;

/// For each place along an axis the lens points before it, 64 to a word.
type Before = [u64; 256];

/// See the module.
#[derive(Default)]
pub(super) struct LensPoints {
    /// For each axis, word by word.
    before: [Vec<Before>; 2],
    /// Places of triangles that are looked at together.
    listed: Vec<u32>,
    /// Of those the ones that are seen, in order, each with where its words begin.
    seen: Vec<(u32, u32)>,
    points: Vec<u64>,
    /// How many of them were taken.
    taken: usize,
}

impl LensPoints {
    /// Batches that there is room for.
    const MOST: usize = 64;

    /// Takes the lens points of `pattern`; tells whether there is room for all of its batches.
    pub(super) fn set(&mut self, pattern: &Pattern) -> bool {
        if pattern.batches.len() > Self::MOST {
            return false;
        }
        self.seen.clear();
        self.taken = 0;
        for before in &mut self.before {
            before.clear();
            before.resize(pattern.batches.len().div_ceil(4), [0; 256]);
        }
        for (number, batch) in pattern.batches.iter().enumerate() {
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
        true
    }

    /// Words of lens points, 64 each, those of four batches.
    pub(super) fn words(&self) -> usize {
        self.before[0].len()
    }

    /// The place of the next triangle that a lens point may see in `tile`, and which may.
    pub(super) fn next(
        &mut self,
        level: Level,
        (lists, loose): (&TileLists, &LooseTriangles),
        tile: (u32, u32),
        cursor: &mut Cursor,
    ) -> Option<(u32, &[u64])> {
        while self.taken == self.seen.len() {
            self.taken = 0;
            self.seen.clear();
            if !lists.some(tile, cursor, &mut self.listed) {
                return None;
            }
            at_level!(level, simd => find(simd, self, loose, tile));
            self.seen.sort_unstable();
        }
        let (place, first) = self.seen[self.taken];
        self.taken += 1;
        let first = first as usize;
        Some((place, &self.points[first..first + self.words()]))
    }
}

/// Finds those of the listed triangles that are seen.
#[inline(always)]
fn find<S: Simd>(simd: S, lens: &mut LensPoints, loose: &LooseTriangles, tile: (u32, u32)) {
    let LensPoints { before: [across, down], listed, seen, points, .. } = lens;
    let words = across.len();
    // One in ten is seen, which no branch foresees: what is not is written over by the next.
    seen.resize(listed.len(), (0, 0));
    points.resize(words * listed.len(), 0);
    let mut count = 0;
    for sixteen in listed.chunks(LANES) {
        let mut rows = [[0.0; LANES]; 6];
        let [x, y, ux, vy, reach_x, reach_y] = &mut rows;
        for (lane, &place) in sixteen.iter().enumerate() {
            let Loose { place, per_pixel, reach } =
                loose.each.get(place as usize).unwrap_or(&Loose::SEEN_BY_ALL);
            (x[lane], y[lane]) = (place[0], place[1]);
            (ux[lane], vy[lane]) = (per_pixel[0], per_pixel[1]);
            (reach_x[lane], reach_y[lane]) = (reach[0], reach[1]);
        }
        let [left, right, top, bottom] = if loose.tilts.is_empty() {
            level(simd, &rows, tile)
        } else {
            let mut tilts = [[0.0; LANES]; 4];
            let [uy, vx, pu, pv] = &mut tilts;
            for (lane, &place) in sixteen.iter().enumerate() {
                let Tilt { across, p } = loose.tilts.get(place as usize).copied().unwrap_or_default();
                (uy[lane], vx[lane], pu[lane], pv[lane]) = (across[0], across[1], p[0], p[1]);
            }
            tilted(simd, &rows, &tilts, tile)
        };
        for (lane, &place) in sixteen.iter().enumerate() {
            let [left, right] = [left[lane], right[lane]].map(|at| usize::from(at as u8));
            let [top, bottom] = [top[lane], bottom[lane]].map(|at| usize::from(at as u8));
            let (first, mut any) = (count * words, 0);
            for ((across, down), out) in across.iter().zip(&*down).zip(&mut points[first..first + words]) {
                *out = across[right] & !across[left] & down[bottom] & !down[top];
                any |= *out;
            }
            seen[count] = (place, first as u32);
            count += usize::from(any != 0);
        }
    }
    seen.truncate(count);
}

/// From where the lens centre sees each of 16 triangles to the middle of a tile, and how far the tile goes from there, right and down.
#[inline(always)]
fn ways<S: Simd>(simd: S, rows: &[[f32; LANES]; 6], tile: (u32, u32)) -> [[f32x16<S>; 2]; 2] {
    let [x, y, _, _, reach_x, reach_y] = rows;
    let half = 0.5 * TILE as f32;
    let middle = f32x16::splat(simd, (tile.0 * TILE) as f32 + half);
    let dx = middle - f32x16::load_array_ref(simd, x);
    let middle = f32x16::splat(simd, (tile.1 * TILE) as f32 + half);
    let dy = middle - f32x16::load_array_ref(simd, y);
    let half_x = f32x16::load_array_ref(simd, reach_x) + half;
    [[dx, half_x], [dy, f32x16::load_array_ref(simd, reach_y) + half]]
}

/// The first and last places along both axes of the lens points that may see each of 16 triangles in a tile, where nothing is tilted.
#[inline(always)]
fn level<S: Simd>(simd: S, rows: &[[f32; LANES]; 6], tile: (u32, u32)) -> [[i32; LANES]; 4] {
    let [[dx, half_x], [dy, half_y]] = ways(simd, rows, tile);
    let (ux, vy) = (f32x16::load_array_ref(simd, &rows[2]), f32x16::load_array_ref(simd, &rows[3]));
    let (u, v) = (ux * dx, vy * dy);
    let (half_u, half_v) = (ux.abs() * half_x, vy.abs() * half_y);
    // What is not loose has no way.
    let is_known = ux.simd_ne(f32x16::splat(simd, 0.0));
    let [left, right] = steps(simd, is_known, u - half_u, u + half_u);
    let [top, bottom] = steps(simd, is_known, v - half_v, v + half_v);
    [left, right, top, bottom]
}

/// The same where the film leans or is turned.
#[inline(always)]
fn tilted<S: Simd>(
    simd: S,
    rows: &[[f32; LANES]; 6],
    tilts: &[[f32; LANES]; 4],
    tile: (u32, u32),
) -> [[i32; LANES]; 4] {
    let [[dx, half_x], [dy, half_y]] = ways(simd, rows, tile);
    let (ux, vy) = (f32x16::load_array_ref(simd, &rows[2]), f32x16::load_array_ref(simd, &rows[3]));
    let (uy, vx) = (f32x16::load_array_ref(simd, &tilts[0]), f32x16::load_array_ref(simd, &tilts[1]));
    let (pu, pv) = (f32x16::load_array_ref(simd, &tilts[2]), f32x16::load_array_ref(simd, &tilts[3]));
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
    let [left, right] = steps(simd, is_known, low_u, high_u);
    let [top, bottom] = steps(simd, is_known, low_v, high_v);
    [left, right, top, bottom]
}

/// The least `1 - p.t` that is not taken for nothing.
const LEAST: f32 = 0.01;

/// What rounding may do to a lens point, as a part of the lens.
const ROUNDING: f32 = 1e-4;

/// The first step that lens points from `low` to `high` lie in, and the one after the last.
#[inline(always)]
fn steps<S: Simd>(simd: S, is_known: mask32x16<S>, low: f32x16<S>, high: f32x16<S>) -> [[i32; LANES]; 2] {
    let (scale, one) = (0.5 * STEPS as f32, f32x16::splat(simd, 1.0));
    let (zero, last) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, STEPS as f32));
    let first = (low + (1.0 - ROUNDING)) * scale;
    let end = (high + (1.0 + ROUNDING)) * scale + one;
    let first = is_known.select(first.max(zero).min(last - one), zero);
    let end = is_known.select(end.max(zero).min(last), last);
    [simd.cvt_i32_f32x16(first.floor()).to_array(), simd.cvt_i32_f32x16(end.floor()).to_array()]
}

/// The step that a lens point's coordinate lies in, not rounded.
fn step(at: f32) -> f32 {
    (at + 1.0) * (0.5 * STEPS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::view::{Batch, View, test_view};
    use crate::simd::SimdLevel;
    use glam::{DVec3, DVec4};

    #[test]
    fn no_lens_point_that_sees_a_triangle_is_left_out() {
        let mut view = test_view();
        // Sixteen by sixteen tiles, a wide lens.
        (view.width, view.height) = (512, 512);
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

    /// And not `most` times as many.
    fn every_lens_point_is_kept(view: &View, is_level: bool, most: u32) {
        let mut random = Random(7);
        let batches = (0..5)
            .map(|_| {
                let mut batch = Batch { live: 0xfffe, ..Batch::of_cell(0) };
                for lane in 0..LANES {
                    let (sine, cosine) = libm::sincos(3.2 * random.signed());
                    let r = libm::sqrt(random.signed().abs());
                    (batch.u[lane], batch.v[lane]) = ((r * cosine) as f32, (r * sine) as f32);
                }
                batch
            })
            .collect();
        let pattern = Pattern { block_bits: [0; 2], batches };
        let mut points = LensPoints::default();
        assert!(points.set(&pattern));
        let each_level = SimdLevel::ALL.into_iter().filter(|level| level.is_available());
        let (mut looked, mut seen, mut kept) = (0, 0, 0);
        for _ in 0..300 {
            let z = 0.5 + 0.1 * random.signed();
            let middle = DVec3::new(z * random.signed(), z * random.signed(), z);
            let corners = [0; 3].map(|_| middle + 2e-3 * DVec3::from_array([0; 3].map(|_| random.signed())));
            let Some((loose, tilt)) = Loose::new(view, corners) else { continue };
            assert_eq!(tilt == Tilt::default(), is_level);
            looked += 1;
            for (tx, ty) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
                let mut found = each_level.clone().map(|level| {
                    // More than sixteen at once.
                    points.listed = (0..20).collect();
                    let mut each = LooseTriangles { each: vec![loose; 20], tilts: vec![tilt; 20] };
                    for at in [0, 19] {
                        (each.each[at], each.tilts[at]) = (Loose::SEEN_BY_ALL, Tilt::default());
                    }
                    if is_level {
                        each.tilts.clear();
                    }
                    at_level!(level.level(), simd => find(simd, &mut points, &each, (tx, ty)));
                    let LensPoints { seen, points, .. } = &points;
                    let all = |at: usize| points[seen[at].1 as usize..][..2].to_vec();
                    let last = seen.len() - 1;
                    assert_eq!([all(0), all(last)], [[0xfffe_fffe_fffe_fffe, 0xfffe]; 2]);
                    assert_eq!([seen[0].0, seen[last].0], [0, 19]);
                    // All others are alike.
                    assert!([1, 19].contains(&last) && (1..last).all(|at| all(at) == all(1)), "{last}");
                    if last == 19 { all(1) } else { vec![0; 2] }
                });
                let first = found.next().expect("every machine has the plain level");
                assert!(found.all(|other| other == first), "levels differ");
                kept += first[0].count_ones() + first[1].count_ones();
                for (number, batch) in pattern.batches.iter().enumerate() {
                    for lane in 1..LANES {
                        let images = corners.map(|corner| {
                            let (u, v) = (f64::from(batch.u[lane]), f64::from(batch.v[lane]));
                            let row = |row: usize| {
                                let [c0, cu, cv] = &view.pixel_from_lens;
                                (c0[row] + cu[row] * u + cv[row] * v).dot(corner.extend(1.0))
                            };
                            [row(0) / row(2), row(1) / row(2)]
                        });
                        let sees = [(0, tx), (1, ty)].into_iter().all(|(axis, tile)| {
                            let low = images.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min);
                            let high = images.iter().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max);
                            let start = f64::from(tile * TILE);
                            low <= start + f64::from(TILE) && high >= start
                        });
                        let is_kept = first[number / 4] >> (LANES * (number % 4) + lane) & 1 == 1;
                        assert!(!sees || is_kept, "tile {tx} {ty}, batch {number}, lens point {lane}");
                        seen += u32::from(sees);
                    }
                }
            }
        }
        assert!(looked > 100 && seen > 1000, "{looked} {seen}");
        assert!(kept < most * seen, "{kept} kept, {seen} seen");
    }
}
