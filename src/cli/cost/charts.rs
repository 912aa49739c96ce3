//! The charts of a study, as figure files: errors against seconds, and against numbers of samples.

use super::kept::Measured;
use super::report::{machine, rows, title};
use super::study::{BASELINE, Study};
use super::ways::{ADAPTIVE, APPROXIMATION, UNIFORM};
use super::words::ROUNDING;
use std::fmt::Write as _;

/// The sequences that are compared, and what they are called.
const SEQUENCES: [(&str, &str); 4] = [
    (UNIFORM, "Sobol, scrambled"),
    ("halton points", "Halton"),
    ("rank-1 points", "rank-1"),
    ("random points", "random"),
];

fn numbers(rows: &[&Measured], pick: impl Fn(&Measured) -> f64) -> String {
    let words: Vec<_> = rows.iter().map(|row| format!("{:e}", pick(row))).collect();
    format!("[{}]", words.join(", "))
}

/// Those with an error that is more than rounding: another has no place on a logarithmic axis.
pub(super) fn wrong<'a>(study: &'a Study<'_>, way: &str) -> Vec<&'a Measured> {
    rows(study, way).into_iter().filter(|row| row.true_rms > ROUNDING).collect()
}

/// The error, true and stated, against seconds; none where no picture has any.
pub(super) fn chart(study: &Study<'_>, stem: &str) -> Option<String> {
    let (table, title) = (&study.table, title("What accuracy costs", stem));
    let mut text = format!(
        "# Made by `groundglass cost`: {} x {} pixels; times over that of {BASELINE} uniform samples drawn just before, in the seconds that those \
         took once; bars are the shortest and the longest of several runs.\nkind = \"plot\"\n\
         title = {title}\nwidth_mm = 130.0\n\n[x]\ntitle = \"time of a picture, {}\"\nunit = \"s\"\nscale = \"log\"\n\n[y]\n\
         title = \"error of the picture, RMS: true, or as stated\"\nscale = \"log\"\n",
        table.width,
        table.height,
        machine(study)
    );
    // The machine is faster at one time than at another, above all where a study was taken up again: what each row takes over what was
    // drawn just before it, in the time that this took once. Bars are as wide as they were measured.
    let once = |row: &Measured| table.baseline_seconds.map_or(row.seconds, |baseline| row.ratio * baseline);
    let mut is_drawn = false;
    let mut series = |name: &str, rows: &[&Measured], error: &dyn Fn(&Measured) -> f64, more: &str| {
        if !rows.is_empty() {
            is_drawn = true;
            let _ = write!(
                text,
                "\n[[series]]\nname = \"{name}\"\nx = {}\ny = {}\nmarkers = true\n{more}",
                numbers(rows, once),
                numbers(rows, error),
            );
        }
    };
    let bars = |rows: &[&Measured]| {
        format!(
            "x_low = {}\nx_high = {}\n",
            numbers(rows, |row| once(row) * row.seconds_low / row.seconds),
            numbers(rows, |row| once(row) * row.seconds_high / row.seconds)
        )
    };
    for (way, stated) in [(UNIFORM, "uniform, stated"), (ADAPTIVE, "adaptive, stated"), (APPROXIMATION, "")] {
        let rows = wrong(study, way);
        let line = if rows.len() > 1 { "" } else { "line = false\n" };
        series(way, &rows, &|row| row.true_rms, &(bars(&rows) + line));
        let known: Vec<&Measured> =
            rows.into_iter().filter(|row| row.stated_rms.is_some_and(|error| error > 0.0)).collect();
        if !stated.is_empty() {
            series(stated, &known, &|row| row.stated_rms.unwrap_or(1.0), "line = false\n");
        }
    }
    is_drawn.then_some(text)
}

/// Error against the number of samples for the sequences; none where there is no error.
pub(super) fn slopes(study: &Study<'_>, stem: &str) -> Option<String> {
    let mut is_drawn = false;
    let title = title("Sequences of samples", stem);
    let mut text = format!(
        "# Made by `groundglass cost`.\nkind = \"plot\"\ntitle = {title}\nwidth_mm = 130.0\n\n[x]\n\
         title = \"samples *N* for each pixel\"\nscale = \"log\"\n\n[y]\ntitle = \"error of the picture, RMS\"\nscale = \"log\"\n"
    );
    for (way, name) in SEQUENCES {
        let rows = wrong(study, way);
        if !rows.is_empty() {
            is_drawn = true;
            let _ = write!(
                text,
                "\n[[series]]\nname = \"{name}\"\nx = {}\ny = {}\n",
                numbers(&rows, |row| row.samples),
                numbers(&rows, |row| row.true_rms)
            );
        }
    }
    is_drawn.then_some(text)
}
