//! The ladder of modules in ARCHITECTURE.md is true, and the binary needs nothing of the system.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Module -> what its line of the table allows.
fn ladder() -> BTreeMap<String, BTreeSet<String>> {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let table = text.split("## The ladder").nth(1).unwrap().split("\n## ").next().unwrap();
    table
        .lines()
        .filter(|line| line.starts_with("| ") && !line.contains("may use"))
        .map(|line| {
            let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
            let allowed =
                cells[1].split(',').map(|name| name.trim().to_owned()).filter(|name| name != "nothing");
            (cells[0].to_owned(), allowed.collect())
        })
        .collect()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn modules_use_only_what_the_ladder_allows() {
    let ladder = ladder();
    let mut files = Vec::new();
    sources(&root().join("src"), &mut files);
    let mut steps = 0;
    for file in files {
        let relative = file.strip_prefix(root().join("src")).unwrap().to_str().unwrap().replace('\\', "/");
        let module = relative.split('/').next().unwrap().trim_end_matches(".rs").to_owned();
        let text = fs::read_to_string(&file).unwrap();
        let code: String =
            text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
        if ["main", "cli"].contains(&module.as_str()) {
            for line in code.lines().filter(|line| line.contains("crate::")) {
                assert!(line.contains("crate::cli"), "{relative} sees more than the public API: {line}");
            }
            continue;
        }
        if module == "lib" {
            continue;
        }
        let allowed =
            ladder.get(&module).unwrap_or_else(|| panic!("{module} has no line in ARCHITECTURE.md"));
        for used in code.split("crate::").skip(1) {
            let used: String = used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            assert!(
                used.is_empty() || used == module || allowed.contains(&used),
                "{relative} uses crate::{used}, which the ladder does not allow"
            );
            steps += 1;
        }
    }
    assert!(steps > 20, "the scan found nothing to check");
}

/// What of its own folder each module there uses, tests left out.
fn uses(folder: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut files = Vec::new();
    sources(&root().join("src").join(folder), &mut files);
    let name = |file: &PathBuf| file.file_stem().unwrap().to_str().unwrap().to_owned();
    let names: BTreeSet<String> = files.iter().map(name).filter(|name| name != "mod").collect();
    let used = |file: &PathBuf| {
        let text = fs::read_to_string(file).unwrap();
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
        let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        let code = lines.collect::<Vec<_>>().join(" ");
        let words = |text: &str| -> Vec<String> {
            text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned).collect()
        };
        let of = |used: &str| match used.strip_prefix('{') {
            Some(several) => words(several.split('}').next().unwrap()),
            None => words(used).into_iter().take(1).collect(),
        };
        code.split("super::").skip(1).flat_map(of).filter(|used| names.contains(used)).collect()
    };
    files.iter().map(|file| (name(file), used(file))).filter(|(name, _)| name != "mod").collect()
}

#[test]
fn modules_of_a_stage_use_one_another_in_one_direction() {
    let mut count = 0;
    for folder in ["raster", "shade", "sampling", "optics", "picture"] {
        let mut left = uses(folder);
        count += left.values().map(BTreeSet::len).sum::<usize>();
        // What uses none that are left goes, until only circles are.
        while let Some(next) =
            left.keys().find(|&name| left[name].iter().all(|used| used == name || !left.contains_key(used)))
        {
            let next = next.clone();
            left.remove(&next);
        }
        assert!(left.is_empty(), "{folder}: in or above a circle: {:?}", left.keys());
    }
    assert!(count > 100, "the scan found nothing to check");
}

#[test]
#[cfg(target_os = "linux")]
fn the_binary_links_only_the_c_library() {
    // The dynamic section's needed libraries, read from the ELF file by its strings: every `lib*.so*` name.
    let binary = fs::read(env!("CARGO_BIN_EXE_groundglass")).unwrap();
    let allowed =
        ["libc.so.6", "libm.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"];
    for needed in needed_libraries(&binary) {
        assert!(allowed.contains(&needed.as_str()), "the binary links {needed}");
    }
}

/// The `DT_NEEDED` entries of a 64-bit little-endian ELF file.
#[cfg(target_os = "linux")]
fn needed_libraries(elf: &[u8]) -> Vec<String> {
    assert_eq!(&elf[..6], b"\x7fELF\x02\x01");
    let number = |at: usize, bytes: usize| {
        elf[at..at + bytes].iter().rev().fold(0u64, |sum, &byte| sum << 8 | u64::from(byte)) as usize
    };
    let (sections, size, count) = (number(0x28, 8), number(0x3a, 2), number(0x3c, 2));
    let header = |i: usize| sections + i * size;
    // Section type 6 is the dynamic section; its link names the string table.
    let dynamic = (0..count).map(header).find(|&at| number(at + 4, 4) == 6).expect("a dynamic section");
    let strings = number(header(number(dynamic + 0x28, 4)) + 0x18, 8);
    let (start, length) = (number(dynamic + 0x18, 8), number(dynamic + 0x20, 8));
    let names: Vec<String> = (start..start + length)
        .step_by(16)
        .filter(|&at| number(at, 8) == 1)
        .map(|at| {
            let name = &elf[strings + number(at + 8, 8)..];
            String::from_utf8_lossy(&name[..name.iter().position(|&b| b == 0).unwrap()]).into_owned()
        })
        .collect();
    assert!(names.iter().any(|name| name.starts_with("libc.so")), "{names:?}");
    names
}
