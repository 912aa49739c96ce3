//! From a description and its assets to a [`Scene`]: meshes loaded and placed, nothing left to look up.

use super::assets::AssetLoader;
use super::description::{Blades, Budget, RenderSettings, SceneDescription, Sky, Sun, picture_size};
use super::digest;
use super::document::{Document, SIZE_LIMIT};
use super::effects::EffectChoice;
use super::file::SceneFile;
use super::reading::Progress;
use super::source::Source;
use super::source_files::Files;
use super::surfaces::{Placement, Surfaces, bounds};
use super::validate::DEFAULT_SAMPLES;
use crate::error::{Error, Place, Result, Warning};
use crate::optics::Optics;
use crate::quantity::Length;
use crate::sampling::{ApertureShape, PointSet};
use crate::threads::on_threads;
use glam::DVec3;
use std::path::Path;

/// A scene, ready to draw.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The camera, its movements solved, and its optics.
    pub optics: Optics,
    /// Shape of the aperture; `None` is a disk.
    pub blades: Option<Blades>,
    /// The world's upward direction, of unit length.
    pub up: DVec3,
    /// Diameter on the film that counts as sharp.
    pub circle_of_confusion: Length,
    /// All meshes in world coordinates.
    pub surfaces: Surfaces,
    /// The sun, if there is one.
    pub sun: Option<Sun>,
    /// Light from everywhere, and the background.
    pub sky: Sky,
    /// Size and quality of the picture.
    pub render: PictureSettings,
    /// What was loaded, mesh by mesh.
    pub meshes: Vec<MeshSummary>,
    /// What was dropped or replaced while loading.
    pub warnings: Vec<Warning>,
    /// SHA-256 of the bytes of all assets, in the scene's order; of surfaces that were made in memory nothing, so that
    /// [`Scene::hash`] does not tell them apart: give each its own.
    pub assets_digest: [u8; 32],
}

/// Size and quality of a picture, settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureSettings {
    /// Pixels, 1 to [`MAX_PICTURE_SIDE`](super::MAX_PICTURE_SIDE). The whole film is drawn on them, so that they are square where width and
    /// height are as those of the film.
    pub width: u32,
    /// Pixels, as many at most.
    pub height: u32,
    /// When it is good enough.
    pub budget: Budget,
    /// Stops (powers of two) by which light is brightened before it is clipped, in the PNG and wherever errors are judged; an EXR is
    /// without.
    pub exposure_ev: f64,
    /// Whether the corners darken as they do in a camera.
    pub falloff: bool,
    /// Whether light bends at the aperture.
    pub diffraction: bool,
    /// Chooses the samples. (A scene file holds no more than 2^63 - 1.)
    pub seed: u64,
    /// Which effects are wanted beside what the scene's keys say.
    pub effects: EffectChoice,
    /// Where the samples' points come from.
    pub points: PointSet,
    /// Whether samples may share look-ups of colour.
    pub share_shading: bool,
}

impl PictureSettings {
    /// As scene files have them that say nothing but the size: 256 samples, nothing left out that can be seen.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            budget: Budget::Samples(DEFAULT_SAMPLES),
            exposure_ev: 0.0,
            falloff: false,
            diffraction: false,
            seed: 0,
            effects: EffectChoice::default(),
            points: PointSet::default(),
            share_shading: true,
        }
    }
}

/// What one `[[mesh]]` brought.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSummary {
    /// As written in the scene file.
    pub path: String,
    /// Where it stands.
    pub placement: Placement,
    /// The sum over faces of corners - 2.
    pub triangles: usize,
    /// Materials that faces use and the file names.
    pub materials: usize,
    /// Distinct texture files decoded.
    pub textures: usize,
    /// Least and greatest corner of the vertices used, world metres.
    pub bounds: [DVec3; 2],
}

/// How a scene is loaded.
#[derive(Clone, Copy, Default)]
pub struct LoadSettings<'a> {
    /// Called while loading.
    pub progress: Option<&'a Progress<'a>>,
    /// Width of the picture in pixels, in place of the file's.
    pub width: Option<u32>,
    /// Threads to load on, 1024 at most; `None` for as many as the machine has.
    pub threads: Option<usize>,
    /// Most memory that loading may take, and what is loaded, in bytes; never more than [`Source::room`], which alone counts for `None`.
    pub memory: Option<u64>,
}

