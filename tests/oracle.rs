//! The fast path against the slow oracle, and against itself: same bytes for every thread count.

mod common;

use common::extremes::{self, Extreme};
use common::oracle;
use common::scenes::{ALIGNED, Random, Setting, camera, eight_bits, noise, palette, scene, yard};
use glam::{DVec2, DVec3};
use groundglass::camera::Camera;
use groundglass::picture::{Allocation, Exposure};
use groundglass::quantity::Angle;
use groundglass::render::{Execution, SimdLevel, render, replay};
use groundglass::scene::{Blades, Budget, Level, Mapping, Patches, Scene, Surfaces, Texture};
use std::sync::Arc;

fn compare(name: &str, scene: &Scene) {
    compare_doubting(name, scene, 20);
}

/// Compares all but the samples that the oracle doubts, which may be one in so many.
fn compare_doubting(name: &str, scene: &Scene, one_in: u32) {
    compare_picture(name, scene, one_in);
    // What 16 to 64 samples see in one go is shaded in groups, of one triangle each where no patches are found.
    if matches!(scene.render.budget, Budget::Samples(16 | 32 | 64)) && !scene.render.diffraction {
        let mut grouped = scene.clone();
        grouped.render.share_shading = true;
        grouped.surfaces.patches = Patches::default();
        // What is in doubt makes its whole group so.
        compare_picture(&format!("{name}, grouped"), &grouped, one_in.min(4));
    }
}

fn compare_picture(name: &str, scene: &Scene, one_in: u32) {
    let (picture, counts) = render(scene, Execution::default()).unwrap();
    assert!(counts.shading_requests <= counts.samples, "{name}: more was shaded than there is");
    let Budget::Samples(each) = scene.render.budget else { panic!("a number of samples is needed") };
    let (width, height) = (scene.render.width, scene.render.height);
    let (mut worst, mut farthest, mut doubtful, mut mismatched) = (0.0f64, 0.0f64, 0u32, 0u32);
    for j in 0..height {
        for i in 0..width {
            let want = oracle::pixel(scene, i, j, scene.render.share_shading);
            let got = DVec3::from_array(picture.pixel(i, j).map(f64::from));
            // What is no number passes all that follows.
            assert!(
                got.is_finite() && want.mean.is_finite(),
                "{name}: pixel {i},{j} is {got} and {}",
                want.mean
            );
            let gap = (got - want.mean).abs().max_element();
            doubtful += want.in_doubt;
            if want.in_doubt == 0 {
                (worst, farthest) = (worst.max(gap - want.slack), farthest.max(gap));
            } else {
                // Each sample in doubt may differ by all of the light there is.
                let allowed = 2.0 * f64::from(want.in_doubt) / f64::from(each);
                assert!(gap <= allowed, "{name}: pixel {i},{j} off by {gap} with {} in doubt", want.in_doubt);
                mismatched += u32::from(gap > 1e-3);
            }
        }
    }
    let samples = width * height * each;
    println!(
        "{name}: worst {worst:.2e}; {doubtful} of {samples} samples in doubt, {mismatched} pixels decided otherwise"
    );
    assert!(worst < 1e-5, "{name}: a pixel without doubt is off by {worst}");
    assert!(farthest < 1e-4, "{name}: a pixel on a steep texture is off by {farthest}");
    assert!(doubtful < samples / one_in, "{name}: the oracle doubts too much to test anything");
}

fn settings() -> Vec<(&'static str, Setting)> {
    vec![
        ("aligned", ALIGNED),
        ("pinhole", Setting { f_number: 0.0, ..ALIGNED }),
        ("lens tilted", Setting { front: [8.0, -3.0], ..ALIGNED }),
        ("film tilted", Setting { rear: [-15.0, 10.0], rise: 12.0, ..ALIGNED }),
        (
            "wide open, everything blurred",
            Setting { f_number: 0.9, stretch: 1.6, front: [3.0, 2.0], ..ALIGNED },
        ),
        ("steep tilt", Setting { front: [40.0, 0.0], stretch: 0.85, f_number: 16.0, ..ALIGNED }),
    ]
}

