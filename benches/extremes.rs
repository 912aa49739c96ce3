//! Inputs that are extreme in one way each, beside an ordinary one with as many triangles: samples a second.
//!
//! `cargo bench --bench extremes -- --quick`

#[path = "../tests/common/mod.rs"]
mod common;

use common::extremes::Extreme;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use groundglass::{Execution, render};

const TRIANGLES: usize = 100_000;
const WIDTH: u32 = 640;
const SAMPLES: u32 = 64;

fn extremes(c: &mut Criterion) {
    let mut group = c.benchmark_group("extreme");
    group.sample_size(10);
    for extreme in Extreme::ALL {
        let triangles = if extreme == Extreme::Dust { 10 * TRIANGLES } else { TRIANGLES };
        let mut scene = extreme.scene(triangles, WIDTH, SAMPLES);
        // As a scene file would give it.
        scene.surfaces.find_patches();
        scene.render.share_shading = true;
        let pixels = u64::from(scene.render.width) * u64::from(scene.render.height);
        group.throughput(Throughput::Elements(pixels * u64::from(SAMPLES)));
        group.bench_function(format!("{extreme:?}"), |b| b.iter(|| render(&scene, Execution::default())));
    }
    group.finish();
}

criterion_group!(benches, extremes);
criterion_main!(benches);
