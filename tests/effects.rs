//! Shadows, holes and coverage against what must come out: nothing shades itself, no light leaks, half of half is a quarter.

mod common;

use common::scenes::{Random, Setting, camera, noise, plain, quad, scene};
use glam::{DMat3, DVec3};
use groundglass::camera::Camera;
use groundglass::quantity::Angle;
use groundglass::render::{Execution, SimdLevel, render};
use groundglass::scene::{Level, Scene, Surfaces, Texture};
use std::sync::Arc;

const OPEN: Setting =
    Setting { front: [3.0, -2.0], rear: [0.0, 0.0], f_number: 2.8, stretch: 1.03, rise: 0.0 };

fn pixels(scene: &Scene) -> Vec<[f32; 3]> {
    let (picture, _) = render(scene, Execution::default()).unwrap();
    (0..scene.render.height)
        .flat_map(|y| (0..scene.render.width).map(move |x| (x, y)))
        .map(|(x, y)| picture.pixel(x, y))
        .collect()
}

fn with_sun(mut surfaces: Surfaces, eye: DVec3, target: DVec3, samples: u32, degrees: f64) -> Scene {
    surfaces.build_hierarchy();
    let mut scene = scene(&camera(eye, target, 100.0, OPEN), surfaces, 64, samples);
    scene.render.share_shading = true;
    let sun = scene.sun.as_mut().unwrap();
    (sun.shadows, sun.angular_diameter) = (true, Angle::degrees(degrees));
    scene
}

