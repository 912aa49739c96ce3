//! A parsed TOML against a JSON schema. In: document, table, schema (without references); out: nothing, or the
//! first thing that is wrong, with its place and remedy: an unknown key, a wrong type, a number out of
//! range, a missing key.
//!
//! Serde would find most of this, but says neither the path of the key nor what to write instead.

use super::document::Document;
use crate::error::{Error, Result};
use serde_json::Value;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// # Errors
/// [`Invalid`](crate::error::ErrorKind::Invalid) when `table` is not what `schema` describes.
pub(crate) fn check(document: &Document, table: &DeTable<'_>, schema: &Value) -> Result<()> {
    let mut walk = Walk { document, root: schema, first: None };
    walk.table("", table, 0..0, schema);
    walk.first.map_or(Ok(()), |(_, error)| Err(error))
}

struct Walk<'a> {
    document: &'a Document,
    root: &'a Value,
    /// The finding to report. Missing keys rank last: a misspelt key is the likely cause of one.
    first: Option<((bool, usize), Error)>,
}

impl Walk<'_> {
    fn offer(&mut self, missing: bool, span: Range<usize>, key: &str, make: impl FnOnce() -> Error) {
        let rank = (missing, span.start);
        if self.first.as_ref().is_none_or(|(best, _)| rank < *best) {
            let mut place = self.document.place_of_range(span.clone(), (!key.is_empty()).then_some(key));
            if span.is_empty() {
                // The document's root has no place in the text.
                (place.line, place.column, place.excerpt) = (None, None, None);
            }
            self.first = Some((rank, make().at(place)));
        }
    }

    /// `schema` describes a table with properties; the depth of calls is that of the schema.
    fn table(&mut self, path: &str, table: &DeTable<'_>, span: Range<usize>, schema: &Value) {
        // In the order of the text, so that the first finding is made only once, however many follow.
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        for (key, value) in entries {
            let name: &str = key.get_ref();
            if let Some(inner) = schema.get("properties").and_then(|properties| properties.get(name)) {
                self.value(&join(path, name), name, value, inner);
                continue;
            }
            // A key can be as long as the file.
            let shown: String = name.chars().take(60).collect();
            let root = self.root;
            self.offer(false, key.span(), &join(path, &shown), || {
                Error::invalid(format!("unknown key `{shown}`"))
                    .remedy(unknown_remedy(root, path, schema, &shown))
            });
        }
        for name in strings(schema.get("required")) {
            if !table.contains_key(name) {
                let inner = schema.pointer(&format!("/properties/{name}")).unwrap_or(&Value::Null);
                let message = if path.is_empty() {
                    let a_table = inner.get("properties").is_some();
                    let what = if a_table { format!("table [{name}]") } else { format!("key `{name}`") };
                    format!("the {what} is missing")
                } else {
                    format!("{} lacks the key `{name}`", bracketed(path))
                };
                let remedy = missing_remedy(name, inner);
                self.offer(true, span.clone(), &join(path, name), || Error::invalid(message).remedy(remedy));
            }
        }
    }

    fn value(&mut self, path: &str, name: &str, value: &Spanned<DeValue<'_>>, schema: &Value) {
        if let Err(message) = self.fits(path, value, schema) {
            let remedy = missing_remedy(name, schema).replacen("add", "for example", 1);
            self.offer(false, value.span(), path, || Error::invalid(message).remedy(remedy));
        }
    }

    /// Whether a value fits, looking into tables and arrays; `Err` says what is wrong with it.
    fn fits(&mut self, path: &str, value: &Spanned<DeValue<'_>>, schema: &Value) -> Result<(), String> {
        let expected = schema.get("type").and_then(Value::as_str).unwrap_or_default();
        match (expected, value.get_ref()) {
            ("object", DeValue::Table(table)) => {
                self.table(path, table, value.span(), schema);
                Ok(())
            }
            ("array", DeValue::Array(items)) => {
                let count = items.len() as u64;
                let bound = |name: &str| schema.get(name).and_then(Value::as_u64);
                let fits = bound("minItems").is_none_or(|least| count >= least)
                    && bound("maxItems").is_none_or(|most| count <= most);
                if !fits {
                    return Err(format!("expected {}, found {count}", describe(schema)));
                }
                let inner = schema.get("items").unwrap_or(&Value::Null);
                for (index, item) in items.iter().enumerate() {
                    if let Err(message) = self.fits(&format!("{path}[{index}]"), item, inner) {
                        // The mark goes to the item, the example shows the whole key.
                        let name = path.rsplit('.').next().unwrap_or(path);
                        let name = name.split('[').next().unwrap_or(name);
                        let remedy = self.example_of(path, name);
                        let key = format!("{path}[{index}]");
                        self.offer(false, item.span(), &key, || Error::invalid(message).remedy(remedy));
                        break;
                    }
                }
                Ok(())
            }
            ("number", DeValue::Float(_) | DeValue::Integer(_)) | ("integer", DeValue::Integer(_)) => {
                number(value.get_ref(), schema)
            }
            ("boolean", DeValue::Boolean(_)) => Ok(()),
            ("string", DeValue::String(word)) => string(word, schema),
            (_, found) => Err(format!("expected {}, found {}", describe(schema), type_name(found))),
        }
    }

    /// The remedy of the key at `path` (indices left out), for a wrong item of its array.
    fn example_of(&self, path: &str, name: &str) -> String {
        let mut schema = self.root;
        for step in path.split('.') {
            let key = step.split('[').next().unwrap_or(step);
            schema = schema.pointer(&format!("/properties/{key}")).unwrap_or(&Value::Null);
            if let Some(items) = schema.get("items")
                && items.get("properties").is_some()
            {
                schema = items;
            }
        }
        missing_remedy(name, schema).replacen("add", "for example", 1)
    }
}

