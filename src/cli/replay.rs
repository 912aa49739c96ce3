//! `render --replay STATS`: an earlier run's numbers of samples, so that its picture can be made again.

use groundglass::error::{Error, ErrorKind, Result};
use groundglass::picture::Allocation;
use groundglass::scene::Scene;
use serde::Deserialize;
use std::io::Read;
use std::path::Path;

/// The most bytes of a file of numbers: some 50 for each of the blocks of the largest picture are far less.
const MOST_BYTES: u64 = 256 << 20;

/// What is needed of a `--stats` file.
#[derive(Deserialize)]
pub(super) struct Replay {
    pub(super) width: u32,
    height: u32,
    allocation: String,
    scene_hash: String,
    #[serde(skip)]
    name: String,
}

impl Replay {
    /// Reads a `--stats` file.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let missing = |error: std::io::Error| {
            let kind = match error.kind() {
                std::io::ErrorKind::NotFound => ErrorKind::Invalid,
                _ => ErrorKind::Io,
            };
            Error::new(kind, format!("cannot be read: {error}")).in_file(&*name)
        };
        let is_file = std::fs::metadata(path).map_err(missing)?.is_file();
        if !is_file {
            return Err(Error::invalid("is not a regular file").in_file(&*name));
        }
        let mut text = String::new();
        let file = std::fs::File::open(path).map_err(missing)?;
        file.take(MOST_BYTES).read_to_string(&mut text).map_err(missing)?;
        let found: Self = serde_json::from_str(&text).map_err(|error| {
            Error::invalid(format!("is not what render --stats writes: {error}"))
                .in_file(&*name)
                .remedy("give the file that --stats wrote beside the picture")
        })?;
        Ok(Self { name, ..found })
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
            .map_err(|error| place(error.at_key("allocation")))
    }
}
