//! `groundglass render [SCENE]`: a picture.

use super::effects::EffectArguments;
use super::input::{self, Input, MemoryArguments, RootArguments};
use super::progress::Progress;
use super::render_files::{Files, Format};
use super::replay::Replay;
use super::stats::{Asked, Samples, Stats};
use super::values::{self, Pixels, Positive, Seconds, Simd};
use super::{diagram, figure_file, interrupt, machine, notes, optics_words, output, render_words, report};
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::picture::{Allocation, Exposure};
use groundglass::plan::RenderPlan;
use groundglass::render::{Counts, Execution, SimdLevel, render, replay};
use groundglass::sampling::runs::MOST_SAMPLES;
use groundglass::scene::{Budget, EffectSet, Scene};
use std::path::PathBuf;
use std::time::Instant;

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("budget").multiple(false))]
pub(super) struct Arguments {
    /// The scene file (TOML); without one, the built-in scene
    #[arg(value_name = "SCENE")]
    pub(super) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(super) root: RootArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    /// The picture: .png (8-bit sRGB) or .exr (linear float); groundglass-out/STEM.png by default. The built-in scene's diagram goes
    /// beside it
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = values::output())]
    pub(super) output: Option<PathBuf>,
    /// Exactly this many samples for each pixel
    #[arg(long, value_name = "N", group = "budget", allow_negative_numbers = true, value_parser = values::samples)]
    pub(super) samples: Option<u32>,
    /// Stop at this error: root mean square over the picture, linear light
    #[arg(long, value_name = "E", group = "budget", allow_hyphen_values = true)]
    pub(super) max_error: Option<Positive>,
    /// Stop after this time, such as 2s, 500ms or 5min
    #[arg(long, value_name = "TIME", group = "budget", allow_hyphen_values = true)]
    pub(super) time_budget: Option<Seconds>,
    /// Width of the picture in pixels; the height follows
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    pub(super) width: Option<Pixels>,
    /// Number of threads; all cores by default. The picture does not depend on it
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = values::threads)]
    pub(super) threads: Option<u16>,
    /// Vector instructions to use, to compare: scalar, sse4.2, avx2, avx512, neon or simd128, as far as the machine has them; the
    /// widest by default. The picture does not depend on it
    #[arg(long, value_name = "LEVEL")]
    pub(super) simd: Option<Simd>,
    /// Write numbers about the run (JSON)
    #[arg(long, value_name = "FILE")]
    pub(super) stats: Option<PathBuf>,
    /// Write the estimated error of each pixel (.exr, linear float, or .png, brightened so that its RMS is mid-grey)
    #[arg(long, value_name = "FILE")]
    pub(super) error_map: Option<PathBuf>,
    #[command(flatten)]
    pub(super) effects: EffectArguments,
    /// Make the picture of an earlier run again, the same bytes, from what its --stats wrote: its width, too
    #[arg(long, value_name = "STATS", group = "budget", conflicts_with = "width")]
    pub(super) replay: Option<PathBuf>,
}

