//! `groundglass diagram FIGURE.toml|SCENE.toml`: a figure, or a scene's camera in section, as SVG, PNG or PDF; also
//! the list of kinds, and a first figure file of a kind. The book of
//! figures is [`super::book`]'s.

use super::book::{self, Reading};
use super::figure_file::{self, Drawn, Writing, draw_figure, write_as};
use super::input::{self, MemoryArguments, Opened, RootArguments};
use super::{optics_words, output, report, values};
use clap::ValueEnum;
use groundglass::diagram::{self, Changes, Figure, FigureFile, KINDS, Kind, TextAs, Theme};
use groundglass::error::{Error, ErrorKind, Result, Warning};
use groundglass::scene::Scene;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Figure files, or one scene file (TOML); a figure without -o is drawn beside its file, as SVG. With --check or --gallery
    /// and none given: all figures in the folder `diagrams`, or in this one where there is none of that name
    #[arg(value_name = "FILE", required_unless_present_any = ["list", "new", "check", "gallery"])]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) root: RootArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    /// The drawing: .svg, .png or .pdf; may be given several times
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = values::output())]
    pub(super) output: Vec<PathBuf>,
    /// The plane of the section
    #[arg(long, value_name = "SECTION")]
    pub(super) section: Option<Section>,
    /// A panel beside, to its own scale, that shows the camera itself
    #[arg(long, value_name = "WHEN")]
    pub(super) inset: Option<Inset>,
    /// The colours: print, screen, dark, text, contrast or grey
    #[arg(long, value_name = "THEME", value_parser = Theme::named)]
    pub(super) theme: Option<Theme>,
    /// Width of the page in millimetres; letters and lines keep their size
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub(super) width_mm: Option<f64>,
    /// Pixels for each millimetre of the page in a PNG
    #[arg(long, value_name = "PX", default_value = "8", value_parser = pixels)]
    pub(super) png_scale: f64,
    /// Lettering: paths, or text that can be searched; by default paths in SVG, text in PDF
    #[arg(long, value_name = "AS")]
    pub(super) text: Option<Lettering>,
    /// Say which SVGs beside the figure files are not what would be drawn now (exit code 1); draw nothing
    #[arg(long, conflicts_with_all = ["output", "list", "new"])]
    pub(super) check: bool,
    /// Write a page that shows the figures with their sources, for the files given: FILE.md
    #[arg(long, value_name = "FILE.md", conflicts_with_all = ["output", "list", "new", "check"])]
    pub(super) gallery: Option<PathBuf>,
    /// List the kinds of figures
    #[arg(long, conflicts_with_all = ["files", "output", "new"])]
    pub(super) list: bool,
    /// Write a commented figure file of this kind: KIND.toml, or the file given with -o
    #[arg(long, value_name = "KIND", conflicts_with = "files")]
    pub(super) new: Option<String>,
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

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Lettering {
    Paths,
    Text,
}

impl From<Section> for diagram::Section {
    fn from(section: Section) -> Self {
        match section {
            Section::Side => Self::Side,
            Section::Top => Self::Top,
            Section::Auto => Self::Auto,
        }
    }
}

impl From<Inset> for diagram::Inset {
    fn from(inset: Inset) -> Self {
        match inset {
            Inset::Auto => Self::Auto,
            Inset::Always => Self::Always,
            Inset::Never => Self::Never,
        }
    }
}

fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number from {least} to {most}")),
    }
}

fn millimetres(text: &str) -> Result<f64, String> {
    within(text, 1.0, 2000.0)
}

fn pixels(text: &str) -> Result<f64, String> {
    within(text, 0.01, 1000.0)
}

pub(super) fn run(arguments: &Arguments) -> Result<bool> {
    if arguments.list {
        return list().map(|()| true);
    }
    if let Some(kind) = &arguments.new {
        return starter(kind, &arguments.output).map(|()| true);
    }
    for path in &arguments.output {
        figure_file::format(path)?;
    }
    if arguments.check {
        return book::check(&arguments.files, arguments.reading(), changes(arguments));
    }
    if let Some(page) = &arguments.gallery {
        return book::gallery(page, &arguments.files, arguments.reading()).map(|()| true);
    }
    if arguments.files.len() > 1 && !arguments.output.is_empty() {
        return Err(Error::new(ErrorKind::Usage, "-o names the drawing of one file, and several are given")
            .remedy("draw them one by one, or leave out -o: each is drawn beside its file"));
    }
    for file in &arguments.files {
        draw(file, arguments)?;
    }
    Ok(true)
}

fn list() -> Result<()> {
    let widest = KINDS.iter().map(|kind| kind.name.len()).max().unwrap_or(0);
    let lines: Vec<String> = KINDS.iter().map(|k| format!("{:widest$}  {}\n", k.name, k.line)).collect();
    report::print(&lines.concat())
}

