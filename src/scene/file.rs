//! The scene file as written: one struct per TOML table, in the file's own units. In: text; out: a
//! [`SceneFile`] whose keys, types and ranges are right. The docs and examples of the fields are
//! what `groundglass schema` prints and what errors quote. Values that exclude each other are
//! judged later, in `validate`.

use super::document::Document;
use super::{schema, shape};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scene file: its tables and the text they came from.
#[derive(Clone, Debug)]
pub struct SceneFile {
    pub(crate) document: Document,
    pub(crate) tables: SceneTables,
}

/// Reads the text of a scene; `file_name` is what errors call it.
///
/// # Errors
/// [`Invalid`](crate::error::ErrorKind::Invalid), with line, column, key and remedy: not TOML, an unknown key, a
/// missing one, a wrong type, a number out of range. [`TooLarge`](crate::error::ErrorKind::TooLarge)
/// beyond [`SIZE_LIMIT`](super::SIZE_LIMIT).
pub fn parse(text: &str, file_name: &str) -> Result<SceneFile> {
    SceneFile::from_document(Document::from_bytes(text.as_bytes(), file_name)?)
}

impl SceneFile {
    /// Reads a scene from a document; errors as for [`parse`].
    ///
    /// # Errors
    /// As for [`parse`].
    pub fn from_document(document: Document) -> Result<Self> {
        let table = document.table()?;
        if let Some((key, _)) = table.get_ref().get_key_value("kind") {
            return Err(Error::invalid("this is a figure, not a scene: it has a top-level `kind`")
                .at(document.place_of_range(key.span(), Some("kind")))
                .remedy("draw figures with `groundglass diagram`, or remove `kind`"));
        }
        shape::check(&document, table.get_ref(), schema::value())?;
        let tables = document.keys(table)?;
        Ok(Self { document, tables })
    }

    /// The text and its places.
    pub fn document(&self) -> &Document {
        &self.document
    }
}

/// A groundglass scene. Lengths of the camera are millimetres (`_mm`), those of the world metres (`_m`),
/// angles degrees (`_deg`); the world is right-handed.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "groundglass scene")]
pub(crate) struct SceneTables {
    /// The camera: place, lens, film and movements.
    pub(crate) camera: CameraTable,
    /// What shall be sharp. With a target the extension is solved for, and for a plane or points one standard's tilt and swing too.
    pub(crate) focus: Option<FocusTable>,
    /// One table for each OBJ file of the scene.
    #[serde(default)]
    pub(crate) mesh: Vec<MeshTable>,
    /// The sun; without this table there is none.
    pub(crate) sun: Option<SunTable>,
    /// Light from everywhere, and the background.
    #[serde(default)]
    pub(crate) sky: SkyTable,
    /// Size and quality of the picture.
    #[serde(default)]
    pub(crate) render: RenderTable,
}

/// The camera: place, lens, film and movements.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraTable {
    /// Origin of the rail frame, the lens centre of the camera without movements; world metres.
    #[schemars(inner(range(min = -1e12, max = 1e12)), example = vec![0.0, 1.6, 10.0])]
    pub(crate) eye_m: [f64; 3],
    /// A point the rail points at; world metres.
    #[schemars(inner(range(min = -1e12, max = 1e12)), example = vec![0.0, 1.6, 0.0])]
    pub(crate) look_at_m: [f64; 3],
    /// The world's upward direction, of any length; the rail's +y and the sky follow it.
    #[serde(default = "up")]
    #[schemars(example = vec![0.0, 1.0, 0.0])]
    pub(crate) up: [f64; 3],
    /// Focal length in millimetres.
    #[schemars(range(min = 1e-6, max = 1e9), example = 150.0)]
    pub(crate) focal_length_mm: f64,
    /// Focal length over aperture diameter. This or `pinhole = true`.
    #[schemars(range(min = 1e-6, max = 1e9), example = 5.6)]
    pub(crate) f_number: Option<f64>,
    /// An aperture without extent: everything is sharp. This or `f_number`.
    #[schemars(example = true)]
    pub(crate) pinhole: Option<bool>,
    /// Width and height of the film in millimetres. This or `film`.
    #[schemars(inner(range(min = 1e-6, max = 1e9)), example = vec![120.0, 96.0])]
    pub(crate) film_mm: Option<[f64; 2]>,
    /// A film format by name. This or `film_mm`.
    #[serde(default)]
    #[schemars(schema_with = "schema::film_names")]
    pub(crate) film: Option<String>,
    /// From the lens to the film along the rail, in millimetres. A target in [focus] replaces it.
    #[schemars(range(min = 1e-9, max = 1e18), example = 152.3)]
    pub(crate) extension_mm: Option<f64>,
    /// Nearest distance along the lens axis that the lens sees, in metres; a tenth of the focal length by default.
    #[schemars(range(min = 1e-12, max = 1e9), example = 0.015)]
    pub(crate) near_m: Option<f64>,
    /// Movements of the front standard, which carries the lens.
    #[serde(default)]
    pub(crate) front: StandardTable,
    /// Movements of the rear standard, which carries the film.
    #[serde(default)]
    pub(crate) rear: StandardTable,
    /// The shape of the aperture; a disk by default.
    pub(crate) aperture: Option<ApertureTable>,
}

