//! Which blocks of a picture get more samples: those whose next sample takes most from the error.
//!
//! A block's squared error is taken to fall as `n^-fall`. Then the sum of errors is least for a given number of samples
//! where `n` is proportional to `(v / pixels)^(1 / (1 + fall))`, `v` being the block's squared error at one sample
//! (Lagrange's multiplier, the same for all blocks).

use crate::picture::BLOCK;
use crate::raster::TILE;
use crate::sampling::runs::{self, Run};

/// How errors fall before it is known: chance gives 1, smooth light up to 3; whole pictures of four scenes gave 1.3 to 1.8
/// from 16 to 64 samples.
pub(super) const USUAL_FALL: f64 = 1.5;

/// A block gets at most so many times what it has in one round: what so few samples say of the error is uncertain.
const MOST_GROWTH: u32 = 8;

/// The most samples of a pixel within a time.
pub(super) const MOST_FOR_TIME: u32 = runs::MOST_SAMPLES;

/// What is known of one block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Block {
    pub pixels: u32,
    pub samples: u32,
    /// The sum of squared errors over its pixels and channels.
    pub error: f64,
}

/// What more samples are for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// The sum of squared errors over all blocks.
    Error(f64),
    /// As many more samples, over all pixels.
    Samples(f64),
}

/// What a sample of a later round costs, in samples of a first run of the same number: its runs are shorter, so fewer of its
/// samples lie close together, and its tiles' triangles are gone through for less (four scenes, 320 pixels wide: 2.0 to 3.5).
const LATER: f64 = 2.4;

/// What a later round costs beside its samples, in samples of every pixel: of itself, and for each entry of a tile's bin.
const ROUND: f64 = 6.0;
const ROUND_ENTRY: f64 = 40.0;

/// Entries of bins for each pixel at which half of a run's price is its tile's triangles, about.
const ALIKE: f64 = 0.3;

/// How far the numbers of a tile's blocks come together at most: further took more samples, and no less time.
const MOST_ALIKE: f64 = 0.3;

/// Rounds that it takes to get from a base to an error, about.
const ROUNDS: f64 = 3.0;

/// A base may take so many times the samples of the one that takes fewest, to save time.
const SPARE: f64 = 1.15;

/// Blocks that a base is chosen by.
const ENOUGH_BLOCKS: usize = 512;

/// How many samples all pixels should get at once, by what the first run found in some blocks: where the error is much the
/// same everywhere, rounds cost more than they save, and `goal`, for these blocks alone, is best reached in one. Where it
/// is not, samples are saved for an error even if that takes longer, as it does on small pictures of many triangles.
pub(super) fn base(blocks: &[Block], goal: Goal, fall: f64, most: u32, entries_per_pixel: f64) -> u32 {
    let round = ROUND + ROUND_ENTRY * entries_per_pixel;
    let stride = blocks.len().div_ceil(ENOUGH_BLOCKS).max(1);
    let few: Vec<Block> = blocks.iter().step_by(stride).copied().collect();
    let pixels: f64 = few.iter().map(|block| f64::from(block.pixels)).sum();
    let part = few.len() as f64 / blocks.len().max(1) as f64;
    let goal = match goal {
        Goal::Error(error) => Goal::Error(error * part),
        Goal::Samples(samples) => Goal::Samples(samples * part),
    };
    // The price of a base (samples for an error, or an error for samples), and for an error what it takes without.
    let price = |base: u32| {
        let raised = |block: &Block| {
            let falls = libm::pow(f64::from(block.samples.max(1)) / f64::from(base), fall);
            Block { samples: base, error: block.error * falls, ..*block }
        };
        let all: Vec<Block> = few.iter().map(raised).collect();
        let error: f64 = all.iter().map(|block| block.error).sum();
        let spent = f64::from(base) * pixels;
        let more = |goal: Goal| {
            // Blocks from all over the picture are no neighbours.
            let errors = all.iter().map(|block| block.error).collect();
            let wanted = spread(&all, errors, goal, fall, most, u32::MAX);
            all.iter().zip(wanted).fold((0.0, 0.0), |sum, (block, wanted)| {
                let ratio = f64::from(base) / f64::from(wanted);
                (
                    sum.0 + f64::from(block.pixels) * f64::from(wanted - base),
                    sum.1 + block.error * libm::pow(ratio, fall),
                )
            })
        };
        match goal {
            Goal::Error(goal) if error <= goal => (spent, spent),
            Goal::Error(goal) => {
                let more = more(Goal::Error(goal)).0;
                (spent + LATER * more + ROUNDS * round * pixels, spent + more)
            }
            Goal::Samples(samples) if spent > samples => (f64::INFINITY, 0.0),
            Goal::Samples(samples) => {
                let left = samples - spent - round * pixels;
                (if left > 0.0 { more(Goal::Samples(left / LATER)).1.min(error) } else { error }, 0.0)
            }
        }
    };
    // Halves of a doubling are left to the rounds.
    let candidates: Vec<u32> =
        Run::between(0, most).map(Run::end).filter(|end| end.is_power_of_two() && *end <= most).collect();
    let prices: Vec<(f64, f64)> = candidates.iter().map(|&base| price(base)).collect();
    let fewest = prices.iter().map(|price| price.1).fold(f64::INFINITY, f64::min);
    let allowed = candidates.iter().zip(&prices).filter(|(_, price)| price.1 <= SPARE * fewest);
    allowed.min_by(|a, b| a.1.0.total_cmp(&b.1.0)).map_or(runs::FIRST_RUN, |(&base, _)| base)
}

