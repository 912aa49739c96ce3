//! Patches: which triangles look alike up to their outline, found once when a scene is loaded.
//!
//! The cells of a tiled floor, or the two halves of a wall, lie in one plane and continue one another's
//! texture. Where they do to a small part of a texel, samples that see them are shaded together: on the tower
//! scene a pixel's 16 samples then see 1.7 different things instead of 2.5.

use super::mesh::NONE;
use super::quads::Quads;
use super::surfaces::{Surfaces, bounds};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Which triangles shade alike.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    /// The number of each triangle's patch.
    number: Vec<u32>,
    /// Each patch's largest triangle, whose plane and texture coordinates hold for all of it.
    reference: Vec<u32>,
    /// Whether each lies in one plane.
    flat: bool,
    /// How many vertices there were.
    vertices: usize,
    /// Triangles of a patch that are drawn two at a time.
    pub(crate) quads: Quads,
}

/// Most difference between a triangle's own texture coordinates and its patch's, in texels.
const TOLERANCE: f64 = 1.0 / 64.0;

/// Most difference between unit normals.
const NORMALS: f64 = 1e-5;

/// Most distance from the plane of a patch that shall lie in one, over the scene's extent: coordinates are rounded.
const PLANE: f64 = 1e-7;

/// The same over the longest side of the triangle that is to belong to it: a sheet of paper on a table is no part of the table, however
/// large the scene.
const STEP: f64 = 1e-4;

/// Different patches whose triangles got the same key, at most; what is left stays single.
const ROUNDS: usize = 8;

/// A flat triangle's surface.
struct Flat {
    material: u32,
    /// By which it is lit, of its vertices if they have one: it need not be square to the triangle.
    normal: DVec3,
    /// Square to the triangle.
    face: DVec3,
    corners: [DVec3; 3],
    texture: Option<Texture>,
}

/// Its texture coordinates as an affine function of place.
struct Texture {
    uv: [DVec2; 3],
    /// How `u` and `v` change along the plane.
    gradient: [DVec3; 2],
    /// Texels on each side.
    size: DVec2,
}

impl Patches {
    /// Whether each patch lies in one plane, as triangles by themselves do.
    pub(crate) fn are_flat(&self) -> bool {
        self.flat || self.is_empty()
    }

    /// Whether each triangle is a patch by itself.
    pub(crate) fn is_empty(&self) -> bool {
        self.number.is_empty()
    }

    /// How many patches there are.
    pub(crate) fn parts(&self) -> usize {
        self.reference.len()
    }

    /// Whether they are empty, or were made of so many triangles and vertices.
    pub(super) fn are_of(&self, triangles_and_vertices: [usize; 2]) -> bool {
        self.is_empty() || [self.number.len(), self.vertices] == triangles_and_vertices
    }

    /// The patch of triangle `t` and the triangle that stands for it.
    pub(crate) fn of(&self, t: u32) -> (u32, u32) {
        match self.number.get(t as usize) {
            Some(&patch) => (patch, self.reference[patch as usize]),
            None => (t, t),
        }
    }

    /// With `coplanar`, patches lie in one plane even where only their normals show.
    pub(crate) fn new(surfaces: &Surfaces, coplanar: bool) -> Self {
        let count = surfaces.triangles.len();
        let [low, high] = bounds(surfaces.positions.iter().copied());
        let (center, extent) = (0.5 * (low + high), (high - low).max_element());
        let thickness = if coplanar { PLANE * extent } else { f64::INFINITY };
        let mut keyed: Vec<(u64, u32)> = (0..count)
            .into_par_iter()
            .filter_map(|t| Some((Flat::new(surfaces, t)?.key(center, extent, coplanar), t as u32)))
            .collect();
        keyed.par_sort_unstable();

        let followers: Vec<(u32, u32)> = keyed
            .par_chunk_by(|a, b| a.0 == b.0)
            .filter(|run| run.len() > 1)
            .flat_map_iter(|run| followers(surfaces, run.iter().map(|&(_, t)| t), thickness))
            .collect();
        let mut leader: Vec<u32> = (0..count as u32).collect();
        followers.into_iter().for_each(|(t, reference)| leader[t as usize] = reference);
        let mut number = vec![NONE; count];
        let mut reference = Vec::new();
        let of = leader
            .into_iter()
            .map(|leader| {
                let number = &mut number[leader as usize];
                if *number == NONE {
                    *number = reference.len() as u32;
                    reference.push(leader);
                }
                *number
            })
            .collect::<Vec<_>>();
        let quads = Quads::new(surfaces, &of);
        Self { number: of, reference, flat: coplanar, vertices: surfaces.positions.len(), quads }
    }
}

