//! The scene file as a whole: the contract's example, its defaults, and each error's line, key and remedy.

use super::*;
use crate::camera::Aperture;
use crate::error::{Error, ErrorKind};
use crate::optics::{Adjust, FocusTarget};
use crate::quantity::{Angle, Length};
use glam::DVec3;
use std::path::Path;

const CAMERA: &str = "[camera]
eye_m = [0.0, 1.6, 10.0]
look_at_m = [0.0, 1.6, 0.0]
focal_length_mm = 150.0
f_number = 5.6
film_mm = [120.0, 96.0]
extension_mm = 152.3
";

fn describe(text: &str) -> crate::error::Result<SceneDescription> {
    parse(text, "s.toml")?.describe()
}

fn error(text: &str) -> Error {
    match describe(text) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(error) => error,
    }
}

#[test]
fn the_least_scene_has_the_contracts_defaults() {
    let scene = describe(CAMERA).unwrap();
    assert_eq!(scene.camera.near, Length::metres(0.015));
    assert_eq!(scene.camera.extension, Length::millimetres(152.3));
    assert_eq!(scene.up, DVec3::Y);
    assert_eq!(scene.picture_size(None).unwrap(), (960, 768));
    let render = scene.render;
    assert_eq!((render.width, render.budget, render.seed), (960, Budget::Samples(256), 0));
    assert_eq!((render.exposure_ev, render.falloff, render.diffraction), (0.0, false, false));
    assert_eq!(scene.sky.ambient, DVec3::new(0.25, 0.28, 0.33));
    assert_eq!(scene.sky.zenith, DVec3::new(0.25, 0.45, 0.8));
    assert!(
        scene.sun.is_none() && scene.meshes.is_empty() && scene.focus.is_none() && scene.blades.is_none()
    );
    let diagonal = libm::hypot(120.0, 96.0) / 1500.0;
    assert!((scene.circle_of_confusion.as_millimetres() - diagonal).abs() < 1e-12);
}

#[test]
fn the_contracts_example_is_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/design/conventions.md");
    let Ok(contract) = std::fs::read_to_string(path) else {
        println!("skipped: ../shared is missing");
        return;
    };
    let text = contract.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let scene = describe(text).unwrap();
    let camera = scene.camera;
    assert_eq!(camera.front.tilt, Angle::degrees(6.0));
    assert_eq!(camera.aperture_diameter(), 0.15 / 5.6);
    assert_eq!(scene.blades, Some(Blades { count: 7, rotation: Angle::degrees(10.0) }));
    let focus = scene.focus.unwrap();
    assert_eq!((focus.target, focus.adjust), (FocusTarget::Distance(8.0), Adjust::Front));
    assert_eq!(scene.circle_of_confusion, Length::millimetres(0.1));
    assert_eq!(scene.meshes[0].path, "tower.obj");
    let sun = scene.sun.unwrap();
    assert!((sun.toward.length() - 1.0).abs() < 1e-15 && !sun.shadows);

    // The same keys as the schema's: each table of the example holds every key, commented ones included.
    let mut known: Vec<String> = Vec::new();
    let mut table = String::new();
    for line in text.lines() {
        let line = line.strip_prefix("# ").unwrap_or(line);
        if let Some(name) = line.strip_prefix('[') {
            table = name.trim_start_matches('[').split(']').next().unwrap().to_string();
        } else if let Some((key, rest)) = line.split_once(" = ") {
            known.push(format!("{table}.{key}"));
            for word in ["pinhole", "film"] {
                if rest.contains(&format!("or: {word} = ")) || rest.contains(&format!("or {word} = ")) {
                    known.push(format!("{table}.{word}"));
                }
            }
        }
    }
    known.extend(["focus.plane.point_m".to_string(), "focus.plane.normal".to_string()]);
    known.sort();
    let mut ours = Vec::new();
    leaves("", super::schema::value(), &mut ours);
    ours.push("focus.plane".into());
    ours.sort();
    assert_eq!(ours, known);
}

