//! Figure files. In: a TOML document with a top-level `kind`, a source for the files it names, and what the command line
//! changes. Out: a [`Figure`], or an error with file, line, key and remedy.

use super::Kind;
use super::keys::{CameraKeys, PAGE_WIDTHS, PageKeys};
use super::side_view::Inset;
use crate::diagram::sheet::Sheet;
use crate::diagram::{Figure, Section, Theme};
use crate::error::{Error, Place, Result, Warning};
use crate::optics::Optics;
use crate::sampling::ApertureShape;
use crate::scene::{
    AssetLoader, Document, Files, RenderTable, SIZE_LIMIT, SceneDescription, SceneFile, SceneTables,
    SkyTable, Source, check_shape,
};
use glam::DVec3;
use serde::de::DeserializeOwned;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// What replaces values of a figure file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Changes {
    /// The colours.
    pub theme: Option<Theme>,
    /// Width of the page in millimetres; the height then suits it.
    pub width_mm: Option<f64>,
    /// Which section is shown, where the kind has one.
    pub section: Option<Section>,
    /// Whether the camera is drawn at its own scale too, where the kind does so.
    pub inset: Option<Inset>,
}

/// A figure file: its kind, and keys of the right names, types and ranges.
///
/// ```
/// use groundglass::diagram::{Changes, FigureFile, Kind};
/// use groundglass::scene::{Document, Files};
///
/// let text = Kind::named("side-view")?.starter;
/// let file = FigureFile::from_document(Document::from_bytes(text.as_bytes(), "my.toml")?)?;
/// let figure = file.draw(&Files::new(), "diagrams".as_ref(), Changes::default())?;
/// assert!(figure.to_svg()?.contains("data-part=\"focus-plane\""));
/// # Ok::<(), groundglass::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FigureFile {
    document: Document,
    kind: &'static Kind,
}

impl FigureFile {
    /// Whether a document is a figure: it has a top-level `kind`.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid) when it is not TOML.
    pub fn is_figure(document: &Document) -> Result<bool> {
        Ok(document.table()?.get_ref().contains_key("kind"))
    }

    /// Reads a figure from a document.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid), with line, key and remedy: not TOML, an unknown kind or key, a
    /// missing one, a wrong type, a number out of range.
    pub fn from_document(document: Document) -> Result<Self> {
        let table = document.table()?;
        let Some(value) = table.get_ref().get("kind") else {
            return Err(Error::invalid("a figure says what it is with a top-level `kind`")
                .in_file(document.name())
                .remedy("add `kind = \"side-view\"`; `groundglass diagram --list` lists the kinds"));
        };
        let place = || document.place_of_range(value.span(), Some("kind"));
        let Some(name) = value.get_ref().as_str() else {
            return Err(Error::invalid("the kind of a figure is a text in quotes")
                .at(place())
                .remedy("for example `kind = \"side-view\"`"));
        };
        let kind = Kind::named(name).map_err(|error| error.at(place()))?;
        check_shape(&document, table.get_ref(), &kind.schema())?;
        drop(table);
        Ok(Self { document, kind })
    }

    /// The figure's kind.
    pub fn kind(&self) -> &'static Kind {
        self.kind
    }

    /// What errors call the file.
    pub fn name(&self) -> &str {
        self.document.name()
    }

    /// Draws it. Files that it names come from `source`; `folder` is the figure file's, as `source` knows it.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid) and [`NoSolution`](crate::error::ErrorKind::NoSolution) with
    /// file, line and key when values exclude each other, a named file is missing or wrong, or the camera cannot exist.
    pub fn draw(&self, source: &dyn Source, folder: &Path, changes: Changes) -> Result<Figure> {
        let input = Input {
            document: &self.document,
            source,
            folder,
            changes,
            warnings: RefCell::default(),
            loaders: RefCell::default(),
        };
        let mut figure = (self.kind.draw)(&input).map_err(|error| input.placed(error))?;
        for words in figure.not_shown() {
            input.warn(words);
        }
        figure.warnings = input.warnings.into_inner();
        Ok(figure)
    }

    /// Reads and draws the figure file at `path`.
    ///
    /// # Errors
    /// As [`Self::from_document`] and [`Self::draw`]; [`Io`](crate::error::ErrorKind::Io) when it cannot be read.
    pub fn draw_path(path: impl AsRef<Path>) -> Result<Figure> {
        let (files, name) = (Files::new(), path.as_ref().display().to_string());
        let named = |error: Error| error.in_file(&*name);
        let found = files.argument(path.as_ref()).map_err(named)?;
        let bytes = files.read(&found, SIZE_LIMIT as u64 + 1).map_err(named)?;
        let folder = found.parent().unwrap_or(Path::new(""));
        Self::from_document(Document::from_bytes(&bytes, &name)?)?.draw(&files, folder, Changes::default())
    }
}

