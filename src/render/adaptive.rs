//! Samples where they help most: rounds of all tiles, each of which gives blocks of pixels the runs of samples that take
//! most from the picture's error, until an error is reached or time is up.
//!
//! In: a [`Prepared`], and an error, a time, or numbers of samples. Out: the exposure ([`super::finish`]). First [`super::pilot`]
//! and [`super::base`], then rounds of [`super::allocate`] and [`super::progressive`] until
//! `e (1 + u) <= 3 width height error^2`, where `e` is the sum of squared errors and `u` the part of it that is uncertain; or
//! until the clock says so.
//!
//! What a block shows depends on its number of samples alone, so a list of these numbers makes the picture again.

use super::allocate::{Block, Forecast, Goal, TileBlocks, USUAL_FALL, allocate, fall};
use super::base::{LATER, base, first_work};
use super::few::Few;
use super::pilot::{self, Pilot, Seen};
use super::prepared::Prepared;
use super::progressive::Progressive;
use super::{Counts, Execution};
use crate::error::{Error, Result};
use crate::picture::{BlockSamples, Exposure};
use crate::sampling::runs::{FIRST_RUN, SKY_RUN, SKY_RUNS};

/// The most samples of a pixel on the way to an error: sixty-four times the usual number leaves an eighth or less of its
/// error, and a target beyond is told as out of reach.
pub const MOST_FOR_ERROR: u32 = 16_384;

/// What a round aims at, as a part of the squared error that is to be reached: falling short by little costs another round. (The
/// first goes by few tiles; at 1.06 it took 2 to 4 % more time on four scenes, and up to 2 % fewer samples.)
const AIM: f64 = 0.97;

/// How errors fall where the first round goes on. Blocks that get more are those whose error was large, some of them by
/// chance: 1.16 to 1.47 on four scenes.
const ROUNDS_FALL: f64 = 1.25;

/// How many standard deviations of the estimate are kept from the goal. A tile's squared error is taken to be as uncertain as it is
/// large: its pixels share their places on the lens, and along an edge they err alike.
const DEVIATIONS: f64 = 1.3;

/// How many more of one tile by itself, of several as much less: few tell little of how uncertain they are. (Nine balls before black, seven
/// tiles with an error, ended at up to 1.58 times the error asked for.)
const FEW_TILES: f64 = 6.0;

/// How many standard deviations are kept from the goal of a sum that is mostly that of so many tiles.
fn deviations(tiles: f64) -> f64 {
    DEVIATIONS + FEW_TILES / tiles
}

/// How much larger the variance of that is where edges or lights raise a tile's error: all of its pixels err by one throw there,
/// and of a normal one's square the variance is twice the mean's square.
const ONE_THROW: f64 = 2.0;

/// The same where light is far brighter than white: a part of the lens that one sample in ten or a hundred falls on makes a
/// pixel white.
const FEW_HITS: f64 = 6.0;

/// What came of a picture within a time.
pub(super) enum Timed {
    Done(Box<(Exposure, Counts)>),
    /// There is only time for so many samples of each pixel, drawn otherwise.
    TooShort(Few),
}

/// The pilot shows by so many samples how the error falls, however many are needed.
const MOST_FOR_PILOT: u32 = 64;

impl<'a> Prepared<'a> {
    /// Draws until the error is reached.
    pub(super) fn until_error(
        &'a self,
        error: f64,
        execution: &Execution<'_>,
        counts: Counts,
    ) -> Result<(Exposure, Counts)> {
        let mut progressive = Progressive::new(self, execution, counts)?;
        progressive.until_error(error, execution)?;
        progressive.finish(execution)
    }

    /// Draws from `start` until the time is up. Where there is no time for the first samples of every pixel, only tells how many
    /// there is time for.
    pub(super) fn until_clock(
        &'a self,
        (start, end): (f64, f64),
        execution: &Execution<'_>,
        counts: Counts,
    ) -> Result<Timed> {
        let mut progressive = Progressive::new(self, execution, counts)?;
        match progressive.until_clock(start, end, execution)? {
            Some(few) => Ok(Timed::TooShort(few)),
            None => progressive.finish(execution).map(|done| Timed::Done(Box::new(done))),
        }
    }

