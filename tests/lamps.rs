//! Light brighter than white that some samples of a pixel meet and others miss: clipping hides how wrong such pixels are, and the
//! stated error says it all the same.

mod common;

use common::gap;
use common::scenes::{ALIGNED, Random, Setting, camera, plain, quad, scene};
use glam::DVec3;
use groundglass::Exposure;
use groundglass::render::{Execution, render, replay};
use groundglass::scene::{Budget, Memory, Scene, Surfaces, parse};

/// Corners of a rectangle that faces the camera, `z` metres nearer than the origin, as a face of an OBJ.
fn rectangle([left, right, bottom, top]: [f64; 4], z: f64) -> String {
    let corners = [[left, bottom], [right, bottom], [right, top], [left, top]];
    let vertices = corners.map(|[x, y]| format!("v {x} {y} {z}\n")).concat();
    format!("{vertices}f -4 -3 -2 -1\n")
}

/// A room seen from 5 m, in focus at 3 m, 160 pixels wide; `lamp` has this radiance.
fn room(walls: &str, lamp: &str, radiance: f64) -> Scene {
    let toml = "[camera]\neye_m = [0, 0, 5]\nlook_at_m = [0, 0, 0]\nfocal_length_mm = 300\nf_number = 2\nfilm = \"4x5\"
[focus]\ndistance_m = 3\n[[mesh]]\npath = \"room.obj\"\n[sky]\nambient = [1, 1, 1]\nhorizon = [0.1, 0.1, 0.1]
zenith = [0.1, 0.1, 0.1]\n[render]\nwidth = 160\n";
    let obj = format!("mtllib room.mtl\nusemtl wall\n{walls}usemtl lamp\n{lamp}");
    let mtl = format!(
        "newmtl wall\nKd 0.2 0.2 0.2\nnewmtl lamp\nKd 0 0 0\nKe {radiance} {} {}\n",
        0.8 * radiance,
        0.1 * radiance
    );
    let files = Memory::new().with("room.obj", obj.into_bytes()).with("room.mtl", mtl.into_bytes());
    parse(toml, "room.toml").unwrap().describe().unwrap().load(&files, "".as_ref(), None).unwrap()
}

fn drawn(scene: &Scene, seed: u64, budget: Budget) -> Exposure {
    let mut scene = scene.clone();
    (scene.render.seed, scene.render.budget) = (seed, budget);
    render(&scene, Execution::default()).unwrap().0
}

/// Stated over true error at 4, 16 and 64 samples, each of four pictures.
fn ratios(scene: &Scene) -> [f64; 3] {
    let truth = drawn(scene, 99, Budget::Samples(16_384));
    [4, 16, 64].map(|samples| {
        let (mut stated, mut found) = (0.0, 0.0);
        for seed in 0..4 {
            let picture = drawn(scene, seed, Budget::Samples(samples));
            stated += picture.rms_error().unwrap() * picture.rms_error().unwrap();
            let gap = gap(&picture, &truth);
            found += gap * gap;
        }
        (stated / found).sqrt()
    })
}

#[test]
fn the_rim_of_a_lamp_is_as_wrong_as_stated() {
    // 45 pixels wide, and blurred over 8.
    for radiance in [3.0, 17.0, 200.0, 5000.0] {
        let ratios = ratios(&room("", &rectangle([-0.3, 0.3, -0.2, 0.25], 0.0), radiance));
        println!("{radiance}: {ratios:.2?}");
        assert!(ratios.iter().all(|ratio| (1.0 / 1.5..1.5).contains(ratio)), "{radiance}: {ratios:?}");
    }
}

#[test]
fn light_through_a_gap_is_as_wrong_as_stated() {
    // Between two walls out of focus: two thirds of a pixel wide, and blurred over 8.
    let walls = rectangle([-3.0, 0.1, -3.0, 3.0], 0.0) + &rectangle([0.104, 3.0, -3.0, 3.0], 0.0);
    for radiance in [30.0, 300.0, 3000.0] {
        let ratios = ratios(&room(&walls, &rectangle([-4.0, 4.0, -4.0, 4.0], -1.0), radiance));
        println!("{radiance}: {ratios:.2?}");
        assert!(ratios.iter().all(|ratio| (1.0 / 1.5..1.5).contains(ratio)), "{radiance}: {ratios:?}");
    }
}