fn leaves(path: &str, schema: &serde_json::Value, into: &mut Vec<String>) {
    let schema = if schema["items"]["properties"].is_object() { &schema["items"] } else { schema };
    match schema["properties"].as_object() {
        None => into.push(path.to_string()),
        Some(keys) => keys.iter().for_each(|(key, value)| {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            leaves(&path, value, into);
        }),
    }
}

#[test]
fn the_reference_cameras_and_scenes_are_read() {
    let text = include_str!("../../tests/data/optics.json");
    let json: serde_json::Value = serde_json::from_str(text).unwrap();
    for case in json["cases"].as_array().unwrap() {
        let scene = describe(case["scene_toml"].as_str().unwrap())
            .unwrap_or_else(|e| panic!("{}: {e}", case["name"]));
        let solved = scene.solve();
        assert_eq!(solved.is_err(), case["expect_error"].is_string(), "{}", case["name"]);
        if let Err(error) = solved {
            assert_eq!(error.kind(), ErrorKind::NoSolution);
            assert!(error.place().key.as_deref().unwrap().starts_with("focus."), "{error}");
            assert_eq!(
                (error.place().file.as_deref(), error.place().line),
                (Some("s.toml"), Some(10)),
                "{error}"
            );
        }
        if let Some(size) = case["size_px"].as_array() {
            let (width, height) = scene.picture_size(None).unwrap();
            assert_eq!(
                [u64::from(width), u64::from(height)],
                [size[0].as_u64().unwrap(), size[1].as_u64().unwrap()]
            );
            assert_eq!(Some(scene.camera.near.as_metres()), case["near_m"].as_f64());
        }
    }
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    if !shared.exists() {
        println!("skipped: the scenes, for ../shared is missing");
        return;
    }
    for folder in ["bench/scenes", "reference/pictures", "reference/effects"] {
        for entry in std::fs::read_dir(shared.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "toml") {
                describe(&std::fs::read_to_string(&path).unwrap())
                    .unwrap_or_else(|e| panic!("{path:?}: {e}"));
            }
        }
    }
}