fn starter(kind: &str, outputs: &[PathBuf]) -> Result<()> {
    let kind = Kind::named(kind).map_err(|error| {
        Error::new(ErrorKind::Usage, error.message()).remedy(error.remedy_text().unwrap_or_default())
    })?;
    let target = match outputs {
        [] => PathBuf::from(kind.name).with_extension("toml"),
        [one] => one.clone(),
        _ => return Err(Error::new(ErrorKind::Usage, "--new writes one file").remedy("give one -o")),
    };
    if target.extension().is_none_or(|ending| ending != "toml") {
        return Err(Error::new(ErrorKind::Usage, "a figure file's name ends in .toml")
            .in_file(target.display().to_string())
            .remedy(format!("for example -o {}.toml", kind.name)));
    }
    if target.exists() {
        return Err(Error::invalid("there is a file of this name already")
            .in_file(target.display().to_string())
            .remedy("give another name with -o"));
    }
    output::write_text(&target, &[], kind.starter)?;
    match kind.needs {
        [] => Ok(()),
        keys => report::print(&format!(
            "{}: name files of your own in `{}`, then draw it\n",
            target.display(),
            keys.join("` and `")
        )),
    }
}

impl Arguments {
    fn reading(&self) -> Reading<'_> {
        Reading { root: self.root.root.as_deref(), memory: self.memory }
    }
}

fn changes(arguments: &Arguments) -> Changes {
    Changes {
        theme: arguments.theme,
        width_mm: arguments.width_mm,
        section: arguments.section.map(Into::into),
        inset: arguments.inset.map(Into::into),
    }
}

/// Draws one file, a figure or a scene.
fn draw(file: &Path, arguments: &Arguments) -> Result<()> {
    let writing = Writing {
        png_scale: arguments.png_scale,
        text: arguments.text.map(|text| match text {
            Lettering::Paths => TextAs::Paths,
            Lettering::Text => TextAs::Text,
        }),
    };
    let mut opened = input::open(file, arguments.root.root.as_deref())?;
    opened.source.limit(arguments.memory);
    let is_figure = FigureFile::is_figure(&opened.document)?;
    let mut outputs = arguments.output.clone();
    if outputs.is_empty() {
        if !is_figure {
            return Err(Error::new(ErrorKind::Usage, "a scene's diagram needs a name")
                .in_file(opened.document.name())
                .remedy("give one with -o, such as -o diagram.svg"));
        }
        outputs.push(file.with_extension("svg"));
    }
    for path in &outputs {
        output::check(path, &opened.source.paths())?;
    }
    let drawn =
        if is_figure { draw_figure(&opened, changes(arguments)) } else { camera_of(opened, arguments) };
    let (figure, read) = drawn.map_err(|error| match error.place().key.as_deref() {
        // The width that the user gave stands in no file.
        Some("width_mm") if arguments.width_mm.is_some() => {
            Error::new(ErrorKind::Usage, format!("--width-mm: {}", error.message()))
                .remedy(error.remedy_text().unwrap_or("give another width"))
        }
        _ => error,
    })?;
    for path in &outputs {
        write_as(&figure, path, &read, writing)?;
    }
    Ok(())
}

/// The side view of a scene's camera, and the files read.
fn camera_of(opened: Opened, arguments: &Arguments) -> Result<Drawn> {
    let input = opened.scene()?;
    // What cannot exist is refused before anything large is loaded.
    input.scene.optics()?;
    let scene = input.load()?;
    report::warnings(&scene.warnings);
    report::warnings(&optics_words::warnings(&scene.optics, &input.name()));
    let figure = changed(&scene, changes(arguments)).map_err(|error| error.in_file(input.name()))?;
    let warn = |message| Warning { file: input.name(), line: None, message };
    report::warnings(&figure.not_shown().into_iter().map(warn).collect::<Vec<_>>());
    Ok((figure, input.read_paths()))
}

/// The side view of a scene's camera, with its meshes as subject.
pub(super) fn figure(scene: &Scene, section: Section, inset: Inset) -> Result<Figure> {
    changed(scene, Changes { section: Some(section.into()), inset: Some(inset.into()), ..Changes::default() })
}

/// As [`figure`], with what the command line changes.
fn changed(scene: &Scene, changes: Changes) -> Result<Figure> {
    let surfaces = &scene.surfaces;
    let triangles: Vec<_> = (0..surfaces.triangles.len()).map(|t| surfaces.corners(t)).collect();
    let width = changes.width_mm.unwrap_or(160.0);
    Figure::side_view(&scene.optics)
        .circle_of_confusion(scene.circle_of_confusion.as_metres())
        .subject(&triangles)
        .up(scene.up)
        .section(changes.section.unwrap_or_default())
        .inset(changes.inset.unwrap_or_default())
        .theme(changes.theme.unwrap_or(Theme::PRINT))
        .page_width(width)
        .figure()
}
