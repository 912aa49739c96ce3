//! The grid of a heat map. In: a table, the columns of its axes and maps. Out: the places of the cells' borders, and for
//! each map the values by row and column.

use super::file::Input;
use super::heat_map_keys::{AxisKeys, Keys};
use super::plot_axis::{Range, Scale};
use super::plot_data::Table;
use super::plot_series;
use crate::error::{Error, Result};

/// The most rows or columns.
const MOST: usize = 400;

/// An axis's cells: one more border than cells.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    values: Vec<f64>,
    pub(crate) borders: Vec<f64>,
    pub(crate) range: Range,
}

/// A map's values, rows upward, `None` where there is none.
pub(crate) type Map = Vec<Vec<Option<f64>>>;

pub(crate) struct Grid {
    pub(crate) x: Cells,
    pub(crate) y: Cells,
    pub(crate) maps: Vec<Map>,
}

/// Reads the grid.
///
/// # Errors
/// When a column is missing, a cell is no number, or the axes have no cells or too many.
pub(crate) fn read(input: &Input, keys: &Keys) -> Result<Grid> {
    let (bytes, _) = input.read("data", &keys.data)?;
    let table = Table::read(&bytes, &keys.data, keys.table.as_deref())?;
    let xs = required(input, "x.column", &table, &keys.x.column)?;
    let ys = required(input, "y.column", &table, &keys.y.column)?;
    let x = Cells::new(&xs, &keys.x).map_err(|error| error.at(input.document.place("x")))?;
    let y = Cells::new(&ys, &keys.y).map_err(|error| error.at(input.document.place("y")))?;
    let rows = rows([&x, &y], [&xs, &ys], &table).map_err(|error| error.in_file(&*keys.data))?;
    let mut maps = Vec::new();
    for (i, panel) in keys.panel.iter().enumerate() {
        let values = numbers(input, &format!("panel[{i}].column"), &table, &panel.column)?;
        let value = |&row: &usize| values.get(row).copied().flatten();
        maps.push(rows.iter().map(|row| row.iter().map(value).collect()).collect());
    }
    Ok(Grid { x, y, maps })
}

/// The table's row of each cell.
fn rows([x, y]: [&Cells; 2], [xs, ys]: [&[f64]; 2], table: &Table) -> Result<Vec<Vec<usize>>> {
    let mut found = vec![vec![None; x.values.len()]; y.values.len()];
    for (row, (&u, &v)) in xs.iter().zip(ys).enumerate() {
        let line = y.index(v).and_then(|at| found.get_mut(at));
        let Some(cell) = line.zip(x.index(u)).and_then(|(line, at)| line.get_mut(at)) else { continue };
        if let Some(other) = cell.replace(row) {
            let [first, second] = [other, row].map(|row| table.place(row));
            return Err(Error::invalid(format!("{first} and {second} both have x = {u}, y = {v}"))
                .remedy("keep one of them"));
        }
    }
    let missing = found.iter().flatten().filter(|cell| cell.is_none()).count();
    let complete = |(line, &v): (Vec<Option<usize>>, &f64)| {
        let cell = |(cell, u): (Option<usize>, &f64)| {
            cell.ok_or_else(|| {
                Error::invalid(format!("no row has x = {u}, y = {v}, and {missing} of the grid's cells have none"))
                    .remedy("give a row for each cell, with an empty value where there is none; numbers that differ by rounding are different")
            })
        };
        line.into_iter().zip(&x.values).map(cell).collect()
    };
    found.into_iter().zip(&y.values).map(complete).collect()
}

impl Cells {
    fn new(all: &[f64], keys: &AxisKeys) -> Result<Self> {
        let scale = if keys.scale.as_deref() == Some("log") { Scale::Log } else { Scale::Linear };
        let mut values = all.to_vec();
        values.sort_by(f64::total_cmp);
        values.dedup();
        if values.len() < 2 || values.len() > MOST {
            let message = format!("{} different values, and a grid has 2 to {MOST}", values.len());
            return Err(Error::invalid(message).remedy("give a row for each cell of a grid"));
        }
        let (first, last) = (values[0], values[values.len() - 1]);
        // Refuses what the scale cannot have.
        Range::holding(&values, scale, [Some(first), Some(last)], 4.0)?;
        let between = |a: f64, b: f64, t: f64| match scale {
            Scale::Linear => a + (b - a) * t,
            Scale::Log => a * libm::pow(b / a, t),
        };
        // Half-way between neighbours; the outermost cells are as wide on either side.
        let mut borders = vec![between(first, values[1], -0.5)];
        borders.extend(values.windows(2).map(|pair| between(pair[0], pair[1], 0.5)));
        borders.push(between(last, values[values.len() - 2], -0.5));
        let (low, high) = (borders[0], borders[borders.len() - 1]);
        Ok(Self { values, borders, range: Range { scale, low, high } })
    }

    fn index(&self, value: f64) -> Option<usize> {
        self.values.binary_search_by(|other| other.total_cmp(&value)).ok()
    }
}

fn required(input: &Input, key: &str, table: &Table, name: &str) -> Result<Vec<f64>> {
    let filled = |(row, cell): (usize, Option<f64>)| {
        cell.ok_or_else(|| {
            input.document.error(key, format!("the column `{name}` is empty in {}", table.place(row)))
        })
    };
    numbers(input, key, table, name)?.into_iter().enumerate().map(filled).collect()
}

/// All numbers of a column.
fn numbers(input: &Input, key: &str, table: &Table, name: &str) -> Result<Vec<Option<f64>>> {
    plot_series::numbers(input, key, table, name, &(0..table.rows()).collect::<Vec<_>>())
}
