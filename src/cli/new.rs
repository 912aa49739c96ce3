//! `groundglass new MODEL.obj`: a first scene for a model, commented. Unlike a picture, a scene may hold
//! somebody's work, so an existing file is replaced only with `--force`.

use super::input::{self, MemoryArguments, Recorded, RootArguments};
use super::progress::Progress;
use super::{output, values};
use groundglass::error::{Error, Result};
use groundglass::scene::starter::{self, Statistics};
use groundglass::scene::{AssetLoader, Source, parse};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The model (OBJ)
    #[arg(value_name = "MODEL.obj")]
    pub(super) model: PathBuf,
    #[command(flatten)]
    pub(super) root: RootArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    /// The scene to write; MODEL.toml in the current folder by default
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true, value_parser = values::output())]
    pub(super) output: Option<PathBuf>,
    /// Replace an existing scene
    #[arg(long)]
    pub(super) force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let model_name = arguments.model.display().to_string();
    let files = Box::new(input::files(arguments.root.root.as_deref())?) as Box<dyn Source>;
    let mut source = Recorded::new(files);
    source.limit(arguments.memory);
    let model = source.argument(&arguments.model).map_err(|error| error.in_file(&*model_name))?;
    let target = arguments
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(model.file_name().unwrap_or_default()).with_extension("toml"));
    if target.is_file() && !arguments.force {
        return Err(Error::invalid("there is a file of this name already")
            .in_file(target.display().to_string())
            .remedy("give another name with -o, or --force to replace it"));
    }
    let written = relative(&output::folder(&target)?, &model)?;
    let statistics = measure(&source, &model)?;
    let text = starter::scene_for(&statistics, &written);
    // A model of 1e18 m asks for a camera beyond all limits.
    parse(&text, &target.display().to_string()).and_then(|document| document.describe()).map_err(
        |error| {
            Error::invalid(format!("no camera can be set up before this model: {}", error.message()))
                .in_file(&*model_name)
                .remedy("give the model another unit of length, such as metres")
        },
    )?;
    output::write_text(&target, &source.paths(), &text)
}

/// Bounds and covered sides of the model's triangles. (Its pictures are read with it, though nothing is seen of them: what is read is not
/// written over.)
fn measure(source: &dyn Source, model: &Path) -> Result<Statistics> {
    let folder = model.parent().unwrap_or(Path::new(""));
    let name = model.file_name().unwrap_or_default().to_string_lossy();
    let progress = Progress::new();
    let tell = |what: &str, done: u64, total: u64| progress.tell(what, done, total);
    let mut loader = AssetLoader::new(source, folder).with_progress(&tell);
    let loaded = loader.load_obj(&name);
    progress.finish();
    let loaded = loaded?;
    let corner = |at: u32| loaded.positions.get(at as usize).copied().unwrap_or_default();
    starter::measure(loaded.triangles.iter().map(|t| t.positions.map(corner)))
        .ok_or_else(|| Error::invalid("the model has no triangles to frame").in_file(name))
}

/// The path from a folder to a file (both with links resolved), with forward slashes.
pub(super) fn relative(folder: &Path, file: &Path) -> Result<String> {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), file.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let refused = |message: &str, remedy: &str| {
        Error::invalid(message.to_string()).in_file(file.display().to_string()).remedy(remedy)
    };
    if shared == 0 {
        return Err(refused(
            "no relative path leads there from the scene's folder",
            "write the scene on the model's drive",
        ));
    }
    let mut parts = vec![".."; from.len() - shared];
    for part in to.iter().skip(shared) {
        parts.push(part.as_os_str().to_str().ok_or_else(|| {
            refused("its path is not UTF-8, as a scene file must be", "rename the file or folder")
        })?);
    }
    let path = parts.join("/");
    if path.contains('\\') && !cfg!(windows) || path.contains(char::is_control) {
        return Err(refused("a scene file cannot name this path", "rename the file or folder"));
    }
    Ok(path)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn names_that_a_scene_cannot_hold_are_refused() {
        for name in ["/a/b\\c.obj", "/a/new\nline.obj"] {
            assert!(relative(Path::new("/a"), Path::new(name)).is_err(), "{name}");
        }
    }

    #[test]
    fn models_are_named_from_the_scenes_folder() {
        let path = |folder: &str, file: &str| relative(Path::new(folder), Path::new(file)).unwrap();
        assert_eq!(path("/a/b", "/a/b/m.obj"), "m.obj");
        assert_eq!(path("/a/b", "/a/b/c/m.obj"), "c/m.obj");
        assert_eq!(path("/a/b", "/a/x/m.obj"), "../x/m.obj");
        assert_eq!(path("/", "/a/m.obj"), "a/m.obj");
    }
}
