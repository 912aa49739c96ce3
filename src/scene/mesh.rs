//! A mesh as the renderer takes it: nothing left to look up, check or triangulate.

use glam::{DVec3, Vec2, Vec3};

use super::material::Material;

/// Stands for an absent index.
pub const NONE: u32 = u32::MAX;

/// One triangle: indices into the lists of its [`Model`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Into [`Model::positions`].
    pub positions: [u32; 3],
    /// Into [`Model::normals`], or all three [`NONE`].
    pub normals: [u32; 3],
    /// Into [`Model::texcoords`], or all three [`NONE`].
    pub texcoords: [u32; 3],
    /// Into [`Model::materials`].
    pub material: u32,
}

/// What one OBJ gives, in its own frame and unit (the scene places it in the world).
///
/// # Guarantees
/// Every index is in range or [`NONE`] as [`Triangle`] says; every number is finite; normals are not zero;
/// there is at least one triangle, and a polygon of k corners gave k - 2 of them.
#[derive(Clone, Debug)]
pub struct Model {
    /// The vertices that faces use, in the OBJ's unit.
    pub positions: Vec<DVec3>,
    /// As in the file: not zero, but not always unit.
    pub normals: Vec<Vec3>,
    /// u to the right, v up; the `-s` and `-o` of a material's maps are applied already.
    pub texcoords: Vec<Vec2>,
    /// The faces, cut up, in the file's order.
    pub triangles: Vec<Triangle>,
    /// Those that faces use; the default one, if faces lack a material, comes last.
    pub materials: Vec<Material>,
    /// How many of [`Model::materials`] the file names (all but the default one).
    pub named_materials: usize,
    /// Distinct texture files decoded for it.
    pub textures: usize,
    /// Least and greatest corner of the vertices that faces use.
    pub bounds: [DVec3; 2],
    /// SHA-256 over the bytes of the OBJ, its MTLs and its textures, in a fixed order; paths do not enter.
    pub digest: [u8; 32],
}
