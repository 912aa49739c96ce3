//! Every seed and every past finding of the fuzzers, and every example and odd file that fits a target, through the same
//! functions without a fuzzer: none panics, and none takes long.

#[path = "../fuzz/targets.rs"]
mod targets;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn files(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if path.is_dir() {
            files(&path, endings, found);
        } else if endings.is_empty() || endings.contains(&&*ending) {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
fn no_seed_and_no_past_finding_panics() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let odd = root.join("../shared/data/odd");
    if !odd.exists() {
        println!("skipped: ../shared is missing, so the odd files are not among the seeds");
    }
    for (name, target) in targets::TARGETS {
        let mut list = Vec::new();
        for folder in ["seeds", "findings"] {
            files(&root.join("fuzz").join(folder).join(name), &[], &mut list);
        }
        let own = list.len();
        assert!(own > 0, "{name} has no seeds");
        let (folders, endings): (&[&str], &[&str]) = match name {
            "scene_toml" => (&["examples", "fuzz/seeds/figure_toml", "diagrams"], &["toml"]),
            "figure_toml" => (&["diagrams", "examples"], &["toml"]),
            "obj" | "mtl" => (&["../shared/data/odd", "fuzz/seeds/scene_toml"], &["obj", "mtl", "toml"]),
            "texture" => (&["../shared/data/odd"], &["png", "jpg", "jpeg", "bmp", "tga", "gif", "webp"]),
            _ => (&["fuzz/seeds"], &[]),
        };
        folders.iter().for_each(|folder| files(&root.join(folder), endings, &mut list));
        let mut slowest = Duration::ZERO;
        for path in &list {
            let mut bytes = fs::read(path).expect("a seed");
            bytes.truncate(1 << 20);
            if name == "texture" && !path.starts_with(root.join("fuzz")) {
                bytes.insert(0, 7);
            }
            let begun = Instant::now();
            target(&bytes);
            slowest = slowest.max(begun.elapsed());
            assert!(begun.elapsed() < Duration::from_secs(10), "{name}: {} takes long", path.display());
        }
        println!(
            "{name}: {own} seeds and findings, {} other files, the slowest {slowest:?}",
            list.len() - own
        );
    }
}

/// Bytes of no kind in particular.
#[test]
fn no_noise_panics() {
    let mut state = 1u64;
    for (_, target) in targets::TARGETS {
        for length in (0..200).chain([1000, 10_000]) {
            let bytes: Vec<u8> = (0..length)
                .map(|_| {
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (state >> 56) as u8
                })
                .collect();
            target(&bytes);
        }
    }
}
