//! The inner loop: one triangle for 16 samples at a time.
//!
//! In: the set-up of 16 triangles ([`super::setup`]) and a batch of 16 samples, which have a place in every block of the tile.
//! Out: what is seen ([`super::visibility`]). Triangles behind all that is seen are passed over, 16 in one comparison. For each
//! other, the functions are made for the 16 lens points; then [`super::regions`] draws block by block, or [`super::scatter`] lens
//! point by lens point, where that visits less than a sixth as many patches as there are blocks; what comes near or lets samples
//! through is for [`super::regions`], which can ask.
//!
//! Of the coefficients `e_1`, `e_u` and so on: `c = e_1 + u e_u + v e_v`, `cx = e_x + u e_xu + v e_xv`, `cy` likewise, and
//! `c0 = c + jx cx + jy cy` with the sample's place `jx`, `jy` in its block. Edges are multiplied by the sign of `N.(v0 - s)`,
//! and `D.N` is divided by it, which makes it `1/t`.
//!
//! One generic source for every SIMD level. Multiply and add stay apart: a fused product rounds
//! differently, and the same bytes are wanted at every level.

use super::batch::Batch;
use super::film::TileFilm;
use super::part::Spans;
use super::setup::{Bilinear, SetUp};
use super::visibility::Visibility;
use super::visit::{AlphaTest, Functions, Visit};
use super::{LANES, regions, scatter};
use crate::simd::at_level;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, f32x16, mask32x16};

/// Sixteen triangles to visit; `t` is which of them.
pub(crate) struct Visits<'a> {
    pub set_up: &'a SetUp,
    pub spans: &'a Spans,
    /// The lens points that may see each, where that was asked.
    pub points: Option<&'a [u16; LANES]>,
    pub film: &'a TileFilm,
    /// Width and height of a block of pixels.
    pub block_size: (u32, u32),
    /// The surfaces in the tile, each with the triangle that was met first.
    pub surfaces: &'a [u32],
}

/// Tests every triangle, in order, against `seen`.
pub(crate) fn cover(
    level: Level,
    batch: &Batch,
    visits: &Visits<'_>,
    seen: &mut Visibility,
    alpha_test: &AlphaTest<'_>,
) {
    // Compiled twice: what only loose triangles ask costs the others 2 % of all time.
    match visits.points {
        Some(points) => at_level!(level, simd => {
            cover_all::<_, true>(simd, batch, (visits, points), seen, alpha_test);
        }),
        None => at_level!(level, simd => {
            cover_all::<_, false>(simd, batch, (visits, &[u16::MAX; LANES]), seen, alpha_test);
        }),
    }
}

