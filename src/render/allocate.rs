//! Which blocks of a picture get more samples: those whose next sample takes most from the error for its price. In: each block's
//! samples, error and cost, and the error or the work to aim at. Out: the number of samples of each, for [`super::adaptive`].
//!
//! A block's squared error is taken to fall as `n^-fall`. Then the sum of errors is least for a given amount of work
//! where `n` is proportional to `(v / (pixels cost))^(1 / (1 + fall))`, `v` being the block's squared error at one sample and
//! `cost` what a sample takes there (Lagrange's multiplier, the same for all blocks). At one cost for all the samples would be
//! fewest. The square root of the cost stands between: nearly the least time, and nearly the fewest samples. (Pictures of the
//! table top 320 pixels wide, the error of 256 samples: 1.35 times uniform's time and 0.73 of its samples at one cost
//! for all, 0.82 and 1.05 at the whole cost, 1.24 and 0.79 at its root.)

use crate::sampling::runs::{self, Run};
use std::collections::BTreeMap;

/// How errors fall before it is known: chance gives 1, smooth light up to 3; whole pictures of four scenes gave 1.3 to 1.8
/// from 16 to 64 samples.
pub(super) const USUAL_FALL: f64 = 1.5;

/// A block gets at most so many times what it has in one round: what so few samples say of the error is uncertain.
const MOST_GROWTH: u32 = 8;

/// What is known of one block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Block {
    pub pixels: u32,
    pub samples: u32,
    /// The sum of squared errors over its pixels and channels.
    pub error: f64,
    /// What a sample takes there: see [`cost`].
    pub cost: f64,
    /// Shows nothing but the sky.
    pub is_sky: bool,
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
/// batches of 16 go through (far out of focus those that are set up for one). Counted and not timed, so that it is the same on
/// every machine.
pub(super) fn cost(samples: u64, groups: u64, triangles: u64) -> f64 {
    const SAMPLE: f64 = 4.0;
    const GROUP: f64 = 30.0;
    const TRIANGLE: f64 = 200.0;
    SAMPLE + (GROUP * groups as f64 + TRIANGLE * triangles as f64) / samples.max(1) as f64
}

impl Block {
    /// What so many samples of its pixels take.
    pub(super) fn work(&self, samples: u32) -> f64 {
        f64::from(self.pixels) * self.cost * f64::from(samples)
    }
}

/// The number of samples that each block, row by row in `columns`, is to have; `most` at most.
pub(super) fn allocate(blocks: &[Block], columns: usize, goal: Goal, fall: f64, most: u32) -> Vec<u32> {
    let levels = Levels::new(most, fall);
    give_out(blocks, smoothed(blocks, columns, &levels), goal, &levels, MOST_GROWTH)
}

/// What blocks are to have, by what was found in some tiles of the picture; the sky keeps what it has, for to begin it again with more takes
/// longer than it saves.
pub(super) struct Forecast {
    levels: Levels,
    factor: f64,
    /// The sum of squared errors that is left of these tiles where all have as many samples as they may.
    pub least: f64,
}

/// The blocks of a tile, row by row.
pub(super) struct TileBlocks {
    blocks: Vec<Block>,
    columns: usize,
}

impl TileBlocks {
    pub(super) fn new(blocks: Vec<Block>, columns: usize) -> Self {
        Self { blocks, columns }
    }

    pub(super) fn blocks(&self) -> impl Iterator<Item = Block> {
        self.blocks.iter().copied()
    }

    /// See [`smoothed`].
    pub(super) fn smoothed(&self, levels: &Levels) -> Vec<f64> {
        smoothed(&self.blocks, self.columns, levels)
    }
}

impl Forecast {
    /// That the blocks of these `tiles` reach `goal`.
    pub(super) fn new(tiles: &[TileBlocks], goal: Goal, fall: f64, most: u32) -> Self {
        let levels = Levels::new(most, fall);
        let errors = tiles.iter().flat_map(|tile| tile.smoothed(&levels)).collect();
        let blocks: Vec<Block> = tiles.iter().flat_map(TileBlocks::blocks).collect();
        let keys = held(&blocks, levels.keys(&blocks, errors));
        let last = levels.powers.len() - 1;
        let left = |key: &Key| key.at_one * levels.powers[if key.weight > 0.0 { last } else { key.now }];
        Self { factor: factor(&blocks, &keys, goal, &levels), least: keys.iter().map(left).sum(), levels }
    }