#[test]
fn the_fast_path_equals_the_oracle() {
    for (at, (name, setting)) in settings().into_iter().enumerate() {
        let mut random = Random(at as u64);
        let surfaces = yard(&mut random, 60);
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        for samples in [1, 3, 16, 37, 64] {
            compare(&format!("{name}, N = {samples}"), &scene(&camera, surfaces.clone(), 50, samples));
        }
    }
}

#[test]
fn falloff_equals_the_oracle() {
    let mut random = Random(77);
    let setting = Setting { front: [5.0, 2.0], rear: [-4.0, 0.0], f_number: 2.0, ..ALIGNED };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 90.0, setting);
    let mut scene = scene(&camera, yard(&mut random, 40), 48, 16);
    scene.render.falloff = true;
    compare("falloff", &scene);
    let setting = Setting { rear: [0.0, 50.0], f_number: 4.0, stretch: 0.9, ..ALIGNED };
    let camera = self::camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 45.0, setting);
    let mut scene = self::scene(&camera, scene.surfaces, 48, 16);
    scene.render.falloff = true;
    let is_before = |x: f64| scene.optics.axis().dot(scene.optics.film_point(x, 0.0)) > 0.0;
    assert_ne!(is_before(0.055), is_before(-0.055), "one end of the film stands before the lens");
    compare("falloff, through the plane of the lens", &scene);
}

#[test]
fn an_aperture_of_blades_equals_the_oracle() {
    let setting = Setting { front: [4.0, -3.0], f_number: 1.4, stretch: 1.2, ..ALIGNED };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    for (count, samples) in [(3, 16), (5, 37), (8, 256)] {
        let mut scene = scene(&camera, yard(&mut Random(12), 40), 40, samples);
        scene.blades = Some(Blades { count, rotation: Angle::degrees(20.0) });
        compare(&format!("{count} blades"), &scene);
    }
}

#[test]
fn diffraction_equals_the_oracle() {
    // Apertures of a twentieth of a millimetre: a ring of a pixel or two, and fifty of them over the whole film.
    let settings = [
        ("square to the film", Setting { f_number: 3000.0, ..ALIGNED }),
        ("film tilted", Setting { f_number: 2500.0, rear: [-15.0, 10.0], rise: 12.0, ..ALIGNED }),
        ("lens tilted", Setting { f_number: 2500.0, front: [25.0, -8.0], stretch: 0.9, ..ALIGNED }),
        ("blurred as well", Setting { f_number: 12.0, front: [3.0, 2.0], stretch: 1.3, ..ALIGNED }),
    ];
    for (at, (name, setting)) in settings.into_iter().enumerate() {
        let mut surfaces = yard(&mut Random(at as u64 + 90), 60);
        surfaces.build_hierarchy();
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        for (samples, blades) in [(1, 0), (3, 5), (16, 0), (37, 4)] {
            let mut scene = scene(&camera, surfaces.clone(), 50, samples);
            scene.render.diffraction = true;
            scene.render.falloff = samples == 16;
            scene.render.effects.all = true;
            scene.sun.as_mut().unwrap().shadows = samples == 3;
            scene.blades = (blades > 0).then(|| Blades { count: blades, rotation: Angle::degrees(20.0) });
            compare(&format!("diffraction, {name}, N = {samples}, {blades} blades"), &scene);
        }
    }
}

#[test]
fn shadows_equal_the_oracle() {
    for (at, (name, setting)) in settings().into_iter().enumerate() {
        let surfaces = yard(&mut Random(at as u64 + 50), 60);
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        for (degrees, samples) in [(0.0, 3), (0.0, 37), (0.5, 16), (20.0, 16), (90.0, 5), (180.0, 5)] {
            for toward in [DVec3::new(0.5, 0.8, 0.6), DVec3::new(-0.9, 0.05, -0.4)] {
                let mut scene = scene(&camera, surfaces.clone(), 40, samples);
                scene.surfaces.build_hierarchy();
                let sun = scene.sun.as_mut().unwrap();
                (sun.shadows, sun.angular_diameter) = (true, Angle::degrees(degrees));
                sun.toward = toward;
                compare(&format!("{name}, sun of {degrees} degrees, N = {samples}"), &scene);
            }
        }
    }
}

