//! What up to 16 groups of samples that see one surface read from its texture: groups in, the sums of their colours out.
//!
//! For [`super::run`], and in part for [`super::shadowed`]: over the even and over the odd samples of a group `sum texel(s, t)`,
//! or `k texel(s, t)` of `k` samples where one look-up is shared; with falloff each sample counts by its weight.
//!
//! The pixel's footprint is computed at each group's mean place. Where the texture is smooth as far as a group's samples
//! look, one look-up at their mean place stands for all of them. Elsewhere each sample looks for itself
//! ([`gather`]): samples of small groups side by side ([`super::packed`]), those of groups that are nearly full by themselves.
//! Where the light differs from sample to sample, each colour is summed a second time by its sample's share of the sun's.

use super::coordinates::{Coordinates, reaches};
use super::fetch;
use super::fetch_queue::{Queue, Reads};
use super::lanes::{lanes_of, of_first, of_groups};
use super::look::{Look, Placed};
use super::mip_level::{self, Choice};
use super::packed::Packed;
use super::rays::Places;
use super::samples::Samples;
use super::slope::Slope;
use crate::raster::batch::Batch;
use crate::raster::group::{Group, batches_of};
use crate::raster::{BATCHES, LANES};
use crate::scene::{Material, Smooth, Texture};
use crate::simd::apart;
use fearless_simd::{Simd, SimdBase, SimdMask, f32x16, u32x16};
use glam::Vec4;

/// Where a group has this many samples of a batch, they look into the texture by themselves.
const DENSE: u32 = 8;

/// A surface's texture in a tile, for up to four batches of samples.
pub(super) struct Textured<'a, S: Simd> {
    map: &'a Texture,
    samples: &'a Samples<'a>,
    placed: &'a Placed,
    /// At the samples of each batch, as functions of their block's place; none before a group's samples look by themselves, which
    /// most surfaces' do not.
    coordinates: [Option<Coordinates<S>>; BATCHES],
}

/// Look-ups on their way, used again from surface to surface.
pub(crate) struct LookUps {
    waiting: Queue,
    pub(super) packed: Packed,
}

impl Default for LookUps {
    fn default() -> Self {
        Self { waiting: Queue::NONE, packed: Packed::default() }
    }
}

/// Look-ups at the mean places of 16 groups.
pub(super) struct Shared<S: Simd> {
    /// Groups whose samples all see this colour.
    pub which: u16,
    pub texels: [Vec4; LANES],
    /// The levels of the texture that the others' samples look into.
    pub levels: u32x16<S>,
}

impl<'a, S: Simd> Textured<'a, S> {
    /// None without a texture.
    #[inline(always)]
    pub(super) fn new(material: &'a Material, look: &'a Look, samples: &'a Samples<'a>) -> Option<Self> {
        let (map, placed) = (material.diffuse_map.as_deref()?, look.texture.as_ref()?);
        Some(Self { map, samples, placed, coordinates: [None; BATCHES] })
    }

    /// Adds what `groups`, whose mean places are `at`, read; with a slope, also by the light that each sample receives.
    #[inline(always)]
    pub(super) fn reads(
        &mut self,
        simd: S,
        groups: &[Group],
        at: &Places<S>,
        slope: Option<&Slope<'_>>,
        look_ups: &mut LookUps,
        reads: &mut Reads,
    ) {
        let Shared { which: shared, texels, levels } = apart!(simd, self.shared(simd, groups, at));
        if shared != 0 {
            for (i, group) in groups.iter().enumerate().take(LANES) {
                let [even, odd] = self.samples.totals(simd, group);
                (reads.all[2 * i], reads.all[2 * i + 1]) = (texels[i] * even, texels[i] * odd);
            }
            if let Some(slope) = slope {
                let packed = &mut look_ups.packed;
                let lights = apart!(simd, slope.totals(simd, self.samples, groups, shared, packed));
                for (i, (lit, light)) in reads.lit.iter_mut().zip(lights).enumerate() {
                    *lit = texels[i / 2] * light;
                }
            }
        }
        let mut rest = of_groups(groups) & !shared;
        while rest != 0 {
            let (level, same) = of_first(simd, levels, rest);
            if let Some(choice) = Choice::colour(self.map, level, self.placed.anchor) {
                let sparse = match (slope, self.samples.falloff) {
                    (None, None) => apart!(simd, self.full(simd, choice, (groups, same), look_ups, reads)),
                    _ => lanes_of(groups, same),
                };
                apart!(simd, self.packed(simd, choice, (groups, &sparse), slope, look_ups, reads));
            }
            rest &= !same;
        }
    }

