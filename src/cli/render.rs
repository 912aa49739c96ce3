//! `groundglass render [SCENE]`: a picture.

use super::input::{self, Input, RootArguments};
use super::progress::Progress;
use super::stats::{self, Samples, Stats};
use super::values::{Pixels, Positive, Seconds, Simd};
use super::{diagram, interrupt, optics_words, output, report};
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::plan::effects;
use groundglass::render::{Execution, SimdLevel, render};
use groundglass::scene::Scene;
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
    /// The picture: .png (8-bit sRGB) or .exr (linear float); groundglass-out/STEM.png by default
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Exactly this many samples for each pixel
    #[arg(long, value_name = "N", group = "budget", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub(super) samples: Option<u32>,
    /// Stop at this error: root mean square over the picture, linear light
    #[arg(long, value_name = "E", group = "budget")]
    pub(super) max_error: Option<Positive>,
    /// Stop after this time, such as 2s
    #[arg(long, value_name = "TIME", group = "budget")]
    pub(super) time_budget: Option<Seconds>,
    /// Width of the picture in pixels; the height follows
    #[arg(long, value_name = "PX")]
    pub(super) width: Option<Pixels>,
    /// Number of threads; all cores by default. The picture does not depend on it
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Vector instructions to use, to compare; the widest by default. The picture does not depend on it
    #[arg(long, value_name = "LEVEL")]
    pub(super) simd: Option<Simd>,
    /// Write numbers about the run (JSON)
    #[arg(long, value_name = "FILE")]
    pub(super) stats: Option<PathBuf>,
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
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("png") => Ok((path, Format::Png)),
            Some("exr") => Ok((path, Format::Exr)),
            _ => Err(Error::new(ErrorKind::Usage, "a picture's name ends in .png or .exr")
                .in_file(path.display().to_string())
                .remedy("give such a name with -o")),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let (path, format) = arguments.output()?;
    if arguments.stats.as_ref().is_some_and(|stats| output::is_same(stats, &path)) {
        return Err(Error::new(ErrorKind::Usage, "-o and --stats name one file").remedy("give two names"));
    }
    for (given, name) in
        [(arguments.max_error.is_some(), "--max-error"), (arguments.time_budget.is_some(), "--time-budget")]
    {
        if given {
            return Err(Error::invalid(format!("{name} is not built yet")).remedy("use --samples N"));
        }
    }
    let input = match &arguments.scene {
        Some(scene) => input::read_scene(scene, arguments.root.root.as_deref())?,
        None => Input::builtin()?,
    };
    input.scene.refuse_unbuilt_effects(arguments.samples.is_some())?;
    // What cannot be written is said before the work, and again when the files that are read are known.
    let named = [arguments.output.as_ref(), arguments.stats.as_ref()];
    for output in named.into_iter().flatten() {
        output::check(output, &input.read_paths())?;
    }
    let (clock, scene) = (Instant::now(), load(&input, arguments)?);
    let load_seconds = clock.elapsed().as_secs_f64();
    report::warnings(&scene.warnings);
    report::warnings(&optics_words::warnings(&scene.optics, &input.name()));
    report::warnings(&optics_words::scene_warnings(&scene, &input.name()));
    if let Some(available) = stats::available_memory() {
        scene.check_memory(available)?;
    }
    let read = input.read_paths();
    if arguments.output.is_none() {
        make_folder(path.parent())?;
    }
    for output in [Some(&path), arguments.stats.as_ref()].into_iter().flatten() {
        output::check(output, &read)?;
    }

    let progress = Progress::new();
    let tell = |done: usize, total: usize| progress.tell("rendering", done as u64, total as u64);
    let threads = arguments.threads.map(usize::from);
    let (clock, cpu) = (Instant::now(), stats::cpu_seconds());
    let simd = arguments.simd.map_or_else(SimdLevel::best, |simd| simd.0);
    let seconds = || clock.elapsed().as_secs_f64();
    let rendered = interrupt::polled(|cancel| {
        let measured = arguments.stats.is_some().then_some(&seconds as &(dyn Fn() -> f64 + Sync));
        let (cancel, progress) = (Some(cancel), Some(&tell as &(dyn Fn(usize, usize) + Sync)));
        render(&scene, Execution { threads, simd: Some(simd), cancel, progress, clock: measured })
    });
    let (render_seconds, cpu_seconds) = (clock.elapsed().as_secs_f64(), stats::cpu_seconds() - cpu);
    progress.finish();
    let (exposure, counts) = rendered.map_err(|error| error.in_file(input.name()))?;

    let notes = stats::notes(&scene, &exposure);
    output::write_whole(&path, &read, |file| match format {
        Format::Png => exposure.write_png(scene.render.exposure_ev, &notes, file),
        Format::Exr => exposure.write_exr(&notes, file),
    })
    .map_err(|error| error.in_file(path.display().to_string()))?;
    let stats = Stats {
        width: exposure.width(),
        height: exposure.height(),
        threads: threads.unwrap_or_else(available_threads),
        load_seconds,
        render_seconds,
        cpu_seconds,
        samples_per_pixel: Samples::uniform(scene.render.samples),
        estimated_rms_error: exposure.rms_error(),
        effects: effects(&scene),
        simd: simd.name(),
        triangles: counts.triangles,
        surfaces: counts.surfaces,
        bin_entries: counts.bin_entries,
        samples: counts.samples,
        shading_requests: counts.shading_requests,
        stages: counts.stages,
        scene_hash: scene.hash(),
        version: env!("CARGO_PKG_VERSION"),
    };
    if let Some(target) = &arguments.stats {
        let mut text = serde_json::to_string_pretty(&stats).unwrap_or_default();
        text.push('\n');
        output::write_text(target, &read, &text)?;
    }
    report::print(&summary(&path, &stats))?;
    if arguments.scene.is_none() {
        first_steps(&scene, &path)?;
    }
    Ok(())
}

