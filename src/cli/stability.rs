//! `groundglass stability -o DIR`: maps of the errors of the optics, beside textbook formulas and single precision. Each is
//! a table, the figure file that shows it, and the drawing.

use super::output;
use groundglass::error::Result;
use groundglass::stability::maps;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The folder to write to; it is made when it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let folder = &arguments.output;
    let _made = output::Folder::given(folder)?;
    for map in maps() {
        let svg = map.draw()?.to_svg()?;
        for (ending, text) in [("csv", &map.csv), ("toml", &map.figure), ("svg", &svg)] {
            output::write_text(&folder.join(map.name).with_extension(ending), &[], text)?;
        }
    }
    Ok(())
}
