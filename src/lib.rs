//! groundglass: one exact model of a view camera.

pub mod camera;
pub mod error;
pub mod geometry;
pub mod optics;
pub mod quantity;
pub mod sampling;
pub mod scene;
