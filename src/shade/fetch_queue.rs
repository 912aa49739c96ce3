//! Texture look-ups that wait for each other: the places of 16 batches are computed before the texels of any are fetched.
//!
//! In: places, whose they are, and the level and filter that they share, from [`super::textured`]. Out: [`Reads`], for each group `sum
//! texel` over its even and its odd samples and, where the light differs between them, `sum texel light`. The look-ups themselves are
//! [`super::fetch`]'s.
//!
//! No processor looks farther ahead than one batch: it would wait for texels with places still to compute.

use super::fetch::{nearest_texels, sum};
use super::interpolate::{Around, Between};
use super::mip_level::Choice;
use super::texel::{FULL, texel};
use crate::raster::LANES;
use crate::simd::apart;
use fearless_simd::{Simd, SimdBase, f32x16};
use glam::Vec4;

/// Look-ups of one choice that wait.
pub(super) struct Queue {
    count: usize,
    /// Whose they are, which lanes look, and which of these belong to the odd half.
    owners: [(u8, u16, u16); WAITING],
    each_owner: [[u8; LANES]; WAITING],
    /// What the light of each is weighed by, where it is.
    weights: [[f32; LANES]; WAITING],
    /// The share of the sun's light that each receives, where that differs from sample to sample.
    lights: [[f32; LANES]; WAITING],
    nearest: [[u32; LANES]; WAITING],
    between: [Around; WAITING],
}

/// How many batches' look-ups wait.
const WAITING: usize = 16;

/// What the samples of 16 groups read: those of the even half of group `i` are number `2 i`, of the odd the next.
pub(super) struct Reads {
    /// Sums of their colours, weighed.
    pub all: [Vec4; 2 * LANES],
    /// The same, each by the share of the sun's light that the sample receives, where that differs from sample to sample.
    pub lit: [Vec4; 2 * LANES],
}

impl Reads {
    pub(super) const NONE: Self = Self { all: [Vec4::ZERO; 2 * LANES], lit: [Vec4::ZERO; 2 * LANES] };

    /// Nothing yet.
    #[inline(always)]
    pub(super) fn clear(&mut self, are_lit: bool) {
        self.all = [Vec4::ZERO; 2 * LANES];
        if are_lit {
            self.lit = [Vec4::ZERO; 2 * LANES];
        }
    }

    #[inline(always)]
    fn add<const WEIGHED: bool, const LIT: bool>(&mut self, owner: u8, color: Vec4, weight: f32, light: f32) {
        let owner = usize::from(owner) % (2 * LANES);
        let color = if WEIGHED { color * weight } else { color };
        self.all[owner] += color;
        if LIT {
            self.lit[owner] += color * light;
        }
    }
}

impl Queue {
    pub(super) const NONE: Self = Self {
        count: 0,
        owners: [(0, 0, 0); WAITING],
        each_owner: [[0; LANES]; WAITING],
        weights: [[0.0; LANES]; WAITING],
        lights: [[0.0; LANES]; WAITING],
        nearest: [[0; LANES]; WAITING],
        between: [Around::NOWHERE; WAITING],
    };

