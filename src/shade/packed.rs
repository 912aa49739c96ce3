//! Samples side by side: groups in, full batches of 16 samples out, each with the number of its sum.
//!
//! A group of five samples would leave eleven of sixteen lanes idle, so samples of several groups share the lanes, in the order
//! of their lanes, one group after the other, for [`super::textured`] and [`super::run`]. (Moving the lanes that a group has of a
//! batch together at once, five instructions for all of them with AVX-512, was no faster: of 64 samples a group has one or two of
//! each batch.)

use super::rays::Places;
use super::samples::Samples;
use crate::raster::group::Group;
use crate::raster::{BATCHES, LANES};
use fearless_simd::Simd;
use glam::Vec4;

/// All samples of 16 groups. (A power of two: numbers are kept within it by a mask.)
const ROOM: usize = (LANES * BATCHES * LANES).next_power_of_two();

/// See the module. Used again from surface to surface.
pub(crate) struct Packed {
    /// One below the other: `u`, `v`, `x`, `y`.
    rows: [[f32; 4]; ROOM],
    owners: [u8; ROOM],
    count: usize,
}

impl Default for Packed {
    fn default() -> Self {
        Self { rows: [[0.0; 4]; ROOM], owners: [0; ROOM], count: 0 }
    }
}

impl Packed {
    /// The samples of these lanes of each group; those of the even half of group `i` belong to sum `2 i`, of the odd to the next.
    #[inline(always)]
    pub(super) fn fill(&mut self, samples: &Samples<'_>, groups: &[Group], lanes: &[u64; LANES]) {
        let mut count = 0;
        for (i, (&lanes, group)) in lanes.iter().zip(groups).enumerate() {
            let corner = samples.corner(group);
            let corner = Vec4::new(0.0, 0.0, corner.x, corner.y);
            let mut rest = lanes;
            while rest != 0 {
                // Four without a branch: how many a group has nothing foresees. What is too much is written over by the next.
                let left = rest.count_ones() as usize;
                for at in count..count + 4 {
                    let lane = rest.trailing_zeros() as usize;
                    rest &= rest.wrapping_sub(1);
                    self.rows[at % ROOM] = (samples.means.lane(lane) + corner).to_array();
                    self.owners[at % ROOM] = (2 * i) as u8 | samples.means.odd_bit(lane);
                }
                count += left.min(4);
            }
        }
        self.count = count.min(ROOM);
    }

    /// How many batches the samples fill.
    #[inline(always)]
    pub(super) fn batches(&self) -> usize {
        self.count.div_ceil(LANES)
    }

    /// Batch number `number`: where its samples lie, whose they are, and how many there are; beyond them stands what was there before.
    #[inline(always)]
    pub(super) fn batch<S: Simd>(&self, simd: S, number: usize) -> (Places<S>, &[u8; LANES], usize) {
        let at = number % (ROOM / LANES);
        let (rows, owners) = (self.rows.as_chunks::<LANES>().0, self.owners.as_chunks::<LANES>().0);
        (Places::of_rows(simd, &rows[at]), &owners[at], (self.count - at * LANES).min(LANES))
    }
}
