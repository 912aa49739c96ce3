//! What is seen: depth and surface of 16 samples at each block of a tile, and the groups that see the same.

use super::view::Batch;
use super::{BATCHES, LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Level, Simd, SimdBase, SimdMask, f32x16, u32x16};

/// The id where nothing is seen.
pub(crate) const NOTHING: u32 = u32::MAX;

/// Blocks on the side of a region, the unit of culling.
pub(crate) const REGION: usize = 4;

/// Regions on the side of a tile whose blocks are single pixels.
const MOST_REGIONS: usize = TILE as usize / REGION;

/// See the module.
pub(crate) struct Visibility {
    /// `1/t`, 0 where nothing is seen. Row by row.
    pub depth: Vec<[f32; LANES]>,
    /// The id of the surface that is seen, [`NOTHING`] where none is.
    pub id: Vec<[u32; LANES]>,
    /// The ids of the batches that were drawn before: see [`Visibility::keep`].
    kept: [Vec<[u32; LANES]>; BATCHES],
    /// Blocks in a row.
    pub columns: usize,
    /// Lane by lane at most the depth anywhere in a region.
    floors: [[f32; LANES]; MOST_REGIONS * MOST_REGIONS],
    /// The least of these over all lanes.
    lows: [f32; MOST_REGIONS * MOST_REGIONS],
    /// Regions that were drawn into since.
    stale: u64,
    /// Lane by lane at most the depth anywhere in the tile.
    pub floor: [f32; LANES],
    /// Regions drawn into since that was made.
    changes: u32,
    /// Regions that are drawn.
    wanted: u64,
}

/// All regions, for [`Visibility::clear`].
pub(crate) const EVERYWHERE: u64 = u64::MAX;

/// Regions that are drawn into between two triangles before the tile's floor is made again: it costs as much as four regions'
/// floors. Before each sixteen triangles any do: those that fill the tile may be few. (Without, the city's samples went
/// through 40 % more triangles.)
pub(crate) const PATIENCE: u32 = 32;

impl Visibility {
    pub(crate) fn new() -> Self {
        Self {
            depth: Vec::new(),
            id: Vec::new(),
            kept: Default::default(),
            columns: 0,
            floors: [[0.0; LANES]; MOST_REGIONS * MOST_REGIONS],
            lows: [0.0; MOST_REGIONS * MOST_REGIONS],
            stale: 0,
            floor: [0.0; LANES],
            changes: 0,
            wanted: EVERYWHERE,
        }
    }

    /// Empties it for blocks of the given size. Regions that are not among `wanted` (bit `8 row + column`) count as
    /// filled up to the lens, so nothing is drawn there.
    pub(crate) fn clear(&mut self, block_width: u32, block_height: u32, wanted: u64) {
        let columns = (TILE / block_width) as usize;
        let blocks = columns * (TILE / block_height) as usize;
        let stays = wanted == self.wanted && columns == self.columns && blocks == self.depth.len();
        (self.columns, self.wanted, self.stale, self.changes) = (columns, wanted, 0, 0);
        self.id.resize(blocks, [NOTHING; LANES]);
        self.floor = [0.0; LANES];
        if wanted == EVERYWHERE {
            self.depth.clear();
            self.depth.resize(blocks, [0.0; LANES]);
            self.id.fill([NOTHING; LANES]);
            self.floors = [[0.0; LANES]; MOST_REGIONS * MOST_REGIONS];
            self.lows = [0.0; MOST_REGIONS * MOST_REGIONS];
            return;
        }
        if !stays {
            self.depth.clear();
            self.depth.resize(blocks, [f32::INFINITY; LANES]);
            self.floors = [[f32::INFINITY; LANES]; MOST_REGIONS * MOST_REGIONS];
            self.lows = [f32::INFINITY; MOST_REGIONS * MOST_REGIONS];
        }
        let mut rest = wanted;
        while rest != 0 {
            let at = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            (self.floors[at], self.lows[at]) = ([0.0; LANES], 0.0);
            let (row, column) = (at / MOST_REGIONS * REGION, at % MOST_REGIONS * REGION);
            for first in (row..row + REGION).map(|y| y * columns + column) {
                // Blocks larger than a pixel have fewer regions.
                if column + REGION <= columns
                    && let Some(depth) = self.depth.get_mut(first..first + REGION)
                    && let Some(ids) = self.id.get_mut(first..first + REGION)
                {
                    depth.fill([0.0; LANES]);
                    ids.fill([NOTHING; LANES]);
                }
            }
        }
    }

