//! Triangle set-up: edge functions and depth of 16 triangles about the centre of one tile.
//!
//! In: corners in the lens frame ([`super::waiting`]). Out: a [`SetUp`], for [`super::kernel`]: nine coefficients for each edge,
//! of `e = q_w s.m - p.m + s.(d x p)`, `m = va x vb`, `d = vb - va` ([`super::film`]), and those of `D.N` and `N.(v0 - s)`, whose
//! quotient is `1/t`, with `N = (v1 - v0) x (v2 - v0)`. Left out is what has an edge with `side e_1 + reach < 0`, `e_1` being its
//! value at the centres of tile and lens, `reach` the most that its other eight coefficients add, and `side` the sign of
//! `N.(v0 - s)`: it misses the whole tile, for every lens point.
//!
//! In double precision relative to the tile's centre, kept in single: the constants are then small wherever the sign is in doubt,
//! and an edge's place is good to about 1e-5 of a pixel.

use super::LANES;
use super::film::{ROUNDING, TileFilm};
use super::vertex_boxes::affine;
use crate::simd::at_level;
use fearless_simd::{Bytes, Level, Select, Simd, SimdBase, SimdMask, SimdNarrow, f32x16, f64x8, u32x16};

/// A function bilinear in lens point (1, u, v) and place in the tile (1, x, y): coefficients of
/// `1, u, v, x, xu, xv, y, yu, yv`; `x`, `y` in pixels from the tile's centre. For 16 triangles.
pub(crate) type Bilinear = [[f32; LANES]; 9];

/// One corner of each of 16 triangles, lens frame: axis, triangle.
pub(crate) type Corner = [[f64; LANES]; 3];

/// Corners of 16 triangles: corner, axis, triangle.
pub(crate) type Corners = [Corner; 3];

/// One corner of each of 16 triangles on the film, `x w`, `y w` and `w` as coefficients of `1, u, v`; pixels from the tile's centre.
pub(crate) type Image = [[[f32; LANES]; 3]; 3];

/// Their three corners.
pub(crate) type Images = [Image; 3];

/// Sixteen triangles in one tile, or quads: convex and plane, with a fourth corner.
#[derive(Clone, Debug)]
pub(crate) struct SetUp {
    /// The triangles' numbers.
    pub triangles: [u32; LANES],
    /// What is written where they are seen.
    pub ids: [u32; LANES],
    /// Edge `i` lies opposite to corner `i`, of a quad the second leads from the fourth corner to the first. Each edge has a scale of
    /// its own: its sign is what counts.
    pub edges: [Bilinear; 3],
    /// From the third corner of a quad to its fourth; where any is one.
    pub last_edge: Bilinear,
    /// `D.N`.
    pub facing: Bilinear,
    /// `N.(v0 - s)`: coefficients of `1, u, v`. Depth is ordered by `1/t = facing / plane`.
    pub plane: [[f32; LANES]; 3],
    pub corners: Images,
    /// The fourth corner, where any is a quad.
    pub fourth: Image,
    /// At least the largest `1/t` anywhere in the tile, for any lens point.
    pub most_inverse: [f32; LANES],
    /// Triangles, the first in the lowest bit, that may touch the tile.
    pub may_touch: u16,
    /// Those whose corners have an image for every lens point, well placed in single precision.
    pub imaged: u16,
    /// Those that may come nearer than the near plane, whose `1/t` is then checked at each sample.
    pub near: u16,
    /// Those that samples may pass through.
    pub cutout: u16,
    /// Those that are quads, neither of the last two kinds.
    pub quads: u16,
}

impl SetUp {
    pub(crate) const EMPTY: Self = Self {
        triangles: [0; LANES],
        ids: [0; LANES],
        edges: [[[0.0; LANES]; 9]; 3],
        last_edge: [[0.0; LANES]; 9],
        facing: [[0.0; LANES]; 9],
        plane: [[0.0; LANES]; 3],
        corners: [[[[0.0; LANES]; 3]; 3]; 3],
        fourth: [[[0.0; LANES]; 3]; 3],
        most_inverse: [0.0; LANES],
        may_touch: 0,
        imaged: 0,
        near: 0,
        cutout: 0,
        quads: 0,
    };
}

