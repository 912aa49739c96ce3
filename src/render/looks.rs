//! The looks of the surfaces that a tile sees, each made once, when first asked for.
//!
//! In: surfaces by their number in the tile, with one triangle of each (`raster::tile`), from [`super::draw`]. Out: a [`Look`]
//! for each. The formula is that of `shade::look`; here are found the triangle that stands for the surface, and its edge
//! functions (`raster::film`).

use super::prepared::{Prepared, patch};
use crate::raster::film::TileFilm;
use crate::shade::{Look, LookParts};

/// Looks by the number of their surface in the tile.
#[derive(Default)]
pub(super) struct Looks {
    /// One more than the place of each, or 0.
    places: Vec<u32>,
    made: Vec<Look>,
    /// Surfaces that have none, with a triangle of each, and what some of them are made of.
    missing: Vec<(u32, u32)>,
    parts: Vec<LookParts>,
}

impl Looks {
    /// For another tile.
    pub(super) fn clear(&mut self) {
        self.places.clear();
        self.made.clear();
    }

    /// None where it was not made.
    pub(super) fn get(&self, id: u32) -> Option<&Look> {
        let place = *self.places.get(id as usize)?;
        self.made.get((place as usize).checked_sub(1)?)
    }

    fn put(&mut self, id: u32, look: Look) {
        if id as usize >= self.places.len() {
            self.places.resize(id as usize + 1, 0);
        }
        self.made.push(look);
        self.places[id as usize] = self.made.len() as u32;
    }
}

/// So many looks are made together.
const TOGETHER: usize = 16;

impl Prepared<'_> {
    /// Makes the looks of those surfaces `ids` that have none. `triangles` has one triangle of each surface of the tile.
    ///
    /// What they are made of lies anywhere in memory: asked for some at a time, with nothing to work out in between, memory
    /// brings many at once.
    pub(super) fn make_looks(
        &self,
        film: &TileFilm,
        triangles: &[u32],
        ids: impl Iterator<Item = u32>,
        looks: &mut Looks,
    ) {
        looks.missing.clear();
        for id in ids {
            if looks.get(id).is_some() {
                continue;
            }
            looks.missing.extend(triangles.get(id as usize).map(|&triangle| (id, triangle)));
        }
        let mut parts = std::mem::take(&mut looks.parts);
        let missing = std::mem::take(&mut looks.missing);
        for some in missing.chunks(TOGETHER) {
            parts.clear();
            parts.extend(some.iter().map(|&(_, triangle)| self.parts(triangle)));
            for ((id, _), parts) in some.iter().zip(&parts) {
                looks.put(*id, self.look(film, parts));
            }
        }
        (looks.missing, looks.parts) = (missing, parts);
    }

    /// Makes the look of a surface that `triangle`, which may be seen in the tile, is part of, where it has none.
    pub(super) fn make_look(&self, film: &TileFilm, id: u32, triangle: u32, looks: &mut Looks) {
        if looks.get(id).is_none() {
            looks.put(id, self.look(film, &self.parts(triangle)));
        }
    }

    /// What the look of the surface that `triangle`, which may be seen in the tile, is part of is made of.
    fn parts(&self, triangle: u32) -> LookParts {
        let corners = |t: u32| self.surfaces.triangles[t as usize].map(|i| self.positions[i as usize]);
        let (_, reference) = patch(self.surfaces, self.alike, triangle);
        self.shader.parts(reference, corners(reference), corners(triangle))
    }

    fn look(&self, film: &TileFilm, parts: &LookParts) -> Look {
        let mut look = self.shader.look(parts, || film.scaled_edges(parts.corners));
        // Where samples that are shaded together may see either side, each is lit by itself.
        if look.sides_differ() && film.may_see_both(look.face.as_dvec3()) {
            let is_one_plane = parts.normals.is_none() && (!self.alike || self.surfaces.patches.are_flat());
            // Which side it is shadows ask by each sample's ray.
            match film.side(parts.corners).filter(|_| is_one_plane && self.shadows.is_none()) {
                Some(is_away) => look.show(is_away),
                None => look.light_each(),
            }
        }
        look.plane = self.shadows.as_ref().map(|sun| sun.plane(parts.triangle, film.depth(parts.corners)));
        look
    }
}
