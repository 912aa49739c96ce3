//! Culling: which clusters of triangles no sample of the picture can meet.
//!
//! In: the boxes of clusters in the lens frame, from `render::prepared`. Out: the ranges of triangles that may be seen, and which blocks
//! of vertices these have, for [`super::bin`] and [`super::triangle_boxes`].
//!
//! From the lens point `s` a point `X` is seen left of the pixel `-m` where `(x + m) w < 0` (see [`super::view`]); that is linear in
//! `X` and in `s`. Over the disk of the lens it is `a + |b|` at most, `a` and `b` linear in `X`, so over a box it is largest at a corner.

use super::vertex_boxes::Frustum;
use super::view::View;
use glam::{DVec3, DVec4};
use std::ops::Range;

/// Triangles that come one after another.
pub(crate) struct Cluster {
    /// The corners of a box that holds them, lens frame.
    pub corners: [DVec3; 8],
    /// The numbers of their vertices lie in this range.
    pub vertices: Range<u32>,
}

/// Vertices that are looked at together or not at all.
pub(super) const VERTEX_CHUNK: usize = 256;

/// Pixels that a box must lie outside of the picture, beside the reach of samples: more than rounding.
const MARGIN: f64 = 1.0;

/// What may be seen.
pub(super) struct Seen {
    /// Ranges of triangles, in order.
    pub triangles: Vec<Range<usize>>,
    /// For each chunk of vertices how many stand before it that are looked at, or [`Seen::NOT`].
    before: Vec<usize>,
    /// Room for those that are looked at, in whole chunks.
    pub vertices: usize,
    /// All there are.
    all: usize,
}

impl Seen {
    const NOT: usize = usize::MAX;

    /// Of `triangles` triangles with `vertices` vertices, `size` to a cluster; without clusters all.
    pub(super) fn new(
        view: &View,
        clusters: &[Cluster],
        size: usize,
        (triangles, vertices): (usize, usize),
    ) -> Self {
        let sides = Sides::new(view);
        let mut wanted = vec![clusters.is_empty(); vertices.div_ceil(VERTEX_CHUNK)];
        let mut found = Vec::new();
        for (at, first) in (0..triangles).step_by(size).enumerate() {
            if let Some(Cluster { corners, vertices }) = clusters.get(at) {
                if sides.hide(corners) {
                    continue;
                }
                let chunks =
                    vertices.start as usize / VERTEX_CHUNK..(vertices.end as usize).div_ceil(VERTEX_CHUNK);
                if let Some(wanted) = wanted.get_mut(chunks) {
                    wanted.fill(true);
                }
            }
            found.push(first..(first + size).min(triangles));
        }
        let mut count = 0;
        let before = wanted.into_iter().map(|wanted| {
            let at = if wanted { count } else { Self::NOT };
            count += usize::from(wanted) * VERTEX_CHUNK;
            at
        });
        Self { triangles: found, before: before.collect(), vertices: count, all: vertices }
    }

    /// The place of a vertex among those that are looked at; beyond them all where it is not.
    #[inline(always)]
    pub(super) fn place(&self, vertex: u32) -> usize {
        let vertex = vertex as usize;
        self.before[vertex / VERTEX_CHUNK].saturating_add(vertex % VERTEX_CHUNK)
    }

    /// The vertices that are looked at, block by block.
    pub(super) fn blocks(&self) -> impl Iterator<Item = Range<usize>> {
        let blocks = self.before.iter().enumerate().filter(|&(_, &before)| before != Self::NOT);
        blocks.map(|(block, _)| block * VERTEX_CHUNK..(block * VERTEX_CHUNK + VERTEX_CHUNK).min(self.all))
    }
}

/// What bounds the picture.
struct Sides {
    /// Of each side the half-space that is seen, at the lens's centre and what `u` and `v` add.
    sides: [[DVec4; 3]; 4],
    frustum: Frustum,
}