    /// For the blocks of a tile.
    pub(super) fn wanted(&self, tile: &TileBlocks) -> Vec<u32> {
        let keys = held(&tile.blocks, self.levels.keys(&tile.blocks, tile.smoothed(&self.levels)));
        self.levels.shares(&tile.blocks, &keys, self.factor, MOST_GROWTH)
    }
}

/// The keys of such blocks, those of the sky without any weight.
fn held(blocks: &[Block], mut keys: Vec<Key>) -> Vec<Key> {
    keys.iter_mut().zip(blocks).filter(|(_, block)| block.is_sky).for_each(|(key, _)| key.weight = 0.0);
    keys
}

/// As [`allocate`], by these `errors` of the blocks.
pub(super) fn give_out(
    blocks: &[Block],
    errors: Vec<f64>,
    goal: Goal,
    levels: &Levels,
    growth: u32,
) -> Vec<u32> {
    let keys = levels.keys(blocks, errors);
    levels.shares(blocks, &keys, factor(blocks, &keys, goal, levels), growth)
}

/// What each block's weight is to be multiplied by, so that all reach `goal`.
fn factor(blocks: &[Block], keys: &[Key], goal: Goal, levels: &Levels) -> f64 {
    // The sums grow (work) or fall (error) with the factor: halve the range of its logarithm, down to a thousandth.
    let (mut low, mut high) = (-40.0 * levels.power, 120.0 * levels.power);
    for _ in 0..19 {
        let middle = 0.5 * (low + high);
        let factor = libm::exp2(middle);
        let enough = match goal {
            Goal::Error(error) => {
                let left = |key: &Key| key.at_one * levels.powers[levels.wanted(key, factor)];
                keys.iter().map(left).sum::<f64>() <= error
            }
            Goal::Work(work) => {
                let samples = |key: &Key| levels.samples[levels.wanted(key, factor)];
                let more =
                    |(block, key): (&Block, &Key)| block.work(samples(key).saturating_sub(block.samples));
                blocks.iter().zip(keys).map(more).sum::<f64>() >= work
            }
        };
        if enough { high = middle } else { low = middle }
    }
    // An error is to be reached, an amount of work not exceeded.
    libm::exp2(if matches!(goal, Goal::Error(_)) { high } else { low })
}

/// The numbers of samples that a block may have, in a table: a picture has tens of thousands of blocks, and each is asked
/// some twenty times.
pub(super) struct Levels {
    samples: Vec<u32>,
    /// What is left at each of the squared error at one sample.
    powers: Vec<f64>,
    /// From here on the next is nearer, by ratio; to the power of `power`.
    ends: Vec<f64>,
    /// Shares to the power of this, which is `1 + fall`, are what is compared: blocks' weights are that by themselves. (A root for
    /// each block and round took 1.5 % of a picture with the error of 16 samples.)
    power: f64,
}

/// What is asked of a block over and over.
struct Key {
    /// What its number of samples is to be proportional to, to the levels' power.
    weight: f64,
    /// Its squared error at one sample.
    at_one: f64,
    /// Its own level.
    now: usize,
}

impl Levels {
    /// 16 at least, but for the sky.
    pub(super) fn new(most: u32, fall: f64) -> Self {
        let most = most.max(runs::FIRST_RUN);
        let reached = Run::between(0, most).map(Run::end).take_while(|&end| end <= most);
        let samples: Vec<u32> = runs::SKY_RUNS.into_iter().chain(reached).collect();
        let powers = samples.iter().map(|&n| libm::pow(f64::from(n), -fall)).collect();
        let power = 1.0 + fall;
        let nearer = |two: &[u32]| libm::pow(f64::from(two[0]) * f64::from(two[1]), 0.5 * power);
        let ends = samples.windows(2).map(nearer).collect();
        Self { samples, powers, ends, power }
    }

    fn level(&self, samples: u32) -> usize {
        self.samples.partition_point(|&n| n < samples).min(self.samples.len() - 1)
    }

    /// For a block whose share goes by this squared error.
    fn key(&self, block: &Block, error: f64) -> Key {
        let now = self.level(block.samples);
        let at_one = error / f64::from(block.pixels.max(1)) / self.powers[now];
        let weight = at_one.max(0.0) / block.cost.sqrt();
        Key { weight, at_one: block.error / self.powers[now], now }
    }

    fn keys(&self, blocks: &[Block], errors: Vec<f64>) -> Vec<Key> {
        errors.into_iter().zip(blocks).map(|(error, block)| self.key(block, error)).collect()
    }