    /// The one look-up of each group that needs no more: a single sample, or many that look where the texture is smooth.
    #[inline(always)]
    pub(super) fn shared(&self, simd: S, groups: &[Group], at: &Places<S>) -> Shared<S> {
        let (map, size) = (self.map, mip_level::size(self.map));
        let coordinates = Coordinates::new(&self.placed.functions, at.u, at.v);
        let spots = coordinates.at(simd, at.x, at.y);
        let places = spots.usable(simd);
        let levels = mip_level::colour_levels(simd, coordinates.width_squared(&spots, size));
        let mut which = of_groups(groups);
        if !self.samples.single {
            let finest = if self.samples.alone || map.smooth.is_empty() {
                None
            } else {
                Choice::colour(map, 0, self.placed.anchor)
            };
            if let Some(choice) = finest {
                let ranges = self.samples.means.ranges;
                let [right, down] = reaches(&self.placed.functions, &coordinates, at, &spots, ranges, size);
                let reach = f32x16::splat(simd, Smooth::REACH);
                let near = (right.simd_le(reach) & down.simd_le(reach)).to_bitmask() as u16;
                which &= near & levels.simd_eq(u32x16::splat(simd, 0)).to_bitmask() as u16;
                if which != 0 {
                    which &= fetch::smooth(simd, map, choice, places);
                }
            } else {
                which = 0;
            }
        }
        let mut texels = [Vec4::ZERO; LANES];
        self.read(simd, levels, places, which, &mut texels);
        Shared { which, texels, levels }
    }

    /// The texels at those of 16 places that are in the mask `which`, each from its level.
    #[inline(always)]
    fn read(
        &self,
        simd: S,
        levels: u32x16<S>,
        spots: [f32x16<S>; 2],
        which: u16,
        texels: &mut [Vec4; LANES],
    ) {
        let mut rest = which;
        while rest != 0 {
            let (level, same) = of_first(simd, levels, rest);
            rest &= !same;
            if let Some(choice) = Choice::colour(self.map, level, self.placed.anchor) {
                fetch::each(simd, choice, spots, same, texels);
            }
        }
    }

    /// How the samples of a group look into the texture by themselves, and where.
    #[inline(always)]
    pub(super) fn alone(
        &mut self,
        simd: S,
        group: &Group,
        level: usize,
    ) -> Option<(Choice<'a>, [f32x16<S>; 2])> {
        let choice = Choice::colour(self.map, level, self.placed.anchor)?;
        Some((choice, self.places(simd, group, (0, self.samples.batches.first()?))))
    }

    /// Where the samples of batch `number` look.
    #[inline(always)]
    fn places(&mut self, simd: S, group: &Group, (number, batch): (usize, &Batch)) -> [f32x16<S>; 2] {
        let corner = self.samples.corner(group);
        let (x, y) = (f32x16::splat(simd, corner.x), f32x16::splat(simd, corner.y));
        let known = &mut self.coordinates[number % BATCHES];
        let coordinates = match known {
            Some(coordinates) => coordinates,
            None => known.insert(Coordinates::of_batch(simd, &self.placed.functions, batch)),
        };
        coordinates.at(simd, x, y).usable(simd)
    }

    /// Of the groups of the mask `which` those samples that fill half of a batch, each batch by itself. What is left of
    /// each group comes back.
    #[inline(always)]
    fn full(
        &mut self,
        simd: S,
        choice: Choice<'_>,
        (groups, which): (&[Group], u16),
        look_ups: &mut LookUps,
        reads: &mut Reads,
    ) -> [u64; LANES] {
        let mut sparse = [0; LANES];
        let mut rest = which;
        while rest != 0 {
            let i = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let Some(group) = groups.get(i) else { continue };
            let dense = dense_lanes(group.lanes);
            sparse[i] = group.lanes & !dense;
            for number in batches_of(dense) {
                let Some(batch) = self.samples.batches.get(number) else { continue };
                let at = self.places(simd, group, (number, batch));
                let lanes = group.lanes_of(number);
                look_ups.waiting.add(simd, choice, at, (i as u8, lanes, batch.odd), reads);
            }
        }
        look_ups.waiting.fetch(simd, choice, reads);
        sparse
    }

    /// These samples of each group side by side, whichever group they belong to.
    #[inline(always)]
    fn packed(
        &self,
        simd: S,
        choice: Choice<'_>,
        (groups, sparse): (&[Group], &[u64; LANES]),
        slope: Option<&Slope<'_>>,
        look_ups: &mut LookUps,
        reads: &mut Reads,
    ) {
        let LookUps { waiting, packed } = look_ups;
        packed.fill(self.samples, groups, sparse);
        for number in 0..packed.batches() {
            let (places, owners, filled) = packed.batch(simd, number);
            let coordinates = Coordinates::new(&self.placed.functions, places.u, places.v);
            let spots = coordinates.at(simd, places.x, places.y).usable(simd);
            let lights = match slope {
                Some(slope) => Some(slope.light(simd, self.samples.rays, &places)),
                None => None,
            };
            let shares = (self.samples.weights(simd, &places), lights);
            waiting.add_packed(simd, choice, spots, (owners, filled), shares, reads);
        }
        waiting.fetch_packed(simd, choice, (self.samples.falloff.is_some(), slope.is_some()), reads);
    }
}

