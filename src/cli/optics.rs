//! `groundglass optics SCENE`: planes, lines, depth of field and matrices of a camera.

use super::input::{self, SceneArguments};
use super::optics_json::optics_json;
use super::optics_words::{self, optics_words};
use super::report;
use super::values::LensPoints;
use groundglass::error::Result;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Print JSON (world frame, metres) instead of text
    #[arg(long)]
    pub(super) json: bool,
    /// Also give the matrices of these lens points, in fractions of the aperture radius: from world metres to clip coordinates
    #[arg(long, value_name = "U,V;...", allow_hyphen_values = true)]
    pub(super) samples_at: Option<LensPoints>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let input = input::read(&arguments.scene)?;
    let optics = input.scene.optics()?;
    let circle = input.scene.circle_of_confusion.as_metres();
    report::warnings(&optics_words::warnings(&optics, &input.name()));
    if arguments.json {
        let points = arguments.samples_at.as_ref().map(|points| points.0.as_slice());
        report::print_json(&optics_json(&optics, circle, points))
    } else {
        let points = arguments.samples_at.as_ref().map_or(&[][..], |points| &points.0);
        let words = optics_words(&optics, circle, input.scene.up);
        report::print(&(words + &optics_words::matrices(&optics, points)))
    }
}
