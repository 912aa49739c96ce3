//! What a study writes: charts (TOML, SVG, PDF, PNG), a table (CSV; JSON is there already), crops and a page in words.

use super::super::{diagram, output, report as tell};
use super::answers;
use super::study::{BASELINE, Measured, Study, nothing};
use super::ways::{ADAPTIVE, APPROXIMATION, Setting, Step, UNIFORM};
use groundglass::diagram::{Changes, FigureFile};
use groundglass::error::Result;
use groundglass::picture::Exposure;
use groundglass::scene::{Document, Memory};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Pixels on the side of a crop, and how much larger it is shown.
const CROP: u32 = 64;
const ZOOM: u32 = 3;

pub(super) fn write(study: &Study<'_>, stem: &str, folder: &Path) -> Result<()> {
    let text = |name: &str, text: &str| output::write_text(&folder.join(name), &study.read, text);
    text("cost.csv", &csv(study))?;
    let optics = answers::measure();
    text("optics.csv", &answers::csv(&optics))?;
    let charts = [
        (
            "cost",
            "What accuracy costs",
            chart(study, "What accuracy costs", &[UNIFORM, ADAPTIVE, APPROXIMATION], true),
        ),
        ("points", "Sequences of samples", slopes(study)),
        ("optics", "What exact optics cost", answers::chart(&optics)),
    ];
    for (name, _, toml) in &charts {
        text(&format!("{name}.toml"), toml)?;
        let document = Document::from_bytes(toml.as_bytes(), &format!("{name}.toml"))?;
        let figure =
            FigureFile::from_document(document)?.draw(&Memory::new(), Path::new(""), Changes::default())?;
        for ending in ["svg", "pdf", "png"] {
            diagram::write(&figure, &folder.join(name).with_extension(ending), &study.read)?;
        }
    }
    let crops = crops(study)?;
    let path = folder.join("crops.png");
    output::write_whole(&path, &study.read, |file| {
        crops.picture.write_png(study.scene.render.exposure_ev, &[], file)
    })?;
    text("cost.md", &(page(study, stem, &crops.names) + &answers::words(&optics)))
}

fn rows<'a>(study: &'a Study<'_>, way: &str) -> Vec<&'a Measured> {
    study.table.measured.iter().filter(|row| row.way == way).collect()
}

/// The last two steps of the ladder, in plain words.
pub(super) fn sentence(study: &Study<'_>) -> String {
    let uniform = rows(study, UNIFORM);
    let [.., before, last] = uniform.as_slice() else { return nothing().to_string() };
    let slope = libm::log(before.true_rms / last.true_rms) / libm::log(last.seconds / before.seconds);
    let mut words = if slope.is_finite() && slope > 0.05 {
        format!(
            "Halving the error from here ({} in {}) costs {:.1} times as long.",
            tell::rms(last.true_rms),
            duration(last.seconds),
            libm::exp2(1.0 / slope)
        )
    } else {
        format!("More time hardly makes the error of {} smaller.", tell::rms(last.true_rms))
    };
    if let Some(adaptive) = rows(study, ADAPTIVE).last() {
        // What uniform sampling takes for the same error, between its own steps.
        let same = last.seconds * libm::pow(last.true_rms / adaptive.true_rms, 1.0 / slope);
        if same.is_finite() && same > 0.0 {
            let _ = write!(
                words,
                " Samples where they help most reach {} in {}, {:.0} % of the time that as many for every pixel take.",
                tell::rms(adaptive.true_rms),
                duration(adaptive.seconds),
                100.0 * adaptive.seconds / same
            );
        }
    }
    if study.left > 0 {
        let _ = write!(
            words,
            " There was no time for {} more measurements; the same command takes them.",
            study.left
        );
    }
    if let [approximation] = rows(study, APPROXIMATION)[..] {
        let _ = write!(
            words,
            " One pinhole picture with a blur is done in {} and stays wrong by {}, whatever the time.",
            duration(approximation.seconds),
            tell::rms(approximation.true_rms)
        );
    }
    words
}

fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", 1e3 * seconds) } else { format!("{seconds:.1} s") }
}

fn csv(study: &Study<'_>) -> String {
    let mut text =
        "way,setting,samples,true_rms,stated_rms,seconds,seconds_low,seconds_high,ratio\n".to_owned();
    for row in &study.table.measured {
        let stated = row.stated_rms.map_or(String::new(), |error| format!("{error:.9}"));
        let _ = writeln!(
            text,
            "{},{},{:.2},{:.9},{stated},{:.6},{:.6},{:.6},{:.3}",
            row.way,
            row.setting,
            row.samples,
            row.true_rms,
            row.seconds,
            row.seconds_low,
            row.seconds_high,
            row.ratio
        );
    }
    text
}

fn numbers(rows: &[&Measured], pick: impl Fn(&Measured) -> f64) -> String {
    let words: Vec<_> = rows.iter().map(|row| format!("{:e}", pick(row))).collect();
    format!("[{}]", words.join(", "))
}

fn series(name: &str, rows: &[&Measured], x: impl Fn(&Measured) -> f64, more: &str) -> String {
    format!(
        "\n[[series]]\nname = \"{name}\"\nx = {}\ny = {}\nlow = {}\nhigh = {}\n{more}",
        numbers(rows, x),
        numbers(rows, |row| row.seconds),
        numbers(rows, |row| row.seconds_low),
        numbers(rows, |row| row.seconds_high)
    )
}

/// Seconds against the error, true and stated.
fn chart(study: &Study<'_>, title: &str, ways: &[&str], stated: bool) -> String {
    let mut text = format!(
        "# Made by `groundglass cost`; bars are the shortest and the longest of several runs.\nkind = \"plot\"\ntitle = \"{title}\"\n\
         width_mm = 130.0\n\n[x]\ntitle = \"error of the picture, RMS\"\nscale = \"log\"\n\n[y]\ntitle = \"time\"\nunit = \"s\"\n\
         scale = \"log\"\n"
    );
    for way in ways {
        let rows = rows(study, way);
        if !rows.is_empty() {
            text += &series(way, &rows, |row| row.true_rms, "");
        }
        let known: Vec<&Measured> =
            rows.into_iter().filter(|row| row.stated_rms.is_some_and(|e| e > 0.0)).collect();
        if stated && *way == UNIFORM && !known.is_empty() {
            text += &series("stated error", &known, |row| row.stated_rms.unwrap_or(1.0), "line = false\n");
        }
    }
    text
}

/// Error against the number of samples for the sequences.
fn slopes(study: &Study<'_>) -> String {
    let mut text = "# Made by `groundglass cost`.\nkind = \"plot\"\ntitle = \"Sequences of samples\"\nwidth_mm = 130.0\n\n\
                    [x]\ntitle = \"samples *N* for each pixel\"\nscale = \"log\"\n\n[y]\ntitle = \"error of the picture, RMS\"\n\
                    scale = \"log\"\n"
        .to_owned();
    let ways = [
        (UNIFORM, "Sobol, scrambled"),
        ("halton points", "Halton"),
        ("rank-1 points", "rank-1"),
        ("random points", "random"),
    ];
    for (way, name) in ways {
        let rows = rows(study, way);
        if !rows.is_empty() {
            let _ = write!(
                text,
                "\n[[series]]\nname = \"{name}\"\nx = {}\ny = {}\n",
                numbers(&rows, |row| row.samples),
                numbers(&rows, |row| row.true_rms)
            );
        }
    }
    text
}

struct Crops {
    picture: Exposure,
    names: Vec<String>,
}

