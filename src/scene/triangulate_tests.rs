//! The triangles' areas add up to the polygon's, and no triangle lies the wrong way round.

use std::time::Instant;

use super::*;
use crate::random::Random;

/// Seen from the tip of its normal: number of triangles, their total area, the sum of their absolute areas.
fn cut(corners: &[DVec3]) -> (usize, f64, f64) {
    let mut work = WORK_PER_FILE;
    let (mut count, mut sum, mut absolute) = (0, DVec3::ZERO, 0.0);
    triangulate(corners, &mut work, |[a, b, c]| {
        let area = 0.5 * (corners[b] - corners[a]).cross(corners[c] - corners[a]);
        count += 1;
        sum += area;
        absolute += area.length();
    });
    (count, sum.length(), absolute)
}

fn check(name: &str, corners: &[DVec3], area: f64) {
    let (count, sum, absolute) = cut(corners);
    assert_eq!(count, corners.len() - 2, "{name}");
    assert!((sum - area).abs() <= 1e-9 * area, "{name}: {sum} for {area}");
    assert!((absolute - area).abs() <= 1e-9 * area, "{name}: overlaps, {absolute} for {area}");
}

/// The polygon in all its turns and both directions, in a tilted plane far from the origin.
fn check_all(name: &str, flat: &[[f64; 2]], area: f64) {
    let (u, v) = (DVec3::new(0.36, 0.48, -0.8), DVec3::new(-0.8, 0.6, 0.0));
    let mut corners: Vec<DVec3> =
        flat.iter().map(|p| DVec3::new(1e3, -2e3, 5e2) + u * p[0] + v * p[1]).collect();
    for _ in 0..2 {
        for _ in 0..corners.len().min(40) {
            corners.rotate_left(1);
            check(name, &corners, area);
        }
        corners.reverse();
    }
}

/// Teeth of width 1 and height `height` over a back of height 1.
fn comb(teeth: usize, height: f64) -> (Vec<[f64; 2]>, f64) {
    let width = (2 * teeth - 1) as f64;
    let mut flat = vec![[0.0, 0.0], [width, 0.0]];
    for tooth in (0..teeth).rev() {
        let x = 2.0 * tooth as f64;
        flat.extend([[x + 1.0, 1.0 + height], [x, 1.0 + height]]);
        if tooth > 0 {
            flat.extend([[x, 1.0], [x - 1.0, 1.0]]);
        }
    }
    (flat, width + height * teeth as f64)
}

#[test]
fn concave_polygons_keep_their_area() {
    check_all("L", &[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]], 5.0);
    check_all("dart", &[[0., 0.], [2., 1.], [0., 2.], [0.5, 1.]], 1.5);
    let bridge =
        [[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.], [1., 1.], [1., 3.], [3., 3.], [3., 1.], [1., 1.]];
    check_all("ring", &bridge, 12.0);
    let (flat, area) = comb(6, 3.0);
    check_all("comb", &flat, area);
    let collinear =
        [[0., 0.], [1., 0.], [2., 0.], [3., 0.], [3., 1.], [3., 2.], [1., 2.], [1., 1.], [0., 1.]];
    check_all("collinear", &collinear, 5.0);
    let (_, _, absolute) = cut(&[DVec3::ZERO, DVec3::X, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y, DVec3::Y]);
    assert!((absolute - 1.0).abs() < 1e-12, "repeated corners");
}

#[test]
fn repeated_corners_and_spikes_change_no_area() {
    let l = [[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]];
    let u = [[0., 0.], [5., 0.], [5., 4.], [4., 4.], [4., 1.], [1., 1.], [1., 4.], [0., 4.]];
    for (name, flat, area) in [("L", &l[..], 5.0), ("U", &u[..], 11.0)] {
        for times in [2, 3] {
            let all: Vec<[f64; 2]> = flat.iter().flat_map(|&p| std::iter::repeat_n(p, times)).collect();
            check_all(name, &all, area);
        }
        for i in 0..flat.len() {
            let mut one = flat.to_vec();
            one.insert(i, flat[i]);
            check_all(name, &one, area);
            // Out and back again, by way of a corner of its own, and of two.
            one.splice(i..=i, [flat[i], [-3.0, 7.0]]);
            check_all(name, &one, area);
            one.splice(i + 1..=i + 1, [[-3.0, 7.0], [9.0, 9.5], [-3.0, 7.0]]);
            check_all(name, &one, area);
        }
    }
}

#[test]
fn random_star_shaped_polygons_keep_their_area() {
    let mut numbers = Random(1);
    let mut random = || numbers.unit();
    for k in 4..60 {
        let mut angles: Vec<f64> = (0..k).map(|i| (i as f64 + 0.9 * random()) / k as f64).collect();
        angles.sort_by(f64::total_cmp);
        let flat: Vec<[f64; 2]> = angles
            .iter()
            .map(|t| t * std::f64::consts::TAU)
            .map(|t| (t, 0.1 + random()))
            .map(|(t, r)| [r * libm::cos(t), r * libm::sin(t)])
            .collect();
        let area: f64 = (0..k)
            .map(|i| (flat[i], flat[(i + 1) % k]))
            .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
            .sum();
        check_all("star", &flat, area);
    }
}

#[test]
fn degenerate_and_crossing_polygons_give_their_count() {
    let point = vec![DVec3::splat(7.0); 9];
    let line: Vec<DVec3> = (0..50).map(|i| DVec3::new(f64::from(i * i % 17), 0.0, 0.0)).collect();
    let huge =
        [DVec3::ZERO, DVec3::X * 1e308, DVec3::new(-1e308, 1e308, 0.0), DVec3::Y * -1e308, DVec3::Y * 1e307];
    let tiny: Vec<DVec3> = huge.iter().map(|p| (*p * 1e-308) * 1e-310).collect();
    let bow = [DVec3::ZERO, DVec3::ONE, DVec3::X, DVec3::Y];
    for corners in [&point[..], &line, &huge, &tiny, &bow] {
        assert_eq!(cut(corners).0, corners.len() - 2);
    }
}

#[test]
fn twenty_thousand_corners_take_bounded_work() {
    let (teeth, area) = comb(5000, 30.0);
    let teeth: Vec<DVec3> = teeth.iter().map(|p| DVec3::new(p[0], 0.0, p[1])).collect();
    // A spiral band: out along one side, back along the other.
    let arm = |i: usize, w: f64| {
        let t = i as f64 * 0.01;
        DVec3::new((1.0 + t + w) * libm::cos(t), (1.0 + t + w) * libm::sin(t), 0.0)
    };
    let spiral: Vec<DVec3> =
        (0..10000).map(|i| arm(i, 0.0)).chain((0..10000).rev().map(|i| arm(i, 3.0))).collect();
    let tangle: Vec<DVec3> = (0..20000u64)
        .map(|i| DVec3::new((i * 7919 % 20011) as f64, (i * 104729 % 19997) as f64, 0.0))
        .collect();
    let begun = Instant::now();
    check("teeth", &teeth, area);
    println!("teeth {:?}", begun.elapsed());
    let (count, sum, absolute) = cut(&spiral);
    println!("spiral {:?}", begun.elapsed());
    assert!(count == 19998 && (sum - absolute).abs() < 1e-9 * sum, "{sum} {absolute}");
    assert_eq!(cut(&tangle).0, 19998);
    println!("tangle {:?}", begun.elapsed());
}
