//! Pictures that stop at an error or a time: the error is true, the samples can be told and drawn again.

mod common;
#[path = "common/program.rs"]
mod program;

use common::gap;
use common::scenes::{Random, Setting, camera, plain, quad, scene, yard};
use glam::DVec3;
use groundglass::picture::Allocation;
use groundglass::render::{Execution, render, replay};
use groundglass::scene::{Budget, Files, Memory, Scene, Surfaces, parse};
use groundglass::{ErrorKind, Exposure};
use program::{CAMERA, folder, run};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Surfaces with textures, seen with a wide aperture: some of the picture is sharp, some flat, some far out of focus.
fn blurred(seed: u64) -> Scene {
    let setting = Setting { front: [4.0, -3.0], rear: [0.0, 0.0], f_number: 2.8, stretch: 1.03, rise: 0.0 };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    let mut surfaces = yard(&mut Random(5), 60);
    surfaces.find_patches();
    let mut scene = scene(&camera, surfaces, 96, 64);
    scene.render.seed = seed;
    scene
}

fn draw(scene: &Scene) -> Exposure {
    render(scene, Execution::default()).unwrap().0
}

fn bits(exposure: &Exposure) -> Vec<u32> {
    let pixels = (0..exposure.height()).flat_map(|y| (0..exposure.width()).map(move |x| (x, y)));
    pixels.flat_map(|(x, y)| exposure.pixel(x, y).map(f32::to_bits)).collect()
}

fn square(x: f64) -> f64 {
    x * x
}

#[test]
fn the_stated_error_is_the_true_one_and_a_target_is_reached() {
    // The truth has a seed of its own.
    let mut scene = blurred(99);
    scene.render.budget = Budget::Samples(16_384);
    let truth = draw(&scene);
    for samples in [4, 16, 64, 256, 1024] {
        let (mut stated, mut found) = (0.0, 0.0);
        for seed in 0..4 {
            let mut scene = blurred(seed);
            scene.render.budget = Budget::Samples(samples);
            let picture = draw(&scene);
            stated += square(picture.rms_error().unwrap());
            found += square(gap(&picture, &truth));
        }
        let ratio = (stated / found).sqrt();
        println!("{samples} samples: error {:.5}, stated over true {ratio:.3}", (found / 4.0).sqrt());
        assert!(
            (1.0 / 1.25..1.25).contains(&ratio),
            "{samples} samples: stated {ratio} times the true error"
        );
    }
    let mut misses = 0;
    for seed in 0..20 {
        for target in [0.02, 0.006] {
            let mut scene = blurred(seed);
            scene.render.budget = Budget::MaxError(target);
            let picture = draw(&scene);
            let found = gap(&picture, &truth);
            println!(
                "seed {seed}: {:.3} of {target}, stated {:.3}",
                found / target,
                picture.rms_error().unwrap() / target
            );
            assert!(picture.rms_error().unwrap() <= target && found <= 1.2 * target, "seed {seed}: {found}");
            misses += u32::from(found > target);
        }
    }
    assert!(misses <= 2, "{misses} of 40 beyond the error that was asked for");
}

/// The errors of pictures of so many seeds that stop at a target, as parts of it.
fn errors(seeds: u64, target: f64, scene: impl Fn(u64) -> Scene, truth: &Exposure) -> Vec<f64> {
    let error = |seed| {
        let mut scene = scene(seed);
        scene.render.budget = Budget::MaxError(target);
        gap(&draw(&scene), truth) / target
    };
    (0..seeds).map(error).collect()
}

