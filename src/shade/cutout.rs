//! Holes and coverage: which of a batch's samples in a region meet a surface that may let them through.
//!
//! In: samples that meet a surface, from `raster::regions` by way of `render::draw`, and its look. Out: the same, without those
//! that pass. Where these look comes from [`super::coordinates`], the level from [`super::mip_level`], alpha from [`super::fetch`].
//!
//! A sample passes where the filtered alpha of `map_Kd` or `map_d` is below a half, and by chance where the material's coverage
//! is below 1 (`chance(pixel, triangle, sample) >= coverage`): each surface decides by itself, each sample for itself.

use super::Shader;
use super::coordinates::Coordinates;
use super::fetch::holes;
use super::lanes::of_first;
use super::look::{Look, Placed};
use super::mip_level::{self, Choice};
use crate::raster::batch::Batch;
use crate::raster::visit::Hit;
use crate::sampling::{chance, hash};
use crate::scene::{Mapping, Texture};
use crate::simd::at_level;
use fearless_simd::{Level, Simd, SimdBase, f32x16};
use glam::Vec2;

impl Shader<'_> {
    /// Leaves of `hits`, samples of a batch that meet the surface of `look`, triangle number `triangle`, those lanes that it does not
    /// let through. `corner` gives the place of a block's corner from the tile's centre, `key` names the pixel of a lane there.
    pub(crate) fn alpha_test(
        &self,
        level: Level,
        (look, triangle): (&Look, u32),
        batch: &Batch,
        hits: &mut [Hit],
        corner: impl Fn(u16) -> Vec2,
        key: impl Fn(u16, usize) -> u64,
    ) {
        let material = &self.materials[look.material as usize];
        if let Some(texture) = &look.texture {
            for (map, mapping) in material.holed_maps() {
                let own = look.opacity.as_deref().filter(|_| mapping != Mapping::IDENTITY);
                at_level!(level, simd => keep_opaque(simd, map, own.unwrap_or(texture), batch, hits, &corner));
            }
        }
        if material.coverage < 1.0 {
            for hit in hits {
                let mut rest = hit.lanes;
                while rest != 0 {
                    let lane = rest.trailing_zeros() as usize;
                    rest &= rest - 1;
                    let key = hash(key(hit.block, lane), u64::from(triangle));
                    if chance(batch.index[lane], key) >= material.coverage {
                        hit.lanes &= !(1 << lane);
                    }
                }
            }
        }
    }
}

/// Leaves the lanes that look at no hole of a texture.
#[inline(always)]
fn keep_opaque<S: Simd>(
    simd: S,
    map: &Texture,
    placed: &Placed,
    batch: &Batch,
    hits: &mut [Hit],
    corner: &impl Fn(u16) -> Vec2,
) {
    let coordinates = Coordinates::of_batch(simd, &placed.functions, batch);
    let size = mip_level::size(map);
    for hit in hits {
        let corner = corner(hit.block);
        let spots = coordinates.at(simd, f32x16::splat(simd, corner.x), f32x16::splat(simd, corner.y));
        let at = spots.usable(simd);
        let levels = mip_level::alpha_levels(simd, coordinates.width_squared(&spots, size));
        let mut rest = hit.lanes;
        while rest != 0 {
            let (level, same) = of_first(simd, levels, rest);
            rest &= !same;
            if let Some(choice) = Choice::alpha(map, level, placed.anchor) {
                hit.lanes &= !holes(simd, choice, at, same);
            }
        }
    }
}
