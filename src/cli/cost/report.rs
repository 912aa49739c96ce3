//! What a study writes: charts (TOML, SVG, PDF, PNG), a table (CSV; JSON is there already), crops and a page in words.

use super::super::{figure_file, notes, output, report as tell};
use super::answers;
use super::charts::{chart, slopes, wrong};
use super::crops::{self, MOST_CROPS, crop_name};
use super::kept::Measured;
use super::study::{BASELINE, Study};
use super::ways::UNIFORM;
use super::words::{duration, sentence};
use groundglass::diagram::{Changes, FigureFile};
use groundglass::error::Result;
use groundglass::scene::{Document, Memory};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const CHARTS: [&str; 4] = ["cost", "points", "optics", "crops"];
const ENDINGS: [&str; 4] = ["toml", "svg", "pdf", "png"];

/// All that a study writes, the table last.
pub(super) fn files() -> Vec<String> {
    let charts = CHARTS.iter().flat_map(|chart| ENDINGS.map(|ending| format!("{chart}.{ending}")));
    let crops = (1..=MOST_CROPS).map(crop_name);
    let rest =
        ["cost.csv", "optics.csv", "optics.json", "cost.md", "converged.exr", "cost.json"].map(str::to_owned);
    charts.chain(crops).chain(rest).collect()
}

pub(super) fn write(study: &Study<'_>, stem: &str, folder: &Path, cancel: &AtomicBool) -> Result<()> {
    let text = |name: &str, text: &str| output::write_text(&folder.join(name), &study.read, text);
    text("cost.csv", &csv(study))?;
    let optics = answers::measure();
    text("optics.csv", &answers::csv(&optics))?;
    text("optics.json", &answers::json(&optics))?;
    let crops = crops::draw(study, cancel)?;
    let mut pictures = Memory::new();
    for (i, crop) in crops.iter().enumerate() {
        let (name, mut png) = (crop_name(i + 1), Vec::new());
        crop.picture.write_png(study.scene.render.exposure_ev, &[], &mut png)?;
        output::write_whole(&folder.join(&name), &study.read, |file| {
            std::io::Write::write_all(file, &png).map_err(|error| output::broken(&folder.join(&name), &error))
        })?;
        pictures = pictures.with(&name, png);
    }
    let charts = [
        chart(study, stem),
        slopes(study, stem),
        Some(answers::chart(&optics)),
        Some(crops::figure(stem, (study.table.width, study.table.height), &crops)),
    ];
    for (name, toml) in CHARTS.into_iter().zip(&charts) {
        let Some(toml) = toml else { continue };
        text(&format!("{name}.toml"), toml)?;
        let document = Document::from_bytes(toml.as_bytes(), &format!("{name}.toml"))?;
        let figure =
            FigureFile::from_document(document)?.draw(&pictures, Path::new(""), Changes::default())?;
        for ending in &ENDINGS[1..] {
            figure_file::write(&figure, &folder.join(name).with_extension(ending), &study.read)?;
        }
    }
    text("cost.md", &(page(study, stem) + &answers::words(&optics)))
}

/// The rows of a way.
pub(super) fn rows<'a>(study: &'a Study<'_>, way: &str) -> Vec<&'a Measured> {
    study.table.measured.iter().filter(|row| row.way == way).collect()
}