    /// Keeps what the batch that was drawn sees as that of batch `number` of those that are grouped together.
    pub(crate) fn keep(&mut self, number: usize) {
        std::mem::swap(&mut self.id, &mut self.kept[number % BATCHES]);
    }

    /// Says that the region in this column and row of regions was drawn into.
    #[inline(always)]
    pub(crate) fn touch(&mut self, column: usize, row: usize) {
        self.stale |= 1 << (row * MOST_REGIONS + column);
        self.changes += 1;
    }

    /// Lane by lane at most the depth anywhere in the region.
    #[inline(always)]
    pub(crate) fn region_floor<S: Simd>(&mut self, simd: S, column: usize, row: usize) -> f32x16<S> {
        let at = (row * MOST_REGIONS + column) % (MOST_REGIONS * MOST_REGIONS);
        if self.stale >> at & 1 == 0 {
            return f32x16::load_array_ref(simd, &self.floors[at]);
        }
        self.stale &= !(1 << at);
        let mut least = f32x16::splat(simd, f32::INFINITY);
        for y in row * REGION..(row + 1) * REGION {
            let first = y * self.columns + column * REGION;
            if let Some(blocks) = self.depth.get(first..first + REGION) {
                for depth in blocks {
                    least = least.min(f32x16::load_array_ref(simd, depth));
                }
            }
        }
        least.store_array(&mut self.floors[at]);
        self.lows[at] = least.reduce_min();
        least
    }

    /// Whether all lanes see something else before what comes no nearer than `nearest`, as a `1/t`, and touches no blocks but
    /// those in columns `x0..=x1` and rows `y0..=y1`.
    #[inline(always)]
    pub(crate) fn hides_all<S: Simd>(&mut self, simd: S, blocks: [u8; 4], nearest: f32) -> bool {
        let [x0, x1, y0, y1] = blocks.map(|block| usize::from(block) / REGION);
        for row in y0..=y1 {
            for column in x0..=x1 {
                let at = (row * MOST_REGIONS + column) % (MOST_REGIONS * MOST_REGIONS);
                // What was drawn since it was last looked at may have raised it.
                if self.lows[at] < nearest && self.stale >> at & 1 == 1 {
                    self.region_floor(simd, column, row);
                }
                // Mostly the first region says so, and what is no number is not behind anything.
                let is_hidden = self.lows[at] >= nearest;
                if !is_hidden {
                    return false;
                }
            }
        }
        true
    }

    #[inline(always)]
    fn is_wanted(&self, block: usize) -> bool {
        if self.wanted == EVERYWHERE {
            return true;
        }
        let (row, column) = (block / self.columns / REGION, block % self.columns / REGION);
        self.wanted >> (row * MOST_REGIONS + column) & 1 == 1
    }

    /// Whether any of the blocks in columns `x0..=x1` and rows `y0..=y1` are drawn.
    #[inline(always)]
    pub(crate) fn wants(&self, blocks: [u8; 4]) -> bool {
        wants(self.wanted, blocks)
    }

    /// Whether all that a `1/t` of at most `nearest` can be seen of lies behind what the `live` lanes see.
    pub(crate) fn hides(&self, nearest: f32, live: u16) -> bool {
        self.floor.iter().enumerate().all(|(lane, &floor)| live >> lane & 1 == 0 || floor >= nearest)
    }

