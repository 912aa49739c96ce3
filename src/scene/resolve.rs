//! From a description to optics: movements solved.

use super::description::SceneDescription;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::optics::{self, Optics};

impl SceneDescription {
    /// The camera with its movements solved for the focus target, if there is one.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::NoSolution`] with the target's line when no movement does it, or with the camera's when
    /// it cannot exist.
    pub fn solve(&self) -> Result<Camera> {
        match &self.focus {
            Some(focus) => optics::solve(&self.camera, &focus.target, focus.adjust)
                .map_err(|unsolvable| Error::from(unsolvable).at(focus.place.clone())),
            None => Ok(self.camera),
        }
    }

    /// The optics of [`Self::solve`].
    ///
    /// # Errors
    /// As there.
    pub fn optics(&self) -> Result<Optics> {
        Optics::new(&self.solve()?).map_err(|error| {
            let key = error.place().key.clone().unwrap_or_else(|| "camera".to_owned());
            let mut placed = Error::new(error.kind(), error.message()).at(self.document.place(&key));
            if let Some(remedy) = error.remedy_text() {
                placed = placed.remedy(remedy);
            }
            placed
        })
    }
}