/// What a kind draws from.
pub(crate) struct Input<'a> {
    pub(crate) document: &'a Document,
    pub(crate) source: &'a dyn Source,
    pub(crate) folder: &'a Path,
    pub(crate) changes: Changes,
    warnings: RefCell<Vec<Warning>>,
    /// A loader for each folder of scenes: what several scenes of a figure name is read once.
    loaders: RefCell<BTreeMap<PathBuf, AssetLoader<'a>>>,
}

/// The page of a figure, settled.
pub(crate) struct Page {
    pub(crate) size: [f64; 2],
    /// Whether the file says how high it is: else it may be as high as what it holds needs.
    pub(crate) has_height: bool,
    pub(crate) title: Option<String>,
    pub(crate) theme: Theme,
    pub(crate) background: bool,
}

impl Page {
    /// The height of the page on which this much is needed: that of the file, or where it gives none and the usual one is too low,
    /// `wanted`.
    ///
    /// # Errors
    /// When the file gives less.
    pub(crate) fn height_for(&self, sheet: &mut Sheet, needed: f64, wanted: f64) -> Result<f64> {
        let [width, height] = sheet.size;
        if height < needed && self.has_height {
            return Err(Error::invalid(format!(
                "a page of {width} by {height} mm leaves no room for the drawing"
            ))
            .at_key("height_mm")
            .remedy(format!("give at least {:.0}", needed.ceil())));
        }
        if height < needed {
            sheet.size[1] = wanted.ceil();
        }
        Ok(sheet.size[1])
    }
}

/// A camera and what stands before it.
pub(crate) struct Subject {
    pub(crate) optics: Optics,
    /// Diameter of the circle of confusion, metres.
    pub(crate) circle: f64,
    /// The world's upward direction.
    pub(crate) up: DVec3,
    pub(crate) aperture: ApertureShape,
    /// World metres.
    pub(crate) triangles: Vec<[DVec3; 3]>,
}