#[test]
fn edges_along_rows_or_diagonals_of_pixels_do_not_end_a_picture_too_early() {
    // All pixels along such an edge err alike, and where the halves of the samples agree by chance they seem to be right.
    let scene = |seed: u64, stretch: f64, f_number: f64, is_turned: bool| {
        let setting = Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number, stretch, rise: 0.0 };
        let camera = camera(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 150.0, setting);
        let mut surfaces = Surfaces { materials: vec![plain([0.0; 3])], ..Default::default() };
        surfaces.materials[0].emission = [1.0; 3];
        let corner = |x: f64, y: f64| match is_turned {
            false => DVec3::new(0.913 * x + 0.01, 0.787 * y + 0.007, 0.0),
            true => DVec3::new(0.51 * x - 0.57 * y + 0.01, 0.51 * x + 0.57 * y + 0.007, 0.0),
        };
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        quad(&mut surfaces, corners, 1.0, 0);
        let mut scene = scene(&camera, surfaces, 240, 8192);
        (scene.sky.horizon, scene.sky.zenith, scene.render.seed) = (DVec3::ZERO, DVec3::ZERO, seed);
        scene
    };
    // In focus, and blurred over a pixel and a half; diagonals through a pinhole too.
    for (stretch, f_number, is_turned, targets) in [
        (1.0, 16.0, false, [0.0008, 0.0003]),
        (1.08, 16.0, false, [0.0015, 0.0004]),
        (1.0, 16.0, true, [0.002, 0.0005]),
        (1.08, 16.0, true, [0.002, 0.0006]),
        (1.0, 0.0, true, [0.003, 0.001]),
    ] {
        let truth = draw(&scene(99, stretch, f_number, is_turned));
        for target in targets {
            let errors = errors(10, target, |seed| scene(seed, stretch, f_number, is_turned), &truth);
            println!("{target}: {errors:.2?} of the error that was asked for");
            let over = errors.iter().filter(|&&error| error > 1.0).count();
            assert!(over <= 1 && errors.iter().all(|&error| error <= 1.2), "{target}: {errors:?}");
        }
    }
}

#[test]
fn bars_along_rows_that_diffraction_spreads_do_not_end_a_picture_too_early() {
    // Each row of pixels is a bar, and all of its pixels err alike in what light they lose to the rows beside it.
    let bar = 0.12 / 160.0 * (5.0 - 0.15) / 0.15;
    let vertices: String = (-66..66)
        .step_by(2)
        .map(|row| {
            let (low, high) = (bar * f64::from(row), bar * f64::from(row + 1));
            format!("v -3 {low} 0\nv 3 {low} 0\nv 3 {high} 0\nv -3 {high} 0\nf -4 -3 -2 -1\n")
        })
        .collect();
    let toml = "[camera]\neye_m = [0, 0, 5]\nlook_at_m = [0, 0, 0]\nfocal_length_mm = 150\nf_number = 42.5\nfilm = \"4x5\"
[focus]\ndistance_m = 5\n[[mesh]]\npath = \"bars.obj\"\n[sky]\nambient = [1, 1, 1]\nhorizon = [0, 0, 0]
zenith = [0, 0, 0]\n[render]\nwidth = 160\nsamples = 16384\ndiffraction = true\n";
    let files = Memory::new().with("bars.obj", vertices.into_bytes());
    let description = parse(toml, "bars.toml").unwrap().describe().unwrap();
    let bars = description.load(&files, "".as_ref(), None).unwrap();
    let scene = |seed| {
        let mut scene = bars.clone();
        scene.render.seed = seed;
        scene
    };
    let truth = draw(&scene(99));
    for target in [0.008, 0.004] {
        let errors = errors(10, target, scene, &truth);
        println!("{target}: {errors:.2?} of the error that was asked for");
        let over = errors.iter().filter(|&&error| error > 1.0).count();
        assert!(over <= 1 && errors.iter().all(|&error| error <= 1.2), "{target}: {errors:?}");
    }
}

