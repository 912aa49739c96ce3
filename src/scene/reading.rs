//! One model on its way: an OBJ and the material libraries it names in, with their looks a finished [`Model`] out.
//!
//! `tobj` reads the geometry on one thread while another normalises it and goes on to the materials.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::digest::{self, Digest};
use super::library::{Chosen, Written, choose, read_libraries};
use super::material::{Mapping, Material};
use super::mesh::{Model, NONE};
use super::mtl::Map;
use super::normalize::{Normalized, normalize};
use super::obj::{self, Target};
use super::records::too_large;
use super::source::Source;
use super::surfaces::bounds;
use super::texture::Texture;
use super::warnings::Warnings;
use crate::error::{Error, Result};

/// Longest OBJ file, in bytes: some ten million triangles.
const OBJ_LIMIT: u64 = 1 << 30;

/// Called while loading, from any thread, with what is being loaded, how much is done and of how much
/// (bytes of an OBJ, files for textures).
pub type Progress<'a> = dyn Fn(&str, u64, u64) + Sync + 'a;

/// What reading a model needs to know.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    pub(crate) source: &'a dyn Source,
    pub(crate) scene_folder: &'a Path,
    pub(crate) progress: Option<&'a Progress<'a>>,
    /// Bytes of memory that may be taken.
    pub(crate) left: u64,
}

/// A model that is read, but for what its materials look like.
pub(crate) struct Parts {
    normalized: Normalized,
    mesh: tobj::Mesh,
    chosen: Chosen,
    library: Vec<Written>,
    /// The model's folder, and the scene's.
    pub(crate) fences: [PathBuf; 2],
    /// Of the OBJ and of what it names, in the order of reading.
    pub(crate) digests: Vec<Digest>,
    /// Bytes of memory that its libraries took while they were read; nothing where one was left out as too large.
    pub(crate) libraries: Option<u64>,
    /// Of the OBJ, in bytes.
    pub(crate) length: u64,
}

/// Finished materials, in the order of first use.
#[derive(Default)]
pub(crate) struct Looks {
    pub(crate) materials: Vec<Material>,
    /// Where the maps of each lie, unless that changes nothing.
    pub(crate) mappings: Vec<Option<Mapping>>,
    /// Distinct files of textures.
    pub(crate) files: usize,
}

impl Looks {
    /// The next material, with its diffuse and its opacity map.
    pub(crate) fn add(
        &mut self,
        written: &Written,
        maps: [Option<(Arc<Texture>, &Map)>; 2],
        warnings: &mut Warnings,
    ) {
        let entry = &written.entry;
        let [diffuse_map, opacity_map] = maps;
        let mapping = |map: &Option<(Arc<Texture>, &Map)>| map.as_ref().map(|(_, map)| map.mapping);
        let first = mapping(&diffuse_map).or(mapping(&opacity_map)).unwrap_or(Mapping::IDENTITY);
        let mut opacity_mapping = Mapping::IDENTITY;
        if let Some((_, map)) = &opacity_map
            && map.mapping != first
        {
            opacity_mapping = map.mapping.after(&first).unwrap_or_else(|| {
                let message = || {
                    "`map_d` is placed by the options of `map_Kd`: a scale of 0 leaves it none of its own"
                        .to_owned()
                };
                warnings.add(&written.file, Some(map.line), "two mappings", message);
                Mapping::IDENTITY
            });
        }
        self.mappings.push(Some(first).filter(|&mapping| mapping != Mapping::IDENTITY));
        self.materials.push(Material {
            name: entry.names.last().cloned().unwrap_or_default(),
            diffuse: entry.diffuse.unwrap_or(Material::diffuse_without_kd(diffuse_map.is_some())),
            emission: entry.emission,
            diffuse_map: diffuse_map.map(|(texture, _)| texture),
            opacity_map: opacity_map.map(|(texture, _)| texture),
            opacity_mapping,
            coverage: entry.coverage.unwrap_or(1.0),
        });
    }
}

