//! `groundglass diagram SCENE`: the camera, its planes and lines in section, as SVG or PNG.

use super::input::{self, SceneArguments};
use clap::ValueEnum;
use groundglass::error::{Error, ErrorKind, Result};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// The drawing: .svg or .png; may be given several times
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(super) output: Vec<PathBuf>,
    /// The plane of the section
    #[arg(long, value_name = "SECTION", default_value = "auto")]
    pub(super) section: Section,
    /// Add a panel that shows the camera itself
    #[arg(long)]
    pub(super) inset: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Section {
    /// Upright, along the rail
    Side,
    /// From above
    Top,
    /// The one that shows the movements
    Auto,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    for path in &arguments.output {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        if !matches!(ending.as_deref(), Some("svg" | "png")) {
            return Err(Error::new(ErrorKind::Usage, "a drawing's name ends in .svg or .png")
                .in_file(path.display().to_string())
                .remedy("give such a name with -o"));
        }
    }
    let _input = input::read(&arguments.scene)?;
    // TODO body: solve, Optics, figure, paint.
    Err(super::not_built("diagram"))
}