#[test]
fn weights_of_light_do_not_end_a_picture_too_early_nor_late() {
    // All pixels of a tile share their lens points, so that its light is weighed wrong by one throw: sky and surfaces alike.
    let setting = Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 2.0, stretch: 1.0, rise: 0.0 };
    let camera = camera(DVec3::new(0.0, 3.0, 24.0), DVec3::new(0.0, 6.0, 0.0), 150.0, setting);
    let mut surfaces = yard(&mut Random(5), 20);
    surfaces.find_patches();
    let views = [("sky", Surfaces::default(), [0.003, 0.002]), ("yard", surfaces, [0.006, 0.004])];
    for (name, surfaces, targets) in views {
        let view = |seed: u64| {
            let mut scene = scene(&camera, surfaces.clone(), 128, 8192);
            (scene.render.falloff, scene.render.seed) = (true, seed);
            scene
        };
        let truth = draw(&view(99));
        for target in targets {
            let told = AtomicU64::new(0);
            let tell = |_: f64| {
                told.fetch_add(1, Ordering::Relaxed);
            };
            let errors: Vec<f64> = (0..8)
                .map(|seed| {
                    let mut scene = view(seed);
                    scene.render.budget = Budget::MaxError(target);
                    let execution = Execution { beyond_reach: Some(&tell), ..Execution::default() };
                    gap(&render(&scene, execution).unwrap().0, &truth) / target
                })
                .collect();
            println!("{name}, {target}: {errors:.2?} of the error that was asked for");
            let over = errors.iter().filter(|&&error| error > 1.0).count();
            assert!(over <= 1 && errors.iter().all(|&error| error <= 1.2), "{name}, {target}: {errors:?}");
            assert_eq!(told.into_inner(), 0, "{name}, {target}: said to be out of reach");
        }
    }
}

#[test]
fn samples_go_where_the_error_is() {
    let mut scene = blurred(3);
    scene.render.budget = Budget::MaxError(0.0015);
    let adaptive = draw(&scene);
    let (least, most) = adaptive.samples().range();
    assert!(most >= 4 * least, "{least} to {most}");
    // As many samples for all give a larger error.
    scene.render.budget = Budget::Samples(adaptive.samples().mean().round() as u32);
    let uniform = draw(&scene);
    assert!(
        uniform.rms_error() > adaptive.rms_error(),
        "{:?} {:?}",
        uniform.rms_error(),
        adaptive.rms_error()
    );
}

/// The tower from below: most of the picture is sky.
const HALF_SKY: &str = r#"
[camera]
eye_m = [-0.208, 0.04, 0.792]
look_at_m = [0.036, 0.55, 0.0]
focal_length_mm = 120.0
f_number = 1.4
film = "4x5"

[focus]
distance_m = 0.75

[[mesh]]
path = "tower/tower.obj"
scale = 0.008

[sun]
toward = [0.5, 0.8, 0.6]
color = [0.72, 0.68, 0.6]

[sky]
horizon = [0.5, 0.62, 0.78]
zenith = [0.12, 0.27, 0.6]

[render]
width = 320
"#;

#[test]
fn the_sky_gets_the_fewest_samples_whatever_others_begin_with() {
    let mut surfaces = yard(&mut Random(5), 40);
    surfaces.find_patches();
    let setting = Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 8.0, stretch: 1.0, rise: 0.0 };
    let camera = camera(DVec3::new(0.0, 3.0, 24.0), DVec3::new(0.0, 6.0, 0.0), 150.0, setting);
    let mut scene = scene(&camera, surfaces, 320, 256);
    let uniform = draw(&scene);
    scene.render.budget = Budget::MaxError(uniform.rms_error().unwrap());
    let picture = draw(&scene);
    let Allocation::Blocks(samples) = picture.samples() else { panic!("by block") };
    let begun: u32 = samples.to_text().split(':').next().unwrap().parse().unwrap();
    let mean = picture.samples().mean();
    println!("begun with {begun}, {:?}, {mean:.1}", picture.samples().range());
    // The top of the picture is sky.
    assert!(begun >= 64 && (0..40).all(|x| samples.get(x, 0) <= 16), "{begun}");
    assert_eq!(picture.samples().range().0, 2);
    assert!(mean < 0.5 * 256.0 && picture.rms_error() <= uniform.rms_error(), "{mean}");
    let (again, _) = replay(&scene, picture.samples(), Execution::default()).unwrap();
    assert!(bits(&picture) == bits(&again) && picture.rms_error() == again.rms_error());
}

