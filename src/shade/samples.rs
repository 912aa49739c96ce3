//! The samples of up to four batches in one tile, as shading takes them: where groups of them lie, and which pixels they belong to.
//!
//! In: batches (`raster::view`), groups of them (`raster::group`), and at the end each group's light ([`super::run`], [`super::shadowed`]).
//! Out: a group's place, the mean of its samples' `u, v, x, y`; what each sample's light is to be weighed by; and the sums of light, over
//! the even and over the odd samples of a group's pixel, which `render::resolve` takes up.

use super::falloff::Falloff;
use super::lanes::total;
use super::rays::{Places, Rays};
use crate::raster::batch::{Batch, Pattern, from_center};
use crate::raster::group::Group;
use crate::raster::{BATCHES, LANES, TILE};
use fearless_simd::{Simd, SimdBase, f32x16};
use glam::{Vec2, Vec4};

/// What groups of samples are made of: sums over lanes for each value of each four bits of a mask, so that the mean of any
/// group costs four loads a batch.
pub(crate) struct LaneSums {
    sums: [[[Vec4; 16]; 4]; BATCHES],
    lanes: [Vec4; BATCHES * LANES],
    /// The most that two lanes lie apart: `u`, `v`, `x`, `y`; and the middle between these.
    pub(super) ranges: Vec4,
    middle: Vec4,
    /// Lanes whose samples belong to the other half of the error estimate.
    pub(super) odd: u64,
}

/// One over the number of lanes.
const INVERSE: [f32; 2 * BATCHES * LANES] = {
    let mut inverse = [0.0; 2 * BATCHES * LANES];
    let mut i = 1;
    while i < inverse.len() {
        inverse[i] = 1.0 / i as f32;
        i += 1;
    }
    inverse
};

impl LaneSums {
    pub(crate) fn new(batches: &[Batch]) -> Self {
        let lane = |batch: &Batch, i: usize| Vec4::new(batch.u[i], batch.v[i], batch.x[i], batch.y[i]);
        let mut all = Self {
            sums: [[[Vec4::ZERO; 16]; 4]; BATCHES],
            lanes: [Vec4::ZERO; BATCHES * LANES],
            ranges: Vec4::ZERO,
            middle: Vec4::ZERO,
            odd: 0,
        };
        let (mut low, mut high) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        let each_lane = all.lanes.chunks_exact_mut(LANES);
        for (number, ((sums, lanes), batch)) in all.sums.iter_mut().zip(each_lane).zip(batches).enumerate() {
            lanes.iter_mut().enumerate().for_each(|(i, place)| *place = lane(batch, i));
            all.odd |= u64::from(batch.odd) << (LANES * number);
            for (part, sums) in sums.iter_mut().enumerate() {
                for mask in 1..sums.len() {
                    let bit = mask.trailing_zeros() as usize;
                    sums[mask] = sums[mask & (mask - 1)] + lane(batch, 4 * part + bit);
                }
            }
            for i in (0..LANES).filter(|i| batch.live >> i & 1 == 1) {
                (low, high) = (low.min(lane(batch, i)), high.max(lane(batch, i)));
            }
        }
        if low.cmple(high).all() {
            (all.ranges, all.middle) = (high - low, 0.5 * (low + high));
        }
        all
    }

    /// The place of a lane, from the block's corner.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> Vec4 {
        self.lanes[lane % (BATCHES * LANES)]
    }

    /// 1 for a lane of the odd half.
    #[inline(always)]
    pub(super) fn odd_bit(&self, lane: usize) -> u8 {
        (self.odd >> (lane % (BATCHES * LANES)) & 1) as u8
    }

    /// The mean place of `lanes`, which are not none, from the block's corner.
    #[inline(always)]
    fn mean(&self, lanes: u64) -> Vec4 {
        let part = |number: usize| {
            let [a, b, c, d] = &self.sums[number % BATCHES];
            let lanes = lanes >> (LANES * (number % BATCHES));
            let part = |sums: &[Vec4; 16], shift: u32| sums[(lanes >> shift) as usize & 15];
            part(a, 0) + part(b, 4) + part(c, 8) + part(d, 12)
        };
        let first = lanes.trailing_zeros() as usize / LANES % BATCHES;
        // Which of several batches it has lanes of nothing foresees: sooner all of them, and zeros of some.
        let sum = if lanes >> (LANES * first) >> LANES == 0 {
            part(first)
        } else {
            part(0) + part(1) + part(2) + part(3)
        };
        sum * INVERSE[lanes.count_ones() as usize % INVERSE.len()]
    }
}

/// What all groups of up to four batches in one tile share.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'a> {
    pub batches: &'a [Batch],
    pub means: &'a LaneSums,
    pub rays: &'a Rays,
    pub pattern: &'a Pattern,
    /// Every group is a single sample, and looks into the texture exactly there.
    pub single: bool,
    /// Samples share no look-up.
    pub alone: bool,
    pub falloff: Option<&'a Falloff>,
}