impl TileFilm {
    /// Sets up triangles with these corners, and a fourth where any is a quad (of triangles the third once more); `least_z` are the depths
    /// of their nearest corners. All but names and flags of what is `made` is written; of `imaged` those are left whose corners single
    /// precision places well. Those that miss the tile for every lens point, as their edges show, may not touch it.
    pub(crate) fn set_up(
        &self,
        level: Level,
        v: (&Corners, Option<&Corner>),
        least_z: &[f32; LANES],
        made: &mut SetUp,
    ) {
        at_level!(level, simd => set_up(simd, self, v, least_z, made));
    }
}

#[inline(always)]
fn set_up<S: Simd>(
    simd: S,
    film: &TileFilm,
    (v, fourth): (&Corners, Option<&Corner>),
    least_z: &[f32; LANES],
    made: &mut SetUp,
) {
    let (low, high) = (corners(simd, v, 0), corners(simd, v, 8));
    let (low_face, high_face) = (Face::new(simd, film, &low), Face::new(simd, film, &high));
    let (low_side, high_side) = (low_face.side(simd), high_face.side(simd));
    store(&low_face.facing, &high_face.facing, &mut made.facing);
    store(&low_face.plane, &high_face.plane, &mut made.plane);
    let (low_near, high_near) =
        (low_face.most_inverse(simd, film, low_side), high_face.most_inverse(simd, film, high_side));
    low_near.narrow(high_near).store_array(&mut made.most_inverse);
    // No part of a triangle is nearer than its nearest corner.
    for (most_inverse, &z) in made.most_inverse.iter_mut().zip(least_z) {
        *most_inverse = (ROUNDING * *most_inverse).min(film.most_inverse_beyond(z));
    }

    let (mut low_last, mut high_last) = (low[2], high[2]);
    if let Some(fourth) = fourth {
        (low_last, high_last) = (corner(simd, fourth, 0), corner(simd, fourth, 8));
    }
    let mut live = 0xffff;
    let [opposite, across, first] = &mut made.edges;
    let sides = (low_side, high_side);
    live &= edge(simd, film, ([low[1], low[2]], [high[1], high[2]]), sides, opposite);
    live &= edge(simd, film, ([low_last, low[0]], [high_last, high[0]]), sides, across);
    live &= edge(simd, film, ([low[0], low[1]], [high[0], high[1]]), sides, first);
    made.imaged &= images(simd, film, (&low, &high), &mut made.corners);
    if fourth.is_some() {
        live &= edge(simd, film, ([low[2], low_last], [high[2], high_last]), sides, &mut made.last_edge);
        let out = std::array::from_mut(&mut made.fourth);
        made.imaged &= images(simd, film, (&[low_last], &[high_last]), out);
    }
    made.may_touch = live;
}

/// The functions of sixteen edges, each between two corners; tells which may leave something of their triangles in the tile.
#[inline(always)]
fn edge<S: Simd>(
    simd: S,
    film: &TileFilm,
    (low, high): (Ends<S>, Ends<S>),
    sides: (f64x8<S>, f64x8<S>),
    out: &mut Bilinear,
) -> u16 {
    let (low, high) = (film.edge(low[0], low[1]), film.edge(high[0], high[1]));
    store(&scaled(simd, film, &low), &scaled(simd, film, &high), out);
    reaches(simd, film, &low, sides.0) | reaches(simd, film, &high, sides.1) << 8
}

/// Where eight edges begin and end.
type Ends<S> = [Places<S>; 2];

/// Where corners lie on the film. Tells which triangles' single precision places as well as [`super::scatter`] assumes.
#[inline(always)]
pub(super) fn images<S: Simd, const N: usize>(
    simd: S,
    film: &TileFilm,
    (low, high): (&[Places<S>; N], &[Places<S>; N]),
    out: &mut [Image; N],
) -> u16 {
    for (corner, images) in out.iter_mut().enumerate() {
        for (row, image) in images.iter_mut().enumerate() {
            for (part, out) in image.iter_mut().enumerate() {
                let h = &film.image[part][row];
                affine(h, &low[corner]).narrow(affine(h, &high[corner])).store_array(out);
            }
        }
    }
    let mut placed = 0xffff;
    for [x, y, w] in &*out {
        let least = f32x16::load_array_ref(simd, &w[0]) - largest(simd, [&w[1], &w[2]]);
        let at = f32x16::load_array_ref(simd, &x[0]).abs().max(f32x16::load_array_ref(simd, &y[0]).abs());
        let moved = largest(simd, [&x[1], &x[2]]).max(largest(simd, [&y[1], &y[2]]));
        placed &= (at + moved).simd_le(least * FARTHEST).to_bitmask() as u16;
    }
    placed
}

