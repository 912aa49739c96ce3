//! `render --replay STATS`: an earlier run's numbers of samples, so that its picture can be made again.

use super::effects::EffectArguments;
use super::input;
use super::stats::Asked;
use groundglass::error::{Error, ErrorKind, Result, Warning};
use groundglass::picture::Allocation;
use groundglass::scene::{Budget, EffectName, MAX_PICTURE_SIDE, Scene, Source};
use serde::Deserialize;
use std::path::Path;

/// The most bytes of a file of numbers: some 50 for each of the blocks of the largest picture are far less.
const MOST_BYTES: u64 = 256 << 20;

/// Of a file that is another, or was changed.
const REMEDY: &str = "give the file that --stats wrote beside the picture";

/// What is needed of a `--stats` file.
#[derive(Deserialize)]
#[serde(expecting = "an object with width, height, allocation and scene_hash")]
pub(super) struct Replay {
    pub(super) width: u32,
    height: u32,
    allocation: String,
    scene_hash: String,
    #[serde(default)]
    version: String,
    /// By default what runs of earlier versions were asked for, which did not tell.
    #[serde(default)]
    asked: Asked,
    #[serde(skip)]
    name: String,
}

impl Replay {
    /// Reads a `--stats` file.
    pub(super) fn read(path: &Path, root: Option<&Path>) -> Result<Self> {
        let name = path.display().to_string();
        let named = |error: Error| error.in_file(&*name);
        let files = input::files(root)?;
        let path = files.argument(path).map_err(named)?;
        let bytes = files.read(&path, MOST_BYTES).map_err(named)?;
        let found: Self = serde_json::from_slice(&bytes).map_err(|error| {
            Error::invalid(format!("is not what render --stats writes: {error}"))
                .in_file(&*name)
                .remedy(REMEDY)
        })?;
        if found.width == 0 || found.height == 0 {
            return Err(Error::invalid("tells of a picture without pixels")
                .in_file(name)
                .at_key(if found.width == 0 { "width" } else { "height" })
                .remedy(REMEDY));
        }
        if found.width.max(found.height) > MAX_PICTURE_SIDE {
            return Err(Error::invalid(format!(
                "tells of a picture of {} x {} pixels; a side has at most {MAX_PICTURE_SIDE} pixels",
                found.width, found.height
            ))
            .in_file(name)
            .at_key(if found.width > MAX_PICTURE_SIDE { "width" } else { "height" })
            .remedy(REMEDY));
        }
        Ok(Self { name, ..found })
    }

    /// Makes the scene that of the run: what effects it has goes by the error that was asked for as well. Effects that are
    /// `given` again must be those of the run.
    ///
    /// # Errors
    /// When the file names an effect that there is not, or no error, or other effects than are given.
    pub(super) fn ask(&self, scene: &mut Scene, given: &EffectArguments) -> Result<EffectArguments> {
        let place = |error: String| Error::invalid(error).in_file(&*self.name).at_key("asked");
        let effects = |names: &[String]| {
            names.iter().map(|name| name.parse().map_err(place)).collect::<Result<Vec<EffectName>>>()
        };
        if self.asked.max_error.is_some_and(|error| !(error > 0.0 && error.is_finite())) {
            return Err(place("the error that was asked for is not positive".to_owned()));
        }
        scene.render.budget = self.asked.max_error.map_or(Budget::Samples(1), Budget::MaxError);
        let asked = EffectArguments {
            all_effects: self.asked.all_effects,
            with: effects(&self.asked.with)?,
            without: effects(&self.asked.without)?,
        };
        if !given.is_empty() && !given.asks_the_same(&asked) {
            let error = format!("--replay: that run was made {asked}, this one {given}");
            return Err(Error::new(ErrorKind::Usage, error)
                .in_file(&*self.name)
                .remedy("leave out the flags of effects: a replay takes them from the file"));
        }
        Ok(asked)
    }

    /// What that run was asked for.
    pub(super) fn asked(&self) -> Asked {
        self.asked.clone()
    }

    /// Of effects that the file asks for, and the scene cannot have.
    pub(super) fn blame(&self, error: &Error) -> Error {
        Error::invalid(error.message()).in_file(&*self.name).at_key("asked").remedy(REMEDY)
    }

    /// What the user is told where another version made the picture: no two need draw the same bytes.
    pub(super) fn warning(&self) -> Option<Warning> {
        let ours = env!("CARGO_PKG_VERSION");
        (self.version != ours).then(|| {
            let theirs = if self.version.is_empty() { "of an unknown version" } else { &self.version };
            Warning {
                file: self.name.clone(),
                line: None,
                message: format!(
                    "the picture is of groundglass {theirs}, and this is {ours}: the same bytes are certain only from the same version"
                ),
            }
        })
    }

    /// The samples of the picture that it tells of, if that is of this scene.
    pub(super) fn allocation(self, scene: &Scene) -> Result<Allocation> {
        let place = |error: Error| error.in_file(&*self.name);
        if self.scene_hash != scene.hash() || self.height != scene.render.height {
            return Err(place(
                Error::invalid(
                    "tells of another scene, or of this one before it or one of its files changed",
                )
                .at_key("scene_hash")
                .remedy("replay with the files of that run"),
            ));
        }
        Allocation::from_text(self.width, self.height, &self.allocation)
            .map_err(|error| place(error.at_key("allocation").remedy(REMEDY)))
    }
}
