//! What a study writes: charts (TOML, SVG, PDF, PNG), a table (CSV; JSON is there already), crops and a page in words.

use super::super::{figure_file, output, report as tell, stats};
use super::answers;
use super::crops::{self, MOST_CROPS, crop_name};
use super::kept::Measured;
use super::reference;
use super::study::{BASELINE, Study};
use super::ways::{ADAPTIVE, APPROXIMATION, UNIFORM};
use groundglass::diagram::{Changes, FigureFile};
use groundglass::error::Result;
use groundglass::scene::{Document, Memory};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The sequences that are compared, and what they are called.
const SEQUENCES: [(&str, &str); 4] = [
    (UNIFORM, "Sobol, scrambled"),
    ("halton points", "Halton"),
    ("rank-1 points", "rank-1"),
    ("random points", "random"),
];

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
        Some(crops::figure(stem, &crops)),
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

fn rows<'a>(study: &'a Study<'_>, way: &str) -> Vec<&'a Measured> {
    study.table.measured.iter().filter(|row| row.way == way).collect()
}

/// How error and time go on beyond the ladder of uniform samples, from its last two steps: the error as a power of the number of
/// samples, the time as what any picture takes and so much for each sample.
struct Trend {
    /// The error falls as `samples^-power`.
    power: f64,
    samples: f64,
    error: f64,
    /// In the time of the baseline, as ratios are.
    fixed: f64,
    each: f64,
}

impl Trend {
    /// None where more samples took no more time, or made the error hardly smaller.
    fn of(before: &Measured, last: &Measured) -> Option<Self> {
        let power = libm::log(before.true_rms / last.true_rms) / libm::log(last.samples / before.samples);
        let each = (last.ratio - before.ratio) / (last.samples - before.samples);
        // More than in proportion is chance, or memory.
        let each = each.min(last.ratio / last.samples);
        let fixed = last.ratio - each * last.samples;
        let is_known = power.is_finite() && power > 0.05 && each.is_finite() && each > 0.0;
        is_known.then_some(Self { power, samples: last.samples, error: last.true_rms, fixed, each })
    }

    /// What a picture with this error takes, as a ratio.
    fn ratio_of(&self, error: f64) -> f64 {
        self.fixed + self.each * self.samples * libm::pow(self.error / error, 1.0 / self.power)
    }
}