/// Sums of the even and the odd samples of each pixel of a tile: red, green and blue.
pub(crate) type Sums = [[Vec4; 2]];

impl Samples<'_> {
    /// The place of a group's block from the tile's centre.
    #[inline(always)]
    pub(super) fn corner(&self, group: &Group) -> Vec2 {
        from_center(self.pattern.corner(u32::from(group.block)))
    }

    /// The mean place of a group.
    #[inline(always)]
    fn place(&self, group: &Group) -> Vec4 {
        let corner = self.corner(group);
        let mean = if self.single {
            self.means.lane(group.lanes.trailing_zeros() as usize)
        } else {
            self.means.mean(group.lanes)
        };
        mean + Vec4::new(0.0, 0.0, corner.x, corner.y)
    }

    /// The mean places of up to 16 groups.
    #[inline(always)]
    pub(super) fn places<S: Simd>(&self, simd: S, groups: &[Group]) -> Places<S> {
        let mut rows = [[0.0; 4]; LANES];
        for (row, group) in rows.iter_mut().zip(groups) {
            *row = self.place(group).to_array();
        }
        Places::of_rows(simd, &rows)
    }

    /// The middles of what the samples of up to 16 groups may lie in.
    #[inline(always)]
    pub(super) fn middles<S: Simd>(&self, simd: S, groups: &[Group]) -> Places<S> {
        let mut rows = [[0.0; 4]; LANES];
        for (row, group) in rows.iter_mut().zip(groups) {
            let corner = self.corner(group);
            *row = (self.means.middle + Vec4::new(0.0, 0.0, corner.x, corner.y)).to_array();
        }
        Places::of_rows(simd, &rows)
    }

    /// The places of a batch's samples in the block of a group.
    #[inline(always)]
    pub(super) fn of_batch<S: Simd>(&self, simd: S, group: &Group, batch: &Batch) -> Places<S> {
        let corner = self.corner(group);
        Places {
            u: f32x16::load_array_ref(simd, &batch.u),
            v: f32x16::load_array_ref(simd, &batch.v),
            x: f32x16::load_array_ref(simd, &batch.x) + corner.x,
            y: f32x16::load_array_ref(simd, &batch.y) + corner.y,
        }
    }

    /// How many samples of a group belong to the even and the odd half.
    #[inline(always)]
    fn counts(&self, group: &Group) -> [f32; 2] {
        let odd = (group.lanes & self.means.odd).count_ones();
        [(group.lanes.count_ones() - odd) as f32, odd as f32]
    }

    /// What the light of samples at 16 places is to be weighed by; none where it is not to be weighed.
    #[inline(always)]
    pub(super) fn weights<S: Simd>(&self, simd: S, at: &Places<S>) -> Option<f32x16<S>> {
        match self.falloff {
            Some(falloff) => Some(falloff.weights(simd, self.rays, at)),
            None => None,
        }
    }

    /// The sums of these weights over a group's even and odd samples: how many they are, where their light is not weighed.
    #[inline(always)]
    pub(super) fn totals<S: Simd>(&self, simd: S, group: &Group) -> [f32; 2] {
        match self.falloff {
            Some(falloff) => self.weighed(simd, falloff, group),
            None => self.counts(group),
        }
    }

    #[inline(always)]
    fn weighed<S: Simd>(&self, simd: S, falloff: &Falloff, group: &Group) -> [f32; 2] {
        let mut sums = [0.0; 2];
        for number in group.batches() {
            let (lanes, Some(batch)) = (group.lanes_of(number), self.batches.get(number)) else {
                continue;
            };
            let weight = falloff.weights(simd, self.rays, &self.of_batch(simd, group, batch));
            sums[0] += total(simd, weight, lanes & !batch.odd);
            sums[1] += total(simd, weight, lanes & batch.odd);
        }
        sums
    }

    /// Adds the light of a group's even and odd samples, weighed already, to its pixel.
    #[inline(always)]
    pub(super) fn add(&self, group: &Group, colors: [Vec4; 2], sums: &mut Sums) {
        let pixel = self.pattern.corner(u32::from(group.block));
        if let Some([even, odd]) = sums.get_mut((pixel.1 * TILE + pixel.0) as usize) {
            *even += colors[0];
            *odd += colors[1];
        }
    }

    /// Adds the light of a single sample, weighed already, to its pixel.
    #[inline(always)]
    pub(super) fn add_one(&self, group: &Group, color: Vec4, sums: &mut Sums) {
        let lane = group.lanes.trailing_zeros() as usize;
        let half = usize::from(self.means.odd_bit(lane));
        let Some(batch) = self.batches.get(lane / LANES) else { return };
        let pixel = self.pattern.pixel(self.pattern.corner(u32::from(group.block)), batch, lane % LANES);
        if let Some(halves) = sums.get_mut((pixel.1 * TILE + pixel.0) as usize) {
            halves[half % 2] += color;
        }
    }
}
