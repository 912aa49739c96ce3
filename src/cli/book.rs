//! `groundglass diagram --gallery` and `--check`: a book of figures, as a page that shows them, and whether all are up to date.

use super::figure_file::draw_figure;
use super::input::{self, MemoryArguments};
use super::{new, output, report};
use groundglass::diagram::{Changes, FigureFile, KINDS};
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::scene::Source;
use std::path::{Path, PathBuf};

/// The folder that holds a book of figures.
const BOOK: &str = "diagrams";

/// How figure files are read.
#[derive(Clone, Copy)]
pub(super) struct Reading<'a> {
    /// The folder beyond which nothing is read.
    pub(super) root: Option<&'a Path>,
    pub(super) memory: MemoryArguments,
}

/// The files given, or all figures of the book beside.
fn book(files: &[PathBuf], Reading { root, .. }: Reading<'_>) -> Result<Vec<PathBuf>> {
    if !files.is_empty() {
        return Ok(files.to_vec());
    }
    let folder = Path::new(BOOK);
    let folder = if folder.is_dir() { folder } else { Path::new(".") };
    let wrong = |error: std::io::Error| {
        Error::new(ErrorKind::Io, format!("the folder cannot be read: {error}"))
            .in_file(folder.display().to_string())
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        let path = path.strip_prefix(".").map(Path::to_path_buf).unwrap_or(path);
        // Scenes and what else is in TOML may stand beside.
        let is_toml = path.extension().is_some_and(|ending| ending == "toml");
        // What cannot be read is told of where it is wanted.
        let is_figure = || FigureFile::is_figure(&input::open(&path, root)?.document);
        if is_toml && is_figure().unwrap_or(true) {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(Error::new(ErrorKind::Usage, "there are no figures here")
            .in_file(folder.display().to_string())
            .remedy("name the files, or begin one with --new KIND"));
    }
    Ok(files)
}

/// How such a page begins.
const TITLE: &str = "# The book of figures";

/// Writes a page in Markdown: of each kind, in the book's order, its figures and their sources.
pub(super) fn gallery(page: &Path, files: &[PathBuf], reading: Reading<'_>) -> Result<()> {
    let folder = output::folder(page)?;
    if page.is_file() && !std::fs::read_to_string(page).is_ok_and(|text| text.starts_with(TITLE)) {
        return Err(Error::invalid("there is a file of this name already, and it is no book of figures")
            .in_file(page.display().to_string())
            .remedy("give another name with --gallery"));
    }
    let mut entries = Vec::new();
    let mut read = Vec::new();
    for file in &book(files, reading)? {
        let opened = input::open(file, reading.root)?;
        let figure = FigureFile::from_document(opened.document.clone())?;
        let order = KINDS.iter().position(|kind| kind.name == figure.kind().name).unwrap_or(0);
        let path = new::relative(&folder, &opened.path)?;
        entries.push((order, path, figure.kind(), opened.document.text().to_owned()));
        read.extend(opened.source.paths());
    }
    entries.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
    let mut text = format!(
        "{TITLE}\n\n\
         Made by `groundglass diagram --gallery docs/gallery.md`: each figure with its figure file. A new one begins with\n`groundglass diagram --new KIND` (of the kinds that show scenes, pictures or tables, put your own into it); `groundglass schema --figures`\nlists every key.\n",
    );
    for (_, path, kind, source) in entries {
        let stem = path.strip_suffix(".toml").unwrap_or(&path);
        let name = stem.rsplit('/').next().unwrap_or(stem);
        let is_plain = !stem.contains(|c: char| c.is_whitespace() || "()<>".contains(c));
        let link = if is_plain { format!("{stem}.svg") } else { format!("<{stem}.svg>") };
        text.push_str(&format!(
            "\n## {name}\n\n`{}`: {}.\n\n![{name}]({link})\n\n```toml\n{}\n```\n",
            kind.name,
            kind.line,
            source.replace("\r\n", "\n").trim_end()
        ));
    }
    output::write_text(page, &read, &text)
}

/// Names the figure files whose SVG is not what would be drawn now; whether there is none.
pub(super) fn check(files: &[PathBuf], reading: Reading<'_>, changes: Changes) -> Result<bool> {
    let (mut stale, mut failed) = (String::new(), None);
    for file in &book(files, reading)? {
        // One that cannot be drawn hides nothing of the others.
        match staleness(file, reading, changes) {
            Ok(None) => {}
            Ok(Some(why)) => stale.push_str(&format!(
                "{} {why}; draw it anew with `groundglass diagram {}`, and look at it\n",
                file.with_extension("svg").display(),
                file.display()
            )),
            Err(error) => {
                if let Some(earlier) = failed.replace(error) {
                    report::failure(&earlier);
                }
            }
        }
    }
    report::print(&stale)?;
    failed.map_or(Ok(stale.is_empty()), Err)
}

/// Why the SVG beside a figure file is not what would be drawn now.
fn staleness(file: &Path, reading: Reading<'_>, changes: Changes) -> Result<Option<&'static str>> {
    let mut opened = input::open(file, reading.root)?;
    opened.source.limit(reading.memory);
    let (figure, _) = draw_figure(&opened, changes)?;
    let svg = file.with_extension("svg");
    let drawn = figure.to_svg()?;
    // Through the door that refuses devices; one longer than what would be drawn is not it.
    Ok(match opened.source.argument(&svg) {
        Err(error) if error.kind() == ErrorKind::Invalid && !svg.exists() => Some("is missing"),
        Err(_) => Some("cannot be read"),
        Ok(found) => match opened.source.read(&found, drawn.len() as u64) {
            Ok(bytes) if *bytes == *drawn.as_bytes() => None,
            Ok(_) => Some("is stale"),
            Err(error) if error.kind() == ErrorKind::TooLarge => Some("is stale"),
            Err(_) => Some("cannot be read"),
        },
    })
}