/// The last two steps of the ladder, in plain words.
pub(super) fn sentence(study: &Study<'_>) -> String {
    let uniform = rows(study, UNIFORM);
    let [.., before, last] = uniform.as_slice() else {
        return format!(
            "Of uniform samples {} of the two measurements that a price needs {} there, and no time was left for {} more: the same \
             command takes them.",
            uniform.len(),
            if uniform.len() == 1 { "is" } else { "are" },
            study.left
        );
    };
    if last.true_rms == 0.0 {
        return format!(
            "A picture of {:.0} samples is the converged one: there is no error to pay for.",
            last.samples
        );
    }
    let trend = Trend::of(before, last);
    let mut words = match &trend {
        Some(trend) => format!(
            "Halving the error from here ({} in {}) costs {:.1} times as long.",
            tell::rms(last.true_rms),
            duration(last.seconds),
            trend.ratio_of(0.5 * last.true_rms) / last.ratio
        ),
        None if last.ratio <= before.ratio => format!(
            "From {:.0} to {:.0} samples the error goes from {} to {} in no more time: what any picture takes is nearly all of it, and \
             what more samples cost was not measured.",
            before.samples,
            last.samples,
            tell::rms(before.true_rms),
            tell::rms(last.true_rms)
        ),
        None => format!(
            "Up to {:.0} samples more time hardly makes the error of {} smaller; what more would do was not measured.",
            last.samples,
            tell::rms(last.true_rms)
        ),
    };
    if uniform.len() == 2 {
        words.push_str(" That is by two numbers of samples alone.");
    }
    if let (Some(adaptive), Some(trend)) = (rows(study, ADAPTIVE).last(), &trend) {
        let same = trend.ratio_of(adaptive.true_rms);
        if same.is_finite() && same > 0.0 {
            let _ = write!(
                words,
                " Samples where they help most reach {} in {}, {:.0} % of the time that uniform ones take for the same error, each over a picture drawn just before it.",
                tell::rms(adaptive.true_rms),
                duration(adaptive.seconds),
                100.0 * adaptive.ratio / same
            );
        }
    }
    if let Some(converged) = study.table.converged_rms.filter(|&error| error > 0.2 * last.true_rms) {
        let _ = write!(
            words,
            " The converged picture itself is wrong by about {}: errors that are not far larger are not to be relied on.",
            tell::rms(converged)
        );
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
            "\"{}\",\"{}\",{:.2},{:.9},{stated},{:.6},{:.6},{:.6},{:.3}",
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

/// Threads and vector instructions that times are of.
fn machine(study: &Study<'_>) -> String {
    let threads = study.table.threads;
    let threads = if threads == 1 { "one thread".to_owned() } else { format!("{threads} threads") };
    let simd =
        study.table.simd.to_uppercase().replace("AVX512", "AVX-512").replace("SCALAR", "no SIMD level");
    format!("{threads}, {simd}")
}

/// A text as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    let plain: String = text.chars().filter(|c| !c.is_control() && !"*_\"\\".contains(*c)).collect();
    format!("\"{plain}\"")
}

/// Those with an error: another has no place on a logarithmic axis.
fn wrong<'a>(study: &'a Study<'_>, way: &str) -> Vec<&'a Measured> {
    rows(study, way).into_iter().filter(|row| row.true_rms > 0.0).collect()
}

/// The error, true and stated, against seconds; none where no picture has any.
fn chart(study: &Study<'_>, stem: &str) -> Option<String> {
    let (table, title) = (&study.table, quoted(&format!("What accuracy costs: {stem}")));
    let mut text = format!(
        "# Made by `groundglass cost`: {} x {} pixels; times over that of {BASELINE} uniform samples drawn just before, in the seconds that those \
         took once; bars are the shortest and the longest of several runs.\nkind = \"plot\"\n\
         title = {title}\nwidth_mm = 130.0\n\n[x]\ntitle = \"time of a picture, by its ratio; {}\"\nunit = \"s\"\nscale = \"log\"\n\n[y]\n\
         title = \"error of the picture, RMS: lines true, points stated\"\nscale = \"log\"\n",
        table.width,
        table.height,
        machine(study)
    );
    // The machine is faster at one time than at another, above all where a study was taken up again: what each row takes over what was
    // drawn just before it, in the time that this took once. Bars are as wide as they were measured.
    let once = |row: &Measured| table.baseline_seconds.map_or(row.seconds, |baseline| row.ratio * baseline);
    let mut is_drawn = false;
    let mut series = |name: &str, rows: &[&Measured], error: &dyn Fn(&Measured) -> f64, more: &str| {
        // A line goes from less time to more, whatever the samples.
        let mut rows = rows.to_vec();
        rows.sort_by(|a, b| once(a).total_cmp(&once(b)));
        let rows = rows.as_slice();
        if !rows.is_empty() {
            is_drawn = true;
            let _ = write!(
                text,
                "\n[[series]]\nname = \"{name}\"\nx = {}\ny = {}\nx_low = {}\nx_high = {}\n{more}",
                numbers(rows, once),
                numbers(rows, error),
                numbers(rows, |row| once(row) * row.seconds_low / row.seconds),
                numbers(rows, |row| once(row) * row.seconds_high / row.seconds),
            );
        }
    };
    for (way, stated) in [(UNIFORM, "uniform, stated"), (ADAPTIVE, "adaptive, stated"), (APPROXIMATION, "")] {
        let rows = wrong(study, way);
        series(way, &rows, &|row| row.true_rms, if rows.len() > 1 { "" } else { "line = false\n" });
        let known: Vec<&Measured> =
            rows.into_iter().filter(|row| row.stated_rms.is_some_and(|error| error > 0.0)).collect();
        if !stated.is_empty() {
            series(stated, &known, &|row| row.stated_rms.unwrap_or(1.0), "line = false\n");
        }
    }
    is_drawn.then_some(text)
}

/// Error against the number of samples for the sequences; none where there is no error.
fn slopes(study: &Study<'_>, stem: &str) -> Option<String> {
    let mut is_drawn = false;
    let title = quoted(&format!("Sequences of samples: {stem}"));
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
    let not_measured = match reference::differs(study.scene) {
        Some(reasons) => format!("The ways in double precision are left out: that renderer {reasons}.\n\n"),
        None => String::new(),
    };
    let told = stats::words_of_effects(study.scene.render.effects);
    let told = if told.is_empty() { String::new() } else { format!(", {}", told.join(" ")) };
    let left_out: Vec<_> = study.plan.left_out().iter().map(|effect| effect.name()).collect();
    let left_out = match left_out[..] {
        [] => String::new(),
        _ => format!(" Left out of all of them as too small to be seen: {}.", left_out.join(", ")),
    };
    let charts = match wrong(study, UNIFORM)[..] {
        [] => "",
        _ => "![Error against time](cost.svg)\n\n![Error against samples](points.svg)\n\n",
    };
    let baseline = table.baseline_seconds.map_or(String::new(), |seconds| format!(", {}", duration(seconds)));
    let mut text = format!(
        "# What accuracy costs: {stem}\n\n{}\n\n{} x {} pixels, {}{told}; against a converged picture of {converged}. Errors are root mean \
         squares over the picture, linear light, clamped to 0..1. Times are the median of three runs (two where one takes long); the \
         ratio is to {BASELINE} uniform samples drawn just before each. The chart shows the ratios, in the time that those took \
         first{baseline}.{left_out}\n\n{charts}![The part of the picture where 16 samples are most wrong](crops.svg)\n\n{not_measured}\
         | way | setting | samples | true error | stated | seconds | ratio |\n|---|---|---|---|---|---|---|\n",
        sentence(study),
        table.width,
        table.height,
        machine(study),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn row(samples: f64, true_rms: f64, ratio: f64) -> Measured {
        Measured {
            way: UNIFORM.to_owned(),
            setting: format!("N = {samples}"),
            samples,
            true_rms,
            stated_rms: None,
            seconds: ratio,
            seconds_low: ratio,
            seconds_high: ratio,
            ratio,
        }
    }

    #[test]
    fn the_price_of_half_the_error_has_no_fixed_cost_in_it_twice() {
        // Pure chance: an error of N^-1/2, so four times the samples. What any picture takes is 0.9 of the time of 64 samples.
        let at = |n: f64| row(n, 0.1 / n.sqrt(), 0.9 + 0.1 * n / 64.0);
        let trend = Trend::of(&at(64.0), &at(256.0)).unwrap();
        let want = at(1024.0).ratio;
        assert!((trend.ratio_of(0.5 * at(256.0).true_rms) / want - 1.0).abs() < 1e-12);
        assert!((trend.ratio_of(at(16.0).true_rms) / at(16.0).ratio - 1.0).abs() < 1e-12);
        // More than in proportion counts as in proportion; no more time, or no less error, tells nothing.
        let dear = Trend::of(&at(64.0), &row(256.0, 0.1 / 16.0, 8.0)).unwrap();
        assert!((dear.ratio_of(0.1 / 32.0) / 32.0 - 1.0).abs() < 1e-12);
        assert!(Trend::of(&at(64.0), &row(256.0, 0.1 / 16.0, 1.0)).is_none());
        assert!(Trend::of(&at(64.0), &row(256.0, 0.1 / 8.0, 4.0)).is_none());
    }
}