#[test]
fn where_half_of_the_picture_is_flat_half_the_samples_do() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let description = parse(HALF_SKY, "half-sky.toml").unwrap().describe().unwrap();
    let mut scene = description.load(&Files::new(), &folder, None).unwrap();
    for samples in [64, 256] {
        scene.render.budget = Budget::Samples(samples);
        let uniform = draw(&scene);
        scene.render.budget = Budget::MaxError(uniform.rms_error().unwrap());
        let targeted = draw(&scene);
        assert!(targeted.rms_error() <= uniform.rms_error());
        let share = targeted.samples().mean() / f64::from(samples);
        assert!(share < 0.5, "{share} of the samples that uniform sampling takes");
    }
}

#[test]
fn the_same_bytes_for_any_thread_count_and_in_a_replay() {
    let mut scene = blurred(5);
    scene.render.budget = Budget::MaxError(0.008);
    let one = render(&scene, Execution { threads: Some(1), ..Execution::default() }).unwrap().0;
    for threads in [2, 3, 8] {
        let other = render(&scene, Execution { threads: Some(threads), ..Execution::default() }).unwrap().0;
        assert!(bits(&one) == bits(&other) && one.samples() == other.samples(), "{threads} threads");
    }
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    scene.render.budget = Budget::Seconds(0.2);
    let (timed, _) = render(&scene, Execution { clock: Some(&clock), ..Execution::default() }).unwrap();
    let text = timed.samples().to_text();
    let samples = Allocation::from_text(timed.width(), timed.height(), &text).unwrap();
    let (again, _) = replay(&scene, &samples, Execution::default()).unwrap();
    assert!(bits(&timed) == bits(&again) && timed.rms_error() == again.rms_error());
    let (width, height) = (scene.render.width, scene.render.height);
    let blocks = width.div_ceil(8) * height.div_ceil(8);
    // Of another size; and with less than all begin with where there is something to see.
    for (width, height, text) in [(8, 8, "16: 1x16"), (width, height, &*format!("32: {blocks}x16"))] {
        let other = Allocation::from_text(width, height, text).unwrap();
        assert_eq!(replay(&scene, &other, Execution::default()).unwrap_err().kind(), ErrorKind::Invalid);
    }
}

/// By a clock that goes on by a tenth of a millisecond whenever it is read, and is slower or faster than the one before.
#[test]
fn a_time_is_kept_by_any_clock() {
    let mut before = 0.0;
    for seconds in [0.05, 0.2, 1.0] {
        let mut scene = blurred(5);
        scene.render.budget = Budget::Seconds(seconds);
        let reads = AtomicU64::new(0);
        let clock = || reads.fetch_add(1, Ordering::Relaxed) as f64 * 1e-4;
        let execution = Execution { threads: Some(1), clock: Some(&clock), ..Execution::default() };
        let (picture, _) = render(&scene, execution).unwrap();
        let read = reads.load(Ordering::Relaxed) as f64 * 1e-4;
        println!("{seconds} s: {read} s, {} samples", picture.samples().mean());
        assert!(read <= (1.05 * seconds).max(seconds + 0.05), "{read} s of {seconds}");
        // And used: more time is more samples.
        assert!(seconds < 0.1 || read >= 0.9 * seconds, "{read} s of {seconds}");
        assert!(picture.samples().mean() > before, "{} samples in {seconds} s", picture.samples().mean());
        before = picture.samples().mean();
        assert!(picture.rms_error().is_some_and(|error| error > 0.0));
    }
}

/// Half a second goes by before the first sample: one sample of each pixel, begun again, would take that once more.
#[test]
fn what_comes_too_late_is_not_begun_again() {
    let mut scene = blurred(5);
    scene.render.budget = Budget::Seconds(0.3);
    let reads = AtomicU64::new(0);
    let clock = || {
        let read = reads.fetch_add(1, Ordering::Relaxed) as f64;
        0.1 * read.min(5.0) + 1e-5 * read
    };
    let execution = Execution { threads: Some(1), clock: Some(&clock), ..Execution::default() };
    let (picture, _) = render(&scene, execution).unwrap();
    assert_eq!(picture.samples().mean(), 16.0);
    assert!(picture.rms_error().is_some());
}

