//! Holes and coverage: which of a batch's samples at a block meet a surface that may let them through.
//!
//! A sample passes where the filtered alpha of `map_Kd` or `map_d` is below a half, and by chance where the
//! material's coverage is below 1: each surface decides by itself, each sample for itself.

use super::Shader;
use super::coordinates::Coordinates;
use super::filter::{self, Choice};
use super::gather::holes;
use super::look::Look;
use super::texels::of_first;
use crate::raster::view::Batch;
use crate::sampling::{chance, hash};
use crate::scene::Material;
use crate::simd::at_level;
use fearless_simd::{Level, Simd, SimdBase, f32x16};
use glam::Vec2;

impl Shader<'_> {
    /// The lanes of `lanes` that meet the surface of `look`, triangle number `triangle`, in the block with its
    /// corner at `corner` from the tile's centre. `key` names the pixel of a lane.
    pub(crate) fn met(
        &self,
        level: Level,
        look: &Look,
        triangle: u32,
        (batch, corner): (&Batch, Vec2),
        lanes: u16,
        key: impl Fn(usize) -> u64,
    ) -> u16 {
        let material = &self.surfaces.materials[look.material as usize];
        let mut met = lanes;
        if look.texture.is_some() && material.holed_maps().next().is_some() {
            met = at_level!(level, simd => solid(simd, material, look, batch, corner, lanes));
        }
        if material.coverage < 1.0 {
            let mut rest = met;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let key = hash(key(lane), u64::from(triangle));
                if chance(batch.index[lane], key) >= material.coverage {
                    met &= !(1 << lane);
                }
            }
        }
        met
    }
}

/// The lanes that look at no hole.
#[inline(always)]
fn solid<S: Simd>(simd: S, material: &Material, look: &Look, batch: &Batch, corner: Vec2, lanes: u16) -> u16 {
    let Some(functions) = &look.texture else { return lanes };
    let coordinates = Coordinates::of_batch(simd, functions, batch);
    let spots = coordinates.at(simd, f32x16::splat(simd, corner.x), f32x16::splat(simd, corner.y));
    let at = spots.usable(simd);
    let mut met = lanes;
    for map in material.holed_maps() {
        let levels = filter::alpha_levels(simd, coordinates.shorter_side_squared(&spots, filter::size(map)));
        let mut rest = met;
        while rest != 0 {
            let (level, same) = of_first(simd, levels, rest);
            rest &= !same;
            if let Some(choice) = Choice::alpha(map, level, look.anchor) {
                met &= !holes(simd, choice, at, same);
            }
        }
    }
    met
}