fn number(value: &DeValue<'_>, schema: &Value) -> Result<(), String> {
    let number = match value {
        DeValue::Integer(integer) => {
            if let Ok(value) = i64::from_str_radix(integer.as_str(), integer.radix()) {
                value as f64
            } else {
                return Err("the number is too large".into());
            }
        }
        DeValue::Float(float) => float.as_str().parse::<f64>().unwrap_or(f64::NAN),
        _ => f64::NAN,
    };
    let infinite = schema.get("x-infinite").is_some();
    if number.is_nan() || (number.is_infinite() && !infinite) {
        return Err(format!("expected a finite number, found {number}"));
    }
    let bound = |name: &str| schema.get(name).and_then(Value::as_f64);
    if let Some(least) = bound("exclusiveMinimum")
        && number <= least
    {
        return Err(format!("must be greater than {least}, not {}", plain(number)));
    }
    match (bound("minimum"), bound("maximum")) {
        (Some(least), _) if number <= 0.0 && least > 0.0 && least < 1.0 => {
            Err(format!("must be positive, not {}", plain(number)))
        }
        (Some(least), _) if number < least => {
            Err(format!("must be at least {}, not {}", plain(least), plain(number)))
        }
        (_, Some(most)) if number > most => {
            Err(format!("must be at most {}, not {}", plain(most), plain(number)))
        }
        _ => Ok(()),
    }
}

fn string(word: &str, schema: &Value) -> Result<(), String> {
    if word.is_empty() && schema.get("minLength").is_some() {
        return Err("must not be empty".into());
    }
    let known: Vec<&str> = strings(schema.get("enum")).collect();
    if known.is_empty() || known.contains(&word) {
        return Ok(());
    }
    let shown: String = word.chars().take(60).collect();
    let hint = nearest(&shown, known.iter().copied()).map(|near| format!(", did you mean \"{near}\"?"));
    let upright: Vec<&str> = known.iter().filter(|name| !name.ends_with("-portrait")).copied().collect();
    let turned = if upright.len() < known.len() { ", each also with -portrait" } else { "" };
    let known = upright.join(", ");
    Err(format!("unknown name \"{shown}\"{} (known: {known}{turned})", hint.unwrap_or_default()))
}

/// What to write for a missing or misunderstood key.
fn missing_remedy(name: &str, schema: &Value) -> String {
    let description = schema.get("description").and_then(Value::as_str).unwrap_or_default();
    let first = description.split(['.', '\n']).next().unwrap_or_default();
    match schema.pointer("/examples/0") {
        Some(example) => format!("add `{name} = {}` ({first})", toml_text(example)),
        None if schema.get("properties").is_some() => {
            let keys: Vec<&str> = strings(schema.get("required")).collect();
            format!("add `[{name}]` with {} ({first})", keys.join(", "))
        }
        None if schema.get("items").is_some() => format!("add `[[{name}]]` ({first})"),
        None => first.to_string(),
    }
}