/// Movements of one standard.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct StandardTable {
    /// Positive leans the top of the standard toward the subject; degrees.
    #[schemars(range(min = -360.0, max = 360.0), example = 6.0)]
    pub(crate) tilt_deg: f64,
    /// Positive turns the subject side of the standard to the right; degrees.
    #[schemars(range(min = -360.0, max = 360.0), example = -4.0)]
    pub(crate) swing_deg: f64,
    /// Upward along the rail's +y, in millimetres.
    #[schemars(range(min = -1e9, max = 1e9), example = 20.0)]
    pub(crate) rise_mm: f64,
    /// To the right along the rail's +x, in millimetres.
    #[schemars(range(min = -1e9, max = 1e9), example = 10.0)]
    pub(crate) shift_mm: f64,
}

/// The shape of the aperture: a regular polygon with its corners on the circle of diameter focal length / f-number.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ApertureTable {
    /// Number of blades, the polygon's corners.
    #[schemars(range(min = 3, max = 1000), example = 7)]
    pub(crate) blades: u32,
    /// 0: a corner at the top; positive turns +ey toward +ex; degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), example = 10.0)]
    pub(crate) rotation_deg: f64,
}

/// What shall be sharp: at most one of `distance_m`, `plane`, `points_m`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FocusTable {
    /// The focus plane crosses the lens axis at this distance from the lens, in metres; `inf` is allowed.
    #[schemars(extend("exclusiveMinimum" = 0, "x-infinite" = true), example = 8.0)]
    pub(crate) distance_m: Option<f64>,
    /// The wanted focus plane.
    pub(crate) plane: Option<PlaneTable>,
    /// Three points of the wanted focus plane, not on one line; world metres.
    #[schemars(inner(inner(range(min = -1e12, max = 1e12))), example = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -5.0]])]
    pub(crate) points_m: Option<[[f64; 3]; 3]>,
    /// For `plane` and `points_m`: which standard the solver turns; `front` by default.
    #[schemars(example = &"front")]
    pub(crate) adjust: Option<AdjustWord>,
    /// Largest blur on the film that counts as sharp, its diameter in millimetres; film diagonal / 1500 by default.
    #[schemars(range(min = 1e-9, max = 1e9), example = 0.1)]
    pub(crate) circle_of_confusion_mm: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum AdjustWord {
    Front,
    Rear,
}

/// The wanted focus plane.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlaneTable {
    /// A point of the plane; world metres.
    #[schemars(inner(range(min = -1e12, max = 1e12)), example = vec![0.0, 0.0, 0.0])]
    pub(crate) point_m: [f64; 3],
    /// The direction square to the plane, of any length.
    #[schemars(example = vec![0.0, 1.0, 0.0])]
    pub(crate) normal: [f64; 3],
}

