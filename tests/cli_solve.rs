//! `solve` through the program: running forward gives the plane that was asked for, `--write` gives a scene with
//! the same optics, and what stops a solution is said.

#[path = "common/program.rs"]
mod program;

use program::{folder, run};
use serde_json::Value;
use std::fs;

const CAMERA: &str = "# a comment at the top
[camera]
eye_m = [1.0, 3.6, 10.0] # the eye
look_at_m = [0.0, 1.6, 0.0]
focal_length_mm = 150.0
f_number = 5.6
film = \"4x5\"
";

/// Targets of every kind, movements, and ways of writing tables.
const SCENES: [&str; 14] = [
    "extension_mm = 152.3\n",
    "[focus]\ndistance_m = 8.0 # metres\n",
    "[focus]\ndistance_m = inf\ncircle_of_confusion_mm = 0.05\n",
    "[camera.front]\ntilt_deg = 6 # tilted\nrise_mm = 12.5\n[focus]\ndistance_m = 5\n",
    "[camera.rear]\ntilt_deg = -3.3\nswing_deg = 7.1\nshift_mm = -4.7\n[focus]\ndistance_m = 20\n",
    "[focus]\nplane = { point_m = [0, 0, 0], normal = [0, 1, 0] }\n",
    "[focus]\nplane = { point_m = [0, 0, 0], normal = [0, 1, 0] }\nadjust = \"rear\"\n",
    "extension_mm = 160 # not used\n[focus]\nplane = { point_m = [0, 0, 0], normal = [0, 0, 1] }\nadjust = \"front\"\n",
    "[camera.front]\nrise_mm = 31.7\nshift_mm = -11.3\n[focus]\n[focus.plane]\npoint_m = [0, 0, 0] # where\nnormal = [0.1, 0.2, 1]\n",
    "[camera.rear]\ntilt_deg = 4\nrise_mm = 3\n[focus]\nadjust = \"rear\"\npoints_m = [[0,0,0],[1,0,0],[0,0,-5]]\n",
    "[focus]\npoints_m = [\n  [0, 0, 0], # one\n  [1, 0.5, 0],\n  [0, 2, -5],\n]\n",
    "front = { tilt_deg = 2, swing_deg = 1 } # inline\nrear = { rise_mm = 0.1 }\n[focus]\ndistance_m = 9\n",
    "front.tilt_deg = 2 # dotted\nfront.rise_mm = 0.3\n[focus]\nplane.point_m = [0, 0, 0]\nplane.normal = [0, 3, 0.1]\n",
    "pinhole = false\nextension_mm = 151\n[camera.front]\ntilt_deg = 1e-12\n[focus]\ndistance_m = 1e6\n",
];

/// Whether two answers hold the same numbers to 1e-9 of the larger, or of 1.
fn same(path: &str, a: &Value, b: &Value) {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            assert_eq!(a.len(), b.len(), "{path}");
            a.iter().for_each(|(key, value)| same(&format!("{path}/{key}"), value, &b[key]));
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{path}");
            let size =
                |list: &[Value]| list.iter().filter_map(Value::as_f64).fold(1.0, |m: f64, x| m.max(x.abs()));
            let scale = size(a).max(size(b));
            for (a, b) in a.iter().zip(b) {
                match (a.as_f64(), b.as_f64()) {
                    (Some(a), Some(b)) => assert!((a - b).abs() <= 1e-9 * scale, "{path}: {a} {b}"),
                    _ => same(path, a, b),
                }
            }
        }
        _ => match (a.as_f64(), b.as_f64()) {
            (Some(a), Some(b)) => {
                assert!((a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1e-3), "{path}: {a} {b}");
            }
            _ => assert_eq!(a, b, "{path}"),
        },
    }
}

#[test]
fn the_written_scene_has_the_same_optics() {
    let meshes = "[[mesh]] # the model\npath = \"models/../t.obj\" # its file\nscale = 2\n";
    for tables in SCENES {
        let scene = format!("{CAMERA}{tables}{meshes}");
        let (_keep, folder) = folder(&scene);
        fs::create_dir(folder.join("models")).unwrap();
        fs::create_dir_all(folder.join("other/deep er")).unwrap();
        let optics = |path: &str| {
            let points = "0,0;0.5,-0.5";
            run(&folder, &["optics", path, "--json", "--samples-at", points]).expect(0, &[]).json()
        };
        let before = optics("scene.toml");
        // Without a target there is nothing to solve, but one can be given.
        let given: &[&str] = if tables.contains("[focus]") { &[] } else { &["--distance", "9"] };
        for target in ["new.toml", "other/deep er/new.toml"] {
            let words = ["solve", "scene.toml", "--write", target];
            run(&folder, &[&words[..], given].concat()).expect(0, &[]);
            let text = fs::read_to_string(folder.join(target)).unwrap();
            for line in scene.lines() {
                let (code, comment) = line.split_once('#').unwrap_or((line, ""));
                let goes =
                    ["distance_m", "plane", "point", "normal", "  [", "one"].iter().any(|k| code.contains(k));
                assert!(goes || text.contains(comment), "`{comment}` is lost in\n{text}");
            }
            for key in ["distance_m", "plane", "points_m", "adjust"] {
                assert!(!text.contains(key), "{key} is left in\n{text}");
            }
            run(&folder, &["check", target]).expect(0, &[]);
            if given.is_empty() {
                same("", &before, &optics(target));
            }
        }
    }
}