#[test]
fn holes_that_lie_elsewhere_than_colours_equal_the_oracle() {
    for (at, (name, setting)) in settings().into_iter().enumerate() {
        let mut random = Random(at as u64 + 120);
        let mut surfaces = yard(&mut random, 60);
        let sheet = &mut surfaces.materials[2];
        if at % 2 == 0 {
            sheet.diffuse_map = Some(Arc::new(noise(&mut random, 64, false)));
        }
        sheet.opacity_map = Some(Arc::new(noise(&mut random, 16, true)));
        sheet.opacity_mapping = Mapping { scale: DVec2::new(1.7, -0.6), offset: DVec2::new(0.3, 5.1) };
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        let drawn = |scene: &Scene| render(scene, Execution::default()).unwrap().0;
        for (shadows, samples) in [(false, 3), (false, 16), (true, 16)] {
            let mut scene = scene(&camera, surfaces.clone(), 40, samples);
            scene.surfaces.build_hierarchy();
            scene.sun.as_mut().unwrap().shadows = shadows;
            compare(&format!("{name}, shadows {shadows}, N = {samples}"), &scene);
            let own = drawn(&scene);
            scene.surfaces.materials[2].opacity_mapping = Mapping::IDENTITY;
            assert!(
                own.rms_difference(&drawn(&scene), 0.0) > 0.005,
                "{name}: where the holes lie is not seen"
            );
        }
    }
}