impl SceneDescription {
    /// Loads all meshes from `source`; `folder` is the scene file's, as `source` knows it.
    ///
    /// # Errors
    /// Those of [`Self::load_with`].
    pub fn load(&self, source: &dyn Source, folder: &Path, progress: Option<&Progress<'_>>) -> Result<Scene> {
        self.load_with(source, folder, LoadSettings { progress, ..LoadSettings::default() })
    }

    /// As [`Self::load`], with settings.
    ///
    /// # Errors
    /// Those of [`Self::optics`], [`Self::picture_size`] and [`AssetLoader::load_obj`], with the mesh's line;
    /// [`TooLarge`](crate::error::ErrorKind::TooLarge) beyond the memory allowed.
    pub fn load_with(&self, source: &dyn Source, folder: &Path, settings: LoadSettings<'_>) -> Result<Scene> {
        on_threads(settings.threads, || self.load_here(source, folder, settings))?
    }

    fn load_here(&self, source: &dyn Source, folder: &Path, settings: LoadSettings<'_>) -> Result<Scene> {
        let optics = self.optics()?;
        let (width, height) = self.picture_size(settings.width)?;
        let mut loader = AssetLoader::new(source, folder);
        if let Some(progress) = settings.progress {
            loader = loader.with_progress(progress);
        }
        if let Some(most) = settings.memory {
            loader = loader.with_memory(most);
        }
        let (mut surfaces, meshes) = self.place_all(&mut loader)?;
        surfaces.prepare(self.sun.is_some_and(|sun| sun.shadows))?;
        let RenderSettings { budget, exposure_ev, falloff, diffraction, seed, .. } = self.render;
        Ok(Scene {
            optics,
            blades: self.blades,
            up: self.up,
            circle_of_confusion: self.circle_of_confusion,
            surfaces,
            sun: self.sun,
            sky: self.sky,
            render: PictureSettings {
                budget,
                exposure_ev,
                falloff,
                diffraction,
                seed,
                ..PictureSettings::new(width, height)
            },
            meshes,
            warnings: loader.warnings().to_vec(),
            assets_digest: loader.digest(),
        })
    }

    /// All meshes in the world, without what finding patches and casting shadows need.
    ///
    /// # Errors
    /// Those of [`AssetLoader::load_obj`], with the mesh's line, and
    /// [`TooLarge`](crate::error::ErrorKind::TooLarge) beyond the memory allowed.
    pub(crate) fn shapes(&self, loader: &mut AssetLoader<'_>) -> Result<Surfaces> {
        self.place_all(loader).map(|(surfaces, _)| surfaces)
    }

    fn place_all(&self, loader: &mut AssetLoader<'_>) -> Result<(Surfaces, Vec<MeshSummary>)> {
        // All models first (one that several meshes name is held once), so that the memory for all is asked for once.
        loader.read_ahead(self.meshes.iter().map(|entry| &*entry.path));
        let mut models = Vec::new();
        let mut surfaces = Surfaces::default();
        for (index, entry) in self.meshes.iter().enumerate() {
            let model = loader
                .load_obj(&entry.path)
                .map_err(|error| named_by(error, self.document.name(), &self.mesh_place(index)))?;
            models.push(model);
        }
        surfaces
            .reserve(&models, loader.left())
            .map_err(|error| error.at(self.mesh_place(self.meshes.len().saturating_sub(1))))?;
        let mut meshes = Vec::new();
        for (index, (entry, model)) in self.meshes.iter().zip(&models).enumerate() {
            let placement =
                Placement { scale: entry.scale, rotate_y: entry.rotate_y, translate: entry.translate };
            let first = surfaces.positions.len();
            surfaces.add(model, &placement).map_err(|error| error.at(self.mesh_place(index)))?;
            let bounds = bounds(surfaces.positions[first..].iter().copied());
            meshes.push(MeshSummary {
                path: entry.path.clone(),
                placement,
                triangles: model.triangles.len(),
                materials: model.named_materials,
                textures: model.textures,
                bounds,
            });
        }
        Ok((surfaces, meshes))
    }
}

/// An asset's error with the line of the scene that asked for it: as its place where it has none of its own.
fn named_by(error: Error, scene: &str, place: &Place) -> Error {
    let named = match (&error.place().file, place.line) {
        (None, _) => Error::new(error.kind(), error.message()).at(place.clone()),
        (Some(_), Some(line)) if error.place().line.is_none() => {
            Error::new(error.kind(), format!("{} (named in {scene}:{line})", error.message()))
                .at(error.place().clone())
        }
        _ => return error,
    };
    match error.remedy_text() {
        Some(remedy) => named.remedy(remedy),
        None => named,
    }
}

