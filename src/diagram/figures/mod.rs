//! The kinds of figures: one file a kind, named like it, and the table that lists them. In: a figure file whose keys
//! have been checked. Out: a [`Figure`].
//!
//! A new kind is a file here with a struct of its keys and a function `draw`, a line in [`KINDS`], and a commented
//! figure `diagrams/KIND.toml` with its SVG.

mod accumulation;
mod aperture_samples;
mod both_rules;
mod exact_blur;
mod figure_1;
pub(crate) mod file;
mod film_tilt_vs_lens_tilt;
mod focus_sweep;
mod heat_map;
mod heat_map_grid;
mod heat_map_keys;
mod hinge;
pub(crate) mod keys;
mod limits;
mod limits_compared;
mod movements;
mod perspective_correction;
mod picture;
mod pictures;
mod plot;
mod plot_axis;
mod plot_chart;
mod plot_data;
mod plot_frame;
mod plot_keys;
mod plot_marks;
mod plot_names;
mod plot_series;
mod scheimpflug;
pub(crate) mod side_view;
mod solve;
mod stage;
mod tilt_sweep;
mod view_pair;
mod wedge;

use super::Figure;
use crate::error::{Error, Result};
use crate::scene::{nearest, schema_of};
use file::Input;
use serde_json::{Map, Value};

/// A kind of figure.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// What `kind = ".."` says.
    pub name: &'static str,
    /// What it shows, in a line.
    pub line: &'static str,
    /// A commented figure file of this kind, which `groundglass diagram --new` writes.
    pub starter: &'static str,
    /// The keys of that file that name files which nobody but its reader has.
    pub needs: &'static [&'static str],
    /// The schemas of the structs that hold its keys.
    keys: &'static [fn() -> Value],
    draw: fn(&Input) -> Result<Figure>,
}

macro_rules! kind {
    ($name:literal, $line:literal, $draw:path, [$($keys:ty),*]) => {
        Kind {
            name: $name,
            line: $line,
            starter: include_str!(concat!("../../../diagrams/", $name, ".toml")),
            needs: &[],
            keys: &[schema_of::<keys::PageKeys>, $(schema_of::<$keys>),*],
            draw: $draw,
        }
    };
}

/// All kinds, in the book's order.
pub const KINDS: &[Kind] = &[
    kind!(
        "side-view",
        "a camera in section: planes, lines, depth of field, rays and subject",
        side_view::draw,
        [keys::CameraKeys, side_view::Keys]
    ),
    kind!(
        "scheimpflug",
        "the rule of Scheimpflug: film, lens and focus planes share a line",
        scheimpflug::draw,
        [keys::CameraKeys, stage::SectionKeys]
    ),
    kind!(
        "hinge",
        "the hinge rule: where the focus plane turns when the camera is focused",
        hinge::draw,
        [keys::CameraKeys, stage::SectionKeys]
    ),
    kind!(
        "both-rules",
        "how the two rules together fix the focus plane, step by step",
        both_rules::draw,
        [keys::CameraKeys, stage::SectionKeys]
    ),
    kind!(
        "focus-sweep",
        "the focus plane turning about the hinge line as the extension changes",
        focus_sweep::draw,
        [keys::CameraKeys, stage::SectionKeys, focus_sweep::Keys]
    ),
    kind!(
        "tilt-sweep",
        "the focus plane as the lens tilts, and where the hinge line goes",
        tilt_sweep::draw,
        [keys::CameraKeys, stage::SectionKeys, tilt_sweep::Keys]
    ),
    kind!(
        "film-tilt-vs-lens-tilt",
        "one focus plane reached both ways: by the lens and by the film",
        film_tilt_vs_lens_tilt::draw,
        [keys::CameraKeys, stage::SectionKeys]
    ),
    kind!(
        "wedge",
        "depth of field for several apertures, and the circle of confusion at the film",
        wedge::draw,
        [keys::CameraKeys, stage::SectionKeys, wedge::Keys]
    ),
    kind!(
        "aperture-samples",
        "the points of the lens that a picture is made through",
        aperture_samples::draw,
        [keys::CameraKeys, aperture_samples::Keys]
    ),
    kind!(
        "movements",
        "the eight movements of both standards, with the sign each has here",
        movements::draw,
        [keys::CameraKeys, movements::Keys]
    ),
    Kind {
        needs: &["scenes"],
        ..kind!(
            "figure-1",
            "the three panels of the 2004 paper: nothing, the lens, the film tilted",
            figure_1::draw,
            [figure_1::Keys]
        )
    },
    kind!(
        "accumulation",
        "one picture for each lens point, and what they add up to at the film",
        accumulation::draw,
        [keys::CameraKeys, stage::SectionKeys, accumulation::Keys]
    ),
    kind!(
        "perspective-correction",
        "looking up against rising: how upright edges converge, or do not",
        perspective_correction::draw,
        [keys::CameraKeys, perspective_correction::Keys]
    ),
    kind!(
        "exact-blur",
        "contours of the exact blur beside the wedge, and their difference in per cent",
        exact_blur::draw,
        [keys::CameraKeys, stage::SectionKeys, exact_blur::Keys]
    ),
    kind!(
        "limits-compared",
        "wedge, exact contour, Merklinger's and the untilted formula on one page",
        limits_compared::draw,
        [keys::CameraKeys, stage::SectionKeys]
    ),
    kind!(
        "solve",
        "a wanted plane and the movements found; one that cannot be had, and why",
        solve::draw,
        [keys::CameraKeys, stage::SectionKeys, solve::Keys]
    ),
    Kind {
        needs: &["scene", "picture"],
        ..kind!(
            "view-pair",
            "a rendered picture with its diagram beside it, the sharp line marked in both",
            view_pair::draw,
            [keys::CameraKeys, stage::SectionKeys, view_pair::Keys]
        )
    },
    Kind {
        needs: &["pictures"],
        ..kind!(
            "pictures",
            "pictures side by side with their names, to be compared",
            pictures::draw,
            [pictures::Keys]
        )
    },
    kind!("plot", "a chart of numbers from CSV or JSON, with error bars", plot::draw, [plot_keys::Keys]),
    Kind {
        needs: &["data"],
        ..kind!(
            "heat-map",
            "maps of a number over two axes, side by side, from CSV or JSON",
            heat_map::draw,
            [heat_map_keys::Keys]
        )
    },
];