#[test]
fn the_map_of_errors_adds_up_to_the_stated_one() {
    for budget in [Budget::Samples(24), Budget::MaxError(0.01)] {
        let mut scene = blurred(1);
        scene.render.budget = budget;
        let (picture, _) = render(&scene, Execution { error_map: true, ..Execution::default() }).unwrap();
        let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
        let squares: Vec<f64> =
            pixels.map(|(x, y)| square(picture.pixel_error(x, y).unwrap().into())).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((rms / picture.rms_error().unwrap() - 1.0).abs() < 1e-5);
    }
}

/// A flat surface that covers the right half of a flat sky: only pixels that its slanting edge goes through are uncertain.
#[test]
fn the_map_of_errors_has_them_where_they_are() {
    let setting = Setting { front: [0.0; 2], rear: [0.0; 2], f_number: 0.0, stretch: 1.0, rise: 0.0 };
    let camera = camera(DVec3::ZERO, DVec3::NEG_Z, 150.0, setting);
    let mut surfaces = Surfaces { materials: vec![plain([0.8, 0.5, 0.2])], ..Default::default() };
    let corners = [(0.3, -9.0), (9.0, -9.0), (9.0, 9.0), (0.9, 9.0)].map(|(x, y)| DVec3::new(x, y, -10.0));
    quad(&mut surfaces, corners, 1.0, 0);
    for samples in [16, 64, 65] {
        let mut scene = scene(&camera, surfaces.clone(), 90, samples);
        scene.sky.zenith = scene.sky.horizon;
        let (picture, _) = render(&scene, Execution { error_map: true, ..Execution::default() }).unwrap();
        let (width, height) = (picture.width(), picture.height());
        let flat = [picture.pixel(0, 0), picture.pixel(width - 1, 0)];
        assert_ne!(flat[0], flat[1]);
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        let (mut mixed, mut uncertain) = (0, 0);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let error = picture.pixel_error(x, y).unwrap();
            let is_mixed = !flat.iter().any(|&flat| near(picture.pixel(x, y), flat));
            assert!(is_mixed || error < 1e-5, "pixel {x},{y} is flat, and wrong by {error}");
            mixed += u32::from(is_mixed);
            uncertain += u32::from(is_mixed && error > 1e-3);
        }
        // Both halves of the samples may have met the surface equally often.
        assert!(mixed > height / 2 && 8 * uncertain > mixed, "{uncertain} of {mixed}");
        let map = picture.error_map();
        let same = |x, y| map.pixel(x, y) == [picture.pixel_error(x, y).unwrap(); 3];
        assert!((0..height).all(|y| (0..width).all(|x| same(x, y))), "the map is of the pixels' errors");
    }
}

/// A lamp of `size` metres, far out of focus, in a dark room.
fn trap(seed: u64, size: f64, lamp: f64) -> Scene {
    trap_before(seed, size, lamp, 0.02)
}

/// The same before a wall of light.
fn trap_before(seed: u64, size: f64, lamp: f64, wall: f64) -> Scene {
    let toml = format!(
        "[camera]\neye_m = [0, 1, 5]\nlook_at_m = [0, 1, 0]\nfocal_length_mm = 300\nf_number = 2.0
film = \"4x5\"\n[focus]\ndistance_m = 1.0\n[[mesh]]\npath = \"lamp.obj\"\n[sky]\nambient = [0, 0, 0]
horizon = [{wall}, {wall}, {wall}]\nzenith = [{wall}, {wall}, {wall}]\n[render]\nwidth = 160\n"
    );
    let obj =
        format!("mtllib l.mtl\nusemtl l\nv -{size} 1 0\nv {size} 1 0\nv 0 {} 0\nf 1 2 3\n", 1.0 + 2.0 * size);
    let mtl = format!("newmtl l\nKd 0 0 0\nKe {lamp} {lamp} {lamp}\n");
    let files = Memory::new().with("lamp.obj", obj.into_bytes()).with("l.mtl", mtl.into_bytes());
    let mut scene =
        parse(&toml, "trap.toml").unwrap().describe().unwrap().load(&files, "".as_ref(), None).unwrap();
    scene.render.seed = seed;
    scene
}

