//! What the program prints and writes has the keys, types and meanings of the contract: JSON of `optics`, `check`
//! and `render --stats`, picture files, and what each verb warns of or refuses.

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, SMALL, folder, run};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;

/// `n`: a number, `s`: a text, `b`: true or false, `?`: this or null, `n4`: an array of 4 numbers; a table lists
/// its keys, and `[..]` is an array of any length of what it holds.
enum Shape {
    Of(&'static str),
    Table(Vec<(&'static str, Shape)>),
    List(Box<Shape>),
}

use Shape::{List, Of, Table};

fn fits(path: &str, value: &Value, shape: &Shape) {
    match shape {
        Of(kind) => {
            let bare = kind.trim_end_matches('?');
            let good = match bare.chars().next() {
                _ if bare != *kind && value.is_null() => true,
                Some('n') if bare.len() > 1 => {
                    let count: usize = bare[1..].parse().unwrap();
                    value
                        .as_array()
                        .is_some_and(|list| list.len() == count && list.iter().all(Value::is_number))
                }
                Some('n') => value.is_number(),
                Some('s') => value.is_string(),
                _ => value.is_boolean(),
            };
            assert!(good, "{path} is {value}, not {kind}");
        }
        Table(entries) => {
            let keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
            let mut wanted: Vec<&str> = entries.iter().map(|(key, _)| *key).collect();
            wanted.sort_unstable();
            let mut sorted = keys;
            sorted.sort_unstable();
            assert_eq!(sorted, wanted, "{path}");
            for (key, inner) in entries {
                fits(&format!("{path}/{key}"), &value[*key], inner);
            }
        }
        List(inner) => {
            let list = value.as_array().unwrap_or_else(|| panic!("{path} is {value}"));
            list.iter().for_each(|value| fits(path, value, inner));
        }
    }
}

fn standard() -> Shape {
    Table(vec![("tilt_deg", Of("n")), ("swing_deg", Of("n")), ("rise_mm", Of("n")), ("shift_mm", Of("n"))])
}

fn optics_shape(samples: bool) -> Shape {
    let axes = |names: [&'static str; 4], more: [&'static str; 2]| {
        let vectors = names.into_iter().map(|name| (name, Of("n3")));
        Table(vectors.chain(more.into_iter().map(|name| (name, Of("n")))).collect())
    };
    let line = || Table(vec![("direction", Of("n3")), ("moment", Of("n3"))]);
    let mut keys = vec![
        ("lens", axes(["center", "axis", "ex", "ey"], ["focal_length", "aperture_diameter"])),
        ("film", axes(["center", "normal", "fx", "fy"], ["width", "height"])),
        ("front", standard()),
        ("rear", standard()),
        ("extension_mm", Of("n")),
        ("focus_plane", Of("n4")),
        ("scheimpflug_line", line()),
        ("hinge_line", line()),
        (
            "dof",
            Table(vec![
                ("circle_of_confusion", Of("n")),
                ("near_plane", Of("n4?")),
                ("far_plane", Of("n4?")),
            ]),
        ),
        ("hinge_distance", Of("n?")),
        ("pinhole_matrix", Of("n16")),
        // Beyond the contract.
        (
            "sensitivity",
            Table(vec![
                ("far_end", Of("n3")),
                ("front_tilt", Of("n")),
                ("front_swing", Of("n")),
                ("rear_tilt", Of("n")),
                ("rear_swing", Of("n")),
                ("extension", Of("n")),
            ]),
        ),
    ];
    if samples {
        let matrix = Table(vec![("u", Of("n")), ("v", Of("n")), ("matrix", Of("n16"))]);
        keys.push(("sample_matrices", List(Box::new(matrix))));
    }
    Table(keys)
}

#[test]
fn optics_prints_the_contracts_json() {
    let (_keep, folder) = folder(&format!("{CAMERA}[camera.front]\ntilt_deg = 6\n"));
    let answer = run(&folder, &["optics", "scene.toml", "--json"]);
    fits("", &answer.expect(0, &[]).json(), &optics_shape(false));
    let answer = run(&folder, &["optics", "scene.toml", "--json", "--samples-at", "0,0;-0.6,0.8;1,0"]);
    let json = answer.expect(0, &[]).json();
    fits("", &json, &optics_shape(true));
    let list = json["sample_matrices"].as_array().unwrap();
    assert_eq!((list.len(), &list[1]["u"], &list[1]["v"]), (3, &(-0.6).into(), &0.8.into()));
    assert_eq!(list[0]["matrix"], json["pinhole_matrix"]);
    // A matrix of contract: the z row is (0, 0, 0, near), and the text reads back to the same numbers.
    assert_eq!(json["pinhole_matrix"].as_array().unwrap()[8..12], [0.0, 0.0, 0.0, 0.015].map(Value::from));
    assert_eq!(json["front"]["tilt_deg"], 6.0);

    let pinhole = CAMERA.replace("f_number = 5.6", "pinhole = true");
    fs::write(folder.join("scene.toml"), pinhole).unwrap();
    let json = run(&folder, &["optics", "scene.toml", "--json"]).expect(0, &[]).json();
    fits("", &json, &optics_shape(false));
    assert_eq!(json["lens"]["aperture_diameter"], 0.0);
    assert!(json["dof"]["near_plane"].is_null() && json["dof"]["far_plane"].is_null());
    assert!(json["hinge_distance"].is_null());
    run(&folder, &["optics", "scene.toml"]).expect(0, &[]);
}

/// Of an untilted lens at extension E the plane at D = f E / (E - f) is sharp, and moves by f^2 / (E - f)^2 times what the film moves along
/// the axis. A film that turns moves by the angle times the offset q of its point; where the lens turns the film does so in its frame, and
/// the plane with the frame, by the angle times q D / E. Steps are 0.01 degrees and 0.01 mm.
#[test]
fn the_sensitivity_is_of_the_movement_that_it_names() {
    let text = CAMERA.replace("film = \"4x5\"", "film_mm = [120.0, 96.0]").replace("152.3", "153");
    let (_keep, folder) = folder(&text);
    let found = &run(&folder, &["optics", "scene.toml", "--json"]).expect(0, &[]).json()["sensitivity"];
    let end: Vec<f64> = found["far_end"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert!(near(end[0].abs(), 3.0) && near((end[1] - 1.6).abs(), 2.4) && near(end[2], 2.35), "{found}");
    let (f, extension, width, height) = (0.15, 0.153, 0.06, 0.048);
    let distance = f * extension / (extension - f);
    let (turn, along) = (f64::to_radians(0.01), (f / (extension - f)) * (f / (extension - f)));
    for (key, expected) in [
        ("rear_tilt", turn * height * along),
        ("rear_swing", turn * width * along),
        ("front_tilt", turn * height * (along + distance / extension)),
        ("front_swing", turn * width * (along + distance / extension)),
        ("extension", distance - f * (extension + 1e-5) / (extension + 1e-5 - f)),
    ] {
        let value = found[key].as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 1e-3, "{key}: {value}, not {expected}");
    }
    let (_keep, folder) = self::folder(&text.replace("153", "150"));
    let found = run(&folder, &["optics", "scene.toml", "--json"]).expect(0, &[]).json();
    assert!(found["sensitivity"].is_null(), "{found}");
}

#[test]
fn check_prints_the_contracts_json() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}scale = 2\ntranslate_m = [1, 0, 0]\n"));
    let obj = format!("mtllib none.mtl\nusemtl a\n{}f 1 2 3 1\n", program::TRIANGLE);
    fs::write(folder.join("t.obj"), obj).unwrap();
    let answer = run(&folder, &["check", "scene.toml", "--json"]);
    let json = answer.expect(0, &[]).json();
    let mesh = Table(vec![
        ("path", Of("s")),
        ("triangles", Of("n")),
        ("materials", Of("n")),
        ("textures", Of("n")),
        ("bounds_m", List(Box::new(Of("n3")))),
    ]);
    let warning = Table(vec![("file", Of("s")), ("line", Of("n?")), ("message", Of("s"))]);
    fits("", &json, &Table(vec![("meshes", List(Box::new(mesh))), ("warnings", List(Box::new(warning)))]));
    let mesh = &json["meshes"][0];
    assert_eq!((mesh["path"].as_str(), mesh["triangles"].as_u64()), (Some("t.obj"), Some(3)));
    assert_eq!(mesh["bounds_m"], serde_json::json!([[-1.0, 0.0, 0.0], [3.0, 6.0, 0.0]]));
    let warnings = json["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|w| w["file"] == "t.obj" && w["line"] == 1), "{json}");
    // Without meshes there is nothing to report, and that is no error.
    fs::write(folder.join("scene.toml"), CAMERA).unwrap();
    let json = run(&folder, &["check", "scene.toml", "--json"]).expect(0, &[]).json();
    assert_eq!(json, serde_json::json!({ "meshes": [], "warnings": [] }));
}

#[test]
fn render_writes_the_contracts_numbers() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    let words =
        ["render", "scene.toml", "-o", "o.png", "--stats", "s.json", "--threads", "2", "--samples", "8"];
    run(&folder, &words).expect(0, &[]);
    let json: Value = serde_json::from_str(&fs::read_to_string(folder.join("s.json")).unwrap()).unwrap();
    let effect = || Table(vec![("effect", Of("s")), ("active", Of("b")), ("because", Of("s"))]);
    let mut shape = vec![
        ("width", Of("n")),
        ("height", Of("n")),
        ("threads", Of("n")),
        ("load_seconds", Of("n")),
        ("render_seconds", Of("n")),
        ("cpu_seconds", Of("n")),
        ("samples_per_pixel", Table(vec![("mean", Of("n")), ("min", Of("n")), ("max", Of("n"))])),
        ("estimated_rms_error", Of("n?")),
        ("effects", List(Box::new(effect()))),
        ("scene_hash", Of("s")),
        ("version", Of("s")),
    ];
    // Beyond the contract: what was counted, and where the time went.
    for key in ["triangles", "surfaces", "bin_entries", "samples", "shading_requests", "unseen_light_blocks"]
    {
        shape.push((key, Of("n")));
    }
    let stages =
        ["plan", "transform", "bin", "prepare", "setup", "coverage", "group", "shading", "resolve", "rounds"];
    shape.push(("stages", Table(stages.map(|stage| (stage, Of("n"))).into())));
    shape.push(("simd", Of("s")));
    shape.push(("allocation", Of("s")));
    let names = || List(Box::new(Of("s")));
    let asked = vec![
        ("samples", Of("n?")),
        ("max_error", Of("n?")),
        ("time_budget", Of("n?")),
        ("all_effects", Of("b")),
        ("with", names()),
        ("without", names()),
    ];
    shape.push(("asked", Table(asked)));
    fits("", &json, &Table(shape));
    assert_eq!((&json["width"], &json["height"], &json["threads"]), (&16.into(), &13.into(), &2.into()));
    let seconds = |value: &Value| value.as_f64().unwrap();
    for key in ["load_seconds", "render_seconds"] {
        assert!(seconds(&json[key]) > 0.0, "{key}");
    }
    // Stages are of all threads, one after the other.
    let all: f64 = json["stages"].as_object().unwrap().values().map(seconds).sum();
    assert!(all > 0.0 && all <= 2.0 * seconds(&json["render_seconds"]), "{all} s of {json}");
    assert_eq!(json["samples_per_pixel"], serde_json::json!({ "mean": 8.0, "min": 8, "max": 8 }));
    assert!(json["estimated_rms_error"].as_f64().unwrap() > 0.0);
    let defocus = json["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "defocus").unwrap();
    // So small a picture shows no blur.
    assert!(defocus["active"] == false && defocus["because"].as_str().unwrap().contains("threshold"));
    assert_eq!(json["scene_hash"].as_str().unwrap().len(), 64);
    run(&folder, &["render", "scene.toml", "-o", "o.png", "--stats", "s.json", "--samples", "1"])
        .expect(0, &[]);
    let one: Value = serde_json::from_str(&fs::read_to_string(folder.join("s.json")).unwrap()).unwrap();
    assert!(one["estimated_rms_error"].is_null());
}

/// All keys of an answer, however deep.
fn keys(value: &Value) -> BTreeSet<String> {
    match value {
        Value::Object(table) => {
            let inner = table.values().flat_map(keys);
            table.keys().cloned().chain(inner).collect()
        }
        Value::Array(list) => list.iter().flat_map(keys).collect(),
        _ => BTreeSet::new(),
    }
}

#[test]
fn docs_tell_every_key_that_is_printed() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    fs::write(folder.join("t.obj"), program::TRIANGLE).unwrap();
    let beyond = ["solve", "scene.toml", "--plane", "0,1.6,9.95;0,1,0.01", "--json"];
    let asked: [(&str, &[&str], i32); 6] = [
        ("render --stats FILE", &["render", "scene.toml", "-o", "o.png", "--stats", "s.json"], 0),
        ("optics --json", &["optics", "scene.toml", "--json", "--samples-at", "0,0"], 0),
        ("solve --json", &["solve", "scene.toml", "--plane", "0,0,0;0,1,0", "--json"], 0),
        ("solve --json", &beyond, 2),
        ("check --json", &["check", "scene.toml", "--json"], 0),
        ("explain --json", &["explain", "scene.toml", "--json"], 0),
    ];
    let docs = include_str!("../docs/formats.md");
    for (heading, words, code) in asked {
        let answer = run(&folder, words);
        answer.expect(code, &[]);
        let written = fs::read(folder.join("s.json")).ok().filter(|_| words[0] == "render");
        let json = written.map_or_else(|| answer.json(), |text| serde_json::from_slice(&text).unwrap());
        let section = |heading: &str| {
            let (_, section) = docs.split_once(&format!("## `{heading}`")).unwrap();
            section.split("\n## ").next().unwrap().to_owned()
        };
        // What is said of cameras is said once.
        let above = if words[0] == "solve" { section("optics --json") } else { String::new() };
        let section = section(heading) + &above;
        for key in keys(&json) {
            assert!(section.contains(&format!("`{key}`")), "{heading}: {key} in {section}");
        }
    }
}

fn scene_hash(folder: &std::path::Path, scene: &str) -> String {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    run(folder, &["render", "scene.toml", "-o", "o.png", "--stats", "s.json"]).expect(0, &[]);
    let json: Value = serde_json::from_str(&fs::read_to_string(folder.join("s.json")).unwrap()).unwrap();
    json["scene_hash"].as_str().unwrap().to_owned()
}

#[test]
fn the_hash_is_of_the_scene_not_of_its_names() {
    let (_keep, folder) = folder("");
    let scene = format!("{CAMERA}{SMALL}");
    let first = scene_hash(&folder, &scene);
    let mut hashes = BTreeSet::from([first.clone()]);
    fs::create_dir(folder.join("moved")).unwrap();
    fs::copy(folder.join("t.obj"), folder.join("moved/u.obj")).unwrap();
    assert_eq!(scene_hash(&folder, &format!("# a comment\n{scene}")), first);
    assert_eq!(scene_hash(&folder, &scene.replace("t.obj", "moved/u.obj")), first);
    for (old, new) in [
        ("tilt", "tilt"),
        ("152.3", "152.4"),
        ("samples = 2", "samples = 2\nseed = 1"),
        ("\"t.obj\"", "\"t.obj\"\nrotate_y_deg = 180"),
        ("\"t.obj\"", "\"t.obj\"\ntranslate_m = [0, 0, 1e-9]"),
        ("\"t.obj\"", "\"t.obj\"\nscale = 2"),
        ("[[mesh]]", "[sky]\nambient = [0, 0, 0]\n[[mesh]]"),
        ("[[mesh]]", "[sun]\ntoward = [0, 1, 0.5]\ncolor = [1, 1, 1]\n[[mesh]]"),
        ("[[mesh]]", "[sun]\ntoward = [0, 1, 0.25]\ncolor = [1, 1, 1]\n[[mesh]]"),
        ("[[mesh]]", "[sun]\ntoward = [0, 1, 0.25]\ncolor = [1, 1, 1]\nshadows = true\n[[mesh]]"),
        ("[[mesh]]", "[sun]\ntoward = [0, 1, 0.25]\ncolor = [1, 1, 0.5]\n[[mesh]]"),
        ("[[mesh]]", "[camera.aperture]\nblades = 5\n[[mesh]]"),
        ("[[mesh]]", "[camera.aperture]\nblades = 6\n[[mesh]]"),
        ("[[mesh]]", "[camera.aperture]\nblades = 6\nrotation_deg = 7\n[[mesh]]"),
        ("[[mesh]]", "[focus]\ncircle_of_confusion_mm = 0.2\n[[mesh]]"),
        ("152.3", "152.3\nup = [1, 1, 0]"),
    ] {
        let other = scene_hash(&folder, &scene.replace(old, new));
        assert_eq!(hashes.insert(other), old != new, "{new}");
    }
    fs::write(folder.join("t.obj"), format!("{}# changed\n", program::TRIANGLE)).unwrap();
    assert_ne!(scene_hash(&folder, &scene), first, "the bytes of an asset count");
}

#[test]
fn pictures_are_8_bit_srgb_png_and_float_zip_exr_with_notes() {
    let (_keep, folder) =
        folder(&format!("{CAMERA}{SMALL}").replace("width = 16", "width = 50\nexposure_ev = 1"));
    run(&folder, &["render", "scene.toml", "-o", "o.png"]).expect(0, &[]);
    run(&folder, &["render", "scene.toml", "-o", "o.exr", "--stats", "s.json"]).expect(0, &[]);
    let stats: Value = serde_json::from_str(&fs::read_to_string(folder.join("s.json")).unwrap()).unwrap();

    let file = std::io::BufReader::new(fs::File::open(folder.join("o.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let info = reader.info();
    assert_eq!((info.width, info.height), (50, 40));
    assert_eq!((info.bit_depth, info.color_type), (png::BitDepth::Eight, png::ColorType::Rgb));
    assert!(info.srgb.is_some(), "it says that it is sRGB");
    let notes: Vec<(String, String)> =
        info.utf8_text.iter().map(|note| (note.keyword.clone(), note.get_text().unwrap())).collect();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut codes).unwrap();

    let image = exr::prelude::read_first_flat_layer_from_file(folder.join("o.exr")).unwrap();
    let layer = &image.layer_data;
    assert_eq!(layer.size, exr::math::Vec2(50, 40));
    assert_eq!(layer.encoding.compression, exr::prelude::Compression::ZIP16);
    assert_eq!(layer.encoding.blocks, exr::prelude::Blocks::ScanLines);
    let channels = &layer.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["B", "G", "R"], "stored in the order of their names");
    let values: Vec<Vec<f32>> = channels.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    for channel in channels {
        assert!(matches!(channel.sample_data, exr::prelude::FlatSamples::F32(_)));
    }
    // The PNG is the EXR, brightened by the exposure and encoded.
    for (at, code) in codes.chunks_exact(3).enumerate() {
        for (i, code) in code.iter().enumerate() {
            let linear = (2.0 * f64::from(values[2 - i][at])).clamp(0.0, 1.0);
            let srgb = if linear <= 0.003_130_8 {
                12.92 * linear
            } else {
                1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
            };
            assert!((255.0 * srgb - f64::from(*code)).abs() <= 0.501, "{at}: {srgb} {code}");
        }
    }
    let comments = layer.attributes.comments.as_ref().unwrap().to_string();
    let noted = |key: &str| -> String {
        let found = comments.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(": "));
        found.unwrap_or_else(|| panic!("{key} is not in {comments}")).to_owned()
    };
    let png = |key: &str| &notes.iter().find(|(name, _)| name == key).unwrap_or_else(|| panic!("{key}")).1;
    let keys = ["scene_hash", "camera", "samples", "effects", "estimated_rms_error"];
    for key in keys.map(|key| format!("groundglass.{key}")) {
        assert_eq!(&noted(&key), png(&key));
    }
    let error = stats["estimated_rms_error"].as_f64().unwrap();
    assert_eq!(noted("groundglass.estimated_rms_error"), format!("{error:.6}"));
    assert_eq!(noted("groundglass.effects"), "as the scene asks; left out as too small to be seen: defocus");
    assert_eq!(noted("groundglass.scene_hash"), stats["scene_hash"].as_str().unwrap());
    assert_eq!(noted("groundglass.samples"), "2");
    assert!(noted("groundglass.camera").contains("extension 152.3 mm"));
}

#[test]
fn diffraction_is_drawn_and_refused_with_a_pinhole() {
    let (old, new) = ("samples = 2", "diffraction = true\nsamples = 2");
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}").replace(old, new));
    let words = ["render", "scene.toml", "-o", "o.png", "--all-effects", "--stats", "s.json"];
    run(&folder, &words).expect(0, &[]);
    let stats = fs::read_to_string(folder.join("s.json")).unwrap();
    let entry = stats.split("\"diffraction\"").nth(1).unwrap().split('}').next().unwrap();
    assert!(entry.contains("true") && entry.contains("--all-effects keeps it"), "{entry}");
    // So small an aperture that light is bent through a right angle, and a film that leans.
    let tiny =
        format!("{CAMERA}[camera.rear]\ntilt_deg = 30\n{SMALL}").replace("5.6", "1e7").replace(old, new);
    fs::write(folder.join("scene.toml"), tiny).unwrap();
    run(&folder, &["render", "scene.toml", "-o", "p.png", "--all-effects"])
        .expect(2, &["render.diffraction", "larger aperture"]);
    assert!(!folder.join("p.png").exists());
    let both = CAMERA.replace("f_number = 5.6", "pinhole = true") + "[render]\ndiffraction = true\n";
    let (_other, folder) = program::folder(&both);
    for verb in ["optics", "check", "render"] {
        run(&folder, &[verb, "scene.toml"]).expect(2, &["scene.toml:9:15", "render.diffraction", "pinhole"]);
    }
}