impl Kind {
    /// The kind of this name.
    ///
    /// # Errors
    /// When there is none; the error names the nearest.
    pub fn named(name: &str) -> Result<&'static Self> {
        KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
            let shown: String = name.chars().take(60).collect();
            let all: Vec<_> = KINDS.iter().map(|kind| kind.name).collect();
            let hint = nearest(&shown, all.iter().copied());
            let hint = hint.map_or(String::new(), |near| format!("did you mean \"{near}\"? "));
            Error::invalid(format!("unknown kind of figure \"{shown}\""))
                .at_key("kind")
                .remedy(format!("{hint}known: {}", all.join(", ")))
        })
    }

    /// The JSON schema of its figure files, without references.
    pub(crate) fn schema(&self) -> Value {
        let mut properties = Map::new();
        let mut required = Vec::new();
        for keys in self.keys {
            let Value::Object(mut part) = keys() else { continue };
            if let Some(Value::Object(own)) = part.remove("properties") {
                properties.extend(own);
            }
            if let Some(Value::Array(own)) = part.remove("required") {
                required.extend(own);
            }
        }
        if let Some(Value::Object(kind)) = properties.get_mut("kind") {
            kind.insert("enum".into(), Value::Array(vec![self.name.into()]));
        }
        serde_json::json!({
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": format!("groundglass `{}` figure", self.name),
            "description": self.line,
            "type": "object",
            "properties": properties,
            "required": required,
            "additionalProperties": false,
        })
    }
}

/// The JSON schema (draft 2020-12) of figure files of all kinds, pretty-printed, with a newline at its end.
pub fn schema() -> String {
    let kinds: Vec<Value> = KINDS.iter().map(Kind::schema).collect();
    let all = serde_json::json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "groundglass figure",
        "oneOf": kinds,
    });
    format!("{all:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_every_kind_has_a_description_and_an_example() {
        fn walk(path: &str, table: &Value) {
            let Some(properties) = table.get("properties").and_then(Value::as_object) else { return };
            for (key, value) in properties {
                let path = format!("{path}.{key}");
                assert!(value["description"].is_string(), "{path} has no description");
                let tables = value["type"] == "array" && value["items"]["type"] == "object";
                let inner = if tables { &value["items"] } else { value };
                if inner["type"] != "object" {
                    assert!(inner["examples"][0] != Value::Null, "{path} has no example");
                }
                walk(&path, inner);
            }
        }
        for kind in KINDS {
            walk(kind.name, &kind.schema());
        }
        assert!(!schema().contains("null") && !schema().contains("$ref"));
    }

    #[test]
    fn kinds_have_names_of_their_own_and_a_starter_that_says_so() {
        for (i, kind) in KINDS.iter().enumerate() {
            assert!(KINDS.iter().take(i).all(|other| other.name != kind.name));
            assert!(kind.starter.starts_with('#'), "{} opens with a comment", kind.name);
            assert!(kind.starter.contains(&format!("kind = \"{}\"", kind.name)));
            assert!(kind.line.len() < 80);
        }
        assert!(Kind::named("side-veiw").unwrap_err().to_string().contains("did you mean \"side-view\"?"));
    }
}
