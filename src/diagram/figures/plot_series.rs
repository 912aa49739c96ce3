//! Series of charts. In: the keys of a series and the tables they name. Out: points with their values and error bars, every
//! one finite; nothing is dropped but empty cells.

use super::file::Input;
use super::plot_data::{Cell, Table};
use super::plot_keys::SeriesKeys;
use crate::diagram::canvas;
use crate::error::{Error, Result};
use crate::scene::nearest;

/// A point, the ends of its error bars, and what is written beside it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DataPoint {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Upright, in values of y.
    pub(crate) bar: Option<[f64; 2]>,
    /// Level, in values of x.
    pub(crate) level_bar: Option<[f64; 2]>,
    pub(crate) label: Option<String>,
}

/// Points in the file's order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<DataPoint>,
}

/// Reads series `index` from its keys; `data` and `table` are those of the figure.
///
/// # Errors
/// With the key's line when values are given twice or not at all, a column is missing, or a cell is not a number.
pub(crate) fn read(
    input: &Input,
    index: usize,
    keys: &SeriesKeys,
    data: Option<&str>,
    table: Option<&str>,
) -> Result<Series> {
    let key = |name: &str| format!("series[{index}].{name}");
    let own = keys.data.as_deref();
    let table = match own.or(data) {
        Some(written) => {
            let at = if own.is_some() { key("data") } else { "data".to_owned() };
            let (bytes, _) = input.read(&at, written)?;
            Some(Table::read(&bytes, written, keys.table.as_deref().or(table))?)
        }
        None => None,
    };
    let rows = table.as_ref().map_or(Ok(Vec::new()), |table| rows(input, index, keys, table))?;
    let column = |name: &str,
                  array: &Option<Vec<f64>>,
                  named: &Option<String>|
     -> Result<Option<Vec<Option<f64>>>> {
        match (array, named) {
            (Some(_), Some(_)) => Err(input
                .document
                .error(&key(name), format!("`{name}` and `{name}_column` exclude each other"))
                .remedy("remove one of them")),
            (Some(values), None) => Ok(Some(values.iter().copied().map(Some).collect())),
            (None, Some(wanted)) => {
                let Some(table) = &table else {
                    return Err(input
                        .document
                        .error(&key(&format!("{name}_column")), "there is no table to take the column from")
                        .remedy("name a CSV or JSON file: data = \"runs.csv\""));
                };
                numbers(input, &key(&format!("{name}_column")), table, wanted, &rows).map(Some)
            }
            (None, None) => Ok(None),
        }
    };
    let required = |name: &str, found: Option<Vec<Option<f64>>>| {
        found.ok_or_else(|| {
            input
                .document
                .error(&format!("series[{index}]"), format!("the series has no `{name}`"))
                .remedy(format!("add `{name} = [1.0, 2.0]`, or `{name}_column = \"{name}\"` with a table"))
        })
    };
    let x = required("x", column("x", &keys.x, &keys.x_column)?)?;
    let y = required("y", column("y", &keys.y, &keys.y_column)?)?;
    let error = column("error", &keys.error, &keys.error_column)?;
    let low = column("low", &keys.low, &keys.low_column)?;
    let high = column("high", &keys.high, &keys.high_column)?;
    let x_low = column("x_low", &keys.x_low, &keys.x_low_column)?;
    let x_high = column("x_high", &keys.x_high, &keys.x_high_column)?;
    for (name, other) in [
        ("y", Some(&y)),
        ("error", error.as_ref()),
        ("low", low.as_ref()),
        ("high", high.as_ref()),
        ("x_low", x_low.as_ref()),
        ("x_high", x_high.as_ref()),
    ] {
        if let Some(other) = other
            && other.len() != x.len()
        {
            let message = format!("`{name}` has {} values and `x` has {}", other.len(), x.len());
            return Err(input.document.error(&key(name), message).remedy("give as many of each"));
        }
    }
    if error.is_some() && (low.is_some() || high.is_some()) {
        return Err(input
            .document
            .error(&format!("series[{index}]"), "`error` and `low`, `high` exclude each other")
            .remedy("keep one of them"));
    }
    let labels = labels(input, index, keys, table.as_ref(), &rows)?;
    let from = if keys.labels.is_some() { "labels" } else { "labels_column" };
    let labelled = labels.iter().flatten().map(|label| (label, from));
    for (text, from) in labelled.chain([(&keys.name, "name")]) {
        // Letters that the figure file itself holds are found in it later.
        let is_elsewhere = from == "labels_column" || text.chars().any(char::is_control);
        let place = |error: Error| {
            Error::invalid(format!("{} in `{}`", error.message(), text.escape_debug()))
                .at(input.document.place(&key(from)))
                .remedy(error.remedy_text().unwrap_or_default())
        };
        canvas::size(text).map_err(|error| if is_elsewhere { place(error) } else { error })?;
    }
    if let Some(labels) = &labels
        && labels.len() != x.len()
    {
        let message = format!("`labels` has {} texts and `x` has {} values", labels.len(), x.len());
        return Err(input.document.error(&key("labels"), message).remedy("give as many of each"));
    }
    let pick = |column: &Option<Vec<Option<f64>>>, i: usize| {
        column.as_ref().and_then(|c| c.get(i).copied().flatten())
    };
    let mut points = Vec::new();
    for (i, (x, y)) in x.iter().zip(&y).enumerate() {
        let (Some(x), Some(y)) = (*x, *y) else { continue };
        let ends = |low: Option<f64>, high: Option<f64>, value: f64| match (low, high) {
            (None, None) => None,
            (low, high) => Some([low.unwrap_or(value), high.unwrap_or(value)]),
        };
        let bar = match pick(&error, i) {
            Some(half) => Some([y - half, y + half]),
            None => ends(pick(&low, i), pick(&high, i), y),
        };
        let level_bar = ends(pick(&x_low, i), pick(&x_high, i), x);
        for (ends, value) in [(bar, y), (level_bar, x)] {
            // A point may be rounded otherwise than its bar.
            let slack = 1e-9 * value.abs();
            if let Some([low, high]) = ends
                && (low > value + slack || high < value - slack)
            {
                let message = if low > high {
                    format!("at ({x}, {y}) the bar runs from {low} down to {high}")
                } else {
                    format!("the point ({x}, {y}) lies beyond its bar from {low} to {high}")
                };
                return Err(input.document.error(&format!("series[{index}]"), message).remedy(
                    "give the lower end as low, the higher as high, and an error that is not negative",
                ));
            }
        }
        let label = labels.as_ref().and_then(|labels| labels.get(i)).filter(|label| !label.is_empty());
        points.push(DataPoint { x, y, bar, level_bar, label: label.cloned() });
    }
    if points.is_empty() {
        return Err(input
            .document
            .error(&format!("series[{index}]"), "the series has no point")
            .remedy("give it a row with numbers for x and y"));
    }
    Ok(Series { name: keys.name.clone(), points })
}

