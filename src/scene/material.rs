//! A material as shading takes it: an MTL's values in, checked numbers and decoded maps out.

use std::sync::Arc;

use super::texture::Texture;
use glam::DVec2;

/// Diffuse reflectance where neither the OBJ nor the MTL says anything.
const DEFAULT_DIFFUSE: f32 = 0.8;

/// Where a picture lies on a surface: its coordinates are `scale uv + offset`, repeats of the picture, v up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapping {
    /// `-s` of a map.
    pub scale: DVec2,
    /// `-o` of a map.
    pub offset: DVec2,
}

impl Mapping {
    /// Where nothing is said.
    pub const IDENTITY: Self = Self { scale: DVec2::ONE, offset: DVec2::ZERO };

    /// The picture's coordinates.
    pub fn at(&self, uv: DVec2) -> DVec2 {
        self.scale * uv + self.offset
    }

    /// What gives these coordinates from those of another mapping; none where that one forgets some.
    pub(crate) fn after(&self, other: &Self) -> Option<Self> {
        let scale = self.scale / other.scale;
        Some(Self { scale, offset: self.offset - scale * other.offset })
            .filter(|m| m.scale.is_finite() && m.offset.is_finite())
    }

    /// Whether so many repeats of the coordinates are whole repeats of the picture.
    pub(crate) fn keeps(&self, repeats: f64) -> bool {
        let turns = self.scale * repeats;
        turns == turns.round()
    }
}

/// How a surface looks.
///
/// # Guarantees
/// Every number is finite, colours and coverage are not negative, and `coverage` is at most 1.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the MTL; empty for the default material.
    pub name: String,
    /// `Kd`, linear light.
    pub diffuse: [f32; 3],
    /// `Ke`, linear light.
    pub emission: [f32; 3],
    /// `map_Kd`: linear light and opacity.
    pub diffuse_map: Option<Arc<Texture>>,
    /// `map_d`: its opacity is texel component 3.
    pub opacity_map: Option<Arc<Texture>>,
    /// Where `map_d` lies by the coordinates that place `map_Kd`.
    pub opacity_mapping: Mapping,
    /// `d`, or 1 - `Tr`: the share of rays that meet the surface.
    pub coverage: f32,
}

impl Material {
    /// What a face without a material has.
    pub fn default_surface() -> Self {
        Self {
            name: String::new(),
            diffuse: [DEFAULT_DIFFUSE; 3],
            emission: [0.0; 3],
            diffuse_map: None,
            opacity_map: None,
            opacity_mapping: Mapping::IDENTITY,
            coverage: 1.0,
        }
    }

    /// Leaves out what a user does not want to see: a map's colours become their mean, its holes and the material's
    /// coverage are filled.
    pub(crate) fn leave_out(&mut self, textures: bool, holes: bool, coverage: bool) {
        if coverage {
            self.coverage = 1.0;
        }
        if holes {
            self.opacity_map = None;
            if let Some(map) = self.diffuse_map.as_mut().filter(|map| map.has_holes) {
                *map = Arc::new(map.without_holes());
            }
        }
        if textures && let Some(map) = &self.diffuse_map {
            let mean = map.mean();
            self.diffuse = std::array::from_fn(|i| self.diffuse[i] * mean[i]);
            // Its holes stay, and those of the other map.
            let holed = self.diffuse_map.take().filter(|map| map.has_holes);
            match (&self.opacity_map, holed) {
                (Some(opacity), Some(map)) if opacity.has_holes => {
                    self.diffuse_map = Some(Arc::new(map.white()))
                }
                (_, Some(map)) => {
                    self.opacity_map = Some(map);
                    self.opacity_mapping = Mapping::IDENTITY;
                }
                (_, None) => {}
            }
        }
    }

    /// The maps whose alpha decides where light passes through, and where they lie.
    pub(crate) fn holed_maps(&self) -> impl Iterator<Item = (&Arc<Texture>, Mapping)> {
        let maps = [(&self.diffuse_map, Mapping::IDENTITY), (&self.opacity_map, self.opacity_mapping)];
        maps.into_iter()
            .filter_map(|(map, mapping)| Some((map.as_ref()?, mapping)))
            .filter(|(map, _)| map.has_holes)
    }

    /// Whether anything is read from a picture.
    pub(crate) fn has_map(&self) -> bool {
        self.diffuse_map.is_some() || self.opacity_map.is_some()
    }

    /// Whether light can pass through somewhere.
    pub(crate) fn is_cutout(&self) -> bool {
        self.coverage < 1.0 || self.holed_maps().next().is_some()
    }

    /// The diffuse reflectance of a material without `Kd`: the map's own where there is one.
    pub(crate) fn diffuse_without_kd(has_map: bool) -> [f32; 3] {
        [if has_map { 1.0 } else { DEFAULT_DIFFUSE }; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn holes_stay_where_colours_are_left_out() {
        let texture = |texel: [u16; 4]| {
            let texels = vec![texel, [0, 0, 0, u16::MAX]];
            Arc::new(Texture::from_level(Level { width: 2, height: 1, texels }).unwrap())
        };
        let (holed, whole) = (texture([u16::MAX, 0, 0, 0]), texture([u16::MAX; 4]));
        for (opacity, holes) in [(None, 1), (Some(&whole), 1), (Some(&holed), 2)] {
            let (diffuse_map, opacity_map) = (Some(Arc::clone(&holed)), opacity.cloned());
            let own = Mapping { scale: DVec2::new(2.0, 3.0), ..Mapping::IDENTITY };
            let opacity_mapping = own;
            let mut material =
                Material { diffuse_map, opacity_map, opacity_mapping, ..Material::default_surface() };
            material.leave_out(true, false, false);
            let mappings: Vec<_> = material.holed_maps().map(|(_, mapping)| mapping).collect();
            assert_eq!(mappings, [Mapping::IDENTITY, own][..holes]);
            let is_white =
                |map: &Arc<Texture>| map.levels[0].texels.iter().all(|texel| texel[..3] == [u16::MAX; 3]);
            assert!(material.diffuse_map.as_ref().is_none_or(is_white));
        }
    }
}
