//! Light that is clipped at white, where few samples of a pixel meet it: what chance makes of such pixels. In: both halves of the
//! samples of a block's pixels, brightened and not clipped, from [`super::resolve`]. Out: the squared error of each pixel.
//!
//! A picture shows no more than white, and nor does either half of its samples. Where one sample of a lamp is enough to make a
//! pixel white, the halves agree wherever both met the lamp or both missed it, and their difference says too little: along the rim
//! of a lamp out of focus, or under light that comes through a gap. The pixels around tell more, for there light is met by chance as
//! well. Of `n` samples, each of which meets a light `L` with the chance `p`, the mean is `m = p L` and its variance
//! `s^2 = p (1 - p) L^2 / n`, so `L = (m^2 + n s^2) / m`. Both are measured without clipping: `m` above the darkest pixel, over those
//! near by, and `L` from sums over the block, with `s^2` from the halves. (From the pixels near by alone it was so uncertain that
//! 256 samples of a lamp behind a gap were stated 1.7 instead of 1.5 times as wrong as they are.) That gives the chance of each
//! number of samples that meet the light, and so the mean of the squared error with clipping ([`expected_error`]).
//!
//! The rim of a light that is sharp, or nearly, is another case: beside a pixel that is white in both halves lies one that no sample
//! says anything of, and a small part of it may be light all the same. Rims lie anywhere, so each part is as likely as any other
//! ([`missed_rim`]). Without, blocks with small lamps of 14 times white seemed to be right after 16 samples, and pictures at an error
//! target were wrong by up to five times as much as was asked for.

use glam::{DVec3, Vec3};
use std::ops::{Range, RangeInclusive};

/// What half of the samples of a pixel near by show, at least: else there is nothing to clip.
pub(super) const BRIGHT: f32 = 1.5;

/// Pixels to each side that tell of a pixel: over more the rim of a lamp is not alike. (Four told too much by a fifth.)
const REACH: usize = 2;

/// A pixel whose halves differ by this met the light by chance; of a block with fewer, all pixels together tell more than a few.
const MET: f32 = 0.5;
const FEW: usize = 8;

/// What pixels near by differ by is chance if it is about as much as what their halves differ by, and else a shape: no more than `SHAPE`
/// times that, and no more than one and `DOUBT` standard errors of it, by the number of samples that met the light. (With four times
/// always, 64 samples of lamps that are blurred over five pixels were stated 1.9 times as wrong as they are; 1.3 times so.)
const SHAPE: f64 = 4.0;
const DOUBT: f64 = 5.0;

/// Samples that meet a light so often, on average, spread evenly about it: the halves tell.
const OFTEN: f64 = 100.0;

/// The two halves of the samples of a block's pixels, not clipped, row by row.
pub(super) struct Halves {
    pub width: usize,
    /// Samples of a pixel, two at least: one half has as many as the other, or one more.
    pub samples: u32,
    pub pixels: Vec<[Vec3; 2]>,
}

/// What a channel shows in the pixels near by.
#[derive(Clone, Copy)]
struct Around {
    /// The least, and the mean above it.
    least: f64,
    mean: f64,
    /// The variance of a pixel's mean by its halves.
    noise: f64,
    /// The variance from pixel to pixel.
    change: f64,
    /// How many pixels these are.
    count: f64,
}

/// Columns and rows of pixels in a block.
type Window = [Range<usize>; 2];

impl Halves {
    /// Pixel by pixel the squared error, summed over channels, as what is around tells.
    pub(super) fn errors(&self) -> Vec<f64> {
        // All white, whatever chance does.
        if self.pixels.iter().all(|[a, b]| a.min(*b).min_element() >= 1.0) {
            return vec![0.0; self.pixels.len()];
        }
        let rows = self.pixels.len() / self.width;
        let met = |[a, b]: &&[Vec3; 2]| (*a - *b).abs().max_element() > MET;
        let few = self.pixels.iter().filter(met).count() < FEW;
        let together = [0, 1, 2].map(|channel| self.around(&[0..self.width, 0..rows], channel));
        let lights = together.map(|all| all.light(self.samples));
        let brightest = self.pixels.iter().fold(Vec3::ZERO, |most, [a, b]| most.max(*a).max(*b)).to_array();
        let of_pixel = |at: usize| {
            let (window, own) = (self.near(at, rows), self.own(at).to_array());
            let is_near = few || self.places(&window).any(|at| is_bright(self.pixels[at]));
            let of_channel = |channel: usize| {
                let around = || if few { together[channel] } else { self.around(&window, channel) };
                let told = if is_near { around().error(self.samples, lights[channel]) } else { None };
                let alone = share(self.samples) * own[channel] * own[channel];
                told.unwrap_or_else(|| alone.max(self.rim(at, rows, channel, f64::from(brightest[channel]))))
            };
            of_channel(0) + of_channel(1) + of_channel(2)
        };
        (0..self.pixels.len()).map(of_pixel).collect()
    }