impl Reader<'_> {
    /// Reads the OBJ at `path`, which the scene names as `written`; `also` is done beside the geometry.
    ///
    /// # Errors
    /// Those of [`normalize`] and of `also`; when the file is missing, too long or has no face.
    pub(crate) fn read<T: Send>(
        self,
        path: &Path,
        written: &str,
        warnings: &mut Warnings,
        also: impl FnOnce(&mut Parts, &mut Warnings) -> Result<T> + Send,
    ) -> Result<(Parts, T)> {
        let Self { source, scene_folder, left, .. } = self;
        let length = source.length(path)?;
        if length <= OBJ_LIMIT && length > left {
            return Err(too_large());
        }
        let bytes = source.read(path, OBJ_LIMIT)?;
        let total = bytes.len() as u64;
        let left = left.saturating_sub(total);
        let tell = |done| self.progress.into_iter().for_each(|tell| tell(written, done, total));
        tell(0);
        let ((mut parts, also), mesh) = obj::read(|out| {
            let normalized = normalize(&bytes, written, warnings, left, &tell, out)?;
            let mut digests = vec![digest::of_bytes(&bytes)];
            if normalized.faces.is_empty() {
                return Err(Error::invalid("the mesh has no face of three or more corners")
                    .remedy("export it as an OBJ with polygons"));
            }
            let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
            let fences = [folder, scene_folder.to_path_buf()];
            let (library, libraries) =
                read_libraries(source, &normalized, written, &fences, left, warnings, &mut digests)?;
            let chosen = choose(&normalized, &library, written, warnings);
            // `tobj` is at it still.
            let mesh = tobj::Mesh::default();
            let mut parts =
                Parts { normalized, mesh, chosen, library, fences, digests, libraries, length: total };
            let also = also(&mut parts, warnings)?;
            Ok((parts, also))
        })?;
        parts.mesh = mesh;
        Ok((parts, also))
    }
}

impl Parts {
    /// Bytes that building the geometry takes at its peak, with what is held already.
    pub(crate) fn working(&self) -> u64 {
        self.normalized.working
    }

    /// The materials that faces use, in the order of first use.
    pub(crate) fn used(&self) -> impl Iterator<Item = &Written> {
        self.chosen.used.iter().filter_map(|&at| self.library.get(at))
    }

    /// Every picture that its libraries name, used or not, with the folder that it is sought from.
    pub(crate) fn pictures(&self) -> BTreeSet<(&Path, &str)> {
        let mut found = BTreeSet::new();
        for Written { entry, folder, .. } in &self.library {
            let maps = [&entry.diffuse_map, &entry.opacity_map].into_iter().flatten();
            let names = maps.map(|map| &map.name).chain(&entry.unread);
            found.extend(names.map(|name| (&**folder, &**name)));
        }
        found
    }

    /// The finished model, and the bytes that its geometry takes.
    ///
    /// # Errors
    /// When a face uses a vertex that is not finite.
    pub(crate) fn build(self, looks: Looks, file: &str, warnings: &mut Warnings) -> Result<(Model, u64)> {
        let Self { normalized, mesh, chosen, digests, .. } = self;
        let targets: Vec<Target> = chosen
            .targets
            .iter()
            .map(|&material| Target {
                material,
                mapping: looks.mappings.get(material as usize).copied().flatten(),
                textured: looks.materials.get(material as usize).is_some_and(Material::has_map),
                near: looks.materials.get(material as usize).is_none_or(|m| {
                    let holed = m.opacity_map.as_ref().is_some_and(|map| map.has_holes);
                    !holed || m.opacity_mapping.keeps(obj::STEP)
                }),
            })
            .collect();
        let plain =
            Target { material: looks.materials.len() as u32, mapping: None, textured: false, near: true };
        let target = |index: u32| {
            targets.get(index as usize).copied().filter(|target| target.material != NONE).unwrap_or(plain)
        };
        let geometry = obj::build((&normalized, &mesh), target, file, warnings)?;
        drop((normalized, mesh));

        let held = geometry.bytes();
        let mut materials = looks.materials;
        let named_materials = materials.len();
        if chosen.plain {
            materials.push(Material::default_surface());
        }
        let bounds = bounds(geometry.positions.iter().copied());
        let model = Model {
            positions: geometry.positions,
            normals: geometry.normals,
            texcoords: geometry.texcoords,
            triangles: geometry.triangles,
            materials,
            named_materials,
            textures: looks.files,
            bounds,
            digest: digest::of_list(&digests),
        };
        Ok((model, held))
    }
}