    /// Makes the tile's floor again where `patience` regions were drawn into since.
    #[inline(always)]
    pub(crate) fn raise_floor<S: Simd>(&mut self, simd: S, patience: u32) {
        if self.changes < patience {
            return;
        }
        self.changes = 0;
        let mut least = f32x16::splat(simd, f32::INFINITY);
        for row in 0..self.depth.len() / self.columns / REGION {
            for column in 0..self.columns / REGION {
                least = least.min(self.region_floor(simd, column, row));
            }
        }
        least.store_array(&mut self.floor);
    }
}

/// Whether any of the blocks in columns `x0..=x1` and rows `y0..=y1` lie in one of the `wanted` regions.
#[inline(always)]
pub(super) fn wants(wanted: u64, [x0, x1, y0, y1]: [u8; 4]) -> bool {
    if wanted == EVERYWHERE {
        return true;
    }
    // A byte of the mask is a row of regions.
    let region = |block: u8| u32::from(block) / REGION as u32 % MOST_REGIONS as u32;
    let columns = u64::MAX >> (63 - region(x1)) & 0xff & (u64::MAX << region(x0));
    let rows = u64::MAX >> (56 - 8 * region(y1)) & (u64::MAX << (8 * region(y0)));
    wanted & rows & (columns * 0x0101_0101_0101_0101) != 0
}

/// Samples of one block that see the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Group {
    pub block: u16,
    /// The surface they see, or [`NOTHING`].
    pub id: u32,
    /// Lanes of up to four batches: those of the first in the lowest 16 bits, lane 0 in the lowest.
    pub lanes: u64,
}

/// The numbers of the batches that have any of these lanes, as in a group.
#[inline(always)]
pub(crate) fn batches_of(lanes: u64) -> impl Iterator<Item = usize> {
    let mut rest = lanes;
    std::iter::from_fn(move || {
        let number = rest.trailing_zeros() as usize / LANES;
        rest &= !(0xffff << (LANES * (number % BATCHES)));
        (number < BATCHES).then_some(number)
    })
}

impl Group {
    /// The numbers of the batches that it has lanes of.
    #[inline(always)]
    pub(crate) fn batches(&self) -> impl Iterator<Item = usize> {
        batches_of(self.lanes)
    }

    /// Its samples of batch `number` as a group of their own.
    #[inline(always)]
    pub(crate) fn part(&self, number: usize) -> Self {
        Self { lanes: self.lanes & 0xffff << (LANES * number), ..*self }
    }

    /// Its lanes of batch `number`.
    #[inline(always)]
    pub(crate) fn lanes_of(&self, number: usize) -> u16 {
        (self.lanes >> (LANES * number)) as u16
    }
}

/// Sorts the samples of the `batches` that were kept into groups, block by block.
pub(crate) fn group(level: Level, batches: &[Batch], seen: &Visibility, out: &mut Vec<Group>) {
    out.clear();
    at_level!(level, simd => group_all(simd, batches, seen, out));
}

#[inline(always)]
fn group_all<S: Simd>(simd: S, batches: &[Batch], seen: &Visibility, out: &mut Vec<Group>) {
    let live = all_live(batches);
    for block in 0..seen.depth.len() {
        if !seen.is_wanted(block) {
            continue;
        }
        let mut rest = live;
        while rest != 0 {
            let first = rest.trailing_zeros() as usize;
            let id = seen.kept[first / LANES % BATCHES].get(block).map_or(NOTHING, |ids| ids[first % LANES]);
            let wanted = u32x16::splat(simd, id);
            let mut lanes = 0;
            for (number, ids) in seen.kept.iter().enumerate().take(batches.len()) {
                if let Some(ids) = ids.get(block) {
                    let same = u32x16::load_array_ref(simd, ids).simd_eq(wanted).to_bitmask();
                    lanes |= same << (LANES * number);
                }
            }
            lanes &= rest;
            // Whatever is there: the first lane itself is of the group.
            lanes |= 1 << first;
            out.push(Group { block: block as u16, lanes, id });
            rest &= !lanes;
        }
    }
}

