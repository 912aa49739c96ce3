//! What the program tells people: the words of `optics`, what `render` says of its own error, and upward directions that are not y.

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, folder, run};
use std::fs;

/// The line of a report that begins with `name`.
fn line<'a>(text: &'a str, name: &str) -> &'a str {
    let found = text.lines().find_map(|line| line.strip_prefix(name));
    found.unwrap_or_else(|| panic!("no line `{name}` in: {text}")).trim()
}

/// A 150 mm lens whose film stands 152.3 mm behind; numbers of the hinge rule J = f / sin t and the lens equation, by hand.
#[test]
fn optics_says_where_lines_and_planes_pass() {
    let (_keep, folder) = folder("");
    let words = |more: &str| {
        fs::write(folder.join("words.toml"), format!("{CAMERA}{more}")).unwrap();
        run(&folder, &["optics", "words.toml"]).expect(0, &[]).out.clone()
    };
    // Matrices are the same numbers as in JSON.
    let asked = ["optics", "words.toml", "--samples-at", "0,0;-0.6,0.8"];
    fs::write(folder.join("words.toml"), CAMERA).unwrap();
    let text = run(&folder, &asked).expect(0, &[]).out.clone();
    let json = run(&folder, &[&asked[..], &["--json"]].concat()).expect(0, &[]).json();
    let rows = text.lines().skip_while(|line| !line.starts_with("matrix (0, 0)"));
    let told: Vec<f64> =
        rows.flat_map(|row| row[19..].split_whitespace()).map(|x| x.parse().unwrap()).collect();
    let matrices = json["sample_matrices"].as_array().unwrap().iter();
    let known: Vec<f64> = matrices
        .flat_map(|sample| sample["matrix"].as_array().unwrap())
        .map(|number| number.as_f64().unwrap())
        .collect();
    assert!(told.len() == 32 && told == known, "{text}");
    // D = f d / (d - f) = 150 x 152.3 / 2.3 = 9932.6 mm; the diagonal of 120 x 96 mm is 153.67, and 2 atan(76.84 / 152.3) = 53.54.
    let plain = words("");
    let sharp = "cuts the lens axis 9.933 m in front of the lens; vertical, square to the lens axis";
    assert_eq!(line(&plain, "sharp"), sharp);
    assert_eq!(line(&plain, "hinge line"), "at infinity (lens and film are parallel)");
    assert_eq!(
        line(&plain, "image circle"),
        "the film needs 153.67 mm about the lens axis (53.54 degrees of coverage)"
    );
    // Toward infinity and stopped down a tilted lens has more than a right angle sharp: by the blur's diameter from the hinge, 101.6 degrees.
    let wide = CAMERA.replace("152.3", "150").replace("f_number = 5.6", "f_number = 45");
    assert!(wide.contains("= 150\n") && wide.contains("= 45\n"), "{wide}");
    let wide = format!("{wide}[camera.front]\ntilt_deg = 1.4\n[focus]\ncircle_of_confusion_mm = 0.1\n");
    fs::write(folder.join("words.toml"), wide).unwrap();
    let wide = run(&folder, &["optics", "words.toml"]).expect(0, &[]).out.clone();
    assert!(line(&wide, "wedge").starts_with("101.68 degrees between"), "{wide}");
    // J = 150 / sin 6 = 1435.0 mm; the film plane meets the lens plane 152.3 / tan 6 = 1449.0 mm below the lens centre.
    let tilted = words("[camera.front]\ntilt_deg = 6\n");
    assert_eq!(line(&tilted, "hinge line"), "1.435 m below the lens centre, level; distance 1.435 m");
    let film = line(&tilted, "Scheimpflug line");
    assert!(film.starts_with("1.449 m below, 152.30 mm behind the lens centre, level"), "{film}");
    // Along its axis the film stands 152.3 / cos 6 = 153.139 mm behind: 150 x 153.139 / 3.139 = 7318 mm.
    let sharp = line(&tilted, "sharp");
    assert!(sharp.starts_with("cuts the lens axis 7.318 m in front of the lens; "), "{sharp}");
    let tilted = words("[camera.front]\ntilt_deg = -6\n");
    assert!(line(&tilted, "hinge line").starts_with("1.435 m above the lens centre, level"), "{tilted}");
    // The lens faces right with swing: the hinge line is upright, on that side.
    let swung = words("[camera.front]\nswing_deg = 6\n");
    assert_eq!(line(&swung, "hinge line"), "1.435 m right of the lens centre, vertical; distance 1.435 m");
    assert!(line(&swung, "sharp").contains("; vertical, turned"), "{swung}");
    let swung = words("[camera.front]\nswing_deg = -6\n");
    assert!(line(&swung, "hinge line").starts_with("1.435 m left of the lens centre, vertical"), "{swung}");
}

/// A lamp of 4 mm before a dark room, so far out of focus that samples miss it.
const TRAP: &str = "[camera]\neye_m = [0, 1, 5]\nlook_at_m = [0, 1, 0]\nfocal_length_mm = 300\nf_number = 2.0
film = \"4x5\"\n[focus]\ndistance_m = 1.0\n[[mesh]]\npath = \"lamp.obj\"\n[sky]\nambient = [0, 0, 0]
horizon = [0.02, 0.02, 0.02]\nzenith = [0.02, 0.02, 0.02]\n[render]\nwidth = 160\n";