    /// Draws exactly these numbers of samples.
    pub(super) fn allocated(
        &'a self,
        samples: &BlockSamples,
        execution: &Execution<'_>,
        counts: Counts,
    ) -> Result<(Exposure, Counts)> {
        let mut progressive = Progressive::new(self, execution, counts)?;
        let wanted = progressive.by_block(|x, y| samples.get(x, y));
        progressive.clear(samples.base());
        let least =
            progressive.by_block(|x, y| if progressive.covered.has(x, y) { samples.base() } else { SKY_RUN });
        if wanted.iter().zip(least).any(|(&wanted, least)| wanted < least) {
            return Err(Error::invalid(format!(
                "gives less than {} samples to pixels that show more than the sky",
                samples.base()
            ))
            .at_key("allocation")
            .remedy("replay the numbers of a picture of this scene"));
        }
        progressive.round(&wanted, execution, &|| false)?;
        progressive.finish(execution)
    }
}

/// The part of the squared error that is allowed that the sky may take: surfaces make up for it.
const SKY_PART: f64 = 0.05;

/// What the sky may err by however much is allowed, RMS: all pixels of a tile err alike there, and where tiles meet no step is to be seen. It is a
/// sixth of a step of 8 bits where the sky is bright.
const SKY_MOST: f64 = 0.001;

/// As much later than asked for a picture of 16 samples may be done, as a part of its time, or of a second if that is more.
const LATE_PART: f64 = 0.03;

/// What a picture of one sample saves of the time of the rest of one of 16, at most.
const AGAIN_PART: f64 = 0.6;

/// The part of what is left that a pilot may take: tiles that are not done then are not of it.
const PILOT_PART: f64 = 0.3;

/// As a part of what came before it a pilot may take so much in any case. (A picture with diffraction was begun again for one sample, which
/// took twice the time of 16 at once, because nothing was seen of them.)
const PILOT_LEAST: f64 = 0.1;

/// The part of the time that a first run may take by the pilot's word: it cannot be stopped, and takes up to a quarter more where
/// the pilot's tiles are cheaper than the others. Rounds take what is left.
const FIRST_PART: f64 = 0.75;