fn csv(study: &Study<'_>) -> String {
    let mut text =
        "way,setting,samples,true_rms,stated_rms,seconds,seconds_low,seconds_high,ratio\n".to_owned();
    for row in &study.table.measured {
        let stated = row.stated_rms.map_or(String::new(), |error| error.to_string());
        let _ = writeln!(
            text,
            "\"{}\",\"{}\",{:.2},{},{stated},{:.6},{:.6},{:.6},{:.3}",
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

/// Threads and vector instructions that times are of.
pub(super) fn machine(study: &Study<'_>) -> String {
    let threads = study.table.threads;
    let threads = if threads == 1 { "one thread".to_owned() } else { format!("{threads} threads") };
    let simd =
        study.table.simd.to_uppercase().replace("AVX512", "AVX-512").replace("SCALAR", "no SIMD level");
    format!("{threads}, {simd}")
}

/// The longest name of a file that stands whole in a title.
const LONGEST: usize = 40;

/// The title of a chart of the scene in a file of this name, as TOML writes it: a name may have letters that the diagrams' font lacks,
/// and be of any length.
pub(super) fn title(of: &str, stem: &str) -> String {
    let has_glyph = |c: &char| {
        c.is_ascii()
            || "–—‘’“”·±°".contains(*c)
            || matches!(c, 'À'..='ň' | 'Ŋ'..='ſ' | 'Α'..='Ρ' | 'Σ'..='Ω' | 'α'..='ω' | 'Ѐ'..='џ')
    };
    let plain = stem.chars().filter(|c| !c.is_control() && !"*_\"\\^{}".contains(*c));
    let plain: Vec<char> = plain.map(|c| if has_glyph(&c) { c } else { '?' }).collect();
    let (shown, dots) = match plain.get(..LONGEST) {
        Some(first) if plain.len() > LONGEST => (first, "…"),
        _ => (&plain[..], ""),
    };
    format!("\"{of}: {}{dots}\"", shown.iter().collect::<String>())
}

/// A name as Markdown shows it, on one line.
fn in_markdown(name: &str) -> String {
    let escaped = |c: char| {
        let marked = c.is_ascii_punctuation() && !".-,:;'()/".contains(c);
        [marked.then_some('\\'), Some(if c.is_control() { ' ' } else { c })]
    };
    name.chars().flat_map(escaped).flatten().collect()
}

fn page(study: &Study<'_>, stem: &str) -> String {
    let table = &study.table;
    let converged = match table.converged_rms {
        Some(error) => format!(
            "{} samples with another seed, which states an error of {} itself",
            table.converged_samples,
            tell::rms(error)
        ),
        None => format!("{} samples with another seed", table.converged_samples),
    };
    let not_measured = match &study.not_doubled {
        Some(reasons) => format!("The ways in double precision are left out: that renderer {reasons}.\n\n"),
        None => String::new(),
    };
    let told = notes::words_of_effects(study.scene.render.effects);
    let told = if told.is_empty() { String::new() } else { format!(", {}", told.join(" ")) };
    let left_out: Vec<_> = study.plan.left_out().iter().map(|effect| effect.name()).collect();
    let left_out = match left_out[..] {
        [] => String::new(),
        _ => format!(" Left out of all of them as too small to be seen: {}.", left_out.join(", ")),
    };
    let baseline = table.baseline_seconds.map_or(String::new(), |seconds| format!(", {}", duration(seconds)));
    let (of_charts, charts) = match wrong(study, UNIFORM)[..] {
        [] => (String::new(), ""),
        _ => (
            format!(" The chart shows the ratios, in the time that those took first{baseline}."),
            "![Error against time](cost.svg)\n\n![Error against samples](points.svg)\n\n",
        ),
    };
    let mut text = format!(
        "# What accuracy costs: {}\n\n{}\n\n{} x {} pixels, {}{told}; against a converged picture of {converged}. Errors are root mean \
         squares over the picture, linear light, clamped to 0..1. Times are the median of three runs (two where one takes long, more where one is short); the \
         ratio is to {BASELINE} uniform samples drawn just before each.{of_charts}{left_out}\n\n{charts}![The part of the picture where 16 samples are most wrong](crops.svg)\n\n{not_measured}\
         | way | setting | samples | true error | stated | time | ratio |\n|---|---|---|---|---|---|---|\n",
        in_markdown(stem),
        sentence(study),
        table.width,
        table.height,
        machine(study),
    );
    for row in &table.measured {
        let error = |error: f64| if error < 0.001 { tell::rms(error) } else { format!("{error:.5}") };
        let stated = row.stated_rms.map_or("-".to_owned(), error);
        let [middle, low, high] = [row.seconds, row.seconds_low, row.seconds_high].map(duration);
        let _ = writeln!(
            text,
            "| {} | {} | {:.0} | {} | {stated} | {middle} ({low} to {high}) | {:.2} |",
            row.way,
            row.setting,
            row.samples,
            error(row.true_rms),
            row.ratio
        );
    }
    text
}
