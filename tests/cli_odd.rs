//! Every odd or malformed file through the program itself: `check --json`, and `render` when it loads. The exit
//! code is 0 or 2, nothing panics, each run ends soon, and on an error standard output is empty. What the
//! manifest expects of each file is judged in `odd_files.rs`.

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, run, shared};
use std::fs;
use std::path::Path;

fn scene(mesh: &str) -> String {
    let path = mesh.replace('\\', "\\\\").replace('"', "\\\"");
    format!("{CAMERA}[[mesh]]\npath = \"{path}\"\n[render]\nwidth = 64\nsamples = 1\n")
}

fn judge(folder: &Path, file: &str, wrong: &mut Vec<String>) -> bool {
    let checked = run(folder, &["check", "scene.toml", "--json"]);
    let mut fault = |text: String| wrong.push(format!("{file}: {text}"));
    if ![0, 2].contains(&checked.code) || checked.err.contains("panicked") || checked.took.as_secs() >= 5 {
        fault(format!("check: {} after {:?}: {}", checked.code, checked.took, checked.err));
    }
    if checked.code != 0 {
        if !checked.out.is_empty() || !checked.err.starts_with("error: ") {
            fault(format!("check says {:?} and {:?}", checked.out, checked.err));
        }
        return false;
    }
    let found = checked.json();
    if found["meshes"].as_array().map(Vec::len) != Some(1) || !found["warnings"].is_array() {
        fault(format!("check gives {found}"));
    }
    let drawn = run(folder, &["render", "scene.toml", "-o", "o.png"]);
    if ![0, 2].contains(&drawn.code) || drawn.err.contains("panicked") || drawn.took.as_secs() >= 5 {
        fault(format!("render: {} after {:?}: {}", drawn.code, drawn.took, drawn.err));
    }
    if (drawn.code == 0) != folder.join("o.png").is_file() {
        fault("a picture is there without success, or none with it".into());
    }
    let _ = fs::remove_file(folder.join("o.png"));
    true
}

#[test]
fn every_odd_file_ends_in_a_picture_or_a_clear_error() {
    let Some(odd) = shared("data/odd") else { return };
    let odd = odd.canonicalize().unwrap();
    let manifest = fs::read_to_string(odd.join("MANIFEST.tsv")).unwrap();
    let (mut wrong, mut count, mut loaded) = (Vec::new(), 0, 0);
    for row in manifest.lines().skip(1) {
        let mut cells = row.split('\t');
        let (Some(file), Some(kind)) = (cells.next(), cells.next()) else { continue };
        count += 1;
        let (_keep, folder) = program::folder("");
        let mesh = if kind == "image" {
            let name = Path::new(file).file_name().unwrap().to_str().unwrap();
            fs::copy(odd.join(file), folder.join(name)).unwrap();
            fs::write(folder.join("t.mtl"), format!("newmtl m\nmap_Kd {name}\n")).unwrap();
            fs::write(folder.join("t.obj"), format!("mtllib t.mtl\nusemtl m\n{}", program::TRIANGLE))
                .unwrap();
            "t.obj".to_owned()
        } else {
            // A scene names its meshes by relative paths.
            let up = "../".repeat(folder.canonicalize().unwrap().components().count() - 1);
            format!("{up}{}", odd.join(file).to_str().unwrap().trim_start_matches('/'))
        };
        fs::write(folder.join("scene.toml"), scene(&mesh)).unwrap();
        loaded += usize::from(judge(&folder, file, &mut wrong));
    }
    println!("{count} files, {loaded} load");
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(count > 0 && loaded > 0);
}