/// The part of the picture where few samples are most wrong, in several pictures of it side by side.
fn crops(study: &Study<'_>) -> Result<Crops> {
    let cancel = AtomicBool::new(false);
    let Some(truth) = &study.truth else { return Err(nothing()) };
    let draw = |way: &str, setting| study.draw(&Step { way: way.to_owned(), setting }, &cancel);
    let mut pictures = vec![("N = 16".to_owned(), draw(UNIFORM, Setting::Samples(16))?)];
    pictures.push(("N = 16, random points".to_owned(), draw("random points", Setting::Samples(16))?));
    pictures.push(("N = 64".to_owned(), draw(UNIFORM, Setting::Samples(64))?));
    if !rows(study, APPROXIMATION).is_empty() {
        pictures.push((APPROXIMATION.to_owned(), draw(APPROXIMATION, Setting::Approximation(16))?));
    }
    let (left, top) = worst(&pictures[0].1, truth);
    pictures.push(("converged".to_owned(), truth.clone()));
    let (width, height) = (CROP.min(truth.width()), CROP.min(truth.height()));
    let gap = 2;
    let across = pictures.len() as u32 * (width * ZOOM + gap) - gap;
    let mut rows = Vec::new();
    for y in 0..height * ZOOM {
        for (i, (_, picture)) in pictures.iter().enumerate() {
            if i > 0 {
                rows.extend([[1.0; 3]; 2]);
            }
            rows.extend((0..width * ZOOM).map(|x| picture.pixel(left + x / ZOOM, top + y / ZOOM)));
        }
    }
    let samples = truth.samples().clone();
    let picture = Exposure::from_rows(across, height * ZOOM, &rows, samples);
    Ok(Crops { picture, names: pictures.into_iter().map(|(name, _)| name).collect() })
}

/// Left top of the crop with the largest error.
fn worst(picture: &Exposure, truth: &Exposure) -> (u32, u32) {
    let steps = |size: u32| (0..=size.saturating_sub(CROP)).step_by(CROP as usize / 2);
    let places = steps(truth.height()).flat_map(|y| steps(truth.width()).map(move |x| (x, y)));
    let error = |&(left, top): &(u32, u32)| -> f64 {
        let pixels = (top..top + CROP).flat_map(|y| (left..left + CROP).map(move |x| (x, y)));
        pixels
            .flat_map(|(x, y)| picture.pixel(x, y).into_iter().zip(truth.pixel(x, y)))
            .map(|(a, b)| f64::from(a.clamp(0.0, 1.0) - b.clamp(0.0, 1.0)))
            .map(|gap| gap * gap)
            .sum()
    };
    places.max_by(|a, b| error(a).total_cmp(&error(b))).unwrap_or((0, 0))
}

fn page(study: &Study<'_>, stem: &str, crops: &[String]) -> String {
    let table = &study.table;
    let mut text = format!(
        "# What accuracy costs: {stem}\n\n{}\n\n{} x {} pixels, {} threads, {}; against a converged picture of {} samples with \
         another seed. Errors are root mean squares over the picture, linear light, clamped to 0..1. Times are the median of \
         several runs; the ratio is to {BASELINE} uniform samples drawn just before.\n\n![Time against error](cost.svg)\n\n\
         ![Error against samples](points.svg)\n\n![Crops](crops.png)\n\nFrom the left: {}.\n\n\
         | way | setting | samples | true error | stated | seconds | ratio |\n|---|---|---|---|---|---|---|\n",
        sentence(study),
        table.width,
        table.height,
        table.threads,
        table.simd,
        table.converged_samples,
        crops.join("; "),
    );
    for row in &table.measured {
        let stated = row.stated_rms.map_or("-".to_owned(), |error| format!("{error:.5}"));
        let _ = writeln!(
            text,
            "| {} | {} | {:.0} | {:.5} | {stated} | {:.3} ({:.3} to {:.3}) | {:.2} |",
            row.way,
            row.setting,
            row.samples,
            row.true_rms,
            row.seconds,
            row.seconds_low,
            row.seconds_high,
            row.ratio
        );
    }
    text
}