fn unknown_remedy(root: &Value, path: &str, schema: &Value, name: &str) -> String {
    let known: Vec<&str> = keys(schema).collect();
    let list = if path.is_empty() { whole(root) } else { bracketed(path) };
    let list = format!("{list} knows {}", known.join(", "));
    if let Some(near) = nearest(name, known.iter().copied()) {
        return format!("did you mean `{near}`? {list}");
    }
    match owner("", root, name) {
        Some(table) => format!("`{name}` belongs to {table}; {list}"),
        None => format!("remove it; {list}"),
    }
}

/// What a file of this schema is called: its title says `groundglass scene`.
fn whole(root: &Value) -> String {
    let title = root.get("title").and_then(Value::as_str).unwrap_or_default();
    format!("a {}", title.trim_start_matches("groundglass "))
}

/// The table whose key `name` is, in brackets, when some table has it.
fn owner(path: &str, schema: &Value, name: &str) -> Option<String> {
    keys(schema).find_map(|key| {
        let inner = schema.pointer(&format!("/properties/{key}"))?;
        let is_array = inner.get("items").is_some();
        let inner = if is_array { inner.get("items")? } else { inner };
        let inner_path = join(path, key);
        if inner.pointer(&format!("/properties/{name}")).is_some() {
            return Some(if is_array { format!("[[{inner_path}]]") } else { format!("[{inner_path}]") });
        }
        owner(&inner_path, inner, name)
    })
}

/// The known word that is nearest to `word`, when it is near enough to be meant.
pub(crate) fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    known
        .map(|name| (strsim::damerau_levenshtein(&word, name), name))
        // `tilt` for `tilt_deg`: the unit forgotten is the commonest slip.
        .map(|(d, name)| {
            let turned = |(a, b): (&str, &str)| word.split_once('x') == Some((b, a));
            if name.strip_prefix(&*word).is_some_and(|rest| rest.starts_with('_'))
                // `5x4` for `4x5`, as film is called in Britain.
                || name.split_once('x').is_some_and(turned)
            {
                (0, name)
            } else {
                (d, name)
            }
        })
        .filter(|(distance, name)| *distance <= 1 + name.len().min(word.len()) / 4)
        .min()
        .map(|(_, name)| name)
}

/// How many items an array may have, before what they are.
fn bounds(schema: &Value) -> String {
    match ["minItems", "maxItems"].map(|name| schema.get(name).and_then(Value::as_u64)) {
        [Some(least), Some(most)] => format!("{least} to {most} "),
        [Some(least), None] => format!("at least {least} "),
        [None, Some(most)] => format!("at most {most} "),
        [None, None] => String::new(),
    }
}

fn describe(schema: &Value) -> String {
    let count = schema.get("minItems").and_then(Value::as_u64);
    let count = count.filter(|_| schema.get("minItems") == schema.get("maxItems"));
    let inner = schema.get("items").unwrap_or(&Value::Null);
    match schema.get("type").and_then(Value::as_str) {
        Some("object") => "a table".into(),
        Some("array") => match (count, inner.get("type").and_then(Value::as_str)) {
            (Some(count), Some("number")) => format!("{count} numbers"),
            (Some(count), Some("array")) => format!("{count} points of 3 numbers"),
            (_, Some("number")) => format!("an array of {}numbers", bounds(schema)),
            (_, Some("string")) => format!("an array of {}texts in quotes", bounds(schema)),
            _ => format!("an array of {}tables", bounds(schema)),
        },
        Some("boolean") => "true or false".into(),
        Some("integer") => "a whole number".into(),
        Some("string") => "a text in quotes".into(),
        _ => "a number".into(),
    }
}

fn type_name(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number with a point or an exponent",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// A bound as people write it.
fn plain(value: f64) -> String {
    if value.abs() >= 1e7 || (value != 0.0 && value.abs() < 1e-3) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

fn toml_text(value: &Value) -> String {
    toml::Value::try_from(value).map_or_else(|_| value.to_string(), |value| value.to_string())
}

/// `[camera.front]`, `[[mesh]]`.
fn bracketed(path: &str) -> String {
    match path.split_once('[') {
        Some((array, _)) => format!("[[{array}]]"),
        None => format!("[{path}]"),
    }
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_string() } else { format!("{path}.{name}") }
}

fn keys(schema: &Value) -> impl Iterator<Item = &str> {
    schema
        .get("properties")
        .and_then(Value::as_object)
        .into_iter()
        .flat_map(|map| map.keys().map(String::as_str))
}

fn strings(list: Option<&Value>) -> impl Iterator<Item = &str> {
    list.and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str)
}
