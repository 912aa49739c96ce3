//! The measurements of a study, kept in its folder as they come.

use super::super::output;
use super::super::progress::Progress;
use super::super::report;
use super::ways::{Setting, Step, UNIFORM, draw, ladder};
use exr::prelude::{ReadChannels, ReadLayers};
use groundglass::error::{Error, ErrorKind, Result, Warning};
use groundglass::picture::{Allocation, Exposure};
use groundglass::render::{Execution, SimdLevel, render};
use groundglass::scene::{Budget, Files, Scene, Source};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Samples of the converged picture.
const TRUTH: u32 = 8192;
const QUICK_TRUTH: u32 = 2048;

/// A picture that takes longer than this is timed once.
const LONG_SECONDS: f64 = 4.0;
const QUICK_LONG_SECONDS: f64 = 0.3;

/// A quick study begins no step after so long.
const QUICK_SECONDS: f64 = 14.0;

/// What times are compared with: this many uniform samples, drawn just before.
pub(super) const BASELINE: u32 = 64;

/// One way at one setting, measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Measured {
    pub(super) way: String,
    pub(super) setting: String,
    /// Mean over the pixels.
    pub(super) samples: f64,
    /// RMS difference from the converged picture, both clamped, linear light.
    pub(super) true_rms: f64,
    /// What the picture says of itself.
    pub(super) stated_rms: Option<f64>,
    /// The median of the times, the shortest and the longest.
    pub(super) seconds: f64,
    pub(super) seconds_low: f64,
    pub(super) seconds_high: f64,
    /// The median over the time of 64 uniform samples, drawn just before.
    pub(super) ratio: f64,
}

/// What `cost.json` holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Table {
    pub(super) scene_hash: String,
    pub(super) version: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) quick: bool,
    pub(super) threads: usize,
    pub(super) simd: String,
    /// Samples of the converged picture, which has another seed.
    pub(super) converged_samples: u32,
    pub(super) measured: Vec<Measured>,
}

pub(super) struct Study<'a> {
    pub(super) scene: &'a Scene,
    pub(super) table: Table,
    /// Steps that a quick study had no time for.
    pub(super) left: usize,
    /// None until [`Study::measure`] has it.
    pub(super) truth: Option<Exposure>,
    /// The folder holds a study of another scene or in another way.
    holds_another: bool,
    folder: &'a Path,
    /// Threads, and bytes of memory that drawing may take.
    limits: (Option<usize>, Option<u64>),
    /// Files that were read, which no output may replace.
    pub(super) read: Vec<PathBuf>,
}