/// Which of these triangles continue a larger one, and which.
fn followers(surfaces: &Surfaces, triangles: impl Iterator<Item = u32>, thickness: f64) -> Vec<(u32, u32)> {
    let flat = |t: u32| Some((t, Flat::new(surfaces, t as usize)?));
    let mut rest: Vec<(u32, Flat)> = triangles.filter_map(flat).collect();
    let mut found = Vec::new();
    for _ in 0..ROUNDS {
        let largest = rest.iter().enumerate().max_by(|a, b| a.1.1.area().total_cmp(&b.1.1.area()));
        let Some((at, _)) = largest else { break };
        let (reference, surface) = rest.swap_remove(at);
        rest.retain(|(t, flat)| {
            let same = surface.continues(flat, thickness);
            if same {
                found.push((*t, reference));
            }
            !same
        });
    }
    found
}

impl Flat {
    /// `None` for triangles with a smooth normal, with holes or without area.
    fn new(surfaces: &Surfaces, t: usize) -> Option<Self> {
        let attributes = &surfaces.attributes[t];
        let material = &surfaces.materials[attributes.material as usize];
        if material.is_cutout() {
            return None;
        }
        let corners = surfaces.corners(t);
        let (a, b) = (corners[1] - corners[0], corners[2] - corners[0]);
        let across = a.cross(b);
        let face = crate::camera::unit(across)?;
        let normal = match attributes.normals {
            [NONE, ..] => face,
            [i, j, k] => {
                let n = [i, j, k].map(|i| surfaces.normals[i as usize]);
                if n[0] != n[1] || n[1] != n[2] {
                    return None;
                }
                crate::camera::unit(n[0].as_dvec3())?
            }
        };
        let texture = match &material.diffuse_map {
            Some(map) if attributes.texcoords[0] != NONE => {
                let uv = attributes.texcoords.map(|i| surfaces.texcoords[i as usize].as_dvec2());
                let (by_a, by_b) = (uv[1] - uv[0], uv[2] - uv[0]);
                // The basis dual to the two edges in their plane.
                let square = across.length_squared();
                let (ga, gb) = (b.cross(across) / square, across.cross(a) / square);
                let gradient = [0, 1].map(|c| ga * by_a[c] + gb * by_b[c]);
                let level = map.levels.first()?;
                let size = DVec2::new(f64::from(level.width), f64::from(level.height));
                if !gradient.iter().all(|g| g.is_finite()) {
                    return None;
                }
                Some(Texture { uv, gradient, size })
            }
            _ => None,
        };
        Some(Self { material: attributes.material, normal, face, corners, texture })
    }

    fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).length()
    }

    /// A number that triangles of one patch mostly share; [`Self::continues`] decides.
    fn key(&self, center: DVec3, extent: f64, coplanar: bool) -> u64 {
        let mut key = u64::from(self.material);
        // Off the round numbers that modelled scenes are full of.
        let mut mix = |x: f64, step: f64| {
            let cell = (x / step + 0.381_966).floor() as i64;
            // A fixed mixing function (multiplier of Steele and Vigna's, 2021): the picture depends on it.
            key = (key.rotate_left(23) ^ cell as u64).wrapping_mul(0xd134_2543_de82_ef95);
            key ^= key >> 29;
        };
        self.normal.to_array().into_iter().for_each(|n| mix(n, 1e-2));
        if coplanar || self.texture.is_some() {
            mix(self.normal.dot(self.corners[0] - center), 1e-5 * extent);
        }
        if let Some(texture) = &self.texture {
            for (c, gradient) in texture.gradient.iter().enumerate() {
                let at_center = texture.uv[0][c] + gradient.dot(center - self.corners[0]);
                mix(at_center - at_center.floor(), 1.0 / 32.0);
                let largest = gradient.abs().max_element();
                mix(libm::log2(largest), 1.0 / 16.0);
                gradient.to_array().into_iter().for_each(|g| mix(g / largest, 0.05));
            }
        }
        key
    }

    /// Whether `other`, which is smaller, looks like this surface continued, and lies no farther from its plane than `thickness` and
    /// [`STEP`] allow.
    fn continues(&self, other: &Self, thickness: f64) -> bool {
        if other.material != self.material || (self.normal - other.normal).abs().max_element() > NORMALS {
            return false;
        }
        let across = (self.corners[1] - self.corners[0]).cross(self.corners[2] - self.corners[0]);
        let [a, b, c] = other.corners;
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let most = thickness.min(STEP * longest) * across.length();
        let is_far = |corner: &DVec3| (corner - self.corners[0]).dot(across).abs() > most;
        if thickness.is_finite() && other.corners.iter().any(is_far) {
            return false;
        }
        match (&self.texture, &other.texture) {
            (None, None) => true,
            (Some(own), Some(texture)) => (0..3).all(|corner| {
                let step = other.corners[corner] - self.corners[0];
                (0..2).all(|c| {
                    let off = own.uv[0][c] + own.gradient[c].dot(step) - texture.uv[corner][c];
                    // Whole turns of the texture do not show.
                    let off = (off - (off + 0.5).floor()).abs();
                    let plane = self.face.dot(step).abs() * own.gradient[c].length();
                    (off + plane) * own.size[c] <= TOLERANCE
                })
            }),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Attributes, Level, Material, Texture as Picture};
    use glam::{Vec2, Vec2Swizzles};
    use std::sync::Arc;

    /// A floor of 5 x 4 cells, each with the texture once, every second one turned around its diagonal.
    fn floor(turned: bool) -> Surfaces {
        let picture = Level { width: 8, height: 8, texels: vec![[u16::MAX; 4]; 64] };
        let material = Material {
            diffuse_map: Picture::from_level(picture).map(Arc::new),
            ..Material::default_surface()
        };
        let mut surfaces = Surfaces { materials: vec![material], ..Surfaces::default() };
        for cell in 0..20 {
            let (x, z) = (f64::from(cell % 5), f64::from(cell / 5));
            let first = surfaces.positions.len() as u32;
            for (dx, dz) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                surfaces.positions.push(DVec3::new(0.3 * (x + dx), 0.7, 0.3 * (z + dz)));
                let uv = Vec2::new(dx as f32, dz as f32 - 3.0);
                surfaces.texcoords.push(if turned && cell == 7 { uv.yx() } else { uv });
            }
            for corners in [[0, 1, 2], [0, 2, 3]].map(|c: [u32; 3]| c.map(|i| i + first)) {
                surfaces.triangles.push(corners);
                surfaces.attributes.push(Attributes { normals: [NONE; 3], texcoords: corners, material: 0 });
            }
        }
        surfaces
    }

    #[test]
    fn the_cells_of_a_floor_are_one_patch() {
        let patches = Patches::new(&floor(false), false);
        assert_eq!(patches.reference.len(), 1);
        assert!(patches.number.iter().all(|&patch| patch == 0));
    }

    #[test]
    fn a_cell_that_is_laid_otherwise_is_not() {
        let patches = Patches::new(&floor(true), false);
        assert_eq!(patches.reference.len(), 2);
        assert_eq!(patches.number[14], patches.number[15]);
        assert_ne!(patches.number[14], patches.number[0]);
    }

    #[test]
    fn a_step_in_the_floor_parts_it() {
        let mut surfaces = floor(false);
        for position in &mut surfaces.positions[..20] {
            position.y += 1e-3;
        }
        assert_eq!(Patches::new(&surfaces, false).reference.len(), 2);
    }

    /// Its normals say that it is level, and its texture lies as on the floor, seen from above.
    #[test]
    fn a_ramp_is_no_part_of_the_floor_whatever_its_normals_say() {
        let mut surfaces = floor(false);
        for position in surfaces.positions.iter_mut().filter(|position| position.z > 0.59) {
            position.y -= 0.02 * (position.z - 0.6);
        }
        let parts = Patches::new(&surfaces, false).reference.len();
        surfaces.normals.push(DVec3::Y.as_vec3());
        surfaces.attributes.iter_mut().for_each(|attributes| attributes.normals = [0; 3]);
        let Patches { number: of, .. } = Patches::new(&surfaces, false);
        let (floor, ramp) = of.split_at(20);
        assert!(floor.iter().all(|patch| *patch == floor[0] && !ramp.contains(patch)), "{of:?}");
        assert_eq!(parts, 2);
    }

    #[test]
    fn a_sheet_on_a_table_is_no_part_of_it_in_a_large_scene() {
        let mut surfaces = Surfaces { materials: vec![Material::default_surface()], ..Surfaces::default() };
        let mut square = |side: f64, x: f64, y: f64| {
            let first = surfaces.positions.len() as u32;
            let corners = [(0.0, 0.0), (side, 0.0), (side, -side), (0.0, -side)];
            surfaces.positions.extend(corners.map(|(dx, dz)| DVec3::new(x + dx, y, dz)));
            for corners in [[0, 1, 2], [0, 2, 3]].map(|c: [u32; 3]| c.map(|i| i + first)) {
                surfaces.triangles.push(corners);
                let attributes = Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material: 0 };
                surfaces.attributes.push(attributes);
            }
        };
        // Far away something else; on the table a sheet of a tenth of a millimetre, and another as far above it as its coordinates are
        // rounded.
        square(2.0, 0.0, 0.0);
        square(0.3, 0.5, 1e-4);
        square(0.3, 1.0, 1e-6);
        square(1.0, 1e5, 0.0);
        let patches = Patches::new(&surfaces, true);
        assert!(
            patches.number[2] == patches.number[3] && patches.number[2] != patches.number[0],
            "{:?}",
            patches.number
        );
        assert_eq!(patches.number[4], patches.number[0]);
    }
}
