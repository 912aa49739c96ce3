//! From files to a scene, nothing left to look up.
//!
//! The scene file: `document` (TOML with places) -> `shape` (against the schema) -> `file` (the mirror
//! structs) -> `validate` (a [`SceneDescription`]: units converted, defaults filled, every wrong value
//! refused with its line) -> `resolve` (movements solved). Its assets: `source` (the one door to files) ->
//! `records`, `normalize`, `obj`, `mtl`, `triangulate`, `decode`, `texture`, `mip`, `outline` -> `reading` -> `assets` (a [`Model`]). Both:
//! `load` (a [`Scene`] with its `surfaces` in the world, and which of them look alike: `patches`, and are drawn as one: `quads`).

mod assets;
mod clusters;
mod decode;
mod description;
mod digest;
mod document;
mod effects;
mod file;
mod hierarchy;
mod library;
mod load;
mod material;
mod mesh;
mod mip;
mod mtl;
mod normalize;
mod obj;
pub(crate) mod outline;
mod patches;
mod pictures;
mod quads;
mod reading;
mod records;
mod resolve;
mod rewrite;
mod schema;
mod shape;
mod smooth;
mod source;
mod source_files;
pub mod starter;
mod starter_measure;
mod starter_view;
mod sunlight;
mod surfaces;
mod text;
mod texture;
mod triangulate;
mod validate;
mod validate_camera;
mod warnings;

pub use assets::AssetLoader;
pub use clusters::Clusters;
pub use decode::is_decoding;
pub use description::{
    Blades, Budget, Focus, MAX_PICTURE_SIDE, MeshEntry, RenderSettings, SceneDescription, Sky, Sun,
};
pub use document::{Document, SIZE_LIMIT};
pub use effects::{EffectChoice, EffectName, EffectSet};
pub use file::{SceneFile, parse};
pub(crate) use hierarchy::DEPTH;
pub use hierarchy::Hierarchy;
pub use load::{LoadSettings, MeshSummary, PictureSettings, Scene};
pub use material::{Mapping, Material};
pub use mesh::{Model, NONE, Triangle};
pub use patches::Patches;
pub use reading::Progress;
pub use rewrite::with_movements;
pub use schema::schema;
pub use source::{Memory, Source};
pub use source_files::Files;
pub use surfaces::{Attributes, Placement, Surfaces};
pub use texture::{Level, Texture};

// What figure files share with scene files.
pub(crate) use file::{CameraTable, FocusTable, MeshTable, PlaneTable, RenderTable, SceneTables, SkyTable};
pub(crate) use outline::Outline;
pub(crate) use schema::of as schema_of;
pub(crate) use shape::{check as check_shape, nearest};
pub(crate) use smooth::Smooth;
pub(crate) use surfaces::{BRIGHTEST, bounds};

#[cfg(test)]
mod tests;
