//! Every line of the manifest of odd and malformed files holds: it loads, warns or fails as it should, soon and in
//! little memory. Meshes are loaded where they lie; a picture is the `map_Kd` of a one-triangle mesh.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use groundglass::error::{Error, ErrorKind};
use groundglass::scene::{AssetLoader, Files, Memory, Source};

/// What came of a file.
#[derive(Debug)]
enum Outcome {
    Loaded { triangles: usize, warnings: Vec<String> },
    Failed(Error),
}

fn shared(below: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(below);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared is missing");
    None
}

fn load(source: &dyn Source, folder: &Path, name: &str) -> Outcome {
    let mut loader = AssetLoader::new(source, folder);
    match loader.load_obj(name) {
        Ok(model) => Outcome::Loaded {
            triangles: model.triangles.len(),
            warnings: loader.warnings().iter().map(ToString::to_string).collect(),
        },
        Err(e) => Outcome::Failed(e),
    }
}

/// Whether the outcome is what one phrase of the manifest says; `n` is the line's own triangle count.
fn fits(outcome: &Outcome, phrase: &str, n: Option<usize>) -> bool {
    let phrase = phrase.trim();
    if phrase.starts_with("clear error") {
        let Outcome::Failed(e) = outcome else { return false };
        return matches!(e.kind(), ErrorKind::Invalid | ErrorKind::TooLarge) && e.place().file.is_some();
    }
    let Outcome::Loaded { triangles, warnings } = outcome else { return false };
    let number = phrase.split(' ').find_map(|word| word.parse().ok());
    let warned = phrase.starts_with("loads with a warning");
    phrase.starts_with("loads") && number.or(n) == Some(*triangles) && warned != warnings.is_empty()
}

fn picture(path: &Path) -> Outcome {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("none").to_owned();
    let files = Memory::new()
        .with("a.obj", &b"mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n"[..])
        .with("a.mtl", format!("newmtl a\nKd 1 1 1\nmap_Kd {name}\n").into_bytes())
        .with(&name, fs::read(path).unwrap_or_default());
    load(&files, Path::new(""), "a.obj")
}

#[test]
fn every_line_of_the_manifest_holds() {
    let Some(folder) = shared("data/odd") else { return };
    let manifest = fs::read_to_string(folder.join("MANIFEST.tsv")).expect("the manifest");
    let (mut wrong, mut count) = (Vec::new(), 0);
    for row in manifest.lines().skip(1) {
        let mut cells = row.split('\t').chain(std::iter::repeat(""));
        let mut cell = || cells.next().unwrap_or("");
        let (file, kind, _odd, _source) = (cell(), cell(), cell(), cell());
        let (expected, triangles, also, why) = (cell(), cell(), cell(), cell());
        count += 1;
        let path = folder.join(file);
        let begun = Instant::now();
        let (outcome, good) = if kind == "image" {
            let outcome = picture(&path);
            let warned = match &outcome {
                Outcome::Loaded { triangles: 1, warnings } => {
                    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("none");
                    Some(warnings.iter().any(|w| w.contains(name)))
                }
                _ => None,
            };
            let said = format!("{expected};{also}");
            let good = match warned {
                Some(true) => said.contains("clear error") || said.contains("is refused"),
                Some(false) => said.contains("decodes"),
                None => false,
            };
            (outcome, good)
        } else {
            let outcome = match (path.parent(), path.file_name().and_then(|name| name.to_str())) {
                (Some(parent), Some(name)) => load(&Files::new(), parent, name),
                _ => continue,
            };
            let n = triangles.parse().ok();
            let mut good =
                std::iter::once(expected).chain(also.split(';')).any(|phrase| fits(&outcome, phrase, n));
            // Where the reader named the line, so must we: that one, or an earlier one (it checks some things last).
            let line =
                why.strip_prefix("line ").and_then(|rest| rest.split(':').next()?.parse::<usize>().ok());
            if let (Outcome::Failed(e), Some(line), "clear error") = (&outcome, line, expected) {
                good &= e.place().line.is_some_and(|ours| ours <= line);
            }
            (outcome, good)
        };
        let took = begun.elapsed();
        if !good || took > Duration::from_secs(5) {
            wrong.push(format!("{file}: {took:?}, {expected} ({also}; {why}), but {outcome:?}"));
        }
    }
    println!("{count} lines");
    wrong.iter().for_each(|line| println!("{line}"));
    assert!(wrong.is_empty(), "{} of {count} lines do not hold", wrong.len());
    // Linux says the most memory ever used, of all files together.
    if let Ok(status) = fs::read_to_string("/proc/self/status") {
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
        let peak: u64 = peak.and_then(|kb| kb.trim().parse().ok()).unwrap_or(0);
        println!("peak memory {} MiB", peak >> 10);
        assert!(peak < 1 << 20, "more than 1 GiB");
    }
}

#[test]
fn concave_polygons_cover_their_own_area() {
    let Some(folder) = shared("data/odd/made-here") else { return };
    for (name, area) in
        [("concave_L.obj", 5.0), ("concave_comb.obj", 23.0), ("polygon_hole_bridge.obj", 12.0)]
    {
        let files = Files::new();
        let model = AssetLoader::new(&files, &folder).load_obj(name).expect("it loads");
        let sum: f64 = model
            .triangles
            .iter()
            .map(|triangle| triangle.positions.map(|i| model.positions[i as usize]))
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
            .sum();
        assert!((sum - area).abs() < 1e-12, "{name}: {sum}");
    }
}