impl Sides {
    fn new(view: &View) -> Self {
        let rows = |row: usize, size: u32| {
            let beyond = MARGIN + view.displacement[row];
            let [low, high] = [beyond, f64::from(size) + beyond];
            let of = |weight: f64, sign: f64| {
                view.pixel_from_lens.map(|family| family[2] * weight + family[row] * sign)
            };
            [of(low, 1.0), of(high, -1.0)]
        };
        let ([left, right], [top, bottom]) = (rows(0, view.width), rows(1, view.height));
        Self { sides: [left, right, top, bottom], frustum: Frustum::new(view) }
    }

    /// Whether all between these points lies outside of one and the same side.
    fn hide(&self, corners: &[DVec3; 8]) -> bool {
        let outside = |[at_center, by_u, by_v]: &[DVec4; 3]| {
            corners.iter().all(|corner| {
                let at = corner.extend(1.0);
                at_center.dot(at) + libm::hypot(by_u.dot(at), by_v.dot(at)) < 0.0
            })
        };
        self.frustum.hides(corners) || self.sides.iter().any(outside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::view::test_view;

    /// A box of half this size around a point.
    fn around(middle: DVec3, half: DVec3) -> [DVec3; 8] {
        std::array::from_fn(|at| {
            middle
                + half * DVec3::from_array([0, 1, 2].map(|axis| if at >> axis & 1 == 1 { 1.0 } else { -1.0 }))
        })
    }

    fn random_point(random: &mut Random, size: f64) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| size * random.signed()))
    }

    #[test]
    fn what_is_culled_no_lens_point_sees_and_most_of_what_is_far_outside_is() {
        let mut random = Random(5);
        let mut view = test_view();
        // The film leans: w changes with the lens point.
        view.pixel_from_lens[1][2] = DVec4::new(0.0, 0.0, 0.04, -0.03);
        view.pixel_from_lens[2][2] = DVec4::new(0.0, 0.0, -0.02, 0.05);
        let sides = Sides::new(&view);
        let size = [view.width, view.height].map(f64::from);
        let (mut culled, mut seen) = (0, 0);
        for _ in 0..4000 {
            let mut point = |size: f64| random_point(&mut random, size);
            // The picture is as wide as a fifth of the distance.
            let (middle, half) = (point(3.0) * DVec3::new(0.15, 0.15, 1.0), point(0.1));
            let corners = around(middle, half);
            let hidden = sides.hide(&corners);
            culled += u32::from(hidden);
            for _ in 0..40 {
                let at = (middle + half * random_point(&mut random, 1.0)).extend(1.0);
                let (sine, cosine) = libm::sincos(4.0 * random.signed());
                let r = libm::sqrt(random.unit());
                let [x, y, w] = [0, 1, 2].map(|row| {
                    let [at_center, by_u, by_v] = view.pixel_from_lens.map(|family| family[row].dot(at));
                    at_center + r * (cosine * by_u + sine * by_v)
                });
                let is_seen = at.z >= view.near
                    && w >= view.least_w
                    && (0.0..=size[0]).contains(&(x / w))
                    && (0.0..=size[1]).contains(&(y / w));
                seen += u32::from(is_seen);
                assert!(!(is_seen && hidden), "{middle} {half} {at}");
            }
        }
        assert!(culled > 1000 && seen > 1000, "{culled} culled, {seen} points seen");
    }

    #[test]
    fn vertices_of_what_is_seen_have_places_of_their_own() {
        let view = test_view();
        let [near, behind] =
            [DVec3::Z * 2.0, DVec3::Z * -2.0].map(|middle| around(middle, DVec3::splat(0.01)));
        let cluster = |corners, vertices| Cluster { corners, vertices };
        let clusters = [cluster(near, 0..10), cluster(behind, 300..700), cluster(near, 900..1000)];
        let seen = Seen::new(&view, &clusters, 4, (11, 1000));
        assert_eq!(seen.triangles, [0..4, 8..11]);
        assert_eq!(seen.blocks().collect::<Vec<_>>(), [0..256, 768..1000]);
        assert_eq!((seen.place(9), seen.place(900), seen.vertices), (9, 256 + 132, 512));
        let all = Seen::new(&view, &[], 4, (11, 1000));
        assert_eq!((all.triangles.len(), all.place(999), all.vertices), (3, 999, 1024));
    }
}
