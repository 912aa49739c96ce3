//! `--root DIR` on every verb that reads a scene or figure: what lies outside is refused by name, whoever named it.

#![cfg(unix)]

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, SMALL, TRIANGLE, command, finish, names, run};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

/// `in/` with scenes and figures that reach out of it, and `out/` with what they reach for.
fn fenced() -> (tempfile::TempDir, PathBuf) {
    let top = tempfile::tempdir().unwrap();
    let path = top.path().canonicalize().unwrap();
    for folder in ["in", "out"] {
        fs::create_dir(path.join(folder)).unwrap();
        fs::write(path.join(folder).join("t.obj"), TRIANGLE).unwrap();
        fs::write(path.join(folder).join("scene.toml"), format!("{CAMERA}{SMALL}")).unwrap();
    }
    fs::write(path.join("in/up.toml"), format!("{CAMERA}{SMALL}").replace("t.obj", "../out/t.obj")).unwrap();
    fs::write(path.join("in/figure.toml"), "kind = \"side-view\"\nscene = \"../out/scene.toml\"\n").unwrap();
    fs::write(path.join("in/plot.toml"), PLOT.replace("FILE", "../out/n.csv")).unwrap();
    fs::write(path.join("out/n.csv"), "a,b\n1,2\n2,3\n").unwrap();
    symlink("../out/scene.toml", path.join("in/link.toml")).unwrap();
    symlink("../out/t.obj", path.join("in/link.obj")).unwrap();
    (top, path)
}

const PLOT: &str =
    "kind = \"plot\"\n[[series]]\nname = \"n\"\ndata = \"FILE\"\nx_column = \"a\"\ny_column = \"b\"\n";

#[test]
fn every_verb_refuses_what_lies_outside_the_root() {
    let (_keep, folder) = fenced();
    let verbs: &[&[&str]] = &[
        &["optics"],
        &["solve", "--distance", "8"],
        &["check"],
        &["explain"],
        &["render", "-o", "o.png"],
        &["diagram", "-o", "o.svg"],
    ];
    for verb in verbs {
        for scene in ["out/scene.toml", "in/../out/scene.toml", "in/link.toml"] {
            let words: Vec<&str> = verb.iter().copied().chain([scene, "--root", "in"]).collect();
            run(&folder, &words).expect(2, &[scene, "root"]);
        }
        let words: Vec<&str> = verb.iter().copied().chain(["in/scene.toml", "--root", "in"]).collect();
        run(&folder, &words).expect(0, &[]);
    }
    for verb in &verbs[2..] {
        let words: Vec<&str> = verb.iter().copied().chain(["in/up.toml", "--root", "in"]).collect();
        run(&folder, &words).expect(2, &["../out/t.obj", "root", "in/up.toml:"]);
    }
    for figure in ["in/figure.toml", "in/plot.toml"] {
        run(&folder, &["diagram", figure, "-o", "f.svg"]).expect(0, &[]);
        run(&folder, &["diagram", figure, "-o", "g.svg", "--root", "in"]).expect(2, &["../out/", "root"]);
        run(&folder, &["diagram", "--check", figure, "--root", "in"]).expect(2, &["../out/", "root"]);
    }
    for model in ["out/t.obj", "in/link.obj"] {
        run(&folder, &["new", model, "-o", "n.toml", "--root", "in"]).expect(2, &[model, "root"]);
    }
    run(&folder, &["cost", "out/scene.toml", "--root", "in", "--quick"])
        .expect(2, &["out/scene.toml", "root"]);
    fs::write(folder.join("out/s.json"), "{}").unwrap();
    run(&folder, &["render", "in/scene.toml", "--replay", "out/s.json", "--root", "in"])
        .expect(2, &["out/s.json", "root"]);
    run(&folder, &["check", "in/scene.toml", "--root", "none"]).expect(2, &["none"]);
    run(&folder, &["check", "in/scene.toml", "--root", "in/t.obj"]).expect(2, &["not a folder"]);
    assert_eq!(names(&folder), ["f.svg", "in", "o.png", "o.svg", "out"]);
}

