//! Figures from files and into files: a figure file in, a drawing out in the format that its name asks for, for
//! `diagram`, `book`, `render` and `cost`.

use super::input::Opened;
use super::{output, report};
use groundglass::diagram::{Changes, Figure, FigureFile, TextAs};
use groundglass::error::{Error, ErrorKind, Result};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Pixels for each millimetre of the page in a PNG: 203 dots an inch, a page of 160 mm 1280 pixels wide.
const PIXELS_PER_MM: f64 = 8.0;

/// How files are written.
#[derive(Clone, Copy)]
pub(super) struct Writing {
    pub(super) png_scale: f64,
    pub(super) text: Option<TextAs>,
}

/// A figure, and the files read.
pub(super) type Drawn = (Figure, Vec<PathBuf>);

/// A figure file's figure, and the files read.
pub(super) fn draw_figure(opened: &Opened, changes: Changes) -> Result<Drawn> {
    let file = FigureFile::from_document(opened.document.clone())?;
    let figure = file.draw(&opened.source, opened.folder(), changes)?;
    report::warnings(figure.warnings());
    Ok((figure, opened.source.paths()))
}

#[derive(Clone, Copy)]
pub(super) enum Format {
    Svg,
    Png,
    Pdf,
}

pub(super) fn format(path: &Path) -> Result<Format> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("svg") => Ok(Format::Svg),
        Some("png") => Ok(Format::Png),
        Some("pdf") => Ok(Format::Pdf),
        _ => Err(Error::new(ErrorKind::Usage, "a drawing's name ends in .svg, .png or .pdf")
            .in_file(path.display().to_string())
            .remedy("give such a name with -o")),
    }
}

/// Writes a figure in the format that the file's name asks for.
pub(super) fn write(figure: &Figure, path: &Path, read: &[PathBuf]) -> Result<()> {
    write_as(figure, path, read, Writing { png_scale: PIXELS_PER_MM, text: None })
}

pub(super) fn write_as(figure: &Figure, path: &Path, read: &[PathBuf], writing: Writing) -> Result<()> {
    let bytes = match format(path)? {
        Format::Svg => figure.to_svg_with(writing.text.unwrap_or(TextAs::Paths))?.into_bytes(),
        Format::Pdf => figure.to_pdf_with(writing.text.unwrap_or(TextAs::Text))?,
        Format::Png => figure.to_png(writing.png_scale)?,
    };
    output::write_whole(path, read, |file| {
        file.write_all(&bytes).map_err(|error| output::broken(path, &error))
    })
}
