//! Lights so small and bright that few samples, or none, meet them: what they may add to a picture that has not seen them. In:
//! the [`lamps`] of a scene and where they are seen; then the errors of a tile's blocks ([`super::resolve`]). Out: these,
//! raised.
//!
//! Two halves of the samples that both miss a light agree, and say that nothing is wrong: false convergence. But geometry
//! knows where the light can be seen. A light of `a` square pixels and radiance `L`, spread over `D`, is met by a share
//! `q = a / D` of the samples of each pixel there, and adds `m = L q` to it. While `n` samples of a pixel are expected to
//! meet it fewer than [`ENOUGH`] times, the error there is taken to be at least what chance makes of it: of `n` samples `k`
//! meet the light, and a pixel that has the brightness `b` without it shows `min(1, b + k L / n)` for `min(1, b + m)`. Where the
//! samples of a whole block should have met it several times, what they saw tells more.

use super::clipped::{self, expected_error, missed_rim};
use super::diffraction::Disk;
use super::lamps::{self, ENOUGH, Lamp};
use super::prepared::Prepared;
use super::resolve::{ByBlock, Sum, block_place, places};
use crate::picture::BLOCK;
use crate::raster::view::View;
use crate::sampling::ApertureShape;
use crate::scene::{Material, Scene};
use crate::shade::ShadowSun;
use fearless_simd::Level;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Times that a light is expected to be met in a block before what is seen of it tells more ([`super::clipped`]): how much of it is
/// not hidden, where, and what clipping hides.
const SEVERAL: f64 = 8.0;

/// Pixels' worth of a light at most that may reach into a block and not be met: its place is that of an ellipse of as large moments.
const RIM: f64 = 8.0;

/// What lights may add to the pixels of a block.
#[derive(Clone, Copy, Default)]
struct Light {
    /// The part of the block that they are spread over, at most 1 for each.
    covered: f64,
    /// The share of a pixel's samples that meet one, times the part.
    share: f64,
    /// Their light, mean over the samples, times the part.
    mean: DVec3,
}

impl Light {
    fn add(&mut self, other: &Self, times: f64) {
        self.covered += times * other.covered;
        self.share += times * other.share;
        self.mean += times * other.mean;
    }
}

/// The small bright lights of a picture.
pub(super) struct Highlights {
    columns: usize,
    /// Block by block, for each disk that diffraction spreads them over: most of a lamp's light is in a few pixels, and some all over
    /// the picture. Empty where there are no such lights.
    lights: Vec<Vec<Light>>,
}

impl Highlights {
    /// What they take for each block and disk of light.
    pub(super) const BLOCK_BYTES: u64 = size_of::<Light>() as u64;

    /// Where [`lamps::find`] finds some.
    pub(super) fn new(
        scene: (&Scene, &[Material]),
        view: (&View, &ApertureShape),
        positions: &[DVec3],
        samples: (u32, f32),
        disks: &[Disk],
        sun: Option<&ShadowSun<'_>>,
        going: (Level, &(dyn Fn() -> bool + Sync)),
    ) -> Self {
        let (columns, rows) = (view.0.width.div_ceil(BLOCK) as usize, view.0.height.div_ceil(BLOCK) as usize);
        // What changes from block to block; sums along rows then give what there is. A span may end past the last column.
        let stride = columns + 2;
        let stop = going.1;
        let Some(lamps) = lamps::find(scene, view, positions, samples, disks, sun, going) else {
            return Self { columns, lights: Vec::new() };
        };
        let of_disk = |disk: &Disk| {
            let mut lights = vec![Light::default(); stride * rows];
            for &Lamp { shown, area, spread } in lamps.iter().take_while(|_| !stop()) {
                let spread = lamps::over(spread, disk);
                let share = (area * disk.share / spread.area()).min(1.0);
                if !share.is_finite() || share == 0.0 {
                    continue;
                }
                let light = Light { covered: 1.0, share, mean: shown * share };
                spread.cover([view.0.width, view.0.height], |row, column, by| {
                    lights[row * stride + column].add(&light, by);
                });
            }
            for row in lights.chunks_mut(stride) {
                for column in 1..row.len() {
                    let left = row[column - 1];
                    row[column].add(&left, 1.0);
                }
            }
            for row in 0..rows {
                lights.copy_within(row * stride..row * stride + columns, row * columns);
            }
            lights.truncate(rows * columns);
            lights
        };
        Self { columns, lights: disks.par_iter().map(of_disk).collect() }
    }

