//! `groundglass optics SCENE`: planes, lines, depth of field and matrices of a camera.

use super::input::{self, SceneArguments};
use super::values::LensPoints;
use groundglass::error::Result;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Print JSON (world frame, metres) instead of text
    #[arg(long)]
    pub(super) json: bool,
    /// Also give the matrices of these lens points, in fractions of the aperture radius
    #[arg(long, value_name = "U,V;...", allow_hyphen_values = true)]
    pub(super) samples_at: Option<LensPoints>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let _input = input::read(&arguments.scene)?;
    // TODO body: solve, Optics, print.
    Err(super::not_built("optics"))
}