#[test]
fn the_camera_inside_the_geometry_equals_the_oracle() {
    // Triangles that cross near, pass behind the camera and through the lens itself.
    for seed in 0..3 {
        let mut random = Random(seed);
        let mut surfaces = yard(&mut random, 40);
        let eye = DVec3::new(0.3, 1.2, 2.5);
        common::scenes::shards(&mut surfaces, &mut random, 60, eye, 0.4, 0.6);
        let setting = Setting { f_number: 2.0, front: [4.0, 3.0], ..ALIGNED };
        let camera = camera(eye, DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        compare("inside", &scene(&camera, surfaces, 40, 16));
    }
}

#[test]
fn extreme_inputs_equal_the_oracle() {
    for extreme in Extreme::ALL {
        for samples in [4, 16] {
            compare(&format!("{extreme:?}, N = {samples}"), &extreme.scene(400, 70, samples));
        }
    }
}

/// Neighbours in space become neighbours in the list: by cells of a grid.
fn sort_by_place(surfaces: &mut Surfaces) {
    let key =
        |&t: &usize| surfaces.corners(t).iter().sum::<DVec3>().to_array().map(|at| (at / 0.7).floor() as i64);
    let mut order: Vec<usize> = (0..surfaces.triangles.len()).collect();
    order.sort_by_key(key);
    let triangles = order.iter().map(|&t| surfaces.triangles[t]).collect();
    surfaces.attributes = order.iter().map(|&t| surfaces.attributes[t]).collect();
    surfaces.triangles = triangles;
}

#[test]
fn clusters_that_are_passed_over_change_no_byte() {
    let tilted = Setting { front: [8.0, -5.0], rear: [-6.0, 3.0], f_number: 1.0, stretch: 1.1, rise: 30.0 };
    let mut scenes: Vec<(String, Scene)> = Extreme::ALL
        .into_iter()
        .filter(|&extreme| extreme != Extreme::Layers)
        .map(|extreme| (format!("{extreme:?}"), extreme.scene(20_000, 70, 4)))
        .collect();
    for (name, setting, diffraction) in
        [("tilted", tilted, false), ("bent", Setting { f_number: 90.0, ..ALIGNED }, true)]
    {
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        let mut scene = scene(&camera, yard(&mut Random(12), 20_000), 70, 4);
        scene.render.diffraction = diffraction;
        scenes.push((name.to_owned(), scene));
    }
    let picture = |scene: &Scene| {
        let (picture, counts) = render(scene, Execution::default()).unwrap();
        let pixels: Vec<_> = (0..56)
            .flat_map(|y| (0..70).map(move |x| (x, y)))
            .map(|(x, y)| picture.pixel(x, y).map(f32::to_bits))
            .collect();
        (pixels, counts.bin_entries)
    };
    for (name, scene) in &mut scenes {
        sort_by_place(&mut scene.surfaces);
        let all = picture(scene);
        scene.surfaces.find_clusters();
        let seen = picture(scene);
        assert!(all.0 == seen.0, "{name}");
        assert!(seen.1 <= all.1, "{name}: {} entries, {} without clusters", seen.1, all.1);
    }
}

#[test]
fn triangles_between_the_samples_of_a_crowded_tile_are_the_only_ones_left_out() {
    for (name, setting) in [
        ("in focus", extremes::ORDINARY),
        ("blurred", Setting { f_number: 1.0, stretch: 1.06, front: [4.0, -3.0], ..extremes::ORDINARY }),
    ] {
        // Of twenty triangles around each sample, smaller than a pixel, one in fifty is met or missed by a hair.
        compare_doubting(&format!("a crowd {name}"), &extremes::crowd(24_000, 32, 2, setting), 2);
    }
    compare("a crowd of dust", &Extreme::Dust.scene(40_000, 20, 4));
}

#[test]
fn loose_triangles_are_seen_from_the_same_lens_points() {
    // Of a lens that leans each point sees the film at another scale, and another shape.
    for (triangles, width, samples, front) in
        [(300, 260, 4, [0.0; 2]), (60, 260, 32, [0.0; 2]), (60, 400, 12, [5.0, -3.0])]
    {
        let scene = extremes::loose(triangles, width, samples, front);
        compare(&format!("loose, N = {samples}, lens at {front:?}"), &scene);
    }
}

#[test]
fn loose_triangles_in_rounds_and_in_one_go_are_the_same_bytes() {
    in_rounds_and_in_one_go(extremes::loose(300, 260, 16, [0.0; 2]), 0.004);
    in_rounds_and_in_one_go(extremes::loose(100, 400, 16, [5.0, -3.0]), 0.004);
}

#[test]
fn crowded_tiles_in_rounds_and_in_one_go_are_the_same_bytes() {
    let mut scene = extremes::crowd(200_000, 32, 16, extremes::ORDINARY);
    // Not all over the picture: half of it needs no more than the first samples.
    for position in &mut scene.surfaces.positions {
        position.x = 0.5 * position.x - 1.0;
    }
    in_rounds_and_in_one_go(scene, 0.03);
}

#[test]
fn a_smooth_wall_in_rounds_and_in_one_go_is_the_same_bytes() {
    let surfaces = wall(&mut Random(31), 0.1, 0.0);
    let setting = Setting { rear: [4.0, 0.0], ..ALIGNED };
    in_rounds_and_in_one_go(scene(&before_the_wall(setting), surfaces, 120, 16), 1e-4);
}

fn in_rounds_and_in_one_go(mut scene: Scene, error: f64) {
    scene.render.budget = Budget::MaxError(error);
    let bytes = |picture: &Exposure| -> Vec<_> {
        let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
        pixels.map(|(x, y)| picture.pixel(x, y).map(f32::to_bits)).collect()
    };
    let on = |threads: usize| Execution { threads: Some(threads), ..Execution::default() };
    let (first, _) = render(&scene, on(2)).unwrap();
    assert!(matches!(first.samples(), Allocation::Blocks(_)), "no block had more than another");
    let (again, _) = replay(&scene, first.samples(), on(1)).unwrap();
    assert!(bytes(&again) == bytes(&first));
}

#[test]
fn far_from_the_origin_nothing_is_lost() {
    let at = DVec3::new(1e6, -2e6, 5e5);
    let mut random = Random(5);
    let mut surfaces = yard(&mut random, 40);
    for position in &mut surfaces.positions {
        *position += at;
    }
    let eye = DVec3::new(0.3, 1.2, 2.5) + at;
    let camera =
        camera(eye, eye + DVec3::new(-0.3, -0.3, -5.5), 150.0, Setting { front: [6.0, 0.0], ..ALIGNED });
    compare("a million metres away", &scene(&camera, surfaces, 40, 16));
}

#[test]
fn every_thread_count_and_simd_level_gives_the_same_bytes() {
    same_bytes(2.8, false);
}

#[test]
fn every_thread_count_and_simd_level_bends_light_to_the_same_bytes() {
    same_bytes(300.0, true);
}

#[test]
fn every_thread_count_and_simd_level_shares_alike() {
    same_bytes_of(scene(&before_the_wall(ALIGNED), wall(&mut Random(31), 0.1, 0.0), 150, 24));
}

fn same_bytes(f_number: f64, diffraction: bool) {
    let mut random = Random(9);
    let mut surfaces = yard(&mut random, 300);
    surfaces.find_patches();
    let setting = Setting { front: [6.0, -4.0], f_number, ..ALIGNED };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    let mut scene = scene(&camera, surfaces, 150, 24);
    scene.render.diffraction = diffraction;
    same_bytes_of(scene);
}

fn same_bytes_of(mut scene: Scene) {
    let bytes = |scene: &Scene, threads: usize, simd: Option<SimdLevel>| {
        let execution = Execution { threads: Some(threads), simd, ..Execution::default() };
        let (picture, _) = render(scene, execution).unwrap();
        let pixels = (0..120).flat_map(|y| (0..150).map(move |x| (x, y)));
        let bits: Vec<u32> = pixels.flat_map(|(x, y)| picture.pixel(x, y).map(f32::to_bits)).collect();
        (bits, picture.rms_error().map(f64::to_bits))
    };
    for (share, samples) in [(true, 24), (false, 24), (false, 3)] {
        scene.render.share_shading = share;
        scene.render.budget = Budget::Samples(samples);
        let one = bytes(&scene, 1, None);
        for threads in [2, 3, 8] {
            assert!(bytes(&scene, threads, None) == one, "{threads} threads");
        }
        for level in SimdLevel::ALL {
            if level.is_available() {
                assert!(bytes(&scene, 2, Some(level)) == one, "{}, {samples} samples", level.name());
            } else {
                println!("skipped: this machine has no {}", level.name());
            }
        }
    }
}

/// How much sharing changes a picture, over its noise.
fn change_of_sharing(scene: Scene) -> f64 {
    let [change, noise] = change_and_noise(scene);
    change / noise
}

/// How much sharing changes a picture, and its noise without.
fn change_and_noise(mut scene: Scene) -> [f64; 2] {
    let picture = |scene: &Scene| render(scene, Execution::default()).unwrap().0;
    scene.render.share_shading = false;
    let alone = picture(&scene);
    scene.render.share_shading = true;
    scene.surfaces.find_patches();
    // Eight stops darker nothing is clamped.
    [256.0 * alone.rms_difference(&picture(&scene), -8.0), alone.rms_error().unwrap()]
}

/// A wall that fills the picture, whose texture rises by `slope` and is off by up to `weak`, in steps of 8 bits.
fn wall(random: &mut Random, slope: f64, weak: f64) -> Surfaces {
    let size = 256;
    let mut surfaces = yard(random, 0);
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % size) / f64::from(size), f64::from(i / size) / f64::from(size));
        let linear = 0.3 + slope * x + 0.5 * slope * y + random.range(-weak, weak);
        let value = (eight_bits(linear) * 65535.0) as u16;
        [value, value, value, 65535]
    };
    let level = Level { width: size, height: size, texels: (0..size * size).map(texel).collect() };
    surfaces.materials[1].diffuse_map = Some(Arc::new(Texture::from_level(level).unwrap()));
    keep_the_wall(&mut surfaces);
    surfaces
}