    /// Pixel by pixel the squared error, summed over channels, as its halves differ.
    pub(super) fn differences(&self) -> Vec<f64> {
        let share = share(self.samples);
        (0..self.pixels.len()).map(|at| share * self.own(at).length_squared()).collect()
    }

    /// What a pixel may hide of a light beside it, of which none of its samples tells.
    fn rim(&self, at: usize, rows: usize, channel: usize, light: f64) -> f64 {
        let [x, y] = [at % self.width, at / self.width];
        let beside = [
            (x > 0).then(|| at - 1),
            (x + 1 < self.width).then(|| at + 1),
            (y > 0).then(|| at - self.width),
            (y + 1 < rows).then(|| at + self.width),
        ];
        let most = f64::from(self.pixels[at].map(|half| half[channel]).into_iter().fold(0.0, f32::max));
        // A single sample that meets it would show.
        let is_dark = most < 1.0 && most < light / f64::from(self.samples);
        if !is_dark || !beside.into_iter().flatten().any(|at| is_bright(self.pixels[at])) {
            return 0.0;
        }
        missed_rim(self.samples, light, 1.0 - most)
    }

    /// What a pixel's own halves differ by.
    fn own(&self, at: usize) -> DVec3 {
        let [a, b] = self.pixels[at].map(|half| half.clamp(Vec3::ZERO, Vec3::ONE));
        (a - b).as_dvec3()
    }

    /// The pixels near one, in the block: what a block tells must not hang on others, which may get more samples later.
    fn near(&self, at: usize, rows: usize) -> Window {
        let range = |middle: usize, end: usize| middle.saturating_sub(REACH)..(middle + REACH + 1).min(end);
        [range(at % self.width, self.width), range(at / self.width, rows)]
    }

    fn places(&self, [columns, rows]: &Window) -> impl Iterator<Item = usize> {
        let (columns, width) = (columns.clone(), self.width);
        rows.clone().flat_map(move |y| columns.clone().map(move |x| y * width + x))
    }

    fn around(&self, window: &Window, channel: usize) -> Around {
        let (mut least, mut sum, mut squares, mut noise) = (f64::INFINITY, 0.0, 0.0, 0.0);
        let (share, odd) = (share(self.samples), f64::from(self.samples / 2) / f64::from(self.samples));
        for at in self.places(window) {
            let [a, b] = self.pixels[at].map(|half| f64::from(half[channel]));
            let value = a + (b - a) * odd;
            least = least.min(value);
            sum += value;
            squares += value * value;
            noise += share * (a - b) * (a - b);
        }
        let count = (window[0].len() * window[1].len()) as f64;
        let mean = sum / count;
        let change = squares / count - mean * mean;
        Around { least, mean: mean - least, noise: noise / count, change, count }
    }
}

/// What the mean of the halves of so many samples is off by, as a part of their difference, squared.
pub(super) fn share(samples: u32) -> f64 {
    let [even, odd, all] = [samples.div_ceil(2), samples / 2, samples].map(f64::from);
    even * odd / (all * all)
}

/// Whether a pixel shows so much that clipping counts.
fn is_bright([a, b]: [Vec3; 2]) -> bool {
    a.max(b).max_element() > BRIGHT
}

impl Around {
    /// How bright the light is that samples meet by chance, so many of each pixel.
    fn light(&self, samples: u32) -> f64 {
        (self.change + self.mean * self.mean + f64::from(samples) * self.noise) / self.mean
    }