impl<'a> Study<'a> {
    /// A new study, or the one that the folder holds when it is of the same scene in the same way.
    pub(super) fn open(
        scene: &'a Scene,
        folder: &'a Path,
        limits: (Option<usize>, Option<u64>),
        quick: bool,
        read: Vec<PathBuf>,
    ) -> Result<Self> {
        let mut table = Table {
            scene_hash: scene.hash(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            width: scene.render.width,
            height: scene.render.height,
            quick,
            threads: limits.0.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)),
            simd: SimdLevel::best().name().to_owned(),
            converged_samples: if quick { QUICK_TRUTH } else { TRUTH },
            measured: Vec::new(),
        };
        let (mut truth, mut holds_another) = (None, false);
        let found = kept(&folder.join("cost.json"), 16 << 20);
        if let Some(found) = found.and_then(|text| serde_json::from_slice::<Table>(&text).ok()) {
            let blank = |table: &Table| Table { measured: Vec::new(), ..table.clone() };
            let same = serde_json::to_string(&blank(&found)).ok() == serde_json::to_string(&table).ok();
            holds_another = !same && !found.measured.is_empty();
            if same {
                truth = converged(&folder.join("converged.exr"), &table);
                // Errors against a picture that is gone are worth nothing.
                if truth.is_some() {
                    table = found;
                }
            }
        }
        Ok(Self { scene, table, left: 0, truth, holds_another, folder, limits, read })
    }

    /// Measures what is not measured yet.
    pub(super) fn measure(&mut self, cancel: &AtomicBool) -> Result<()> {
        let steps = ladder(self.scene, self.table.quick);
        let progress = Progress::new();
        let begun = Instant::now();
        // Work left is counted in samples: times differ by way, but these are known beforehand.
        let work = |step: &Step| match step.setting {
            Setting::Samples(n) | Setting::ErrorOf(n) | Setting::Approximation(n) => {
                u64::from(n + BASELINE) * 3
            }
            // A sample takes some fifty times as long, and is timed once.
            Setting::Double(n) => u64::from(50 * n + BASELINE),
        };
        let truth_work = u64::from(self.table.converged_samples);
        let total = truth_work + steps.iter().map(work).sum::<u64>();
        let mut done = 0;
        let truth = match self.truth.take() {
            Some(truth) => truth,
            None => {
                let told = |tile: usize, tiles: usize| {
                    progress.tell("converging", truth_work * tile as u64 / tiles.max(1) as u64, total);
                };
                let converged = self.converge(Execution { progress: Some(&told), ..self.execution(cancel) });
                converged.map_err(|error| {
                    stopped(error, "nothing was measured yet: the converged picture comes first")
                })?
            }
        };
        done += truth_work;
        for step in &steps {
            progress.tell("measuring", done, total);
            done += work(step);
            if self.find(&step.way, &step.setting.name()).is_none() {
                if self.table.quick && begun.elapsed().as_secs_f64() > QUICK_SECONDS {
                    self.left += 1;
                    continue;
                }
                let measured = self.time(step, &truth, cancel).map_err(|error| {
                    let folder = self.folder.display();
                    stopped(error, format!("the same command goes on; {folder} keeps what was measured"))
                })?;
                self.table.measured.push(measured);
                self.save()?;
            }
        }
        progress.finish();
        self.truth = Some(truth);
        Ok(())
    }

    pub(super) fn find(&self, way: &str, setting: &str) -> Option<&Measured> {
        self.table.measured.iter().find(|found| found.way == way && found.setting == setting)
    }

    fn execution<'b>(&self, cancel: &'b AtomicBool) -> Execution<'b> {
        Execution {
            threads: self.limits.0,
            memory: self.limits.1,
            cancel: Some(cancel),
            ..Execution::default()
        }
    }

    /// The converged picture, of other samples than any that is measured.
    fn converge(&mut self, execution: Execution<'_>) -> Result<Exposure> {
        let mut scene = self.scene.clone();
        scene.render.budget = Budget::Samples(self.table.converged_samples);
        scene.render.seed = scene.render.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let (truth, _) = render(&scene, execution)?;
        if self.holds_another {
            self.set_aside()?;
        }
        let path = self.folder.join("converged.exr");
        output::write_whole(&path, &self.read, |file| truth.write_exr(&[], file))?;
        self.table.measured.clear();
        self.save()?;
        Ok(truth)
    }

    /// Renames the table of another study, and says so.
    fn set_aside(&mut self) -> Result<()> {
        let table = self.folder.join("cost.json");
        let free = (1..).map(|n| self.folder.join(format!("cost.{n}.json"))).find(|path| !path.exists());
        let Some(kept) = free else { return Ok(()) };
        std::fs::rename(&table, &kept).map_err(|error| output::broken(&table, &error))?;
        self.holds_another = false;
        report::warnings(&[Warning {
            file: table.display().to_string(),
            line: None,
            message: format!(
                "this was of another scene or another way to measure, and is now {}",
                kept.display()
            ),
        }]);
        Ok(())
    }

    fn save(&self) -> Result<()> {
        let mut text = serde_json::to_string_pretty(&self.table).unwrap_or_default();
        text.push('\n');
        output::write_text(&self.folder.join("cost.json"), &self.read, &text)
    }

    /// Draws a step's picture once.
    pub(super) fn draw(&self, step: &Step, cancel: &AtomicBool) -> Result<Exposure> {
        let error = match step.setting {
            Setting::ErrorOf(n) => self
                .find(UNIFORM, &Setting::Samples(n).name())
                .and_then(|found| found.stated_rms)
                .filter(|&error| error > 0.0)
                .unwrap_or(f64::MIN_POSITIVE.sqrt()),
            _ => 0.0,
        };
        draw(self.scene, step, error, self.execution(cancel))
    }

    fn time(&self, step: &Step, truth: &Exposure, cancel: &AtomicBool) -> Result<Measured> {
        let timed = |step: &Step| -> Result<(Exposure, f64)> {
            let start = Instant::now();
            let picture = self.draw(step, cancel)?;
            Ok((picture, start.elapsed().as_secs_f64()))
        };
        let baseline = Step { way: UNIFORM.to_owned(), setting: Setting::Samples(BASELINE) };
        let (_, baseline) = timed(&baseline)?;
        let (picture, first) = timed(step)?;
        let mut times = vec![first];
        let long = if self.table.quick { QUICK_LONG_SECONDS } else { LONG_SECONDS };
        for _ in 0..if first > long { 0 } else { 2 } {
            times.push(timed(step)?.1);
        }
        times.sort_by(f64::total_cmp);
        let seconds = times[times.len() / 2];
        Ok(Measured {
            way: step.way.clone(),
            setting: step.setting.name(),
            samples: picture.samples().mean(),
            true_rms: picture.rms_difference(truth, self.scene.render.exposure_ev),
            stated_rms: picture.rms_error(),
            seconds,
            seconds_low: times[0],
            seconds_high: times[times.len() - 1],
            ratio: seconds / baseline,
        })
    }
}

/// An error with a remedy, if it is that the study was stopped.
fn stopped(error: Error, remedy: impl Into<String>) -> Error {
    if error.kind() == ErrorKind::Cancelled { error.remedy(remedy) } else { error }
}

/// The converged picture of an earlier run, if it is there and whole.
fn converged(path: &Path, table: &Table) -> Option<Exposure> {
    let (width, height) = (table.width as usize, table.height as usize);
    let area = width.checked_mul(height)?;
    // Twelve bytes a pixel, of which compression leaves hardly more at the worst, and a head.
    let bytes = kept(path, 16 * area as u64 + (1 << 20))?;
    // A damaged file may claim any size, and room is made for that before anything is read.
    let head = exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes), false).ok()?;
    let is_ours = |header: &exr::meta::header::Header| {
        (header.layer_size.width(), header.layer_size.height()) == (width, height)
    };
    if !head.headers.iter().all(is_ours) {
        return None;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0f32; 3]; area]),
            |(width, pixels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                if let Some(pixel) = pixels.get_mut(at.y() * *width + at.x()) {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .ok()?;
    let (_, pixels) = image.layer_data.channel_data.pixels;
    let is_whole = pixels.iter().flatten().all(|value| value.is_finite());
    is_whole.then(|| {
        let samples = Allocation::Uniform(table.converged_samples);
        Exposure::from_rows(table.width, table.height, &pixels, samples)
    })
}

/// For a study of nothing.
pub(super) fn nothing() -> Error {
    Error::invalid("nothing was measured")
}

/// A regular file of an earlier study, if there is one and it is no larger than `most`.
fn kept(path: &Path, most: u64) -> Option<Vec<u8>> {
    let files = Files::new();
    files.argument(path).and_then(|path| files.read(&path, most).map(Cow::into_owned)).ok()
}