#[test]
fn a_light_that_samples_miss_is_told_and_not_hidden() {
    // A lamp of ten times the size and a hundredth of the brightness is blurred to nearly the same disk, and is met often.
    let mut truth = trap(77, 0.02, 200.0);
    truth.render.budget = Budget::Samples(65_536);
    let truth = draw(&truth);
    for seed in 0..5 {
        let mut scene = trap(seed, 0.002, 20_000.0);
        scene.render.budget = Budget::Samples(4);
        let (picture, counts) = render(&scene, Execution::default()).unwrap();
        let (stated, found) = (picture.rms_error().unwrap(), gap(&picture, &truth));
        println!("seed {seed}: stated {stated:.4}, true {found:.4}, {} blocks", counts.unseen_light);
        assert!(
            counts.unseen_light > 20 && stated > found / 1.5 && stated < 1.5 * found,
            "seed {seed}: {stated} and {found}"
        );
        // Out of reach for the small lamp, and said; for the larger one the first samples would agree that all is dark.
        for (mut scene, can_be_had) in [(scene, false), (trap(seed, 0.02, 200.0), true)] {
            scene.render.budget = Budget::MaxError(0.06);
            let (picture, _) = render(&scene, Execution::default()).unwrap();
            let (stated, found) = (picture.rms_error().unwrap(), gap(&picture, &truth));
            println!("{} samples: stated {stated:.4}, true {found:.4}", picture.samples().mean());
            assert!(stated > found / 1.5 && stated < 1.5 * found, "seed {seed}: {stated} and {found}");
            assert!((stated <= 0.06) == can_be_had && (found <= 0.072) == can_be_had, "seed {seed}: {found}");
        }
    }
}

#[test]
fn a_light_adds_no_more_than_there_is_room_for() {
    for wall in [0.6, 0.9, 1.2] {
        let with = |seed: u64, size: f64, lamp: f64, samples: u32| {
            let mut scene = trap_before(seed, size, lamp, wall);
            scene.render.budget = Budget::Samples(samples);
            render(&scene, Execution { error_map: true, ..Execution::default() }).unwrap()
        };
        let (truth, _) = with(77, 0.02, 200.0, 16_384);
        let (picture, counts) = with(1, 0.002, 20_000.0, 16);
        let (stated, found) = (picture.rms_error().unwrap(), gap(&picture, &truth));
        println!("wall {wall}: stated {stated:.5}, true {found:.5}");
        if wall > 1.0 {
            // All of it is white whether or not the lamp is met.
            assert!(stated < 1e-6 && found < 1e-6 && counts.unseen_light == 0, "{stated} and {found}");
            continue;
        }
        assert!(
            counts.unseen_light > 20 && stated > found / 1.5 && stated < 1.5 * found,
            "{stated} and {found}"
        );
        let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
        let squares: Vec<f64> =
            pixels.map(|(x, y)| square(picture.pixel_error(x, y).unwrap().into())).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((rms / stated - 1.0).abs() < 1e-4, "{rms} and {stated}");
    }
}

