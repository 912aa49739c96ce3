//! Groups: the samples of a block of pixels, of up to four batches, that see the same surface.
//!
//! In: what each batch that was kept sees ([`super::visibility`]). Out: the groups, surface by surface, so that each surface is
//! shaded in one go (`shade::run`, `shade::shadowed`). A group is a block, an id, and the set of lanes that see it there,
//! `{ lane : id(lane) = id }`; groups are counted for each id, and sorted by that.

use super::batch::Batch;
use super::visibility::{NOTHING, REGION, Visibility};
use super::{BATCHES, LANES};
use crate::simd::at_level;
use fearless_simd::{Level, Simd, SimdBase, SimdMask, u32x16};

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
    const NONE: Self = Self { block: 0, id: NOTHING, lanes: 0 };

    /// The numbers of the batches that it has lanes of.
    #[inline(always)]
    pub(crate) fn batches(&self) -> impl Iterator<Item = usize> {
        batches_of(self.lanes)
    }

    /// Its lanes of batch `number`.
    #[inline(always)]
    pub(crate) fn lanes_of(&self, number: usize) -> u16 {
        (self.lanes >> (LANES * number)) as u16
    }
}

/// The groups of a tile. What they take of memory is used again.
#[derive(Default)]
pub(crate) struct Groups {
    /// As they are found, block by block, and by surface; both longer than there are groups.
    found: Vec<Group>,
    sorted: Vec<Group>,
    count: usize,
    /// How many groups see each surface; then where the next of them goes, and at last where they end.
    next: Vec<u32>,
}

impl Groups {
    /// Those of each surface that is seen, by its number in the tile, and at last those that see nothing; each block by block.
    pub(crate) fn runs(&self) -> impl Iterator<Item = &[Group]> {
        let mut first = 0;
        self.next.iter().filter_map(move |&end| {
            let run = self.sorted.get(first..end as usize)?;
            first = end as usize;
            (!run.is_empty()).then_some(run)
        })
    }

    /// Sorts the samples of the `batches` that were kept; what they see are so many surfaces.
    pub(super) fn find(&mut self, level: Level, batches: &[Batch], seen: &Visibility, surfaces: usize) {
        self.begin(surfaces);
        let most = seen.inverse_depth.len() * batches.len() * LANES;
        if self.found.len() < most {
            self.found.resize(most, Group::NONE);
        }
        self.count = at_level!(level, simd => match batches.len() {
            1 => find::<_, 1>(simd, batches, seen, &mut self.found, &mut self.next),
            2 => find::<_, 2>(simd, batches, seen, &mut self.found, &mut self.next),
            3 => find::<_, 3>(simd, batches, seen, &mut self.found, &mut self.next),
            _ => find::<_, BATCHES>(simd, batches, seen, &mut self.found, &mut self.next),
        });
        self.sort(surfaces);
    }

    /// Each sample of the batch that was kept first by itself.
    pub(super) fn find_singles(&mut self, batch: &Batch, seen: &Visibility, surfaces: usize) {
        self.begin(surfaces);
        self.found.clear();
        for (block, ids) in seen.kept(0).iter().enumerate().filter(|(block, _)| seen.is_wanted(*block)) {
            for (lane, &id) in ids.iter().enumerate().filter(|(lane, _)| batch.live >> lane & 1 == 1) {
                self.found.push(Group { block: block as u16, lanes: 1 << lane, id });
                self.next[(id as usize).min(surfaces) + 1] += 1;
            }
        }
        self.count = self.found.len();
        self.sort(surfaces);
    }

    /// Leaves of each group only the lanes that `inside` says.
    pub(crate) fn clip(&mut self, inside: impl Fn(&Group) -> u64) {
        let (mut from, mut to) = (0, 0);
        for end in &mut self.next {
            for at in from..*end as usize {
                let group = self.sorted[at];
                let lanes = group.lanes & inside(&group);
                if lanes != 0 {
                    self.sorted[to] = Group { lanes, ..group };
                    to += 1;
                }
            }
            (from, *end) = (*end as usize, to as u32);
        }
    }

    fn begin(&mut self, surfaces: usize) {
        self.next.clear();
        self.next.resize(surfaces + 2, 0);
    }

    fn sort(&mut self, surfaces: usize) {
        for i in 1..self.next.len() {
            self.next[i] += self.next[i - 1];
        }
        if self.sorted.len() < self.count {
            self.sorted.resize(self.count, Group::NONE);
        }
        for group in &self.found[..self.count] {
            let place = &mut self.next[(group.id as usize).min(surfaces)];
            self.sorted[*place as usize] = *group;
            *place += 1;
        }
    }
}

