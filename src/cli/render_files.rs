//! The files that `render` writes. In: its arguments; out: where they go and as what, and whether they can be written.

use super::{output, render::Arguments};
use groundglass::error::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// What a picture is to be written as, by the name's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Exr,
}

impl Format {
    fn of(path: &Path, flag: &str) -> Result<Self> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(Error::new(ErrorKind::Usage, "a picture's name ends in .png or .exr")
                .in_file(path.display().to_string())
                .remedy(format!("give such a name with {flag}"))),
        }
    }
}

/// Where everything goes.
#[derive(Debug)]
pub(super) struct Files<'a> {
    pub(super) picture: (PathBuf, Format),
    pub(super) error_map: Option<(&'a Path, Format)>,
    pub(super) stats: Option<&'a Path>,
    /// Of the built-in scene: beside the picture.
    pub(super) diagrams: Vec<PathBuf>,
    /// Whether the picture has its usual name, whose folder is made.
    is_usual: bool,
}

impl<'a> Files<'a> {
    /// Settles them.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for other endings of pictures than .png and .exr, and where two are one file.
    pub(super) fn new(arguments: &'a Arguments) -> Result<Self> {
        let path = arguments.output.clone().unwrap_or_else(|| {
            let stem = arguments.scene.as_deref().and_then(|scene| scene.file_stem());
            let mut name = stem.unwrap_or(std::ffi::OsStr::new("tower")).to_os_string();
            name.push(".png");
            PathBuf::from("groundglass-out").join(name)
        });
        let format = Format::of(&path, "-o")?;
        let files = Self {
            diagrams: if arguments.scene.is_none() { beside(&path).to_vec() } else { Vec::new() },
            picture: (path, format),
            error_map: match &arguments.error_map {
                Some(path) => Some((path, Format::of(path, "--error-map")?)),
                None => None,
            },
            stats: arguments.stats.as_deref(),
            is_usual: arguments.output.is_none(),
        };
        let all: Vec<(&Path, &str)> = files.all().collect();
        for (i, (first, flag)) in all.iter().enumerate() {
            for (second, other) in &all[..i] {
                if output::is_same(first, second) {
                    return Err(Error::new(ErrorKind::Usage, format!("{other} and {flag} name one file"))
                        .remedy("give two names"));
                }
            }
        }
        Ok(files)
    }

    /// Each with the flag that names it.
    fn all(&self) -> impl Iterator<Item = (&Path, &str)> {
        [
            Some((&*self.picture.0, "-o")),
            self.stats.map(|path| (path, "--stats")),
            self.error_map.map(|(path, _)| (path, "--error-map")),
        ]
        .into_iter()
        .flatten()
        .chain(self.diagrams.iter().map(|path| (&**path, "the diagram beside the picture")))
    }

    /// The folder that is made for a picture without a name.
    pub(super) fn folder(&self) -> Option<&Path> {
        self.picture.0.parent().filter(|_| self.is_usual)
    }

    /// Whether each can be written and none replaces what was `read`; those in a folder that is still to be made can.
    ///
    /// # Errors
    /// As for [`output::check`].
    pub(super) fn check(&self, read: &[PathBuf]) -> Result<()> {
        let coming = self.folder().filter(|folder| !folder.exists());
        self.all()
            .filter(|(path, _)| coming.is_none() || path.parent() != coming)
            .try_for_each(|(path, _)| output::check(path, read))
    }
}

/// What the built-in scene's diagram is written as: beside the picture, and named after it.
fn beside(picture: &Path) -> [PathBuf; 2] {
    let stem = picture.file_stem().unwrap_or_default().to_string_lossy();
    ["svg", "png"].map(|ending| picture.with_file_name(format!("{stem}-diagram.{ending}")))
}
