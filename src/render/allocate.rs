//! Which blocks of a picture get more samples: those whose next sample takes most from the error for its price.
//!
//! A block's squared error is taken to fall as `n^-fall`. Then the sum of errors is least for a given amount of work
//! where `n` is proportional to `(v / (pixels cost))^(1 / (1 + fall))`, `v` being the block's squared error at one sample and
//! `cost` what a sample takes there (Lagrange's multiplier, the same for all blocks). At one cost for all the samples would be
//! fewest. The square root of the cost stands between: nearly the least time, and nearly the fewest samples. (Pictures of the
//! table top 320 pixels wide, the error of 256 samples: 1.35 times uniform's time and 0.73 of its samples at one cost
//! for all, 0.82 and 1.05 at the whole cost, 1.24 and 0.79 at its root.)

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
    /// What a sample takes there: see [`cost`].
    pub cost: f64,
}

/// What more samples are for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// The sum of squared errors over all blocks.
    Error(f64),
    /// As much more work: samples times what each takes, over all pixels.
    Work(f64),
}

/// What a sample of a tile takes, in nanoseconds about: of itself, of the groups that are shaded, and of the triangles that
/// batches of 16 go through. Counted and not timed, so that it is the same on every machine.
pub(super) fn cost(samples: u64, groups: u64, triangles: u64) -> f64 {
    const SAMPLE: f64 = 4.0;
    const GROUP: f64 = 30.0;
    const TRIANGLE: f64 = 200.0;
    SAMPLE + (GROUP * groups as f64 + TRIANGLE * triangles as f64) / samples.max(1) as f64
}

/// What the samples of small first runs cost, in samples of a larger one: fewer of them lie close together, and a tile's
/// triangles are set up for fewer.
const SMALL: [(u32, f64); 2] = [(16, 1.8), (32, 1.3)];

/// The same of a later round, whose runs are short.
pub(super) const LATER: f64 = 1.5;

/// What a later round costs beside its samples, in samples of every pixel: of itself, and for each entry of a tile's bin.
const ROUND: f64 = 2.0;
const ROUND_ENTRY: f64 = 5.0;

/// Rounds that it takes to get from a base to an error, about.
const ROUNDS: f64 = 3.0;

/// A base may take so many times the samples of the one that takes fewest, to save time.
const SPARE: f64 = 1.15;

/// Blocks that a base is chosen by.
const ENOUGH_BLOCKS: usize = 512;

impl Block {
    /// What so many samples of its pixels take.
    pub(super) fn work(&self, samples: u32) -> f64 {
        f64::from(self.pixels) * self.cost * f64::from(samples)
    }
}

