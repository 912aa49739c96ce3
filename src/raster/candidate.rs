//! A triangle, or a quad, that touches the picture.
//!
//! In: what [`super::bin`] finds. Out: a [`Candidate`], which [`super::waiting`] sets up, and a [`Brief`], which
//! [`super::loose_queue`] lists.

use super::vertex_boxes::PixelBox;

/// Two triangles of a surface that no sample passes through, and that together are a convex plane quadrilateral.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quad {
    /// Its corners in turn, as numbers of vertices.
    pub corners: [u32; 4],
    /// Whether it is drawn where this half comes, or the other.
    pub is_first: bool,
}

/// A triangle that may be seen, or a quad, with all that tiles ask of it: they come by in the order of depth, so each place more that
/// they would have to look at is one that memory has to bring. Half a line of the cache, never in two.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(crate) struct Candidate {
    /// Its number in the scene.
    pub triangle: u32,
    /// The depth of its nearest corner; 0 behind the lens.
    pub least_z: f32,
    /// Its corners, as numbers of vertices, of a quad three.
    pub vertices: [u32; 3],
    /// Its surface, and above that [`Candidate::INSIDE`], [`Candidate::CUTOUT`] and [`Candidate::QUAD`].
    pub(super) surface: u32,
    /// The pixels that it can reach from the first cell of the lens.
    pub(super) pixels: PixelBox,
}

/// Numbers of surfaces are less than this.
pub(crate) const MOST_SURFACES: usize = 1 << 29;

impl Candidate {
    pub(super) const INSIDE: u32 = 1 << 31;
    pub(super) const CUTOUT: u32 = 1 << 30;
    pub(super) const QUAD: u32 = 1 << 29;

    /// The surface that it is part of. Which surface is seen is all that is told of a sample.
    #[inline(always)]
    pub(crate) fn surface(&self) -> u32 {
        self.surface & !(Self::INSIDE | Self::CUTOUT | Self::QUAD)
    }

    /// Whether all of its corners lie in the frustum.
    #[inline(always)]
    pub(crate) fn is_inside(&self) -> bool {
        self.surface & Self::INSIDE != 0
    }

    /// Whether it has a fourth corner: see [`super::waiting`].
    #[inline(always)]
    pub(crate) fn is_quad(&self) -> bool {
        self.surface & Self::QUAD != 0
    }

    /// Whether samples may pass through it.
    #[inline(always)]
    pub(crate) fn is_cutout(&self) -> bool {
        self.surface & Self::CUTOUT != 0
    }
}

/// What a tile asks of a candidate when it lists it: they come by in the order of depth, and lie in it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Brief {
    /// Its number among the candidates.
    pub number: u32,
    pub triangle: u32,
    pub surface: u32,
    pub least_z: f32,
}