#[inline(always)]
fn cover_all<S: Simd, const LOOSE: bool>(
    simd: S,
    batch: &Batch,
    (visits, points): (&Visits<'_>, &[u16; LANES]),
    seen: &mut Visibility,
    alpha_test: &AlphaTest<'_>,
) {
    let floors = f32x16::load_array_ref(simd, &seen.floor);
    let live = mask32x16::from_bitmask(simd, u64::from(batch.live));
    let floor = live.select(floors, f32x16::splat(simd, f32::INFINITY)).reduce_min();
    let most_inverse = f32x16::load_array_ref(simd, &visits.set_up.most_inverse);
    // NaN is not behind anything.
    let hidden = most_inverse.simd_le(f32x16::splat(simd, floor)).to_bitmask() as u16;
    let mut rest = visits.set_up.may_touch & visits.spans.some & !hidden;
    let is_full = batch.live == u16::MAX;
    while rest != 0 {
        let t = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let blocks = visits.spans.blocks[t];
        let most_inverse = visits.set_up.most_inverse[t];
        let mut points = points[t];
        if LOOSE {
            points &= !(f32x16::splat(simd, most_inverse).simd_le(floors).to_bitmask() as u16);
            if points == 0 {
                continue;
            }
        }
        if seen.wants(blocks) && !(is_full && seen.hides_all(simd, blocks, most_inverse)) {
            cover_one::<_, LOOSE>(simd, batch, visits, (t, points), seen, alpha_test);
        }
    }
    // By it the next sixteen are chosen.
    seen.raise_floor(simd);
}

/// A bilinear function of triangle `t` for the 16 lens points, times `factor`: `c0` of the module, and its change with `x` and `y`. A
/// function and not a closure: closures do not inline into a SIMD context.
#[inline(always)]
fn at_lens<S: Simd>(simd: S, e: &Bilinear, t: usize, batch: &Batch, factor: f32x16<S>) -> [f32x16<S>; 3] {
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let jx = f32x16::load_array_ref(simd, &batch.x);
    let jy = f32x16::load_array_ref(simd, &batch.y);
    let c = u * e[1][t] + v * e[2][t] + e[0][t];
    let cx = u * e[4][t] + v * e[5][t] + e[3][t];
    let cy = u * e[7][t] + v * e[8][t] + e[6][t];
    [(c + cx * jx + cy * jy) * factor, cx * factor, cy * factor]
}

#[inline(always)]
fn cover_one<S: Simd, const LOOSE: bool>(
    simd: S,
    batch: &Batch,
    visits: &Visits<'_>,
    (t, points): (usize, u16),
    seen: &mut Visibility,
    alpha_test: &AlphaTest<'_>,
) {
    let Visits { set_up, spans, film, block_size, .. } = *visits;
    let u = f32x16::load_array_ref(simd, &batch.u);
    let v = f32x16::load_array_ref(simd, &batch.v);
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, 1.0);
    let is = |mask: u16| mask >> t & 1 == 1;

    let visit = Visit {
        triangle: set_up.triangles[t],
        id: set_up.ids[t],
        first: visits.surfaces.get(set_up.ids[t] as usize).copied().unwrap_or(set_up.triangles[t]),
        near_inverse: is(set_up.near).then_some(film.near_inverse),
        cutout: is(set_up.cutout),
    };
    let [x0, x1, y0, y1] = spans.blocks[t].map(i32::from);
    let mut blocks = [x0, x1, y0, y1];
    let mut boxes = None;
    if is(set_up.imaged) && (x1 - x0 + 1) * (y1 - y0 + 1) > NARROWED_ABOVE {
        // Where each lens point sees the triangle: tighter than any box that was made beforehand.
        let corners = (&set_up.corners, is(set_up.quads).then_some(&set_up.fourth));
        let found = scatter::ranges(simd, corners, t, batch, block_size, blocks);
        let mut some = found.some();
        if LOOSE {
            some &= mask32x16::from_bitmask(simd, u64::from(points));
        }
        if !some.any_true() {
            return;
        }
        let mut found = found.boxes(simd, some);
        let [x0, x1, y0, y1] = found.union;
        blocks = found.union;
        // Small triangles far apart for different lens points: one lens point and 16 blocks at a time.
        if !visit.cutout
            && visit.near_inverse.is_none()
            && WORTH * found.patches < (x1 - x0 + 1) * (y1 - y0 + 1)
        {
            if LOOSE && !found.sift(set_up.most_inverse[t], seen) {
                return;
            }
            boxes = Some(found);
        }
    }
    let [plane, plane_u, plane_v] = set_up.plane.map(|part| part[t]);
    let plane_at_lens = u * plane_u + v * plane_v + plane;
    // Edge-on for this lens point: no sample of the t can meet it.
    let live = mask32x16::from_bitmask(simd, u64::from(batch.live)) & plane_at_lens.simd_ne(zero);
    let z = at_lens(simd, &set_up.facing, t, batch, one / plane_at_lens);
    let side = live.select(one.copysign(plane_at_lens), zero);
    let edges = &set_up.edges;
    let mut functions = Functions {
        a: at_lens(simd, &edges[0], t, batch, side),
        b: at_lens(simd, &edges[1], t, batch, side),
        c: at_lens(simd, &edges[2], t, batch, side),
        d: [zero; 3],
        z,
        live,
        block_size: (block_size.0 as f32, block_size.1 as f32),
    };
    let most_inverse = set_up.most_inverse[t];
    // Quads are none of those that are loose.
    let is_quad = !LOOSE && is(set_up.quads);
    if is_quad {
        functions.d = at_lens(simd, &set_up.last_edge, t, batch, side);
    }
    match boxes {
        Some(boxes) if is_quad => {
            scatter::draw::<_, false, true>(simd, &functions, &boxes, (visit.id, most_inverse), seen);
        }
        None if is_quad => {
            regions::draw::<_, true>(simd, &functions, batch, blocks, &visit, seen, alpha_test)
        }
        Some(boxes) => {
            scatter::draw::<_, LOOSE, false>(simd, &functions, &boxes, (visit.id, most_inverse), seen);
        }
        None => regions::draw::<_, false>(simd, &functions, batch, blocks, &visit, seen, alpha_test),
    }
}