#[test]
fn a_sharp_lamp_is_not_taken_for_chance() {
    // In focus, slanted: white or dark, and wrong in few pixels, which is what is said.
    let lamp = "v -0.2 -0.2 2\nv 0.2 -0.1 2\nv 0.15 0.2 2\nv -0.22 0.1 2\nf -4 -3 -2 -1\n";
    for radiance in [3.0, 20.0, 200.0] {
        let ratios = ratios(&room("", lamp, radiance));
        println!("{radiance}: {ratios:.2?}");
        assert!(ratios.iter().all(|&ratio| ratio < 1.5), "{radiance}: {ratios:?}");
    }
}

/// At each target, of pictures with so many seeds none errs 1.2 times as much, and at most `over` more than it.
fn hold(scene: &Scene, targets: [f64; 2], seeds: u64, over: usize) {
    let truth = drawn(scene, 99, Budget::Samples(16_384));
    for target in targets {
        let errors: Vec<f64> = (0..seeds)
            .map(|seed| gap(&drawn(scene, seed, Budget::MaxError(target)), &truth) / target)
            .collect();
        println!("{target}: {errors:.2?}");
        assert!(errors.iter().all(|&error| error < 1.2), "{target}: {errors:?}");
        assert!(errors.iter().filter(|&&error| error > 1.0).count() <= over, "{target}: {errors:?}");
    }
}

#[test]
fn targets_hold_where_small_lamps_are_sharp() {
    // Three pixels wide: what a few pixels of their rims miss is most of the error.
    let lamps: String = (0..24)
        .map(|i| {
            let (x, y) = (0.13 * f64::from(i % 6) - 0.33, 0.17 * f64::from(i / 6) - 0.25);
            let (x, y) = (x + 0.002 * f64::from(i), y + 0.0013 * f64::from(i));
            rectangle([x, x + 0.019, y, y + 0.023], 1.98 + 0.01 * f64::from(i % 5))
        })
        .collect();
    let scene = room("", &lamps, 14.0);
    hold(&scene, [0.004, 0.016], 10, 5);
}

#[test]
fn targets_hold_where_the_rim_of_a_lamp_runs_along_rows_of_pixels() {
    // All pixels of a row err alike there, and a few samples of each make it white.
    let scene = room("", &rectangle([-0.3, 0.3, -0.2, 0.25], 0.0), 3.0);
    hold(&scene, [0.004, 0.01], 20, 2);
}

#[test]
fn what_a_target_is_said_to_reach_does_not_hang_on_the_way_there() {
    let mut scene = room("", &rectangle([-0.3, 0.3, -0.2, 0.25], 0.0), 17.0);
    scene.render.budget = Budget::MaxError(0.01);
    let execution = || Execution { error_map: true, ..Execution::default() };
    let (picture, _) = render(&scene, execution()).unwrap();
    let truth = drawn(&scene, 99, Budget::Samples(16_384));
    assert!(gap(&picture, &truth) <= 0.01 && picture.rms_error().unwrap() <= 0.01);
    let (again, _) = replay(&scene, picture.samples(), execution()).unwrap();
    assert_eq!(again.rms_error(), picture.rms_error());
    let places = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
    let squares: Vec<f64> = places
        .map(|(x, y)| {
            let e = f64::from(picture.pixel_error(x, y).unwrap());
            e * e
        })
        .collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((rms / picture.rms_error().unwrap() - 1.0).abs() < 1e-5);
}

