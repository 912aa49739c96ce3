//! `groundglass check SCENE`: loads a scene and its assets and says what is in them.

use super::input::{self, SceneArguments};
use groundglass::error::Result;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Print JSON instead of text
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let input = input::read(&arguments.scene)?;
    // TODO body: load `input.scene.meshes`, print the contract's JSON.
    let _ = input.scene.meshes;
    Err(super::not_built("check"))
}