/// Text appended to (or put for a line of) the camera, the line, the key, and words of the message.
#[test]
fn every_wrong_value_names_line_key_and_remedy() {
    let cases: &[(&str, &str, usize, &str, &[&str])] = &[
        // Unknown keys and tables.
        ("", "[camera.front]\ntillt_deg = 6", 9, "camera.front.tillt_deg", &["unknown key", "`tilt_deg`"]),
        ("", "near = 1", 8, "camera.near", &["unknown key", "did you mean `near_m`?"]),
        ("", "width = 1", 8, "camera.width", &["unknown key", "belongs to [render]"]),
        ("", "[cammera]", 8, "cammera", &["unknown key", "`camera`"]),
        ("", "[[mesh]]\npath = \"a.obj\"\n[[mesh]]\nptah = \"b.obj\"", 11, "mesh[1].ptah", &["`path`"]),
        ("focal_length_mm", "focal_lenght_mm = 150", 4, "camera.focal_lenght_mm", &["`focal_length_mm`"]),
        // Missing keys.
        ("eye_m", "", 1, "camera.eye_m", &["[camera] lacks", "`eye_m = [0.0, 1.6, 10.0]`"]),
        ("f_number", "", 1, "camera.f_number", &["`pinhole`", "f_number = 5.6"]),
        ("film_mm", "", 1, "camera.film_mm", &["`film`", "film = \"4x5\""]),
        ("extension_mm", "", 1, "camera.extension_mm", &["[focus]", "extension_mm = 152.3"]),
        ("", "[sun]\ncolor = [1, 1, 1]", 8, "sun.toward", &["[sun] lacks", "toward = "]),
        ("", "[[mesh]]\nscale = 2", 8, "mesh[0].path", &["[[mesh]] lacks", "path = "]),
        ("", "[focus]\nplane = { point_m = [0,0,0] }", 9, "focus.plane.normal", &["lacks", "normal = "]),
        // Wrong types.
        ("eye_m", "eye_m = [0, 1]", 2, "camera.eye_m", &["expected 3 numbers, found 2"]),
        (
            "eye_m",
            "eye_m = [0, 1, \"x\"]",
            2,
            "camera.eye_m[2]",
            &["expected a number, found a text", "eye_m = ["],
        ),
        ("f_number", "f_number = \"5.6\"", 5, "camera.f_number", &["expected a number, found a text", "5.6"]),
        ("", "[render]\nwidth = 96.5", 9, "render.width", &["expected a whole number"]),
        ("", "[render]\nfalloff = 1", 9, "render.falloff", &["true or false"]),
        ("", "[mesh]\npath = \"a.obj\"", 8, "mesh", &["expected an array of tables", "[[mesh]]"]),
        ("", "focus = 3", 8, "camera.focus", &["unknown key"]),
        // Numbers out of range.
        ("eye_m", "eye_m = [0, nan, 1]", 2, "camera.eye_m[1]", &["finite"]),
        ("eye_m", "eye_m = [0, inf, 1]", 2, "camera.eye_m[1]", &["finite"]),
        ("eye_m", "eye_m = [0, 1e300, 1]", 2, "camera.eye_m[1]", &["at most"]),
        ("focal_length_mm", "focal_length_mm = 0", 4, "camera.focal_length_mm", &["must be positive, not 0"]),
        ("focal_length_mm", "focal_length_mm = -5.5", 4, "camera.focal_length_mm", &["positive, not -5.5"]),
        ("focal_length_mm", "focal_length_mm = 1e-30", 4, "camera.focal_length_mm", &["at least 1e-6"]),
        ("f_number", "f_number = nan", 5, "camera.f_number", &["finite"]),
        ("film_mm", "film_mm = [120, 0]", 6, "camera.film_mm[1]", &["positive"]),
        ("extension_mm", "extension_mm = 0", 7, "camera.extension_mm", &["positive"]),
        ("", "near_m = -1", 8, "camera.near_m", &["positive"]),
        ("", "[camera.front]\ntilt_deg = nan", 9, "camera.front.tilt_deg", &["finite"]),
        ("", "[camera.front]\ntilt_deg = 90", 9, "camera.front.tilt_deg", &["lens faces backwards"]),
        ("", "[camera.rear]\nswing_deg = -120", 9, "camera.rear.swing_deg", &["film faces backwards"]),
        ("", "[camera.aperture]\nblades = 2", 9, "camera.aperture.blades", &["at least 3"]),
        ("", "[focus]\ndistance_m = nan", 9, "focus.distance_m", &["finite"]),
        ("", "[focus]\ndistance_m = 0", 9, "focus.distance_m", &["greater than 0"]),
        ("", "[focus]\ndistance_m = -inf", 9, "focus.distance_m", &["greater than 0"]),
        ("", "[focus]\ncircle_of_confusion_mm = 0", 9, "focus.circle_of_confusion_mm", &["positive"]),
        ("", "[[mesh]]\npath = \"a.obj\"\nscale = 0", 10, "mesh[0].scale", &["positive"]),
        ("", "[render]\nwidth = 0", 9, "render.width", &["at least 1"]),
        ("", "[render]\nwidth = 99999999999999", 9, "render.width", &["at most 32767"]),
        ("", "[render]\nsamples = 0", 9, "render.samples", &["at least 1"]),
        ("", "[render]\nmax_error = 0", 9, "render.max_error", &["greater than 0"]),
        ("", "[render]\nmax_error = nan", 9, "render.max_error", &["finite"]),
        ("", "[render]\ntime_budget_s = -1", 9, "render.time_budget_s", &["greater than 0"]),
        ("", "[render]\nseed = -1", 9, "render.seed", &["at least 0"]),
        ("", "[render]\nexposure_ev = inf", 9, "render.exposure_ev", &["finite"]),
        ("", "[sky]\nzenith = [0, -1, 0]", 9, "sky.zenith[1]", &["at least 0"]),
        // Directions.
        (
            "look_at_m",
            "look_at_m = [0.0, 1.6, 10.0]",
            3,
            "camera.look_at_m",
            &["its own place", "another point"],
        ),
        ("", "up = [0, 0, 0]", 8, "camera.up", &["zero"]),
        ("", "up = [0, 0, 2]", 8, "camera.up", &["parallel"]),
        ("", "[sun]\ntoward = [0, 0, 0]\ncolor = [1, 1, 1]", 9, "sun.toward", &["zero", "toward = "]),
        ("", "[focus]\nplane = { point_m = [0,0,0], normal = [0,0,0] }", 9, "focus.plane.normal", &["zero"]),
        // Keys that exclude each other.
        ("", "film = \"4x5\"", 8, "camera.film", &["`film_mm` and `film`", "remove one"]),
        ("", "pinhole = true", 8, "camera.pinhole", &["`f_number` and `pinhole`"]),
        (
            "",
            "[focus]\ndistance_m = 3\npoints_m = [[0,0,0],[1,0,0],[0,1,0]]",
            10,
            "focus.points_m",
            &["`distance_m`"],
        ),
        ("", "[focus]\nadjust = \"rear\"", 9, "focus.adjust", &["target"]),
        ("", "[render]\nsamples = 4\nmax_error = 0.1", 10, "render.max_error", &["`samples`", "keep one"]),
        ("", "[render]\nmax_error = 0.1\ntime_budget_s = 1", 10, "render.time_budget_s", &["`max_error`"]),
        // Words.
        ("film_mm", "film = \"4x6\"", 6, "camera.film", &["did you mean \"4x5\"?", "8x10"]),
        ("film_mm", "film = \"5x4\"", 6, "camera.film", &["did you mean \"4x5\"?"]),
        ("film_mm", "film = \"10x8\"", 6, "camera.film", &["did you mean \"8x10\"?"]),
        ("", "[focus]\ndistance_m = 3\nadjust = \"fornt\"", 10, "focus.adjust", &["did you mean \"front\"?"]),
        // Paths.
        ("", "[[mesh]]\npath = \"\"", 9, "mesh[0].path", &["empty"]),
        ("", "[[mesh]]\npath = \"/etc/passwd\"", 9, "mesh[0].path", &["absolute"]),
        ("", "[[mesh]]\npath = \"C:\\\\x.obj\"", 9, "mesh[0].path", &["absolute"]),
        (
            "f_number",
            "pinhole = true\n[render]\ndiffraction = true",
            7,
            "render.diffraction",
            &["pinhole", "f_number"],
        ),
        // Not TOML.
        ("", "x = = 1", 8, "", &["not TOML"]),
        ("", "near_m = 1\nnear_m = 2", 9, "", &["duplicate"]),
    ];
    for &(replaced, text, line, key, words) in cases {
        let mut scene = String::new();
        let mut trailing = String::new();
        for given in CAMERA.lines() {
            if replaced.is_empty() || !given.starts_with(replaced) {
                scene.push_str(given);
            } else if text.contains('[') && text.contains('\n') {
                let (own, rest) = text.split_once('\n').unwrap();
                scene.push_str(own);
                trailing = rest.to_string();
            } else {
                scene.push_str(text);
            }
            scene.push('\n');
        }
        if !trailing.is_empty() {
            scene = format!("{scene}{trailing}\n");
        } else if replaced.is_empty() {
            scene = format!("{scene}{text}\n");
        }
        let error = error(&scene);
        let shown = error.to_string();
        let expected_line = if trailing.is_empty() { line } else { 9 };
        assert_eq!(error.place().line, Some(expected_line), "{shown}\n{scene}");
        assert_eq!(error.place().key.as_deref().unwrap_or_default(), key, "{shown}");
        assert!(error.place().excerpt.is_some() && error.place().column.is_some(), "{shown}");
        assert!(key.is_empty() || error.remedy_text().is_some(), "{shown}");
        for word in words {
            assert!(shown.contains(word), "`{word}` is not in: {shown}");
        }
    }
}

