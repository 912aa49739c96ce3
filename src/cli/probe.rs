//! Small pictures of a scene with and without effects: what each takes, and what it changes.
//!
//! All are drawn by turns, round after round: what slows the machine down for a while slows all of a round.

use super::progress::Progress;
use groundglass::error::{ErrorKind, Result};
use groundglass::picture::Exposure;
use groundglass::render::{Execution, render};
use groundglass::scene::{
    Budget, EffectChoice, EffectSet, Hierarchy, Patches, PictureSettings, Scene, Sun, Surfaces,
};
use std::time::Instant;

/// Width and samples of the small pictures, which are four times as high at most.
pub(super) const PROBE: (u32, u32) = (160, 64);

/// How often each is drawn at least, and at most while that takes no longer than this for each.
const ROUNDS: [usize; 2] = [5, 40];
const SECONDS: f64 = 0.25;

/// So many times the squared difference of two pictures the square of the error that they state is no more than a good estimate of it: the
/// square of a factor of 1.5.
const SHOWN: f64 = 2.25;

/// What is added to a seed for other samples of the same scene, as of every other round: what two rounds have in common is not chance.
pub(super) const TWIN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A small picture of a scene with some of its effects.
pub(super) struct Probe {
    settings: PictureSettings,
    sun: Option<Sun>,
    /// Whether it is drawn with what [`Shadowed`] holds.
    pub(super) is_shadowed: bool,
    /// Of the first two rounds, of different samples.
    pictures: Vec<Exposure>,
    /// What it took, round by round.
    seconds: Vec<f64>,
    /// Whether the scene cannot have it, such as diffraction that bends light to where there is no film.
    pub(super) is_refused: bool,
}

/// What a scene's surfaces have in pictures with shadows, where the scene's own has none: which are shaded together, and what the sun's
/// rays go by.
#[derive(Default)]
pub(super) struct Shadowed(Patches, Option<Hierarchy>);

impl Shadowed {
    /// Puts them into the surfaces, and keeps what was there; and back.
    pub(super) fn exchange(&mut self, surfaces: &mut Surfaces) {
        std::mem::swap(&mut self.0, &mut surfaces.patches);
        std::mem::swap(&mut self.1, &mut surfaces.hierarchy);
    }
}

/// Width and height of a small picture of the same shape.
fn small(width: u32, height: u32) -> (u32, u32) {
    let part = |of: u32, most: u32, side: u32| {
        ((f64::from(of) * f64::from(most) / f64::from(side)).round() as u32).max(1)
    };
    let tallest = 4 * PROBE.0;
    match part(height, PROBE.0, width) {
        high if high <= tallest => (PROBE.0, high),
        _ => (part(width, tallest, height), tallest),
    }
}

impl Probe {
    /// Width and height, pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.settings.width, self.settings.height]
    }

    /// Of the scene as it is now, but for the effects.
    pub(super) fn new(scene: &Scene, active: EffectSet) -> Self {
        let mut settings = scene.render;
        (settings.width, settings.height) = small(settings.width, settings.height);
        settings.budget = Budget::Samples(PROBE.1);
        settings.effects = EffectChoice { all: false, with: active, without: active.others() };
        let (pictures, seconds) = (Vec::new(), Vec::new());
        Self { settings, sun: scene.sun, is_shadowed: false, pictures, seconds, is_refused: false }
    }

    fn draw(
        &mut self,
        scene: &mut Scene,
        shadowed: &mut Shadowed,
        round: usize,
        execution: Execution<'_>,
    ) -> Result<()> {
        (scene.render, scene.sun) = (self.settings, self.sun);
        if round % 2 == 1 {
            scene.render.seed = scene.render.seed.wrapping_add(TWIN);
        }
        if self.is_shadowed {
            shadowed.exchange(&mut scene.surfaces);
        }
        let start = Instant::now();
        let drawn = render(scene, execution);
        let seconds = start.elapsed().as_secs_f64();
        if self.is_shadowed {
            shadowed.exchange(&mut scene.surfaces);
        }
        let (picture, _) = drawn?;
        self.seconds.push(seconds);
        if round < 2 {
            self.pictures.push(picture);
        }
        Ok(())
    }

    /// How much longer than this the other takes, as a part of this one's time, and three standard errors of that.
    pub(super) fn extra_time(&self, other: &Self) -> [f64; 2] {
        let mut differences: Vec<f64> = self.seconds.iter().zip(&other.seconds).map(|(a, b)| b - a).collect();
        let more = median(&mut differences);
        let mut far: Vec<f64> = differences.iter().map(|difference| (difference - more).abs()).collect();
        // Of normal noise: its standard deviation from the median distance, and the error of a median of so many.
        let error = 1.4826 * median(&mut far) * 1.2533 / (differences.len() as f64).sqrt();
        let time = median(&mut self.seconds.clone());
        [more / time, 3.0 * error / time]
    }

    /// The RMS difference of the two, chance left out; and what it is at most, with what all may have missed.
    pub(super) fn change(&self, other: &Self) -> [f64; 2] {
        match (&self.pictures[..], &other.pictures[..]) {
            ([a, b], [c, d]) => {
                let [change, most] = Exposure::rms_change([a, b], [c, d], self.settings.exposure_ev);
                [change, (most * most + self.hidden() + other.hidden()).sqrt()]
            }
            _ => [0.0, f64::INFINITY],
        }
    }

    /// The square of the error that pictures state and do not show: samples that miss a small bright light all agree, so that nothing
    /// tells from them what it changes. 0 where they differ about as much as they say.
    fn hidden(&self) -> f64 {
        let [a, b] = &self.pictures[..] else { return 0.0 };
        let gap = a.rms_difference(b, self.settings.exposure_ev);
        let shown = 0.5 * gap * gap;
        let stated: f64 =
            [a, b].iter().filter_map(|picture| picture.rms_error()).map(|error| 0.5 * error * error).sum();
        if stated > SHOWN * shown { stated } else { 0.0 }
    }
}

/// The middle of the numbers, which it puts in order; of an even number of them the mean of the middle two.
pub(super) fn median(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    if numbers.len() % 2 == 1 { numbers[middle] } else { 0.5 * (numbers[middle - 1] + numbers[middle]) }
}

/// Draws all probes of the scene, whose settings and sun it changes. The first is of the scene as it is; another that is refused is
/// left out.
pub(super) fn measure(
    scene: &mut Scene,
    probes: &mut [Probe],
    shadowed: &mut Shadowed,
    execution: Execution<'_>,
) -> Result<()> {
    let progress = Progress::with_lines();
    let (start, count) = (Instant::now(), probes.len());
    let may_take = SECONDS * count as f64;
    let mut round = 0;
    while round < ROUNDS[0] || round < ROUNDS[1] && start.elapsed().as_secs_f64() < may_take {
        for place in 0..count {
            let done = round * count + place;
            progress.tell("measuring", done as u64, (count * ROUNDS[0]).max(done) as u64);
            // The first of one round is the last of the next.
            let place = if round % 2 == 0 { place } else { count - 1 - place };
            if probes[place].is_refused {
                continue;
            }
            match probes[place].draw(scene, shadowed, round, execution) {
                Err(error) if place > 0 && error.kind() == ErrorKind::Invalid => {
                    probes[place].is_refused = true
                }
                drawn => drawn?,
            }
        }
        round += 1;
    }
    progress.finish();
    Ok(())
}
