//! Every key of the scene file with values that cannot be, and cameras at the ends of what can: an error with line
//! and key, or a picture of finite numbers.

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, SMALL, folder, run};
use std::fs;
use std::path::Path;

/// A scene that has every key once, and in which each value may be replaced.
const EVERY_KEY: &str = "[camera]
eye_m = [0.0, 1.6, 10.0]
look_at_m = [0.0, 1.6, 0.0]
up = [0.0, 1.0, 0.0]
focal_length_mm = 150.0
f_number = 5.6
film_mm = [120.0, 96.0]
extension_mm = 152.3
near_m = 0.015
[camera.front]
tilt_deg = 1.0
swing_deg = 1.0
rise_mm = 1.0
shift_mm = 1.0
[camera.rear]
tilt_deg = 1.0
swing_deg = 1.0
rise_mm = 1.0
shift_mm = 1.0
[camera.aperture]
blades = 7
rotation_deg = 10.0
[focus]
plane = { point_m = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }
adjust = \"front\"
circle_of_confusion_mm = 0.1
[[mesh]]
path = \"t.obj\"
scale = 1.0
rotate_y_deg = 0.0
translate_m = [0.0, 0.0, 0.0]
[sun]
toward = [0.4, 1.0, 0.3]
color = [0.8, 0.77, 0.7]
shadows = false
angular_diameter_deg = 0.0
[sky]
ambient = [0.25, 0.28, 0.33]
horizon = [0.75, 0.82, 0.9]
zenith = [0.25, 0.45, 0.8]
[render]
width = 16
samples = 2
exposure_ev = 0.0
falloff = false
diffraction = false
seed = 0
";

/// The line with `key` replaced; its number, and the scene.
fn with(line: usize, value: &str) -> String {
    let lines = EVERY_KEY.lines().enumerate().map(|(at, text)| match text.split_once(" = ") {
        Some((key, _)) if at == line => format!("{key} = {value}\n"),
        _ => format!("{text}\n"),
    });
    lines.collect()
}

#[test]
fn every_key_refuses_what_it_cannot_be_and_names_itself() {
    let (_keep, folder) = folder(EVERY_KEY);
    run(&folder, &["check", "scene.toml"]).expect(0, &[]);
    let mut count = 0;
    for (line, text) in EVERY_KEY.lines().enumerate() {
        let Some((key, old)) = text.split_once(" = ") else { continue };
        let mut values = vec!["{ x = 1 }", "[[]]", "1979-05-27", "99999999999999999999"];
        if old.starts_with('[') {
            values.extend([
                "[nan, 1.0, 1.0]",
                "[1.0, inf, 1.0]",
                "[]",
                "[1.0]",
                "[true, 1, 1]",
                "nan",
                "\"\"",
            ]);
            values.push(if key == "film_mm" { "[-1.0, 1.0]" } else { "[1.0, 1.0, 1.0, 1.0]" });
        } else {
            values.extend(["[1]", "nan", "-nan", "inf", "-inf"]);
            values.push(if old.starts_with('"') { "1" } else { "\"1\"" });
        }
        if ["eye_m", "color", "ambient"].contains(&key) {
            values.push("[1e300, 1.0, 1.0]");
        }
        if ["toward", "up"].contains(&key) {
            values.push("[0.0, 0.0, 0.0]");
        }
        if ["focal_length_mm", "f_number", "extension_mm", "near_m", "scale", "width", "samples"]
            .contains(&key)
        {
            values.extend(["0", "-1", "-0.0", "1e300"]);
        }
        for value in values {
            fs::write(folder.join("scene.toml"), with(line, value)).unwrap();
            let answer = run(&folder, &["check", "scene.toml", "--json"]);
            let place = format!("scene.toml:{}:", line + 1);
            assert_eq!(answer.code, 2, "{key} = {value}: {}", answer.err);
            assert!(
                answer.err.contains(&place) && answer.err.contains(key),
                "{key} = {value}: {}",
                answer.err
            );
            assert!(answer.out.is_empty() && answer.err.lines().count() > 1, "{}", answer.err);
            count += 1;
        }
    }
    println!("{count} wrong values");
}

