//! The loader: the name of an OBJ as a scene writes it in, a finished [`Model`] and warnings out.
//!
//! The way of one model: find and read the OBJ, normalise it, read the material libraries it names, decode (in
//! parallel) the textures of those materials that faces use, then build the triangles. Models and textures are kept, so
//! a file that several meshes name is read once.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::digest::{self, Digest};
use super::library::{Written, choose, read_libraries};
use super::material::Material;
use super::mesh::{Model, NONE};
use super::mtl::Map;
use super::normalize::{normalize, shown};
use super::obj::{self, Target};
use super::source::Source;
use super::text::readings;
use super::texture::{Texture, Use, decode};
use super::warnings::Warnings;
use crate::error::{Error, ErrorKind, Result, Warning};

/// Longest OBJ and picture file, in bytes.
const OBJ_LIMIT: u64 = 2 << 30;
const PICTURE_LIMIT: u64 = 256 << 20;

/// Most memory for the textures of all meshes, in bytes.
const TEXTURES_LIMIT: u64 = 8 << 30;

/// Called while loading, from any thread, with what is being loaded, how much is done and of how much
/// (bytes of an OBJ, files for textures).
pub type Progress<'a> = dyn Fn(&str, u64, u64) + Sync + 'a;

/// Loads the meshes of one scene.
pub struct AssetLoader<'a> {
    source: &'a dyn Source,
    scene_folder: PathBuf,
    progress: Option<&'a Progress<'a>>,
    models: HashMap<PathBuf, Arc<Model>>,
    textures: HashMap<(PathBuf, Use), Decoded>,
    texture_bytes: u64,
    texture_limit: u64,
    warnings: Vec<Warning>,
    digests: Vec<Digest>,
}

/// A texture, or why there is none, and the digest of its file.
type Decoded = (std::result::Result<Arc<Texture>, String>, Digest);

impl<'a> AssetLoader<'a> {
    /// A loader for the scene file in `scene_folder` (as [`Source`] found it).
    pub fn new(source: &'a dyn Source, scene_folder: &Path) -> Self {
        Self {
            source,
            scene_folder: scene_folder.to_path_buf(),
            progress: None,
            models: HashMap::new(),
            textures: HashMap::new(),
            texture_bytes: 0,
            texture_limit: TEXTURES_LIMIT,
            warnings: Vec::new(),
            digests: Vec::new(),
        }
    }

    /// Asks for calls while loading.
    #[must_use]
    pub fn with_progress(mut self, progress: &'a Progress<'a>) -> Self {
        self.progress = Some(progress);
        self
    }

    /// Limits the memory for textures to `bytes`, if that is less than the usual limit.
    #[must_use]
    pub fn with_memory(mut self, bytes: u64) -> Self {
        self.texture_limit = self.texture_limit.min(bytes);
        self
    }

    /// Loads the OBJ that the scene names as `written`.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`] when it is missing, refused, or holds no triangle, an index or a number that cannot be;
    /// [`ErrorKind::TooLarge`] when there is not the memory; [`ErrorKind::Io`] when it is there but cannot be read.
    /// Anything wrong with materials or textures is a warning.
    pub fn load_obj(&mut self, written: &str) -> Result<Arc<Model>> {
        let path = self.source.named(&self.scene_folder, written)?;
        let model = match self.models.get(&path) {
            Some(model) => Arc::clone(model),
            None => {
                let mut warnings = Warnings::default();
                let model = self.load(&path, written, &mut warnings).map_err(|e| e.in_file(written))?;
                self.warnings.extend(warnings.finish(written));
                let model = Arc::new(model);
                self.models.insert(path, Arc::clone(&model));
                model
            }
        };
        self.digests.push(model.digest);
        Ok(model)
    }

    /// The warnings of all models loaded so far, in the order of loading.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// SHA-256 over the bytes of all that was loaded, in the order of the calls; paths do not enter.
    pub fn digest(&self) -> [u8; 32] {
        digest::of_list(&self.digests)
    }