/// The lanes of up to four batches that are in use.
fn all_live(batches: &[Batch]) -> u64 {
    let each = batches.iter().take(BATCHES).enumerate();
    each.fold(0, |live, (number, batch)| live | u64::from(batch.live) << (LANES * number))
}

/// Each sample of the batch that was kept first as a group of its own, sorted by what they see (one of `surfaces`, or
/// nothing, which comes last), otherwise in order. `next` is scratch.
pub(crate) fn singles(
    batch: &Batch,
    seen: &Visibility,
    surfaces: usize,
    next: &mut Vec<u32>,
    out: &mut Vec<Group>,
) {
    next.clear();
    next.resize(surfaces + 2, 0);
    let live = |lane: usize| batch.live >> lane & 1 == 1;
    let blocks = || seen.kept[0].iter().enumerate().filter(|(block, _)| seen.is_wanted(*block));
    for (_, ids) in blocks() {
        for (_, &id) in ids.iter().enumerate().filter(|(lane, _)| live(*lane)) {
            next[(id as usize).min(surfaces) + 1] += 1;
        }
    }
    for i in 1..next.len() {
        next[i] += next[i - 1];
    }
    out.clear();
    out.resize(next[surfaces + 1] as usize, Group { block: 0, lanes: 0, id: NOTHING });
    for (block, ids) in blocks() {
        for (lane, &id) in ids.iter().enumerate().filter(|(lane, _)| live(*lane)) {
            let place = &mut next[(id as usize).min(surfaces)];
            out[*place as usize] = Group { block: block as u16, lanes: 1 << lane, id };
            *place += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_four_batches_are_grouped_by_what_they_see() {
        let batches: [Batch; 4] = std::array::from_fn(|i| Batch { live: 0xffff >> i, ..Batch::of_cell(0) });
        let id = |batch: usize, block: usize, lane: usize| ((batch * 7 + block * 3 + lane) % 5) as u32;
        let mut seen = Visibility::new();
        for number in 0..4 {
            seen.clear(1, 1, EVERYWHERE);
            for (block, ids) in seen.id.iter_mut().enumerate() {
                *ids = std::array::from_fn(|lane| id(number, block, lane));
            }
            seen.keep(number);
        }
        for count in 1..=4 {
            let mut groups = Vec::new();
            group(crate::simd::SimdLevel::best().level(), &batches[..count], &seen, &mut groups);
            let mut met = vec![0u64; 1024];
            for group in &groups {
                assert_eq!(met[usize::from(group.block)] & group.lanes, 0);
                met[usize::from(group.block)] |= group.lanes;
                for lane in (0..64).filter(|lane| group.lanes >> lane & 1 == 1) {
                    assert_eq!(group.id, id(lane / 16, usize::from(group.block), lane % 16));
                }
            }
            assert!(met.iter().all(|&lanes| lanes == all_live(&batches[..count])));
            // One group for each of the five surfaces.
            assert_eq!(groups.len(), 5 * 1024);
        }
    }

    #[test]
    fn blocks_are_wanted_where_a_region_of_theirs_is() {
        let mut seen = Visibility::new();
        for wanted in [0, 1, 1 << 63, 1 << 27, 0x8100_0000_0000_0081, 0x00ff_0000] {
            seen.clear(1, 1, wanted);
            for i in 0..4096u32 {
                let [x0, x1, y0, y1] = [i, i / 5, i / 3, i * 7].map(|n| (n % 32) as u8);
                let (x0, x1, y0, y1) = (x0.min(x1), x0.max(x1), y0.min(y1), y0.max(y1));
                let inside = |low: u8, high: u8, region: u32| {
                    (u32::from(low) / 4..=u32::from(high) / 4).contains(&region)
                };
                let any = (0..64)
                    .any(|bit| wanted >> bit & 1 == 1 && inside(x0, x1, bit % 8) && inside(y0, y1, bit / 8));
                assert_eq!(seen.wants([x0, x1, y0, y1]), any, "{wanted:x} {x0} {x1} {y0} {y1}");
            }
        }
    }
}