#[test]
fn other_errors_are_clear() {
    assert!(error("").to_string().contains("the table [camera] is missing"));
    let figure = error("kind = \"hinge\"\n");
    assert!(figure.to_string().contains("figure, not a scene"), "{figure}");
    assert_eq!(figure.place().line, Some(1));
    // Many findings, many meshes and long keys take no more than linear time.
    let many: String = (0..200_000).rev().map(|index| format!("key{index:06} = 1\n")).collect();
    assert!(error(&many).to_string().contains("key199999"));
    let meshes = format!("{CAMERA}{}", "[[mesh]]\npath = \"a.obj\"\n".repeat(50_000));
    let scene = describe(&meshes).unwrap();
    assert_eq!((scene.meshes.len(), scene.mesh_place(49_999).line), (50_000, Some(7 + 100_000)));
    assert!(error(&format!("{} = 1", "k".repeat(1_000_000))).to_string().len() < 400);
    let tall = describe(&CAMERA.replace("[120.0, 96.0]", "[1.0, 100000.0]")).unwrap();
    assert_eq!(tall.picture_size(None).unwrap_err().kind(), ErrorKind::TooLarge);
}

#[test]
fn a_target_replaces_the_extension_and_what_it_turns() {
    let target = "[focus]\nplane = { point_m = [0, 0, 0], normal = [0, 2, 0] }\nadjust = \"rear\"\n";
    let turned = format!("{CAMERA}[camera.rear]\ntilt_deg = 170\n{target}");
    let scene = describe(&turned).unwrap();
    let focus = scene.focus.unwrap();
    assert_eq!(focus.adjust, Adjust::Rear);
    assert_eq!(focus.target, FocusTarget::Plane { point: DVec3::ZERO, normal: DVec3::Y });
    assert_eq!((focus.place.line, focus.place.key.as_deref()), (Some(11), Some("focus.plane")));
    assert!(describe(&turned.replace("rear\"", "front\"")).is_err(), "the rear is then not solved for");
    let without = CAMERA.replace("extension_mm = 152.3\n", "");
    let scene = describe(&format!("{without}[focus]\ndistance_m = inf\n")).unwrap();
    assert_eq!(scene.focus.unwrap().target, FocusTarget::Distance(f64::INFINITY));
    assert_eq!(scene.camera.extension, scene.camera.focal_length);
    assert!(describe(&format!("{CAMERA}[focus]\ncircle_of_confusion_mm = 0.1\n")).unwrap().focus.is_none());
}