/// What is written beside the points.
fn labels(
    input: &Input,
    index: usize,
    keys: &SeriesKeys,
    table: Option<&Table>,
    rows: &[usize],
) -> Result<Option<Vec<String>>> {
    let key = format!("series[{index}].labels_column");
    match (&keys.labels, &keys.labels_column) {
        (Some(_), Some(_)) => Err(input
            .document
            .error(&key, "`labels` and `labels_column` exclude each other")
            .remedy("remove one of them")),
        (Some(labels), None) => Ok(Some(labels.clone())),
        (None, Some(name)) => {
            let Some(table) = table else {
                return Err(input
                    .document
                    .error(&key, "there is no table to take the column from")
                    .remedy("name a CSV or JSON file: data = \"runs.csv\""));
            };
            let cells = cells(input, &key, table, name)?;
            let word = |&row: &usize| match cells.get(row) {
                Some(Cell::Word(word)) => word.clone(),
                Some(Cell::Number(_, text)) => text.clone(),
                _ => String::new(),
            };
            Ok(Some(rows.iter().map(word).collect()))
        }
        (None, None) => Ok(None),
    }
}

/// The rows of the table that a series takes.
fn rows(input: &Input, index: usize, keys: &SeriesKeys, table: &Table) -> Result<Vec<usize>> {
    let all = 0..table.rows();
    let (Some(column), Some(word)) = (&keys.only_column, &keys.only) else {
        if keys.only.is_some() != keys.only_column.is_some() {
            return Err(input
                .document
                .error(&format!("series[{index}]"), "`only` and `only_column` go together")
                .remedy("for example only_column = \"method\", only = \"ours\""));
        }
        return Ok(all.collect());
    };
    let key = format!("series[{index}].only_column");
    let cells = cells(input, &key, table, column)?;
    let rows: Vec<usize> = all.filter(|&row| cells.get(row).is_some_and(|cell| cell.says(word))).collect();
    if rows.is_empty() {
        let message = format!("no row has `{word}` in the column `{column}`");
        return Err(input
            .document
            .error(&format!("series[{index}].only"), message)
            .remedy("give what a cell of that column says"));
    }
    Ok(rows)
}

fn cells<'t>(input: &Input, key: &str, table: &'t Table, name: &str) -> Result<&'t [Cell]> {
    table.column(name).ok_or_else(|| {
        let all: Vec<&str> = table.columns.keys().map(String::as_str).collect();
        let hint = nearest(name, all.iter().copied());
        let hint = hint.map_or(String::new(), |near| format!("did you mean \"{near}\"? "));
        input
            .document
            .error(key, format!("the table has no column `{name}`"))
            .remedy(format!("{hint}it has {}", all.join(", ")))
    })
}

/// The numbers of a column in these rows, `None` where there is none.
///
/// # Errors
/// With the key's line when there is no such column, or a word in it.
pub(super) fn numbers(
    input: &Input,
    key: &str,
    table: &Table,
    name: &str,
    rows: &[usize],
) -> Result<Vec<Option<f64>>> {
    let cells = cells(input, key, table, name)?;
    rows.iter()
        .map(|&row| match cells.get(row) {
            Some(Cell::Number(number, _)) => Ok(Some(*number)),
            Some(Cell::Word(word)) => {
                let (place, file) = (table.place(row), &table.name);
                Err(Error::invalid(format!(
                    "`{word}` in the column `{name}`, {place} of {file}, is not a number"
                ))
                .at(input.document.place(key))
                .remedy("write it with digits and a point, or leave the cell empty"))
            }
            _ => Ok(None),
        })
        .collect()
}
