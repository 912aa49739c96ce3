//! What exact optics cost: each way to answer a question, timed, beside its error.

use super::super::probe::median;
use groundglass::stability::{Asked, answers};
use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

/// Tilts that are answered for one time, degrees.
const TILTS: u32 = 4000;

/// Times that are taken, and those of them, the shortest first, between which half of them lie.
const RUNS: usize = 9;
const MIDDLE_HALF: [usize; 2] = [2, 6];

/// A way to answer a question.
#[derive(serde::Serialize)]
pub(super) struct Timed {
    question: &'static str,
    pub(super) way: &'static str,
    /// The largest relative error at 0.1 to 30 degrees of tilt, and at any; `null` in JSON where there is no answer.
    errors: [f64; 2],
    /// Nanoseconds an answer: the median of several runs, and between what half of them lie. (A run is so short that the longest tells of
    /// whatever else the machine did.)
    nanoseconds: [f64; 3],
}

pub(super) fn measure() -> Vec<Timed> {
    // Tilts at which every question has an answer.
    let asked: Vec<Asked> =
        (0..TILTS).map(|i| Asked::at(0.1 + 2.0 * f64::from(i) / f64::from(TILTS))).collect();
    answers()
        .into_iter()
        .map(|answer| {
            let mut times: Vec<f64> = (0..RUNS)
                .map(|_| {
                    let start = Instant::now();
                    for &to in &asked {
                        black_box((answer.run)(black_box(to)));
                    }
                    start.elapsed().as_secs_f64() * 1e9 / f64::from(TILTS)
                })
                .collect();
            let middle = median(&mut times);
            Timed {
                question: answer.question,
                way: answer.way,
                nanoseconds: [middle, times[MIDDLE_HALF[0]], times[MIDDLE_HALF[1]]],
                errors: answer.errors,
            }
        })
        .collect()
}

/// An error, or what stands for none.
fn shown(error: f64, otherwise: &str) -> String {
    if error.is_finite() { format!("{error:.2e}") } else { otherwise.to_owned() }
}

pub(super) fn csv(rows: &[Timed]) -> String {
    let mut text =
        "question,way,error_ordinary,error_any,nanoseconds,nanoseconds_low,nanoseconds_high\n".to_owned();
    for row in rows {
        let [ordinary, any] = row.errors.map(|error| shown(error, ""));
        let [middle, low, high] = row.nanoseconds;
        let _ = writeln!(
            text,
            "\"{}\",\"{}\",{ordinary},{any},{middle:.1},{low:.1},{high:.1}",
            row.question, row.way
        );
    }
    text
}

/// The same as JSON.
pub(super) fn json(rows: &[Timed]) -> String {
    serde_json::to_string_pretty(rows).unwrap_or_default() + "\n"
}

/// Time against error, a series for each way.
pub(super) fn chart(rows: &[Timed]) -> String {
    let mut text = "# Made by `groundglass cost`; a point is a question, bars hold the middle half of several runs.\n\
                    kind = \"plot\"\ntitle = \"What exact optics cost\"\nwidth_mm = 130.0\n\n\
                    [x]\ntitle = \"largest relative error of an answer at tilts of 0.1 to 30 degrees\"\nscale = \"log\"\n\n\
                    [y]\ntitle = \"time of an answer\"\nunit = \"ns\"\nscale = \"log\"\n"
        .to_owned();
    let mut ways: Vec<&str> = Vec::new();
    for row in rows {
        if !ways.contains(&row.way) {
            ways.push(row.way);
        }
    }
    for way in ways {
        let of: Vec<&Timed> = rows.iter().filter(|row| row.way == way && row.errors[0].is_finite()).collect();
        let list = |pick: &dyn Fn(&Timed) -> f64| {
            of.iter().map(|row| format!("{:e}", pick(row))).collect::<Vec<_>>().join(", ")
        };
        let _ = write!(
            text,
            "\n[[series]]\nname = \"{way}\"\nline = false\nx = [{}]\ny = [{}]\nlow = [{}]\nhigh = [{}]\nlabels = {:?}\n",
            list(&|row| row.errors[0].max(1e-17)),
            list(&|row| row.nanoseconds[0]),
            list(&|row| row.nanoseconds[1]),
            list(&|row| row.nanoseconds[2]),
            of.iter().map(|row| in_short(row.question)).collect::<Vec<_>>(),
        );
    }
    text
}

/// A question in a word or two, where a chart has no room for more.
fn in_short(question: &str) -> &str {
    let starts =
        [("Plane", "focus plane"), ("Distance", "hinge line"), ("Blur", "blur"), ("Tilt", "wanted plane")];
    starts.into_iter().find(|(start, _)| question.starts_with(start)).map_or(question, |(_, short)| short)
}

/// A table, and what it means.
pub(super) fn words(rows: &[Timed]) -> String {
    let mut text = "\n## The optics\n\n![Time against error](optics.svg)\n\nFor a lens of 150 mm, focused at 10 m; errors are relative, \
                    the largest at tilts of 0.1 to 30 degrees and of 1e-16 to 89.\n\n\
                    | question | way | error | at any tilt | nanoseconds |\n|---|---|---|---|---|\n"
        .to_owned();
    for row in rows {
        let [ordinary, any] = row.errors.map(|error| shown(error, "no answer"));
        let [middle, low, high] = row.nanoseconds;
        let _ = writeln!(
            text,
            "| {} | {} | {ordinary} | {any} | {middle:.0} ({low:.0} to {high:.0}) |",
            row.question, row.way
        );
    }
    text
}