/// The groups of `N` batches into `found`, and for each surface, one place further in `counts`, how many there are. Tells how
/// many there are in all.
///
/// Which samples are left of a block is known only once its last group is, so several blocks go side by side (four took 0.55 of
/// the time of one on Sponza, 0.65 on the tower; two 0.6).
#[inline(always)]
fn find<S: Simd, const N: usize>(
    simd: S,
    batches: &[Batch],
    seen: &Visibility,
    found: &mut [Group],
    counts: &mut [u32],
) -> usize {
    let live = all_live(batches);
    let nothing = counts.len() - 2;
    let mut count = 0;
    for block in (0..seen.inverse_depth.len()).step_by(REGION).filter(|&block| seen.is_wanted(block)) {
        let mut ids = [&[[NOTHING; LANES]; REGION]; N];
        for (number, ids) in ids.iter_mut().enumerate() {
            if let Some(row) = seen.kept(number).get(block..).and_then(|rest| rest.first_chunk()) {
                *ids = row;
            }
        }
        let mut rest = [live; REGION];
        while rest != [0; REGION] {
            for (at, rest) in rest.iter_mut().enumerate() {
                // Where no sample of this block is left, what is found counts for nothing.
                let first = rest.trailing_zeros() as usize;
                let id = ids[first / LANES % N][at % REGION][first % LANES];
                let wanted = u32x16::splat(simd, id);
                let mut same = 0;
                for (number, ids) in ids.iter().enumerate() {
                    let equal = u32x16::load_array_ref(simd, &ids[at % REGION]).simd_eq(wanted).to_bitmask();
                    same |= equal << (LANES * number);
                }
                let lanes = same & *rest;
                let is_some = *rest != 0;
                if let Some(slot) = found.get_mut(count) {
                    *slot = Group { block: (block + at) as u16, lanes, id };
                }
                counts[(id as usize).min(nothing) + 1] += u32::from(is_some);
                count += usize::from(is_some);
                // Whatever is there: the first lane itself is of the group.
                *rest &= !lanes & rest.wrapping_sub(1);
            }
        }
    }
    count
}

/// The lanes of up to four batches that are in use.
fn all_live(batches: &[Batch]) -> u64 {
    let each = batches.iter().take(BATCHES).enumerate();
    each.fold(0, |live, (number, batch)| live | u64::from(batch.live) << (LANES * number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::visibility::EVERYWHERE;
    use crate::simd::SimdLevel;

    #[test]
    fn samples_of_four_batches_are_grouped_by_what_they_see() {
        let batches: [Batch; 4] = std::array::from_fn(|i| Batch { live: 0xffff >> i, ..Batch::of_cell(0) });
        let id = |batch: usize, block: usize, lane: usize| match (batch * 7 + block * 3 + lane) % 5 {
            4 => NOTHING,
            id => id as u32,
        };
        let mut seen = Visibility::new();
        for number in 0..4 {
            seen.clear(1, 1, EVERYWHERE);
            for (block, ids) in seen.id.iter_mut().enumerate() {
                *ids = std::array::from_fn(|lane| id(number, block, lane));
            }
            seen.keep(number);
        }
        let mut groups = Groups::default();
        for count in 1..=4 {
            groups.find(SimdLevel::best().level(), &batches[..count], &seen, 4);
            let mut met = vec![0u64; 1024];
            for group in groups.runs().flatten() {
                assert_eq!(met[usize::from(group.block)] & group.lanes, 0);
                met[usize::from(group.block)] |= group.lanes;
                for lane in (0..64).filter(|lane| group.lanes >> lane & 1 == 1) {
                    assert_eq!(group.id, id(lane / 16, usize::from(group.block), lane % 16));
                }
            }
            assert!(met.iter().all(|&lanes| lanes == all_live(&batches[..count])));
            // One group for each of the four surfaces, and one that sees nothing.
            let runs: Vec<&[Group]> = groups.runs().collect();
            assert_eq!(runs.iter().map(|run| run.len()).sum::<usize>(), 5 * 1024);
            assert!(runs.windows(2).all(|two| two[0][0].id < two[1][0].id));
            assert!(runs.iter().all(|run| run.iter().all(|group| group.id == run[0].id)));
        }
        groups.find(SimdLevel::best().level(), &batches, &seen, 4);
        groups.clip(|group| if group.block < 500 { 0xff } else { 0 });
        for run in groups.runs() {
            assert!(
                run.iter().all(|group| group.id == run[0].id && group.block < 500 && group.lanes <= 0xff)
            );
        }
        let lanes: u32 = groups.runs().flatten().map(|group| group.lanes.count_ones()).sum();
        assert_eq!(lanes, 500 * 8);
        groups.find_singles(&batches[3], &seen, 4);
        let singles: Vec<&Group> = groups.runs().flatten().collect();
        assert_eq!(singles.len(), 13 * 1024);
        assert!(singles.is_sorted_by_key(|group| group.id));
        assert!(singles.iter().all(|group| group.lanes.is_power_of_two()));
    }
}
