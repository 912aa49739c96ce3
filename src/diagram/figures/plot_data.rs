//! Tables of numbers beside a figure file. In: the bytes of a CSV or JSON file. Out: columns by name, each cell a number,
//! a word or nothing.
//!
//! CSV: the first line names the columns; cells are parted by commas (or tabs, or semicolons where it has neither), may stand
//! in double quotes, and empty ones are nothing; lines that begin with `#` are comments. JSON: an array of objects (a row each), or an object of
//! arrays (a column each), found under a JSON pointer where it is not the whole document.

use crate::error::{Error, ErrorKind, Result};
use serde_json::Value;
use std::collections::BTreeMap;

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cell {
    Nothing,
    /// And as a text table has it; of JSON, in its shortest form.
    Number(f64, String),
    Word(String),
}

impl Cell {
    fn of_text(text: &str) -> Self {
        let text = text.trim();
        match text.parse::<f64>() {
            _ if text.is_empty() => Self::Nothing,
            // Zero has no sign here.
            Ok(number) if number.is_finite() => Self::Number(number + 0.0, text.to_owned()),
            _ => Self::Word(text.to_owned()),
        }
    }

    fn of_json(value: &Value) -> Self {
        match value {
            Value::Number(number) => {
                // A float of a whole number has no decimals, and a long whole number keeps its digits.
                let text = |value: f64| if number.is_f64() { value.to_string() } else { number.to_string() };
                number.as_f64().map_or(Self::Nothing, |value| Self::Number(value + 0.0, text(value)))
            }
            Value::String(word) => Self::Word(word.clone()),
            Value::Bool(truth) => Self::Word(truth.to_string()),
            _ => Self::Nothing,
        }
    }

    /// Whether the cell says this word, or this number.
    pub(crate) fn says(&self, word: &str) -> bool {
        match self {
            Self::Nothing => word.is_empty(),
            Self::Word(own) => own == word,
            Self::Number(number, _) => word.trim().parse::<f64>().is_ok_and(|other| other == *number),
        }
    }
}

/// Columns of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Table {
    pub(crate) columns: BTreeMap<String, Vec<Cell>>,
    /// Where each row stands in the file, from 1; empty for JSON.
    pub(crate) lines: Vec<usize>,
    /// What the file is called.
    pub(crate) name: String,
}

impl Table {
    /// Reads a table; `name` tells its format by its ending.
    ///
    /// # Errors
    /// When it is not such a table, with the line where there is one.
    pub(crate) fn read(bytes: &[u8], name: &str, pointer: Option<&str>) -> Result<Self> {
        let text = std::str::from_utf8(bytes)
            .map_err(|_| Error::invalid("not UTF-8 text").in_file(name).remedy("save it as UTF-8"))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let ending = name.rsplit('.').next().unwrap_or_default().to_lowercase();
        match ending.as_str() {
            "csv" | "tsv" => csv(text),
            "json" => json(text, pointer),
            _ => Err(Error::invalid("a table's name ends in .csv, .tsv or .json").remedy("rename it")),
        }
        .map(|table| Self { name: name.to_owned(), ..table })
        .map_err(|error| error.in_file(name))
    }

    /// The rows.
    pub(crate) fn rows(&self) -> usize {
        self.columns.values().map(Vec::len).max().unwrap_or(0)
    }

    /// Where a row stands, for errors: `line 7`, or `row 6` of JSON, from 1.
    pub(crate) fn place(&self, row: usize) -> String {
        self.lines.get(row).map_or(format!("row {}", row + 1), |line| format!("line {line}"))
    }

    /// A column by its name.
    pub(crate) fn column(&self, name: &str) -> Option<&[Cell]> {
        self.columns.get(name).map(Vec::as_slice)
    }
}

fn csv(text: &str) -> Result<Table> {
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line))
        .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let Some((first, head)) = lines.next() else {
        return Err(Error::invalid("the table is empty").remedy("its first line names the columns"));
    };
    let parts = |&c: &char| cells(head, c).len() > 1;
    let separator = ['\t', ',', ';'].into_iter().find(parts).unwrap_or(',');
    let names: Vec<String> = cells(head, separator).into_iter().map(|name| name.trim().to_owned()).collect();
    if let Some((i, twice)) = names.iter().enumerate().find(|&(i, name)| names[..i].contains(name)) {
        let message = format!("two columns are named `{twice}`: the one before number {} too", i + 1);
        return Err(Error::invalid(message).at_line(first).remedy("give each its own name"));
    }
    let mut table = Table::default();
    let mut columns = vec![Vec::new(); names.len()];
    for (number, line) in lines {
        let row = cells(line, separator);
        if row.len() != names.len() {
            let (found, plural) = (row.len(), if row.len() == 1 { "" } else { "s" });
            let message =
                format!("{found} cell{plural} in the line, and the first line names {}", names.len());
            let remedy =
                "give each line as many cells; one that holds what parts them stands in double quotes";
            return Err(Error::invalid(message).at_line(number).remedy(remedy));
        }
        for (column, cell) in columns.iter_mut().zip(&row) {
            column.push(Cell::of_text(cell));
        }
        table.lines.push(number);
    }
    table.columns = names.into_iter().zip(columns).collect();
    Ok(table)
}