/// The number of samples that each block, row by row in `columns`, is to have; `most` at most.
///
/// A tile's triangles are gone through for each run, however few of its blocks take part. Where there are many
/// `entries_per_pixel` that is most of the price, so a tile's blocks get more alike.
pub(super) fn allocate(
    blocks: &[Block],
    columns: usize,
    goal: Goal,
    fall: f64,
    most: u32,
    entries_per_pixel: f64,
) -> Vec<u32> {
    let alike = (entries_per_pixel / (entries_per_pixel + ALIKE)).min(MOST_ALIKE);
    spread(blocks, smoothed(blocks, columns, fall, alike), goal, fall, most, MOST_GROWTH)
}

/// As [`allocate`], by these `errors` of the blocks.
fn spread(blocks: &[Block], errors: Vec<f64>, goal: Goal, fall: f64, most: u32, growth: u32) -> Vec<u32> {
    let levels = Levels::new(most, fall);
    let keys: Vec<Key> =
        errors.into_iter().zip(blocks).map(|(e, block)| levels.key(block, e, growth)).collect();
    let wanted =
        |block: &Block, key: &Key, factor: f64| levels.samples[levels.wanted(key, factor)].max(block.samples);
    // The sums grow (samples) or fall (error) with the factor: halve the range of its logarithm.
    let (mut low, mut high) = (-40.0f64, 120.0f64);
    for _ in 0..44 {
        let middle = 0.5 * (low + high);
        let factor = libm::exp2(middle);
        let enough = match goal {
            Goal::Error(error) => {
                let left = |(block, key): (&Block, &Key)| {
                    block.error * levels.powers[levels.wanted(key, factor)] / levels.powers[key.now]
                };
                blocks.iter().zip(&keys).map(left).sum::<f64>() <= error
            }
            Goal::Samples(samples) => {
                let more = |(block, key): (&Block, &Key)| {
                    f64::from(block.pixels) * f64::from(wanted(block, key, factor) - block.samples)
                };
                blocks.iter().zip(&keys).map(more).sum::<f64>() >= samples
            }
        };
        if enough { high = middle } else { low = middle }
    }
    // An error is to be reached, a number of samples not exceeded.
    let factor = libm::exp2(if matches!(goal, Goal::Error(_)) { high } else { low });
    blocks.iter().zip(&keys).map(|(block, key)| wanted(block, key, factor)).collect()
}

/// The numbers of samples that a block may have, in a table: a picture has tens of thousands of blocks, and each is asked
/// some forty times.
struct Levels {
    samples: Vec<u32>,
    /// What is left at each of the squared error at one sample.
    powers: Vec<f64>,
    /// From here on the next is nearer, by ratio.
    ends: Vec<f64>,
    exponent: f64,
}

/// What is asked of a block over and over.
struct Key {
    /// What its number of samples is to be proportional to.
    weight: f64,
    /// Its own level, and the highest that it may reach now.
    now: usize,
    last: usize,
}

impl Levels {
    /// 16 at least.
    fn new(most: u32, fall: f64) -> Self {
        let reached = Run::between(0, most).map(Run::end).take_while(|&end| end <= most);
        let samples: Vec<u32> = reached.chain((most < runs::FIRST_RUN).then_some(runs::FIRST_RUN)).collect();
        let powers = samples.iter().map(|&n| libm::pow(f64::from(n), -fall)).collect();
        let ends = samples.windows(2).map(|two| (f64::from(two[0]) * f64::from(two[1])).sqrt()).collect();
        Self { samples, powers, ends, exponent: 1.0 / (1.0 + fall) }
    }

    fn level(&self, samples: u32) -> usize {
        self.samples.partition_point(|&n| n < samples).min(self.samples.len() - 1)
    }

    /// For a block with this squared error, which may get `growth` times the samples that it has.
    fn key(&self, block: &Block, error: f64, growth: u32) -> Key {
        let now = self.level(block.samples);
        let at_one = error / f64::from(block.pixels.max(1)) / self.powers[now];
        let weight = libm::pow(at_one.max(0.0), self.exponent);
        let most = block.samples.saturating_mul(growth);
        let last = self.samples.partition_point(|&n| n <= most).saturating_sub(1).max(now);
        Key { weight, now, last }
    }

    /// The level that is nearest to a block's share.
    fn wanted(&self, key: &Key, factor: f64) -> usize {
        let share = key.weight * factor;
        self.ends.partition_point(|&end| end <= share).clamp(key.now, key.last)
    }
}

