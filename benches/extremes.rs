//! Inputs that are extreme in one way each, beside an ordinary one with as many triangles: samples a second.
//!
//! `cargo bench --bench extremes -- --quick`

#[path = "../tests/common/mod.rs"]
mod common;

use common::extremes::{Extreme, loose};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use groundglass::camera::{Aperture, Camera};
use groundglass::optics::Optics;
use groundglass::quantity::{FNumber, Length};
use groundglass::scene::Budget;
use groundglass::{Execution, Scene, render};

const TRIANGLES: usize = 100_000;
const WIDTH: u32 = 640;
const SAMPLES: u32 = 64;

/// The tower of the examples, and as it is seen through f/0.5 with nothing in focus.
fn tower(is_blurred: bool) -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tower.toml");
    let mut scene = Scene::read(path).expect("the tower");
    scene.render.budget = Budget::Samples(SAMPLES);
    if is_blurred {
        let own = *scene.optics.camera();
        // A third farther from the lens: the plane of focus comes nearer than anything that stands there.
        let blurred = Camera {
            aperture: Aperture::FNumber(FNumber::new(0.5).expect("an f-number")),
            extension: Length::metres(1.3 * own.extension.as_metres()),
            ..own
        };
        scene.optics = Optics::new(&blurred).expect("a camera");
    }
    scene
}

fn extremes(c: &mut Criterion) {
    let mut group = c.benchmark_group("extreme");
    group.sample_size(10);
    let made = Extreme::ALL.map(|extreme| {
        let triangles = if extreme == Extreme::Dust { 10 * TRIANGLES } else { TRIANGLES };
        (format!("{extreme:?}"), extreme.scene(triangles, WIDTH, SAMPLES))
    });
    let heap = ("a heap, blurred".to_owned(), loose(TRIANGLES, WIDTH, SAMPLES, [0.0; 2]));
    for (name, mut scene) in made.into_iter().chain([heap]) {
        // As a scene file would give it.
        scene.surfaces.find_patches();
        scene.surfaces.find_clusters();
        scene.render.share_shading = true;
        let pixels = u64::from(scene.render.width) * u64::from(scene.render.height);
        group.throughput(Throughput::Elements(pixels * u64::from(SAMPLES)));
        group.bench_function(name, |b| b.iter(|| render(&scene, Execution::default())));
    }
    for (name, is_blurred) in [("tower", false), ("tower, blurred", true)] {
        let scene = tower(is_blurred);
        let pixels = u64::from(scene.render.width) * u64::from(scene.render.height);
        group.throughput(Throughput::Elements(pixels * u64::from(SAMPLES)));
        group.bench_function(name, |b| b.iter(|| render(&scene, Execution::default())));
    }
    group.finish();
}

criterion_group!(benches, extremes);
criterion_main!(benches);
