//! The keys of a heat map as written in its figure file. Their docs and examples are what `groundglass schema --figures`
//! prints and what errors quote.

use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says beside the page.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// The table: .csv, .tsv or .json, relative to this file. Each row is a cell; all together fill a grid.
    #[schemars(length(min = 1), example = &"error.csv")]
    pub(crate) data: String,
    /// Where in a JSON file the table stands, as a JSON pointer.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"/runs")]
    pub(crate) table: Option<String>,
    /// The axis from left to right.
    pub(crate) x: AxisKeys,
    /// The axis upward.
    pub(crate) y: AxisKeys,
    /// Maps side by side, of one table and to one scale of colours.
    #[schemars(length(min = 1, max = 6))]
    pub(crate) panel: Vec<PanelKeys>,
    /// Where one colour ends and the next begins, rising.
    #[schemars(length(min = 1, max = 16), example = vec![1e-12, 1e-8, 1e-4])]
    pub(crate) bands: Vec<f64>,
    /// What the colours measure.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"relative error")]
    pub(crate) value: Option<String>,
    /// What an empty cell means.
    #[serde(default = "none")]
    #[schemars(length(min = 1), example = &"no answer")]
    pub(crate) nothing: String,
}

/// An axis.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct AxisKeys {
    /// The column with its values.
    #[schemars(length(min = 1), example = &"tilt")]
    pub(crate) column: String,
    /// What is measured along it, with its unit.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"tilt (degrees)")]
    pub(crate) title: Option<String>,
    /// How values run along it.
    #[serde(default)]
    #[schemars(extend("enum" = ["linear", "log"]), example = &"log")]
    pub(crate) scale: Option<String>,
    /// Values with a tick, in place of round ones or decades.
    #[serde(default)]
    #[schemars(example = vec![1e-12, 1e-6, 1.0])]
    pub(crate) ticks: Vec<f64>,
}

/// A map.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct PanelKeys {
    /// What it is called in the figure.
    #[schemars(length(min = 1), example = &"in double precision")]
    pub(crate) name: String,
    /// The column with its values.
    #[schemars(length(min = 1), example = &"double")]
    pub(crate) column: String,
}

fn none() -> String {
    "no value".into()
}
