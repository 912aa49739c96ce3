//! Small triangles far out of focus that a tile's lens points may see, until one of its batches does.
//!
//! In: candidates, nearest first, each with the lens points that may see it ([`super::bin`], [`super::lens_points`]). Out: for one batch
//! after the other, sixteen at a time, the set-ups of those that its lens points do not see hidden by then, for [`super::kernel`]. Most are
//! seen by one batch alone, and half of them are hidden when it comes: what is set up for all batches together takes up to a third more
//! time. (With 64 batches, where more than one sees most, the tower takes 7 % more instead.)

use super::LANES;
use super::candidate::Brief;
use super::film::TileFilm;
use super::geometry::Geometry;
use super::lens_points::LensPoints;
use super::part::{Part, Spans};
use super::setup::SetUp;
use super::surfaces::Surfaces;
use super::tile_lists::Cursor;
use super::visibility::Visibility;
use super::waiting::Waiting;
use fearless_simd::Level;

/// See the module.
#[derive(Default)]
pub(super) struct LooseQueue {
    /// (A tile has tens of thousands of them: what they do not need is asked of the bins again.)
    each: Vec<One>,
    /// For each 64 lens points those of each that may see it: a batch goes through one of them.
    points: Vec<Vec<u64>>,
    gathered: Gathered,
}

#[derive(Clone, Copy)]
struct One {
    /// Its number among the candidates.
    number: u32,
    /// The place of its surface among the tile's.
    id: u32,
    /// At least the largest `1/t` of it and all after it.
    most_inverse: f32,
}

/// Sixteen triangles at most, for one batch.
struct Gathered {
    those: Waiting,
    spans: Spans,
    points: [u16; LANES],
    set_up: SetUp,
}

impl Default for Gathered {
    fn default() -> Self {
        Self { those: Waiting::default(), spans: Spans::NONE, points: [0; LANES], set_up: SetUp::EMPTY }
    }
}

impl LooseQueue {
    /// For another tile, with so many words of lens points for each triangle.
    pub(super) fn clear(&mut self, words: usize) {
        self.each.clear();
        self.points.resize_with(words, Vec::new);
        self.points.iter_mut().for_each(Vec::clear);
        self.gathered.those.count = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.each.len()
    }

    /// Adds the next that `lens` points may see, sixteen at most; tells whether there were any.
    pub(super) fn list(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        (tile, cursor): ((u32, u32), &mut Cursor),
        (lens, surfaces): (&mut LensPoints, &mut Surfaces),
    ) -> bool {
        let (mut those, mut count) = ([Brief::default(); LANES], 0);
        while count < LANES
            && let Some((brief, points)) = geometry.bins.next_seen(level, tile, cursor, lens)
        {
            those[count] = brief;
            for (all, &points) in self.points.iter_mut().zip(points) {
                all.push(points);
            }
            count += 1;
        }
        let those = &those[..count];
        let ids = surfaces.number(those.iter().map(|brief| (brief.surface, brief.triangle)));
        for (&Brief { number, least_z, .. }, id) in those.iter().zip(ids) {
            self.each.push(One { number, id, most_inverse: film.most_inverse_beyond(least_z) });
        }
        count > 0
    }

    /// Whether the `live` lanes of a batch see none from `at` on, or none of those that are not listed yet.
    pub(super) fn is_hidden(&self, at: usize, live: u16, seen: &Visibility) -> bool {
        let at = at.min(self.each.len().saturating_sub(1));
        self.each.get(at).is_some_and(|one| seen.hides(one.most_inverse, live))
    }

    /// Gathers the one at `at` if a lens point of the batch of that number may see it before what is seen.
    pub(super) fn gather(&mut self, at: usize, batch: usize, seen: &Visibility) {
        let points = (self.points[batch / 4][at] >> (LANES * (batch % 4))) as u16;
        if points == 0 {
            return;
        }
        let One { number, id, most_inverse } = self.each[at];
        let points = seen.open(most_inverse, points);
        if points != 0 {
            let Gathered { those, points: each, .. } = &mut self.gathered;
            let lane = those.count % LANES;
            (those.numbers[lane], those.ids[lane], each[lane]) = (number, id, points);
            those.count += 1;
        }
    }

    /// How many were gathered: sixteen at most.
    pub(super) fn gathered(&self) -> usize {
        self.gathered.those.count
    }

    /// Sets up what was gathered: with the blocks that each may touch from the batch's cell of the lens, and the lens points that may
    /// see it. Others may be gathered then.
    pub(super) fn set_up(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        (film, part, cell): (&TileFilm, &Part, usize),
    ) -> (&SetUp, &Spans, &[u16; LANES]) {
        let Gathered { those, spans, points, set_up } = &mut self.gathered;
        // They lie anywhere in memory: with nothing to decide in between, it brings many at once.
        for (candidate, &number) in those.candidates.iter_mut().zip(&those.numbers).take(those.count) {
            *candidate = geometry.bins.candidate(number);
        }
        those.set_up(level, geometry, film, set_up);
        spans.some = 0;
        for (lane, &number) in those.numbers.iter().enumerate().take(those.count) {
            spans.set(lane, part.blocks(geometry.bins.pixels(number, cell)));
        }
        those.count = 0;
        (set_up, spans, points)
    }
}