/// The largest difference between two pictures.
fn gap(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    assert!(a.iter().chain(b).flatten().all(|value| value.is_finite()));
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// A floor of `cells` by `cells` quads, turned about two axes so that no coordinate is round, each quad `times` over.
fn floor(cells: i32, times: usize) -> Surfaces {
    let turn = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(0.7);
    let mut surfaces =
        Surfaces { materials: vec![plain([0.8, 0.7, 0.6]), plain([0.5; 3])], ..Default::default() };
    for i in 0..cells * cells {
        let (x, z) = (f64::from(i % cells - cells / 2), f64::from(i / cells - cells / 2));
        let corner = |dx: f64, dz: f64| turn * (DVec3::new(x + dx, 0.0, z + dz) * 0.37);
        for _ in 0..times {
            quad(
                &mut surfaces,
                [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
                1.0,
                (i % 2) as u32,
            );
        }
    }
    surfaces
}

#[test]
fn a_flat_surface_does_not_shade_itself() {
    // Cells side by side, and lying on one another; the sun high and a tenth of a degree over the floor.
    let turn = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_y(0.7);
    for times in [1, 2] {
        for (height, degrees) in [(1.0, 0.0), (0.002, 0.0), (0.5, 3.0)] {
            for samples in [4, 64] {
                let mut lit = with_sun(
                    floor(40, times),
                    turn * DVec3::new(0.3, 2.0, 4.0),
                    DVec3::ZERO,
                    samples,
                    degrees,
                );
                lit.sun.as_mut().unwrap().toward = (turn * DVec3::new(0.6, height, 0.2)).normalize();
                let shadowed = pixels(&lit);
                lit.sun.as_mut().unwrap().shadows = false;
                let found = gap(&shadowed, &pixels(&lit));
                // A disk's mean over few directions is not its middle's.
                let allowed = if degrees > 0.0 { 0.02 } else { 1e-5 };
                assert!(found < allowed, "{times} times, height {height}, N = {samples}: {found}");
            }
        }
    }
}

/// A ball of triangles.
fn ball(surfaces: &mut Surfaces, center: DVec3, radius: f64, steps: u32, material: u32) {
    let at = |i: u32, j: u32| {
        let (sa, ca) = libm::sincos(std::f64::consts::TAU * f64::from(i % steps) / f64::from(steps));
        let (sb, cb) = libm::sincos(std::f64::consts::PI * f64::from(j) / f64::from(steps));
        center + DVec3::new(sb * ca, cb, sb * sa) * radius
    };
    for i in 0..steps {
        for j in 0..steps {
            quad(surfaces, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], 1.0, material);
        }
    }
}

#[test]
fn a_bulge_does_not_shade_what_faces_the_sun() {
    let mut surfaces = Surfaces { materials: vec![plain([0.8; 3])], ..Default::default() };
    ball(&mut surfaces, DVec3::ZERO, 1.0, 60, 0);
    let mut scene = with_sun(surfaces, DVec3::new(0.5, 1.0, 4.0), DVec3::ZERO, 16, 0.0);
    let shadowed = pixels(&scene);
    scene.sun.as_mut().unwrap().shadows = false;
    assert!(gap(&shadowed, &pixels(&scene)) < 1e-5);
}

#[test]
fn no_light_leaks_into_a_closed_room() {
    // A dented ball around the camera, and the sun outside: whatever is seen is as dark as the sky's light leaves it.
    let mut surfaces = Surfaces { materials: vec![plain([0.8; 3])], ..Default::default() };
    ball(&mut surfaces, DVec3::new(0.1, 0.9, 0.2), 6.0, 200, 0);
    let mut random = Random(4);
    let mut dents: Vec<f64> = (0..40_000).map(|_| random.range(0.8, 1.2)).collect();
    for position in &mut surfaces.positions {
        // By place, so that corners of one place stay together.
        let key = (position.x * 1e4).round() as i64 * 31 + (position.y * 1e4).round() as i64 * 17;
        let key = (key + (position.z * 1e4).round() as i64 * 7).rem_euclid(dents.len() as i64);
        *position *= dents[key as usize];
    }
    dents.clear();
    for degrees in [0.0, 5.0] {
        for toward in [DVec3::new(0.3, 0.9, -0.4), DVec3::Y, DVec3::new(-1.0, 0.02, 0.0)] {
            let mut scene = with_sun(
                surfaces.clone(),
                DVec3::new(0.3, 1.2, 2.5),
                DVec3::new(0.0, 0.9, -3.0),
                64,
                degrees,
            );
            let sun = scene.sun.as_mut().unwrap();
            (sun.toward, sun.color) = (toward.normalize(), DVec3::splat(1000.0));
            scene.sky.ambient = DVec3::ZERO;
            assert!(pixels(&scene).iter().flatten().all(|&value| value == 0.0), "{toward} {degrees}");
        }
    }
}

/// Two panes, each with coverage a half, between a white emitter and the lens.
#[test]
fn two_panes_of_a_half_let_a_quarter_pass() {
    let mut pane = plain([0.0; 3]);
    pane.coverage = 0.5;
    let mut lamp = plain([0.0; 3]);
    lamp.emission = [1.0; 3];
    let square =
        |z: f64| [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| DVec3::new(x, y, z));
    let mut surfaces = Surfaces { materials: vec![pane, lamp], ..Default::default() };
    quad(&mut surfaces, square(-4.0), 1.0, 1);
    quad(&mut surfaces, square(-2.0), 1.0, 0);
    quad(&mut surfaces, square(-1.0), 1.0, 0);
    let mut errors = Vec::new();
    for samples in [16, 64, 256, 1024] {
        let seen = pixels(&with_sun(surfaces.clone(), DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, samples, 0.0));
        let mean = seen.iter().map(|p| f64::from(p[0])).sum::<f64>() / seen.len() as f64;
        let off = |p: &[f32; 3]| (f64::from(p[0]) - 0.25) * (f64::from(p[0]) - 0.25);
        let rms = (seen.iter().map(off).sum::<f64>() / seen.len() as f64).sqrt();
        assert!((mean - 0.25).abs() < 0.003, "N = {samples}: {mean}");
        errors.push(rms);
    }
    // A fair coin for each sample would have 0.43 / sqrt N.
    assert!(errors[3] < 0.0136 && errors[3] < 0.25 * errors[0], "{errors:?}");
}

/// The same two panes between the sun and a wall.
#[test]
fn two_panes_of_a_half_let_a_quarter_of_the_sun_pass() {
    let mut pane = plain([0.0; 3]);
    pane.coverage = 0.5;
    let mut surfaces = Surfaces { materials: vec![pane, plain([1.0; 3])], ..Default::default() };
    let flat = |y: f64, size: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| DVec3::new(x * size, y, z * size))
    };
    quad(&mut surfaces, flat(0.0, 30.0), 1.0, 1);
    quad(&mut surfaces, flat(20.0, 60.0), 1.0, 0);
    quad(&mut surfaces, flat(21.0, 60.0), 1.0, 0);
    for degrees in [0.0, 2.0] {
        let mut scene = with_sun(surfaces.clone(), DVec3::new(0.0, 3.0, 1.0), DVec3::ZERO, 256, degrees);
        let sun = scene.sun.as_mut().unwrap();
        (sun.toward, sun.color) = (DVec3::Y, DVec3::ONE);
        scene.sky.ambient = DVec3::ZERO;
        let seen = pixels(&scene);
        let mean = seen.iter().map(|p| f64::from(p[0])).sum::<f64>() / seen.len() as f64;
        assert!((mean - 0.25).abs() < 0.002, "{degrees} degrees: {mean}");
        let rms = (seen.iter().map(|p| libm::pow(f64::from(p[0]) - 0.25, 2.0)).sum::<f64>()
            / seen.len() as f64)
            .sqrt();
        assert!(rms < 0.43 / 16.0, "{degrees} degrees: {rms}");
    }
}

