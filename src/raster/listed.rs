//! Small triangles far out of focus that a tile's lens points may see, until one of its batches does.
//!
//! In: those that wait ([`super::waiting`]), nearest first, each with the lens points that may see it ([`super::lens_points`]). Out: for
//! one batch after the other, sixteen at a time, the set-ups of those that its lens points do not see hidden by then, for
//! [`super::kernel`]. Most are seen by one batch alone, and half of them are hidden when it comes: what is set up for all batches
//! together takes up to a third more time. (With 64 batches, where more than one sees most, the tower takes 7 % more instead.)

use super::LANES;
use super::bin::Candidate;
use super::bounds::PixelBox;
use super::film::TileFilm;
use super::setup::Block;
use super::tile::{Geometry, Part, Spans};
use super::view::Batch;
use super::visibility::Visibility;
use super::waiting::Waiting;
use fearless_simd::Level;

/// See the module.
#[derive(Default)]
pub(super) struct Listed {
    each: Vec<One>,
    cells: usize,
    /// For each its boxes, one for each cell of the lens.
    boxes: Vec<PixelBox>,
    words: usize,
    /// For each the lens points that may see it, word by word.
    points: Vec<u64>,
    /// Those that are gathered for the batch.
    group: Group,
}

struct One {
    candidate: Candidate,
    /// The place of its surface among the tile's.
    id: u32,
    /// At least the largest `1/t` of it and all after it.
    nearest: f32,
}

/// Sixteen triangles at most, for one batch.
struct Group {
    those: Waiting,
    spans: Spans,
    points: [u16; LANES],
    block: Block,
}

impl Default for Group {
    fn default() -> Self {
        Self { those: Waiting::default(), spans: Spans::NONE, points: [0; LANES], block: Block::EMPTY }
    }
}

impl Listed {
    /// For another tile, with boxes from so many cells of the lens.
    pub(super) fn clear(&mut self, cells: usize) {
        self.cells = cells;
        self.each.clear();
        self.boxes.clear();
        self.points.clear();
        self.group.those.count = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.each.len()
    }

    /// Adds those that wait.
    pub(super) fn take(&mut self, next: &Waiting, film: &TileFilm) {
        self.words = next.words;
        for (&candidate, &id) in next.candidates.iter().zip(&next.ids).take(next.count) {
            self.each.push(One { candidate, id, nearest: film.nearest(candidate.nearest) });
        }
        self.boxes.extend_from_slice(&next.boxes[..next.count * self.cells]);
        self.points.extend_from_slice(&next.points[..next.count * next.words]);
    }

    /// Whether the `live` lanes of a batch see none from `at` on, as every sixteenth asks.
    pub(super) fn is_hidden(&self, at: usize, live: u16, seen: &Visibility) -> bool {
        at.is_multiple_of(LANES) && self.each.get(at).is_some_and(|one| seen.hides(one.nearest, live))
    }

    /// Gathers the one at `at` if a lens point of the batch, with its number, may see it before what is seen.
    pub(super) fn gather(
        &mut self,
        at: usize,
        part: &Part,
        (number, batch): (usize, &Batch),
        seen: &Visibility,
    ) {
        let Some(one) = self.each.get(at) else { return };
        let mut points = (self.points[at * self.words + number / 4] >> (LANES * (number % 4))) as u16;
        if points == 0 {
            return;
        }
        // What is no number is not behind anything.
        for (lane, &floor) in seen.floor.iter().enumerate() {
            points &= !(u16::from(one.nearest <= floor) << lane);
        }
        if points != 0
            && let Some(blocks) = part.blocks(self.boxes[at * self.cells + batch.cell])
        {
            let Group { those, spans, points: each, .. } = &mut self.group;
            let lane = those.count % LANES;
            (those.candidates[lane], those.ids[lane]) = (one.candidate, one.id);
            (spans.blocks[lane], each[lane]) = (blocks, points);
            those.count += 1;
        }
    }

    /// Whether there is room for no more.
    pub(super) fn is_ready(&self) -> bool {
        self.group.those.count == LANES
    }

    /// Sets up what was gathered, if anything was: with their blocks, and the lens points that may see each. Others may be gathered then.
    pub(super) fn set_up(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        film: &TileFilm,
    ) -> Option<(&Block, &Spans, &[u16; LANES])> {
        let Group { those, spans, points, block } = &mut self.group;
        if those.count == 0 {
            return None;
        }
        those.set_up(level, geometry, film, block);
        spans.some = block.live;
        those.count = 0;
        Some((block, spans, points))
    }
}
