//! From files to a scene: `document` (TOML with places) -> `shape` (against the schema) -> `file`
//! (the mirror structs) -> `validate` (a [`SceneDescription`]: units converted, defaults filled,
//! every wrong value refused with its line); and from the files it names to models (`source` -> `assets`).

mod description;
mod document;
mod file;
mod schema;
mod shape;
mod source;
pub mod starter;
mod validate;
mod validate_camera;

pub use description::{
    Adjust, Blades, Budget, Focus, FocusTarget, MAX_PICTURE_SIDE, MeshEntry, RenderSettings,
    SceneDescription, Sky, Sun,
};
pub use document::{Document, SIZE_LIMIT};
pub use file::{SceneFile, parse};
pub use schema::schema;
pub use source::{Files, Memory, Source};

#[cfg(test)]
mod tests;
