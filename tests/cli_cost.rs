//! `groundglass cost` from its first picture to its report, as a user runs it, and again.

#[path = "common/program.rs"]
mod program;

use program::{command, finish, names};
use serde_json::Value;
use std::fs;
use std::path::Path;

#[test]
fn a_study_is_measured_written_and_taken_up_again() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    let wall = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wall.toml");
    let run = |width: &str| {
        let words = ["cost", wall.to_str().unwrap(), "--quick", "--width", width, "-o", "study"];
        let ended = finish(command(folder.path(), &words));
        assert_eq!(ended.code, 0, "{}", ended.err);
        ended.out
    };
    let read =
        || -> Value { serde_json::from_str(&fs::read_to_string(study.join("cost.json")).unwrap()).unwrap() };
    let said = run("48");
    let json = read();
    let number = |way: &str, setting: &str, key: &str| {
        let rows = json["measured"].as_array().unwrap();
        let row = rows.iter().find(|row| row["way"] == way && row["setting"] == setting);
        row.unwrap_or_else(|| panic!("no row {way}, {setting}"))[key].as_f64().unwrap()
    };

    // The reference in 64 bits is a renderer of its own, with the same samples and a look-up in the texture for each: it is as wrong
    // as the one in 32.
    let (single, double) = (number("uniform", "N = 16", "true_rms"), number("64 bits", "N = 16", "true_rms"));
    assert!((single - double).abs() < 0.01 * single, "{single} {double}");
    // Four times as many samples at least halve the error; what is stated is about the truth.
    let uniform = ["N = 4", "N = 16", "N = 64", "N = 256"];
    for pair in uniform.windows(2) {
        let [few, many] = [pair[0], pair[1]].map(|n| number("uniform", n, "true_rms"));
        assert!(many < 0.6 * few, "{pair:?}: {few} {many}");
    }
    for setting in uniform {
        let share = number("uniform", setting, "stated_rms") / number("uniform", setting, "true_rms");
        assert!((1.0 / 1.5..1.5).contains(&share), "{setting}: {share}");
        let [low, middle, high] =
            ["seconds_low", "seconds", "seconds_high"].map(|key| number("uniform", setting, key));
        assert!(0.0 < low && low <= middle && middle <= high, "{low} {middle} {high}");
    }
    // The sentence tells what the last rows say.
    assert!(said.contains("Halving the error from here (") && said.contains(" times as long."), "{said}");
    // The table has the rows of the JSON.
    let table = fs::read_to_string(study.join("cost.csv")).unwrap();
    assert_eq!(table.lines().count(), json["measured"].as_array().unwrap().len() + 1);
    for chart in ["cost", "points", "optics", "crops"] {
        for ending in ["toml", "svg", "pdf", "png"] {
            assert!(
                study.join(chart).with_extension(ending).metadata().unwrap().len() > 500,
                "{chart}.{ending}"
            );
        }
    }

    // Every time in the chart is a ratio in the time of the same picture.
    let chart: toml::Table = fs::read_to_string(study.join("cost.toml")).unwrap().parse().unwrap();
    let times = chart["series"][0]["x"].as_array().unwrap();
    for setting in uniform {
        let want = number("uniform", setting, "ratio") * json["baseline_seconds"].as_f64().unwrap();
        let found = times.iter().any(|time| (time.as_float().unwrap() / want - 1.0).abs() < 1e-9);
        assert!(found, "{setting}: {want}, {times:?}");
    }
    let optics: Value =
        serde_json::from_str(&fs::read_to_string(study.join("optics.json")).unwrap()).unwrap();
    assert!(optics[0]["way"].is_string() && optics[0]["nanoseconds"].as_array().unwrap().len() == 3);

    // A converged picture that is gone is drawn again, and nothing else.
    let converged = fs::read(study.join("converged.exr")).unwrap();
    fs::remove_file(study.join("converged.exr")).unwrap();
    run("48");
    assert!(read() == json && fs::read(study.join("converged.exr")).unwrap() == converged);
    // So is one that says that it is of another scene.
    let mut other = converged.clone();
    let key = b"groundglass.scene_hash: ";
    let at = other.windows(key.len()).position(|found| found == key).unwrap() + key.len();
    other[at] ^= 1;
    fs::write(study.join("converged.exr"), other).unwrap();
    run("48");
    assert!(read() == json && fs::read(study.join("converged.exr")).unwrap() == converged);

    // Taken up again nothing is measured twice; another study's files are kept aside.
    run("48");
    assert_eq!(read(), json);
    let before = names(&study);
    run("32");
    assert_ne!(read(), json);
    let kept = names(&study.join("earlier-1"));
    assert!(kept.contains(&"cost.json".to_owned()) && kept.len() >= before.len() - 1, "{kept:?}");
}

