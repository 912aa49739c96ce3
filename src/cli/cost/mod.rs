//! `groundglass cost SCENE`: what accuracy costs in time, measured on the scene itself.
//!
//! Against a converged picture of other samples, a ladder of budgets and ways is drawn and timed; a folder then holds charts, a
//! table, crops side by side and a page that says it in words. What was measured is kept, so a study that was stopped
//! goes on where it was.

mod answers;
mod approximation;
mod charts;
mod crops;
mod kept;
mod reference;
mod report;
mod rows;
mod study;
mod ways;
mod words;

use super::effects::EffectArguments;
use super::input::{self, MemoryArguments, SceneArguments};
use super::values::{self, Pixels};
use super::{interrupt, machine, optics_words, output, report as tell};
use groundglass::error::{Error, ErrorKind, Result};
use std::path::PathBuf;
use study::Study;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    /// The folder to write to; groundglass-out/STEM-cost by default
    #[arg(short, long, value_name = "DIR", allow_hyphen_values = true, value_parser = values::output())]
    pub(super) output: Option<PathBuf>,
    /// Small pictures and few of them: an answer in less than 20 seconds
    #[arg(long)]
    pub(super) quick: bool,
    /// Width of the pictures in pixels, 480 by default, 160 with --quick; the height follows
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    pub(super) width: Option<Pixels>,
    /// Number of threads; all cores by default
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = values::threads)]
    pub(super) threads: Option<u16>,
    #[command(flatten)]
    pub(super) effects: EffectArguments,
}

/// Widths of the pictures, where none is given.
const WIDTH: u32 = 480;
const QUICK_WIDTH: u32 = 160;

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let threads = machine::threads(arguments.threads);
    let input = input::read(&arguments.scene)?.within(arguments.memory, threads);
    let usual = if arguments.quick { QUICK_WIDTH } else { WIDTH };
    let mut scene = input.load_at(Some(arguments.width.map_or(usual, |width| width.0)))?;
    arguments.effects.apply(&mut scene)?;
    tell::warnings(&scene.warnings);
    tell::warnings(&optics_words::scene_warnings(&scene, &input.name()));
    let stem = arguments.scene.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = arguments
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from("groundglass-out").join(format!("{stem}-cost")));
    if folder.exists() && !folder.is_dir() {
        return Err(Error::new(ErrorKind::Io, "is a file, and a study writes a folder of files")
            .in_file(folder.display().to_string())
            .remedy("name a folder with -o"));
    }
    // Held to the end: a study that cannot begin leaves no folder.
    let _folder = match arguments.output {
        None => output::Folder::make(&folder)?,
        Some(_) => output::Folder::given(&folder)?,
    };
    let _held = kept::hold(&folder)?;
    let limits = (threads, input.room());
    let mut study = Study::open(&scene, &folder, limits, arguments.quick, input.read_paths())?;
    let study = interrupt::polled(|cancel| {
        study.measure(cancel)?;
        let written = report::write(&study, &stem, &folder, cancel);
        study.unless_stopped(cancel)?;
        written.map(|()| study)
    })
    .map_err(|error: Error| match error.kind() {
        ErrorKind::Cancelled => error,
        _ => error.in_file(input.name()),
    })?;
    tell::print(&format!("{}\n{}\n", words::sentence(&study), folder.join("cost.md").display()))
}