#[test]
fn what_a_camera_cannot_be_is_2_with_its_key() {
    let (_keep, folder) = folder("");
    for (old, new, words) in [
        ("up = ", "up = [0.0, 0.0, 1.0]", ["camera.up", "parallel"]),
        ("look_at_m = ", "look_at_m = [0.0, 1.6, 10.0]", ["camera.look_at_m", "its own place"]),
        ("film_mm = ", "film = \"4x6\"", ["camera.film", "4x5"]),
        ("f_number = ", "f_number = 5.6\npinhole = true", ["camera.pinhole", "exclude"]),
        ("film_mm = ", "film_mm = [1.0, 1.0]\nfilm = \"4x5\"", ["camera.film", "exclude"]),
        ("plane = ", "distance_m = 0.15", ["focus.distance_m", "no real image"]),
        ("plane = ", "distance_m = 1e-320", ["focus.distance_m", "no real image"]),
        ("plane = ", "distance_m = -1e300", ["focus.distance_m", "not -1e300"]),
        ("plane = ", "points_m = [[0,0,0],[1,0,0],[2,0,0]]", ["focus.points_m", "one line"]),
        (
            "plane = ",
            "distance_m = 8\npoints_m = [[0,0,0],[1,0,0],[0,0,1]]",
            ["focus.points_m", "two targets"],
        ),
        ("path = ", "path = \"/t.obj\"", ["mesh[0].path", "absolute"]),
        ("path = ", "path = \"C:\\\\t.obj\"", ["mesh[0].path", "absolute"]),
        ("path = ", "path = \"\\\\\\\\host\\\\t.obj\"", ["mesh[0].path", "absolute"]),
        ("path = ", "path = \"https://a/t.obj\"", ["mesh[0].path", "URL"]),
        ("path = ", "path = \"..\"", ["mesh[0].path", "folder"]),
        ("path = ", "path = \"scene.toml\"", ["scene.toml", "no face"]),
        ("scale = ", "scale = 1e12\ntranslat_m = [0, 0, 0]", ["mesh[0].translat_m", "`translate_m`"]),
        ("samples = ", "samples = 2\nmax_error = 0.1", ["render.max_error", "exclude"]),
        ("diffraction = ", "diffraction = 1", ["render.diffraction", "true or false"]),
    ] {
        let text: String = EVERY_KEY
            .lines()
            .map(|line| if line.starts_with(old) { format!("{new}\n") } else { format!("{line}\n") })
            .collect();
        fs::write(folder.join("scene.toml"), text).unwrap();
        let answer = run(&folder, &["check", "scene.toml", "--json"]);
        assert_eq!(answer.code, 2, "{new}: {}", answer.err);
        for word in words {
            assert!(answer.err.contains(word), "{new}: `{word}` is not in {}", answer.err);
        }
    }
}

#[test]
fn keys_take_the_budgets_that_flags_take() {
    let (_keep, folder) = folder("");
    for (key, flag, value) in [
        ("max_error", "--max-error", "1e-30"),
        ("max_error", "--max-error", "5.0"),
        ("time_budget_s", "--time-budget", "1e-9"),
        ("time_budget_s", "--time-budget", "0.0"),
    ] {
        let scene = format!("{CAMERA}{SMALL}");
        fs::write(folder.join("flag.toml"), &scene).unwrap();
        let key = format!("{key} = {value}\nwidth = 8");
        let text: String = scene
            .lines()
            .map(|line| match line.split(' ').next() {
                Some("samples") => format!("{key}\n"),
                Some("width") => String::new(),
                _ => format!("{line}\n"),
            })
            .collect();
        fs::write(folder.join("key.toml"), text).unwrap();
        let by_key = run(&folder, &["render", "key.toml", "-o", "k.png"]);
        let by_flag = run(&folder, &["render", "flag.toml", "--width", "8", flag, value, "-o", "f.png"]);
        assert_eq!(by_key.code == 0, by_flag.code == 0, "{value}: {}{}", by_key.err, by_flag.err);
        assert_eq!(by_key.code == 0, value != "0.0", "{value}: {}", by_key.err);
    }
}

