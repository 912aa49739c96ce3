//! The last step before optics: the camera with its focus target reached. In: a description; out: a camera
//! whose movements and extension are final, or the error at the target's line.

use super::description::SceneDescription;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::optics;

impl SceneDescription {
    /// The camera with movements and extension solved for, where the file has a focus target; else as it stands.
    ///
    /// # Errors
    /// [`NoSolution`](crate::error::ErrorKind::NoSolution) when no movement reaches the target; it names the target's
    /// line and the nearest plane that can be had.
    pub fn solve(&self) -> Result<Camera> {
        let Some(focus) = &self.focus else { return Ok(self.camera) };
        optics::solve(&self.camera, &focus.target, focus.adjust)
            .map_err(|unsolvable| Error::from(unsolvable).at(focus.place.clone()))
    }
}
