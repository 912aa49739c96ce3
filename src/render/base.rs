//! How many samples all pixels of a picture should get at once, before rounds give more where they help: what some tiles show
//! after their first run in ([`super::pilot`]), a number out, for [`super::adaptive`].
//!
//! For an error it is the one with the least `work + 1.5 (work of the samples that allocate adds) + 3 (work of a round)` of those
//! that need at most 1.25 times the fewest samples; for a time, the one with the least error by what [`super::allocate`] adds.

use super::allocate::{Block, Goal, Levels, give_out};
use super::pilot::Seen;
use crate::sampling::runs::{self, Run};

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
const SPARE: f64 = 1.25;

/// What `base` samples of every pixel, drawn at once, take.
pub(super) fn first_work(blocks: impl IntoIterator<Item = Block>, base: u32) -> f64 {
    let small = SMALL.iter().find(|(small, _)| *small == base).map_or(1.0, |(_, cost)| *cost);
    small * blocks.into_iter().map(|block| block.work(base)).sum::<f64>()
}

/// How many samples all pixels should get at once, by what the first run found in some blocks: where the error is much the
/// same everywhere, rounds cost more than they save, and `goal`, for these blocks alone, is best reached in one. Where it
/// is not, samples are saved for an error even if that takes longer, as it does on small pictures of many triangles.
pub(super) fn base(seen: &Seen, goal: Goal, fall: f64, most: u32, entries_per_pixel: f64) -> u32 {
    let levels = Levels::new(most, fall);
    let all = seen.tiles.iter().flat_map(|tile| tile.blocks().zip(tile.smoothed(&levels)));
    let (blocks, errors): (Vec<Block>, Vec<f64>) = all.filter(|(block, _)| !block.is_sky).unzip();
    // All have as many.
    let drawn = f64::from(blocks.first().map_or(runs::FIRST_RUN, |block| block.samples));
    let pixels: f64 = blocks.iter().map(|block| f64::from(block.pixels)).sum();
    let round =
        (ROUND + ROUND_ENTRY * entries_per_pixel) * blocks.iter().map(|block| block.work(1)).sum::<f64>();
    // The price of a base (work for an error, or an error for work), and for an error the samples that it takes.
    let price = |base: u32| {
        let falls = libm::pow(drawn / f64::from(base), fall);
        let raised = |block: &Block| Block { samples: base, error: block.error * falls, ..*block };
        let all: Vec<Block> = blocks.iter().map(raised).collect();
        let error: f64 = all.iter().map(|block| block.error).sum();
        let work = first_work(blocks.iter().copied(), base);
        // What shows nothing but the sky has the fewest in any case.
        let samples = f64::from(base) * pixels + f64::from(runs::SKY_RUN) * (seen.pixels() - pixels);
        // Samples, work and error of what comes after.
        let more = |goal: Goal| {
            let errors = errors.iter().map(|error| error * falls).collect();
            let wanted = give_out(&all, errors, goal, &levels, u32::MAX);
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

#[cfg(test)]
mod tests {
    use super::super::allocate::TileBlocks;
    use super::*;

    /// Four tiles of blocks with 16 samples, of which `share` are wrong and the others done.
    fn tiles(share: f64) -> Seen {
        let error = |i: usize| if (i as f64) < share * 16.0 { 1.0 } else { 0.0 };
        let block = |i: usize| Block { pixels: 64, samples: 16, error: error(i), cost: 10.0, is_sky: false };
        Seen { tiles: (0..4).map(|_| TileBlocks::new((0..16).map(block).collect(), 4)).collect() }
    }

    #[test]
    fn what_is_alike_everywhere_is_drawn_at_once() {
        // An eighth of 64 blocks' squared error: four times the samples, where it falls by the power of 1.5.
        assert_eq!(base(&tiles(1.0), Goal::Error(8.0), 1.5, 1 << 14, 0.1), 64);
        assert_eq!(base(&tiles(1.0), Goal::Error(1.0), 1.5, 1 << 14, 0.1), 256);
    }

    #[test]
    fn where_little_is_wrong_all_begin_with_few() {
        assert_eq!(base(&tiles(0.25), Goal::Error(2.0), 1.5, 1 << 14, 0.1), 16);
        assert_eq!(base(&tiles(0.0), Goal::Error(1.0), 1.5, 1 << 14, 0.1), 16);
    }

    #[test]
    fn no_more_is_begun_with_than_there_is_time_for() {
        let work = |samples: u32| first_work(tiles(1.0).covered(), samples);
        assert_eq!(base(&tiles(1.0), Goal::Work(1.01 * work(256)), 1.5, 1 << 14, 0.1), 256);
        assert_eq!(base(&tiles(1.0), Goal::Work(0.99 * work(32)), 1.5, 1 << 14, 0.1), 16);
    }
}
