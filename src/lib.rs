//! groundglass: one exact model of a view camera.

pub mod camera;
pub mod diagram;
pub mod error;
pub mod geometry;
pub mod optics;
pub mod picture;
pub mod plan;
pub mod quantity;
mod raster;
pub mod render;
pub mod sampling;
pub mod scene;
mod shade;

pub use glam;