/// Loads the scene, with what the flags replace.
fn load(input: &Input, arguments: &Arguments) -> Result<Scene> {
    let mut scene = input.load_at(arguments.width.map(|width| width.0))?;
    if let Some(samples) = arguments.samples {
        scene.render.samples = samples;
    }
    Ok(scene)
}

fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn make_folder(folder: Option<&Path>) -> Result<()> {
    let Some(folder) = folder else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|error| output::broken(folder, &error))
}

/// One line: what was made, how long it took, its error.
fn summary(path: &Path, stats: &Stats) -> String {
    let error = match stats.estimated_rms_error {
        Some(error) => format!("RMS error about {error:.4}"),
        None => "one sample a pixel: its error is unknown".to_owned(),
    };
    format!(
        "{}: {} x {} pixels, {} samples each, {:.2} s ({:.2} s loading); {error}\n",
        path.display(),
        stats.width,
        stats.height,
        stats.samples_per_pixel.max,
        stats.render_seconds,
        stats.load_seconds,
    )
}

/// For the built-in scene: its diagram beside the picture, and what to try next.
fn first_steps(scene: &Scene, picture: &Path) -> Result<()> {
    let figure = diagram::figure(scene, diagram::Section::Side, diagram::Inset::Auto)?;
    let mut made = Vec::new();
    for ending in ["svg", "png"] {
        let path = picture.with_file_name("tower-diagram").with_extension(ending);
        diagram::write(&figure, &path, &[])?;
        made.push(path.display().to_string());
    }
    report::print(&format!(
        "{}: its camera in section\n\n\
         The front standard was solved so that the tower's whole front wall is sharp. Next, try\n  \
         groundglass optics examples/tower.toml            what is sharp, and where lines and planes pass\n  \
         groundglass render --samples 256                  half the error\n  \
         groundglass new MODEL.obj -o scene.toml           a first scene for a model of yours\n",
        made.join(", "),
    ))
}