fn before_the_wall(setting: Setting) -> Camera {
    camera(DVec3::new(0.5, 1.5, 2.5), DVec3::new(0.5, 1.5, -6.0), 500.0, setting)
}

/// Leaves of a yard only its wall.
fn keep_the_wall(surfaces: &mut Surfaces) {
    surfaces.triangles = surfaces.triangles[2..4].to_vec();
    surfaces.attributes = surfaces.attributes[2..4].to_vec();
}

#[test]
fn shared_look_ups_stay_under_a_third_of_the_noise() {
    let mut most = 0.0f64;
    for (name, setting) in settings() {
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        for samples in [16, 64, 256] {
            let look = |is_alone: bool| {
                let random = &mut Random(31);
                let mut surfaces = yard(random, 60);
                surfaces.materials[1].diffuse_map = Some(Arc::new(palette(random, 256)));
                // The wall by itself, flat and near: nothing but what its texture is read by can change.
                if is_alone {
                    keep_the_wall(&mut surfaces);
                }
                change_of_sharing(scene(&camera, surfaces, 120, samples))
            };
            let (all, alone) = (look(false), look(true));
            println!(
                "{name}, N = {samples}: sharing changes {all:.4} of the noise, look-ups {alone:.4} of a wall's"
            );
            assert!(all < 1.0 / 3.0, "{name}, N = {samples}: {all}");
            most = most.max(alone);
        }
    }
    // Where the film is tilted; elsewhere the wall is sharp, and each sample reads it for itself.
    assert!(most > 3e-4, "nothing is shared");
}