/// Farther than this from the tile's centre, pixels, roundings may misplace a corner by more than
/// [`MARGIN`](super::scatter::MARGIN) foresees, also where a lens point moves it back into the tile: far out of focus its place is
/// a difference of large numbers.
const FARTHEST: f32 = 4000.0;

/// The most that two parts can add, the lens point being no farther than 1 from the centre along each.
#[inline(always)]
fn largest<S: Simd>(simd: S, [u, v]: [&[f32; LANES]; 2]) -> f32x16<S> {
    f32x16::load_array_ref(simd, u).abs() + f32x16::load_array_ref(simd, v).abs()
}

/// Corners of eight triangles: corner, axis.
pub(super) type Eight<S> = [Places<S>; 3];

/// One corner of eight triangles: axis.
pub(super) type Places<S> = [f64x8<S>; 3];

#[inline(always)]
pub(super) fn corners<S: Simd>(simd: S, v: &Corners, first: usize) -> Eight<S> {
    [corner(simd, &v[0], first), corner(simd, &v[1], first), corner(simd, &v[2], first)]
}

/// One corner of eight.
#[inline(always)]
pub(super) fn corner<S: Simd>(simd: S, v: &Corner, first: usize) -> Places<S> {
    let [x, y, z] = v;
    [
        f64x8::from_slice(simd, &x[first..first + 8]),
        f64x8::from_slice(simd, &y[first..first + 8]),
        f64x8::from_slice(simd, &z[first..first + 8]),
    ]
}

#[inline(always)]
fn store<S: Simd, const N: usize>(low: &[f64x8<S>; N], high: &[f64x8<S>; N], out: &mut [[f32; LANES]; N]) {
    for ((low, high), out) in low.iter().zip(high).zip(out) {
        low.narrow(*high).store_array(out);
    }
}

/// Planes of eight triangles: `D.N` and `N.(v0 - s)`, by a common power of two.
struct Face<S: Simd> {
    facing: [f64x8<S>; 9],
    plane: [f64x8<S>; 3],
}

impl<S: Simd> Face<S> {
    #[inline(always)]
    fn new(simd: S, film: &TileFilm, v: &Eight<S>) -> Self {
        let (mut facing, mut plane) = film.face(v, f64x8::splat(simd, 0.0));
        let scale = power_of_two(simd, plane[0].abs() + plane[1].abs() + plane[2].abs());
        for c in facing.iter_mut().chain(&mut plane) {
            *c *= scale;
        }
        Self { facing, plane }
    }

    /// The sign of `N.(v0 - s)` where it is the same for all of the lens, 1 where the normal points away from it; else 0.
    #[inline(always)]
    fn side(&self, simd: S) -> f64x8<S> {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let swing = self.plane[1].abs() + self.plane[2].abs();
        let back = (-self.plane[0]).simd_gt(swing).select(-one, zero);
        self.plane[0].simd_gt(swing).select(one, back)
    }

    /// At least the largest `1/t` in the tile.
    #[inline(always)]
    fn most_inverse(&self, simd: S, film: &TileFilm, side: f64x8<S>) -> f64x8<S> {
        let infinite = f64x8::splat(simd, f64::INFINITY);
        let reach = reach(film, &self.facing);
        let least = self.plane[0].abs() - self.plane[1].abs() - self.plane[2].abs();
        // Single precision loses a few millionths of what cancels.
        let most = self.facing[0] * side + reach + (self.facing[0].abs() + reach) * 4e-6;
        let most_inverse = most / least;
        (side.abs() * least).simd_gt(f64x8::splat(simd, 0.0)).select(most_inverse, infinite)
    }
}