impl Scene {
    /// A scene that was made in memory: these surfaces under the sky that scene files have by default, without a sun, in a picture `width`
    /// pixels wide whose height follows from the film's shape, with 256 samples. The fields can be set afterwards; where the sun casts
    /// shadows [`Surfaces::prepare`] saves finding what stands before it with each picture.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid) for surfaces that [`Surfaces::check`] refuses and a width of 0;
    /// [`TooLarge`](crate::error::ErrorKind::TooLarge) when a side is more than [`MAX_PICTURE_SIDE`](super::MAX_PICTURE_SIDE) pixels.
    ///
    /// # Example
    /// ```
    /// use groundglass::scene::{Attributes, Material, NONE, Surfaces};
    /// use groundglass::{Camera, Execution, Optics, Scene, glam::DVec3, render};
    ///
    /// let camera = Camera::looking_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO)?;
    /// let mut surfaces = Surfaces { materials: vec![Material::default_surface()], ..Surfaces::default() };
    /// surfaces.positions = vec![DVec3::NEG_X, DVec3::X, DVec3::Y];
    /// surfaces.triangles.push([0, 1, 2]);
    /// surfaces.attributes.push(Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material: 0 });
    /// let scene = Scene::new(Optics::new(&camera)?, surfaces, 50)?;
    /// let (exposure, _) = render(&scene, Execution::default())?;
    /// assert_eq!((exposure.width(), exposure.height()), (50, 40));
    /// # Ok::<(), groundglass::Error>(())
    /// ```
    pub fn new(optics: Optics, mut surfaces: Surfaces, width: u32) -> Result<Self> {
        let film = optics.camera().film;
        let (width, height) = picture_size(width, [film.width, film.height].map(Length::as_metres))?;
        surfaces.prepare(false)?;
        Ok(Self {
            blades: None,
            up: DVec3::Y,
            circle_of_confusion: Length::metres(film.usual_circle()),
            surfaces,
            sun: None,
            sky: Sky::default(),
            render: PictureSettings::new(width, height),
            meshes: Vec::new(),
            warnings: Vec::new(),
            assets_digest: [0; 32],
            optics,
        })
    }

    /// Reads the scene file at `path` and the files it names.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid) and [`NoSolution`](crate::error::ErrorKind::NoSolution) with file, line and key when a file is missing or wrong,
    /// or no movement focuses as asked; [`Io`](crate::error::ErrorKind::Io) when one cannot be read.
    ///
    /// # Example
    /// ```
    /// let scene = groundglass::Scene::read("examples/tower.toml")?;
    /// assert_eq!(scene.meshes[0].triangles, 47_346);
    /// # Ok::<(), groundglass::Error>(())
    /// ```
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let (files, name) = (Files::new(), path.as_ref().display().to_string());
        let named = |error: Error| error.in_file(&*name);
        let file = files.argument(path.as_ref()).map_err(named)?;
        let bytes = files.read(&file, SIZE_LIMIT as u64 + 1).map_err(named)?;
        let description = SceneFile::from_document(Document::from_bytes(&bytes, &name)?)?.describe()?;
        description.load(&files, file.parent().unwrap_or(Path::new("")), None)
    }

    /// The aperture's shape.
    pub fn aperture_shape(&self) -> ApertureShape {
        self.blades.map_or(ApertureShape::Disk, |blades| blades.shape())
    }

    /// The hash of the resolved scene and the bytes of its assets, not their paths: SHA-256 in hexadecimal. How good the
    /// picture is to be does not change it.
    pub fn hash(&self) -> String {
        let render = PictureSettings { budget: Budget::Samples(1), ..self.render };
        let mut text = format!(
            "{:?} {:?} {:?} {:?} {:?} {:?} {render:?} ",
            self.optics.camera(),
            self.blades,
            self.up,
            self.circle_of_confusion,
            self.sun,
            self.sky,
        );
        for mesh in &self.meshes {
            text.push_str(&format!("{:?} {:?} ", mesh.placement, mesh.bounds));
        }
        let mut bytes = text.into_bytes();
        bytes.extend_from_slice(&self.assets_digest);
        digest::of_bytes(&bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
