//! Keys that kinds of figures share, as written in the file: the page, and the camera with its subject. The docs and
//! examples of the fields are what `groundglass schema --figures` prints and what errors quote.

use crate::diagram::parts::PARTS;
use crate::diagram::theme::THEMES;
use crate::scene::{CameraTable, FocusTable, MeshTable};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

/// Widths of columns and pages of common books and journals, in millimetres.
pub const PAGE_WIDTHS: [(&str, f64); 12] = [
    ("acm-column", 84.7),
    ("acm-page", 177.8),
    ("elsevier-column", 90.0),
    ("elsevier-half", 140.0),
    ("elsevier-page", 190.0),
    ("ieee-column", 88.9),
    ("ieee-page", 181.9),
    ("lncs-page", 122.0),
    ("nature-column", 89.0),
    ("nature-page", 183.0),
    ("springer-column", 84.0),
    ("springer-page", 174.0),
];

/// The page of a figure.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct PageKeys {
    /// What is drawn; `groundglass diagram --list` lists the kinds.
    #[schemars(example = &"side-view")]
    #[allow(dead_code, reason = "read before the keys are")]
    pub(crate) kind: String,
    /// A title over the figure. Variables stand between asterisks, an index after `_`: `*f* = 150 mm`, `y_n`.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"The lens tilted by six degrees")]
    pub(crate) title: Option<String>,
    /// The colours: print, screen, dark, text, contrast or grey.
    #[serde(default)]
    #[schemars(schema_with = "theme_names")]
    pub(crate) theme: Option<String>,
    /// Width of the page in millimetres; letters and lines keep their size. This or `width`.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 2000.0), example = 160.0)]
    pub(crate) width_mm: Option<f64>,
    /// Width of the page by name: a column or page of a common book or journal. This or `width_mm`.
    #[serde(default)]
    #[schemars(schema_with = "width_names")]
    pub(crate) width: Option<String>,
    /// Height of the page in millimetres; by default it suits the width.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 2000.0), example = 100.0)]
    pub(crate) height_mm: Option<f64>,
    /// Whether the page is painted; without, it is transparent.
    #[serde(default = "yes")]
    #[schemars(example = false)]
    pub(crate) paper: bool,
}

/// The camera: from a scene file, or as in one.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct CameraKeys {
    /// A scene file whose camera and meshes are drawn, relative to this file. This or [camera].
    #[serde(default)]
    #[schemars(length(min = 1), example = &"../examples/tower.toml")]
    pub(crate) scene: Option<String>,
    /// The camera, as in a scene file. This or `scene`.
    #[serde(default)]
    pub(crate) camera: Option<CameraTable>,
    /// What shall be sharp, as in a scene file.
    #[serde(default)]
    pub(crate) focus: Option<FocusTable>,
    /// OBJ files that are the subject, as in a scene file.
    #[serde(default)]
    pub(crate) mesh: Vec<MeshTable>,
}

fn yes() -> bool {
    true
}

fn theme_names(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<_> = THEMES.iter().map(|theme| theme.0).collect();
    json_schema!({ "type": "string", "enum": names, "examples": ["print"] })
}

fn width_names(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<_> = PAGE_WIDTHS.iter().map(|width| width.0).collect();
    json_schema!({ "type": "string", "enum": names, "examples": ["ieee-column"] })
}

/// The parts that can be left out.
pub(crate) fn part_names(_: &mut SchemaGenerator) -> Schema {
    let names = json_schema!({ "type": "string", "enum": PARTS });
    json_schema!({ "type": "array", "items": names, "examples": [["bellows", "wedge"]] })
}