#[test]
fn heights_round_half_up_and_are_at_least_one() {
    let size = |film: &str, width| {
        describe(&CAMERA.replace("[120.0, 96.0]", film)).unwrap().picture_size(Some(width)).unwrap().1
    };
    assert_eq!(size("[2.0, 1.0]", 1), 1, "0.5 rounds up");
    assert_eq!(size("[2.0, 1.0]", 3), 2);
    assert_eq!(size("[56.0, 41.5]", 56), 42);
    assert_eq!(size("[1000.0, 1.0]", 10), 1);
    let scene = describe(&CAMERA.replace("film_mm = [120.0, 96.0]", "film = \"645-portrait\"")).unwrap();
    assert_eq!(scene.film_mm, [41.5, 56.0]);
}

#[test]
fn a_pinhole_needs_no_f_number() {
    let text = CAMERA.replace("f_number = 5.6", "pinhole = true");
    assert_eq!(describe(&text).unwrap().camera.aperture, Aperture::Pinhole);
    let text = format!("{CAMERA}pinhole = false\n");
    assert!(matches!(describe(&text).unwrap().camera.aperture, Aperture::FNumber(_)));
    assert!(describe(&CAMERA.replace("f_number = 5.6", "pinhole = false")).is_err());
}

#[test]
fn a_scene_made_in_memory_is_what_a_file_gives_that_says_nothing_more() {
    let files = super::Memory::new().with("a.obj", b"v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".as_slice());
    let text = format!("{CAMERA}[[mesh]]\npath = \"a.obj\"\n");
    let read = describe(&text).unwrap().load(&files, std::path::Path::new(""), None).unwrap();
    let made = super::Scene::new(read.optics.clone(), read.surfaces.clone(), read.render.width).unwrap();
    assert_eq!((made.up, made.circle_of_confusion, made.sky), (read.up, read.circle_of_confusion, read.sky));
    assert_eq!((made.sun, made.blades, made.render), (read.sun, read.blades, read.render));
}