#[test]
fn a_film_that_reaches_the_aperture_is_warned_of_and_not_rendered() {
    let scene = format!("{CAMERA}[camera.rear]\ntilt_deg = 85\n{SMALL}");
    let (_keep, folder) = folder(&scene);
    for words in [
        &["optics", "scene.toml", "--json"][..],
        &["optics", "scene.toml"],
        &["check", "scene.toml", "--json"],
        &["solve", "scene.toml", "--distance", "8", "--json"],
    ] {
        let answer = run(&folder, words);
        answer.expect(0, &["warning: scene.toml", "reaches the aperture"]);
        assert!(!answer.out.contains("warning: "), "warnings go to standard error");
    }
    let checked = run(&folder, &["check", "scene.toml"]);
    checked.expect(0, &["reaches the aperture"]);
    // All that was told is counted.
    let told = checked.err.lines().filter(|line| line.starts_with("warning: ")).count();
    let words = if told == 1 { "warning" } else { "warnings" };
    assert!(told > 0 && checked.out.ends_with(&format!("\n{told} {words}\n")), "{told}: {}", checked.out);
    run(&folder, &["render", "scene.toml", "-o", "o.png"]).expect(2, &["scene.toml", "reaches the aperture"]);
    assert!(!folder.join("o.png").exists());
}

