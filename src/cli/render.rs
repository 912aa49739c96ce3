//! `groundglass render [SCENE]`: a picture.

use super::effects::EffectArguments;
use super::input::{self, Input, MemoryArguments, RootArguments};
use super::progress::Progress;
use super::replay::Replay;
use super::stats::{Asked, Samples, Stats};
use super::values::{self, Pixels, Positive, Seconds, Simd};
use super::{diagram, figure_file, interrupt, machine, notes, optics_words, output, render_words, report};
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::plan::RenderPlan;
use groundglass::render::{Execution, SimdLevel, render, replay};
use groundglass::sampling::runs::MOST_SAMPLES;
use groundglass::scene::{Budget, Scene};
use std::path::{Path, PathBuf};
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

/// What the picture is to be written as, by the name's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Exr,
}

impl Arguments {
    /// The output's path and format.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for another ending than .png and .exr.
    pub(super) fn output(&self) -> Result<(PathBuf, Format)> {
        let path = self.output.clone().unwrap_or_else(|| {
            let stem = self.scene.as_deref().and_then(|scene| scene.file_stem());
            let mut name = stem.unwrap_or(std::ffi::OsStr::new("tower")).to_os_string();
            name.push(".png");
            PathBuf::from("groundglass-out").join(name)
        });
        let format = Format::of(&path, "-o")?;
        Ok((path, format))
    }

    /// What replaces the scene's budget.
    fn budget(&self) -> Option<Budget> {
        let samples = self.samples.map(Budget::Samples);
        let error = self.max_error.map(|error| Budget::MaxError(error.0));
        let time = self.time_budget.map(|time| Budget::Seconds(time.0));
        samples.or(error).or(time)
    }
}

impl Format {
    fn of(path: &Path, flag: &str) -> Result<Self> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(Error::new(ErrorKind::Usage, "a picture's name ends in .png or .exr")
                .in_file(path.display().to_string())
                .remedy(format!("give such a name with {flag}"))),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let (path, format) = arguments.output()?;
    let error_map = arguments.error_map.as_ref();
    let stats = arguments.stats.as_ref();
    let diagrams = if arguments.scene.is_none() { diagrams(&path).to_vec() } else { Vec::new() };
    let outputs: Vec<(&PathBuf, &str)> =
        [(Some(&path), "-o"), (stats, "--stats"), (error_map, "--error-map")]
            .into_iter()
            .filter_map(|(output, flag)| output.map(|output| (output, flag)))
            .chain(diagrams.iter().map(|diagram| (diagram, "the diagram beside the picture")))
            .collect();
    for (i, (first, flag)) in outputs.iter().enumerate() {
        for (second, other) in &outputs[..i] {
            if output::is_same(first, second) {
                return Err(Error::new(ErrorKind::Usage, format!("{other} and {flag} name one file"))
                    .remedy("give two names"));
            }
        }
    }
    let map_format = error_map.map(|path| Format::of(path, "--error-map")).transpose()?;
    let replayed = arguments
        .replay
        .as_deref()
        .map(|stats| Replay::read(stats, arguments.root.root.as_deref()))
        .transpose()?;
    let threads = machine::threads(arguments.threads);
    let input = match &arguments.scene {
        Some(scene) => input::read_scene(scene, arguments.root.root.as_deref())?,
        None => Input::builtin()?,
    }
    .within(arguments.memory, threads);
    // What cannot be written is said before the work, and again when the files that are read are known.
    // (The folder that is made for a picture without a name may not be there yet.)
    let made =
        if arguments.output.is_none() { path.parent().filter(|folder| !folder.exists()) } else { None };
    for (output, _) in outputs.iter().filter(|(output, _)| made.is_none() || output.parent() != made) {
        output::check(output, &input.read_paths())?;
    }
    let clock = Instant::now();
    let width = replayed.as_ref().map(|replay| replay.width).or(arguments.width.map(|width| width.0));
    let mut scene = input.load_at(width)?;
    scene.render.budget = arguments.budget().unwrap_or(scene.render.budget);
    let mut effects = arguments.effects.clone();
    if let Some(replay) = &replayed {
        effects = replay.ask(&mut scene, &effects)?;
    }
    effects.apply(&mut scene).map_err(|error| match &replayed {
        Some(replay) => replay.blame(&error),
        None => error,
    })?;
    if error_map.is_some() && matches!(scene.render.budget, Budget::Samples(1)) && replayed.is_none() {
        return Err(Error::new(ErrorKind::Usage, "--error-map: of one sample a pixel no error is known")
            .remedy("take 2 samples or more"));
    }
    let asked = replayed.as_ref().map_or_else(|| Asked::new(scene.render.budget, &effects), Replay::asked);
    let load_seconds = clock.elapsed().as_secs_f64();
    report::warnings(&scene.warnings);
    report::warnings(&optics_words::scene_warnings(&scene, &input.name()));
    report::warnings(replayed.as_ref().and_then(Replay::warning).as_slice());
    let allocation = replayed.map(|replay| replay.allocation(&scene)).transpose()?;
    let mut read = input.read_paths();
    read.extend(arguments.replay.clone());
    // Held to the end: a picture that is not made leaves no folder.
    let default_folder = path.parent().filter(|_| arguments.output.is_none());
    let (_folder, ()) = output::in_made(default_folder, || {
        outputs.iter().try_for_each(|(output, _)| output::check(output, &read))
    })?;

