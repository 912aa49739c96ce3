//! The measurements of a study: steps in, a row of the table for each out, kept in its folder as they come ([`super::kept`]).

use super::super::machine;
use super::super::notes::notes;
use super::super::output;
use super::super::probe::{TWIN, median};
use super::super::progress::Progress;
use super::kept::{Another, Measured, Table, refuse_another, save, set_aside, take_up};
use super::reference;
use super::report::files;
use super::ways::{Setting, Step, UNIFORM, draw, ladder, turn};
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::picture::Exposure;
use groundglass::plan::RenderPlan;
use groundglass::render::{Execution, SimdLevel, render};
use groundglass::scene::{Budget, EffectChoice, Scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Samples of the converged picture.
const TRUTH: u32 = 8192;

/// The same of a quick study: the most that take no longer than this, as far as 16 tell, so that there is time for the ladder.
const QUICK_TRUTHS: [u32; 3] = [2048, 1024, 512];
const QUICK_CONVERGING_SECONDS: f64 = 5.0;

/// A picture is timed three times; one that takes longer than this, twice, so that times have their bars.
const LONG_SECONDS: f64 = 6.0;
const QUICK_LONG_SECONDS: f64 = 0.3;

/// A quick study begins no step after so long.
const QUICK_SECONDS: f64 = 14.0;

/// What times are compared with: this many uniform samples, drawn just before.
pub(super) const BASELINE: u32 = 64;

/// A picture that takes less than this in all runs so far is drawn again, so many times at most: one of a millisecond by itself
/// says little of how long it takes.
const SHORT_SECONDS: f64 = 0.1;
const MOST_RUNS: usize = 15;

pub(super) struct Study<'a> {
    pub(super) scene: &'a Scene,
    pub(super) table: Table,
    /// Steps that a quick study had no time for.
    pub(super) left: usize,
    /// None until [`Study::measure`] has it.
    pub(super) truth: Option<Exposure>,
    another: Option<Another>,
    folder: &'a Path,
    /// Threads, and bytes of memory that drawing may take.
    limits: (usize, Option<u64>),
    /// Files that were read, which no output may replace.
    pub(super) read: Vec<PathBuf>,
    /// What all pictures have and have not, whatever is asked of each. (By a plan of its own a picture with a small error has what the
    /// converged one leaves out.)
    pub(super) plan: RenderPlan,
    /// Why the ways in double precision are left out, if they are.
    pub(super) not_doubled: Option<String>,
}

