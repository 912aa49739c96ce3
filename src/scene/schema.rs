//! The JSON schema of the scene file, generated from its mirror structs, so that what an editor
//! completes, what `groundglass schema` prints and what the reader accepts are one thing.

use super::file::SceneTables;
use crate::camera::FILM_FORMATS;
use schemars::generate::{Contract, SchemaSettings};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value};
use std::sync::OnceLock;

/// The JSON schema (draft 2020-12) of the scene file, pretty-printed, with a newline at its end.
pub fn schema() -> String {
    // `{:#}` of a JSON value is its pretty form and cannot fail.
    format!("{:#}\n", value())
}

/// The schema as a tree; without references, so that it can be walked beside a file.
pub(crate) fn value() -> &'static Value {
    static VALUE: OnceLock<Value> = OnceLock::new();
    VALUE.get_or_init(|| {
        let mut value = of::<SceneTables>();
        exclusive_keys(&mut value);
        value
    })
}

/// The schema of one mirror struct, in the form that [`super::shape`] reads.
pub(crate) fn of<T: JsonSchema>() -> Value {
    let mut settings = SchemaSettings::draft2020_12();
    settings.inline_subschemas = true;
    settings.contract = Contract::Deserialize;
    let mut value = settings.into_generator().into_root_schema_for::<T>().to_value();
    without_null(&mut value);
    value
}

/// The film formats by name, each also turned.
pub(crate) fn film_names(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<String> = FILM_FORMATS
        .iter()
        .flat_map(|(name, ..)| [(*name).to_string(), format!("{name}-portrait")])
        .collect();
    json_schema!({ "type": "string", "enum": names, "examples": ["4x5"] })
}

/// TOML has no null: an optional key is one that may be absent.
fn without_null(value: &mut Value) {
    match value {
        Value::Object(map) => {
            if map.get("default").is_some_and(|default| default.is_null()) {
                map.remove("default");
            }
            if let Some(Value::Object(table)) = map.get_mut("default") {
                table.retain(|_, value| !value.is_null());
            }
            if let Some(Value::Array(types)) = map.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    map.insert("type".into(), only);
                }
            }
            if let Some(Value::Array(words)) = map.get_mut("enum") {
                words.retain(|word| !word.is_null());
            }
            if let Some(Value::Array(any)) = map.remove("anyOf") {
                // What schemars makes of an optional table or word: itself, or null.
                for part in any {
                    if let Value::Object(part) = part
                        && part.get("type") != Some(&Value::from("null"))
                    {
                        for (key, inner) in part {
                            map.entry(key).or_insert(inner);
                        }
                    }
                }
            }
            map.values_mut().for_each(without_null);
        }
        Value::Array(items) => items.iter_mut().for_each(without_null),
        _ => {}
    }
}

/// Says which keys exclude each other, for editors; the reader says it better, in `validate`.
fn exclusive_keys(root: &mut Value) {
    fn one(keys: [&str; 2]) -> Value {
        let options: Vec<Value> = keys.iter().map(|key| serde_json::json!({ "required": [key] })).collect();
        serde_json::json!({ "oneOf": options })
    }
    fn at_most_one(keys: [&str; 3]) -> Value {
        let pairs: Vec<Value> = [(0, 1), (0, 2), (1, 2)]
            .iter()
            .map(|&(a, b)| serde_json::json!({ "not": { "required": [keys[a], keys[b]] } }))
            .collect();
        Value::Array(pairs)
    }
    let mut set = |table: &str, rules: Value| {
        if let Some(Value::Object(map)) = root.pointer_mut(&format!("/properties/{table}")) {
            Map::insert(map, "allOf".into(), rules);
        }
    };
    set("camera", Value::Array(vec![one(["film_mm", "film"])]));
    set("focus", at_most_one(["distance_m", "plane", "points_m"]));
    set("render", at_most_one(["samples", "max_error", "time_budget_s"]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_a_description_and_every_value_an_example() {
        fn walk(path: &str, table: &Value) {
            let Some(properties) = table.get("properties").and_then(Value::as_object) else { return };
            assert_eq!(table["additionalProperties"], false, "{path}");
            for (key, value) in properties {
                let path = format!("{path}.{key}");
                assert!(value["description"].is_string(), "{path} has no description");
                let inner = if value["type"] == "array" && value["items"]["type"] == "object" {
                    &value["items"]
                } else {
                    value
                };
                assert!(inner["type"].is_string(), "{path}: {inner}");
                if inner["type"] != "object" {
                    assert!(inner["examples"][0] != Value::Null, "{path} has no example");
                }
                walk(&path, inner);
            }
        }
        walk("", value());
        assert!(!schema().contains("null") && !schema().contains("$ref"), "{}", schema());
    }
}