/// A wall that is as bright as the sky: nothing to be wrong about.
const PLAIN: &str = "[camera]\neye_m = [0, 0, 1]\nlook_at_m = [0, 0, 0]\nfocal_length_mm = 150\nfilm = \"4x5\"\nf_number = 8\n[focus]\n\
                     distance_m = 1\n[sky]\nhorizon = [0.5, 0.5, 0.5]\nzenith = [0.5, 0.5, 0.5]\n[[mesh]]\npath = \"wall.obj\"\n";
const WALL: &str = "mtllib wall.mtl\nusemtl grey\nv 5 -5 -1\nv 5 5 -1\nv 6 5 -1\nf 1 2 3\n";

fn plain(folder: &Path, name: &str) {
    fs::write(folder.join(name), PLAIN).unwrap();
    fs::write(folder.join("wall.obj"), WALL).unwrap();
    fs::write(folder.join("wall.mtl"), "newmtl grey\nKd 0.5 0.5 0.5\n").unwrap();
}

#[test]
fn what_has_no_error_has_a_study_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    plain(folder.path(), "plain.toml");
    let words = ["cost", "plain.toml", "--quick", "--width", "24", "-o", "study"];
    let ended = finish(command(folder.path(), &words));
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(ended.out.contains("there is no error to pay for"), "{}", ended.out);
    let study = folder.path().join("study");
    let page = fs::read_to_string(study.join("cost.md")).unwrap();
    assert!(!page.contains("cost.svg") && !study.join("cost.svg").exists(), "{page}");
    assert!(study.join("optics.svg").exists() && page.contains("| uniform | N = 64 |"), "{page}");
    // An error of nothing is no target.
    assert!(!page.contains("| adaptive |"), "{page}");
}

#[test]
fn a_study_leaves_what_it_reads_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    plain(folder.path(), "cost.toml");
    let before = names(folder.path());
    let ended = finish(command(folder.path(), &["cost", "cost.toml", "--quick", "--width", "24", "-o", "."]));
    assert_eq!(ended.code, 2, "{}", ended.err);
    assert!(ended.err.contains("cost.toml") && ended.err.contains("was read as input"), "{}", ended.err);
    assert_eq!(names(folder.path()), before);
    assert_eq!(fs::read_to_string(folder.path().join("cost.toml")).unwrap(), PLAIN);
}

#[test]
fn a_scene_of_any_name_has_its_charts() {
    let folder = tempfile::tempdir().unwrap();
    let name = format!("日本 – Łódź {} *a*_{{b}}^.toml", "é".repeat(60));
    plain(folder.path(), &name);
    let ended = finish(command(folder.path(), &["cost", &name, "--quick", "--width", "24", "-o", "study"]));
    assert_eq!(ended.code, 0, "{}", ended.err);
    let page = fs::read_to_string(folder.path().join("study/cost.md")).unwrap();
    assert!(
        page.starts_with("# What accuracy costs: 日本 – Łódź") && page.contains(" \\*a\\*\\_\\{b\\}\\^\n"),
        "{page}"
    );
    let crops = fs::read_to_string(folder.path().join("study/crops.toml")).unwrap();
    assert!(crops.contains("What the eye sees: ?? – Łódź éé") && crops.contains("é…\""), "{crops}");
}
