//! `groundglass stability -o DIR`: maps of the errors of the optics, beside textbook formulas and single precision. Each is
//! a table, the figure file that shows it, and the drawing.

use super::{output, values};
use groundglass::error::{Error, Result};
use groundglass::stability::maps;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The folder to write to; it is made when it is not there
    #[arg(short, long, value_name = "DIR", allow_hyphen_values = true, value_parser = values::output())]
    pub(super) output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let folder = &arguments.output;
    let _made = output::Folder::given(folder)?;
    let maps = maps();
    for map in &maps {
        check_free(&folder.join(map.name))?;
    }
    for map in maps {
        let svg = map.draw()?.to_svg()?;
        for (ending, text) in [("csv", &map.csv), ("toml", &map.figure), ("svg", &svg)] {
            output::write_text(&folder.join(map.name).with_extension(ending), &[], text)?;
        }
    }
    Ok(())
}

/// Refuses to replace what another has made: tables and figure files say who made them, and drawings have a map's cells.
fn check_free(map: &Path) -> Result<()> {
    for (ending, sign) in [
        ("csv", "Made by `groundglass stability`"),
        ("toml", "Made by `groundglass stability`"),
        ("svg", "data-part=\"cells\""),
    ] {
        let path = map.with_extension(ending);
        // No regular file, as a pipe, is not read.
        output::check(&path, &[])?;
        let made_here = |text: Vec<u8>| String::from_utf8_lossy(&text).contains(sign);
        if path.exists() && !std::fs::read(&path).is_ok_and(made_here) {
            return Err(Error::invalid(
                "there is a file of this name already, and it is none that `stability` made",
            )
            .in_file(path.display().to_string())
            .remedy("move it, or give another folder"));
        }
    }
    Ok(())
}
