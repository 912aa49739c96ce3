//! The same world elsewhere or of another size: the picture must be the same.

use super::common::scenes::{Random, Setting, camera, scene, yard};
use glam::DVec3;
use groundglass::camera::{Camera, FilmSize, Standard};
use groundglass::quantity::Length;
use groundglass::render::{Execution, render};
use groundglass::scene::Surfaces;

const EYE: DVec3 = DVec3::new(0.3125, 1.1875, 2.5);
const LOOK_AT: DVec3 = DVec3::new(0.0, 0.875, -3.0);

fn setting() -> Setting {
    Setting { front: [6.0, -3.0], rear: [0.0, 4.0], f_number: 2.8, stretch: 1.02, rise: 8.0 }
}

fn world() -> Surfaces {
    yard(&mut Random(12), 200)
}

fn picture(camera: &Camera, surfaces: Surfaces) -> Vec<[f32; 3]> {
    let scene = scene(camera, surfaces, 240, 64);
    let (picture, _) = render(&scene, Execution::default()).unwrap();
    (0..scene.render.height)
        .flat_map(|y| (0..240).map(move |x| (x, y)))
        .map(|(x, y)| picture.pixel(x, y))
        .collect()
}

/// Everything times `k`, the camera included.
fn scaled(k: f64) -> Vec<[f32; 3]> {
    let base = camera(EYE * k, LOOK_AT * k, 150.0, setting());
    let length = |l: Length| Length::metres(l.as_metres() * k);
    let standard = |s: Standard| Standard { rise: length(s.rise), shift: length(s.shift), ..s };
    let camera = Camera {
        front: standard(base.front),
        rear: standard(base.rear),
        extension: length(base.extension),
        focal_length: length(base.focal_length),
        film: FilmSize { width: length(base.film.width), height: length(base.film.height) },
        near: length(base.near),
        ..base
    };
    let mut surfaces = world();
    surfaces.positions.iter_mut().for_each(|p| *p *= k);
    picture(&camera, surfaces)
}

/// Everything moved.
fn moved(by: DVec3, round: bool) -> Vec<[f32; 3]> {
    let mut surfaces = world();
    for p in &mut surfaces.positions {
        if round {
            // To 2^-30 m, so that moving loses nothing.
            *p = (*p * 1_073_741_824.0).round() / 1_073_741_824.0;
        }
        *p += by;
    }
    picture(&camera(EYE + by, LOOK_AT + by, 150.0, setting()), surfaces)
}

/// The share of pixels that differ by more than 1e-5, the largest difference, and the RMS.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> [f64; 3] {
    let gaps =
        || a.iter().zip(b).map(|(a, b)| (0..3).map(|c| f64::from((a[c] - b[c]).abs())).fold(0.0, f64::max));
    let count = a.len() as f64;
    let square: f64 = gaps().map(|g| g * g).sum();
    [gaps().filter(|&g| g > 1e-5).count() as f64 / count, gaps().fold(0.0, f64::max), (square / count).sqrt()]
}

#[test]
fn moving_the_world_by_a_million_metres_changes_nothing() {
    let far = DVec3::new(1e6, -1e6, 1e6);
    let exact = difference(&moved(DVec3::ZERO, true), &moved(far, true));
    let [share, largest, rms] = difference(&moved(DVec3::ZERO, false), &moved(far, false));
    println!(
        "moved by 1e6 m: coordinates kept {exact:?}; rounded to 1e-10 m {share:.1e} of pixels, at most {largest:.1e}, RMS {rms:.1e}"
    );
    // Only the lens centre, which stands beside the eye, was rounded: an ulp of single precision.
    assert!(exact[1] <= f64::from(f32::EPSILON), "{exact:?}");
    assert!(share <= 1e-3 && rms <= 1e-4);
}

#[test]
fn scaling_the_world_and_the_camera_changes_nothing() {
    let one = scaled(1.0);
    for k in [1.0 / 1024.0, 1024.0, 1e-3, 1e3] {
        let [share, largest, rms] = difference(&one, &scaled(k));
        println!("scaled by {k}: {share:.1e} of pixels, at most {largest:.1e}, RMS {rms:.1e}");
        assert!(share <= 1e-3 && rms <= 1e-4, "{k}");
    }
}
