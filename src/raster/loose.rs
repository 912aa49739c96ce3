//! Small triangles far out of focus: the lens points from which a tile sees them.
//!
//! In: a triangle's corners, and a tile's lens points. Out: the batches that have a lens point from which the triangle's image
//! touches the tile; [`super::bin`] leaves out what has none. Sixty-four lens points see such a triangle in 64 places all over
//! its disk of confusion, so most of the tiles under the disk see it from none, and need not set it up.
//!
//! A corner's image moves with the lens point: `x(s) = x(0) + (g.s) w(0) / w(s)`, `g = (dx - x(0) dw) / w(0)`, in the
//! terms of [`super::bounds`]. So the images that touch a tile are those of lens points in a rectangle, which moves in
//! proportion to the tile's place.

use super::lists::Tiles;
use super::view::{Pattern, View};
use super::{LANES, TILE};
use glam::DVec3;
use rayon::prelude::*;

/// The least way, in pixels, that an image moves from one end of the lens to the other, for a triangle to be loose. At one
/// and a half tiles (the tower at f/1.2) it is as fast without.
const LEAST_BLUR: f64 = 3.0 * TILE as f64;

/// Along one axis of the lens, the middle of the lens points that see the triangle at pixel coordinate 0 of the same axis
/// of the picture, its change with a pixel, and how far from the middle they lie; fractions of the aperture's radius.
#[derive(Clone, Copy, Debug)]
struct Axis {
    at_zero: f32,
    per_pixel: f32,
    reach: f32,
}

/// A triangle whose image is small beside its way over the film.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loose {
    axes: [Axis; 2],
}

impl Loose {
    /// Stands for a triangle that is not loose.
    const SEEN_BY_ALL: Self = Self { axes: [Axis { at_zero: 0.0, per_pixel: 0.0, reach: f32::INFINITY }; 2] };

    /// None for a triangle that is not loose; all `corners` have to lie within the frustum.
    fn new(view: &View, corners: [DVec3; 3]) -> Option<Self> {
        let mut images = [[[0.0; 3]; 2]; 3];
        let mut swings = [0.0; 3];
        let [c0, cu, cv] = &view.pixel_from_lens;
        for ((axes, swing), corner) in images.iter_mut().zip(&mut swings).zip(corners) {
            let at = corner.extend(1.0);
            let [w, wu, wv] = [c0, cu, cv].map(|rows| rows[2].dot(at));
            let h = libm::hypot(wu, wv);
            // How far w(0) / w(s) may be from 1.
            *swing = if w > h { h / (w - h) } else { return None };
            for (row, image) in axes.iter_mut().enumerate() {
                let middle = c0[row].dot(at) / w;
                *image = [middle, (cu[row].dot(at) - middle * wu) / w, (cv[row].dot(at) - middle * wv) / w];
            }
        }
        let [x, y] = [0, 1].map(|row| {
            let own = 1 + row;
            let each = || images.iter().zip(&swings).map(|(axes, swing)| (axes[row], *swing));
            let middle = |part: usize| {
                let low = each().map(|(image, _)| image[part]).fold(f64::INFINITY, f64::min);
                let high = each().map(|(image, _)| image[part]).fold(f64::NEG_INFINITY, f64::max);
                0.5 * (low + high)
            };
            let (place, way) = (middle(0), middle(own));
            let reach = |(image, swing): ([f64; 3], f64)| {
                let across = image[3 - own].abs();
                let bend = swing * libm::hypot(image[1], image[2]);
                (image[0] - place).abs() + (image[own] - way).abs() + across + bend
            };
            let reach = each().map(reach).fold(0.0, f64::max);
            // As in `bounds`, and what the single precision of this file may lose.
            let most = f64::from(view.width.max(view.height)) + place.abs() + way.abs();
            let reach = reach + view.spread[row] + 2e-3 + 4e-6 * most;
            let is_loose = 2.0 * way.abs() >= LEAST_BLUR && 2.0 * reach <= way.abs();
            is_loose.then(|| Axis {
                at_zero: (-place / way) as f32,
                per_pixel: (1.0 / way) as f32,
                reach: (reach / way.abs()) as f32,
            })
        });
        Some(Self { axes: [x?, y?] })
    }
}

/// A triangle in fewer tiles is not taken for loose.
const FEW_TILES: u32 = 4;

/// One in so many candidates tells whether most of what the tiles list is loose.
const STRIDE: usize = 29;

/// The candidates in `order`, which touch `tiles`; none where most of what the tiles list is not loose. `corners` tells those
/// of a candidate within the frustum.
pub(super) fn find(
    view: &View,
    order: &[u32],
    tiles: &[Tiles],
    corners: impl Fn(u32) -> Option<[DVec3; 3]> + Sync,
) -> Vec<Loose> {
    let of = |at: usize| {
        let loose = (tiles[at].count() >= FEW_TILES).then(|| Loose::new(view, corners(order[at])?));
        loose.flatten()
    };
    // One in a few tells enough.
    let some = (0..order.len()).step_by(STRIDE);
    let (all, loose) = some.fold((0, 0), |(all, loose), at| {
        let count = u64::from(tiles[at].count());
        (all + count, loose + if of(at).is_some() { count } else { 0 })
    });
    if 2 * loose <= all {
        return Vec::new();
    }
    (0..order.len()).into_par_iter().map(|at| of(at).unwrap_or(Loose::SEEN_BY_ALL)).collect()
}