#[test]
fn render_says_what_its_error_may_hide() {
    let (_keep, folder) = folder(TRAP);
    fs::write(
        folder.join("lamp.obj"),
        "mtllib l.mtl\nusemtl l\nv -0.002 1 0\nv 0.002 1 0\nv 0 1.004 0\nf 1 2 3\n",
    )
    .unwrap();
    fs::write(folder.join("l.mtl"), "newmtl l\nKd 0 0 0\nKe 20000 20000 20000\n").unwrap();
    let words = ["render", "scene.toml", "-o", "o.exr", "--stats", "s.json", "--samples", "4"];
    let missed = run(&folder, &words);
    missed.expect(0, &["warning", "the samples may have missed it in "]);
    let stats: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.join("s.json")).unwrap()).unwrap();
    let blocks = stats["unseen_light_blocks"].as_u64().unwrap();
    assert!(
        blocks > 0 && missed.err.contains(&format!(" in {blocks} blocks of 8 x 8 pixels")),
        "{}",
        missed.err
    );
    assert!(missed.out.contains("160 x 128 pixels, 4 samples each, "), "{}", missed.out);

    // What is tame is drawn without a word, and says its error; one sample has none.
    fs::write(folder.join("scene.toml"), format!("{CAMERA}{}", program::SMALL)).unwrap();
    let tame = run(&folder, &["render", "scene.toml", "-o", "o.png", "--samples", "16"]);
    assert_eq!((tame.code, tame.err.as_str()), (0, ""));
    assert!(tame.out.contains("16 x 13 pixels, 16 samples each, ") && tame.out.contains("RMS error about "));
    let one = run(&folder, &["render", "scene.toml", "-o", "o.png", "--samples", "1"]);
    assert!(one.out.contains("1 sample each") && one.out.contains("its error is unknown"), "{}", one.out);
    // An error that no number of samples reaches, foretold and told, and one that is.
    let beyond = run(&folder, &["render", "scene.toml", "-o", "o.png", "--max-error", "1e-9"]);
    beyond.expect(
        0,
        &[
            "an error of 1e-9 seems out of reach: ",
            "an error of 1e-9 was asked for and ",
            " is reached with up to ",
        ],
    );
    let number = |before: &str| -> f64 {
        let digits = beyond.err.split_once(before).unwrap().1.split([' ', ',']).next().unwrap();
        digits.parse().unwrap()
    };
    let (expected, found) = (number(" may reach "), number(" asked for and "));
    assert!((0.5..=2.0).contains(&(expected / found)), "{expected} foretold, {found} found");
    let reached = run(&folder, &["render", "scene.toml", "-o", "o.png", "--max-error", "0.02"]);
    assert_eq!((reached.code, reached.err.as_str()), (0, ""));
    assert!(reached.out.contains("samples on average (") || reached.out.contains("samples each"));
}

/// What is turned with its camera and its upward direction looks the same, sky and sunlight included, and its verticals stay upright
/// by the same movements.
#[test]
fn upward_may_be_any_direction() {
    let (_keep, folder) = folder("");
    let sky = "[sky]\nambient = [0.1, 0.2, 0.3]\nhorizon = [0.9, 0.8, 0.7]\nzenith = [0.1, 0.2, 0.6]\n";
    let write = |name: &str, up: [f64; 3], turned: fn([f64; 3]) -> [f64; 3]| {
        let camera = CAMERA
            .replace("[0.0, 1.6, 10.0]", &format!("{:?}", turned([0.0, 1.6, 10.0])))
            .replace("[0.0, 1.6, 0.0]", &format!("{:?}\nup = {:?}", turned([0.0, 3.6, 0.0]), turned(up)));
        let corners = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]].map(turned);
        let obj: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
        fs::write(folder.join(format!("{name}.obj")), format!("{obj}f 1 2 3\n")).unwrap();
        let sun = format!("[sun]\ntoward = {:?}\ncolor = [0.7, 0.7, 0.6]\n", turned([-0.5, 0.8, 0.6]));
        let scene = format!(
            "{camera}{sun}{sky}[render]\nwidth = 48\nsamples = 16\n[[mesh]]\npath = \"{name}.obj\"\n"
        );
        fs::write(folder.join(format!("{name}.toml")), scene).unwrap();
        run(&folder, &["render", &format!("{name}.toml"), "-o", &format!("{name}.png")]).expect(0, &[]);
    };
    write("y", [0.0, 1.0, 0.0], |p| p);
    write("z", [0.0, 1.0, 0.0], |[x, y, z]| [x, -z, y]);
    let picture = |name: &str| image::open(folder.join(name)).unwrap().into_rgb8();
    let (y, z) = (picture("y.png"), picture("z.png"));
    let colors: std::collections::BTreeSet<_> = y.pixels().map(|pixel| pixel.0).collect();
    assert!(colors.len() > 20, "sky and triangle are seen");
    // The axes of the camera are made of other numbers: an edge may be decided otherwise.
    let apart = y.iter().zip(z.iter()).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    assert!(apart < y.len() / 200, "{apart} values of {} differ", y.len());
    // Upright verticals: the film stands along `up`.
    let solve = |name: &str, normal: &str| {
        let plane = format!("0,0,0;{normal}");
        let scene = format!("{name}.toml");
        let found = run(&folder, &["solve", &scene, "--plane", &plane, "--upright", "--json"]);
        found.expect(0, &[]);
        let json = found.json();
        ["front", "rear"].map(|s| [&json[s]["tilt_deg"], &json[s]["swing_deg"]].map(|x| x.as_f64().unwrap()))
    };
    let (y, z) = (solve("y", "0,0.2,1"), solve("z", "0,-1,0.2"));
    assert!(y.as_flattened().iter().any(|angle| angle.abs() > 1.0), "{y:?}");
    for (a, b) in y.as_flattened().iter().zip(z.as_flattened()) {
        assert!((a - b).abs() < 1e-9, "{y:?} {z:?}");
    }
}
