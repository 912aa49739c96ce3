//! The lens points of a tile, and the triangles that they see: those far out of focus most of a tile's do not ([`super::loose`]).
//!
//! In: a tile's samples, and the triangles that are listed with it ([`super::lists`]). Out: those that a lens point may see, nearest
//! first, each with these lens points as bits, for [`super::bin`]. A lens point sees a triangle in the tile where it lies in a
//! rectangle: for each axis a table holds the lens points before each of 128 places, so two look-ups an axis are all that is asked. The
//! rectangles are made for 16 triangles at once.

use super::lists::{Cursor, TileLists};
use super::loose::Loose;
use super::view::Pattern;
use super::{LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Level, Simd, SimdBase, SimdFloat, f32x16};

/// Places along an axis of the lens that are told apart.
const STEPS: usize = 128;

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
        (lists, loose): (&TileLists, &[Loose]),
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
fn find<S: Simd>(simd: S, lens: &mut LensPoints, loose: &[Loose], tile: (u32, u32)) {
    let LensPoints { before: [across, down], listed, seen, points, .. } = lens;
    let words = across.len();
    // One in ten is seen, which no branch foresees: what is not is written over by the next.
    seen.resize(listed.len(), (0, 0));
    points.resize(words * listed.len(), 0);
    let mut count = 0;
    for sixteen in listed.chunks(LANES) {
        let mut axes = [[[0.0; LANES]; 3]; 2];
        for (lane, &place) in sixteen.iter().enumerate() {
            let loose = loose.get(place as usize).unwrap_or(&Loose::SEEN_BY_ALL);
            for (rows, axis) in axes.iter_mut().zip(&loose.axes) {
                rows[0][lane] = axis.at_zero;
                rows[1][lane] = axis.per_pixel;
                rows[2][lane] = axis.reach;
            }
        }
        let (left, right) = range(simd, &axes[0], tile.0);
        let (top, bottom) = range(simd, &axes[1], tile.1);
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

/// The first and last place of 16 rectangles along an axis, where the tile is the `tile`-th.
#[inline(always)]
fn range<S: Simd>(
    simd: S,
    [at_zero, per_pixel, reach]: &[[f32; LANES]; 3],
    tile: u32,
) -> ([i32; LANES], [i32; LANES]) {
    let half = 0.5 * TILE as f32;
    let at_zero = f32x16::load_array_ref(simd, at_zero);
    let per_pixel = f32x16::load_array_ref(simd, per_pixel);
    let reach = f32x16::load_array_ref(simd, reach) + per_pixel.abs() * half;
    let middle = at_zero + per_pixel * ((tile * TILE) as f32 + half);
    let (scale, one) = (0.5 * STEPS as f32, f32x16::splat(simd, 1.0));
    let zero = f32x16::splat(simd, 0.0);
    let last = f32x16::splat(simd, STEPS as f32);
    let first = ((middle - reach + one) * scale).max(zero).min(last - one);
    let end = ((middle + reach + one) * scale + one).max(zero).min(last);
    (simd.cvt_i32_f32x16(first.floor()).to_array(), simd.cvt_i32_f32x16(end.floor()).to_array())
}

/// The step that a lens point's coordinate lies in, not rounded.
fn step(at: f32) -> f32 {
    (at + 1.0) * (0.5 * STEPS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::view::{Batch, test_view};
    use crate::simd::SimdLevel;
    use glam::DVec3;

    #[test]
    fn no_lens_point_that_sees_a_triangle_is_left_out() {
        let mut view = test_view();
        // Sixteen by sixteen tiles, a wide lens, and a film that leans: w changes with the lens point.
        (view.width, view.height) = (512, 512);
        view.pixel_from_lens[1][0] *= 20.0;
        view.pixel_from_lens[2][1] *= -25.0;
        view.pixel_from_lens[1][2] = glam::DVec4::new(0.0, 0.0, 0.04, -0.03);
        view.pixel_from_lens[2][2] = glam::DVec4::new(0.0, 0.0, -0.02, 0.05);
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
            let Some(loose) = Loose::new(&view, corners) else { continue };
            looked += 1;
            for (tx, ty) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
                let mut found = each_level.clone().map(|level| {
                    points.listed = vec![0, 1, 2];
                    let loose = [Loose::SEEN_BY_ALL, loose, Loose::SEEN_BY_ALL];
                    at_level!(level.level(), simd => find(simd, &mut points, &loose, (tx, ty)));
                    let all = |at: usize| points.points[points.seen[at].1 as usize..][..2].to_vec();
                    let last = points.seen.len() - 1;
                    assert_eq!([all(0), all(last)], [[0xfffe_fffe_fffe_fffe, 0xfffe]; 2]);
                    assert_eq!([points.seen[0].0, points.seen[last].0], [0, 2]);
                    if last == 2 { all(1) } else { vec![0; 2] }
                });
                let first = found.next().unwrap();
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
        assert!(kept < 5 * seen, "{kept} kept, {seen} seen");
    }
}