/// So many blocks are visited sooner than narrowed down.
const NARROWED_ABOVE: i32 = 12;

/// A patch for one lens point takes about as long as so many blocks for all 16. (A quarter or a ninth: no difference.)
const WORTH: i32 = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::group::Groups;
    use crate::raster::setup::Corners;
    use crate::raster::view::test_view;
    use crate::raster::visibility::EVERYWHERE;
    use crate::simd::SimdLevel;

    #[test]
    fn every_simd_level_sees_the_same_bits() {
        let mut numbers = Random(1);
        let mut random = |size: f32| numbers.signed() as f32 * size;
        let batch = Batch {
            cell: 0,
            u: std::array::from_fn(|_| random(0.7)),
            v: std::array::from_fn(|_| random(0.7)),
            x: std::array::from_fn(|_| 0.5 + random(0.5)),
            y: std::array::from_fn(|_| 0.5 + random(0.5)),
            pixel: [0; LANES],
            index: [0; LANES],
            live: 0xfff7,
            odd: 0,
        };
        let view = test_view();
        let film = TileFilm::new(&view, 0, 0);
        // Large and small, some through the near plane, some with boxes lens point by lens point.
        let corners: Vec<Corners> = (0..12)
            .map(|round| {
                let size = [1.0, 0.3, 0.05][round % 3];
                let mut v: Corners = [[[0.0; LANES]; 3]; 3];
                for lane in 0..LANES {
                    let z = f64::from(1.4 + random(1.0));
                    let middle = [f64::from(random(0.1)) * z, f64::from(random(0.1)) * z, z];
                    for corner in &mut v {
                        for axis in 0..3 {
                            corner[axis][lane] = middle[axis] + size * f64::from(random(1.0));
                        }
                    }
                }
                v
            })
            .collect();
        let run = |level: Level| {
            let mut seen = Visibility::new();
            seen.clear(1, 1, EVERYWHERE);
            let mut set_ups = Vec::new();
            for (round, v) in corners.iter().enumerate() {
                let mut set_up = SetUp::EMPTY;
                film.set_up(level, (v, None), &[0.0; LANES], &mut set_up);
                set_up.ids = std::array::from_fn(|lane| (round * LANES + lane) as u32);
                (set_up.near, set_up.cutout) = (0xffff, 0x1111);
                set_up.imaged = if round % 2 == 0 { 0xffff } else { 0 };
                let spans = Spans { blocks: [[0, 31, 0, 31]; LANES], some: 0xffff };
                let visits = Visits {
                    set_up: &set_up,
                    spans: &spans,
                    points: None,
                    film: &film,
                    block_size: (1, 1),
                    surfaces: &[],
                };
                cover(level, &batch, &visits, &mut seen, &|visit, hits| {
                    for hit in hits {
                        hit.lanes &=
                            (0x6db6_u32 >> ((visit.id as usize + usize::from(hit.block)) % 3)) as u16;
                    }
                });
                set_ups.push(format!("{set_up:?}"));
            }
            let depth: Vec<u32> = seen.inverse_depth.iter().flatten().map(|z| z.to_bits()).collect();
            let ids = seen.id.clone();
            let mut groups = Groups::default();
            seen.keep(0);
            groups.find(level, std::slice::from_ref(&batch), &seen, ids.len());
            (depth, ids, groups.runs().flatten().copied().collect::<Vec<_>>(), set_ups)
        };
        let wanted = run(SimdLevel::Scalar.level());
        assert!(wanted.0.iter().filter(|&&bits| bits != 0).count() > 1000, "the test draws next to nothing");
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            assert!(run(level.level()) == wanted, "{} differs from scalar", level.name());
        }
    }
}