    /// The mean squared error of a pixel of so many samples, which meet a `light` by chance; none where its own halves tell as
    /// well, or better.
    fn error(&self, samples: u32, light: f64) -> Option<f64> {
        let Self { least, mean, noise, change, count } = *self;
        // Of many hits chance leaves little doubt how they lie.
        let hits = count * f64::from(samples) * mean / light;
        let shape = SHAPE.min(1.0 + DOUBT * (2.0 / hits).sqrt());
        let is_chance = noise > 0.0 && noise.is_finite() && mean > 1e-6 && change <= shape * noise;
        let room = (1.0 - least).clamp(0.0, 1.0);
        if !is_chance || mean + 8.0 * noise.sqrt() < room {
            return None;
        }
        let share = mean / light;
        let is_known = light.is_finite() && share < 1.0 && f64::from(samples) * share <= OFTEN;
        is_known.then(|| expected_error(samples, share, mean, room))
    }
}

/// The mean squared error of a pixel of which `k` of `n` samples, each with the chance `share`, meet a light that adds `mean`,
/// where it shows no more than `room`.
pub(super) fn expected_error(n: u32, share: f64, mean: f64, room: f64) -> f64 {
    let hits = f64::from(n) * share;
    if share >= 1.0 || mean <= 0.0 || hits <= 0.0 {
        return 0.0;
    }
    let wanted = mean.min(room);
    let counts = likely_hits(n, share);
    let (mut chance, mut sum) = (chance_of(*counts.start(), n, share), 0.0);
    // From so many on the pixel is full, which has what is left of the chances.
    let mut left = 1.0;
    for k in counts {
        let shown = mean * f64::from(k) / hits;
        if shown >= room || left < 1e-12 {
            break;
        }
        sum += chance * (shown - wanted) * (shown - wanted);
        left -= chance;
        chance *= f64::from(n - k) / f64::from(k + 1) * share / (1.0 - share);
    }
    sum + left.max(0.0) * (room - wanted) * (room - wanted)
}

/// How many of `n` samples may meet what each meets with the chance `share`: where the chance that none does is too small for a
/// number, within ten standard deviations of their mean.
fn likely_hits(n: u32, share: f64) -> RangeInclusive<u32> {
    if f64::from(n) * libm::log1p(-share) > -700.0 {
        return 0..=n;
    }
    let hits = f64::from(n) * share;
    let reach = 10.0 * (hits * (1.0 - share)).sqrt() + 10.0;
    (hits - reach).max(0.0) as u32..=(hits + reach).min(f64::from(n)) as u32
}

/// The chance that `k` of `n` samples meet what each meets with the chance `share`, between 0 and 1.
fn chance_of(k: u32, n: u32, share: f64) -> f64 {
    let none = f64::from(n - k) * libm::log1p(-share);
    if k == 0 {
        return libm::exp(none);
    }
    let ways = |n: u32| libm::lgamma(f64::from(n) + 1.0);
    libm::exp(ways(n) - ways(k) - ways(n - k) + f64::from(k) * libm::log(share) + none)
}