/// What fills the picture is one wall, whose texture changes by a step or two of 8 bits: hardly any noise to hide a change in, least of
/// all in the steps of a slope, which have none but at their edges.
#[test]
fn shared_look_ups_stay_under_a_third_of_weak_noise() {
    for (what, slope, weak) in [("slope", 0.1, 0.0), ("noise", 0.0, 0.003), ("dithered slope", 0.2, 0.001)] {
        let surfaces = wall(&mut Random(31), slope, weak);
        for (name, setting) in settings() {
            let camera = before_the_wall(setting);
            for samples in [16, 64, 256] {
                let [change, noise] = change_and_noise(scene(&camera, surfaces.clone(), 120, samples));
                println!(
                    "{what}, {name}, N = {samples}: sharing changes {change:.1e}, the noise is {noise:.1e}"
                );
                assert!(change < noise / 3.0, "{what}, {name}, N = {samples}: {change} of {noise}");
            }
        }
    }
}

#[test]
fn sharing_stays_under_a_third_of_the_noise() {
    let mut random = Random(31);
    let surfaces = yard(&mut random, 200);
    for (name, setting) in settings() {
        let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
        for samples in [16, 64, 256] {
            // With shadows each sample has a normal of its own.
            for (what, most) in [("sun", 3.0), ("falloff", 3.0), ("shadows", 12.0), ("soft shadows", 12.0)] {
                let mut scene = scene(&camera, surfaces.clone(), 120, samples);
                scene.render.falloff = what == "falloff";
                if what.ends_with("shadows") {
                    scene.surfaces.build_hierarchy();
                    let sun = scene.sun.as_mut().unwrap();
                    sun.shadows = true;
                    sun.angular_diameter = Angle::degrees(if what == "shadows" { 0.0 } else { 2.0 });
                }
                let gap = change_of_sharing(scene);
                println!("{name}, N = {samples}, {what}: sharing changes {gap:.3} of the noise");
                assert!(gap < 1.0 / most, "{name}, N = {samples}, {what}: {gap}");
            }
        }
    }
}
