//! What a study's folder holds, so that the next run goes on: the table in and out, the converged picture in ([`super::study`] writes
//! it); what another study left is set aside.

use super::super::{output, report};
use exr::prelude::{ReadChannels, ReadLayers};
use groundglass::error::{Error, Result, Warning};
use groundglass::picture::{Allocation, Exposure};
use groundglass::scene::{Files, Scene, Source};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fs::{File, TryLockError};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// One way at one setting, measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Measured {
    pub(super) way: String,
    pub(super) setting: String,
    /// Mean over the pixels.
    pub(super) samples: f64,
    /// RMS difference from the converged picture, both clamped, linear light.
    pub(super) true_rms: f64,
    /// What the picture says of itself.
    pub(super) stated_rms: Option<f64>,
    /// The median of the times (of two, their mean), the shortest and the longest.
    pub(super) seconds: f64,
    pub(super) seconds_low: f64,
    pub(super) seconds_high: f64,
    /// The median of the times, each over that of 64 uniform samples, drawn just before it.
    pub(super) ratio: f64,
}

/// What `cost.json` holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Table {
    pub(super) scene_hash: String,
    pub(super) version: String,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) quick: bool,
    pub(super) threads: usize,
    pub(super) simd: String,
    /// The effects that its pictures have, but where a row says otherwise: a scene's error target decides, too, what is too small.
    #[serde(default)]
    pub(super) effects: String,
    /// Samples of the converged picture, which has another seed.
    pub(super) converged_samples: u32,
    /// The error that it states of itself.
    #[serde(default)]
    pub(super) converged_rms: Option<f64>,
    /// What the baseline took first: the time in which charts show all ratios.
    #[serde(default)]
    pub(super) baseline_seconds: Option<f64>,
    pub(super) measured: Vec<Measured>,
}

/// A study of another scene or in another way that a folder holds, or other files of the names that a study writes: its table, if any.
pub(super) struct Another(Option<Vec<u8>>);

/// Goes on with the study of `table` that the folder holds, if it does: fills the table and gives the converged picture. Tells also
/// whether the folder holds another.
pub(super) fn take_up(
    folder: &Path,
    scene: &Scene,
    table: &mut Table,
) -> (Option<Exposure>, Option<Another>) {
    // Files of these names that no study of ours goes on with are set aside, whosever they are.
    let holds_another = super::report::files().iter().any(|name| folder.join(name).exists());
    let text = kept_table(folder);
    let found = text.as_ref().and_then(|text| serde_json::from_slice::<Table>(text).ok());
    let another = holds_another.then_some(Another(text));
    let Some(found) = found else { return (None, another) };
    if !is_of_one(&found, table) || !found.holds() {
        return (None, another);
    }
    *table = found;
    // One that is gone, or another's, is drawn again, the same bytes: what was measured against it holds.
    (converged(&folder.join("converged.exr"), scene, table), None)
}

/// Whether two tables are of one study: of one scene, measured in one way.
fn is_of_one(a: &Table, b: &Table) -> bool {
    let blank = |table: &Table| Table {
        measured: Vec::new(),
        converged_samples: 0,
        converged_rms: None,
        baseline_seconds: None,
        ..table.clone()
    };
    serde_json::to_string(&blank(a)).ok() == serde_json::to_string(&blank(b)).ok()
}

impl Table {
    /// Whether it can have been measured: numbers that are numbers, and no step twice.
    fn holds(&self) -> bool {
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        let is_error = |value: f64| value >= 0.0 && value.is_finite();
        let holds = |row: &Measured| {
            [row.samples, row.seconds, row.seconds_low, row.seconds_high, row.ratio]
                .into_iter()
                .all(is_positive)
                && row.seconds_low <= row.seconds
                && row.seconds <= row.seconds_high
                && is_error(row.true_rms)
                && row.stated_rms.is_none_or(is_error)
        };
        let is_first = |(i, row): (usize, &Measured)| {
            !self.measured[..i].iter().any(|other| (&other.way, &other.setting) == (&row.way, &row.setting))
        };
        super::study::converges_by(self.quick, self.converged_samples)
            && self.converged_rms.is_none_or(is_error)
            && self.baseline_seconds.is_none_or(is_positive)
            && self.measured.iter().all(holds)
            && self.measured.iter().enumerate().all(is_first)
    }
}