/// A half-plane high over a floor: across its penumbra the light is the part of the sun's disk that is seen.
#[test]
fn a_penumbra_shows_the_suns_disk() {
    let mut surfaces = Surfaces { materials: vec![plain([1.0; 3])], ..Default::default() };
    let (height, degrees) = (10.0, 4.0_f64);
    quad(
        &mut surfaces,
        [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, z)| DVec3::new(x, 0.0, z)),
        1.0,
        0,
    );
    quad(
        &mut surfaces,
        [(0.0, -9.0), (90.0, -9.0), (90.0, 9.0), (0.0, 9.0)].map(|(x, z)| DVec3::new(x, height, z)),
        1.0,
        0,
    );
    let mut scene = with_sun(surfaces, DVec3::new(0.0, 3.0, 0.001), DVec3::ZERO, 1024, degrees);
    scene.optics = groundglass::Optics::new(&camera(
        DVec3::new(0.0, 3.0, 0.001),
        DVec3::ZERO,
        100.0,
        Setting { f_number: 0.0, front: [0.0; 2], ..OPEN },
    ))
    .unwrap();
    let sun = scene.sun.as_mut().unwrap();
    (sun.toward, sun.color) = (DVec3::Y, DVec3::ONE);
    scene.sky.ambient = DVec3::ZERO;
    let (width, row) = (scene.render.width, scene.render.height / 2);
    let seen = pixels(&scene);
    let film = scene.optics.camera().film.width.as_metres();
    let drawn = scene.optics.camera().extension.as_metres() / 3.0;
    let rim = height * libm::tan(degrees.to_radians() / 2.0);
    let mut between = 0;
    for i in 0..width {
        let x = (f64::from(i) + 0.5 - 0.5 * f64::from(width)) * film / f64::from(width) / drawn;
        // The part of a disk on one side of a chord.
        let t = (x / rim).clamp(-1.0, 1.0);
        let hidden = 0.5 + (libm::asin(t) + t * (1.0 - t * t).sqrt()) / std::f64::consts::PI;
        let found = f64::from(seen[(row * width + i) as usize][0]);
        between += u32::from(hidden > 0.02 && hidden < 0.98);
        assert!((found - (1.0 - hidden)).abs() < 0.012, "pixel {i}: {found}, not {}", 1.0 - hidden);
    }
    assert!(between > 10, "the penumbra is not in the picture");
}

#[test]
fn shadows_are_the_same_bytes_on_every_machine() {
    let mut random = Random(8);
    let mut surfaces = common::scenes::yard(&mut random, 300);
    let mut pane = plain([0.3, 0.2, 0.9]);
    pane.coverage = 0.4;
    pane.opacity_map = Some(Arc::new(noise(&mut random, 16, true)));
    surfaces.materials.push(pane);
    let corners = [(-2.0, 0.0), (2.0, 0.0), (2.0, 2.5), (-2.0, 2.5)].map(|(x, y)| DVec3::new(x, y, -2.0));
    quad(&mut surfaces, corners, 1.0, 4);
    for (samples, degrees) in [(24, 0.0), (24, 5.0), (3, 5.0)] {
        let eye = DVec3::new(0.3, 1.2, 2.5);
        let scene = with_sun(surfaces.clone(), eye, DVec3::new(0.0, 0.9, -3.0), samples, degrees);
        let bytes = |threads: usize, simd: Option<SimdLevel>| {
            let execution = Execution { threads: Some(threads), simd, ..Execution::default() };
            let (picture, _) = render(&scene, execution).unwrap();
            let places = (0..51).flat_map(|y| (0..64).map(move |x| (x, y)));
            places.flat_map(|(x, y)| picture.pixel(x, y).map(f32::to_bits)).collect::<Vec<_>>()
        };
        let one = bytes(1, None);
        assert!(bytes(3, None) == one);
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            assert!(bytes(2, Some(level)) == one, "{}", level.name());
        }
    }
}

