//! The front door tells the truth: every example reads, solves and has its picture, what the comments claim is so,
//! and the files that the documents name exist.

#[path = "common/program.rs"]
mod program;

use groundglass::glam::DVec3;
use groundglass::optics::{Optics, upright};
use groundglass::render::{Execution, render};
use groundglass::scene::{Budget, Scene, SceneDescription, parse};
use groundglass::{FocusTarget, solve};
use program::run;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn scene(name: &str) -> SceneDescription {
    let path = root().join("examples").join(name).with_extension("toml");
    let text = fs::read_to_string(&path).unwrap();
    parse(&text, name).and_then(|file| file.describe()).unwrap_or_else(|error| panic!("{error}"))
}

/// Normal and offset of the plane that is sharp, world, unit normal.
fn sharp(optics: &Optics) -> (DVec3, f64) {
    let plane = optics.world_from_lens().plane(optics.focus_plane()).normalized();
    (plane.m, plane.e)
}

#[test]
fn every_example_has_its_lesson_its_picture_and_its_place_in_the_readme() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let mut count = 0;
    for entry in fs::read_dir(root().join("examples")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        count += 1;
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.lines().take(3).all(|line| line.starts_with('#')), "{name} says nothing");
        assert!(scene(name).optics().is_ok(), "{name}");
        let picture = root().join(format!("examples/pictures/{name}.png"));
        let size = fs::metadata(&picture).unwrap_or_else(|_| panic!("{name} has no picture")).len();
        assert!(size < 200_000, "the picture of {name} is large: {size} bytes");
        assert!(readme.contains(&format!("examples/{name}.toml")), "README.md leaves out {name}");
    }
    assert!(count >= 8, "{count} examples");
}

/// Each example, drawn with fewer samples, is its picture but for chance; its diagram is the same bytes.
#[test]
fn the_pictures_of_the_examples_are_what_is_drawn() {
    let pictures = root().join("examples/pictures");
    let keep = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(&pictures).unwrap() {
        let file = entry.unwrap().file_name().into_string().unwrap();
        if let Some(name) = file.strip_suffix("-diagram.svg") {
            let (scene, drawn) = (format!("examples/{name}.toml"), keep.path().join(&file));
            let mut words = vec!["diagram", &scene, "-o", drawn.to_str().unwrap()];
            if name == "tower" {
                words.extend(["--section", "side"]);
            }
            run(&root(), &words).expect(0, &[]);
            assert!(
                fs::read(&drawn).unwrap() == fs::read(pictures.join(&file)).unwrap(),
                "{file} is another"
            );
        } else if let Some(name) = file.strip_suffix(".png") {
            let picture = image::open(pictures.join(&file)).unwrap().into_rgb8();
            let mut scene = Scene::read(root().join("examples").join(name).with_extension("toml")).unwrap();
            (scene.render.width, scene.render.height) = picture.dimensions();
            scene.render.budget = Budget::Samples(if name == "star" { 8192 } else { 64 });
            let drawn = render(&scene, Execution::default()).unwrap().0.to_srgb8(scene.render.exposure_ev);
            let codes = || picture.as_raw().iter().map(|&code| f64::from(code) / 255.0);
            let count = drawn.len() as f64;
            let mean = codes().sum::<f64>() / count;
            let contrast = (codes().map(|code| (code - mean) * (code - mean)).sum::<f64>() / count).sqrt();
            let off =
                codes().zip(&drawn).map(|(a, &b)| (a - f64::from(b) / 255.0) * (a - f64::from(b) / 255.0));
            let off = (off.sum::<f64>() / count).sqrt();
            println!("{name}: off by {off:.4}, contrast {contrast:.4}");
            assert!(off < 0.15 * contrast, "{file} is another: off by {off} of a contrast of {contrast}");
        }
    }
}

#[test]
fn upright_after_is_what_solving_before_gives() {
    let (before, after) = (scene("upright-before"), scene("upright-after"));
    let Some(focus) = before.focus.as_ref() else { panic!("no target") };
    let turned = upright(&before.camera, before.up).unwrap();
    let solved = solve(&turned, &focus.target, focus.adjust).unwrap();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert!(close(solved.front.tilt.as_degrees(), after.camera.front.tilt.as_degrees()));
    assert!(close(solved.front.swing.as_degrees(), after.camera.front.swing.as_degrees()));
    assert!(close(solved.rear.tilt.as_degrees(), after.camera.rear.tilt.as_degrees()));
    assert!(close(solved.extension.as_metres(), after.camera.extension.as_metres()));
    // Film upright, wall sharp.
    let optics = after.optics().unwrap();
    assert!(optics.world_from_lens().vector(optics.film_normal()).y.abs() < 1e-12);
    let (normal, offset) = sharp(&optics);
    assert!(normal.cross(DVec3::Z).length() < 1e-9 && offset.abs() < 1e-9);
}

#[test]
fn the_planes_named_in_the_comments_are_sharp() {
    for (name, normal) in [
        ("figure-1b", DVec3::Y),
        ("figure-1c", DVec3::Y),
        ("ground", DVec3::Y),
        ("tower", DVec3::Z),
        ("wall", DVec3::Z),
        ("upright-before", DVec3::Z),
    ] {
        let (found, offset) = sharp(&scene(name).optics().unwrap());
        assert!(found.cross(normal).length() < 1e-9 && offset.abs() < 1e-9, "{name}: {found} {offset}");
    }
    // Figure 1: one camera, of which (a) turns nothing, (b) the lens, (c) the film.
    let [a, b, c] = ["figure-1a", "figure-1b", "figure-1c"].map(|name| scene(name).solve().unwrap());
    assert!(a.rail == b.rail && b.rail == c.rail);
    assert!(a.front == a.rear && b.rear == a.rear && c.front == a.front);
    assert!(matches!(scene("figure-1a").focus.unwrap().target, FocusTarget::Distance(d) if d == 1.84));
    let wall = scene("wall").optics().unwrap();
    assert!((wall.hinge_distance().unwrap() - 0.31).abs() < 0.01);
    assert!((wall.camera().front.swing.as_degrees() + 26.0).abs() < 0.5);
}

#[test]
fn the_documents_name_files_that_exist() {
    for document in ["README.md", "CONTRIBUTING.md", "CREDITS.md", "ARCHITECTURE.md"] {
        let text = fs::read_to_string(root().join(document)).unwrap();
        let links = text.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(link, _)| link));
        let pictures =
            text.split("src=\"").skip(1).filter_map(|rest| rest.split_once('"').map(|(link, _)| link));
        for link in links.chain(pictures).filter(|link| !link.contains("://")) {
            assert!(root().join(Path::new(link)).exists(), "{document} names {link}");
        }
    }
}