#[test]
fn on_the_command_line() {
    let text = format!("{CAMERA}[render]\nwidth = 64\n[[mesh]]\npath = \"t.obj\"\n");
    let (_keep, folder) = folder(&text);
    let folder = folder.as_path();
    let stats = || -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.join("s.json")).unwrap()).unwrap()
    };
    let words = |more: &[&'static str]| [&["render", "scene.toml", "--stats", "s.json"][..], more].concat();
    run(folder, &words(&["-o", "a.png", "--max-error", "0.01", "--error-map", "e.exr"])).expect(0, &[]);
    assert!(stats()["estimated_rms_error"].as_f64().unwrap() <= 0.01 && folder.join("e.exr").exists());
    run(folder, &words(&["-o", "b.png", "--time-budget", "300ms"])).expect(0, &[]);
    let found = stats();
    // (It is no bound on a machine that does something else meanwhile.)
    let seconds = |key: &str| found[key].as_f64().unwrap();
    assert!(seconds("render_seconds") > 0.15, "{found}");
    assert!(cfg!(not(unix)) || seconds("cpu_seconds") > 0.0, "{found}");
    let asked = |key: &str| found["asked"][key].as_f64();
    assert_eq!(["samples", "max_error", "time_budget"].map(asked), [None, None, Some(0.3)]);
    std::fs::rename(folder.join("s.json"), folder.join("timed.json")).unwrap();
    run(folder, &words(&["-o", "c.png", "--replay", "timed.json"])).expect(0, &[]);
    assert!(std::fs::read(folder.join("b.png")).unwrap() == std::fs::read(folder.join("c.png")).unwrap());
    // Less than all begin with, where there is something to see.
    let mut fewer = found.clone();
    let blocks = |pixels: &str| found[pixels].as_u64().unwrap().div_ceil(8);
    fewer["allocation"] = format!("64: {}x16", blocks("width") * blocks("height")).into();
    std::fs::write(folder.join("fewer.json"), fewer.to_string()).unwrap();
    run(folder, &words(&["-o", "f.png", "--replay", "fewer.json"]))
        .expect(2, &["fewer.json", "allocation", "64 samples"]);
    assert!(!folder.join("f.png").exists());
    fewer["width"] = 40_000.into();
    std::fs::write(folder.join("fewer.json"), fewer.to_string()).unwrap();
    run(folder, &words(&["-o", "f.png", "--replay", "fewer.json"])).expect(2, &["fewer.json: width"]);
    // From another version the same bytes are not promised.
    let old = std::fs::read_to_string(folder.join("timed.json")).unwrap();
    std::fs::write(folder.join("old.json"), old.replace(env!("CARGO_PKG_VERSION"), "0.0.1")).unwrap();
    run(folder, &words(&["-o", "c.png", "--replay", "old.json"]))
        .expect(0, &["old.json", "groundglass 0.0.1"]);
    let told = run(folder, &words(&["-o", "c.png", "--replay", "timed.json"]));
    assert!(!told.err.contains("version"), "{}", told.err);
    // What effects it has, by flags or by the error, needs not be said again.
    let flags = ["-o", "f.png", "--without", "defocus", "--all-effects", "--max-error", "0.004"];
    run(folder, &words(&flags)).expect(0, &[]);
    std::fs::rename(folder.join("s.json"), folder.join("flags.json")).unwrap();
    run(folder, &words(&["-o", "g.png", "--replay", "flags.json"])).expect(0, &[]);
    assert!(std::fs::read(folder.join("f.png")).unwrap() == std::fs::read(folder.join("g.png")).unwrap());
    assert_eq!(stats()["asked"]["max_error"].as_f64(), Some(0.004));
    run(folder, &words(&["-o", "g.png", "--replay", "flags.json", "--with", "falloff"]))
        .expect(64, &["--all-effects", "--with falloff"]);
    // The same from the scene's own keys.
    std::fs::write(folder.join("keys.toml"), text.replace("[render]", "[render]\nmax_error = 0.01")).unwrap();
    run(folder, &["render", "keys.toml", "-o", "k.png"]).expect(0, &[]);
    assert!(std::fs::read(folder.join("a.png")).unwrap() == std::fs::read(folder.join("k.png")).unwrap());

    std::fs::write(folder.join("other.toml"), text.replace("5.6", "8")).unwrap();
    run(folder, &["render", "other.toml", "-o", "d.png", "--replay", "timed.json"])
        .expect(2, &["timed.json", "another scene"]);
    run(folder, &["render", "scene.toml", "-o", "d.png", "--replay", "scene.toml"]).expect(2, &["--stats"]);
    for wrong in [["--max-error", "0"], ["--max-error", "nan"], ["--time-budget", "0s"]] {
        run(folder, &[&["render", "scene.toml", "-o", "d.png"][..], &wrong].concat()).expect(64, &[wrong[0]]);
    }
    run(folder, &words(&["--max-error", "0.1", "--time-budget", "1s"])).expect(64, &["cannot be used with"]);
    run(folder, &words(&["-o", "d.png", "--samples", "1", "--error-map", "e.png"]))
        .expect(64, &["2 samples"]);
    run(folder, &words(&["-o", "s.json"])).expect(64, &["ends in .png"]);
    run(folder, &words(&["-o", "a.exr", "--error-map", "a.exr"])).expect(64, &["--error-map", "one file"]);
    assert!(!folder.join("d.png").exists());
}