/// Moves all that another study wrote into a folder of its own, and says so; unless a third was begun there since.
pub(super) fn set_aside(folder: &Path, another: &Another) -> Result<()> {
    if kept_table(folder) != another.0 {
        return Ok(());
    }
    let free = (1..).map(|n| folder.join(format!("earlier-{n}"))).find(|path| !path.exists());
    let Some(kept) = free else { return Ok(()) };
    std::fs::create_dir(&kept).map_err(|error| output::broken(&kept, &error))?;
    for name in super::report::files() {
        let file = folder.join(&name);
        // The table last: without it nobody would know that there is something to move.
        match std::fs::rename(&file, kept.join(&name)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(output::broken(&file, &error));
            }
            _ => {}
        }
    }
    report::warnings(&[Warning {
        file: folder.display().to_string(),
        line: None,
        message: format!(
            "this held a study of another scene or by another way to measure, or files of the same names: they are in {} now",
            kept.display()
        ),
    }]);
    Ok(())
}

/// Keeps other studies out of a folder for as long as the handle lives, where the system can, and clears away what one that was
/// killed had not finished.
///
/// # Errors
/// [`groundglass::error::ErrorKind::Invalid`] when another is measured there: both would write all rows, and take each other's time.
pub(super) fn hold(folder: &Path) -> Result<Option<File>> {
    let Ok(handle) = File::open(folder) else { return Ok(None) };
    match handle.try_lock() {
        Ok(()) => {
            let names = super::report::files();
            let is_ours = |path: &Path| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let inner = name.strip_prefix('.').and_then(|name| name.strip_suffix(".part"));
                let of = inner.and_then(|name| name.rsplit_once('.')).map(|(of, _)| of);
                of.is_some_and(|of| names.iter().any(|name| name == of))
            };
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            for path in entries.map(|entry| entry.path()).filter(|path| is_ours(path)) {
                let _ = std::fs::remove_file(path);
            }
            Ok(Some(handle))
        }
        Err(TryLockError::WouldBlock) => Err(Error::invalid("another run measures a study in this folder")
            .in_file(folder.display().to_string())
            .remedy("wait until it ends, or give each a folder of its own with -o")),
        // File systems without locks.
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Refuses a folder that holds the table of another study, begun while this one went on.
///
/// # Errors
/// [`groundglass::error::ErrorKind::Invalid`], naming its table, which stays.
pub(super) fn refuse_another(folder: &Path, table: &Table) -> Result<()> {
    let path = folder.join("cost.json");
    let Some(text) = kept_table(folder) else { return Ok(()) };
    match serde_json::from_slice::<Table>(&text) {
        Ok(found) if !is_of_one(&found, table) => {
            Err(Error::invalid("another study was begun in this folder while this one went on")
                .in_file(path.display().to_string())
                .remedy("give each a folder of its own with -o"))
        }
        _ => Ok(()),
    }
}

/// Writes the table as it is.
///
/// # Errors
/// As for [`refuse_another`] and [`output::write_text`].
pub(super) fn save(folder: &Path, table: &Table, read: &[PathBuf]) -> Result<()> {
    refuse_another(folder, table)?;
    let mut text = serde_json::to_string_pretty(table).unwrap_or_default();
    text.push('\n');
    output::write_text(&folder.join("cost.json"), read, &text)
}

/// The converged picture of an earlier run, if it is there, whole, and says that it is of this scene and of as many samples.
fn converged(path: &Path, scene: &Scene, table: &Table) -> Option<Exposure> {
    let (width, height) = (table.width as usize, table.height as usize);
    let area = width.checked_mul(height)?;
    // Twelve bytes a pixel, of which compression leaves hardly more at the worst, and a head.
    let bytes = kept(path, 16 * area as u64 + (1 << 20))?;
    // A damaged file may claim any size, and room is made for that before anything is read.
    let head = exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes), false).ok()?;
    let is_ours = |header: &exr::meta::header::Header| {
        (header.layer_size.width(), header.layer_size.height()) == (width, height)
    };
    if !head.headers.iter().all(is_ours) {
        return None;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0f32; 3]; area]),
            |(width, pixels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                if let Some(pixel) = pixels.get_mut(at.y() * *width + at.x()) {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .ok()?;
    let samples = table.converged_samples;
    let comments = image.layer_data.attributes.comments?.to_string();
    let says =
        |key: &str, value: &str| comments.lines().any(|line| line == format!("groundglass.{key}: {value}"));
    let hash = super::study::converging(scene, samples).hash();
    if !says("scene_hash", &hash) || !says("samples", &samples.to_string()) {
        return None;
    }
    let (_, pixels) = image.layer_data.channel_data.pixels;
    let is_whole = pixels.iter().flatten().all(|value| value.is_finite());
    let samples = Allocation::Uniform(samples);
    Exposure::from_rows(table.width, table.height, &pixels, samples).ok().filter(|_| is_whole)
}

/// The table that a folder holds, as it is written.
fn kept_table(folder: &Path) -> Option<Vec<u8>> {
    kept(&folder.join("cost.json"), 16 << 20)
}

/// A regular file of an earlier study, if there is one and it is no larger than `most`.
fn kept(path: &Path, most: u64) -> Option<Vec<u8>> {
    let files = Files::new();
    files.argument(path).and_then(|path| files.read(&path, most).map(Cow::into_owned)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let measured = Measured {
            way: "uniform".to_owned(),
            setting: "N = 4".to_owned(),
            samples: 4.0,
            true_rms: 0.01,
            stated_rms: None,
            seconds: 0.2,
            seconds_low: 0.1,
            seconds_high: 0.3,
            ratio: 0.1,
        };
        Table {
            scene_hash: "a".to_owned(),
            version: "1".to_owned(),
            width: 2,
            height: 2,
            quick: true,
            threads: 1,
            simd: "scalar".to_owned(),
            effects: String::new(),
            converged_samples: 512,
            converged_rms: None,
            baseline_seconds: Some(0.1),
            measured: vec![measured],
        }
    }

    #[test]
    fn a_table_that_cannot_have_been_measured_is_not_gone_on_with() {
        assert!(table().holds());
        let with = |change: fn(&mut Table)| {
            let mut table = table();
            change(&mut table);
            table.holds()
        };
        assert!(!with(|table| table.measured[0].seconds = -1.0));
        assert!(!with(|table| table.measured[0].seconds_high = 0.15));
        assert!(!with(|table| table.measured[0].true_rms = f64::NAN));
        assert!(!with(|table| table.baseline_seconds = Some(0.0)));
        assert!(!with(|table| table.measured.extend_from_within(..)));
        assert!(!with(|table| table.converged_samples = 513));
    }

    #[test]
    fn one_study_at_a_time_is_in_a_folder_and_what_a_killed_one_left_is_not() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|error| output::broken(Path::new("."), &error))?;
        for name in [".crop-2.png.31566-6.part", ".mine.png.1-1.part", "cost.csv"] {
            std::fs::write(folder.path().join(name), "")
                .map_err(|error| output::broken(Path::new(name), &error))?;
        }
        let held = hold(folder.path())?;
        assert!(held.is_some());
        let left = std::fs::read_dir(folder.path()).into_iter().flatten().flatten();
        let mut left: Vec<_> = left.map(|entry| entry.file_name()).collect();
        left.sort();
        assert_eq!(left, [".mine.png.1-1.part", "cost.csv"]);
        let refused = hold(folder.path()).map(|_| ()).map_err(|error| error.to_string());
        assert!(refused.is_err_and(|text| text.contains("another run measures")));
        drop(held);
        hold(folder.path()).map(|_| ())
    }

    #[test]
    fn a_study_does_not_write_over_one_that_was_begun_after_it() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|error| output::broken(Path::new("."), &error))?;
        let (first, mut second) = (table(), table());
        second.scene_hash = "b".to_owned();
        save(folder.path(), &first, &[])?;
        save(folder.path(), &first, &[])?;
        let refused = save(folder.path(), &second, &[]).map_err(|error| error.to_string());
        assert!(refused.is_err_and(|text| text.contains("another study was begun")));
        // Nor does it take it for what lay there before.
        set_aside(folder.path(), &Another(None))?;
        let text = kept_table(folder.path()).unwrap_or_default();
        assert!(String::from_utf8_lossy(&text).contains("\"scene_hash\": \"a\""));
        set_aside(folder.path(), &Another(Some(text)))?;
        assert!(kept_table(folder.path()).is_none());
        save(folder.path(), &second, &[])?;
        Ok(())
    }
}