/// The mean squared error of a pixel of `n` samples, none of which meets a `light` that covers a part of it, any part as likely as any
/// other, where the light adds no more than `room`: the integral over `p` of `(1 - p)^n min(room, p light)^2`.
pub(super) fn missed_rim(n: u32, light: f64, room: f64) -> f64 {
    if light <= 0.0 || room <= 0.0 {
        return 0.0;
    }
    let n = f64::from(n);
    let full = (room / light).min(1.0);
    let power = |k: f64| libm::pow(1.0 - full, n + k) / (n + k);
    // Beyond `full` all of the room; up to it by parts, three times, or as a series of `full`, where those would cancel.
    let beyond = room * room * power(1.0);
    let rising = if full * n < 0.5 {
        let (mut sum, mut term) = (0.0, 1.0);
        for k in 0..16 {
            let k = f64::from(k);
            sum += term / (k + 3.0);
            term *= -full * (n - k) / (k + 1.0);
        }
        room * room * full * sum
    } else {
        let begins = 1.0 / (n + 1.0) - 2.0 / (n + 2.0) + 1.0 / (n + 3.0);
        let ends = power(1.0) - 2.0 * power(2.0) + power(3.0);
        light * light * (begins - ends)
    };
    (rising + beyond).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::BLOCK;
    use crate::random::Random;

    const PIXELS: usize = (BLOCK * BLOCK) as usize;

    /// Pixels of a block whose samples meet the light with the chances `share`, and what they show in truth, not clipped.
    fn block(seed: u64, samples: u32, light: f32, share: impl Fn(usize, usize) -> f32) -> (Halves, Vec<f32>) {
        let mut numbers = Random(seed);
        let mut random = || (numbers.bits() >> 40) as f32 / 16_777_216.0;
        let (mut pixels, mut truth) = (Vec::new(), Vec::new());
        for at in 0..PIXELS {
            let share = share(at % 8, at / 8);
            let mut half = |count: u32| {
                let met = (0..count).filter(|_| random() < share).count();
                Vec3::splat(0.1 + light * met as f32 / count as f32)
            };
            pixels.push([half(samples.div_ceil(2)), half(samples / 2)]);
            truth.push(0.1 + light * share);
        }
        (Halves { width: 8, samples, pixels }, truth)
    }

    /// The mean of what is told over many blocks, as a part of what is true.
    fn told(samples: u32, light: f32, share: impl Fn(usize, usize) -> f32) -> f64 {
        let (mut told, mut found) = (0.0, 0.0);
        for seed in 0..400 {
            let (halves, truth) = block(seed, samples, light, &share);
            told += halves.errors().iter().sum::<f64>();
            for ([a, b], truth) in halves.pixels.iter().zip(truth) {
                let odd = (samples / 2) as f32 / samples as f32;
                let gap = (a.x + (b.x - a.x) * odd).min(1.0) - truth.min(1.0);
                found += 3.0 * f64::from(gap) * f64::from(gap);
            }
        }
        told / found
    }

    #[test]
    fn chance_that_clipping_hides_is_told() {
        for samples in [2, 4, 5, 16, 64] {
            for light in [3.0, 20.0, 500.0] {
                for met in [0.3, 2.0] {
                    // Alike everywhere, and along the rim of something large.
                    let even = f32::min(met / samples as f32, 0.4);
                    let ratio = [
                        told(samples, light, |_, _| even),
                        told(samples, light, |x, _| even * x as f32 / 4.0),
                    ];
                    println!("{samples} {light} {met}: {ratio:.2?}");
                    assert!(
                        ratio.iter().all(|ratio| (0.8..1.6).contains(ratio)),
                        "{samples} {light} {met}: {ratio:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn where_nothing_is_clipped_the_halves_are_believed() {
        for samples in [4, 16] {
            let (halves, _) = block(7, samples, 0.8, |x, _| 0.1 * x as f32);
            let own: f64 = (0..PIXELS).map(|at| share(samples) * halves.own(at).length_squared()).sum();
            assert!((halves.errors().iter().sum::<f64>() / own - 1.0).abs() < 1e-12);
        }
        // Nor is anything else where a lamp ends, but in the pixels along its rim.
        let (halves, _) = block(7, 16, 50.0, |x, _| if x < 3 { 0.0 } else { 1.0 });
        let rim = 8.0 * 3.0 * missed_rim(16, 50.1, 0.9);
        assert!((halves.errors().iter().sum::<f64>() / rim - 1.0).abs() < 1e-6);
    }

    #[test]
    fn rims_of_sharp_lights_that_no_sample_met_are_told() {
        for samples in [4, 16, 64] {
            for light in [14.0, 200.0] {
                let (mut told, mut found) = (0.0, 0.0);
                for seed in 0..2000 {
                    let edge = 2.0 + (seed as f32 * 0.618_034) % 1.0;
                    let (halves, truth) =
                        block(seed, samples, light, |x, _| (x as f32 + 1.0 - edge).clamp(0.0, 1.0));
                    told += halves.errors().iter().sum::<f64>();
                    for ([a, b], truth) in halves.pixels.iter().zip(truth) {
                        let gap = (0.5 * (a.x + b.x)).min(1.0) - truth.min(1.0);
                        found += 3.0 * f64::from(gap) * f64::from(gap);
                    }
                }
                let ratio = (told / found).sqrt();
                println!("{samples} {light}: {ratio:.2}");
                assert!((0.8..1.4).contains(&ratio), "{samples} {light}: {ratio}");
            }
        }
    }

    #[test]
    fn a_missed_rim_is_the_integral_it_says() {
        for (n, light, room) in
            [(4, 14.0, 0.9), (16, 2.0, 1.0), (64, 300.0, 0.5), (1024, 14.0, 1.0), (2, 0.5, 1.0)]
        {
            let steps = 200_000;
            let sum: f64 = (0..steps)
                .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
                .map(|p| libm::pow(1.0 - p, f64::from(n)) * (p * light).min(room) * (p * light).min(room))
                .sum();
            let wanted = sum / f64::from(steps);
            assert!((missed_rim(n, light, room) / wanted - 1.0).abs() < 1e-3, "{n} {light} {room}");
        }
        // So bright that all but nothing of the pixel is enough: the integral of (1 - p)^n.
        for (n, light) in [(4, 3e5), (4, 1e8), (16, 1e8), (64, 1e6), (64, 1e9), (1 << 20, 1e15)] {
            let wanted = 0.81 / (f64::from(n) + 1.0);
            let found = missed_rim(n, light, 0.9);
            assert!((found / wanted - 1.0).abs() < 1e-3, "{n} {light}: {found} {wanted}");
        }
    }

    #[test]
    fn chance_errs_as_its_limits_say() {
        // Hardly ever met: all of it is missing. Met often and never clamped: the noise of counting.
        assert!((expected_error(1, 1e-4, 0.3, 1.0) - 0.09).abs() < 1e-3);
        let (share, mean) = (16.0 / 4096.0, 0.1);
        let counted = mean * mean / 16.0 * (1.0 - share);
        assert!((expected_error(4096, share, mean, 1.0) / counted - 1.0).abs() < 1e-3);
        // So bright that one hit is white: wrong where there was none, and by no more than was dark.
        assert!(
            (expected_error(1 << 20, 3.0 / f64::from(1 << 20), 50.0, 1.0) - libm::exp(-3.0)).abs() < 1e-6
        );
        assert!((expected_error(1, 1e-6, 50.0, 0.5) - 0.25).abs() < 1e-5);
        // What every sample meets is right.
        assert_eq!(expected_error(4, 1.0, 50.0, 1.0), 0.0);
    }

    #[test]
    fn chance_errs_as_the_sum_over_all_counts_says() {
        let mut numbers = Random(3);
        let mut random = || (numbers.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        let known = [(1024, 0.6, 0.9), (16_384, 0.1, 0.5), (100, 0.9995, 0.98), (1 << 20, 1e-3, 0.999)];
        let others = (0..300).map(|_| (1 << (random() * 14.0) as u32, random(), 2.0 * random()));
        for (n, share, mean) in known.into_iter().chain(others.collect::<Vec<_>>()) {
            let (n_f, hits) = (f64::from(n), f64::from(n) * share);
            // Chances as parts of the largest, from it to both sides, which never are too small for a number.
            let mode = ((n_f + 1.0) * share).floor().min(n_f) as u32;
            let gap = |k: u32| (mean * f64::from(k) / hits).min(1.0) - mean.min(1.0);
            let (mut all, mut sum) = (1.0, gap(mode) * gap(mode));
            let (mut up, mut down) = (1.0, 1.0);
            for k in mode..n {
                up *= f64::from(n - k) / f64::from(k + 1) * share / (1.0 - share);
                (all, sum) = (all + up, sum + up * gap(k + 1) * gap(k + 1));
            }
            for k in (1..=mode).rev() {
                down *= f64::from(k) / f64::from(n - k + 1) * (1.0 - share) / share;
                (all, sum) = (all + down, sum + down * gap(k - 1) * gap(k - 1));
            }
            let (found, wanted) = (expected_error(n, share, mean, 1.0), sum / all);
            assert!((found - wanted).abs() < 1e-6 * wanted + 1e-12, "{n} {share} {mean}: {found} {wanted}");
        }
    }
}
