//! How many samples a second a picture takes: a scene of twenty triangles, and the tower's 47 thousand.
//! Loading is left out.
//!
//! `cargo bench --bench render -- --quick`

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use groundglass::scene::{Budget, Memory, parse};
use groundglass::{Execution, Scene, render};
use std::path::Path;

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

fn tower() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tower.toml");
    Scene::read(path).expect("the tower")
}

fn pictures(c: &mut Criterion) {
    let mut group = c.benchmark_group("render");
    group.sample_size(10);
    for (name, mut scene) in [("few triangles", few()), ("tower", tower())] {
        let height = 240 * scene.render.height / scene.render.width;
        (scene.render.width, scene.render.height) = (240, height);
        scene.render.budget = Budget::Samples(64);
        for threads in [Some(1), None] {
            group.throughput(Throughput::Elements(240 * u64::from(height) * 64));
            let label = if threads.is_some() { "one thread" } else { "all threads" };
            group.bench_function(format!("{name}, {label}"), |b| {
                b.iter(|| render(&scene, Execution { threads, ..Execution::default() }));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, pictures);
criterion_main!(benches);