    /// What blocks get, each at most `growth` times what it has. (That others make up for those that may not get all would
    /// take half as many samples again for the error of 256 on the city.)
    fn shares(&self, blocks: &[Block], keys: &[Key], factor: f64, growth: u32) -> Vec<u32> {
        let share = |(block, key): (&Block, &Key)| {
            let most = block.samples.saturating_mul(growth);
            let last = self.samples.partition_point(|&n| n <= most).saturating_sub(1).max(key.now);
            self.samples[self.wanted(key, factor).min(last)].max(block.samples)
        };
        blocks.iter().zip(keys).map(share).collect()
    }

    /// The level that is nearest to a block's share.
    fn wanted(&self, key: &Key, factor: f64) -> usize {
        let share = key.weight * factor;
        // From its own on: most stay there, or go on by one.
        let above = self.ends.get(key.now..).unwrap_or_default();
        key.now + above.iter().take_while(|&&end| end <= share).count()
    }
}

/// How errors of surfaces fell from `before` to `after`, as the exponent that explains the sum of all that got more samples; none where
/// none did.
pub(super) fn fall(before: &[Block], after: &[Block]) -> Option<f64> {
    // Few blocks differ in how many times their samples they got.
    let (mut sums, mut found) = (BTreeMap::<(u32, u32), f64>::new(), 0.0);
    let surfaces = before.iter().zip(after).filter(|(before, _)| !before.is_sky);
    for (before, after) in surfaces.filter(|(before, after)| after.samples > before.samples) {
        *sums.entry((before.samples, after.samples)).or_default() += before.error;
        found += after.error;
    }
    if sums.is_empty() {
        return None;
    }
    let expected = |fall: f64| -> f64 {
        sums.iter().map(|(&(a, b), sum)| sum * libm::pow(f64::from(a) / f64::from(b), fall)).sum()
    };
    let (mut low, mut high) = (0.8, 2.2);
    for _ in 0..10 {
        let middle = 0.5 * (low + high);
        if expected(middle) > found { low = middle } else { high = middle }
    }
    Some(low)
}

/// Each block's error, half its own and half the mean of the nine about it: two halves may agree by chance, and a block
/// that stopped for that would stay wrong. (The sky's is its own.)
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
            if blocks[i].is_sky {
                return blocks[i].error;
            }
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
        Block { pixels: 64, samples: 16, error, cost: 10.0, is_sky: false }
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
    fn a_forecast_gives_its_own_tiles_what_they_need() {
        let tile = |scale: f64| {
            let blocks = (0..16).map(|i| block(scale * f64::from(1 + i % 3))).collect();
            TileBlocks::new(blocks, 4)
        };
        let tiles = [tile(0.1), tile(1.0), tile(0.0)];
        let error = |tile: &TileBlocks, samples: &[u32]| -> f64 {
            let falls = |n: u32| libm::pow(16.0 / f64::from(n), 1.25);
            tile.blocks().zip(samples).map(|(block, &n)| block.error * falls(n)).sum()
        };
        let forecast = Forecast::new(&tiles, Goal::Error(12.0), 1.25, 1 << 20);
        let wanted = tiles.each_ref().map(|tile| forecast.wanted(tile));
        let reached: f64 = tiles.iter().zip(&wanted).map(|(tile, wanted)| error(tile, wanted)).sum();
        assert!((9.0..=12.0).contains(&reached), "{reached}");
        assert!(wanted[1].iter().zip(&wanted[0]).all(|(more, less)| more > less), "{wanted:?}");
        assert!(wanted[2].iter().all(|&n| n == 16), "{wanted:?}");
        let left: f64 = tiles.iter().map(|tile| error(tile, &[1 << 20; 16])).sum();
        assert!((forecast.least / left - 1.0).abs() < 1e-9, "{} {left}", forecast.least);
        // However much is wanted, so few samples are trusted no further.
        let forecast = Forecast::new(&tiles, Goal::Error(0.001), 1.25, 1 << 20);
        assert!(forecast.wanted(&tiles[1]).iter().all(|&n| n == 16 * MOST_GROWTH));
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
        let key = Key { weight: 1.0, at_one: 1.0, now: levels.level(16) };
        let found = [0.0, 22.0, 23.0, 78.0, 79.0, 1e9]
            .map(|share| levels.samples[levels.wanted(&key, libm::pow(share, levels.power))]);
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
