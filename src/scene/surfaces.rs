//! All meshes of a scene as one list of triangles in the world, ready to draw.

use super::clusters::Clusters;
use super::hierarchy::Hierarchy;
use super::material::{Mapping, Material};
use super::mesh::{Model, NONE};
use super::patches::Patches;
use crate::error::{Error, ErrorKind, Result, memory};
use crate::quantity::Angle;
use glam::{DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Where a mesh stands: `world = translate + Ry(rotate_y) (scale * v)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Metres for one unit of the model; positive.
    pub scale: f64,
    /// Turn about the world's y axis.
    pub rotate_y: Angle,
    /// Metres.
    pub translate: DVec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self { scale: 1.0, rotate_y: Angle::ZERO, translate: DVec3::ZERO }
    }
}

/// What shading needs of a triangle: indices into [`Surfaces`], or [`NONE`] three times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attributes {
    /// Into [`Surfaces::normals`].
    pub normals: [u32; 3],
    /// Into [`Surfaces::texcoords`].
    pub texcoords: [u32; 3],
    /// Into [`Surfaces::materials`].
    pub material: u32,
}

/// The triangles of a scene in world coordinates, metres. Loading makes whole ones; of others [`Surfaces::check`] says whether all that
/// they name is there, without which making patches, clusters, a hierarchy or a [plan](crate::plan::RenderPlan) of them panics.
///
/// Pictures need none of `patches`, `clusters` and `hierarchy`: they save time. What they say of vertices or triangles that have changed
/// since is not true, and neither is the picture: call [`Surfaces::prepare`] again.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Vertex normals, of any length but zero.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, u right and v up.
    pub texcoords: Vec<Vec2>,
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// One for each triangle.
    pub attributes: Vec<Attributes>,
    /// All materials.
    pub materials: Vec<Material>,
    /// Which triangles look alike; empty, or made by [`Surfaces::find_patches`] from all that is here.
    pub patches: Patches,
    /// Boxes of many triangles each, by which pictures pass over what is out of view; empty, or made by [`Surfaces::find_clusters`]
    /// from all that is here: anew, where vertices have moved since.
    pub clusters: Clusters,
    /// For rays to the sun; `None`, or made by [`Surfaces::build_hierarchy`] from all that is here.
    pub hierarchy: Option<Hierarchy>,
}

/// Coordinates beyond this, in metres, are refused: products of a few of them would leave the range of f64.
const FARTHEST: f64 = 1e100;

/// Most of a channel of light, in scene files and material libraries too.
pub(crate) const BRIGHTEST: f32 = 1e9;

/// Whether a vertex lies where products of coordinates stay numbers.
fn is_near(vertex: &DVec3) -> bool {
    // Of what is no number this does not hold.
    vertex.cmple(DVec3::splat(FARTHEST)).all() & vertex.cmpge(DVec3::splat(-FARTHEST)).all()
}

impl Surfaces {
    /// Makes room for models, at most `most` bytes.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] when there is not so much memory.
    pub(crate) fn reserve(&mut self, models: &[Arc<Model>], most: u64) -> Result<()> {
        let count = |of: fn(&Model) -> usize| models.iter().map(|model| of(model)).sum::<usize>();
        let (positions, normals) = (count(|m| m.positions.len()), count(|m| m.normals.len()));
        let (texcoords, triangles) = (count(|m| m.texcoords.len()), count(|m| m.triangles.len()));
        let materials = count(|m| m.materials.len());
        let bytes = positions * size_of::<DVec3>()
            + normals * size_of::<Vec3>()
            + texcoords * size_of::<Vec2>()
            + triangles * (size_of::<[u32; 3]>() + size_of::<Attributes>())
            + materials * size_of::<Material>();
        let mut reserved = || {
            self.positions.try_reserve_exact(positions)?;
            self.normals.try_reserve_exact(normals)?;
            self.texcoords.try_reserve_exact(texcoords)?;
            self.triangles.try_reserve_exact(triangles)?;
            self.attributes.try_reserve_exact(triangles)?;
            self.materials.try_reserve_exact(materials)
        };
        // What finding the patches takes besides, for each triangle: a key, a leader, two lists of flat ones.
        let working = triangles as u64 * 250;
        if bytes as u64 + working > most || reserved().is_err() {
            let sum = memory(bytes as u64 + working);
            let message = format!("the meshes take {sum} together, and there is not so much memory");
            return Err(Error::new(ErrorKind::TooLarge, message).remedy("leave out meshes"));
        }
        Ok(())
    }

    /// Adds a model where `placement` puts it. Patches, clusters and hierarchy, which do not know of it, are dropped: see
    /// [`Surfaces::prepare`].
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] when there are more than 2^32 vertices or triangles in all, [`ErrorKind::Invalid`] when the scale is not
    /// positive and finite, or the placement takes a vertex out of the range of numbers. Nothing is added then.
    pub fn add(&mut self, model: &Model, placement: &Placement) -> Result<()> {
        let counts = [
            self.positions.len() + model.positions.len(),
            self.normals.len() + model.normals.len(),
            self.texcoords.len() + model.texcoords.len(),
            self.triangles.len() + model.triangles.len(),
        ];
        if counts.iter().any(|&count| count >= NONE as usize) {
            return Err(Error::new(ErrorKind::TooLarge, "the scene has more than 2^32 vertices")
                .remedy("leave out a mesh"));
        }
        if !(placement.scale > 0.0 && placement.scale.is_finite()) {
            return Err(Error::invalid(format!("a mesh cannot be scaled by {}", placement.scale))
                .remedy("give a scale that is positive and finite"));
        }
        let (sine, cosine) = placement.rotate_y.sin_cos();
        let rotation =
            DMat3::from_cols(DVec3::new(cosine, 0.0, -sine), DVec3::Y, DVec3::new(sine, 0.0, cosine));
        let first = [self.positions.len(), self.normals.len(), self.texcoords.len(), self.materials.len()];
        let [positions, normals, texcoords, materials] = first.map(|n| n as u32);
        self.positions
            .extend(model.positions.iter().map(|&v| placement.translate + rotation * (v * placement.scale)));
        if !self.positions[positions as usize..].iter().all(is_near) {
            self.positions.truncate(positions as usize);
            return Err(Error::invalid(format!("a vertex lies more than {FARTHEST:e} m from the origin"))
                .remedy("use a smaller scale, or mend the mesh"));
        }
        (self.patches, self.clusters, self.hierarchy) = (Patches::default(), Clusters::default(), None);
        self.normals.extend(model.normals.iter().map(|&n| (rotation * n.as_dvec3()).as_vec3()));
        self.texcoords.extend_from_slice(&model.texcoords);
        self.materials.extend(model.materials.iter().cloned());
        let moved = |indices: [u32; 3], by: u32| indices.map(|i| if i == NONE { NONE } else { i + by });
        for triangle in &model.triangles {
            self.triangles.push(moved(triangle.positions, positions));
            self.attributes.push(Attributes {
                normals: moved(triangle.normals, normals),
                texcoords: moved(triangle.texcoords, texcoords),
                material: triangle.material + materials,
            });
        }
        Ok(())
    }

    /// Whether every triangle has attributes, every number in either names something that is there, vertices, normals, texture coordinates
    /// and materials are numbers that can be drawn, textures have levels with all their texels, and patches, clusters and hierarchy are of
    /// so many triangles.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`] with the first that does not.
    pub fn check(&self) -> Result<()> {
        let (triangles, attributes) = (self.triangles.len(), self.attributes.len());
        if triangles != attributes {
            let message = format!("{triangles} triangles and {attributes} attributes");
            return Err(Error::invalid(message).remedy("give each triangle its own"));
        }
        self.check_numbers()?;
        let made_of = [triangles, self.positions.len()];
        let hierarchy = self.hierarchy.as_ref().is_none_or(|hierarchy| hierarchy.triangles == triangles);
        if !(hierarchy && self.patches.are_of(made_of) && self.clusters.are_of(made_of)) {
            return Err(Error::invalid(
                "patches, clusters or the hierarchy are of other triangles or vertices",
            )
            .remedy("call Surfaces::prepare"));
        }
        // Without branches: with one for each number 47,000 triangles took 0.8 ms, and take 0.2.
        let within = |[a, b, c]: [u32; 3], count: usize| {
            let count = count.min(NONE as usize) as u32;
            (a < count) & (b < count) & (c < count)
        };
        let found = |[a, b, c]: [u32; 3], count: usize| ((a & b & c) == NONE) | within([a, b, c], count);
        let is_whole = |(corners, of): (&[u32; 3], &Attributes)| {
            within(*corners, self.positions.len())
                & found(of.normals, self.normals.len())
                & found(of.texcoords, self.texcoords.len())
                & ((of.material as usize) < self.materials.len())
        };
        const TOGETHER: usize = 1 << 12;
        let all = self.triangles.par_chunks(TOGETHER).zip(self.attributes.par_chunks(TOGETHER));
        let broken = all.position_first(|(triangles, attributes)| {
            !triangles.iter().zip(attributes).fold(true, |whole, triangle| whole & is_whole(triangle))
        });
        let first = broken.and_then(|chunk| {
            let from = chunk * TOGETHER;
            let mut rest = self.triangles[from..].iter().zip(&self.attributes[from..]);
            rest.position(|triangle| !is_whole(triangle)).map(|at| from + at)
        });
        match first {
            Some(at) => Err(Error::invalid(format!(
                "triangle {at} names a vertex, normal, texture coordinate or material that is not there"
            ))
            .remedy("number them from 0, below the count of each; NONE three times for no normals or texture coordinates")),
            None => Ok(()),
        }
    }

    fn check_numbers(&self) -> Result<()> {
        const TOGETHER: usize = 1 << 12;
        // Without branches, as below.
        let are_near = |vertices: &[DVec3]| vertices.iter().fold(true, |all, vertex| all & is_near(vertex));
        if !self.positions.par_chunks(TOGETHER).all(are_near) {
            return Err(Error::invalid(format!(
                "a vertex is no number, or more than {FARTHEST:e} m from the origin"
            ))
            .remedy("leave it out, or mend the mesh"));
        }
        let are_finite = |vectors: &[Vec3]| vectors.iter().fold(true, |all, vector| all & vector.is_finite());
        let are_places = |places: &[Vec2]| places.iter().fold(true, |all, place| all & place.is_finite());
        if !self.normals.par_chunks(TOGETHER).all(are_finite)
            || !self.texcoords.par_chunks(TOGETHER).all(are_places)
        {
            return Err(Error::invalid("a normal or a texture coordinate is no finite number")
                .remedy("leave it out, or mend the mesh"));
        }
        let wrong = |material: &Material| {
            let mut colours = material.diffuse.iter().chain(&material.emission);
            let Mapping { scale, offset } = material.opacity_mapping;
            let are_colours = colours.all(|channel| (0.0..=BRIGHTEST).contains(channel));
            !(are_colours
                && (0.0..=1.0).contains(&material.coverage)
                && scale.is_finite()
                && offset.is_finite())
        };
        if let Some(at) = self.materials.iter().position(wrong) {
            return Err(Error::invalid(format!(
                "a colour, the coverage or the mapping of material {at} is none"
            ))
            .remedy("give colours of 0 to 1e9, a coverage of 0 to 1, and a finite mapping"));
        }
        let maps = |material: &Material| {
            let mut maps = material.diffuse_map.iter().chain(&material.opacity_map);
            maps.all(|map| map.is_whole())
        };
        match self.materials.iter().position(|material| !maps(material)) {
            Some(at) => Err(Error::invalid(format!("a texture of material {at} lacks levels or texels"))
                .remedy("make it by Texture::from_level")),
            None => Ok(()),
        }
    }

    /// Makes patches, clusters and, for pictures with shadows, the hierarchy anew from all that is here.
    ///
    /// # Errors
    /// Those of [`Surfaces::check`]; what was made before is gone then.
    pub fn prepare(&mut self, shadows: bool) -> Result<()> {
        (self.patches, self.clusters, self.hierarchy) = (Patches::default(), Clusters::default(), None);
        self.check()?;
        self.find_clusters();
        if shadows {
            self.build_hierarchy();
        } else {
            self.find_patches();
        }
        Ok(())
    }

    /// Finds which triangles look alike, so that samples of a pixel that see them can share shading.
    ///
    /// # Panics
    /// Where [`Surfaces::check`] would refuse them.
    pub fn find_patches(&mut self) {
        self.patches = Patches::new(self, false);
    }

    /// Finds boxes of many triangles each, so that a picture passes over what is out of view at one look.
    ///
    /// # Panics
    /// Where [`Surfaces::check`] would refuse them.
    pub fn find_clusters(&mut self) {
        self.clusters = Clusters::new(self);
    }

    /// Sorts the triangles for the rays of shadows, and finds the patches for them: only what lies in one plane is one.
    ///
    /// # Panics
    /// Where [`Surfaces::check`] would refuse them.
    pub fn build_hierarchy(&mut self) {
        self.hierarchy = Some(Hierarchy::new(self));
        self.patches = Patches::new(self, true);
    }

    /// The corners of triangle `t`.
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|i| self.positions[i as usize])
    }
}
/// The lowest and the highest coordinates of points; infinite the wrong way round where there are none.
pub(crate) fn bounds(points: impl IntoIterator<Item = DVec3>) -> [DVec3; 2] {
    let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.into_iter().fold(start, |[low, high], p| [low.min(p), high.max(p)])
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Triangle;
    use super::*;

    /// `world = translate + Ry(rotate_y) (scale v)`, whose quarter turn takes +x to -z and +z to +x; normals turn with it.
    #[test]
    fn a_mesh_is_scaled_then_turned_then_moved() {
        let model = Model {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(3.0, 3.0, 1.0)],
            normals: vec![Vec3::X, Vec3::new(0.0, 2.0, 1.0)],
            texcoords: vec![],
            triangles: vec![Triangle {
                positions: [0, 1, 2],
                normals: [0, 1, 1],
                texcoords: [NONE; 3],
                material: 0,
            }],
            materials: vec![Material::default_surface()],
            named_materials: 0,
            textures: 0,
            bounds: [DVec3::ZERO, DVec3::new(3.0, 3.0, 1.0)],
            digest: [0; 32],
        };
        let placement =
            Placement { scale: 2.0, rotate_y: Angle::degrees(90.0), translate: DVec3::new(1.0, 10.0, 100.0) };
        let mut surfaces = Surfaces::default();
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(surfaces.add(&model, &Placement { scale, ..placement }).is_err(), "{scale}");
        }
        surfaces.add(&model, &placement).unwrap();
        let want = [DVec3::new(1.0, 10.0, 100.0), DVec3::new(1.0, 10.0, 98.0), DVec3::new(3.0, 16.0, 94.0)];
        for (got, want) in surfaces.positions.iter().zip(want) {
            assert!((*got - want).length() < 1e-13, "{got} {want}");
        }
        for (got, want) in surfaces.normals.iter().zip([Vec3::NEG_Z, Vec3::new(1.0, 2.0, 0.0)]) {
            assert!((*got - want).length() < 1e-6, "{got} {want}");
        }
        // Another after it has numbers of its own.
        surfaces.add(&model, &Placement::default()).unwrap();
        assert_eq!(surfaces.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(surfaces.positions[5], DVec3::new(3.0, 3.0, 1.0));
    }
}