/// What `base` samples of every pixel, drawn at once, take.
pub(super) fn first_work(blocks: &[Block], base: u32) -> f64 {
    let small = SMALL.iter().find(|(small, _)| *small == base).map_or(1.0, |(_, cost)| *cost);
    small * blocks.iter().map(|block| block.work(base)).sum::<f64>()
}

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
        Goal::Work(work) => Goal::Work(work * part),
    };
    let round = round * few.iter().map(|block| block.work(1)).sum::<f64>();
    let levels = Levels::new(most, fall);
    // The price of a base (work for an error, or an error for work), and for an error the samples that it takes.
    let price = |base: u32| {
        let raised = |block: &Block| {
            let falls = libm::pow(f64::from(block.samples.max(1)) / f64::from(base), fall);
            Block { samples: base, error: block.error * falls, ..*block }
        };
        let all: Vec<Block> = few.iter().map(raised).collect();
        let error: f64 = all.iter().map(|block| block.error).sum();
        let (samples, work) = (f64::from(base) * pixels, first_work(&few, base));
        // Samples, work and error of what comes after.
        let more = |goal: Goal| {
            // Blocks from all over the picture are no neighbours.
            let errors = all.iter().map(|block| block.error).collect();
            let wanted = spread(&all, errors, goal, &levels, u32::MAX);
            all.iter().zip(wanted).fold([0.0; 3], |[samples, work, error], (block, wanted)| {
                let more = wanted - base;
                let falls = libm::pow(f64::from(base) / f64::from(wanted), fall);
                let samples = samples + f64::from(block.pixels) * f64::from(more);
                [samples, work + block.work(more), error + block.error * falls]
            })
        };
        match goal {
            Goal::Error(goal) if error <= goal => (work, samples),
            Goal::Error(goal) => {
                let [more_samples, more_work, _] = more(Goal::Error(goal));
                (work + LATER * more_work + ROUNDS * round, samples + more_samples)
            }
            Goal::Work(given) if work > given => (f64::INFINITY, 0.0),
            Goal::Work(given) => {
                let left = given - work - round;
                (if left > 0.0 { more(Goal::Work(left / LATER))[2].min(error) } else { error }, 0.0)
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
pub(super) fn allocate(blocks: &[Block], columns: usize, goal: Goal, fall: f64, most: u32) -> Vec<u32> {
    let levels = Levels::new(most, fall);
    spread(blocks, smoothed(blocks, columns, &levels), goal, &levels, MOST_GROWTH)
}

/// As [`allocate`], by these `errors` of the blocks.
fn spread(blocks: &[Block], errors: Vec<f64>, goal: Goal, levels: &Levels, growth: u32) -> Vec<u32> {
    let keys: Vec<Key> =
        errors.into_iter().zip(blocks).map(|(e, block)| levels.key(block, e, growth)).collect();
    let wanted =
        |block: &Block, key: &Key, factor: f64| levels.samples[levels.wanted(key, factor)].max(block.samples);
    // The sums grow (work) or fall (error) with the factor: halve the range of its logarithm, down to a millionth.
    let (mut low, mut high) = (-40.0f64, 120.0f64);
    for _ in 0..28 {
        let middle = 0.5 * (low + high);
        let factor = libm::exp2(middle);
        let enough = match goal {
            Goal::Error(error) => {
                let left = |(block, key): (&Block, &Key)| {
                    block.error * levels.powers[levels.wanted(key, factor)] / levels.powers[key.now]
                };
                blocks.iter().zip(&keys).map(left).sum::<f64>() <= error
            }
            Goal::Work(work) => {
                let more =
                    |(block, key): (&Block, &Key)| block.work(wanted(block, key, factor) - block.samples);
                blocks.iter().zip(&keys).map(more).sum::<f64>() >= work
            }
        };
        if enough { high = middle } else { low = middle }
    }
    // An error is to be reached, an amount of work not exceeded.
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
        let weight = libm::pow(at_one.max(0.0) / block.cost.sqrt(), self.exponent);
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
fn smoothed(blocks: &[Block], columns: usize, levels: &Levels) -> Vec<f64> {
    let columns = columns.max(1);
    let rows = blocks.len() / columns;
    // Of one pixel, at one sample.
    let left = |block: &Block| f64::from(block.pixels.max(1)) * levels.powers[levels.level(block.samples)];
    let scaled: Vec<f64> = blocks.iter().map(|block| block.error / left(block)).collect();
    // By rows, then by columns.
    let around = |i: usize, count: usize| (i.saturating_sub(1), (i + 1).min(count - 1));
    let mut across = vec![0.0; scaled.len()];
    for (i, out) in across.iter_mut().enumerate() {
        let (first, last) = around(i % columns, columns);
        let row = &scaled[i / columns * columns..];
        *out = row[first..=last].iter().sum::<f64>() / (last - first + 1) as f64;
    }
    (0..blocks.len())
        .map(|i| {
            let (first, last) = around(i / columns, rows.max(1));
            let sum: f64 = (first..=last).map(|y| across[y * columns + i % columns]).sum();
            let mean = sum / (last - first + 1) as f64;
            (0.5 * scaled[i] + 0.5 * mean) * left(&blocks[i])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(error: f64) -> Block {
        Block { pixels: 64, samples: 16, error, cost: 10.0 }
    }

    #[test]
    fn more_goes_where_the_error_is() {
        let mut blocks = vec![block(0.0); 64];
        blocks.iter_mut().take(32).for_each(|block| block.error = 1.0);
        let found = allocate(&blocks, 8, Goal::Error(8.0), 1.25, 1 << 20);
        assert!(found[..24].iter().all(|&n| n == 32 || n == 64), "{found:?}");
        assert!(found[40..].iter().all(|&n| n == 16), "{found:?}");
    }

    #[test]
    fn of_two_alike_the_cheaper_gets_more() {
        let blocks: Vec<Block> =
            (0..64).map(|i| Block { cost: if i < 32 { 5.0 } else { 50.0 }, ..block(1.0) }).collect();
        let found = allocate(&blocks, 8, Goal::Error(16.0), 1.5, 1 << 20);
        // The root of ten to the power of 1 / 2.5: 1.6 times as many.
        assert!(found[..24].iter().all(|&n| n == 2 * found[63]), "{found:?}");
    }

    #[test]
    fn what_is_given_is_nearly_spent_and_not_exceeded() {
        let blocks: Vec<Block> = (0..400).map(|i| block(f64::from(i % 17) * 0.01)).collect();
        let budget = 10.0 * 64.0 * 400.0 * 40.0;
        let found = allocate(&blocks, 20, Goal::Work(budget), 1.25, 1 << 20);
        let spent: f64 = found.iter().map(|&n| 10.0 * 64.0 * f64::from(n - 16)).sum();
        assert!(spent <= budget && spent > 0.5 * budget, "{spent} of {budget}");
    }

    #[test]
    fn the_nearest_number_is_nearest_by_ratio() {
        let levels = Levels::new(runs::MOST_SAMPLES, 1.5);
        let key = Key { weight: 1.0, now: 0, last: levels.samples.len() - 1 };
        let found =
            [0.0, 22.0, 23.0, 78.0, 79.0, 1e9].map(|share| levels.samples[levels.wanted(&key, share)]);
        assert_eq!(found, [16, 16, 32, 64, 64, runs::MOST_SAMPLES]);
    }

    #[test]
    fn what_cannot_be_reached_ends_at_the_limit() {
        let blocks = vec![Block { samples: 512, ..block(1.0) }; 9];
        assert!(allocate(&blocks, 3, Goal::Error(0.0), 1.5, 1024).iter().all(|&n| n == 1024));
        assert!(allocate(&[block(0.0); 9], 3, Goal::Work(1e9), 1.5, 1024).iter().all(|&n| n == 16));
        assert!(allocate(&[], 3, Goal::Error(0.0), 1.5, 1024).is_empty());
    }
}