/// Renders `scene` to EXR; the picture's least and greatest value.
fn rendered(folder: &Path, name: &str, scene: &str) -> (f32, f32) {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let answer = run(folder, &["render", "scene.toml", "-o", "o.exr"]);
    assert_eq!(answer.code, 0, "{name}: {}", answer.err);
    assert!(answer.took.as_secs() < 5, "{name}: {:?}", answer.took);
    let image = exr::prelude::read_first_flat_layer_from_file(folder.join("o.exr")).unwrap();
    let mut range = (f32::INFINITY, f32::NEG_INFINITY);
    for channel in &image.layer_data.channel_data.list {
        for value in channel.sample_data.values_as_f32() {
            assert!(value.is_finite(), "{name} has {value}");
            range = (range.0.min(value), range.1.max(value));
        }
    }
    range
}

#[test]
fn extreme_cameras_and_meshes_give_finite_pictures() {
    let (_keep, folder) = folder("");
    let camera = |from: &str, to: &str| {
        let mut text = String::new();
        for line in CAMERA.lines() {
            text.push_str(if line.starts_with(from) { to } else { line });
            text.push('\n');
        }
        format!("{text}{SMALL}")
    };
    for (from, to) in [
        ("f_number", "f_number = 0.1"),
        ("f_number", "f_number = 1e-6"),
        ("f_number", "f_number = 1e9"),
        ("f_number", "pinhole = true"),
        ("focal_length_mm", "focal_length_mm = 1e-3"),
        ("focal_length_mm", "focal_length_mm = 1e6"),
        ("film", "film_mm = [1e9, 1e9]"),
        ("film", "film_mm = [1e-6, 1e-6]"),
        ("film", "film_mm = [1e9, 1e-6]"),
        ("film", "film_mm = [1.0, 1000.0]"),
        ("extension_mm", "extension_mm = 1e9"),
        ("extension_mm", "extension_mm = 1e-9"),
        ("extension_mm", "extension_mm = 152.3\nnear_m = 1e9"),
        ("extension_mm", "extension_mm = 152.3\nnear_m = 1e-12"),
        ("look_at_m", "look_at_m = [0.0, 1.6, 9.999999999999998]"),
        ("look_at_m", "look_at_m = [0.0, 1.6, -1e12]"),
        ("extension_mm", "extension_mm = 152.3\n[camera.front]\ntilt_deg = 89.9999999"),
    ] {
        rendered(&folder, to, &camera(from, to));
    }
    for more in ["scale = 1e-12", "scale = 1e12", "translate_m = [1e12, -1e12, 1e12]", "rotate_y_deg = 360"] {
        rendered(&folder, more, &format!("{CAMERA}{SMALL}{more}\n"));
    }
    let lights = "[sun]\ntoward = [0, 1, 1]\ncolor = [1e9, 1e9, 1e9]\n[sky]\nambient = [1e9, 1e9, 1e9]\n";
    let lit =
        format!("{CAMERA}{SMALL}{lights}").replace("samples", "falloff = true\nexposure_ev = 100\nsamples");
    for (name, obj, mtl) in [
        ("a point", "v 0 1 0\nf 1 1 1\n", ""),
        ("at the eye", "v 0 1.6 10\nv 1 1.6 10\nv 0 2 10\nf 1 2 3\n", ""),
        ("through the eye", "v -5 1.6 20\nv 5 1.6 20\nv 0 1.6 -20\nf 1 2 3\n", ""),
        ("huge", "v -1e30 -1e30 -1\nv 1e30 0 -1\nv 0 1e30 -1\nf 1 2 3\n", ""),
        ("denormal", "v 0 0 0\nv 5e-324 0 0\nv 0 5e-324 0\nf 1 2 3\n", ""),
        ("needle", "v -1e6 1.6 0\nv 1e6 1.6 0\nv 0 1.6000001 0\nf 1 2 3\n", ""),
        ("long normals", "v -1 0 0\nv 1 0 0\nv 0 3 0\nvn 3e38 3e38 3e38\nf 1//1 2//1 3//1\n", ""),
        ("opposite normals", "v -1 0 0\nv 1 0 0\nv 0 3 0\nvn 0 0 1\nvn 0 0 -1\nf 1//1 2//2 3//1\n", ""),
        ("far coordinates", "v -1 0 0\nv 1 0 0\nv 0 3 0\nvt 0 0\nvt 1e30 0\nf 1/1 2/2 3/1\n", "map_Kd k.png"),
        ("bright", program::TRIANGLE, "Kd 1e38 1e38 1e38\nKe 1e38 1e38 1e38"),
        ("no number", program::TRIANGLE, "Kd nan nan nan\nKe inf 0 0\nd nan"),
        ("scaled away", program::TRIANGLE, "map_Kd -s 1e300 nan k.png"),
    ] {
        let brick = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tower/textures/brick.png");
        fs::copy(brick, folder.join("k.png")).unwrap();
        fs::write(folder.join("t.mtl"), format!("newmtl m\n{mtl}\n")).unwrap();
        fs::write(folder.join("t.obj"), format!("mtllib t.mtl\nusemtl m\n{obj}")).unwrap();
        rendered(&folder, name, &lit);
        rendered(&folder, name, &format!("{CAMERA}{SMALL}"));
    }
    fs::write(folder.join("t.obj"), "v -1e300 0 -1\nv 1e300 0 -1\nv 0 1e300 -1\nf 1 2 3\n").unwrap();
    run(&folder, &["render", "scene.toml", "-o", "o.exr"]).expect(2, &["mesh[0]", "1e100"]);
}

