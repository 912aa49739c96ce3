//! Every generated scene reads, and its camera, solved by the contract's formulas, has the box in the frame.

use super::*;
use crate::camera::Camera;
use crate::optics::FocusTarget;
use crate::scene::parse;

fn quad(corners: [DVec3; 4]) -> [[DVec3; 3]; 2] {
    let [a, b, c, d] = corners;
    [[a, b, c], [a, c, d]]
}

/// The sides of a box, facing outward, without the sides in `open`.
fn hollow(lo: DVec3, hi: DVec3, open: &[(usize, usize)]) -> Vec<[DVec3; 3]> {
    let mut out = Vec::new();
    for axis in 0..3 {
        for side in 0..2 {
            if open.contains(&(axis, side)) {
                continue;
            }
            let corner = |s: usize, t: usize| {
                let mut p = if side == 0 { lo } else { hi };
                p[(axis + 1) % 3] = if s == 0 { lo } else { hi }[(axis + 1) % 3];
                p[(axis + 2) % 3] = if t == 0 { lo } else { hi }[(axis + 2) % 3];
                p
            };
            let mut corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if side == 0 {
                corners.reverse();
            }
            out.extend(quad(corners));
        }
    }
    out
}

fn inward(triangles: Vec<[DVec3; 3]>) -> Vec<[DVec3; 3]> {
    triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}

fn scene(triangles: &[[DVec3; 3]]) -> (String, crate::scene::SceneDescription) {
    let text = scene_for(&measure(triangles.iter().copied()).unwrap(), "a b/model.obj");
    let scene =
        parse(&text, "new.toml").and_then(|file| file.describe()).unwrap_or_else(|e| panic!("{e}\n{text}"));
    (text, scene)
}

/// Extension for the wanted plane, lens adjusted: the contract's inverse with n fixed.
fn extension(camera: &Camera, target: &FocusTarget) -> f64 {
    let FocusTarget::Plane { point, normal } = target else { panic!("no plane") };
    let n = camera.film_frame().axes.z_axis;
    let (m, f) = (*normal, camera.focal_length.as_metres());
    let g = -m.dot(*point - camera.lens_frame().origin);
    let (a, b) = (m.length_squared() - g * g / (f * f), n.dot(m));
    let root = (b * b - a).sqrt();
    assert!(root.is_finite(), "the hinge is nearer than f");
    [(b + root) / a, (b - root) / a]
        .into_iter()
        .filter(|k| k * g < 0.0)
        .filter(|k| ((n - m * *k) * (f / (k * g))).dot(n) < 0.0)
        .map(|k| -k * g)
        .next()
        .expect("a real image")
}

fn assert_in_frame(text: &str, scene: &crate::scene::SceneDescription, lo: DVec3, hi: DVec3) {
    let camera = &scene.camera;
    let extension = extension(camera, &scene.focus.as_ref().unwrap().target);
    let (rail, scale) = (camera.rail, scene.meshes[0].scale);
    let mut largest: f64 = 0.0;
    for corner in 0..8 {
        let pick = |bit: usize| if corner >> bit & 1 == 0 { lo } else { hi }[bit];
        let p = DVec3::new(pick(0), pick(1), pick(2)) * scale;
        let p = rail.axes.transpose() * (p - rail.origin);
        assert!(-p.z > camera.near.as_metres(), "near cuts the model\n{text}");
        let half = extension / -p.z * 2.0;
        largest = largest.max((p.x * half / 0.120).abs()).max((p.y * half / 0.096).abs());
    }
    assert!(largest <= 1.0, "a corner is outside the frame: {largest}\n{text}");
    assert!(largest > 0.4, "the model is small in the frame: {largest}\n{text}");
}

#[test]
fn objects_of_every_size_and_shape_are_in_the_frame() {
    for size in [1e-9, 0.01, 0.3, 1.0, 30.0, 320.0, 3700.0, 5e6, 1e15] {
        for shape in
            [DVec3::ONE, DVec3::new(1.0, 0.05, 1.0), DVec3::new(0.1, 1.0, 0.1), DVec3::new(1.0, 0.3, 0.01)]
        {
            let (lo, hi) = (shape * size * -0.25, shape * size * 0.75);
            let (text, scene) = scene(&hollow(lo, hi, &[]));
            assert_in_frame(&text, &scene, lo, hi);
            // Far from the origin the same.
            let far = DVec3::new(-1e5, 1e5, 3e5) * size;
            let (text, scene) = self::scene(&hollow(lo + far, hi + far, &[]));
            assert_in_frame(&text, &scene, lo + far, hi + far);
        }
    }
}

#[test]
fn large_units_are_scaled_and_the_file_says_so() {
    let (text, scene) = scene(&hollow(DVec3::ZERO, DVec3::splat(556.0), &[]));
    assert_eq!(scene.meshes[0].scale, 0.001);
    assert!(text.contains("the model is 556.0 units large; so small, its blur shows"), "{text}");
    let (text, scene) = self::scene(&hollow(DVec3::ZERO, DVec3::splat(0.6), &[]));
    assert_eq!(scene.meshes[0].scale, 1.0);
    assert!(text.contains("taken as metres"), "{text}");
}

