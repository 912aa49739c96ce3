//! The program from outside: exit codes, where text goes, and that errors name line, key and remedy.

#[path = "common/program.rs"]
mod program;

use program::heard;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const CAMERA: &str = "[camera]
eye_m = [0.0, 1.6, 10.0]
look_at_m = [0.0, 1.6, 0.0]
focal_length_mm = 150.0
f_number = 5.6
film = \"4x5\"
extension_mm = 152.3
";

const READERS: [&[&str]; 5] = [
    &["optics", "SCENE", "--json"],
    &["solve", "SCENE"],
    &["render", "SCENE"],
    &["diagram", "SCENE", "-o", "x.svg"],
    &["check", "SCENE", "--json"],
];

fn groundglass(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_groundglass"));
    command.args(words).current_dir(folder).env("NO_COLOR", "1").output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("ended by a signal")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn folder(scene: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let path = folder.path().to_path_buf();
    (folder, path)
}

#[test]
fn wrong_usage_is_64() {
    let (_keep, folder) = folder(CAMERA);
    let wrong: [&[&str]; 28] = [
        &["render", "scene.toml", "--max-error", "-1"],
        &["render", "scene.toml", "--time-budget", "-1s"],
        &["render", "scene.toml", "--width", "-3"],
        &[],
        &["nothing"],
        &["--nothing"],
        &["optics"],
        &["optics", "scene.toml", "--samples-at", "2,0"],
        &["optics", "scene.toml", "--samples-at", "x"],
        &["optics", "scene.toml", "more"],
        &["solve", "scene.toml", "--plane", "0,0,0;0,0,0"],
        &["solve", "scene.toml", "--distance", "-1"],
        &["solve", "scene.toml", "--distance", "1", "--points", "0,0,0;1,0,0;0,1,0"],
        &["solve", "scene.toml", "--adjust", "both"],
        &["render", "scene.toml", "--samples", "0"],
        &["render", "scene.toml", "--samples", "4", "--max-error", "0.1"],
        &["render", "scene.toml", "--samples", "4", "--time-budget", "2s"],
        &["render", "scene.toml", "--max-error", "0.1", "--time-budget", "2s"],
        &["render", "scene.toml", "--width", "0"],
        &["render", "scene.toml", "--threads", "0"],
        &["render", "scene.toml", "--simd", "mmx"],
        // No machine has both.
        if cfg!(target_arch = "aarch64") {
            &["render", "scene.toml", "--simd", "avx2"]
        } else {
            &["render", "scene.toml", "--simd", "neon"]
        },
        &["render", "scene.toml", "-o", "x.jpg"],
        &["render", "scene.toml", "-o", "x"],
        &["diagram", "scene.toml"],
        &["diagram", "scene.toml", "-o", "x.eps"],
        &["diagram", "scene.toml", "-o", "x.svg", "--section", "front"],
        &["new"],
    ];
    for words in wrong {
        let output = groundglass(&folder, words);
        assert_eq!(code(&output), 64, "{words:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{words:?}");
    }
}

#[test]
fn help_and_version_are_0() {
    let (_keep, folder) = folder(CAMERA);
    for words in [&["--help"][..], &["--version"], &["help"], &["render", "--help"], &["solve", "-h"]] {
        let output = groundglass(&folder, words);
        assert_eq!(code(&output), 0, "{words:?}");
        assert!(!output.stdout.is_empty() && output.stderr.is_empty(), "{words:?}");
    }
}

#[test]
fn missing_files_folders_and_files_outside_the_root_are_2() {
    let (_keep, folder) = folder(CAMERA);
    std::fs::create_dir(folder.join("inner")).unwrap();
    std::fs::write(folder.join("model.obj"), "v 0 0 0\n").unwrap();
    let cases: [(&str, &[&str], &str); 5] = [
        ("none.toml", &[], "none.toml"),
        ("inner", &[], "folder"),
        // A model is no scene, and can have one.
        ("model.obj", &[], "groundglass new"),
        ("scene.toml", &["--root", "inner"], "root"),
        ("scene.toml", &["--root", "none"], "none"),
    ];
    for words in READERS {
        for (scene, more, shown) in cases {
            let mut words: Vec<&str> = words.iter().map(|&w| if w == "SCENE" { scene } else { w }).collect();
            words.extend(more);
            let output = groundglass(&folder, &words);
            assert_eq!(code(&output), 2, "{words:?}");
            assert!(
                output.stdout.is_empty() && stderr(&output).contains(shown),
                "{words:?}: {}",
                stderr(&output)
            );
        }
    }
    #[cfg(unix)]
    assert_eq!(code(&groundglass(&folder, &["check", "/dev/zero"])), 2);
}

#[test]
fn a_wrong_scene_is_2_and_names_file_line_key_and_remedy() {
    for (more, shown) in [
        ("[camera.front]\ntillt_deg = 6\n", ["scene.toml:9:1", "tillt_deg", "`tilt_deg`"]),
        ("near_m = 0\n", ["scene.toml:8:10", "camera.near_m", "near_m = 0.015"]),
        ("x = = 2\n", ["scene.toml:8:", "not TOML", "x = = 2"]),
        ("[focus]\nadjust = 3\n", ["scene.toml:9:10", "focus.adjust", "front"]),
    ] {
        let (_keep, folder) = folder(&format!("{CAMERA}{more}"));
        for words in READERS {
            let words: Vec<&str> =
                words.iter().map(|&w| if w == "SCENE" { "scene.toml" } else { w }).collect();
            let output = groundglass(&folder, &words);
            assert_eq!(code(&output), 2, "{words:?}");
            for word in shown {
                assert!(stderr(&output).contains(word), "`{word}` is not in {}", stderr(&output));
            }
            assert!(output.stdout.is_empty());
        }
    }
    let (_keep, folder) = folder("kind = \"hinge\"\n");
    let output = groundglass(&folder, &["check", "scene.toml"]);
    assert!(code(&output) == 2 && stderr(&output).contains("figure"), "{}", stderr(&output));
    std::fs::write(folder.join("scene.toml"), b"\xff\xfe[\0c\0").unwrap();
    let output = groundglass(&folder, &["check", "scene.toml"]);
    assert!(code(&output) == 2 && stderr(&output).contains("UTF-8"), "{}", stderr(&output));
}

#[test]
fn the_schema_is_json_with_the_contracts_tables() {
    let (_keep, folder) = folder("");
    let output = groundglass(&folder, &["schema"]);
    assert_eq!(code(&output), 0);
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let keys = |at: &str| -> Vec<String> {
        schema.pointer(at).and_then(|map| map.as_object()).unwrap().keys().cloned().collect()
    };
    assert_eq!(keys("/properties"), ["camera", "focus", "mesh", "render", "sky", "sun"]);
    assert_eq!(
        keys("/properties/camera/properties/front/properties"),
        ["rise_mm", "shift_mm", "swing_deg", "tilt_deg"]
    );
    assert_eq!(schema["required"], serde_json::json!(["camera"]));
    assert_eq!(
        schema["properties"]["camera"]["required"],
        serde_json::json!(["eye_m", "look_at_m", "focal_length_mm"])
    );
    assert_eq!(schema["properties"]["sun"]["required"], serde_json::json!(["toward", "color"]));
}

#[test]
fn a_closed_pipe_is_no_error() {
    let (_keep, folder) = folder("");
    for words in [&["schema"][..], &["--help"]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_groundglass"))
            .args(words)
            .current_dir(&folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((code(&output), stderr(&output).as_str()), (0, ""), "{words:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_is_full_is_3() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_groundglass")).arg("schema").stdout(full).output().unwrap();
    assert_eq!(code(&output), 3, "{}", stderr(&output));
}

#[test]
fn new_does_not_replace_a_scene_unasked() {
    let (_keep, folder) = folder("# mine\n");
    std::fs::write(folder.join("scene.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let output = groundglass(&folder, &["new", "scene.obj"]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("--force"), "{}", stderr(&output));
    assert_eq!(std::fs::read_to_string(folder.join("scene.toml")).unwrap(), "# mine\n");
    assert_eq!(code(&groundglass(&folder, &["new", "none.obj"])), 2);
}

/// A verb that hangs in writing to a full pipe is stopped.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_ends_the_program_with_75() {
    use std::io::Write;
    for signal in ["-TERM", "-INT"] {
        let (_reader, mut writer) = std::io::pipe().unwrap();
        // The default capacity of a pipe; this much never blocks.
        writer.write_all(&[0; 65_536]).unwrap();
        let mut child =
            Command::new(env!("CARGO_BIN_EXE_groundglass")).arg("schema").stdout(writer).spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(500));
        if child.try_wait().unwrap().is_some() {
            println!("skipped: this system's pipes are larger than 64 KiB");
            return;
        }
        assert!(
            Command::new("kill").args([heard(signal), &child.id().to_string()]).status().unwrap().success()
        );
        assert_eq!(child.wait().unwrap().code(), Some(75), "{signal}");
    }
}
