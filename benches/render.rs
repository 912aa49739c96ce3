//! How fast a scene is loaded, each stage of a picture passes, and whole pictures are made: a scene of twenty
//! triangles, and the tower's 47 thousand.
//!
//! Stages are not seen from outside; they are timed as `render --stats` does it, by the clock that is lent to
//! [`render`]: what criterion is told are the times that they took of a dozen whole pictures, over and over, so its
//! statistics are those of twelve numbers. (Timed anew each time, a stage that is a hundredth of a picture would take a hundred
//! times as long to bench.) Each has its own unit: vertices, triangles, entries of bins, samples, groups of samples or pixels
//! a second.
//!
//! `cargo bench --bench render -- --quick`

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use groundglass::camera::{Aperture, Camera};
use groundglass::optics::Optics;
use groundglass::plan::RenderPlan;
use groundglass::quantity::{Angle, FNumber};
use groundglass::render::Stages;
use groundglass::scene::{Blades, Budget, EffectName, Memory, parse};
use groundglass::{Execution, Scene, render};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A ground and three boxes without their undersides, in a tilted plane of focus.
const FEW: &str = r#"
[camera]
eye_m = [0.35, 0.5, 0.9]
look_at_m = [0.0, 0.02, 0.0]
focal_length_mm = 150
f_number = 2.8
film = "4x5"
[focus]
plane = { point_m = [0, 0, 0], normal = [0, 1, 0] }
[[mesh]]
path = "few.obj"
[sun]
toward = [-0.5, 1.0, 0.6]
color = [0.7, 0.7, 0.65]
"#;

fn few() -> Scene {
    let mut obj = String::from("v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nf 1 2 3 4\n");
    for k in -1..2 {
        let (x, z, s) = (f64::from(k) * 0.12, f64::from(k) * -0.25, 0.05);
        for y in [0.0, 0.1] {
            for (dx, dz) in [(-s, s), (s, s), (s, -s), (-s, -s)] {
                obj.push_str(&format!("v {} {y} {}\n", x + dx, z + dz));
            }
        }
        // Front, right, top.
        obj.push_str("f -8 -7 -3 -4\nf -7 -6 -2 -3\nf -4 -3 -2 -1\n");
    }
    let source = Memory::new().with("few.obj", obj.into_bytes());
    let description = parse(FEW, "few.toml").and_then(|file| file.describe()).expect("a scene");
    description.load(&source, Path::new(""), None).expect("a model")
}

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

fn tower() -> Scene {
    Scene::read(examples().join("tower.toml")).expect("the tower")
}

/// The scene at `width` with 64 samples a pixel, and how many pixels it has.
fn sized(mut scene: Scene, width: u32) -> (Scene, u64) {
    let height = width * scene.render.height / scene.render.width;
    (scene.render.width, scene.render.height) = (width, height);
    scene.render.budget = Budget::Samples(64);
    (scene, u64::from(width) * u64::from(height))
}

fn loading(c: &mut Criterion) {
    let size = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.and_then(|entry| entry.metadata()).map_or(0, |m| m.len())
    };
    let bytes = std::fs::read_dir(examples().join("tower")).expect("the tower's files").map(size).sum();
    let mut group = c.benchmark_group("loading");
    group.sample_size(10).throughput(Throughput::Bytes(bytes));
    group.bench_function("tower", |b| b.iter(tower));
    group.finish();
}

fn stages(c: &mut Criterion) {
    let (scene, pixels) = sized(tower(), 480);
    let start = Instant::now();
    let clock = move || start.elapsed().as_secs_f64();
    let picture = || {
        let execution = Execution { threads: Some(1), clock: Some(&clock), ..Execution::default() };
        render(&scene, execution).expect("a picture").1
    };
    let pictures: Vec<_> = (0..12).map(|_| picture()).collect();
    let counts = &pictures[0];
    let (vertices, triangles) = (scene.surfaces.positions.len() as u64, counts.triangles as u64);
    type Stage = fn(&Stages) -> f64;
    let stages: [(&str, Stage, u64); 7] = [
        ("transform, vertices", |s| s.transform, vertices),
        ("bin, triangles", |s| s.bin, triangles),
        ("set-up, bin entries", |s| s.setup, counts.bin_entries as u64),
        ("coverage, samples", |s| s.coverage, counts.samples),
        ("group, samples", |s| s.group, counts.samples),
        ("shading, requests", |s| s.shading, counts.shading_requests),
        ("resolve, pixels", |s| s.resolve, pixels),
    ];
    let mut group = c.benchmark_group("stages");
    group.sample_size(10);
    for (name, seconds, units) in stages {
        group.throughput(Throughput::Elements(units));
        group.bench_function(name, |b| {
            let mut next = pictures.iter().cycle().map(|counts| seconds(&counts.stages));
            b.iter_custom(|times| Duration::from_secs_f64(next.by_ref().take(times as usize).sum()));
        });
    }
    group.finish();
}

fn pictures(c: &mut Criterion) {
    let mut group = c.benchmark_group("pictures");
    group.sample_size(10);
    for (name, scene) in [("few triangles", few()), ("tower", tower())] {
        let (scene, pixels) = sized(scene, 240);
        for threads in [Some(1), None] {
            group.throughput(Throughput::Elements(64 * pixels));
            let label = if threads.is_some() { "one thread" } else { "all threads" };
            group.bench_function(format!("{name}, {label}"), |b| {
                b.iter(|| render(&scene, Execution { threads, ..Execution::default() }));
            });
        }
    }
    group.finish();
}

/// An effect that the scene asks for and the plan leaves out: beside each, the same scene that does not ask for it.
fn left_out(c: &mut Criterion) {
    let (plain, pixels) = sized(tower(), 480);
    let mut bent = plain.clone();
    bent.render.diffraction = true;
    let mut shadowed = plain.clone();
    shadowed.sun.as_mut().expect("the tower's sun").shadows = true;
    shadowed.surfaces.build_hierarchy();
    let mut soft = shadowed.clone();
    soft.sun.as_mut().expect("the tower's sun").angular_diameter = Angle::degrees(0.0001);
    // A lens of a tenth of a millimetre, for which blur, shape and falloff over the lens are small; and a pinhole.
    let small = |aperture: Aperture, blades: Option<Blades>| {
        let mut scene = plain.clone();
        scene.optics = Optics::new(&Camera { aperture, ..*scene.optics.camera() }).expect("a camera");
        scene.blades = blades;
        scene
    };
    let dot = Aperture::FNumber(FNumber::new(2000.0).expect("an f-number"));
    let blades = Blades { count: 5, rotation: Angle::ZERO };
    let mut group = c.benchmark_group("left out");
    group.sample_size(20).throughput(Throughput::Elements(64 * pixels));
    let pairs = [
        (EffectName::Defocus, [small(Aperture::Pinhole, None), small(dot, None)]),
        (EffectName::ApertureShape, [small(dot, None), small(dot, Some(blades))]),
        (EffectName::Diffraction, [plain, bent]),
        (EffectName::SoftShadows, [shadowed, soft]),
    ];
    for (effect, scenes) in pairs {
        for (scene, words) in scenes.iter().zip(["not asked for", "asked for"]) {
            assert!(!RenderPlan::new(scene).active().has(effect));
            group.bench_function(format!("{effect}, {words}"), |b| {
                b.iter(|| render(scene, Execution { threads: Some(1), ..Execution::default() }));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, loading, stages, pictures, left_out);
criterion_main!(benches);
