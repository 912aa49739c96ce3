//! What is seen: depth and surface of 16 samples at each block of a tile.
//!
//! In: `1/t` and id of what samples see, from [`super::regions`] and [`super::scatter`]: the largest `1/t` yet, and of equal ones
//! the first. Out: the ids, batch by batch, for [`super::group`]; for [`super::kernel`], [`super::scatter`], [`super::loose_queue`] and
//! [`super::tile`] whether anything can still be seen. Lane by lane, `floor = min 1/t` over the 16 blocks of a region, or over the
//! tile: a triangle whose `1/t` is nowhere above it is hidden.

use super::{BATCHES, LANES, TILE};
use fearless_simd::{Simd, SimdBase, f32x16};

/// The id where nothing is seen.
pub(crate) const NOTHING: u32 = u32::MAX;

/// Blocks on the side of a region, the unit of culling.
pub(crate) const REGION: usize = 4;

/// Regions on the side of a tile whose blocks are single pixels.
const MOST_REGIONS: usize = TILE as usize / REGION;

/// See the module.
pub(crate) struct Visibility {
    /// `1/t`, 0 where nothing is seen. Row by row.
    pub inverse_depth: Vec<[f32; LANES]>,
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
    /// Whether anything was drawn since that was made.
    is_changed: bool,
    /// Regions that are drawn.
    wanted: u64,
    /// Of a region's blocks, the `1/t` of what may be drawn once it is asked for.
    pub asked: [[f32; LANES]; REGION * REGION],
}

/// All regions, for [`Visibility::clear`].
pub(crate) const EVERYWHERE: u64 = u64::MAX;

impl Visibility {
    pub(crate) fn new() -> Self {
        Self {
            inverse_depth: Vec::new(),
            id: Vec::new(),
            kept: Default::default(),
            columns: 0,
            floors: [[0.0; LANES]; MOST_REGIONS * MOST_REGIONS],
            lows: [0.0; MOST_REGIONS * MOST_REGIONS],
            stale: 0,
            floor: [0.0; LANES],
            is_changed: false,
            wanted: EVERYWHERE,
            asked: [[0.0; LANES]; REGION * REGION],
        }
    }

    /// Empties it for blocks of the given size. Regions that are not among `wanted` (bit `8 row + column`) count as
    /// filled up to the lens, so nothing is drawn there.
    pub(crate) fn clear(&mut self, block_width: u32, block_height: u32, wanted: u64) {
        let columns = (TILE / block_width) as usize;
        let blocks = columns * (TILE / block_height) as usize;
        let stays = wanted == self.wanted && columns == self.columns && blocks == self.inverse_depth.len();
        (self.columns, self.wanted, self.stale, self.is_changed) = (columns, wanted, 0, false);
        self.id.resize(blocks, [NOTHING; LANES]);
        self.floor = [0.0; LANES];
        if wanted == EVERYWHERE {
            self.inverse_depth.resize(blocks, [0.0; LANES]);
            // Byte by byte: that is a call of the system's, which knows the machine's widest stores.
            bytemuck::cast_slice_mut::<_, u8>(&mut self.inverse_depth).fill(0);
            bytemuck::cast_slice_mut::<_, u8>(&mut self.id).fill(u8::MAX);
            self.floors = [[0.0; LANES]; MOST_REGIONS * MOST_REGIONS];
            self.lows = [0.0; MOST_REGIONS * MOST_REGIONS];
            return;
        }
        if !stays {
            self.inverse_depth.clear();
            self.inverse_depth.resize(blocks, [f32::INFINITY; LANES]);
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
                    && let Some(depth) = self.inverse_depth.get_mut(first..first + REGION)
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
        self.is_changed = true;
    }

    /// Whether what is nowhere nearer than `most_inverse` is hidden from a lane in the region, by what was known when that was last asked.
    #[inline(always)]
    pub(crate) fn hides_in(&self, column: usize, row: usize, lane: usize, most_inverse: f32) -> bool {
        let at = (row * MOST_REGIONS + column) % (MOST_REGIONS * MOST_REGIONS);
        most_inverse <= self.floors[at][lane % LANES]
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
            if let Some(blocks) = self.inverse_depth.get(first..first + REGION) {
                for depth in blocks {
                    least = least.min(f32x16::load_array_ref(simd, depth));
                }
            }
        }
        least.store_array(&mut self.floors[at]);
        self.lows[at] = least.reduce_min();
        least
    }

    /// Whether all lanes see something else before what comes no nearer than `most_inverse`, as a `1/t`, and touches no blocks but
    /// those in columns `x0..=x1` and rows `y0..=y1`.
    #[inline(always)]
    pub(crate) fn hides_all<S: Simd>(&mut self, simd: S, blocks: [u8; 4], most_inverse: f32) -> bool {
        let [x0, x1, y0, y1] = blocks.map(|block| usize::from(block) / REGION);
        for row in y0..=y1 {
            for column in x0..=x1 {
                let at = (row * MOST_REGIONS + column) % (MOST_REGIONS * MOST_REGIONS);
                // What was drawn since it was last looked at may have raised it.
                if self.lows[at] < most_inverse && self.stale >> at & 1 == 1 {
                    self.region_floor(simd, column, row);
                }
                // Mostly the first region says so, and NaN is not behind anything.
                let is_hidden = self.lows[at] >= most_inverse;
                if !is_hidden {
                    return false;
                }
            }
        }
        true
    }

    /// What batch `number` of those that are grouped together sees, block by block.
    #[inline(always)]
    pub(super) fn kept(&self, number: usize) -> &[[u32; LANES]] {
        &self.kept[number % BATCHES]
    }

    /// Whether a block is drawn: all four in a row of its region are, or none.
    #[inline(always)]
    pub(super) fn is_wanted(&self, block: usize) -> bool {
        if self.wanted == EVERYWHERE {
            return true;
        }
        // Columns are a power of two, and a shift is not a division.
        let (row, column) = (block >> self.columns.trailing_zeros(), block & (self.columns - 1));
        self.wanted >> (row / REGION * MOST_REGIONS + column / REGION) & 1 == 1
    }

    /// Whether any of the blocks in columns `x0..=x1` and rows `y0..=y1` are drawn.
    #[inline(always)]
    pub(crate) fn wants(&self, blocks: [u8; 4]) -> bool {
        wants(self.wanted, blocks)
    }

    /// Those of the `lanes` that do not see something at least as near as `most_inverse`, a `1/t`, everywhere in the tile.
    pub(super) fn open(&self, most_inverse: f32, lanes: u16) -> u16 {
        let (mut open, mut rest) = (lanes, lanes);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            open &= !(u16::from(self.floor[lane] >= most_inverse) << lane);
        }
        open
    }

    /// Whether all of the `lanes` see something at least as near everywhere in the tile.
    pub(crate) fn hides(&self, most_inverse: f32, lanes: u16) -> bool {
        self.floor.iter().enumerate().all(|(lane, &floor)| lanes >> lane & 1 == 0 || floor >= most_inverse)
    }

    /// Makes the tile's floor again where anything was drawn since: after each sixteen triangles. (Without, the city's samples went
    /// through 40 % more of them; before each one, too, it hid hardly any more.)
    #[inline(always)]
    pub(crate) fn raise_floor<S: Simd>(&mut self, simd: S) {
        if !self.is_changed {
            return;
        }
        self.is_changed = false;
        let mut least = f32x16::splat(simd, f32::INFINITY);
        for row in 0..self.inverse_depth.len() / self.columns / REGION {
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

#[cfg(test)]
mod tests {
    use super::*;

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
