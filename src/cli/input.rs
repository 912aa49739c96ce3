//! The scene a verb works on. In: the path and the root folder from the command line; out: the described
//! scene and the files that were read (which no output may replace).

use groundglass::error::{Error, ErrorKind, Result};
use groundglass::scene::{Document, SIZE_LIMIT, SceneDescription, SceneFile};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The scene argument of every verb that reads one.
#[derive(Debug, clap::Args)]
pub(super) struct SceneArguments {
    /// The scene file (TOML)
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    #[command(flatten)]
    pub(super) root: RootArguments,
}

/// The fence for documents that others wrote.
#[derive(Debug, clap::Args)]
pub(super) struct RootArguments {
    /// Refuse every file outside this folder (for scenes that others wrote)
    #[arg(long, value_name = "DIR")]
    pub(super) root: Option<PathBuf>,
}

/// A described scene and where it came from.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) scene: SceneDescription,
    /// The scene file, links resolved.
    pub(super) path: PathBuf,
}

impl Input {
    /// The scene file as the user named it.
    pub(super) fn name(&self) -> String {
        self.scene.document.name().to_owned()
    }
}

/// Reads and judges a scene file; its assets are not opened.
///
/// # Errors
/// [`ErrorKind::Invalid`] when it is missing, no regular file, outside the root, or wrong;
/// [`ErrorKind::Io`] when it cannot be read.
pub(super) fn read(arguments: &SceneArguments) -> Result<Input> {
    read_scene(&arguments.scene, arguments.root.root.as_deref())
}

/// As [`read`], for a path.
pub(super) fn read_scene(path: &Path, root: Option<&Path>) -> Result<Input> {
    let name = path.display().to_string();
    let (path, bytes) = bytes(path, root).map_err(|error| error.in_file(&*name))?;
    let scene = SceneFile::from_document(Document::from_bytes(&bytes, &name)?)?.describe()?;
    Ok(Input { scene, path })
}

// To be replaced by `scene::Files`, the library's one door to files.
fn bytes(path: &Path, root: Option<&Path>) -> Result<(PathBuf, Vec<u8>)> {
    let found = path.canonicalize().map_err(|error| explain(&error))?;
    if let Some(root) = root {
        let fence = root
            .canonicalize()
            .map_err(|error| Error::invalid(format!("the root folder {}: {error}", root.display())))?;
        if !found.starts_with(&fence) {
            return Err(Error::invalid("lies outside the root folder").remedy("choose another --root"));
        }
    }
    let kind = std::fs::metadata(&found).map_err(|error| explain(&error))?;
    if kind.is_dir() {
        return Err(Error::invalid("is a folder, not a scene").remedy("name the TOML file in it"));
    }
    if !kind.is_file() {
        return Err(Error::invalid("is not a regular file").remedy("name a TOML file"));
    }
    let file = std::fs::File::open(&found).map_err(|error| explain(&error))?;
    let mut bytes = Vec::new();
    file.take(SIZE_LIMIT as u64 + 1).read_to_end(&mut bytes).map_err(|error| explain(&error))?;
    Ok((found, bytes))
}

fn explain(error: &io::Error) -> Error {
    if error.kind() == io::ErrorKind::NotFound {
        Error::invalid("there is no such file").remedy("check the path")
    } else {
        Error::new(ErrorKind::Io, format!("cannot be read: {error}"))
    }
}