impl Progressive<'_> {
    /// How uncertain the sum of squared errors is, as a part of it.
    fn uncertainty(&self) -> f64 {
        let sum = self.squared_error();
        let mut tiles = vec![(0.0, 0.0); self.picture.tiles()];
        for (block, (error, plain)) in self.errors.iter().zip(&self.plain).enumerate() {
            let tile = &mut tiles[self.tile_of(block)];
            *tile = (tile.0 + error, tile.1 + plain);
        }
        let variance = |((error, plain), &is_bright): ((f64, f64), &bool)| {
            let throws = if is_bright {
                FEW_HITS
            } else if error > plain {
                ONE_THROW
            } else {
                1.0
            };
            throws * error * error
        };
        let squares: f64 = tiles.iter().map(|(error, _)| error * error).sum();
        let variance: f64 = tiles.into_iter().zip(&self.bright).map(variance).sum();
        if squares > 0.0 { deviations(sum * sum / squares) * variance.sqrt() / sum } else { 0.0 }
    }

    fn until_error(&mut self, error: f64, execution: &Execution<'_>) -> Result<()> {
        let columns = self.samples.columns_and_rows().0 as usize;
        let count = self.picture.tiles();
        let (few, tiles) = (self.pilot_of(Pilot::to_choose), self.pilot_of(Pilot::for_error));
        self.sky = SKY_RUN;
        let mut seen = self.pilot(few, execution, &|| false)?;
        let allowed = error * error;
        // As uncertain as the error of so many tiles is at least, were they all alike: twenty keep three tenths of it from the goal.
        // (Before this was foreseen they fell short by as much, and another round took a tenth to a third of the time.)
        let foreseen = allowed / (1.0 + deviations(count as f64) / (count as f64).sqrt());
        let goal = |part: f64, pilot: &Seen| Goal::Error(part * foreseen * 3.0 * pilot.pixels());
        let entries = self.entries_per_pixel();
        let choose = |pilot: &Seen, falling| base(pilot, goal(1.0, pilot), falling, MOST_FOR_ERROR, entries);
        let look = choose(&seen, USUAL_FALL).min(MOST_FOR_PILOT);
        let (mut falling, mut first) = (USUAL_FALL, FIRST_RUN);
        if look > FIRST_RUN {
            self.clear(look);
            let more = self.pilot(few, execution, &|| false)?;
            // How the error falls is known now, by half: by a few tiles' word alone, 1.18, a picture that 256 samples had been enough for
            // began with 512. And more at once may be wanted.
            falling = 0.5 * (USUAL_FALL + pilot::fall(&seen.tiles, &more.tiles).unwrap_or(USUAL_FALL));
            (first, seen) = (choose(&more, falling).max(look), more);
        }
        if first > look {
            self.clear(first);
        }
        if first > look || few != tiles {
            seen = self.pilot(tiles, execution, &|| false)?;
        }
        self.sky = self.enough_for_sky(&seen, allowed);
        if self.sky != SKY_RUN {
            seen = self.pilot(tiles, execution, &|| false)?;
        }
        let forecast = Forecast::new(&seen.tiles, goal(AIM, &seen), ROUNDS_FALL, MOST_FOR_ERROR);
        let least = (forecast.least / (3.0 * seen.pixels())).sqrt();
        if let Some(tell) = execution.beyond_reach.filter(|_| least > error) {
            tell(least);
        }
        self.first_round(&forecast, execution)?;
        let mut before = None;
        loop {
            let goal = allowed * self.picture.values() / (1.0 + self.uncertainty());
            if self.squared_error() <= goal {
                return Ok(());
            }
            let blocks = self.blocks();
            let before = before.replace(blocks.clone()).unwrap_or_else(|| self.after_first());
            let falling = fall(&before, &blocks).unwrap_or(falling);
            let mut wanted = allocate(&blocks, columns, Goal::Error(AIM * goal), falling, MOST_FOR_ERROR);
            if wanted.iter().zip(&blocks).all(|(&wanted, block)| wanted <= block.samples) {
                // What was predicted is there and was not enough: ask for less, or be at the limit.
                wanted = allocate(&blocks, columns, Goal::Error(0.8 * goal), falling, MOST_FOR_ERROR);
                if wanted.iter().zip(&blocks).all(|(&wanted, block)| wanted <= block.samples) {
                    return Ok(());
                }
            }
            self.round(&wanted, execution, &|| false)?;
        }
    }

    /// As many samples as the sky needs by the word of the pilot, which drew it with the fewest: so that it takes little of the squared
    /// error that is `allowed` of a value; where the pilot saw nothing of it, [`FIRST_RUN`]. It is as good as linear over a pixel, so of
    /// `n` stratified samples in two halves `(2 / n)^3 / 24` of its variance is left. (While rounds gave it more where it erred, it was
    /// begun again with 4 and 8 samples all over the tower from below, which took 1.14 to 1.2 times as long.)
    fn enough_for_sky(&self, seen: &Seen, allowed: f64) -> u32 {
        let pixels = |blocks: &[Block]| blocks.iter().map(|block| f64::from(block.pixels)).sum::<f64>();
        let (all, drawn) = (self.blocks().into_iter(), seen.tiles.iter().flat_map(TileBlocks::blocks));
        let all: Vec<Block> = all.filter(|block| block.is_sky).collect();
        if all.is_empty() {
            return SKY_RUN;
        }
        let drawn: Vec<Block> = drawn.filter(|block| block.is_sky && block.samples == SKY_RUN).collect();
        if drawn.is_empty() {
            return FIRST_RUN;
        }
        let error = drawn.iter().map(|block| block.error).sum::<f64>() / pixels(&drawn) * pixels(&all);
        let left = |samples: u32| error * libm::pow(f64::from(SKY_RUN) / f64::from(samples), 3.0);
        let most = (SKY_PART * allowed * self.picture.values()).min(SKY_MOST * SKY_MOST * 3.0 * pixels(&all));
        let is_enough = |samples: &u32| left(*samples) <= most;
        SKY_RUNS.into_iter().find(is_enough).unwrap_or(FIRST_RUN)
    }

    /// Entries of the tiles' bins for each pixel that may show more than the sky: how dear it is to begin a tile again.
    fn entries_per_pixel(&self) -> f64 {
        let covered = self.blocks().into_iter().filter(|block| !block.is_sky);
        let pixels: f64 = covered.map(|block| f64::from(block.pixels)).sum();
        self.picture.bins.work() as f64 / pixels.max(1.0)
    }

    /// Draws until the time is up; where there is no time for the first run, the number of samples that there is time for.
    fn until_clock(&mut self, start: f64, end: f64, execution: &Execution<'_>) -> Result<Option<Few>> {
        let clock = execution.clock.unwrap_or(&|| 0.0);
        let late = || clock() >= end;
        let columns = self.samples.columns_and_rows().0 as usize;
        let pixels = self.picture.pixels();
        let begun = clock();
        let entries = self.entries_per_pixel();
        // Fewer begin again, with all that comes before the first sample: not if that takes as long.
        let again = begun - start;
        // Where a tile takes long the pilot must not take all of the time; and where there is hardly any left, how long the rest takes
        // must be known all the same.
        let until = begun + (PILOT_PART * (end - begun)).max(PILOT_LEAST * again);
        let pilot = self.pilot(self.pilot_of(Pilot::for_time), execution, &|| clock() >= until)?;
        let seen = pilot.pixels();
        let took = (clock() - begun).max(1e-9);
        let left = end - clock();
        let rest = if seen > 0.0 { took * (pixels - seen) / seen } else { f64::INFINITY };
        if rest > left + LATE_PART * (end - start).max(1.0) && again < AGAIN_PART * rest {
            return Ok(Some(Few::that_fit(again, rest, left)));
        }
        // Of a larger first run more samples are drawn in a time; what is left over goes into rounds.
        let goal =
            Goal::Work(FIRST_PART * left / took * first_work(pilot.covered(), FIRST_RUN) * seen / pixels);
        let most = self.picture.longest_run;
        let base = base(&pilot, goal, USUAL_FALL, most, entries);
        let begun = clock();
        self.clear(base);
        self.round(&self.first_samples(), execution, &|| false)?;
        let drawn = self.blocks().into_iter().filter(|block| !block.is_sky);
        let mut rate = first_work(drawn, base) / (clock() - begun).max(1e-9) / LATER;
        // A round takes what its predecessor's speed says, the first no more than a third of what is left: its errors
        // tell better where the rest should go.
        let mut share = 0.35;
        loop {
            let left = end - clock();
            if left <= 0.004 * (end - start) {
                return Ok(None);
            }
            let blocks = self.blocks();
            let goal = Goal::Work(share * left * rate);
            let wanted = allocate(&blocks, columns, goal, USUAL_FALL, most);
            let more = |(wanted, block): (&u32, &Block)| block.work(wanted - block.samples);
            let planned: f64 = wanted.iter().zip(&blocks).map(more).sum();
            if planned == 0.0 {
                if share >= 1.0 {
                    return Ok(None);
                }
                share = 1.0;
                continue;
            }
            let begun = clock();
            self.round(&wanted, execution, &late)?;
            rate = planned / (clock() - begun).max(1e-9);
            share = 0.9;
        }
    }
}
