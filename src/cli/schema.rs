//! `groundglass schema`: the JSON schema of the scene file, or of figure files, on standard output.

use super::report;
use groundglass::error::Result;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The schema of figure files instead
    #[arg(long)]
    pub(super) figures: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let schema =
        if arguments.figures { groundglass::diagram::schema() } else { groundglass::scene::schema() };
    report::print(&schema)
}