/// How errors fell from `before` to `after`, as the exponent that explains the sum of all that got more samples.
pub(super) fn fall(before: &[Block], after: &[Block]) -> f64 {
    let moved = || before.iter().zip(after).filter(|(before, after)| after.samples > before.samples);
    let found: f64 = moved().map(|(_, after)| after.error).sum();
    let expected = |fall: f64| -> f64 {
        let ratio = |a: u32, b: u32| libm::pow(f64::from(a) / f64::from(b), fall);
        moved().map(|(before, after)| before.error * ratio(before.samples, after.samples)).sum()
    };
    let (mut low, mut high) = (0.8, 2.2);
    for _ in 0..10 {
        let middle = 0.5 * (low + high);
        if expected(middle) > found { low = middle } else { high = middle }
    }
    low
}

/// Each block's error, half its own and half the mean of the nine about it: two halves may agree by chance, and a block
/// that stopped for that would stay wrong.
fn smoothed(blocks: &[Block], columns: usize, fall: f64, alike: f64) -> Vec<f64> {
    let columns = columns.max(1);
    let rows = blocks.len() / columns;
    let at_one = |x: usize, y: usize| {
        let block = &blocks[y * columns + x];
        let scale = libm::pow(f64::from(block.samples.max(1)), fall);
        (block.error / f64::from(block.pixels.max(1)) * scale, block)
    };
    // By rows, then by columns.
    let scaled: Vec<f64> = (0..blocks.len()).map(|i| at_one(i % columns, i / columns).0).collect();
    let around = |i: usize, count: usize| (i.saturating_sub(1), (i + 1).min(count - 1));
    let mut across = vec![0.0; scaled.len()];
    for (i, out) in across.iter_mut().enumerate() {
        let (first, last) = around(i % columns, columns);
        let row = &scaled[i / columns * columns..];
        *out = row[first..=last].iter().sum::<f64>() / (last - first + 1) as f64;
    }
    let side = (TILE / BLOCK) as usize;
    let tile = |x: usize, y: usize| {
        let (left, top) = (x / side * side, y / side * side);
        let (right, bottom) = ((left + side).min(columns), (top + side).min(rows));
        let sum: f64 = (top..bottom).flat_map(|y| &scaled[y * columns + left..y * columns + right]).sum();
        sum / ((right - left) * (bottom - top)).max(1) as f64
    };
    (0..blocks.len())
        .map(|i| {
            let (first, last) = around(i / columns, rows.max(1));
            let sum: f64 = (first..=last).map(|y| across[y * columns + i % columns]).sum();
            let mean = sum / (last - first + 1) as f64;
            let block = &blocks[i];
            let scale = f64::from(block.pixels) / libm::pow(f64::from(block.samples.max(1)), fall);
            let own = 0.5 * scaled[i] + 0.5 * mean;
            (own + alike * (tile(i % columns, i / columns) - own)) * scale
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(error: f64) -> Block {
        Block { pixels: 64, samples: 16, error }
    }

    #[test]
    fn more_goes_where_the_error_is() {
        let mut blocks = vec![block(0.0); 64];
        blocks.iter_mut().take(32).for_each(|block| block.error = 1.0);
        let found = allocate(&blocks, 8, Goal::Error(8.0), 1.25, 1 << 20, 0.0);
        assert!(found[..24].iter().all(|&n| n == 64 || n == 48 || n == 96), "{found:?}");
        assert!(found[40..].iter().all(|&n| n == 16), "{found:?}");
    }

    #[test]
    fn a_number_of_samples_is_nearly_spent_and_not_exceeded() {
        let blocks: Vec<Block> = (0..400).map(|i| block(f64::from(i % 17) * 0.01)).collect();
        let budget = 64.0 * 400.0 * 40.0;
        let found = allocate(&blocks, 20, Goal::Samples(budget), 1.25, 1 << 20, 0.0);
        let spent: f64 = found.iter().map(|&n| 64.0 * f64::from(n - 16)).sum();
        assert!(spent <= budget && spent > 0.5 * budget, "{spent} of {budget}");
    }

    #[test]
    fn the_nearest_number_is_nearest_by_ratio() {
        let levels = Levels::new(runs::MOST_SAMPLES, 1.5);
        let key = Key { weight: 1.0, now: 0, last: levels.samples.len() - 1 };
        let found =
            [0.0, 22.0, 23.0, 78.0, 79.0, 1e9].map(|share| levels.samples[levels.wanted(&key, share)]);
        assert_eq!(found, [16, 16, 32, 64, 96, runs::MOST_SAMPLES]);
    }

    #[test]
    fn what_cannot_be_reached_ends_at_the_limit() {
        let blocks = vec![Block { samples: 512, ..block(1.0) }; 9];
        assert!(allocate(&blocks, 3, Goal::Error(0.0), 1.5, 1024, 0.0).iter().all(|&n| n == 1024));
        assert!(allocate(&[block(0.0); 9], 3, Goal::Samples(1e9), 1.5, 1024, 0.0).iter().all(|&n| n == 16));
        assert!(allocate(&[], 3, Goal::Error(0.0), 1.5, 1024, 0.0).is_empty());
    }
}