    /// Whether there are no such lights.
    pub(super) fn are_none(&self) -> bool {
        self.lights.is_empty()
    }

    /// What the lights of a block of a tile, of which each of `pixels` has `n` samples, may add to it unseen, disk by disk, and whether
    /// its samples tell more; nothing where it has no lights.
    fn of_block(
        &self,
        tile: (u32, u32),
        block: usize,
        n: u32,
        pixels: f64,
    ) -> impl Iterator<Item = (Unseen, bool)> {
        let (x, y) = block_place(tile, block);
        let at = ((x as usize) < self.columns).then_some(y as usize * self.columns + x as usize);
        let of_disk = move |lights: &Vec<Light>| {
            // Sums and differences leave a trace where there is nothing.
            let light = lights.get(at?).filter(|light| light.share > 1e-12 && n > 0)?;
            let covered = light.covered.clamp(1e-3, 1.0);
            let share = (light.share / covered).min(1.0);
            let hits = f64::from(n) * share;
            let is_seen = hits >= ENOUGH || hits * pixels * covered >= SEVERAL;
            Some((Unseen { pixels: pixels * covered, share, mean: light.mean / covered }, is_seen))
        };
        self.lights.iter().filter_map(of_disk)
    }
}

/// Lights that the samples of a block may have missed.
struct Unseen {
    /// Those under them.
    pixels: f64,
    /// The share of a pixel's samples that meet one, and their light, mean over all.
    share: f64,
    mean: DVec3,
}

impl Unseen {
    /// All of their light.
    fn light(&self) -> f64 {
        self.pixels * self.mean.element_sum()
    }
}

/// The blocks of a tile that were raised, and what is known of all that lights may be unseen in: sums of squared errors by the word of
/// the samples and as raised, and how often pixels are expected to meet such a light.
#[derive(Clone, Copy, Default)]
pub(super) struct Raised {
    pub blocks: u16,
    found: f64,
    raised: f64,
    hits: f64,
}

/// Hits of lights in a picture from which both words about them count: see [`Raised::too_much`].
const MANY: f64 = 32.0;

impl Raised {
    /// With those of another tile.
    pub(super) fn and(self, other: &Self) -> Self {
        let [found, raised, hits] =
            [self.found + other.found, self.raised + other.raised, self.hits + other.hits];
        Self { found, raised, hits, ..self }
    }

    /// How much of a whole picture's squared error, which is that of these blocks and others, is to be taken back where diffraction spreads
    /// lights: chance takes samples to be thrown anywhere, and they are spread evenly, so that lamps of a pixel or two err by less; but what
    /// their samples found may have missed some. Where many meet lights the truth is taken to lie between, at the mean of the logarithms, and
    /// what was found for no less than a quarter. (Lamps 3 and 12 times as bright as white, six seeds, 4 to 64 samples: stated as raised 1.10 to
    /// 1.53 times the true error, as found 0.73 to 1.05.)
    pub(super) fn too_much(&self) -> f64 {
        if self.hits < MANY {
            0.0
        } else {
            self.raised - (self.found.max(0.25 * self.raised) * self.raised).sqrt()
        }
    }
}

