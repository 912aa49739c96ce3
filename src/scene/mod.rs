//! From files to a scene: `document` (TOML with places) -> `shape` (against the schema) -> `file`
//! (the mirror structs) -> `validate` (a [`SceneDescription`]: units converted, defaults filled,
//! every wrong value refused with its line). The assets a description names are loaded elsewhere.

mod description;
mod document;
mod file;
mod resolve;
mod rewrite;
mod schema;
mod shape;
pub mod starter;
mod validate;
mod validate_camera;

pub use description::{
    Blades, Budget, Focus, MAX_PICTURE_SIDE, MeshEntry, RenderSettings, SceneDescription, Sky, Sun,
};
pub use document::{Document, SIZE_LIMIT};
pub use file::{SceneFile, parse};
pub use rewrite::with_movements;
pub use schema::schema;

#[cfg(test)]
mod tests;