impl Input<'_> {
    fn warn(&self, message: String) {
        let warning = Warning { file: self.document.name().to_owned(), line: None, message };
        self.warnings.borrow_mut().push(warning);
    }

    /// The keys of a struct; those that it does not know belong to another.
    ///
    /// # Errors
    /// None that the schema has not found before.
    pub(crate) fn keys<T: DeserializeOwned>(&self) -> Result<T> {
        self.document.keys(self.document.table()?)
    }

    /// The page; `height` gives that of a width where the file has none.
    ///
    /// # Errors
    /// When the width is given twice.
    pub(crate) fn page(&self, height: impl Fn(f64) -> f64) -> Result<Page> {
        let keys: PageKeys = self.keys()?;
        let named = match &keys.width {
            Some(_) if keys.width_mm.is_some() => {
                return Err(self
                    .document
                    .error("width", "`width` and `width_mm` exclude each other")
                    .remedy("remove one of them"));
            }
            Some(name) => PAGE_WIDTHS.iter().find(|width| width.0 == name).map(|width| width.1),
            None => None,
        };
        let own = keys.width_mm.or(named).unwrap_or(160.0);
        let width = self.changes.width_mm.unwrap_or(own);
        // A page set narrower keeps the height that the file gives, unless it had the shape of its width.
        let height = keys.height_mm.unwrap_or_else(|| height(width).round());
        let theme = match (self.changes.theme, &keys.theme) {
            (Some(theme), _) => theme,
            (None, Some(name)) => Theme::named(name)?,
            (None, None) => Theme::PRINT,
        };
        Ok(Page {
            size: [width, height],
            has_height: keys.height_mm.is_some(),
            title: keys.title,
            theme,
            background: keys.paper,
        })
    }

    /// The camera that the file gives or names; with its meshes where they are `wanted`.
    ///
    /// # Errors
    /// When neither or both of `scene` and [camera] are given, or they have the errors of a scene.
    pub(crate) fn camera(&self, wanted: bool) -> Result<Subject> {
        let keys: CameraKeys = self.keys()?;
        let (description, folder) = match (keys.scene, keys.camera) {
            (Some(_), Some(_)) => {
                return Err(self
                    .document
                    .error("scene", "`scene` and [camera] exclude each other")
                    .remedy("remove one of them"));
            }
            (None, None) => {
                return Err(self
                    .document
                    .error("camera", "nothing says which camera is drawn: neither `scene` nor [camera]")
                    .remedy("add `scene = \"scene.toml\"`, or the table [camera] of a scene file"));
            }
            (None, Some(camera)) => {
                let tables = SceneTables {
                    camera,
                    focus: keys.focus,
                    mesh: keys.mesh,
                    sun: None,
                    sky: SkyTable::default(),
                    render: RenderTable::default(),
                };
                let file = SceneFile { document: self.document.clone(), tables };
                (file.describe()?, self.folder.to_path_buf())
            }
            (Some(written), None) => {
                for (key, given) in [("focus", keys.focus.is_some()), ("mesh", !keys.mesh.is_empty())] {
                    if given {
                        return Err(self
                            .document
                            .error(key, format!("`scene` brings its own `{key}`"))
                            .remedy(format!("remove `{key}`, or give [camera] instead of `scene`")));
                    }
                }
                return self.scene("scene", &written, wanted);
            }
        };
        self.loaded(&description, &folder, wanted)
    }

    /// The camera of the scene file that a key names; with its meshes where they are `wanted`.
    ///
    /// # Errors
    /// Those of a scene.
    pub(crate) fn scene(&self, key: &str, written: &str, wanted: bool) -> Result<Subject> {
        let (bytes, path) = self.read(key, written)?;
        let description = SceneFile::from_document(Document::from_bytes(&bytes, written)?)?.describe()?;
        self.loaded(&description, path.parent().unwrap_or(Path::new("")), wanted)
    }

    fn loaded(&self, description: &SceneDescription, folder: &Path, wanted: bool) -> Result<Subject> {
        let (circle, up) = (description.circle_of_confusion.as_metres(), description.up);
        let optics = description.optics()?;
        let aperture = description.blades.map_or(ApertureShape::Disk, |blades| blades.shape());
        for caution in optics.cautions() {
            self.warn(caution);
        }
        if !wanted || description.meshes.is_empty() {
            return Ok(Subject { optics, circle, up, aperture, triangles: Vec::new() });
        }
        let mut loaders = self.loaders.borrow_mut();
        let loader = loaders
            .entry(folder.to_path_buf())
            .or_insert_with(|| AssetLoader::new(self.source, folder).shapes_only());
        let said = loader.warnings().len();
        let surfaces = description.shapes(loader)?;
        self.warnings.borrow_mut().extend(loader.warnings().iter().skip(said).cloned());
        let triangles = (0..surfaces.triangles.len()).map(|t| surfaces.corners(t)).collect();
        Ok(Subject { optics, circle, up, aperture, triangles })
    }

    /// The bytes of a file that the key names, and its path.
    ///
    /// # Errors
    /// When it is missing or refused, with the key's line.
    pub(crate) fn read(&self, key: &str, written: &str) -> Result<(Vec<u8>, std::path::PathBuf)> {
        let at = |error: Error| replaced(error, self.document.place(key));
        let path = self.source.named(self.folder, written).map_err(at)?;
        let bytes = self.source.read(&path, SIZE_LIMIT as u64).map_err(at)?;
        Ok((bytes.into_owned(), path))
    }

    /// An error that names a key alone, with the key's place.
    fn placed(&self, error: Error) -> Error {
        let place = error.place();
        match (&place.file, &place.key) {
            (None, Some(key)) => {
                let place = self.document.place(key);
                replaced(error, place)
            }
            (None, None) => match unwritable(self.document.text(), error.message()) {
                Some(at) => replaced(error, self.document.place_of_range(at, None)),
                None => error.in_file(self.document.name()),
            },
            _ => error,
        }
    }
}

/// Where in quotes the letter stands that an error says the font has no glyph for.
fn unwritable(text: &str, message: &str) -> Option<Range<usize>> {
    let (_, named) = message.split_once("no glyph for `")?;
    let mut quote = None;
    let mut is_comment = false;
    for (at, letter) in text.char_indices() {
        match (quote, letter) {
            (_, '\n') => is_comment = false,
            (None, '#') => is_comment = true,
            (None, '"' | '\'') if !is_comment => quote = Some(letter),
            (Some(open), _) if letter == open => quote = None,
            (Some(_), _) if !letter.is_ascii() && named.starts_with(&letter.escape_default().to_string()) => {
                return Some(at..at + letter.len_utf8());
            }
            _ => {}
        }
    }
    None
}

/// The error with another place.
fn replaced(error: Error, place: Place) -> Error {
    error.at(place)
}
