//! `groundglass render [SCENE]`: a picture.

use super::input::{self, RootArguments};
use super::values::{Positive, Seconds};
use groundglass::error::{Error, ErrorKind, Result};
use std::path::PathBuf;

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
    #[arg(long, value_name = "N", group = "budget", value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    pub(super) samples: Option<u32>,
    /// Stop at this error: root mean square over the picture, linear light
    #[arg(long, value_name = "E", group = "budget")]
    pub(super) max_error: Option<Positive>,
    /// Stop after this time, such as 2s
    #[arg(long, value_name = "TIME", group = "budget")]
    pub(super) time_budget: Option<Seconds>,
    /// Width of the picture in pixels; the height follows
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(super) width: Option<u32>,
    /// Number of threads; all cores by default. The picture does not depend on it
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
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
            let mut name = stem.unwrap_or(std::ffi::OsStr::new("groundglass")).to_os_string();
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
    arguments.output()?;
    for (given, name) in
        [(arguments.max_error.is_some(), "--max-error"), (arguments.time_budget.is_some(), "--time-budget")]
    {
        if given {
            return Err(Error::invalid(format!("{name} is not built yet")).remedy("use --samples N"));
        }
    }
    if let Some(scene) = &arguments.scene {
        input::read_scene(scene, arguments.root.root.as_deref())?;
    }
    // TODO body: load, plan, render, write.
    Err(super::not_built("render"))
}