#[test]
fn falloff_is_that_of_the_whole_lens_in_focus_and_out() {
    for stretch in [1.0, 1.03] {
        let setting = Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 1.8, stretch, rise: 0.0 };
        let camera = camera(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 150.0, setting);
        let mut surfaces = Surfaces { materials: vec![plain([0.0; 3])], ..Default::default() };
        surfaces.materials[0].emission = [0.5; 3];
        let corner = |x: f64, y: f64| DVec3::new(20.0 * x, 20.0 * y, 0.0);
        quad(
            &mut surfaces,
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            1.0,
            0,
        );
        for share in [false, true] {
            let mut scene = scene(&camera, surfaces.clone(), 80, 256);
            (scene.render.falloff, scene.render.share_shading) = (true, share);
            let (picture, _) = render(&scene, Execution::default()).unwrap();
            let middle =
                [(39, 31), (40, 31), (39, 32), (40, 32)].map(|(x, y)| f64::from(picture.pixel(x, y)[0]));
            // The mean of d^4 / (d^2 + s^2)^2 over a disk of radius R is d^2 / (d^2 + R^2).
            let (d, r) = (scene.optics.film_center().length(), scene.optics.aperture_radius());
            let wanted = 0.5 * d * d / (d * d + r * r);
            let found = middle.iter().sum::<f64>() / 4.0;
            assert!((found / wanted - 1.0).abs() < 1e-3, "{stretch}, {share}: {found} for {wanted}");
        }
    }
}

/// Light that changes over the lens as its weight does: on a curved surface and a textured one, both far out of focus, in the sky, and at
/// the edge of a shadow. Samples that are grouped and samples by themselves make the same picture.
#[test]
fn falloff_weighs_each_samples_own_light() {
    let setting = Setting { front: [30.0, 0.0], rear: [0.0, 0.0], f_number: 0.9, stretch: 1.2, rise: 0.0 };
    let camera = camera(DVec3::new(0.0, 1.0, 2.0), DVec3::ZERO, 80.0, setting);
    for shadows in [false, true] {
        let mut surfaces =
            Surfaces { materials: vec![plain([0.8; 3]), plain([0.9; 3])], ..Default::default() };
        surfaces.materials[1].diffuse_map = Some(Arc::new(noise(&mut Random(4), 16, false)));
        let corner = |x: f64, z: f64| DVec3::new(x, -0.3, z);
        for material in [0, 1] {
            let [left, right] = [[-3.0, 0.0], [0.0, 3.0]][material];
            let corners = [corner(left, 1.0), corner(right, 1.0), corner(right, -3.0), corner(left, -3.0)];
            quad(&mut surfaces, corners, 4.0, material as u32);
        }
        // The first is lit as a slope.
        let normals = [(-0.9, 0.4), (0.9, 0.4), (0.2, -0.9), (-0.2, -0.9)];
        surfaces.normals.extend(normals.map(|(x, z)| DVec3::new(x, 0.5, z).normalize().as_vec3()));
        (surfaces.attributes[0].normals, surfaces.attributes[1].normals) = ([0, 1, 2], [0, 2, 3]);
        let post = [(0.3, -0.3), (0.5, -0.3), (0.5, 0.2), (0.3, 0.2)];
        quad(&mut surfaces, post.map(|(x, y)| DVec3::new(x, y, -0.5)), 1.0, 0);
        surfaces.build_hierarchy();
        let mut scene = scene(&camera, surfaces, 64, 64);
        (scene.render.falloff, scene.sun.as_mut().unwrap().shadows) = (true, shadows);
        let alone = pixels(&scene);
        scene.render.share_shading = true;
        assert!(gap(&alone, &pixels(&scene)) < 1e-5, "shadows: {shadows}");
        scene.render.falloff = false;
        assert!(gap(&alone, &pixels(&scene)) > 0.05, "falloff is to be seen");
    }
}