    let effects = match arguments.stats {
        Some(_) => machine::on_threads(Some(threads), || RenderPlan::new(&scene).effects().to_vec())?,
        None => Vec::new(),
    };
    let progress = Progress::new();
    let tell = |done: usize, total: usize| progress.tell("rendering", done as u64, total as u64);
    let (clock, cpu) = (Instant::now(), machine::cpu_seconds());
    let simd = arguments.simd.map_or_else(SimdLevel::best, |simd| simd.0);
    let seconds = || clock.elapsed().as_secs_f64();
    let memory = input.room();
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
            memory,
            simd: Some(simd),
            cancel: Some(cancel),
            progress: Some(&tell),
            beyond_reach: Some(&beyond_reach),
            clock: timed.then_some(&seconds),
            error_map: error_map.is_some(),
        };
        match &allocation {
            Some(allocation) => replay(&scene, allocation, execution),
            None => render(&scene, execution),
        }
    });
    let (render_seconds, cpu_seconds) = (clock.elapsed().as_secs_f64(), machine::cpu_seconds() - cpu);
    progress.finish();
    let (exposure, counts) = rendered.map_err(|error| {
        // Numbers of samples are those of the file that is replayed.
        let replayed =
            arguments.replay.as_ref().filter(|_| error.place().key.as_deref() == Some("allocation"));
        error.in_file(replayed.map_or_else(|| input.name(), |path| path.display().to_string()))
    })?;

    let notes = notes::notes(&scene, &exposure, counts.left_out);
    let (_again, ()) = output::in_made(default_folder, || {
        output::write_whole(&path, &read, |file| match format {
            Format::Png => exposure.write_png(scene.render.exposure_ev, &notes, file),
            Format::Exr => exposure.write_exr(&notes, file),
        })
    })?;
    if let (Some(target), None) = (error_map, exposure.rms_error()) {
        report::warnings(&[render_words::no_error_map(&input.name(), target)]);
    } else if let (Some(target), Some(format)) = (error_map, map_format) {
        let map = exposure.error_map();
        // Mid-grey where the error is that of the whole.
        let gain = -libm::log2(exposure.rms_error().unwrap_or(1.0).max(1e-9) / 0.2);
        let times = match format {
            Format::Png => format!(", times {:.6}, as sRGB", libm::exp2(gain)),
            Format::Exr => String::new(),
        };
        let mut notes = notes;
        notes.push((
            "groundglass.error_map",
            format!("RMS error of each pixel, linear light from 0 to 1{times}"),
        ));
        output::write_whole(target, &read, |file| match format {
            Format::Png => map.write_png(gain, &notes, file),
            Format::Exr => map.write_exr(&notes, file),
        })?;
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
    if let Some(target) = &arguments.stats {
        let mut text = serde_json::to_string_pretty(&stats).unwrap_or_default();
        text.push('\n');
        output::write_text(target, &read, &text)?;
    }
    report::print(&render_words::summary(&path, &stats))?;
    if counts.unseen_light > 0 {
        report::warnings(&[render_words::unseen_light(&input.name(), counts.unseen_light)]);
    }
    if let (Budget::MaxError(wanted), Some(reached), None) =
        (scene.render.budget, exposure.rms_error(), &allocation)
        && reached > wanted
    {
        report::warnings(&[render_words::beyond_reach(&input.name(), wanted, reached)]);
    }
    if let (Budget::Seconds(wanted), None) = (scene.render.budget, &allocation) {
        let (took, leeway) = (stats.render_seconds, (0.05 * wanted).max(0.05));
        if took > wanted + leeway {
            report::warnings(&[render_words::too_late(&input.name(), wanted, &stats)]);
        } else if took < wanted - leeway && exposure.samples().range().0 == MOST_SAMPLES {
            report::warnings(&[render_words::no_more(&input.name(), wanted, &stats)]);
        }
    }
    if arguments.scene.is_none() {
        let width = width.map(|width| format!(" --width {width}"));
        first_steps(&scene, &diagrams, exposure.samples().mean(), &width.unwrap_or_default())?;
    }
    Ok(())
}

/// What the built-in scene's diagram is written as: beside the picture, and named after it.
fn diagrams(picture: &Path) -> [PathBuf; 2] {
    let stem = picture.file_stem().unwrap_or_default().to_string_lossy();
    ["svg", "png"].map(|ending| picture.with_file_name(format!("{stem}-diagram.{ending}")))
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