#[test]
fn what_stands_before_a_lamp_counts() {
    let lamp = |size: f64| rectangle([-size, size, 0.1 - size, 0.1 + size], 0.0);
    let wall = |bottom: f64| rectangle([-2.0, 2.0, bottom, 2.0], 1.0);
    // Hidden by a wall: as without it.
    for radiance in [30.0, 50_000.0] {
        let [hidden, alone] = [lamp(0.002), String::new()].map(|lamp| {
            let scene = room(&wall(-2.0), &lamp, radiance);
            [4, 64].map(|samples| drawn(&scene, 1, Budget::Samples(samples)).rms_error().unwrap())
        });
        assert_eq!(hidden, alone, "{radiance}");
    }
    // Behind a pane; of ten times the size and a hundredth of the brightness it is blurred to nearly the same disk, and met often.
    for (bottom, pane) in [(-2.0, 0.5), (-2.0, 0.9), (0.5, 0.9)] {
        let before = wall(bottom);
        let scene = |lamp: &str, radiance: f64| {
            let mut scene = room(&before, lamp, radiance);
            scene
                .surfaces
                .materials
                .iter_mut()
                .filter(|m| m.emission == [0.0; 3])
                .for_each(|m| m.coverage = pane);
            scene
        };
        let truth = drawn(&scene(&lamp(0.02), 200.0), 99, Budget::Samples(4096));
        for samples in [4, 16, 64] {
            let picture = drawn(&scene(&lamp(0.002), 20_000.0), 1, Budget::Samples(samples));
            let ratio = picture.rms_error().unwrap() / gap(&picture, &truth);
            println!("pane {pane} from {bottom}, {samples}: {ratio:.2}");
            assert!((1.0 / 1.5..1.5).contains(&ratio), "pane {pane} from {bottom}, {samples}: {ratio}");
        }
    }
}

/// Diffraction spreads some light of a lamp all over the picture, and most of it over a pixel or two.
#[test]
fn a_street_of_lamps_with_stars_is_as_wrong_as_stated() {
    let mut scene = Scene::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/star.toml")).unwrap();
    (scene.render.width, scene.render.height) = (80, 64);
    let truth = drawn(&scene, 99, Budget::Samples(32_768));
    for samples in [4, 16, 64, 256] {
        let (mut stated, mut found) = (0.0, 0.0);
        for seed in 0..4 {
            let picture = drawn(&scene, seed, Budget::Samples(samples));
            stated += picture.rms_error().unwrap() * picture.rms_error().unwrap();
            let gap = picture.rms_difference(&truth, scene.render.exposure_ev);
            found += gap * gap;
        }
        let ratio: f64 = f64::sqrt(stated / found);
        println!("{samples} samples: stated {ratio:.2} of the true error");
        assert!((1.0 / 1.5..1.5).contains(&ratio), "{samples} samples: {ratio}");
    }
}

/// Small leaves in a strong sun that gives them little light: nearly along them, from behind, or kept away by a wall. They are no lamps.
#[test]
fn what_the_sun_hardly_lights_is_no_lamp() {
    let mut random = Random(4);
    let mut leaves = Surfaces { materials: vec![plain([0.6, 0.7, 0.4])], ..Surfaces::default() };
    for _ in 0..200 {
        let [x, y, z] = [0, 1, 2].map(|_| 0.7 * random.next() - 0.35);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        quad(&mut leaves, corners.map(|(a, b)| DVec3::new(x + 0.004 * a, y + 0.004 * b, z)), 1.0, 0);
    }
    leaves.materials.push(plain([0.3; 3]));
    let wall = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
    quad(&mut leaves, wall.map(|(x, y)| DVec3::new(x, y, 20.0)), 1.0, 1);
    leaves.build_hierarchy();
    let setting = Setting { f_number: 4.0, stretch: 1.1, ..ALIGNED };
    let camera = camera(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 150.0, setting);
    for (toward, light) in
        [(DVec3::new(0.0, 1.0, 0.05), 10.0), (DVec3::new(0.0, 0.3, -1.0), 20.0), (DVec3::Z, 5.0)]
    {
        let mut scene = scene(&camera, leaves.clone(), 100, 16);
        let sun = scene.sun.as_mut().unwrap();
        (sun.toward, sun.color, sun.shadows) = (toward, DVec3::splat(light), true);
        let truth = drawn(&scene, 99, Budget::Samples(4096));
        for samples in [4, 16] {
            let ratios = [1, 2, 3].map(|seed| {
                let picture = drawn(&scene, seed, Budget::Samples(samples));
                picture.rms_error().unwrap() / gap(&picture, &truth)
            });
            let mean = ratios.iter().sum::<f64>() / 3.0;
            assert!((1.0 / 1.5..1.5).contains(&mean), "{toward} {samples}: {ratios:?}");
        }
    }
}