    fn tell(&self, what: &str, done: u64, total: u64) {
        if let Some(progress) = self.progress {
            progress(what, done, total);
        }
    }

    fn load(&mut self, path: &Path, written: &str, warnings: &mut Warnings) -> Result<Model> {
        let source = self.source;
        let bytes = source.read(path, OBJ_LIMIT)?;
        let total = bytes.len() as u64;
        self.tell(written, 0, total);
        let mut digests = vec![digest::of_bytes(&bytes)];
        let mut normalized =
            normalize(&bytes, written, warnings, &|done| self.tell(written, done / 2, total))?;
        drop(bytes);
        if normalized.faces.is_empty() {
            return Err(Error::invalid("the mesh has no face of three or more corners")
                .remedy("export it as an OBJ with polygons"));
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let fences = [folder.clone(), self.scene_folder.clone()];
        let library = read_libraries(source, &normalized, written, &fences, warnings, &mut digests);
        let chosen = choose(&normalized, &library, written, warnings);
        let used: Vec<&Written> = chosen.used.iter().filter_map(|&at| library.get(at)).collect();
        let looks = self.looks(&used, &fences, warnings, &mut digests)?;
        let targets: Vec<Target> = chosen
            .targets
            .iter()
            .map(|&material| Target {
                material,
                mapping: looks.mappings.get(material as usize).copied().flatten(),
            })
            .collect();
        let plain = Target { material: looks.materials.len() as u32, mapping: None };
        let target = |index: u32| {
            targets.get(index as usize).copied().filter(|target| target.material != NONE).unwrap_or(plain)
        };
        let geometry = obj::build(&mut normalized, target, written, warnings)?;
        self.tell(written, total, total);

        let mut materials = looks.materials;
        let named_materials = materials.len();
        if chosen.plain {
            materials.push(Material::default_surface());
        }
        let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let bounds = geometry.positions.iter().fold(start, |[low, high], &p| [low.min(p), high.max(p)]);
        Ok(Model {
            positions: geometry.positions,
            normals: geometry.normals,
            texcoords: geometry.texcoords,
            triangles: geometry.triangles,
            materials,
            named_materials,
            textures: looks.files,
            bounds,
            digest: digest::of_list(&digests),
        })
    }

    /// The finished materials, with their textures.
    fn looks(
        &mut self,
        used: &[&Written],
        fences: &[PathBuf],
        warnings: &mut Warnings,
        digests: &mut Vec<Digest>,
    ) -> Result<Looks> {
        let mut wanted = Vec::new();
        for written in used {
            for (map, what_for) in
                [(&written.entry.diffuse_map, Use::Diffuse), (&written.entry.opacity_map, Use::Opacity)]
            {
                let found = map.as_ref().map(|map| self.find_picture(map, &written.folder, fences));
                wanted.push((map.as_ref().zip(found), what_for));
            }
        }
        let paths = wanted.iter().filter_map(|(map, what_for)| match map {
            Some((_, Ok(path))) => Some((path.clone(), *what_for)),
            _ => None,
        });
        self.decode_all(paths.collect())?;

        let mut files = BTreeSet::new();
        let mut looks = Looks::default();
        for (written, wanted) in used.iter().zip(wanted.chunks_exact(2)) {
            let mut maps = [None, None];
            for (slot, &(ref map, what_for)) in maps.iter_mut().zip(wanted) {
                let Some((map, found)) = map else { continue };
                let decoded = match found {
                    Ok(path) => self.textures.get(&(path.clone(), what_for)).cloned(),
                    Err(e) => Some((Err(e.message().to_owned()), digest::ABSENT)),
                };
                let Some((decoded, digest)) = decoded else { continue };
                digests.push(digest);
                match (decoded, found) {
                    (Ok(texture), Ok(path)) => {
                        files.insert(path.clone());
                        *slot = Some((texture, *map));
                    }
                    (decoded, _) => {
                        let why = decoded.err().unwrap_or_default();
                        let message = || format!("texture `{}` is left out: {why}", shown(&map.name));
                        warnings.add(&written.file, Some(map.line), &format!("map {}", map.name), message);
                    }
                }
            }
            looks.add(written, maps, warnings);
        }
        looks.files = files.len();
        Ok(looks)
    }

    fn find_picture(&self, map: &Map, folder: &Path, fences: &[PathBuf]) -> Result<PathBuf> {
        let mut first = None;
        for name in readings(&map.name).filter(|name| !name.is_empty()) {
            for folder in [folder, &fences[0]] {
                match self.source.asset(folder, name, fences) {
                    Ok(path) => return Ok(path),
                    Err(e) => first.get_or_insert(e),
                };
            }
        }
        Err(first.unwrap_or_else(|| Error::invalid("it has no name")))
    }

    /// Decodes what is not decoded yet; a few files at a time, so that memory is counted before it is gone.
    fn decode_all(&mut self, mut wanted: Vec<(PathBuf, Use)>) -> Result<()> {
        let mut seen = BTreeSet::new();
        wanted.retain(|(path, what_for)| {
            !self.textures.contains_key(&(path.clone(), *what_for))
                && seen.insert((path.clone(), *what_for == Use::Opacity))
        });
        let total = wanted.len() as u64;
        let done = AtomicU64::new(0);
        for some in wanted.chunks(2 * rayon::current_num_threads()) {
            let decoded: Vec<Decoded> = some
                .par_iter()
                .map(|(path, what_for)| {
                    let decoded = match self.source.read(path, PICTURE_LIMIT) {
                        Ok(bytes) => {
                            (decode(&bytes, path, *what_for).map(Arc::new), digest::of_bytes(&bytes))
                        }
                        Err(e) => (Err(e.message().to_owned()), digest::ABSENT),
                    };
                    self.tell("textures", done.fetch_add(1, Ordering::Relaxed) + 1, total);
                    decoded
                })
                .collect();
            let bytes = |decoded: &Decoded| decoded.0.as_ref().map_or(0, |texture| texture.bytes());
            self.texture_bytes += decoded.iter().map(bytes).sum::<u64>();
            if self.texture_bytes > self.texture_limit {
                let gigabytes = self.texture_limit as f64 / 1e9;
                let message = format!("the textures take more than {gigabytes:.1} GB");
                return Err(Error::new(ErrorKind::TooLarge, message).remedy("make them smaller"));
            }
            self.textures.extend(some.iter().cloned().zip(decoded));
        }
        Ok(())
    }
}

/// Finished materials, in the order of first use.
#[derive(Default)]
struct Looks {
    materials: Vec<Material>,
    mappings: Vec<Option<([f64; 2], [f64; 2])>>,
    files: usize,
}

impl Looks {
    fn add(&mut self, written: &Written, maps: [Option<(Arc<Texture>, &Map)>; 2], warnings: &mut Warnings) {
        let entry = &written.entry;
        let mapping =
            |map: &Option<(Arc<Texture>, &Map)>| map.as_ref().map(|(_, map)| (map.scale, map.offset));
        let [diffuse_map, opacity_map] = maps;
        let (first, second) = (mapping(&diffuse_map), mapping(&opacity_map));
        if let (Some(a), Some(b), Some((_, map))) = (first, second, &opacity_map)
            && a != b
        {
            let message = || "`map_d` is placed by the options of `map_Kd`, not its own".to_owned();
            warnings.add(&written.file, Some(map.line), "two mappings", message);
        }
        self.mappings.push(first.or(second).filter(|&mapping| mapping != ([1.0; 2], [0.0; 2])));
        self.materials.push(Material {
            name: entry.names.last().cloned().unwrap_or_default(),
            diffuse: entry.diffuse.unwrap_or(Material::diffuse_without_kd(diffuse_map.is_some())),
            emission: entry.emission,
            diffuse_map: diffuse_map.map(|(texture, _)| texture),
            opacity_map: opacity_map.map(|(texture, _)| texture),
            coverage: entry.coverage.unwrap_or(1.0),
        });
    }
}