impl Prepared<'_> {
    /// Whether geometry tells what a block errs by, and not what its samples saw.
    pub(super) fn is_unseen(&self, tile: (u32, u32), block: usize, n: u32) -> bool {
        let (x, y) = block_place(tile, block);
        let lights = self.highlights.of_block(tile, block, n, f64::from(self.block_pixels(x, y)));
        // Of what most of the light is.
        let most = lights.max_by(|(a, _), (b, _)| a.light().total_cmp(&b.light()));
        most.is_some_and(|(_, is_seen)| !is_seen)
    }

    /// The most that lights make a block err by, whose light diffraction spreads: what [`clipped`] tells of a block that has a lamp in
    /// two of its pixels takes it to be met anywhere. None without diffraction, where it does not; or without lights.
    pub(super) fn most_by_lights(
        &self,
        tile: (u32, u32),
        block: usize,
        (sums, n): (&[Sum], u32),
    ) -> Option<f64> {
        if !self.spreads_lights() {
            return None;
        }
        let (x, y) = block_place(tile, block);
        let room = DVec3::ONE - self.least(tile, block, sums, n).min(DVec3::ONE);
        let lights = self.highlights.of_block(tile, block, n, f64::from(self.block_pixels(x, y)));
        let of_light = |(light, is_seen): (Unseen, bool)| {
            let of_channel = |i: usize| {
                let rim = if is_seen { missed_rim(n, light.mean[i] / light.share, room[i]) } else { 0.0 };
                light.pixels * expected_error(n, light.share, light.mean[i], room[i])
                    + light.pixels.min(RIM) * rim
            };
            of_channel(0) + of_channel(1) + of_channel(2)
        };
        lights.map(of_light).reduce(|a, b| a + b)
    }

    /// Raises the squared errors of the blocks with `samples`, each a sum over pixels and channels, to what unseen lights may
    /// add, or the rims of lights beside the block. Tells what was raised for unseen lights.
    pub(super) fn raise_unseen(
        &self,
        tile: (u32, u32),
        sums: &[Sum],
        samples: &ByBlock<u32>,
        squared: &mut ByBlock<f64>,
    ) -> Raised {
        let mut all = Raised::default();
        let (columns, rows) = (self.view.width.div_ceil(BLOCK), self.view.height.div_ceil(BLOCK));
        for (block, error) in squared.iter_mut().enumerate() {
            let (n, (x, y)) = (samples[block], block_place(tile, block));
            if x >= columns || y >= rows {
                continue;
            }
            let pixels = f64::from(self.block_pixels(x, y));
            let (mut expected, mut has_unseen, found) = (0.0, false, *error);
            let mut room = None;
            for (light, is_seen) in self.highlights.of_block(tile, block, n, pixels) {
                // Where nothing is seen of a light that should be met often, its rim at most reaches into the block.
                if is_seen && (light.pixels > RIM || self.shows_light(tile, block, sums, n)) {
                    continue;
                }
                let room = *room
                    .get_or_insert_with(|| DVec3::ONE - self.least(tile, block, sums, n).min(DVec3::ONE));
                let of_channel = |i: usize| match is_seen {
                    false => expected_error(n, light.share, light.mean[i], room[i]),
                    true => missed_rim(n, light.mean[i] / light.share, room[i]),
                };
                expected += light.pixels * (of_channel(0) + of_channel(1) + of_channel(2));
                has_unseen |= !is_seen;
                all.hits += if is_seen { 0.0 } else { f64::from(n) * light.share * light.pixels };
            }
            if expected > *error {
                *error = expected;
                all.blocks |= u16::from(has_unseen) << block;
            }
            if has_unseen {
                (all.found, all.raised) = (all.found + found, all.raised + *error);
            }
        }
        all
    }

    /// Whether diffraction spreads the lights.
    pub(super) fn spreads_lights(&self) -> bool {
        self.highlights.lights.len() > 1
    }

    /// Whether any pixel of a block shows more than white, or nearly: then its samples tell.
    fn shows_light(&self, tile: (u32, u32), block: usize, sums: &[Sum], n: u32) -> bool {
        let (columns, rows) = self.pixels_of(tile, block);
        let most = places(columns, rows).filter_map(|at| sums.get(at)).fold(0.0, |most: f32, [a, b]| {
            most.max((Vec3::from_array(*a) + Vec3::from_array(*b)).max_element())
        });
        most * self.gain / n as f32 >= 0.5 * clipped::BRIGHT
    }

    /// The least that any pixel of a block shows after `n` samples, channel by channel and not clamped: what is there without a
    /// light that is seldom met.
    fn least(&self, tile: (u32, u32), block: usize, sums: &[Sum], n: u32) -> DVec3 {
        let mut least = Vec3::INFINITY;
        let (columns, rows) = self.pixels_of(tile, block);
        for at in places(columns, rows) {
            if let Some([a, b]) = sums.get(at).map(|sum| sum.map(Vec3::from_array)) {
                least = least.min((a + b) * (self.gain / n as f32));
            }
        }
        least.as_dvec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_back_stands_between_both_words_and_is_half_at_most() {
        let too_much = |found, raised, hits| Raised { blocks: 0, found, raised, hits }.too_much();
        assert_eq!(too_much(0.5, 1.0, 31.0), 0.0);
        assert_eq!(too_much(1.0, 1.0, 32.0), 0.0);
        assert!((too_much(0.64, 1.0, 32.0) - 0.2).abs() < 1e-12);
        assert_eq!(too_much(0.0, 1.0, 1e9), 0.5);
        let [one, other] = [(0.6, 3.0, 20.0), (0.04, 1.0, 12.0)].map(|(found, raised, hits)| Raised {
            blocks: 1,
            found,
            raised,
            hits,
        });
        assert!((one.and(&other).too_much() - 2.0).abs() < 1e-12);
    }
}
