//! The loader: the name of an OBJ as a scene writes it in, a finished [`Model`] and warnings out.
//!
//! The way of one model: find and read the OBJ, normalise it, read the material libraries it names, decode (in
//! parallel) the textures of those materials that faces use, then build the triangles. Models and textures are kept, so
//! a file that several meshes name is read once.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::digest::{self, Digest};
use super::library::{Written, choose, read_libraries};
use super::material::Material;
use super::mesh::{Model, NONE};
use super::mtl::Map;
use super::normalize::{normalize, shown, too_large};
use super::obj::{self, Target};
use super::pictures::Pictures;
use super::source::Source;
use super::surfaces::bounds;
use super::text::readings;
use super::texture::{Texture, Use};
use super::warnings::Warnings;
use crate::error::{Error, Result, Warning};
use crate::threads::on_threads;

/// Longest OBJ file, in bytes: some ten million triangles.
const OBJ_LIMIT: u64 = 1 << 30;

/// Called while loading, from any thread, with what is being loaded, how much is done and of how much
/// (bytes of an OBJ, files for textures).
pub type Progress<'a> = dyn Fn(&str, u64, u64) + Sync + 'a;

/// Loads the meshes of one scene.
pub struct AssetLoader<'a> {
    source: &'a dyn Source,
    scene_folder: PathBuf,
    progress: Option<&'a Progress<'a>>,
    models: HashMap<PathBuf, Arc<Model>>,
    pictures: Pictures,
    /// Whether pictures are left out: a drawing has no use for them.
    shapes_only: bool,
    memory: u64,
    /// Bytes that the models loaded so far take, textures apart.
    held: u64,
    warnings: Vec<Warning>,
    digests: Vec<Digest>,
}

impl<'a> AssetLoader<'a> {
    /// A loader for the scene file in `scene_folder` (as [`Source`] found it).
    pub fn new(source: &'a dyn Source, scene_folder: &Path) -> Self {
        Self {
            source,
            scene_folder: scene_folder.to_path_buf(),
            progress: None,
            models: HashMap::new(),
            pictures: Pictures::default(),
            shapes_only: false,
            memory: source.room().unwrap_or(u64::MAX),
            held: 0,
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

    /// Leaves out the pictures of materials: what has shape is loaded, not what it looks like.
    #[must_use]
    pub(crate) fn shapes_only(mut self) -> Self {
        self.shapes_only = true;
        self
    }

    /// Limits the memory that loading may take, and what is loaded, to `bytes` (else to [`Source::room`]).
    #[must_use]
    pub fn with_memory(mut self, bytes: u64) -> Self {
        self.memory = self.memory.min(bytes);
        self
    }

    /// Bytes of memory that may yet be taken.
    pub(crate) fn left(&self) -> u64 {
        self.memory.saturating_sub(self.held).saturating_sub(self.pictures.bytes())
    }

    /// Loads the OBJ that the scene names as `written`.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid) when it is missing, refused, or holds no triangle, an index or a number that cannot be;
    /// [`TooLarge`](crate::error::ErrorKind::TooLarge) when there is not the memory; [`Io`](crate::error::ErrorKind::Io) when it is there but cannot be read.
    /// Anything wrong with materials or textures is a warning.
    pub fn load_obj(&mut self, written: &str) -> Result<Arc<Model>> {
        let path = self.source.named(&self.scene_folder, written)?;
        let model = match self.models.get(&path) {
            Some(model) => Arc::clone(model),
            None => {
                let mut warnings = Warnings::default();
                let model = on_threads(None, || self.load(&path, written, &mut warnings))
                    .and_then(|loaded| loaded)
                    .map_err(|e| e.in_file(written))?;
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
        let length = source.length(path)?;
        if length <= OBJ_LIMIT && length > self.left() {
            return Err(too_large());
        }
        let bytes = source.read(path, OBJ_LIMIT)?;
        let total = bytes.len() as u64;
        let left = self.left().saturating_sub(total);
        self.tell(written, 0, total);
        // Materials and textures are read while `tobj` is at the geometry still.
        let (parts, mesh) = obj::read(|out| {
            let tell = |done| self.tell(written, done, total);
            let normalized = normalize(&bytes, written, warnings, left, &tell, out)?;
            let mut digests = vec![digest::of_bytes(&bytes)];
            if normalized.faces.is_empty() {
                return Err(Error::invalid("the mesh has no face of three or more corners")
                    .remedy("export it as an OBJ with polygons"));
            }
            let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
            let fences = [folder, self.scene_folder.clone()];
            let library = read_libraries(source, &normalized, written, &fences, left, warnings, &mut digests);
            let chosen = choose(&normalized, &library, written, warnings);
            let used: Vec<&Written> = chosen.used.iter().filter_map(|&at| library.get(at)).collect();
            self.held = self.held.saturating_add(normalized.working);
            let looks = self.looks(&used, &fences, warnings, &mut digests);
            self.held = self.held.saturating_sub(normalized.working);
            Ok((normalized, chosen, looks?, digests))
        })?;
        drop(bytes);
        let (normalized, chosen, looks, digests) = parts;
        let targets: Vec<Target> = chosen
            .targets
            .iter()
            .map(|&material| Target {
                material,
                mapping: looks.mappings.get(material as usize).copied().flatten(),
                textured: looks.materials.get(material as usize).is_some_and(Material::has_map),
            })
            .collect();
        let plain = Target { material: looks.materials.len() as u32, mapping: None, textured: false };
        let target = |index: u32| {
            targets.get(index as usize).copied().filter(|target| target.material != NONE).unwrap_or(plain)
        };
        if normalized.working > self.left() {
            return Err(too_large());
        }
        let geometry = obj::build((&normalized, &mesh), target, written, warnings)?;
        drop((normalized, mesh));
        self.tell(written, total, total);
        self.held = self.held.saturating_add(geometry.bytes());

        let mut materials = looks.materials;
        let named_materials = materials.len();
        if chosen.plain {
            materials.push(Material::default_surface());
        }
        let bounds = bounds(&geometry.positions);
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
                let map = map.as_ref().filter(|_| !self.shapes_only);
                let found = map.map(|map| self.find_picture(map, &written.folder, fences));
                wanted.push((map.zip(found), what_for));
            }
        }
        let paths = wanted.iter().filter_map(|(map, what_for)| match map {
            Some((_, Ok(path))) => Some((path.clone(), *what_for)),
            _ => None,
        });
        let (source, left) = (self.source, self.left());
        let progress = self.progress;
        let tell =
            |done: u64, total: u64| progress.into_iter().for_each(|tell| tell("textures", done, total));
        self.pictures.decode(source, paths.collect(), left, &tell)?;

        let mut files = BTreeSet::new();
        let mut looks = Looks::default();
        for (written, wanted) in used.iter().zip(wanted.chunks_exact(2)) {
            let mut maps = [None, None];
            for (slot, &(ref map, what_for)) in maps.iter_mut().zip(wanted) {
                let Some((map, found)) = map else { continue };
                let decoded = match found {
                    Ok(path) => self.pictures.get(path, what_for),
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