#[test]
fn the_widest_picture_shows_its_right_edge() {
    // A wall across the whole view: every pixel shows it, to the last column.
    let (_keep, folder) = folder(&format!(
        "{}[render]\nwidth = 32767\nsamples = 1\n[[mesh]]\npath = \"t.obj\"\n",
        CAMERA.replace("film = \"4x5\"", "film_mm = [1000.0, 0.1]")
    ));
    fs::write(folder.join("t.obj"), "v -900 -900 0\nv 900 -900 0\nv 0 2000 0\nf 1 2 3\n").unwrap();
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let (low, high) = rendered(&folder, "wide", &scene);
    assert!((low - 0.2).abs() < 1e-5 && (high - 0.264).abs() < 1e-5, "{low} {high}");
    fs::write(folder.join("scene.toml"), scene.replace("32767", "32768")).unwrap();
    run(&folder, &["render", "scene.toml", "-o", "o.exr"]).expect(2, &["render.width", "32767"]);
}

#[test]
fn small_pictures_have_at_least_one_pixel() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    for (width, film, size) in [
        (1, "film = \"4x5\"", (1, 1)),
        (3, "film = \"4x5\"", (3, 2)),
        (400, "film_mm = [1e6, 1.0]", (400, 1)),
    ] {
        let text =
            format!("{}[render]\nwidth = {width}\nsamples = 3\n", CAMERA.replace("film = \"4x5\"", film));
        fs::write(folder.join("scene.toml"), text).unwrap();
        run(&folder, &["render", "scene.toml", "-o", "o.png"]).expect(0, &[]);
        let file = std::io::BufReader::new(fs::File::open(folder.join("o.png")).unwrap());
        let reader = png::Decoder::new(file).read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), size);
    }
}