/// What an OBJ or MTL names outside is left out with a warning that names it, and nothing of it shows.
#[test]
fn textures_outside_the_root_are_left_out() {
    let (_keep, folder) = fenced();
    let brick = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tower/textures/brick.png");
    fs::copy(brick, folder.join("out/k.png")).unwrap();
    symlink("../out/k.png", folder.join("in/k.png")).unwrap();
    fs::write(folder.join("in/t.mtl"), "newmtl m\nmap_Kd k.png\n").unwrap();
    fs::write(folder.join("in/t.obj"), format!("mtllib t.mtl\nusemtl m\n{TRIANGLE}")).unwrap();
    let checked = run(&folder, &["check", "in/scene.toml", "--json", "--root", "in"]);
    let found = checked.expect(0, &[]).json();
    assert_eq!(found["meshes"][0]["textures"], 0);
    assert!(found["warnings"][0]["message"].as_str().unwrap().contains("k.png"), "{found}");
}

#[test]
fn outputs_do_not_follow_links_out_of_their_place() {
    let (_keep, folder) = fenced();
    fs::write(folder.join("out/kept.png"), "kept").unwrap();
    fs::write(folder.join("out/kept.svg"), "kept").unwrap();
    symlink("out/kept.png", folder.join("o.png")).unwrap();
    run(&folder, &["render", "in/scene.toml", "-o", "o.png"]).expect(3, &["o.png", "link"]);
    run(&folder, &["render", "in/scene.toml", "-o", "p.png", "--stats", "o.png"])
        .expect(3, &["o.png", "link"]);
    // Nobody named these: the default beside a figure file, and the default folder.
    fs::write(folder.join("in/figure.toml"), "kind = \"side-view\"\nscene = \"scene.toml\"\n").unwrap();
    symlink("../out/kept.svg", folder.join("in/figure.svg")).unwrap();
    run(&folder, &["diagram", "in/figure.toml"]).expect(3, &["figure.svg", "link"]);
    symlink("out", folder.join("groundglass-out")).unwrap();
    run(&folder, &["render", "in/scene.toml"]).expect(3, &["groundglass-out", "link"]);
    for name in ["kept.png", "kept.svg"] {
        assert_eq!(fs::read(folder.join("out").join(name)).unwrap(), b"kept");
    }
    // A folder that the user names may be a link, and a link within its folder stays one.
    symlink("in", folder.join("way")).unwrap();
    symlink("real.png", folder.join("in/here.png")).unwrap();
    fs::write(folder.join("in/real.png"), "old").unwrap();
    run(&folder, &["render", "in/scene.toml", "-o", "way/here.png"]).expect(0, &[]);
    assert!(folder.join("in/here.png").is_symlink());
    assert!(fs::read(folder.join("in/real.png")).unwrap().starts_with(b"\x89PNG"));
    assert_eq!(names(&folder.join("out")), ["kept.png", "kept.svg", "n.csv", "scene.toml", "t.obj"]);
}

/// What `diagram --check` compares with is read through the same door.
#[test]
fn a_stale_figure_may_be_a_device_or_endless() {
    let (_keep, folder) = fenced();
    fs::write(folder.join("in/figure.toml"), "kind = \"side-view\"\nscene = \"scene.toml\"\n").unwrap();
    symlink("/dev/zero", folder.join("in/figure.svg")).unwrap();
    let checked = run(&folder, &["diagram", "--check", "in/figure.toml"]);
    assert!(checked.expect(1, &[]).out.contains("cannot be read"), "{}", checked.out);
    fs::remove_file(folder.join("in/figure.svg")).unwrap();
    fs::File::create(folder.join("in/figure.svg")).unwrap().set_len(1 << 40).unwrap();
    let checked = run(&folder, &["diagram", "--check", "in/figure.toml"]);
    assert!(checked.expect(1, &[]).out.contains("is stale"), "{}", checked.out);
}

/// Devices, pipes and standard input, named by the user as well.
#[test]
fn a_scene_is_a_regular_file() {
    let (_keep, folder) = fenced();
    std::process::Command::new("mkfifo").arg(folder.join("pipe")).status().unwrap();
    for scene in
        ["/dev/zero", "/dev/stdin", "/dev/null", "/dev/tty", "pipe", "in", "/proc/self/environ", "a\nb"]
    {
        finish(command(&folder, &["check", scene])).expect(2, &["error: "]);
        finish(command(&folder, &["diagram", scene, "-o", "o.svg"])).expect(2, &["error: "]);
    }
}