#[test]
fn subjects_and_focus_behind_the_lens_are_warned_of() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}translate_m = [0, 0, 30]\n"));
    for verb in ["check", "render"] {
        run(&folder, &[verb, "scene.toml"]).expect(0, &["warning: scene.toml", "behind the lens"]);
    }
    fs::write(folder.join("scene.toml"), CAMERA.replace("152.3", "140.0")).unwrap();
    run(&folder, &["optics", "scene.toml"]).expect(0, &["focus plane", "behind the lens"]);
}

#[test]
fn files_outside_the_root_are_refused_by_name() {
    let (_keep, folder) = folder("");
    fs::create_dir(folder.join("in")).unwrap();
    fs::write(folder.join("in/s.toml"), format!("{CAMERA}[[mesh]]\npath = \"../t.obj\"\n")).unwrap();
    run(&folder, &["check", "in/s.toml"]).expect(0, &[]);
    run(&folder, &["check", "in/s.toml", "--root", "."]).expect(0, &[]);
    run(&folder, &["check", "in/s.toml", "--root", "in"])
        .expect(2, &["../t.obj", "outside the root", "in/s.toml:9"]);
    run(&folder, &["optics", "in/s.toml", "--root", "in"]).expect(0, &[]);
    run(&folder, &["new", "t.obj", "--root", "in"]).expect(2, &["t.obj", "outside the root"]);
    run(&folder, &["check", "in/s.toml", "--root", "none"]).expect(2, &["--root", "none"]);
    run(&folder, &["check", "in/s.toml", "--root", "t.obj"]).expect(2, &["--root", "t.obj"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../../t.obj", folder.join("in/link.obj")).unwrap();
        fs::write(folder.join("in/s.toml"), format!("{CAMERA}[[mesh]]\npath = \"link.obj\"\n")).unwrap();
        fs::rename(folder.join("in"), folder.join("a")).unwrap();
        fs::create_dir(folder.join("in")).unwrap();
        fs::rename(folder.join("a"), folder.join("in/a")).unwrap();
        run(&folder, &["check", "in/a/s.toml"]).expect(0, &[]);
        run(&folder, &["check", "in/a/s.toml", "--root", "in"]).expect(2, &["link.obj", "outside the root"]);
    }
}