/// Which of eight edge functions are anywhere in the tile, for any lens point, not negative; all where the side is
/// in doubt.
#[inline(always)]
fn reaches<S: Simd>(simd: S, film: &TileFilm, e: &[f64x8<S>; 9], side: f64x8<S>) -> u16 {
    let most = e[0] * side + reach(film, e) * (1.0 + 1e-6);
    let outside = most.simd_lt(f64x8::splat(simd, 0.0)) & side.simd_ne(f64x8::splat(simd, 0.0));
    !(outside.to_bitmask() as u16) & 0xff
}

/// How far a function can be from its value at tile centre and lens centre.
#[inline(always)]
fn reach<S: Simd>(film: &TileFilm, e: &[f64x8<S>; 9]) -> f64x8<S> {
    let right = e[3].abs() + e[4].abs() + e[5].abs();
    let down = e[6].abs() + e[7].abs() + e[8].abs();
    e[1].abs() + e[2].abs() + (right * film.half[0] + down * film.half[1])
}

/// Eight functions, each by a power of two that keeps it away from the ends of single precision.
#[inline(always)]
fn scaled<S: Simd>(simd: S, film: &TileFilm, e: &[f64x8<S>; 9]) -> [f64x8<S>; 9] {
    let scale = power_of_two(simd, e[0].abs() + reach(film, e));
    [
        e[0] * scale,
        e[1] * scale,
        e[2] * scale,
        e[3] * scale,
        e[4] * scale,
        e[5] * scale,
        e[6] * scale,
        e[7] * scale,
        e[8] * scale,
    ]
}

/// [`power_of_two_near`](super::film::power_of_two_near) for eight: of each number's upper half only the exponent counts.
#[inline(always)]
fn power_of_two<S: Simd>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let upper = |half: u32| u32x16::load_array(simd, std::array::from_fn(|i| half * (i as u32 % 2)));
    let exponent = x.bitcast::<u32x16<S>>() & upper(0x7ff << 20);
    let last = upper(2046 << 20);
    let alone = exponent.simd_eq(u32x16::splat(simd, 0)) | exponent.simd_ge(u32x16::splat(simd, 2046 << 20));
    alone.select(upper(1023 << 20), last - exponent).bitcast()
}

/// What tests of set-up and of what goes before it share.
#[cfg(test)]
pub(super) mod testing {
    use super::*;

    /// Sixteen triangles of about `size`, from 0.2 to 2.2 m before the lens, in and around the view of a test's tile.
    pub(in crate::raster) fn triangles(size: f64, random: &mut dyn FnMut() -> f64) -> Corners {
        let mut v: Corners = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            let z = 1.2 + random();
            let middle = [0.2 * z * random(), 0.2 * z * random(), z];
            for corner in &mut v {
                for axis in 0..3 {
                    corner[axis][lane] = middle[axis] + size * random();
                }
            }
        }
        v
    }

    /// The three edge functions of a triangle.
    pub(in crate::raster) fn edges(film: &TileFilm, v: &Corners, lane: usize) -> [[f64; 9]; 3] {
        let c = v.map(|corner| corner.map(|axis| axis[lane]));
        [film.edge(c[1], c[2]), film.edge(c[2], c[0]), film.edge(c[0], c[1])]
    }

    /// A function at lens point (u, v) and place (x, y).
    pub(in crate::raster) fn at(e: &[f64; 9], [u, v, x, y]: [f64; 4]) -> f64 {
        let part = |i: usize| e[i] + e[i + 1] * u + e[i + 2] * v;
        part(0) + part(3) * x + part(6) * y
    }
}

#[cfg(test)]
mod tests {
    use super::testing::{at, edges, triangles};
    use super::*;
    use crate::random::Random;
    use crate::raster::film::{cross, minus, power_of_two_near};
    use crate::raster::scatter::MARGIN;
    use crate::raster::view::{test_view, test_view_through};
    use crate::simd::SimdLevel;

