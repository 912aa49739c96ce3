//! One visit: a triangle for a batch of 16 samples, as [`super::kernel`] makes it for [`super::regions`] and [`super::scatter`].
//!
//! In the block whose corner lies `x`, `y` pixels from the tile's centre each function is `c0 + x cx + y cy`.

use fearless_simd::{Simd, f32x16, mask32x16};

/// A triangle, or a quad, to be visited for one batch.
pub(crate) struct Visit {
    /// Its number in the scene.
    pub triangle: u32,
    /// What is written where the triangle is seen: the number of its surface in the tile.
    pub id: u32,
    /// The triangle of that surface that the tile met first.
    pub first: u32,
    /// `1/t` of the near plane, as [`TileFilm::near_inverse`], where it may come nearer.
    pub near_inverse: Option<[f32; 3]>,
    /// Samples that meet it may pass through.
    pub cutout: bool,
}

/// Samples of a block that meet a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub block: u16,
    /// Lane 0 in the lowest bit.
    pub lanes: u16,
}

/// Leaves of hits those lanes that the surface of a visit does not let through, by its alpha or by chance.
pub(crate) type AlphaTest<'a> = dyn Fn(&Visit, &mut [Hit]) + 'a;

/// A triangle's functions for 16 lens points: each `c0`, its value at the sample of each lane if its block's corner were the tile's
/// centre, and its change with `x` and `y` in pixels. Inside where `a`, `b` and `c` are not negative, of a quad `d` neither; `z` is
/// `1/t`.
#[derive(Clone, Copy)]
pub(super) struct Functions<S: Simd> {
    pub a: [f32x16<S>; 3],
    pub b: [f32x16<S>; 3],
    pub c: [f32x16<S>; 3],
    pub d: [f32x16<S>; 3],
    pub z: [f32x16<S>; 3],
    /// Lanes that are in use and do not see the triangle edge-on.
    pub live: mask32x16<S>,
    /// The size of a block in pixels.
    pub block_size: (f32, f32),
}