/// An OBJ file and where it stands: world = translate + Ry(rotate_y) (scale * vertex).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MeshTable {
    /// The OBJ file, relative to the scene file.
    #[schemars(length(min = 1), example = &"tower.obj")]
    pub(crate) path: String,
    /// Metres per unit of the OBJ.
    #[serde(default = "one")]
    #[schemars(range(min = 1e-12, max = 1e12), example = 1.0)]
    pub(crate) scale: f64,
    /// A turn about the world's y axis; degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), example = 30.0)]
    pub(crate) rotate_y_deg: f64,
    /// Where the OBJ's origin comes to stand; world metres.
    #[serde(default)]
    #[schemars(inner(range(min = -1e12, max = 1e12)), example = vec![0.0, 0.0, -2.0])]
    pub(crate) translate_m: [f64; 3],
}

/// The sun.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SunTable {
    /// From the scene to the sun, of any length.
    #[schemars(example = vec![0.4, 1.0, 0.3])]
    pub(crate) toward: [f64; 3],
    /// Its light on a surface square to it; linear red, green, blue.
    #[schemars(inner(range(min = 0.0, max = 1e9)), example = vec![0.8, 0.77, 0.7])]
    pub(crate) color: [f64; 3],
    /// Whether surfaces cast shadows.
    #[serde(default)]
    #[schemars(example = true)]
    pub(crate) shadows: bool,
    /// Angular diameter of its disk, which softens shadows; degrees.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 180.0), example = 0.53)]
    pub(crate) angular_diameter_deg: f64,
}

/// Light from everywhere, and the background; linear red, green, blue.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SkyTable {
    /// Light that reaches every surface.
    #[schemars(inner(range(min = 0.0, max = 1e9)), example = vec![0.25, 0.28, 0.33])]
    pub(crate) ambient: [f64; 3],
    /// Background at and below the horizon.
    #[schemars(inner(range(min = 0.0, max = 1e9)), example = vec![0.75, 0.82, 0.9])]
    pub(crate) horizon: [f64; 3],
    /// Background straight up.
    #[schemars(inner(range(min = 0.0, max = 1e9)), example = vec![0.25, 0.45, 0.8])]
    pub(crate) zenith: [f64; 3],
}

/// Size and quality of the picture: at most one of `samples`, `max_error`, `time_budget_s` (none: 256 samples).
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RenderTable {
    /// Width of the picture in pixels; the height follows from the film's shape.
    #[schemars(range(min = 1, max = 32767), example = 960)]
    pub(crate) width: u32,
    /// Samples for each pixel, exactly; 256 when neither `max_error` nor `time_budget_s` is given.
    #[schemars(range(min = 1, max = 1_048_576), example = 256)]
    pub(crate) samples: Option<u32>,
    /// Stop at this error: root mean square over the picture, linear light.
    #[schemars(extend("exclusiveMinimum" = 0), example = 0.004)]
    pub(crate) max_error: Option<f64>,
    /// Stop after this time; seconds.
    #[schemars(extend("exclusiveMinimum" = 0), example = 2.0)]
    pub(crate) time_budget_s: Option<f64>,
    /// Brightens the PNG by this many stops.
    #[schemars(range(min = -100.0, max = 100.0), example = 0.5)]
    pub(crate) exposure_ev: f64,
    /// Whether the corners darken as they do in a camera.
    #[schemars(example = true)]
    pub(crate) falloff: bool,
    /// Whether light bends at the aperture (550 nm); refused with a pinhole.
    #[schemars(example = true)]
    pub(crate) diffraction: bool,
    /// Chooses other samples, for an independent picture of the same scene.
    #[schemars(example = 0)]
    pub(crate) seed: u64,
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

fn one() -> f64 {
    1.0
}

impl Default for SkyTable {
    fn default() -> Self {
        Self { ambient: [0.25, 0.28, 0.33], horizon: [0.75, 0.82, 0.9], zenith: [0.25, 0.45, 0.8] }
    }
}

impl Default for RenderTable {
    fn default() -> Self {
        Self {
            width: 960,
            samples: None,
            max_error: None,
            time_budget_s: None,
            exposure_ev: 0.0,
            falloff: false,
            diffraction: false,
            seed: 0,
        }
    }
}