    #[test]
    fn eight_powers_of_two_are_those_of_each() {
        let each = [0.0, 1e-310, f64::MIN_POSITIVE, 0.7, 1.0, 1.999e9, f64::MAX, f64::INFINITY];
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            let found = at_level!(level.level(), simd => {
                power_of_two(simd, f64x8::load_array(simd, each)).to_array()
            });
            assert_eq!(found, each.map(power_of_two_near), "{}", level.name());
        }
        assert_eq!(power_of_two_near(1.999e9) * 1.999e9, 1.999e9 / f64::from(1 << 30));
    }

    /// Triangles that some lens point sees in the tile, through lenses of up to 2 km: blur of up to a million pixels.
    #[test]
    fn corners_that_are_imaged_are_where_single_precision_says() {
        let mut numbers = Random(8);
        let (mut imaged, mut misplaced) = (0, 0);
        for round in 0..60 {
            let radius = [0.02, 2.0, 2000.0][round % 3];
            let film = TileFilm::new(&test_view_through(radius), 0, 0);
            let mut v = triangles(0.01, &mut || numbers.signed());
            // What lies at 2.1 m is in focus.
            let lens = numbers.signed();
            for x in v.iter_mut().map(|corner| corner.split_at_mut(2)) {
                for (x, z) in x.0[0].iter_mut().zip(&x.1[0]) {
                    *x += lens * radius * (1.0 - z / 2.1);
                }
            }
            let mut made = SetUp { imaged: 0xffff, ..SetUp::EMPTY };
            film.set_up(SimdLevel::best().level(), (&v, None), &[0.0; LANES], &mut made);
            let lens = lens as f32;
            for (lane, corner) in (0..LANES).flat_map(|lane| (0..3).map(move |corner| (lane, corner))) {
                let part = |row: usize, part: usize| {
                    let h = film.image[part][row];
                    let [x, y, z] = v[corner].map(|axis| axis[lane]);
                    x * h.x + y * h.y + z * h.z + h.w
                };
                let exact = (part(0, 0) + f64::from(lens) * part(0, 1)) / part(2, 0);
                let [x, _, w] = &made.corners[corner];
                // As `scatter` does.
                let single = (lens * x[1][lane] + x[0][lane]) * (1.0 / w[0][lane]);
                let error = (f64::from(single) - exact).abs();
                let is_imaged = made.imaged >> lane & 1 == 1;
                imaged += u32::from(is_imaged);
                misplaced += u32::from(error > f64::from(MARGIN));
                assert!(!is_imaged || error < f64::from(MARGIN), "{error} px");
            }
        }
        assert!(imaged > 1000 && misplaced > 100, "{imaged} {misplaced}");
    }

    #[test]
    fn what_is_passed_over_misses_the_tile_and_nothing_is_nearer_than_said() {
        let film = TileFilm::new(&test_view(), 0, 0);
        let mut numbers = Random(5);
        let mut random = || numbers.signed();
        let (mut missed, mut met) = (0, 0);
        for round in 0..40 {
            let size = [1.0, 0.1, 0.01][round % 3];
            let v = triangles(size, &mut random);
            let mut least_z = [0.0; LANES];
            for lane in 0..LANES {
                least_z[lane] = v.iter().map(|c| c[2][lane]).fold(f64::INFINITY, f64::min).max(0.0) as f32;
            }
            let mut made = SetUp::EMPTY;
            film.set_up(SimdLevel::best().level(), (&v, None), &least_z, &mut made);
            for lane in 0..LANES {
                let c = [0, 1, 2].map(|i| [0, 1, 2].map(|axis| v[i][axis][lane]));
                let edges = edges(&film, &v, lane);
                let n = cross(minus(c[1], c[0]), minus(c[2], c[0]));
                for _ in 0..200 {
                    let angle = 3.2 * random();
                    let (sine, cosine) = libm::sincos(angle);
                    let (u, v, x, y) = (cosine, sine, 16.0 * random(), 16.0 * random());
                    let at = |e: &[f64; 9]| at(e, [u, v, x, y]);
                    let s = [film.radius * u, film.radius * v, 0.0];
                    let side: f64 = (0..3).map(|i| n[i] * (c[0][i] - s[i])).sum();
                    let inverse = at(&film.bilinear(n, [0.0; 3])) / side;
                    if !edges.iter().all(|e| at(e) * side >= 0.0) || inverse <= 0.0 {
                        continue;
                    }
                    met += 1;
                    assert!(made.may_touch >> lane & 1 == 1, "passed over, and met at {u} {v} {x} {y}");
                    assert!(
                        inverse <= f64::from(made.most_inverse[lane]),
                        "{inverse} {}",
                        made.most_inverse[lane]
                    );
                }
                missed += u32::from(made.may_touch >> lane & 1 == 0);
            }
        }
        assert!(missed > 100 && met > 1000, "{missed} {met}");
    }
}
