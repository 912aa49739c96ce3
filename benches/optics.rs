//! How long an answer takes: movements for a plane, the optics of a camera, one projection, one blur.
//!
//! `cargo bench --bench optics -- --quick`

use criterion::{Criterion, criterion_group, criterion_main};
use groundglass::{Adjust, Camera, FocusTarget, Optics, glam::DVec3, solve};
use std::hint::black_box;

fn optics(c: &mut Criterion) {
    let camera = Camera::looking_at(DVec3::new(3.0, 1.6, 10.0), DVec3::new(0.0, 1.2, 0.0)).expect("a camera");
    let ground = FocusTarget::Plane { point: DVec3::ZERO, normal: DVec3::Y };
    // Nearer to the lens than the focal length: the nearest that can be had is searched for.
    let table = FocusTarget::Plane { point: DVec3::new(0.0, 1.5, 0.0), normal: DVec3::Y };
    let solved = solve(&camera, &ground, Adjust::Front).expect("a tilt");
    let optics = Optics::new(&solved).expect("optics");
    let point = DVec3::new(0.4, -1.1, -9.0);

    let mut group = c.benchmark_group("optics");
    group.bench_function("solve front", |b| b.iter(|| solve(black_box(&camera), &ground, Adjust::Front)));
    group.bench_function("solve rear", |b| b.iter(|| solve(black_box(&camera), &ground, Adjust::Rear)));
    group.bench_function("solve, no solution", |b| {
        b.iter(|| solve(black_box(&camera), &table, Adjust::Front));
    });
    group.bench_function("new", |b| b.iter(|| Optics::new(black_box(&solved))));
    group.bench_function("projection", |b| b.iter(|| optics.projection(black_box(0.004), 0.002)));
    group.bench_function("blur of a point", |b| b.iter(|| optics.blur_of(black_box(point))));
    group.finish();
}

criterion_group!(benches, optics);
criterion_main!(benches);
