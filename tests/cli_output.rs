//! Files that the program writes: whole or not at all, never over what it read, and what stops it is said early.

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, SMALL, command, finish, folder, heard, names, run};
use std::fs;
use std::path::Path;

/// A scene with a material and a texture, and what is in its folder.
fn textured() -> (tempfile::TempDir, std::path::PathBuf) {
    let (keep, path) = folder(&format!("{CAMERA}{SMALL}"));
    let obj = format!("mtllib t.mtl\nusemtl m\n{}", program::TRIANGLE);
    fs::write(path.join("t.obj"), obj).unwrap();
    fs::write(path.join("t.mtl"), "newmtl m\nmap_Kd k.png\n").unwrap();
    let brick = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tower/textures/brick.png");
    fs::copy(brick, path.join("k.png")).unwrap();
    (keep, path)
}

#[test]
fn no_output_replaces_what_was_read() {
    let (_keep, folder) = textured();
    let before = |name: &str| fs::read(folder.join(name)).unwrap();
    let inputs = ["scene.toml", "t.obj", "t.mtl", "k.png"];
    let kept: Vec<Vec<u8>> = inputs.iter().map(|name| before(name)).collect();
    fs::create_dir(folder.join("in")).unwrap();
    for name in inputs {
        let words = ["render", "scene.toml", "-o", "o.png", "--stats", name];
        run(&folder, &words).expect(2, &[name, "read as input"]);
        run(&folder, &["render", "scene.toml", "-o", "o.png", "--stats", &format!("in/../{name}")])
            .expect(2, &[name]);
    }
    run(&folder, &["render", "scene.toml", "-o", "k.png"]).expect(2, &["k.png"]);
    for name in ["t.mtl", "k.png", "t.obj"] {
        run(&folder, &["new", "t.obj", "-o", name, "--force"]).expect(2, &[name]);
        run(&folder, &["solve", "scene.toml", "--distance", "8", "--write", name]).expect(2, &[name]);
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("k.png", folder.join("link.png")).unwrap();
        fs::hard_link(folder.join("k.png"), folder.join("hard.png")).unwrap();
        for name in ["link.png", "hard.png"] {
            run(&folder, &["render", "scene.toml", "-o", name]).expect(2, &[name, "read as input"]);
        }
    }
    for (name, bytes) in inputs.iter().zip(kept) {
        assert!(before(name) == bytes, "{name} was changed");
    }
    assert!(!names(&folder).iter().any(|name| name == "o.png" || name.ends_with(".part")));
}

/// A figure reads no texture of the scene that it draws; the scene names it all the same.
#[test]
fn what_a_figures_scene_names_and_what_others_made_stays() {
    let (_keep, folder) = textured();
    fs::write(folder.join("fig.toml"), "kind = \"side-view\"\nscene = \"scene.toml\"\n").unwrap();
    // Nor does any verb read the maps of bumps and of materials that no face uses.
    let library = "newmtl m\nmap_Kd k.png\nmap_bump -bm 0.5 bump.png\nnewmtl unused\nmap_Kd unused.png\n";
    fs::write(folder.join("t.mtl"), library).unwrap();
    for name in ["k.png", "bump.png", "unused.png"] {
        fs::copy(folder.join("k.png"), folder.join("a copy")).unwrap();
        fs::rename(folder.join("a copy"), folder.join(name)).unwrap();
        for words in [&["diagram", "fig.toml"][..], &["diagram", "scene.toml"], &["render", "scene.toml"]] {
            run(&folder, &[words, &["-o", name]].concat()).expect(2, &[name, "read as input"]);
        }
        run(&folder, &["new", "t.obj", "--force", "-o", name]).expect(2, &[name]);
    }
    for (name, words) in [
        ("Cargo.toml", &["solve", "scene.toml", "--distance", "8", "--write", "Cargo.toml"][..]),
        ("README.md", &["diagram", "fig.toml", "--gallery", "README.md"]),
        ("blur.csv", &["stability", "-o", "."]),
        ("hinge-distance.toml", &["stability", "-o", "."]),
    ] {
        fs::write(folder.join(name), "[package]\n").unwrap();
        run(&folder, words).expect(2, &[name, "already"]);
        assert_eq!(fs::read_to_string(folder.join(name)).unwrap(), "[package]\n");
        fs::remove_file(folder.join(name)).unwrap();
    }
    assert_eq!(names(&folder).len(), 7, "{:?}", names(&folder));
    // What it made itself it makes again.
    run(&folder, &["solve", "scene.toml", "--distance", "8", "--write", "new.toml"]).expect(0, &[]);
    run(&folder, &["solve", "scene.toml", "--distance", "9", "--write", "new.toml"]).expect(0, &[]);
    run(&folder, &["stability", "-o", "maps"]).expect(0, &[]);
    run(&folder, &["stability", "-o", "maps"]).expect(0, &[]);
}