#[test]
fn mesh_paths_lead_from_the_new_folder_to_the_old_files() {
    let meshes = "[[mesh]]\npath = \"in\\\\t.obj\"\n[[mesh]]\npath = \"none.obj\"\n";
    let (_keep, folder) = folder(&format!("{CAMERA}extension_mm = 152.3\n{meshes}"));
    fs::create_dir_all(folder.join("in")).unwrap();
    fs::create_dir_all(folder.join("out")).unwrap();
    fs::rename(folder.join("t.obj"), folder.join("in/t.obj")).unwrap();
    for (target, paths) in [
        ("new.toml", ["path = \"in\\\\t.obj\"", "path = \"none.obj\""]),
        ("out/new.toml", ["path = \"../in/t.obj\"", "path = \"../none.obj\""]),
    ] {
        run(&folder, &["solve", "scene.toml", "--distance", "9", "--write", target]).expect(0, &[]);
        let text = fs::read_to_string(folder.join(target)).unwrap();
        assert!(paths.iter().all(|path| text.contains(path)), "{text}");
    }
}

#[test]
fn the_scene_itself_may_be_replaced_by_its_solution() {
    let (_keep, folder) = folder(&format!("{CAMERA}[focus]\ndistance_m = 8\n"));
    run(&folder, &["solve", "scene.toml", "--write", "scene.toml"]).expect(0, &[]);
    let text = fs::read_to_string(folder.join("scene.toml")).unwrap();
    assert!(text.contains("extension_mm = 152.8") && text.contains("# the eye"), "{text}");
    run(&folder, &["solve", "scene.toml"]).expect(2, &["scene.toml", "focus", "--plane"]);
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn upright_keeps_the_film_parallel_to_up_and_the_plane_sharp() {
    let (_keep, folder) = folder(&format!("{CAMERA}extension_mm = 152.3\n"));
    for target in [
        ["--plane", "0,0,0;0,1,0"],
        ["--plane", "0,0,0;0,0,1"],
        ["--points", "0,0,0;1,0,0;0,3,0.5"],
        ["--distance", "9"],
    ] {
        let words =
            ["solve", "scene.toml", "--upright", "--write", "new.toml", "--json", target[0], target[1]];
        let found = run(&folder, &words).expect(0, &[]).json();
        let optics = run(&folder, &["optics", "new.toml", "--json"]).expect(0, &[]).json();
        assert!(numbers(&optics["film"]["normal"])[1].abs() < 1e-12, "{optics}");
        for key in ["front", "rear", "extension_mm", "focus_plane"] {
            same(key, &found[key], &optics[key]);
        }
        let plane = numbers(&optics["focus_plane"]);
        let distance = |p: [f64; 3]| plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] + plane[3];
        let points: &[[f64; 3]] = match target[1] {
            "0,0,0;0,1,0" => &[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 0.0, -20.0]],
            "0,0,0;0,0,1" => &[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 20.0, 0.0]],
            "9" => &[],
            _ => &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.5]],
        };
        for &point in points {
            assert!(distance(point).abs() < 1e-9, "{target:?}: {point:?} lies {} away", distance(point));
        }
    }
    run(&folder, &["solve", "scene.toml", "--upright", "--distance", "9", "--adjust", "rear"])
        .expect(64, &["--upright"]);
}

#[test]
fn points_are_near_enough_for_a_scene_file_and_may_lie_close_together() {
    let (_keep, folder) = folder(&format!("{CAMERA}extension_mm = 152.3\n"));
    let far = "1e155,0,0;0,1e155,0;0,0,1e155";
    run(&folder, &["solve", "scene.toml", "--points", far]).expect(64, &["--points", "1e155", "1e12 m"]);
    run(&folder, &["solve", "scene.toml", "--plane", "1,2,1e13;0,0,1"]).expect(64, &["--plane", "1e13"]);
    // Whose cross product is less than the least number: a plane like any other.
    run(&folder, &["solve", "scene.toml", "--points", "1e-200,0,0;0,1e-200,0;0,0,1e-200"]).expect(0, &[]);
}

