//! The scene a verb works on. In: the path and the root folder from the command line; out: the described
//! scene, its assets when asked for, and the files that were read (which no output may replace).

use super::machine;
use super::progress::Progress;
use super::values::Bytes;
use groundglass::error::{Error, Result};
use groundglass::scene::{
    Document, Files, LoadSettings, SIZE_LIMIT, Scene, SceneDescription, SceneFile, Source,
};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

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

/// How much memory a verb that loads meshes may take.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(super) struct MemoryArguments {
    /// Refuse what would take more memory than this, such as 2GiB; by default all that is free
    #[arg(long, value_name = "LIMIT", allow_hyphen_values = true)]
    pub(super) memory: Option<Bytes>,
}

/// A described scene and where it came from.
pub(super) struct Input {
    pub(super) scene: SceneDescription,
    /// The scene file, links resolved.
    pub(super) path: PathBuf,
    source: Recorded<Box<dyn Source>>,
}

/// Reads and judges a scene file; its assets are not opened.
///
/// # Errors
/// [`Invalid`](groundglass::error::ErrorKind::Invalid) when it is missing, no regular file, outside the root, or
/// wrong; [`Io`](groundglass::error::ErrorKind::Io) when it cannot be read.
pub(super) fn read(arguments: &SceneArguments) -> Result<Input> {
    read_scene(&arguments.scene, arguments.root.root.as_deref())
}

/// As [`read`], for a path.
pub(super) fn read_scene(path: &Path, root: Option<&Path>) -> Result<Input> {
    open(path, root)?.scene()
}

/// A TOML file, a scene or a figure.
pub(super) struct Opened {
    pub(super) document: Document,
    /// The file, links resolved.
    pub(super) path: PathBuf,
    pub(super) source: Recorded<Box<dyn Source>>,
}

/// Reads a TOML file.
///
/// # Errors
/// As [`read`], but for what it says.
pub(super) fn open(path: &Path, root: Option<&Path>) -> Result<Opened> {
    let name = path.display().to_string();
    let source = Recorded::new(Box::new(files(root)?) as Box<dyn Source>);
    let named = |error: Error| error.in_file(&*name);
    let path = source.argument(path).map_err(named)?;
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("obj")) {
        return Err(named(
            Error::invalid("is a model, and a scene or figure file (TOML) is wanted")
                .remedy("write a scene for it to start from with `groundglass new MODEL.obj -o scene.toml`"),
        ));
    }
    let bytes = source.read(&path, SIZE_LIMIT as u64 + 1).map_err(named)?;
    let document = Document::from_bytes(&bytes, &name)?;
    drop(bytes);
    Ok(Opened { document, path, source })
}

impl Opened {
    /// It as a scene.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn scene(self) -> Result<Input> {
        let scene = SceneFile::from_document(self.document)?.describe()?;
        Ok(Input { scene, path: self.path, source: self.source })
    }

    /// The folder that the file lies in.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}

/// All files, or those under the root folder.
pub(super) fn files(root: Option<&Path>) -> Result<Files> {
    root.map_or_else(|| Ok(Files::new()), |root| Files::under(root).map_err(|error| error.at_key("--root")))
}

impl Input {
    /// The scene that the program carries in itself.
    pub(super) fn builtin() -> Result<Self> {
        let document = Document::from_bytes(super::builtin::SCENE.as_bytes(), super::builtin::NAME)?;
        Ok(Self {
            scene: SceneFile::from_document(document)?.describe()?,
            path: PathBuf::from(super::builtin::NAME),
            source: Recorded::new(Box::new(super::builtin::assets())),
        })
    }

    /// It, loaded and drawn in so much memory, on so many threads.
    #[must_use]
    pub(super) fn within(mut self, memory: MemoryArguments, threads: usize) -> Self {
        self.source.limit(memory);
        self.source.threads = threads;
        self
    }

    /// Bytes of memory that may yet be taken.
    pub(super) fn room(&self) -> Option<u64> {
        self.source.room()
    }

    /// The scene file as the user named it.
    pub(super) fn name(&self) -> String {
        self.scene.document.name().to_owned()
    }

    /// Loads the meshes, with a progress bar on a terminal.
    ///
    /// # Errors
    /// Those of [`SceneDescription::load_with`].
    pub(super) fn load(&self) -> Result<Scene> {
        self.load_at(None)
    }

    /// As [`Self::load`], for a picture of this width.
    ///
    /// # Errors
    /// As there.
    pub(super) fn load_at(&self, width: Option<u32>) -> Result<Scene> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let progress = Progress::new();
        let tell = |what: &str, done: u64, total: u64| progress.tell(what, done, total);
        let threads = Some(self.source.threads);
        let settings = LoadSettings { progress: Some(&tell), width, threads, ..LoadSettings::default() };
        let loaded = self.scene.load_with(&self.source, folder, settings);
        progress.finish();
        loaded
    }

    /// The file that the scene names as `written`, if it is there and may be read.
    pub(super) fn find(&self, written: &str) -> Option<PathBuf> {
        self.source.named(self.path.parent().unwrap_or(Path::new("")), written).ok()
    }

    /// The files read or found so far.
    pub(super) fn read_paths(&self) -> Vec<PathBuf> {
        self.source.paths()
    }
}

/// A source that remembers what was read from it, and what was found in it to be read.
pub(super) struct Recorded<S> {
    inner: S,
    paths: Mutex<Vec<PathBuf>>,
    memory: MemoryArguments,
    threads: usize,
}

impl<S> Recorded<S> {
    pub(super) fn new(inner: S) -> Self {
        Self {
            inner,
            paths: Mutex::default(),
            memory: MemoryArguments::default(),
            threads: machine::threads(None),
        }
    }

    /// Limits what is loaded.
    pub(super) fn limit(&mut self, memory: MemoryArguments) {
        self.memory = memory;
    }

    /// Bytes of memory that may yet be taken.
    pub(super) fn room(&self) -> Option<u64> {
        machine::room(self.memory.memory.map(|most| most.0), self.threads)
    }

    fn remember(&self, file: &Path) {
        self.paths.lock().unwrap_or_else(PoisonError::into_inner).push(file.to_path_buf());
    }

    /// The files read or found so far.
    pub(super) fn paths(&self) -> Vec<PathBuf> {
        self.paths.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Source for Recorded<Box<dyn Source>> {
    fn argument(&self, path: &Path) -> Result<PathBuf> {
        self.inner.argument(path)
    }

    fn named(&self, folder: &Path, written: &str) -> Result<PathBuf> {
        self.inner.named(folder, written)
    }

    fn asset(&self, folder: &Path, written: &str, fences: &[PathBuf]) -> Result<PathBuf> {
        let file = self.inner.asset(folder, written, fences)?;
        self.remember(&file);
        Ok(file)
    }

    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>> {
        self.remember(file);
        self.inner.read(file, limit)
    }

    fn length(&self, file: &Path) -> Result<u64> {
        self.inner.length(file)
    }

    fn room(&self) -> Option<u64> {
        Self::room(self)
    }
}