#[test]
fn names_do_not_drive_the_terminal() {
    let (_keep, folder) = textured();
    let name = "\u{1b}[31mred\u{7}.obj";
    fs::copy(folder.join("t.obj"), folder.join(name)).unwrap();
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let scene = scene.replace("t.obj", "\\u001b[31mred\\u0007.obj");
    fs::write(folder.join("e.toml"), scene).unwrap();
    for words in [&["check", "e.toml"][..], &["render", "e.toml", "-o", "\u{1b}[1m.png"]] {
        let answer = run(&folder, words);
        assert_eq!(answer.code, 0, "{}", answer.err);
        assert!(!answer.out.contains(['\u{1b}', '\u{7}']), "{:?}", answer.out);
    }
}

#[test]
#[cfg(unix)]
fn what_is_private_is_private_while_it_is_written() {
    use std::os::unix::fs::PermissionsExt;
    let (_keep, folder) = textured();
    fs::write(folder.join("o.png"), "old").unwrap();
    fs::set_permissions(folder.join("o.png"), fs::Permissions::from_mode(0o600)).unwrap();
    let mut child =
        command(&folder, &["render", "scene.toml", "--width", "2000", "--samples", "64", "-o", "o.png"])
            .spawn()
            .unwrap();
    let mut seen = 0;
    while child.try_wait().unwrap().is_none() {
        for name in names(&folder).iter().filter(|name| name.ends_with(".part")) {
            if let Ok(found) = fs::metadata(folder.join(name)) {
                assert_eq!(found.permissions().mode() & 0o077, 0, "{name}");
                seen += 1;
            }
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    assert!(seen > 0 && child.wait().unwrap().success());
    assert_eq!(fs::metadata(folder.join("o.png")).unwrap().permissions().mode() & 0o777, 0o600);
}

#[test]
fn one_file_for_picture_and_stats_is_wrong_usage() {
    let (_keep, folder) = textured();
    for stats in ["o.png", "./o.png"] {
        run(&folder, &["render", "scene.toml", "-o", "o.png", "--stats", stats]).expect(64, &["--stats"]);
    }
    assert!(!folder.join("o.png").exists());
}

#[test]
fn what_cannot_be_written_is_3_and_leaves_nothing() {
    let (_keep, folder) = textured();
    fs::create_dir(folder.join("dir.png")).unwrap();
    fs::write(folder.join("locked.png"), "x").unwrap();
    let mut locked = fs::metadata(folder.join("locked.png")).unwrap().permissions();
    locked.set_readonly(true);
    fs::set_permissions(folder.join("locked.png"), locked).unwrap();
    let before = names(&folder);
    let long = format!("{}.png", "a".repeat(300));
    for (name, why) in [
        ("dir.png", "folder"),
        ("none/o.png", "folder"),
        ("t.obj/o.png", "o.png"),
        ("locked.png", "read-only"),
        (&*long, "aaa"),
    ] {
        run(&folder, &["render", "scene.toml", "-o", name]).expect(3, &[why]);
        run(&folder, &["render", "scene.toml", "-o", "o.png", "--stats", name]).expect(3, &[why]);
    }
    for target in ["dir.png", "none/s.toml"] {
        run(&folder, &["new", "t.obj", "-o", target]).expect(3, &[target]);
        run(&folder, &["solve", "scene.toml", "--distance", "8", "--write", target]).expect(3, &[target]);
    }
    run(&folder, &["cost", "scene.toml", "-o", "t.obj"]).expect(3, &["t.obj: is a file"]);
    run(&folder, &["cost", "scene.toml", "-o", "t.obj/study"])
        .expect(3, &["t.obj/study", "`t.obj` is a file"]);
    assert_eq!(names(&folder), before, "a picture is not left when its statistics cannot be");
    fs::write(folder.join("groundglass-out"), "x").unwrap();
    run(&folder, &["render", "scene.toml"]).expect(3, &["groundglass-out"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_3_for_text_and_help() {
    let (_keep, folder) = textured();
    for words in [
        &["optics", "scene.toml", "--json"][..],
        &["check", "scene.toml"],
        &["solve", "scene.toml", "--distance", "8"],
        &["--help"],
        &["--version"],
        &["help", "render"],
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = command(&folder, words);
        let status = command.stdout(full).stderr(std::process::Stdio::null()).status().unwrap();
        assert_eq!(status.code(), Some(3), "{words:?}");
    }
    // Standard error may be full or closed: the work is done all the same.
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    assert_eq!(command(&folder, &["check", "none.toml"]).stderr(full).status().unwrap().code(), Some(2));
}

#[test]
fn names_with_spaces_and_other_letters_work() {
    let (_keep, folder) = textured();
    let inner = folder.join("ä b 日本");
    fs::create_dir(&inner).unwrap();
    for name in ["scene.toml", "t.obj", "t.mtl", "k.png"] {
        fs::rename(folder.join(name), inner.join(name)).unwrap();
    }
    run(&folder, &["render", "ä b 日本/scene.toml", "-o", "ö ü.png"]).expect(0, &[]);
    run(&folder, &["render", "ä b 日本/scene.toml"]).expect(0, &[]);
    run(&folder, &["new", "ä b 日本/t.obj"]).expect(0, &[]);
    run(&folder, &["render", "ä b 日本/scene.toml", "-o", "-x.png"]).expect(0, &[]);
    // A flag is no name.
    run(&folder, &["new", "ä b 日本/t.obj", "-o", "--force"]).expect(64, &["write ./--force"]);
    assert_eq!(names(&folder), ["-x.png", "groundglass-out", "t.toml", "ä b 日本", "ö ü.png"]);
    assert_eq!(names(&folder.join("groundglass-out")), ["scene.png"]);
    run(&folder, &["check", "t.toml"]).expect(0, &[]);
}

#[test]
fn a_failed_load_leaves_no_folder() {
    let (_keep, folder) = folder(&format!("{CAMERA}[[mesh]]\npath = \"none.obj\"\n"));
    run(&folder, &["render", "scene.toml"]).expect(2, &["scene.toml:9:8", "mesh[0].path", "none.obj"]);
    assert_eq!(names(&folder), ["scene.toml", "t.obj"]);
}

#[test]
fn an_existing_picture_is_replaced_and_keeps_its_permissions() {
    let (_keep, folder) = textured();
    fs::write(folder.join("o.PNG"), "old").unwrap();
    #[cfg(unix)]
    fs::set_permissions(folder.join("o.PNG"), std::os::unix::fs::PermissionsExt::from_mode(0o640)).unwrap();
    run(&folder, &["render", "scene.toml", "-o", "o.PNG"]).expect(0, &[]);
    assert!(fs::read(folder.join("o.PNG")).unwrap().starts_with(b"\x89PNG"));
    #[cfg(unix)]
    {
        let mode = std::os::unix::fs::PermissionsExt::mode(
            &fs::metadata(folder.join("o.PNG")).unwrap().permissions(),
        );
        assert_eq!(mode & 0o777, 0o640);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn signals_while_loading_rendering_and_writing_leave_nothing() {
    let signal = |folder: &Path, words: &[&str], wait: u64, name: &'static str| {
        let mut child = command(folder, words)
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let begun = std::time::Instant::now();
        let kill =
            std::process::Command::new("kill").args([heard(name), &child.id().to_string()]).status().unwrap();
        let code = child.wait().unwrap().code();
        assert!(kill.success() && code == Some(75), "{words:?} {name}: {code:?}");
        assert!(begun.elapsed().as_secs_f64() < 5.0, "{words:?} {name}: {:?}", begun.elapsed());
    };
    let (_keep, folder) = textured();
    let before = names(&folder);
    for name in ["-INT", "-TERM", "-HUP"] {
        // Tiles of a quarter of a second each, for a minute.
        let long = ["render", "scene.toml", "-o", "o.png", "--width", "512", "--samples", "400000"];
        signal(&folder, &long, 300, name);
    }
    // Writing takes seconds.
    let big = ["render", "scene.toml", "-o", "o.exr", "--samples", "1", "--width", "6000"];
    for wait in [300, 1200, 2000] {
        signal(&folder, &big, wait, "-TERM");
    }
    assert_eq!(names(&folder), before);
    let faces = "f 1 2 3\n".repeat(4_000_000);
    fs::write(folder.join("t.obj"), format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}")).unwrap();
    signal(&folder, &["render", "scene.toml", "-o", "o.png"], 250, "-INT");
    assert_eq!(names(&folder), before);
}

#[cfg(unix)]
#[test]
fn a_default_folder_that_another_run_took_away_is_made_again() {
    let (_keep, folder) = textured();
    let words = ["render", "scene.toml", "--width", "512", "--samples", "4000"];
    let mut child = command(&folder, &words).stderr(std::process::Stdio::null()).spawn().unwrap();
    let made = folder.join("groundglass-out");
    // At any moment that it is empty: before the work, while it draws, and before the picture is written.
    let mut times_gone = 0;
    while child.try_wait().unwrap().is_none() {
        times_gone += u32::from(fs::remove_dir(&made).is_ok());
        // (Without a pause it is gone faster than anything can be put into it.)
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    assert!(times_gone > 0);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(names(&made), ["scene.png"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_pipe_is_no_file_to_replace() {
    let (_keep, folder) = textured();
    for name in ["blur.csv", "o.png"] {
        let pipe = folder.join(name);
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    }
    run(&folder, &["render", "scene.toml", "-o", "o.png"]).expect(3, &["o.png", "regular file"]);
    run(&folder, &["stability", "-o", "."]).expect(3, &["blur.csv", "regular file"]);
}

#[test]
fn a_width_beyond_all_memory_is_2() {
    let (_keep, folder) = textured();
    for width in ["1000000000", "99999999999999999999", "32768"] {
        run(&folder, &["render", "scene.toml", "--width", width]).expect(2, &["pixels", "32767"]);
    }
    for width in ["0", "-1", "1.5", "x", ""] {
        run(&folder, &["render", "scene.toml", "--width", width]).expect(64, &["--help"]);
    }
    assert!(!folder.join("groundglass-out").exists());
}

/// The address space is limited, as a cluster does.
#[cfg(target_os = "linux")]
#[test]
fn too_little_memory_is_2() {
    let (_keep, folder) = textured();
    let limited = |kilobytes: u32, rest: &str| {
        let program = env!("CARGO_BIN_EXE_groundglass");
        let mut shell = std::process::Command::new("sh");
        shell.current_dir(&folder).args(["-c", &format!("ulimit -v {kilobytes}; '{program}' {rest}")]);
        finish(shell)
    };
    limited(1_000_000, "render scene.toml -o o.png --width 20000 --samples 1").expect(2, &["GB"]);
    limited(1_000_000, "render scene.toml -o o.png --threads 1").expect(0, &[]);
    fs::write(folder.join("t.obj"), format!("{}{}", program::TRIANGLE, "f 1 2 3\n".repeat(20_000))).unwrap();
    let meshes = "[[mesh]]\npath = \"t.obj\"\n".repeat(2000);
    fs::write(folder.join("scene.toml"), format!("{CAMERA}{meshes}")).unwrap();
    limited(1_000_000, "check scene.toml").expect(2, &["GB", "mesh[1999]"]);
    // Below what the system's loader takes there is no program; from there on no thread may be had, which is no panic.
    for kilobytes in (16_000..30_000).step_by(500) {
        let told = limited(kilobytes, "--version").err;
        assert!(!told.contains("panicked"), "{kilobytes}: {told}");
    }
}

#[test]
fn what_the_first_picture_is_drawn_beside_does_not_replace_it() {
    let (_keep, folder) = folder("");
    let quick = ["--width", "16", "--samples", "2"];
    for words in
        [&["-o", "o.png", "--stats", "o-diagram.svg"][..], &["-o", "o.png", "--error-map", "o-diagram.png"]]
    {
        run(&folder, &[&["render"], words, &quick].concat()).expect(64, &["name one file", "two names"]);
    }
    assert_eq!(names(&folder), ["scene.toml", "t.obj"]);
    fs::write(folder.join("tower-diagram.svg"), "mine").unwrap();
    run(&folder, &[&["render", "-o", "a.b.png"][..], &quick].concat()).expect(0, &[]);
    assert_eq!(fs::read_to_string(folder.join("tower-diagram.svg")).unwrap(), "mine");
    let written =
        ["a.b-diagram.png", "a.b-diagram.svg", "a.b.png", "scene.toml", "t.obj", "tower-diagram.svg"];
    assert_eq!(names(&folder), written);
}

#[test]
fn files_may_go_into_the_folder_that_is_made_for_the_picture() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    run(&folder, &["render", "scene.toml", "--stats", "groundglass-out/s.json"]).expect(0, &[]);
    assert_eq!(names(&folder.join("groundglass-out")), ["s.json", "scene.png"]);
    // What lies in no folder is said before the work all the same.
    run(&folder, &["render", "scene.toml", "--stats", "nowhere/s.json"]).expect(3, &["nowhere"]);
}