#[test]
fn what_has_no_solution_says_which_limit_and_what_can_be_had() {
    let (_keep, folder) = folder(&format!("{CAMERA}extension_mm = 152.3\n"));
    for (target, limit, nearest) in [
        (["--distance", "0.1"], "NoRealImage", false),
        (["--points", "0,0,0;1,1,1;2,2,2"], "NoPlane", false),
        (["--plane", "1,3.6,10;0,1,0"], "ThroughLens", true),
        (["--plane", "1,3.5,10;0,1,0"], "HingeTooNear", true),
        (["--plane", "1,3.6,9.9;0,0,1"], "NoRealImage", true),
    ] {
        let words = ["solve", "scene.toml", "--json", "--write", "new.toml", target[0], target[1]];
        let answer = run(&folder, &words);
        let json = answer.expect(2, &["scene.toml", target[0]]).json();
        assert_eq!((&json["solved"], &json["limit"]), (&false.into(), &limit.into()), "{target:?}: {json}");
        assert_eq!(json["miss_m"].is_number(), nearest, "{json}");
        if limit == "HingeTooNear" {
            // Offered are the movements that have another plane sharp, which lies as far from what was asked for as is said.
            let plane = &json["focus_plane"];
            let number = |value: &Value| value.as_f64().unwrap();
            let [n, e] = [number(&plane[1]), number(&plane[3])];
            assert!((n.abs() - 1.0).abs() < 1e-9, "{json}");
            let away = (-e / n - 3.5).abs();
            assert!((away - 0.05).abs() < 1e-6 && (number(&json["miss_m"]) - away).abs() < 1e-9, "{json}");
            assert!(number(&json["front"]["tilt_deg"]).abs() > 1.0, "{json}");
        }
        assert!(!folder.join("new.toml").exists());
        if nearest {
            // The plane offered can be had: the remedy names it as it must be asked for.
            let plane = answer.err.split("--plane \"").nth(1).unwrap().split('"').next().unwrap();
            run(&folder, &["solve", "scene.toml", "--plane", plane]).expect(0, &[]);
        }
    }
    let tables = "[focus]\nplane = { point_m = [1, 3.6, 10], normal = [0, 1, 0] }\n";
    fs::write(folder.join("scene.toml"), format!("{CAMERA}{tables}")).unwrap();
    for verb in ["optics", "solve", "check", "render"] {
        run(&folder, &[verb, "scene.toml"]).expect(2, &["scene.toml:9:", "focus.plane", "lens centre"]);
    }
}

#[test]
fn a_solution_replaces_scenes_alone() {
    let (_keep, folder) = folder(program::CAMERA);
    for other in [
        "camera, lens\n1, 2\n",
        "camera notes\n",
        "kind = \"side-view\"\n[camera]\nfocal_length_mm = 150\n",
        "camera = \"a Sinar\"\n",
    ] {
        fs::write(folder.join("o.toml"), other).unwrap();
        let words = ["solve", "scene.toml", "--distance", "8", "--write", "o.toml"];
        run(&folder, &words).expect(2, &["o.toml", "no scene"]);
        assert_eq!(fs::read_to_string(folder.join("o.toml")).unwrap(), other);
    }
}

#[test]
fn what_is_solved_or_proposed_is_of_use() {
    let scene =
        |rear: &str| format!("{CAMERA}{rear}").replace("eye_m = [1.0, 3.6, 10.0]", "eye_m = [0, 1.6, 10]");
    let (_keep, folder) = folder(&scene("extension_mm = 152.3\n"));
    let solve = |words: &[&str]| run(&folder, &[&["solve", "scene.toml"], words].concat());
    // A plane through the lens: what is proposed instead can be rendered, and says no word of warning.
    let through = solve(&["--adjust", "rear", "--plane", "0,1.6,10;0,1,0"]);
    let (_, proposed) =
        through.expect(2, &["passes through the lens centre"]).err.split_once("--plane \"").unwrap();
    let proposed = proposed.split('"').next().unwrap();
    let again = solve(&["--adjust", "rear", "--plane", proposed]);
    assert_eq!(again.expect(0, &[]).err, "");
    // Nearer than the focal length, by the film: why, not only how far the film would have to turn.
    solve(&["--adjust", "rear", "--plane", "0,1.6,9.9;0,0,1"]).expect(2, &["backwards", "no real image"]);
    solve(&["--points", "0,0,0;1,0,0;2,0,0"]).expect(2, &["give three points that are not on one line"]);
    solve(&["--distance", "0.1"]).expect(2, &["farther away than the focal length"]);
    // A distance turns no standard, whatever a file says.
    fs::write(folder.join("scene.toml"), scene("[focus]\ndistance_m = 5\nadjust = \"rear\"\n")).unwrap();
    solve(&["--upright"]).expect(0, &[]);
    solve(&["--upright", "--plane", "0,0,0;0,1,0"]).expect(64, &["--adjust front"]);
    // The film sees above the horizon alone: the ground is nowhere in the picture.
    fs::write(folder.join("scene.toml"), scene("extension_mm = 152.3\n[camera.rear]\nrise_mm = -60\n"))
        .unwrap();
    let nowhere = run(&folder, &["solve", "scene.toml", "--plane", "0,0,0;0,1,0"]);
    nowhere.expect(0, &["nothing in the picture is sharp"]);
    assert!(nowhere.out.contains("finite distance before the lens"), "{}", nowhere.out);
}