impl<'a> Study<'a> {
    /// A new study, or the one that the folder holds when it is of the same scene in the same way.
    ///
    /// # Errors
    /// As [`machine::on_threads`].
    pub(super) fn open(
        scene: &'a Scene,
        folder: &'a Path,
        limits: (usize, Option<u64>),
        quick: bool,
        read: Vec<PathBuf>,
    ) -> Result<Self> {
        let (plan, not_doubled) = machine::on_threads(Some(limits.0), || {
            let plan = RenderPlan::new(scene);
            let not_doubled = reference::differs(scene, plan.active());
            (plan, not_doubled)
        })?;
        let mut table = Table {
            scene_hash: scene.hash(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            width: scene.render.width,
            height: scene.render.height,
            quick,
            threads: limits.0,
            simd: SimdLevel::best().name().to_owned(),
            effects: plan.active().iter().map(|effect| effect.name()).collect::<Vec<_>>().join(" "),
            converged_samples: if quick { QUICK_TRUTHS[0] } else { TRUTH },
            converged_rms: None,
            baseline_seconds: None,
            measured: Vec::new(),
        };
        let (truth, another) = take_up(folder, scene, &mut table);
        Ok(Self { scene, table, left: 0, truth, another, folder, limits, read, not_doubled, plan })
    }

    /// Measures what is not measured yet.
    ///
    /// # Errors
    /// Before any work where the folder cannot be written to or a file that was read lies where one is to be written; and as [`render`].
    pub(super) fn measure(&mut self, cancel: &AtomicBool) -> Result<()> {
        for name in files() {
            output::refuse_inputs(&self.folder.join(name), &self.read)?;
        }
        for name in ["converged.exr", "cost.json"] {
            output::check(&self.folder.join(name), &self.read)?;
        }
        let told = ladder(self.plan.active(), self.not_doubled.is_none(), self.table.quick);
        let mut steps = told.clone();
        if self.table.quick {
            steps.sort_by_key(turn);
        }
        let progress = Progress::with_lines();
        let begun = Instant::now();
        // What is left, in samples that take as long as those of the converged picture.
        let mut left: Vec<f64> = steps
            .iter()
            .map(|step| if self.find(&step.way, &step.setting.name()).is_some() { 0.0 } else { work(step) })
            .collect();
        let allowed = if self.table.quick { QUICK_SECONDS } else { f64::INFINITY };
        let tell = |what: &str, rate: f64, left: f64| {
            let done = begun.elapsed().as_secs_f64();
            let left = (left * rate).min((allowed - done).max(0.0));
            // In milliseconds, so that the time left is as long as it says.
            progress.tell(what, (1e3 * done) as u64, (1e3 * (done + left)) as u64);
        };
        let mut rate = None;
        let truth = match self.truth.take() {
            Some(truth) => truth,
            None => {
                if self.table.quick && self.table.measured.is_empty() {
                    self.table.converged_samples = self.affordable(cancel)?;
                }
                let ladder: f64 = left.iter().sum();
                let samples = f64::from(self.table.converged_samples);
                let each = |tile: usize, tiles: usize| {
                    let part = tile as f64 / tiles.max(1) as f64;
                    let rate = begun.elapsed().as_secs_f64() / (part * samples).max(1.0);
                    tell("converging", rate, (1.0 - part) * samples + ladder);
                };
                let converged = self.converge(Execution { progress: Some(&each), ..self.execution(cancel) });
                let truth = converged.map_err(|error| match self.table.measured.is_empty() {
                    true => stopped(error, "nothing was measured yet: the converged picture comes first"),
                    false => stopped(error, self.goes_on()),
                })?;
                rate = Some(begun.elapsed().as_secs_f64() / samples);
                truth
            }
        };
        for (i, step) in steps.iter().enumerate() {
            tell("measuring", rate.unwrap_or(0.0), left.iter().sum());
            let has_target = !matches!(step.setting, Setting::ErrorOf(_)) || self.target(step).is_some();
            if has_target && self.find(&step.way, &step.setting.name()).is_none() {
                let is_late = begun.elapsed().as_secs_f64() > QUICK_SECONDS;
                // The first is measured in any case: crops and words are of it.
                if self.table.quick && is_late && !self.table.measured.is_empty() {
                    self.left += 1;
                    continue;
                }
                let start = Instant::now();
                let measured =
                    self.time(step, &truth, cancel).map_err(|error| stopped(error, self.goes_on()))?;
                // What one way took tells of its like: a sample of one is as dear as a thousand of another.
                let took = start.elapsed().as_secs_f64();
                let rate = *rate.get_or_insert(took / work(step));
                let dearer = took / rate / work(step);
                for (left, other) in left.iter_mut().zip(&steps).skip(i + 1) {
                    if *left > 0.0 && is_like(step, other) {
                        *left = dearer * work(other);
                    }
                }
                self.table.measured.push(measured);
                let place = |row: &Measured| {
                    told.iter().position(|step| step.way == row.way && step.setting.name() == row.setting)
                };
                self.table.measured.sort_by_key(place);
                save(self.folder, &self.table, &self.read)?;
            }
            if let Some(left) = left.get_mut(i) {
                *left = 0.0;
            }
        }
        progress.finish();
        self.truth = Some(truth);
        Ok(())
    }

    /// An error if the study was stopped, after all its rows were there.
    pub(super) fn unless_stopped(&self, cancel: &AtomicBool) -> Result<()> {
        match cancel.load(Ordering::SeqCst) {
            true => {
                Err(Error::new(ErrorKind::Cancelled, "stopped before it was done").remedy(self.goes_on()))
            }
            false => Ok(()),
        }
    }

    fn goes_on(&self) -> String {
        format!("the same command goes on; {} keeps what was measured", self.folder.display())
    }

    pub(super) fn find(&self, way: &str, setting: &str) -> Option<&Measured> {
        self.table.measured.iter().find(|found| found.way == way && found.setting == setting)
    }

    fn execution<'b>(&self, cancel: &'b AtomicBool) -> Execution<'b> {
        Execution {
            threads: Some(self.limits.0),
            memory: self.limits.1,
            cancel: Some(cancel),
            ..Execution::default()
        }
    }

    /// How many samples of the converged picture a quick study has time for.
    fn affordable(&self, cancel: &AtomicBool) -> Result<u32> {
        let few = Step { way: UNIFORM.to_owned(), setting: Setting::Samples(16) };
        let mut seconds = f64::INFINITY;
        // Twice: memory is touched first by the first.
        for _ in 0..2 {
            let start = Instant::now();
            self.draw(&few, cancel)?;
            seconds = seconds.min(start.elapsed().as_secs_f64());
        }
        Ok(most_converged(seconds / 16.0))
    }

    /// The converged picture, of other samples than any that is measured.
    fn converge(&mut self, execution: Execution<'_>) -> Result<Exposure> {
        let mut scene = converging(self.scene, self.table.converged_samples);
        let asked = scene.render.effects;
        scene.render.effects = self.effects();
        let (truth, _) = render(&scene, execution)?;
        // The picture's notes tell what was asked for.
        scene.render.effects = asked;
        self.table.converged_rms = truth.rms_error();
        if let Some(another) = self.another.take() {
            set_aside(self.folder, &another)?;
        }
        // Another run that made the folder and was stopped has taken it away again.
        let _again = output::Folder::given(self.folder)?;
        refuse_another(self.folder, &self.table)?;
        let path = self.folder.join("converged.exr");
        let notes = notes(&scene, &truth, self.plan.left_out());
        output::write_whole(&path, &self.read, |file| truth.write_exr(&notes, file))?;
        save(self.folder, &self.table, &self.read)?;
        Ok(truth)
    }

    /// Draws a step's picture once.
    pub(super) fn draw(&self, step: &Step, cancel: &AtomicBool) -> Result<Exposure> {
        self.draw_of(&mut self.planned(), step, cancel)
    }

    /// The scene, with the effects of the plan.
    fn planned(&self) -> Scene {
        let mut scene = self.scene.clone();
        scene.render.effects = self.effects();
        scene
    }

    fn effects(&self) -> EffectChoice {
        let active = self.plan.active();
        EffectChoice { all: false, with: active, without: active.others() }
    }

    /// As [`Study::draw`], of a scene that is this study's and stays so.
    fn draw_of(&self, scene: &mut Scene, step: &Step, cancel: &AtomicBool) -> Result<Exposure> {
        // Of other steps it is not asked for.
        let error = self.target(step).unwrap_or_default();
        draw(scene, step, error, self.execution(cancel))
    }

    /// The error that a step asks for, if it does and there is one: that of a picture without any is reached as soon as it is begun.
    fn target(&self, step: &Step) -> Option<f64> {
        let Setting::ErrorOf(n) = step.setting else { return None };
        let stated = self.find(UNIFORM, &Setting::Samples(n).name())?.stated_rms;
        stated.filter(|&error| error > 0.0)
    }

    fn time(&mut self, step: &Step, truth: &Exposure, cancel: &AtomicBool) -> Result<Measured> {
        let mut scene = self.planned();
        let mut timed = |step: &Step| -> Result<(Exposure, f64)> {
            let start = Instant::now();
            let picture = self.draw_of(&mut scene, step, cancel)?;
            Ok((picture, start.elapsed().as_secs_f64()))
        };
        let baseline = Step { way: UNIFORM.to_owned(), setting: Setting::Samples(BASELINE) };
        let long = if self.table.quick { QUICK_LONG_SECONDS } else { LONG_SECONDS };
        // By turns, so that what slows the machine down slows both.
        let (_, base) = timed(&baseline)?;
        let (picture, first) = timed(step)?;
        let (mut times, mut ratios, mut bases) = (vec![first], vec![first / base], vec![base]);
        let least = if first > long { 2 } else { 3 };
        while times.len() < least || (times.len() < MOST_RUNS && times.iter().sum::<f64>() < SHORT_SECONDS) {
            let (_, base) = timed(&baseline)?;
            let (_, seconds) = timed(step)?;
            times.push(seconds);
            ratios.push(seconds / base);
            bases.push(base);
        }
        let (seconds, ratio) = (median(&mut times), median(&mut ratios));
        self.table.baseline_seconds.get_or_insert(median(&mut bases));
        Ok(Measured {
            way: step.way.clone(),
            setting: step.setting.name(),
            samples: picture.samples().mean(),
            true_rms: picture.rms_difference(truth, self.scene.render.exposure_ev),
            stated_rms: picture.rms_error(),
            seconds,
            seconds_low: times[0],
            seconds_high: times[times.len() - 1],
            ratio,
        })
    }
}

