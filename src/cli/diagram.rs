//! `groundglass diagram SCENE`: the camera, its planes and lines in section, as SVG or PNG.

use super::input::{self, SceneArguments};
use super::{optics_words, output, report};
use clap::ValueEnum;
use groundglass::diagram::{self, Figure};
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::scene::Scene;
use std::io::Write;
use std::path::{Path, PathBuf};

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
    /// A panel beside, to its own scale, that shows the camera itself
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub(super) inset: Inset,
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

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Inset {
    /// Where the camera is too small to be read
    Auto,
    Always,
    Never,
}

/// Pixels for each millimetre of the page in a PNG: 203 dots an inch, a page of 160 mm 1280 pixels wide.
const PIXELS_PER_MM: f64 = 8.0;

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    for path in &arguments.output {
        format(path)?;
    }
    let input = input::read(&arguments.scene)?;
    for path in &arguments.output {
        output::check(path, &input.read_paths())?;
    }
    // What cannot exist is refused before anything large is loaded.
    input.scene.optics()?;
    let scene = input.load()?;
    report::warnings(&scene.warnings);
    report::warnings(&optics_words::warnings(&scene.optics, &input.name()));
    let figure = figure(&scene, arguments.section, arguments.inset)?;
    for path in &arguments.output {
        write(&figure, path, &input.read_paths())?;
    }
    Ok(())
}

#[derive(Clone, Copy)]
enum Format {
    Svg,
    Png,
}

fn format(path: &Path) -> Result<Format> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("svg") => Ok(Format::Svg),
        Some("png") => Ok(Format::Png),
        _ => Err(Error::new(ErrorKind::Usage, "a drawing's name ends in .svg or .png")
            .in_file(path.display().to_string())
            .remedy("give such a name with -o")),
    }
}

/// The side view of a scene's camera, with its meshes as subject.
pub(super) fn figure(scene: &Scene, section: Section, inset: Inset) -> Result<Figure> {
    let surfaces = &scene.surfaces;
    let triangles: Vec<_> = (0..surfaces.triangles.len()).map(|t| surfaces.corners(t)).collect();
    Figure::side_view(&scene.optics)
        .circle_of_confusion(scene.circle_of_confusion.as_metres())
        .subject(&triangles)
        .section(match section {
            Section::Side => diagram::Section::Side,
            Section::Top => diagram::Section::Top,
            Section::Auto => diagram::Section::Auto,
        })
        .inset(match inset {
            Inset::Auto => diagram::Inset::Auto,
            Inset::Always => diagram::Inset::Always,
            Inset::Never => diagram::Inset::Never,
        })
        .figure()
}

/// Writes a figure in the format that the file's name asks for.
pub(super) fn write(figure: &Figure, path: &Path, read: &[PathBuf]) -> Result<()> {
    match format(path)? {
        Format::Svg => output::write_text(path, read, &figure.to_svg()?),
        Format::Png => {
            let bytes = figure.to_png(PIXELS_PER_MM)?;
            output::write_whole(path, read, |file| {
                file.write_all(&bytes).map_err(|error| output::broken(path, &error))
            })
        }
    }
}