    /// Those of `lanes`, which look right and down from the texture's anchor.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        choice: Choice<'_>,
        at: [f32x16<S>; 2],
        owner: (u8, u16, u16),
        reads: &mut Reads,
    ) {
        if self.place(simd, choice, at, owner) {
            self.fetch(simd, choice, reads);
        }
    }

    /// Computes places; tells whether no more can wait.
    #[inline(always)]
    fn place<S: Simd>(
        &mut self,
        simd: S,
        choice: Choice<'_>,
        [right, down]: [f32x16<S>; 2],
        owner: (u8, u16, u16),
    ) -> bool {
        let at = self.count % WAITING;
        self.owners[at] = owner;
        if choice.nearest {
            self.nearest[at] = nearest_texels(simd, choice, right, down);
        } else {
            self.between[at] = Around::new(simd, choice, [right, down]);
        }
        self.count = at + 1;
        self.count == WAITING
    }

    /// Samples side by side, each with an owner of its own, as many as there are, and with a weight and a share of the sun's light where
    /// these are wanted.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    pub(super) fn add_packed<S: Simd>(
        &mut self,
        simd: S,
        choice: Choice<'_>,
        at: [f32x16<S>; 2],
        (owners, filled): (&[u8; LANES], usize),
        (weights, lights): (Option<f32x16<S>>, Option<f32x16<S>>),
        reads: &mut Reads,
    ) {
        let number = self.count % WAITING;
        self.each_owner[number] = *owners;
        if let Some(weights) = weights {
            weights.store_array(&mut self.weights[number]);
        }
        if let Some(lights) = lights {
            lights.store_array(&mut self.lights[number]);
        }
        if self.place(simd, choice, at, (0, filled as u16, 0)) {
            self.fetch_packed(simd, choice, (weights.is_some(), lights.is_some()), reads);
        }
    }

    /// Adds what they read, weighed or not, to each owner's sum, and where they are lit by shares of their own to another by these; none
    /// waits any more.
    #[inline(always)]
    pub(super) fn fetch_packed<S: Simd>(
        &mut self,
        simd: S,
        choice: Choice<'_>,
        (are_weighed, are_lit): (bool, bool),
        reads: &mut Reads,
    ) {
        // Asked once, and not for each sample.
        apart!(
            simd,
            match (are_weighed, are_lit) {
                (false, false) => self.fetch_each::<S, false, false>(simd, choice, reads),
                (false, true) => self.fetch_each::<S, false, true>(simd, choice, reads),
                (true, false) => self.fetch_each::<S, true, false>(simd, choice, reads),
                (true, true) => self.fetch_each::<S, true, true>(simd, choice, reads),
            }
        )
    }

    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    fn fetch_each<S: Simd, const WEIGHED: bool, const LIT: bool>(
        &mut self,
        simd: S,
        choice: Choice<'_>,
        reads: &mut Reads,
    ) {
        let texels = &choice.level.texels[..];
        let count = std::mem::take(&mut self.count);
        for (at, &(_, filled, _)) in self.owners.iter().enumerate().take(count) {
            // By number: iterators side by side go through memory, 24 instructions a sample.
            let (owners, weights, lights) = (&self.each_owner[at], &self.weights[at], &self.lights[at]);
            let filled = usize::from(filled).min(LANES);
            if choice.nearest {
                let places = &self.nearest[at];
                for lane in 0..filled {
                    let color = texel(texels, places[lane] as usize) * FULL;
                    reads.add::<WEIGHED, LIT>(owners[lane], color, weights[lane], lights[lane]);
                }
            } else {
                let between = Between::new(simd, choice, &self.between[at]);
                for lane in 0..filled {
                    reads.add::<WEIGHED, LIT>(owners[lane], between.at(lane), weights[lane], lights[lane]);
                }
            }
        }
    }

    /// Adds what they read to their owners' sums; none waits any more.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    pub(super) fn fetch<S: Simd>(&mut self, simd: S, choice: Choice<'_>, reads: &mut Reads) {
        let texels = &choice.level.texels[..];
        let count = std::mem::take(&mut self.count);
        for (at, &(owner, lanes, odd)) in self.owners.iter().enumerate().take(count) {
            let halves = [lanes & !odd, lanes & odd];
            // No closure here: see `Between::sums`.
            let [even, odd] = if choice.nearest {
                let places = &self.nearest[at];
                [sum(texels, places, halves[0]), sum(texels, places, halves[1])]
            } else {
                Between::new(simd, choice, &self.between[at]).sums(halves)
            };
            let owner = 2 * usize::from(owner) % (2 * LANES);
            reads.all[owner] += even;
            reads.all[owner + 1] += odd;
        }
    }
}