/// Places along an axis of the lens that are told apart.
const STEPS: usize = 128;

/// The lens points of a tile's batches, to look them up by place.
#[derive(Default)]
pub(super) struct LensPoints {
    /// Sets of 64 lens points, those of four batches each.
    words: usize,
    /// For each axis and place, the lens points before it, word by word.
    before: [Vec<u64>; 2],
}

impl LensPoints {
    /// Batches that a mask has room for.
    const MOST: usize = 64;

    /// Takes the lens points of `pattern`; tells whether there is room for all of its batches.
    pub(super) fn set(&mut self, pattern: &Pattern) -> bool {
        if pattern.batches.len() > Self::MOST {
            return false;
        }
        self.words = pattern.batches.len().div_ceil(4);
        for before in &mut self.before {
            before.clear();
            before.resize((STEPS + 1) * self.words, 0);
        }
        for (number, batch) in pattern.batches.iter().enumerate() {
            for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
                let bit = 1 << (number % 4 * LANES + lane);
                for (before, at) in self.before.iter_mut().zip([batch.u[lane], batch.v[lane]]) {
                    let step = (step(at).max(0.0) as usize).min(STEPS - 1);
                    before[(step + 1) * self.words + number / 4] |= bit;
                }
            }
        }
        for before in &mut self.before {
            for i in self.words..before.len() {
                before[i] |= before[i - self.words];
            }
        }
        true
    }

    /// The batches, the first in the lowest bit, with lens points that may see `loose` in tile `(x, y)`.
    #[inline]
    pub(super) fn seeing(&self, loose: &Loose, tile: (u32, u32)) -> u64 {
        let range = |axis: &Axis, tile: u32| {
            let half = 0.5 * TILE as f32;
            let middle = axis.at_zero + ((tile * TILE) as f32 + half) * axis.per_pixel;
            let reach = axis.reach + half * axis.per_pixel.abs();
            // Conversion saturates.
            let first = (step(middle - reach) as usize).min(STEPS - 1);
            let end = ((step(middle + reach) + 1.0) as usize).min(STEPS);
            (first * self.words, end * self.words)
        };
        let (left, right) = range(&loose.axes[0], tile.0);
        let (top, bottom) = range(&loose.axes[1], tile.1);
        let [across, down] = &self.before;
        let mut batches = 0;
        for word in 0..self.words {
            let columns = across[right + word] & !across[left + word];
            let points = columns & down[bottom + word] & !down[top + word];
            for batch in 0..4 {
                batches |= u64::from(points >> (LANES * batch) & 0xffff != 0) << (4 * word + batch);
            }
        }
        batches
    }
}

/// The step that a lens point's coordinate lies in, not rounded.
#[inline]
fn step(at: f32) -> f32 {
    (at + 1.0) * (0.5 * STEPS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::view::{Batch, test_view};

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
        let (mut looked, mut seen, mut kept) = (0, 0, 0);
        for _ in 0..300 {
            let z = 0.5 + 0.1 * random.signed();
            let middle = DVec3::new(z * random.signed(), z * random.signed(), z);
            let corners = [0; 3].map(|_| middle + 2e-3 * DVec3::from_array([0; 3].map(|_| random.signed())));
            let Some(loose) = Loose::new(&view, corners) else { continue };
            looked += 1;
            for (tx, ty) in (0..16).flat_map(|y| (0..16).map(move |x| (x, y))) {
                let found = points.seeing(&loose, (tx, ty));
                kept += found.count_ones();
                for (number, batch) in pattern.batches.iter().enumerate() {
                    let sees = (1..LANES).any(|lane| {
                        let images = corners.map(|corner| {
                            let (u, v) = (f64::from(batch.u[lane]), f64::from(batch.v[lane]));
                            let row = |row: usize| {
                                let [c0, cu, cv] = &view.pixel_from_lens;
                                (c0[row] + cu[row] * u + cv[row] * v).dot(corner.extend(1.0))
                            };
                            [row(0) / row(2), row(1) / row(2)]
                        });
                        [(0, tx), (1, ty)].into_iter().all(|(axis, tile)| {
                            let low = images.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min);
                            let high = images.iter().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max);
                            let start = f64::from(tile * TILE);
                            low <= start + f64::from(TILE) && high >= start
                        })
                    });
                    seen += u32::from(sees);
                    assert!(!sees || found >> number & 1 == 1, "tile {tx} {ty}, batch {number}");
                }
            }
        }
        assert!(looked > 100 && seen > 1000, "{looked} {seen}");
        assert!(kept < 3 * seen, "{kept} kept, {seen} seen");
    }
}