/// Boards at the lens's height, of which half of the lens sees the side that the sun shines on: samples that are grouped and samples by
/// themselves make the same picture.
#[test]
fn of_a_board_at_the_lenss_height_each_lens_point_sees_its_side() {
    let setting = Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 1.4, stretch: 1.1, rise: 0.0 };
    let eye = DVec3::new(0.0, 0.003, 0.0);
    let camera = camera(eye, eye - DVec3::Z, 80.0, setting);
    let mut materials = vec![plain([0.8; 3]), plain([0.9; 3]), plain([0.7; 3])];
    // Of one colour: samples that share a look-up see the same.
    let level = Level { width: 4, height: 4, texels: vec![[40_000, 50_000, 60_000, 65_535]; 16] };
    materials[1].diffuse_map = Texture::from_level(level).map(Arc::new);
    let mut surfaces = Surfaces { materials, ..Default::default() };
    // The third board has normals of its own, all alike, and the others of its material lie over and under the lens.
    for (left, height, material) in
        [(-0.5, 0.0, 0), (-0.2, 0.0, 1), (0.1, 0.0, 2), (0.25, 0.05, 0), (0.3, -0.05, 0), (-0.4, 0.1, 2)]
    {
        let corner = |x: f64, z: f64| DVec3::new(left + x, height, z);
        quad(
            &mut surfaces,
            [corner(0.0, -0.5), corner(0.25, -0.5), corner(0.25, -4.0), corner(0.0, -4.0)],
            4.0,
            material,
        );
    }
    surfaces.normals.push(DVec3::new(0.02, 1.0, 0.01).normalize().as_vec3());
    for attributes in surfaces.attributes.iter_mut().filter(|attributes| attributes.material == 2) {
        attributes.normals = [0; 3];
    }
    let find: [fn(&mut Surfaces); 3] = [|_| {}, Surfaces::find_patches, Surfaces::build_hierarchy];
    for (kind, find) in find.into_iter().enumerate() {
        find(&mut surfaces);
        for (samples, shadows) in [(16, false), (64, false), (64, true), (256, false)] {
            let mut scene = scene(&camera, surfaces.clone(), 64, samples);
            scene.sun.as_mut().unwrap().shadows = shadows;
            let alone = pixels(&scene);
            scene.render.share_shading = true;
            let gap = gap(&alone, &pixels(&scene));
            assert!(gap < 1e-5, "{samples} samples, shadows: {shadows}, patches {kind}: {gap}");
        }
    }
}

/// Stripes on a floor, in a camera that is rolled, and a strip of few texels by many, stretched: both sides of a pixel's footprint are
/// many times as long as it is wide. Without coarser levels to choose from every sample looks at the texture itself.
#[test]
fn textures_keep_their_detail_where_a_pixel_is_seen_askew() {
    let setting = Setting { front: [0.0; 2], rear: [0.0; 2], f_number: 8.0, stretch: 1.0, rise: 0.0 };
    for (up, size, rows) in [(DVec3::new(1.0, 1.0, 0.0), [512, 512], 64), (DVec3::Y, [512, 2], 1)] {
        let (eye, look_at) = (DVec3::new(0.0, 1.5, 4.0), DVec3::new(0.0, 0.0, -1.0));
        let mut camera = camera(eye, look_at, 90.0, setting);
        camera.rail = Camera::rail_frame(eye, look_at, up).unwrap();
        let [width, height] = size;
        let row = |at: u32| {
            if (at / width / rows).is_multiple_of(2) { [u16::MAX; 4] } else { [0, 0, 0, u16::MAX] }
        };
        let level = Level { width, height, texels: (0..width * height).map(row).collect() };
        let mut texture = Texture::from_level(level).unwrap();
        let [filtered, exact] = [false, true].map(|is_exact| {
            if is_exact {
                texture.levels = texture.levels[..1].into();
            }
            let mut surfaces = Surfaces { materials: vec![plain([1.0; 3])], ..Default::default() };
            surfaces.materials[0].diffuse_map = Some(Arc::new(texture.clone()));
            let corner = |x: f64, z: f64| DVec3::new(3.0 * x, 0.0, 4.5 * z - 2.0);
            let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
            quad(&mut surfaces, corners, 12.0, 0);
            let mut scene = scene(&camera, surfaces, 48, 4096);
            scene.sun = None;
            scene.sky.ambient = DVec3::ONE;
            pixels(&scene)
        });
        let squares = filtered.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b) * (a - b));
        let rms = (squares.sum::<f32>() / (3 * exact.len()) as f32).sqrt();
        println!("{size:?}: {rms}");
        assert!(rms < 0.002, "{size:?}: {rms}");
    }
}