/// The scene of the converged picture of so many samples: other ones than those of any picture that is measured.
pub(super) fn converging(scene: &Scene, samples: u32) -> Scene {
    let mut scene = scene.clone();
    scene.render.budget = Budget::Samples(samples);
    scene.render.seed = scene.render.seed.wrapping_add(TWIN);
    scene
}

/// The most samples of a quick study's converged picture that are done in time, where one takes so long.
fn most_converged(each: f64) -> u32 {
    let is_in_time = |samples: &u32| f64::from(*samples) * each <= QUICK_CONVERGING_SECONDS;
    QUICK_TRUTHS.into_iter().find(is_in_time).unwrap_or(QUICK_TRUTHS[2])
}

/// Whether a study's converged picture may have so many samples.
pub(super) fn converges_by(quick: bool, samples: u32) -> bool {
    if quick { QUICK_TRUTHS.contains(&samples) } else { samples == TRUTH }
}

/// How long a step takes, in samples that take as long as those of the converged picture: a guess before it is measured.
fn work(step: &Step) -> f64 {
    match step.setting {
        Setting::Samples(n) | Setting::ErrorOf(n) => 3.0 * f64::from(n + BASELINE),
        Setting::Approximation(n) => 3.0 * f64::from(20 * n + BASELINE),
        Setting::Double(n) => 3.0 * f64::from(50 * n + BASELINE),
    }
}

