//! One tile: its triangles, nearest first, through every batch of samples.
//!
//! In: the tile and its batches, one by one, from `render::draw`; triangles from [`super::bin`]. Out: what each batch sees,
//! sorted into groups. On the way lie [`super::waiting`], [`super::sift`], [`super::setup`], [`super::kernel`],
//! [`super::visibility`] and [`super::group`]; far out of focus [`super::lens_points`] and [`super::loose_queue`], too.
//!
//! Triangles are set up 16 at a time, and only when a batch comes to them (loose ones for each batch that does): what lies behind
//! all that the batches see, nearest corner and all, is never touched. From the depth `z` on, `1/t` is at most `deepest / z`,
//! `deepest` being the largest distance of the tile's samples from the plane of the lens: a batch is done where that is nowhere
//! above its floor.

use super::LANES;
use super::batch::{Batch, Pattern};
use super::film::TileFilm;
use super::geometry::Geometry;
use super::group::Groups;
use super::kernel::{Visits, cover};
use super::lens_points::LensPoints;
use super::loose_queue::LooseQueue;
use super::part::{Part, Spans};
use super::setup::SetUp;
use super::sift::Sieve;
use super::surfaces::Surfaces;
use super::tile_lists::Cursor;
use super::visibility::{EVERYWHERE, Visibility};
use super::visit::AlphaTest;
use super::waiting::Waiting;
use fearless_simd::Level;

/// What one thread reuses from tile to tile.
pub(crate) struct TileScratch {
    part: Part,
    cursor: Cursor,
    /// The tile's lens points, where most of its triangles are loose, and whether they are told apart.
    lens: LensPoints,
    is_loose: bool,
    /// The tile's samples, where most of its triangles may lie between them.
    sieve: Sieve,
    is_crowded: bool,
    /// Where most of the tile's triangles are loose, what may be seen of them.
    loose_queue: LooseQueue,
    /// The candidates to be set up next.
    next: Waiting,
    /// Set-ups, of which the first `ready` are this tile's, and cell by cell their spans.
    set_ups: Vec<SetUp>,
    ready: usize,
    spans: Vec<Spans>,
    /// For each of these at least the largest `1/t` of it and all after it.
    most_inverse: Vec<f32>,
    surfaces: Surfaces,
    seen: Visibility,
    /// Seconds that set-up took in this tile.
    pub seconds: f64,
}

impl Default for TileScratch {
    fn default() -> Self {
        Self {
            part: Part { tile: (0, 0), block_size: (1, 1), wanted: EVERYWHERE },
            cursor: Cursor::default(),
            lens: LensPoints::default(),
            is_loose: false,
            sieve: Sieve::default(),
            is_crowded: false,
            loose_queue: LooseQueue::default(),
            next: Waiting::default(),
            set_ups: Vec::new(),
            ready: 0,
            spans: Vec::new(),
            most_inverse: Vec::new(),
            surfaces: Surfaces::default(),
            seen: Visibility::new(),
            seconds: 0.0,
        }
    }
}

impl TileScratch {
    /// Whether only batches of the pattern that the tile was prepared for may follow.
    pub(crate) fn serves_one_pattern(&self) -> bool {
        self.is_loose || self.is_crowded
    }

    /// Starts a tile, of which only this part may follow, and perhaps only the batches of `pattern`.
    pub(crate) fn prepare(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        part: Part,
        pattern: &Pattern,
    ) {
        self.part = part;
        self.ready = 0;
        self.spans.clear();
        self.most_inverse.clear();
        self.surfaces.clear(geometry.surfaces);
        self.seconds = 0.0;
        self.is_loose = geometry.bins.are_loose() && self.lens.set(pattern);
        self.loose_queue.clear(self.lens.words());
        self.is_crowded = self.sieve.set(pattern, geometry.bins.crowd(self.part.tile));
        self.cursor = Cursor::default();
        if !self.is_loose {
            self.pull(level, geometry, film);
        }
    }

    /// Finds the triangles that are to be set up next, and numbers their surfaces: those of the triangles that are passed over
    /// because they touch nothing wanted, too, for the order of surfaces is the order of sums.
    fn pull(&mut self, level: Level, geometry: &Geometry<'_>, film: &TileFilm) {
        let mut lens = geometry.bins.are_loose().then_some(&mut self.lens);
        let cells = geometry.bins.cells();
        let next = &mut self.next;
        (next.count, next.is_last) = (0, false);
        for turn in 0..MOST_TURNS {
            let first = next.count;
            next.fill(level, geometry.bins, self.part.tile, &mut self.cursor, lens.as_deref_mut());
            let found = first..next.count;
            next.is_last = found.len() < LANES - first;
            next.count = first;
            if turn == 0 {
                next.least_z = next.candidates[0].least_z;
            }
            let those = next.candidates[found.clone()].iter();
            let ids = self.surfaces.number(those.map(|found| (found.surface(), found.triangle)));
            for (lane, id) in found.zip(ids) {
                if self.part.touches(&next.boxes[lane * cells..(lane + 1) * cells]) {
                    next.ids[lane] = id;
                    next.replace(next.count, lane, cells);
                    next.count += 1;
                }
            }
            if self.is_crowded {
                next.sift((level, geometry.view, film), geometry.positions, &self.sieve, first, cells);
            }
            if next.is_last || next.count == LANES {
                return;
            }
        }
    }