/// The cells of a line; `""` in quotes is one quote.
fn cells(line: &str, separator: char) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut characters = line.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                push(&mut cells, '"');
            }
            '"' => quoted = !quoted,
            _ if c == separator && !quoted => cells.push(String::new()),
            _ => push(&mut cells, c),
        }
    }
    cells
}

fn push(cells: &mut [String], c: char) {
    if let Some(cell) = cells.last_mut() {
        cell.push(c);
    }
}

/// Most cells of a table: of files as large as are read, only ones with columns that hardly any row has have more.
const CELLS: usize = 1 << 22;

fn too_many_cells() -> Error {
    Error::new(
        ErrorKind::TooLarge,
        format!("the table has more than {CELLS} cells, those that are empty included"),
    )
    .remedy("leave out columns, or give each a table of its own")
}

fn json(text: &str, pointer: Option<&str>) -> Result<Table> {
    let whole: Value = serde_json::from_str(text)
        .map_err(|error| Error::invalid(format!("not JSON: {error}")).at_line(error.line().max(1)))?;
    let found = match pointer {
        Some(pointer) => whole.pointer(pointer).ok_or_else(|| {
            Error::invalid(format!("the document has nothing at `{pointer}`"))
                .remedy("give `table` as a JSON pointer, such as \"/runs\"")
        })?,
        None => &whole,
    };
    let mut table = Table::default();
    match found {
        Value::Array(rows) => {
            for (i, row) in rows.iter().enumerate() {
                let Value::Object(row) = row else {
                    return Err(Error::invalid(format!("row {} is not an object", i + 1)));
                };
                for (name, value) in row {
                    let column = table.columns.entry(name.clone()).or_default();
                    column.resize(i, Cell::Nothing);
                    column.push(Cell::of_json(value));
                }
                if table.columns.len().saturating_mul(i + 1) > CELLS {
                    return Err(too_many_cells());
                }
            }
            let rows = rows.len();
            table.columns.values_mut().for_each(|column| column.resize(rows, Cell::Nothing));
        }
        Value::Object(columns) => {
            for (name, values) in columns {
                if let Value::Array(values) = values {
                    table.columns.insert(name.clone(), values.iter().map(Cell::of_json).collect());
                }
            }
            let rows = table.rows();
            if table.columns.len().saturating_mul(rows) > CELLS {
                return Err(too_many_cells());
            }
            table.columns.values_mut().for_each(|column| column.resize(rows, Cell::Nothing));
        }
        _ => {
            return Err(Error::invalid("expected an array of objects or an object of arrays")
                .remedy("say with `table` where the table stands"));
        }
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_and_json_give_the_same_table() {
        let csv = "# made by hand\nn,\"rms, mean\",who\n16,0.5,a\n64,,\"b \"\"c\"\"\"\n";
        let rows = r#"{"runs": [{"n": 16, "rms, mean": 0.5, "who": "a"}, {"n": 64, "who": "b \"c\""}]}"#;
        let columns = r#"{"n": [16, 64], "rms, mean": [0.5, null], "who": ["a", "b \"c\""]}"#;
        let table = Table::read(csv.as_bytes(), "t.csv", None).unwrap();
        assert_eq!(table.column("rms, mean").unwrap(), [Cell::Number(0.5, "0.5".to_owned()), Cell::Nothing]);
        assert_eq!(table.lines, [3, 4]);
        // As spreadsheets write it where a comma is a decimal point.
        let parted = Table::read(b"\"a, all\";b\n1;\"2;3\"\n", "s.csv", None).unwrap();
        assert_eq!(parted.column("b").unwrap(), [Cell::Word("2;3".to_owned())]);
        assert_eq!(Table::read(rows.as_bytes(), "t.json", Some("/runs")).unwrap().columns, table.columns);
        assert_eq!(Table::read(columns.as_bytes(), "t.json", None).unwrap().columns, table.columns);
    }

    #[test]
    fn wrong_tables_say_where() {
        let wrong =
            |text: &str, name: &str| Table::read(text.as_bytes(), name, None).unwrap_err().to_string();
        assert!(wrong("a,b\n1\n", "t.csv").contains("t.csv:2: 1 cell in"));
        assert!(wrong("", "t.csv").contains("empty"));
        assert!(wrong("{", "t.json").contains("t.json:1"));
        assert!(wrong("3", "t.json").contains("array of objects"));
        assert!(wrong("", "t.xls").contains(".csv"));
        // Each row with a column of its own.
        let rows: Vec<String> = (0..3000).map(|row| format!("{{\"{row}\": 1}}")).collect();
        assert!(wrong(&format!("[{}]", rows.join(",")), "t.json").contains("more than 4194304 cells"));
        let columns: Vec<String> = (0..3000).map(|column| format!("\"{column}\": []")).collect();
        let long = format!("{{\"long\": [{}], {}}}", vec!["0"; 3000].join(","), columns.join(","));
        assert!(wrong(&long, "t.json").contains("more than 4194304 cells"));
    }
}