/// Whether two steps take about as long a sample.
fn is_like(a: &Step, b: &Step) -> bool {
    std::mem::discriminant(&a.setting) == std::mem::discriminant(&b.setting)
}

/// An error with a remedy, if it is that the study was stopped.
fn stopped(error: Error, remedy: impl Into<String>) -> Error {
    if error.kind() == ErrorKind::Cancelled { error.remedy(remedy) } else { error }
}

/// For a study of nothing.
pub(super) fn nothing() -> Error {
    Error::invalid("nothing was measured")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::input::Input;
    use groundglass::scene::EffectName;

    #[test]
    fn all_pictures_of_a_study_have_the_same_effects() -> Result<()> {
        let mut scene = Input::builtin()?.load()?;
        scene.render.diffraction = true;
        let study = Study::open(&scene, Path::new("none"), (1, None), true, Vec::new())?;
        let of = |mut scene: Scene, error: f64| {
            scene.render.budget = Budget::MaxError(error);
            RenderPlan::new(&scene).active()
        };
        assert!(study.plan.left_out().has(EffectName::Diffraction));
        // By its own plan a picture with so small an error has more.
        assert!(of(scene.clone(), 1e-4).has(EffectName::Diffraction));
        assert_eq!(of(study.planned(), 1e-4), study.plan.active());
        Ok(())
    }

    #[test]
    fn a_dear_scene_has_fewer_samples_in_its_quick_converged_picture() {
        assert_eq!([0.001, 0.003, 0.008, 1.0].map(most_converged), [2048, 1024, 512, 512]);
        assert!(converges_by(true, 512) && !converges_by(true, 0) && !converges_by(false, 512));
    }
}