impl Arguments {
    /// What replaces the scene's budget.
    fn budget(&self) -> Option<Budget> {
        let samples = self.samples.map(Budget::Samples);
        let error = self.max_error.map(|error| Budget::MaxError(error.0));
        let time = self.time_budget.map(|time| Budget::Seconds(time.0));
        samples.or(error).or(time)
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let files = Files::new(arguments)?;
    let root = arguments.root.root.as_deref();
    let replayed = arguments.replay.as_deref().map(|stats| Replay::read(stats, root)).transpose()?;
    let threads = machine::threads(arguments.threads);
    let input = match &arguments.scene {
        Some(scene) => input::read_scene(scene, root)?,
        None => Input::builtin()?,
    }
    .within(arguments.memory, threads);
    // What cannot be written is said before the work, and again when the files that are read are known.
    files.check(&input.read_paths())?;
    let clock = Instant::now();
    let width = replayed.as_ref().map(|replay| replay.width).or(arguments.width.map(|width| width.0));
    let (scene, asked) = load(arguments, &input, width, replayed.as_ref())?;
    let load_seconds = clock.elapsed().as_secs_f64();
    report::warnings(&scene.warnings);
    report::warnings(&optics_words::scene_warnings(&scene, &input.name()));
    report::warnings(replayed.as_ref().and_then(Replay::warning).as_slice());
    let allocation = replayed.map(|replay| replay.allocation(&scene)).transpose()?;
    let mut read = input.read_paths();
    read.extend(arguments.replay.clone());
    // Held to the end: a picture that is not made leaves no folder.
    let (_folder, ()) = output::in_made(files.folder(), || files.check(&read))?;
    let effects = match files.stats {
        Some(_) => machine::on_threads(Some(threads), || RenderPlan::new(&scene).effects().to_vec())?,
        None => Vec::new(),
    };

    let progress = Progress::new();
    let (clock, cpu) = (Instant::now(), machine::cpu_seconds());
    let simd = arguments.simd.map_or_else(SimdLevel::best, |simd| simd.0);
    let drawn = draw(arguments, &input, &scene, allocation.as_ref(), (threads, simd), (&progress, clock));
    let (render_seconds, cpu_seconds) = (clock.elapsed().as_secs_f64(), machine::cpu_seconds() - cpu);
    progress.finish();
    let (exposure, counts) = drawn?;
    write(&files, &scene, &exposure, counts.left_out, &read)?;
    if let (Some((target, _)), None) = (files.error_map, exposure.rms_error()) {
        report::warnings(&[render_words::no_error_map(&input.name(), target)]);
    }
    let stats = Stats {
        width: exposure.width(),
        height: exposure.height(),
        threads,
        load_seconds,
        render_seconds,
        cpu_seconds,
        samples_per_pixel: Samples::of(exposure.samples()),
        estimated_rms_error: exposure.rms_error(),
        allocation: exposure.samples().to_text(),
        effects,
        simd: simd.name(),
        triangles: counts.triangles,
        surfaces: counts.surfaces,
        bin_entries: counts.bin_entries,
        samples: counts.samples,
        shading_requests: counts.shading_requests,
        unseen_light_blocks: counts.unseen_light,
        stages: counts.stages,
        asked,
        scene_hash: scene.hash(),
        version: env!("CARGO_PKG_VERSION"),
    };
    if let Some(target) = files.stats {
        let mut text = serde_json::to_string_pretty(&stats).unwrap_or_default();
        text.push('\n');
        output::write_text(target, &read, &text)?;
    }
    report::print(&render_words::summary(&files.picture.0, &stats))?;
    if counts.unseen_light > 0 {
        report::warnings(&[render_words::unseen_light(&input.name(), counts.unseen_light)]);
    }
    if allocation.is_none() {
        report::warnings(render_words::missed(&input.name(), scene.render.budget, &stats).as_slice());
    }
    if arguments.scene.is_none() {
        let width = width.map(|width| format!(" --width {width}"));
        first_steps(&scene, &files.diagrams, exposure.samples().mean(), &width.unwrap_or_default())?;
    }
    Ok(())
}

/// The scene, and what was asked for: by the file, the command line, or the run that is made again.
fn load(
    arguments: &Arguments,
    input: &Input,
    width: Option<u32>,
    replayed: Option<&Replay>,
) -> Result<(Scene, Asked)> {
    let mut scene = input.load_at(width)?;
    scene.render.budget = arguments.budget().unwrap_or(scene.render.budget);
    let mut effects = arguments.effects.clone();
    if let Some(replay) = replayed {
        effects = replay.ask(&mut scene, &effects)?;
    }
    effects.apply(&mut scene).map_err(|error| match replayed {
        Some(replay) => replay.blame(&error),
        None => error,
    })?;
    if arguments.error_map.is_some()
        && matches!(scene.render.budget, Budget::Samples(1))
        && replayed.is_none()
    {
        return Err(Error::new(ErrorKind::Usage, "--error-map: of one sample a pixel no error is known")
            .remedy("take 2 samples or more"));
    }
    let asked = replayed.map_or_else(|| Asked::new(scene.render.budget, &effects), Replay::asked);
    Ok((scene, asked))
}

/// Draws the picture, `clock` running since before.
fn draw(
    arguments: &Arguments,
    input: &Input,
    scene: &Scene,
    allocation: Option<&Allocation>,
    (threads, simd): (usize, SimdLevel),
    (progress, clock): (&Progress, Instant),
) -> Result<(Exposure, Counts)> {
    let tell = |done: usize, total: usize| progress.tell("rendering", done as u64, total as u64);
    let seconds = || clock.elapsed().as_secs_f64();
    let beyond_reach = |expected: f64| {
        if let Budget::MaxError(wanted) = scene.render.budget {
            progress.pause(|| {
                report::warnings(&[render_words::seems_beyond_reach(&input.name(), wanted, expected)])
            });
        }
    };
    let rendered = interrupt::polled(|cancel| {
        let timed = arguments.stats.is_some() || matches!(scene.render.budget, Budget::Seconds(_));
        let execution = Execution {
            threads: Some(threads),
            memory: input.room(),
            simd: Some(simd),
            cancel: Some(cancel),
            progress: Some(&tell),
            beyond_reach: Some(&beyond_reach),
            clock: timed.then_some(&seconds),
            error_map: arguments.error_map.is_some(),
        };
        match allocation {
            Some(allocation) => replay(scene, allocation, execution),
            None => render(scene, execution),
        }
    });
    rendered.map_err(|error| {
        // Numbers of samples are those of the file that is replayed.
        let replayed =
            arguments.replay.as_ref().filter(|_| error.place().key.as_deref() == Some("allocation"));
        error.in_file(replayed.map_or_else(|| input.name(), |path| path.display().to_string()))
    })
}

/// Writes the picture, and the map of its error where there is one.
fn write(
    files: &Files<'_>,
    scene: &Scene,
    exposure: &Exposure,
    left_out: EffectSet,
    read: &[PathBuf],
) -> Result<()> {
    let (path, format) = &files.picture;
    let mut notes = notes::notes(scene, exposure, left_out);
    let (_again, ()) = output::in_made(files.folder(), || {
        output::write_whole(path, read, |file| match format {
            Format::Png => exposure.write_png(scene.render.exposure_ev, &notes, file),
            Format::Exr => exposure.write_exr(&notes, file),
        })
    })?;
    let (Some((target, format)), Some(error)) = (files.error_map, exposure.rms_error()) else {
        return Ok(());
    };
    let map = exposure.error_map();
    // Mid-grey where the error is that of the whole.
    let gain = -libm::log2(error.max(1e-9) / 0.2);
    let times = match format {
        Format::Png => format!(", times {:.6}, as sRGB", libm::exp2(gain)),
        Format::Exr => String::new(),
    };
    notes
        .push(("groundglass.error_map", format!("RMS error of each pixel, linear light from 0 to 1{times}")));
    output::write_whole(target, read, |file| match format {
        Format::Png => map.write_png(gain, &notes, file),
        Format::Exr => map.write_exr(&notes, file),
    })
}

/// For the built-in scene: its diagram beside the picture, and what to try next: among it a picture of four times the `samples`, if
/// there may be so many, as wide as was asked for.
fn first_steps(scene: &Scene, diagrams: &[PathBuf], samples: f64, width: &str) -> Result<()> {
    let figure = diagram::figure(scene, diagram::Section::Side, diagram::Inset::Auto)?;
    let mut made = Vec::new();
    for path in diagrams {
        figure_file::write(&figure, path, &[])?;
        made.push(path.display().to_string());
    }
    let samples = (4.0 * samples).ceil();
    let more = format!("groundglass render --samples {samples}{width}");
    let more = match samples <= f64::from(MOST_SAMPLES) {
        true => format!("  {more:<50}half the error or less\n"),
        false => String::new(),
    };
    report::print(&format!(
        "{}: its camera in section\n\n\
         The front standard was solved so that the tower's whole front wall is sharp. Next, try\n  \
         groundglass optics examples/tower.toml            what is sharp, and where lines and planes pass\n\
         {more}  groundglass new MODEL.obj -o scene.toml           a first scene for a model of yours\n",
        made.join(", "),
    ))
}
