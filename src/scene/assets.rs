//! The loader: the name of an OBJ as a scene writes it in, a finished [`Model`] and warnings out.
//!
//! The way of one model: find it, read it with the material libraries it names (`reading`), decode (in parallel) the
//! textures of those materials that faces use, then build the triangles. Models and textures are kept, so a file that
//! several meshes name is read once; several models are read side by side.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::decode::Use;
use super::digest::{self, Digest};
use super::mesh::Model;
use super::normalize::shown;
use super::pictures::Pictures;
use super::reading::{Looks, Parts, Progress, Reader};
use super::records::too_large;
use super::source::Source;
use super::text::readings;
use super::warnings::Warnings;
use crate::error::{Error, ErrorKind, Result, Warning};
use crate::threads::on_threads;

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

    /// Limits the memory that loading may take, and what is loaded, to `bytes` or to [`Source::room`] if that is less.
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

    /// Reads the OBJs that a scene names side by side, for [`Self::load_obj`] to find them: those that it would read one
    /// after the other, in its order. Where that goes wrong, or takes more memory than there is, nothing is kept, and
    /// [`Self::load_obj`] says why, if it is so one after the other, too.
    pub(crate) fn read_ahead<'w>(&mut self, names: impl Iterator<Item = &'w str>) {
        let mut files: Vec<(PathBuf, &str, u64)> = Vec::new();
        let mut known = HashSet::new();
        for written in names {
            let Ok(path) = self.source.named(&self.scene_folder, written) else { return };
            if known.insert(path.clone()) {
                let Ok(length) = self.source.length(&path) else { return };
                files.push((path, written, length));
            }
        }
        if files.len() < 2 || !self.models.is_empty() {
            return;
        }
        match on_threads(None, || self.read_together(&files)).and_then(|models| models) {
            Ok(models) => {
                for ((path, written, _), (model, warnings)) in files.into_iter().zip(models) {
                    self.warnings.extend(warnings.finish(written));
                    self.models.insert(path, Arc::new(model));
                }
            }
            Err(_) => (self.pictures, self.held) = (Pictures::default(), 0),
        }
    }

    fn read_together(&mut self, files: &[(PathBuf, &str, u64)]) -> Result<Vec<(Model, Warnings)>> {
        // Each gets its share, so that it does not depend on the others' progress whether they fit.
        let sum = |bytes: &mut dyn Iterator<Item = u64>| bytes.fold(0, u64::saturating_add);
        let (left, all) = (self.left(), sum(&mut files.iter().map(|file| file.2)).max(1));
        let share = |length: u64| (u128::from(left) * u128::from(length) / u128::from(all)) as u64;
        let folder = self.scene_folder.clone();
        let read = files.par_iter().map(|(path, written, length)| {
            let (mut warnings, reader) = (Warnings::default(), self.reader(&folder, share(*length)));
            let (parts, ()) = reader.read(path, written, &mut warnings, |_, _| Ok(()))?;
            Ok((parts, warnings))
        });
        let mut read = read.collect::<Result<Vec<_>>>()?;
        // With what the libraries took: one after the other a library is left out where models and pictures before leave too
        // little for it. (One that is left out here may have had too small a share.)
        let taken = |parts: &Parts| parts.working().saturating_add(parts.libraries.unwrap_or(u64::MAX));
        let together = sum(&mut read.iter().map(|(parts, _)| taken(parts)));
        let held = self.held;
        self.held = held.saturating_add(together);
        let looks: Vec<Looks> =
            read.iter_mut().map(|(parts, warnings)| self.looks(parts, warnings)).collect::<Result<_>>()?;
        self.held = held;
        if together > self.left() {
            return Err(too_large());
        }
        let models =
            read.into_par_iter().zip(looks).zip(files).map(|(((parts, mut warnings), looks), file)| {
                let (model, bytes) = self.build(parts, looks, file.1, &mut warnings)?;
                Ok(((model, warnings), bytes))
            });
        let (models, bytes): (Vec<_>, Vec<u64>) = models.collect::<Result<Vec<_>>>()?.into_iter().unzip();
        self.held = self.held.saturating_add(sum(&mut bytes.into_iter()));
        Ok(models)
    }

    fn reader<'r>(&self, scene_folder: &'r Path, left: u64) -> Reader<'r>
    where
        'a: 'r,
    {
        Reader { source: self.source, scene_folder, progress: self.progress, left }
    }

    fn load(&mut self, path: &Path, written: &str, warnings: &mut Warnings) -> Result<Model> {
        let folder = self.scene_folder.clone();
        let reader = self.reader(&folder, self.left());
        // Textures are read while `tobj` is at the geometry still.
        let (parts, looks) = reader.read(path, written, warnings, |parts, warnings| {
            self.held = self.held.saturating_add(parts.working());
            let looks = self.looks(parts, warnings);
            self.held = self.held.saturating_sub(parts.working());
            looks
        })?;
        if parts.working() > self.left() {
            return Err(too_large());
        }
        let (model, bytes) = self.build(parts, looks, written, warnings)?;
        self.held = self.held.saturating_add(bytes);
        Ok(model)
    }

    fn build(
        &self,
        parts: Parts,
        looks: Looks,
        written: &str,
        warnings: &mut Warnings,
    ) -> Result<(Model, u64)> {
        let total = parts.length;
        let built = parts.build(looks, written, warnings)?;
        self.tell(written, total, total);
        Ok(built)
    }

    /// The finished materials, with their textures.
    fn looks(&mut self, parts: &mut Parts, warnings: &mut Warnings) -> Result<Looks> {
        // All of them: a source may remember what is asked for, so that no output replaces what a model names, whether it is read or not.
        let found: BTreeMap<_, _> = parts
            .pictures()
            .into_iter()
            .map(|(folder, name)| ((folder, name), self.find_picture(name, folder, &parts.fences)))
            .collect();
        let mut wanted = Vec::new();
        for written in parts.used() {
            for (map, what_for) in
                [(&written.entry.diffuse_map, Use::Diffuse), (&written.entry.opacity_map, Use::Opacity)]
            {
                let map = map.as_ref().filter(|_| !self.shapes_only);
                let found = map.and_then(|map| found.get(&(&*written.folder, &*map.name)));
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
        let mut digests = Vec::new();
        for (written, wanted) in parts.used().zip(wanted.chunks_exact(2)) {
            let mut maps = [None, None];
            for (slot, &(ref map, what_for)) in maps.iter_mut().zip(wanted) {
                let Some((map, found)) = map else { continue };
                let decoded = match found {
                    Ok(path) => self.pictures.get(path, what_for),
                    Err(e) => Some((Err(e.clone()), digest::ABSENT)),
                };
                let Some((decoded, digest)) = decoded else { continue };
                digests.push(digest);
                match decoded {
                    Ok(texture) => {
                        files.extend(found.as_ref().ok().cloned());
                        *slot = Some((texture, *map));
                    }
                    // A fault of the system's is no property of the scene: the next run might have the texture.
                    Err(error) if error.kind() == ErrorKind::Io => {
                        return Err(error.in_file(&*written.file).at_line(map.line));
                    }
                    Err(error) => {
                        let why = error.message();
                        let message = || format!("texture `{}` is left out: {why}", shown(&map.name));
                        warnings.add(&written.file, Some(map.line), &format!("map {}", map.name), message);
                    }
                }
            }
            looks.add(written, maps, warnings);
        }
        parts.digests.extend(digests);
        looks.files = files.len();
        Ok(looks)
    }

    fn find_picture(&self, name: &str, folder: &Path, fences: &[PathBuf]) -> Result<PathBuf> {
        let mut first = None;
        for name in readings(name).filter(|name| !name.is_empty()) {
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