/// Those of `lanes` that fill half of a batch. Asked of all batches before any is looked up: for which it is so nothing foresees.
#[inline(always)]
fn dense_lanes(lanes: u64) -> u64 {
    let mut dense = 0;
    for number in 0..BATCHES {
        let part = lanes & 0xffff << (LANES * number);
        dense |= if part.count_ones() >= DENSE { part } else { 0 };
    }
    dense
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::batch::Pattern;
    use crate::scene::Level;
    use crate::shade::rays::Rays;
    use crate::shade::samples::LaneSums;
    use crate::simd::{SimdLevel, at_level};
    use glam::Vec3;
    use std::sync::Arc;

    fn random(seed: usize) -> f32 {
        let x = (seed as u32 ^ 0x9e37).wrapping_mul(0x7feb_352d);
        let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
        (x ^ x >> 16) as f32 / 4_294_967_296.0
    }

    /// What the groups read from a texture of 64 x 64 texels, each of which is a third of a pixel to two pixels wide.
    fn reads(texture: Texture, groups: &[Group]) -> [Vec4; 2 * LANES] {
        let batches = [0, 1000, 2000, 3000].map(|start| Batch {
            u: std::array::from_fn(|i| random(start + i)),
            v: std::array::from_fn(|i| random(start + 100 + i)),
            x: std::array::from_fn(|i| random(start + 200 + i)),
            y: std::array::from_fn(|i| random(start + 300 + i)),
            live: 0xffff,
            odd: 0xff00,
            ..Batch::of_cell(0)
        });
        let mut functions = [Vec4::ZERO; 9];
        functions[0] = Vec4::new(0.2, 0.1, 1.0, 0.0);
        (functions[1], functions[2]) = (Vec4::X * 0.02, Vec4::Y * 0.02);
        (functions[3], functions[6]) =
            (Vec4::new(0.008, 0.002, 0.001, 0.0), Vec4::new(0.0, 0.02, 0.003, 0.0));
        let look = Look {
            material: 0,
            texture: Some(Placed { functions, anchor: [77, 200] }),
            opacity: None,
            normal: None,
            face: Vec3::Z,
            lit: [Vec3::ONE; 2],
            plane: None,
        };
        let material = Material { diffuse_map: Some(Arc::new(texture)), ..Material::default_surface() };
        let rays = Rays { p: Vec3::NEG_Z, dx: Vec3::X, dy: Vec3::Y, focal_length: 1.0, radius: 1.0 };
        let samples = Samples {
            batches: &batches,
            means: &LaneSums::new(&batches),
            rays: &rays,
            pattern: &Pattern { block_bits: [0; 2], batches: Vec::new() },
            single: false,
            alone: false,
            falloff: None,
        };
        at_level!(SimdLevel::best().level(), simd => {
            let mut texture = Textured::new(&material, &look, &samples).unwrap();
            let mut reads = Reads::NONE;
            let at = samples.places(simd, groups);
            texture.reads(simd, groups, &at, None, &mut LookUps::default(), &mut reads);
            reads.all
        })
    }

    fn texture(texel: impl Fn(u32, u32) -> f32) -> Texture {
        let texels = (0..64 * 64)
            .map(|i| [(texel(i % 64, i / 64) * 65535.0) as u16, 40000, i as u16, u16::MAX])
            .collect();
        Texture::from_level(Level { width: 64, height: 64, texels }).unwrap()
    }

    fn groups(lanes: [u64; LANES]) -> [Group; LANES] {
        std::array::from_fn(|i| Group { block: (37 * i) as u16, lanes: lanes[i], id: 0 })
    }

    #[test]
    fn packed_samples_read_what_they_read_alone() {
        let noise = texture(|x, y| random((64 * y + x) as usize));
        let some = groups(std::array::from_fn(|i| {
            [0x8421_0000_ffff_0001, 0x8421, 0xfff0_ffff_0000_0001, 0x0ff0_0000][i % 4] << (i / 8)
        }));
        let together = reads(noise.clone(), &some);
        for (i, &group) in some.iter().enumerate() {
            let mut alone = [Vec4::ZERO; 2];
            for number in group.batches() {
                let part = Group { lanes: group.lanes & 0xffff << (LANES * number), ..group };
                let one = reads(noise.clone(), &[part]);
                alone = [alone[0] + one[0], alone[1] + one[1]];
            }
            for half in 0..2 {
                let gap = (together[2 * i + half] - alone[half]).abs().max_element();
                assert!(gap < 1e-5, "group {i}: {gap}");
            }
        }
    }

    #[test]
    fn a_shared_look_up_reads_what_all_read_where_the_texture_is_smooth() {
        // Fields of slopes, in steps of an eighth of a bit less than the tolerance.
        let fields = texture(|x, y| (x / 32) as f32 * 0.5 + (y as f32 * 0.006 / 0.003).floor() * 0.003);
        assert!(!fields.smooth.is_empty());
        let unshared = Texture { smooth: Arc::default(), ..fields.clone() };
        let all = groups([u64::MAX; LANES]);
        let (found, wanted) = (reads(fields, &all), reads(unshared, &all));
        let mut differ = 0;
        for (found, wanted) in found.iter().zip(&wanted) {
            let gap = (*found - *wanted) / 32.0;
            differ += u32::from(gap.x != 0.0);
            assert!(gap.x.abs() < 0.004 && gap.y.abs() < 1e-4, "{gap}");
        }
        assert!(differ > 0, "nothing was shared");
    }
}