/// As PNG the errors are brightened, and the file says by how much.
#[test]
fn a_map_of_errors_tells_by_how_much_it_is_brightened() {
    // A flat triangle whose edges lie across the picture: errors there, and none elsewhere.
    let (_keep, folder) = folder(&format!("{CAMERA}[render]\nwidth = 64\n[[mesh]]\npath = \"t.obj\"\n"));
    let folder = folder.as_path();
    for map in ["e.png", "e.exr"] {
        let words = ["render", "scene.toml", "-o", "a.png", "--samples", "16", "--error-map", map];
        run(folder, &words).expect(0, &[]);
    }
    let note = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let found = text.split("RMS error of each pixel, linear light from 0 to 1").nth(1);
        found.unwrap_or_else(|| panic!("{name} does not say what it is")).to_owned()
    };
    let said = note("e.png");
    let gain: f64 = said.strip_prefix(", times ").unwrap().split(',').next().unwrap().parse().unwrap();
    assert!(!note("e.exr").starts_with(','));
    // Channels by name: B, G, R.
    let exact = exr::prelude::read_first_flat_layer_from_file(folder.join("e.exr")).unwrap();
    let exact: Vec<Vec<f32>> =
        exact.layer_data.channel_data.list.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    let shown = image::open(folder.join("e.png")).unwrap().to_rgb8();
    assert_eq!(exact[0].len(), shown.pixels().count());
    let linear = |code: u8| {
        let code = f64::from(code) / 255.0;
        if code <= 0.04045 { code / 12.92 } else { libm::pow((code + 0.055) / 1.055, 2.4) }
    };
    let mut seen = 0;
    for (i, shown) in shown.pixels().enumerate() {
        for (c, shown) in shown.0.into_iter().enumerate() {
            let want = (f64::from(exact[2 - c][i]) * gain).min(1.0);
            // Half of a step at white, where steps are widest.
            assert!((linear(shown) - want).abs() < 0.005, "{want} is shown as {shown}");
            seen += usize::from(want > 0.05);
        }
    }
    assert!(seen > 30, "{seen}");
}

#[test]
fn a_sky_seen_through_a_wide_lens_close_up_does_not_end_a_picture_too_early() {
    // At 1:1 what is far away is out of focus by the whole lens, and all pixels of a tile share their lens points.
    let setting = Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 1.4, stretch: 2.0, rise: 0.0 };
    let camera = camera(DVec3::new(0.0, 0.0, 0.1), DVec3::new(0.0, 0.05, 0.0), 50.0, setting);
    let view = |seed: u64| {
        let mut scene = scene(&camera, Surfaces::default(), 160, 4096);
        scene.render.seed = seed;
        scene
    };
    let (truth, target) = (draw(&view(99)), 0.0004);
    let errors = errors(12, target, view, &truth);
    println!("{errors:.2?} of the error that was asked for");
    let over = errors.iter().filter(|&&error| error > 1.0).count();
    assert!(over <= 1 && errors.iter().all(|&error| error <= 1.2), "{errors:?}");
}