    /// Draws one batch of samples, with its number in the tile's pattern, in the `wanted` regions of 4 x 4 blocks (see
    /// [`Visibility::clear`]); what is seen stays until the next. Tells how many triangles it went through.
    pub(crate) fn draw(
        &mut self,
        level: Level,
        wanted: u64,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        (number, batch): (usize, &Batch),
        alpha_test: &AlphaTest<'_>,
    ) -> u64 {
        let mut count = 0;
        self.seen.clear(self.part.block_size.0, self.part.block_size.1, wanted);
        if self.is_loose {
            return self.draw_loose(level, geometry, film, (number, batch), alpha_test);
        }
        for at in 0.. {
            if at % 256 == 255 && (geometry.stop)() {
                break;
            }
            if at == self.ready {
                if self.next.count == 0 && self.next.is_last {
                    break;
                }
                let most_inverse = film.most_inverse_beyond(self.next.least_z);
                if self.seen.hides(most_inverse, batch.live) {
                    break;
                }
                let start = geometry.now();
                self.set_up(level, geometry, film);
                self.seconds += geometry.now() - start;
                self.most_inverse.push(most_inverse);
            }
            if self.seen.hides(self.most_inverse[at], batch.live) {
                break;
            }
            let spans = &self.spans[at * geometry.bins.cells() + batch.cell];
            let visits = Visits {
                set_up: &self.set_ups[at],
                spans,
                points: None,
                film,
                block_size: self.part.block_size,
                surfaces: self.surfaces.each(),
            };
            cover(level, batch, &visits, &mut self.seen, alpha_test);
            count += LANES as u64;
        }
        count
    }

    /// The same where most triangles are loose: each is set up for the batches that see it, unless it is hidden by then.
    fn draw_loose(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        batch: (usize, &Batch),
        alpha_test: &AlphaTest<'_>,
    ) -> u64 {
        let (mut count, live) = (0, batch.1.live);
        for at in 0usize.. {
            let stops = at % 256 == 255 && (geometry.stop)();
            if stops || at.is_multiple_of(LANES) && self.loose_queue.is_hidden(at, live, &self.seen) {
                break;
            }
            if at == self.loose_queue.len() {
                let start = geometry.now();
                let from = (self.part.tile, &mut self.cursor);
                let any =
                    self.loose_queue.list(level, geometry, film, from, (&mut self.lens, &mut self.surfaces));
                self.seconds += geometry.now() - start;
                if !any {
                    break;
                }
            }
            self.loose_queue.gather(at, batch.0, &self.seen);
            if self.loose_queue.gathered() == LANES {
                count += self.draw_gathered(level, geometry, film, batch.1, alpha_test);
            }
        }
        count + self.draw_gathered(level, geometry, film, batch.1, alpha_test)
    }

    /// Sets up and draws what was gathered; tells how many triangles that was.
    fn draw_gathered(
        &mut self,
        level: Level,
        geometry: &Geometry<'_>,
        film: &TileFilm,
        batch: &Batch,
        alpha_test: &AlphaTest<'_>,
    ) -> u64 {
        let count = self.loose_queue.gathered();
        if count == 0 {
            return 0;
        }
        let start = geometry.now();
        let (set_up, spans, points) =
            self.loose_queue.set_up(level, geometry, (film, &self.part, batch.cell));
        self.seconds += geometry.now() - start;
        let visits = Visits {
            set_up,
            spans,
            points: Some(points),
            film,
            block_size: self.part.block_size,
            surfaces: self.surfaces.each(),
        };
        cover(level, batch, &visits, &mut self.seen, alpha_test);
        count as u64
    }

    /// Sets up the triangles that wait.
    fn set_up(&mut self, level: Level, geometry: &Geometry<'_>, film: &TileFilm) {
        if self.set_ups.len() == self.ready {
            self.set_ups.push(SetUp::EMPTY);
        }
        let made = &mut self.set_ups[self.ready];
        self.next.set_up(level, geometry, film, made);
        let (first, cells) = (self.spans.len(), geometry.bins.cells());
        self.spans.resize(first + cells, Spans::NONE);
        let mut rest = made.may_touch;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let boxes = &self.next.boxes[lane * cells..(lane + 1) * cells];
            for (spans, &pixels) in self.spans[first..].iter_mut().zip(boxes) {
                spans.set(lane, self.part.blocks(pixels));
            }
        }
        self.ready += 1;
        self.pull(level, geometry, film);
    }

    /// Keeps what the batch that was drawn sees as that of batch `number` of those that are grouped together.
    pub(crate) fn keep(&mut self, number: usize) {
        self.seen.keep(number);
    }

    /// What the batch that was drawn last sees.
    #[cfg(test)]
    pub(crate) fn seen(&self) -> &Visibility {
        &self.seen
    }

    /// Sorts the samples of the batches that were kept by what they see.
    pub(crate) fn group(&self, level: Level, batches: &[Batch], groups: &mut Groups) {
        groups.find(level, batches, &self.seen, self.surfaces.each().len());
    }

    /// Each sample of the batch that was kept first by itself, sorted by what it sees.
    pub(crate) fn singles(&self, batch: &Batch, groups: &mut Groups) {
        groups.find_singles(batch, &self.seen, self.surfaces.each().len());
    }

    /// The surfaces met in the tile so far, by one triangle of each; a group's or visit's id is a place in them.
    pub(crate) fn surfaces(&self) -> &[u32] {
        self.surfaces.each()
    }
}

/// So often sixteen candidates are looked at for some that are wanted, before it is asked whether all is hidden by now.
const MOST_TURNS: usize = 16;
