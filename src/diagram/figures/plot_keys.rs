//! The keys of a chart as written in its figure file. Their docs and examples are what `groundglass schema --figures` prints and
//! what errors quote.

use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says beside the page.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// A table that series take columns from: .csv, .tsv or .json, relative to this file.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"error.csv")]
    pub(crate) data: Option<String>,
    /// Where in a JSON file the table stands, as a JSON pointer.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"/runs")]
    pub(crate) table: Option<String>,
    /// Where names stand: at the lines' `ends`, in a `legend`, nowhere (`none`), or as it suits (`auto`).
    #[serde(default = "auto")]
    #[schemars(extend("enum" = ["auto", "ends", "legend", "none"]), example = &"auto")]
    pub(crate) names: String,
    /// The axis from left to right.
    #[serde(default)]
    pub(crate) x: AxisKeys,
    /// The axis upward.
    #[serde(default)]
    pub(crate) y: AxisKeys,
    /// A line or a row of points.
    #[schemars(length(min = 1))]
    pub(crate) series: Vec<SeriesKeys>,
    /// A straight line that helps to read the chart.
    #[serde(default)]
    pub(crate) guide: Vec<GuideKeys>,
}

/// An axis.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct AxisKeys {
    /// What is measured along it; variables between asterisks.
    #[schemars(length(min = 1), example = &"samples *N* for each pixel")]
    pub(crate) title: Option<String>,
    /// The unit, written after the title.
    #[schemars(length(min = 1), example = &"s")]
    pub(crate) unit: Option<String>,
    /// How values run along it.
    #[schemars(extend("enum" = ["linear", "log"]), example = &"log")]
    pub(crate) scale: Option<String>,
    /// Where it begins; by default at a round value below all data.
    #[schemars(example = 1.0)]
    pub(crate) min: Option<f64>,
    /// Where it ends; by default at a round value above all data.
    #[schemars(example = 1000.0)]
    pub(crate) max: Option<f64>,
    /// Values with a tick, in place of 1, 2, 5 or decades.
    #[schemars(example = vec![16.0, 64.0, 256.0])]
    pub(crate) ticks: Vec<f64>,
}

/// A line or a row of points.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct SeriesKeys {
    /// What it is called in the figure.
    #[schemars(length(min = 1), example = &"16 samples")]
    pub(crate) name: String,
    /// A table of its own, in place of the figure's.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"error.csv")]
    pub(crate) data: Option<String>,
    /// Where in its JSON file the table stands, as a JSON pointer.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"/runs")]
    pub(crate) table: Option<String>,
    /// Values from left to right. This or `x_column`.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![16.0, 64.0])]
    pub(crate) x: Option<Vec<f64>>,
    /// Values upward. This or `y_column`.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![0.1, 0.05])]
    pub(crate) y: Option<Vec<f64>>,
    /// Half the length of each point's error bar.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![0.01, 0.005])]
    pub(crate) error: Option<Vec<f64>>,
    /// Where each point's error bar begins; with `high`, in place of `error`.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![0.09, 0.045])]
    pub(crate) low: Option<Vec<f64>>,
    /// Where each point's error bar ends.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![0.12, 0.055])]
    pub(crate) high: Option<Vec<f64>>,
    /// Where each point's level error bar begins, in values of x.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![15.0, 60.0])]
    pub(crate) x_low: Option<Vec<f64>>,
    /// Where each point's level error bar ends.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec![17.0, 70.0])]
    pub(crate) x_high: Option<Vec<f64>>,
    /// The column of the table with the values from left to right.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"samples")]
    pub(crate) x_column: Option<String>,
    /// The column with the values upward.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"rms")]
    pub(crate) y_column: Option<String>,
    /// The column with half the length of each error bar.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"sigma")]
    pub(crate) error_column: Option<String>,
    /// The column with the lower ends of the error bars.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"least")]
    pub(crate) low_column: Option<String>,
    /// The column with the upper ends of the error bars.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"most")]
    pub(crate) high_column: Option<String>,
    /// The column with the left ends of the level error bars.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"soonest")]
    pub(crate) x_low_column: Option<String>,
    /// The column with the right ends of the level error bars.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"latest")]
    pub(crate) x_high_column: Option<String>,
    /// What is written beside each point; nothing where it is empty.
    #[serde(default)]
    #[schemars(length(min = 1), example = vec!["first", "second"])]
    pub(crate) labels: Option<Vec<String>>,
    /// The column with what is written beside each point.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"what")]
    pub(crate) labels_column: Option<String>,
    /// A column of which only the rows that say `only` are taken.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"method")]
    pub(crate) only_column: Option<String>,
    /// What `only_column` says in the rows taken.
    #[serde(default)]
    #[schemars(example = &"ours")]
    pub(crate) only: Option<String>,
    /// Whether its points are joined.
    #[serde(default = "yes")]
    #[schemars(example = false)]
    pub(crate) line: bool,
    /// Whether its points are marked; by default where they stand far enough apart.
    #[serde(default)]
    #[schemars(example = true)]
    pub(crate) markers: Option<bool>,
}

/// A straight line that helps to read the chart: `slope` with `through`, or `x`, or `y`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct GuideKeys {
    /// What it is called in the figure.
    #[serde(default)]
    #[schemars(length(min = 1), example = &"*N^{−1/2}*")]
    pub(crate) name: Option<String>,
    /// Its slope: of the logarithms where both axes are logarithmic.
    #[serde(default)]
    #[schemars(example = -0.5)]
    pub(crate) slope: Option<f64>,
    /// A point it passes through.
    #[serde(default)]
    #[schemars(example = vec![16.0, 0.1])]
    pub(crate) through: Option<[f64; 2]>,
    /// It is upright, at this value.
    #[serde(default)]
    #[schemars(example = 256.0)]
    pub(crate) x: Option<f64>,
    /// It is level, at this value.
    #[serde(default)]
    #[schemars(example = 0.004)]
    pub(crate) y: Option<f64>,
}

fn auto() -> String {
    "auto".into()
}

fn yes() -> bool {
    true
}