#[test]
fn a_room_open_on_one_side_is_looked_into() {
    let (lo, hi) = (DVec3::ZERO, DVec3::new(556.0, 548.0, 559.0));
    for open in [(2, 1), (2, 0), (0, 1), (0, 0)] {
        let (text, scene) = scene(&inward(hollow(lo, hi, &[open])));
        assert_in_frame(&text, &scene, lo, hi);
        let eye = scene.camera.rail.origin / scene.meshes[0].scale;
        let outside = if open.1 == 1 { eye[open.0] > hi[open.0] } else { eye[open.0] < lo[open.0] };
        assert!(outside, "{text}");
    }
}

#[test]
fn a_closed_room_is_seen_from_inside() {
    let (lo, hi) = (DVec3::new(-19.0, -1.0, -12.0), DVec3::new(18.0, 14.0, 11.0));
    let (text, scene) = scene(&inward(hollow(lo, hi, &[])));
    let eye = scene.camera.rail.origin;
    assert!(eye.cmpgt(lo).all() && eye.cmplt(hi).all(), "{text}");
    assert!(text.contains("the floor"), "{text}");
    extension(&scene.camera, &scene.focus.unwrap().target);
}

#[test]
fn degenerate_statistics_still_give_a_scene() {
    assert!(measure(std::iter::empty()).is_none());
    assert!(measure(std::iter::once([DVec3::NAN; 3])).is_none());
    for bounds in [
        [DVec3::ZERO, DVec3::ZERO],
        [DVec3::ONE * 7.0; 2],
        [DVec3::NAN; 2],
        [DVec3::ZERO, DVec3::INFINITY],
        [DVec3::ZERO, DVec3::Y],
        [DVec3::ZERO, DVec3::splat(1e-40)],
    ] {
        for path in ["m.obj", "it's \"odd\"\\x.obj", "é.obj"] {
            let text = scene_for(&Statistics { bounds, ..Statistics::default() }, path);
            let scene = parse(&text, "new.toml").and_then(|file| file.describe());
            assert_eq!(scene.unwrap_or_else(|e| panic!("{e}\n{text}")).meshes[0].path, path);
        }
    }
}

#[test]
fn what_stands_on_the_ground_fills_the_frame_and_the_ground_is_sharp() {
    let plan = DVec3::new(160.0, 0.0, 160.0);
    let ground = quad([-plan, DVec3::new(-160.0, 0.0, 160.0), plan, DVec3::new(160.0, 0.0, -160.0)]);
    let (lo, hi) = (DVec3::new(-20.0, 0.0, -30.0), DVec3::new(20.0, 15.0, 10.0));
    let all: Vec<_> = ground.into_iter().chain(hollow(lo, hi, &[])).collect();
    let statistics = measure(all.iter().copied()).unwrap();
    assert_eq!(statistics.ground, Some(0.0));
    let (text, scene) = scene(&all);
    assert_in_frame(&text, &scene, lo, hi);
    let Some(FocusTarget::Plane { point, normal }) = scene.focus.map(|focus| focus.target) else {
        panic!("no plane\n{text}")
    };
    assert_eq!((point.y, normal), (0.0, DVec3::Y), "{text}");
}

#[test]
fn a_flat_model_is_faced_and_sharp() {
    for corners in [
        [DVec3::ZERO, DVec3::X, DVec3::Y],
        [DVec3::ZERO, DVec3::Y, DVec3::X],
        [DVec3::ZERO, DVec3::Y, DVec3::Z],
        [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0)],
    ] {
        let (text, scene) = scene(&[corners]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let rail = scene.camera.rail;
        assert!((rail.axes.z_axis.dot(normal)).abs() > 0.5, "seen edge-on\n{text}");
        let Some(FocusTarget::Plane { normal: sharp, .. }) = scene.focus.as_ref().map(|focus| focus.target)
        else {
            panic!("no plane\n{text}")
        };
        assert!(sharp.cross(normal).length() < 1e-4, "{text}");
        assert!(scene.solve().is_ok(), "{text}");
    }
}

#[test]
fn thin_models_are_faced_whichever_way_their_faces_look() {
    let corners = [DVec3::ZERO, DVec3::Y, DVec3::new(0.0, 1.0, 1.0), DVec3::Z];
    let one = quad(corners);
    let two: Vec<_> = one.iter().copied().chain(inward(one.to_vec())).collect();
    let slab = hollow(DVec3::ZERO, DVec3::new(0.01, 10.0, 10.0), &[]);
    for model in [two, slab] {
        let (text, scene) = scene(&model);
        assert!(scene.camera.rail.axes.z_axis.x.abs() > 0.5, "seen edge-on\n{text}");
    }
    // Two walls, a room's width apart, are no sheet; a floor and a ceiling too near for a man are no room.
    let walls = hollow(DVec3::ZERO, DVec3::new(4.0, 10.0, 10.0), &[(1, 0), (1, 1), (2, 0), (2, 1)]);
    assert!(measure(walls.iter().copied()).unwrap().sheet.is_none());
    let low = [DVec3::ZERO, DVec3::new(6.0, 0.1, 8.0)];
    let (text, scene) = scene(&inward(hollow(low[0], low[1], &[])));
    let eye = scene.camera.rail.origin;
    assert!(eye.y > 0.1, "inside\n{text}");
}
