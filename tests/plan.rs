//! What a plan leaves out cannot be seen, and what it says is what is drawn.

mod common;
#[path = "common/program.rs"]
mod program;

use common::gap;
use common::scenes::{ALIGNED, Random, Setting, camera, plain, quad, scene, yard};
use glam::DVec3;
use groundglass::plan::RenderPlan;
use groundglass::quantity::{Angle, Length};
use groundglass::render::{Execution, render};
use groundglass::scene::{Blades, Budget, EffectChoice, EffectName, Level, Scene, Surfaces, Texture};
use groundglass::{Camera, Exposure, FilmSize, Optics};
use program::{CAMERA, SMALL, folder, run};

fn at(f_number: f64, seed: u64, tilt: f64) -> Scene {
    let setting = Setting { front: [tilt, 0.0], rear: [0.0, 0.0], f_number, stretch: 1.03, rise: 0.0 };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    let mut surfaces = yard(&mut Random(seed), 60);
    surfaces.find_patches();
    scene(&camera, surfaces, 96, 64)
}

fn draw(scene: &Scene) -> Exposure {
    render(scene, Execution::default()).unwrap().0
}

/// The RMS difference of pictures with and without the plan, chance left out.
fn change(scene: &Scene) -> f64 {
    let pictures = |all: bool| {
        [0, 1000].map(|seed| {
            let mut scene = scene.clone();
            (scene.render.seed, scene.render.effects.all) = (scene.render.seed + seed, all);
            draw(&scene)
        })
    };
    let (planned, whole) = (pictures(false), pictures(true));
    Exposure::rms_change(planned.each_ref(), whole.each_ref(), scene.render.exposure_ev)[0]
}

/// A scene in which this effect is asked for, the smaller the larger `step` is.
fn with_small(effect: EffectName, step: i32, seed: u64) -> Scene {
    let size = libm::exp2(f64::from(step) / 2.0);
    let mut scene = match effect {
        EffectName::Falloff => {
            let setting =
                Setting { front: [1.0, 0.0], rear: [0.0, 0.0], f_number: 64.0, stretch: 1.03, rise: 0.0 };
            let mut camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
            camera.film.width = Length::metres(camera.film.width.as_metres() / size);
            camera.film.height = Length::metres(camera.film.height.as_metres() / size);
            let mut surfaces = yard(&mut Random(seed), 60);
            surfaces.find_patches();
            scene(&camera, surfaces, 96, 64)
        }
        EffectName::Defocus | EffectName::ApertureShape => at(2.8 * size, seed, (seed % 3) as f64),
        EffectName::Diffraction => at((250.0 / size).max(1.0), seed, 1.0),
        _ => at(8.0, seed, 1.0),
    };
    // Light brighter than white, so that clipping has its say: of a lamp, by exposure, of the sun, of the sky.
    match seed {
        0 | 2 => scene.surfaces.materials[3].emission = [12.0, 9.0, 5.0],
        4 => scene.render.exposure_ev = 5.0,
        5 => scene.sun.as_mut().unwrap().color *= 40.0,
        6 => scene.sky.horizon = DVec3::splat(40.0),
        _ => {}
    }
    match effect {
        EffectName::Falloff => scene.render.falloff = true,
        EffectName::Diffraction => scene.render.diffraction = true,
        EffectName::ApertureShape => {
            scene.blades = Some(Blades { count: 3 + seed as u32 % 4, rotation: Angle::degrees(7.0) })
        }
        EffectName::SoftShadows => {
            scene.surfaces.build_hierarchy();
            let sun = scene.sun.as_mut().unwrap();
            (sun.shadows, sun.angular_diameter) = (true, Angle::degrees(20.0 / size));
        }
        _ => {}
    }
    scene
}

/// The scene with the largest such effect that the plan leaves out.
fn largest_left_out(effect: EffectName, seed: u64) -> Scene {
    let mut small = (0..60).map(|step| with_small(effect, step, seed));
    small.find(|scene| !RenderPlan::new(scene).active().has(effect)).unwrap()
}

#[test]
fn what_is_left_out_changes_the_picture_by_no_more_than_is_stated() {
    use EffectName::{ApertureShape, Defocus, Diffraction, Falloff, SoftShadows};
    for effect in [Defocus, ApertureShape, SoftShadows, Falloff, Diffraction] {
        for seed in 0..7u64 {
            let scene = largest_left_out(effect, seed);
            let plan = RenderPlan::new(&scene);
            let (_, counts) = render(&scene, Execution::default()).unwrap();
            assert!(counts.left_out.has(effect), "{effect} is drawn, though the plan leaves it out");
            assert_eq!(counts.left_out, plan.left_out());
            let change = change(&scene);
            println!("{effect}, scene {seed}: {:?}, change {change:.5}", plan.active());
            assert!(change <= plan.tolerance(), "{effect}, scene {seed}: {change}");
            let mut all = scene;
            all.render.effects.all = true;
            assert!(RenderPlan::new(&all).active().has(effect));
        }
    }
}

#[test]
fn what_is_drawn_is_what_the_plan_says() {
    use EffectName::{ApertureShape, Defocus, Diffraction, Falloff, SoftShadows};
    let of = |scene: &Scene| {
        let (plan, (_, counts)) = (RenderPlan::new(scene), render(scene, Execution::default()).unwrap());
        assert_eq!(counts.left_out, plan.left_out());
        for name in [Defocus, ApertureShape, SoftShadows, Falloff, Diffraction] {
            assert!(!(plan.active().has(name) && counts.left_out.has(name)), "{name}: {:?}", plan.effects());
            // Never dropped without a word.
            let effect = plan.effects().iter().find(|effect| effect.effect == name.name()).unwrap();
            let is_dropped = !effect.active && !effect.because.contains("--without") && asked(scene, name);
            assert_eq!(is_dropped, counts.left_out.has(name), "{effect:?}");
        }
    };
    for seed in 0..2 {
        for effect in [Defocus, ApertureShape, SoftShadows, Falloff, Diffraction] {
            for step in (0..40).step_by(3) {
                let mut scene = with_small(effect, step, seed);
                (scene.render.width, scene.render.height) = (20, 16);
                scene.render.budget = Budget::Samples(1);
                of(&scene);
                scene.render.effects.without = [EffectName::Shadows, Defocus].into_iter().collect();
                of(&scene);
            }
        }
    }
}

fn asked(scene: &Scene, name: EffectName) -> bool {
    match name {
        EffectName::ApertureShape => scene.blades.is_some(),
        EffectName::SoftShadows => {
            scene.sun.as_ref().is_some_and(|sun| sun.shadows && sun.angular_diameter.as_degrees() > 0.0)
        }
        EffectName::Falloff => scene.render.falloff,
        EffectName::Diffraction => scene.render.diffraction,
        _ => true,
    }
}

#[test]
fn a_scene_within_a_fraction_of_a_pixel_is_drawn_as_a_pinhole() {
    let sharp = at(20_000.0, 3, 0.0);
    let plan = RenderPlan::new(&sharp);
    assert!(!plan.active().has(EffectName::Defocus) && plan.active().has(EffectName::Antialiasing));
    let effect = &plan.effects()[0];
    assert!(effect.because.contains("threshold 0.12 px"), "{}", effect.because);
    let mut without = at(5.6, 3, 0.0);
    without.render.effects.without = [EffectName::Defocus].into_iter().collect();
    // The same lens centre, film and samples: whatever the aperture was.
    assert_eq!(gap(&draw(&sharp), &draw(&without)), 0.0);
    assert!(gap(&draw(&at(5.6, 3, 0.0)), &draw(&without)) > 0.003);
}

#[test]
fn where_a_part_is_blurred_only_its_tiles_pay() {
    // A wall of tiles in focus 4.6 m away at the left, and one at the right, as large as seen, in focus or much farther.
    let requests = |far: [f64; 2]| {
        let mut surfaces =
            Surfaces { materials: vec![plain([0.7; 3]), plain([0.4; 3])], ..Surfaces::default() };
        for (side, far) in far.into_iter().enumerate() {
            for i in 0..400 {
                let at = |x: i32, y: i32| {
                    let x = 0.09 * f64::from(x) - if side == 0 { 1.85 } else { -0.05 };
                    DVec3::new(x, 0.08 * f64::from(y) - 0.8, 0.0) * far + DVec3::new(0.0, 0.0, -4.6 * far)
                };
                let (x, y) = (i % 20, i / 20);
                let corners = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                quad(&mut surfaces, corners, 1.0, (x + y) as u32 % 2);
            }
        }
        let setting =
            Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 2.8, stretch: 1.0337, rise: 0.0 };
        let camera = camera(DVec3::ZERO, DVec3::new(0.0, 0.0, -1.0), 150.0, setting);
        let mut scene = scene(&camera, surfaces, 160, 64);
        scene.render.share_shading = true;
        render(&scene, Execution::default()).unwrap().1.shading_requests as f64
    };
    let [sharp, half, blurred] = [[1.0, 1.0], [1.0, 4.0], [4.0, 4.0]].map(requests);
    println!("requests: {sharp} in focus, {half} with the right half blurred, {blurred} all");
    assert!(blurred > 1.3 * sharp, "{sharp} and {blurred}");
    assert!((half - sharp) / (blurred - sharp) < 0.55, "{sharp}, {half} and {blurred}");
}

/// A floor that nothing shades, seen from above: of a sun of `2 h` straight above it gets (1 + cos h) / 2 of the light of its middle.
#[test]
fn the_suns_disk_lights_also_what_no_shadow_falls_on() {
    let camera = camera(DVec3::new(0.0, 3.0, 2.0), DVec3::ZERO, 150.0, ALIGNED);
    let mut surfaces = Surfaces { materials: vec![plain([0.8, 0.6, 0.4])], ..Default::default() };
    let corners = [(-50.0, 50.0), (50.0, 50.0), (50.0, -50.0), (-50.0, -50.0)];
    quad(&mut surfaces, corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 1.0, 0);
    surfaces.build_hierarchy();
    for (degrees, is_in) in [(0.5, false), (20.0, true), (60.0, true), (180.0, true)] {
        let mut scene = scene(&camera, surfaces.clone(), 16, 256);
        let sun = scene.sun.as_mut().unwrap();
        (sun.toward, sun.color, sun.shadows) = (DVec3::Y, DVec3::ONE, true);
        sun.angular_diameter = Angle::degrees(degrees);
        scene.sky.ambient = DVec3::ZERO;
        assert_eq!(RenderPlan::new(&scene).active().has(EffectName::SoftShadows), is_in, "{degrees} degrees");
        let half = 0.5 * degrees.to_radians();
        let want = 0.5 * (1.0 + if is_in { libm::cos(half) } else { 1.0 });
        let picture = draw(&scene);
        let places = || (0..picture.height()).flat_map(|y| (0..16).map(move |x| (x, y)));
        for (c, of) in [0.8, 0.6, 0.4].into_iter().enumerate() {
            let sum: f64 = places().map(|(x, y)| f64::from(picture.pixel(x, y)[c])).sum();
            let mean = sum / places().count() as f64;
            assert!((mean - of * want).abs() < 1e-3, "{degrees} degrees: {mean}, not {}", of * want);
        }
    }
}

/// An empty scene, level, so close up that the sky is far out of focus: its horizon is the mean over the lens.
#[test]
fn the_sky_is_seen_through_the_whole_lens() {
    for (f_number, stretch, samples) in [(1.0, 2.0, 256), (1.0, 2.0, 1024), (2.8, 2.0, 256), (1.4, 1.04, 256)]
    {
        let setting = Setting { f_number, stretch, ..ALIGNED };
        let mut scene =
            scene(&camera(DVec3::ZERO, DVec3::NEG_Z, 150.0, setting), Surfaces::default(), 25, samples);
        scene.sky.horizon = DVec3::ZERO;
        scene.sky.zenith = DVec3::ONE;
        scene.render.falloff = false;
        let picture = draw(&scene);
        let (width, height) = (picture.width(), picture.height());
        let film = scene.optics.camera().film;
        let (film, behind) = ([film.width.as_metres(), film.height.as_metres()], 0.15 * stretch);
        // `q_w s - p` of the contract, up being y: q_w = 1 - behind / f.
        let rise = |[sx, sy]: [f64; 2], [px, py]: [f64; 2]| {
            let q = 1.0 - behind / 0.15;
            let [x, y] = [q * sx - px, q * sy - py];
            (y / (x * x + y * y + behind * behind).sqrt()).max(0.0)
        };
        let mut worst = 0.0f64;
        for (i, j) in (0..height).flat_map(|j| [2, width / 2].map(|i| (i, j))) {
            let (mut sum, mut count) = (0.0, 0.0);
            for k in 0..60 * 60 * 9 {
                let at = |k: i32, n: i32| (f64::from(k % n) + 0.5) / f64::from(n);
                let (radius, angle) = (
                    at(k, 60).sqrt() * scene.optics.aperture_radius(),
                    at(k / 60, 60) * std::f64::consts::TAU,
                );
                let (x, y) = (f64::from(i) + at(k / 3600, 3), f64::from(j) + at(k / 10_800, 3));
                let place = [(0.5 - x / f64::from(width)) * film[0], (y / f64::from(height) - 0.5) * film[1]];
                sum += rise([radius * libm::cos(angle), radius * libm::sin(angle)], place);
                count += 1.0;
            }
            worst = worst.max((f64::from(picture.pixel(i, j)[0]) - sum / count).abs());
        }
        println!("f/{f_number}, {stretch} f, {samples} samples: off by {worst:.1e} at most");
        assert!(worst < 1e-3, "f/{f_number}, {samples} samples: off by {worst}");
    }
}

/// All that a tilted lens sees lies in its plane of focus, and most of that plane beside and behind what the film can see.
#[test]
fn what_a_tilted_lens_has_behind_the_film_is_not_blur_in_view() {
    for (tilt, swing) in [(3.0, 0.0), (12.0, 0.0), (30.0, 0.0), (0.0, -20.0), (15.0, 10.0)] {
        let setting = Setting { front: [tilt, swing], f_number: 4.0, ..ALIGNED };
        let camera = camera(DVec3::new(0.0, 1.5, 0.0), DVec3::new(0.0, 1.5, -1.0), 150.0, setting);
        let optics = Optics::new(&camera).unwrap();
        let focus = optics.focus_plane();
        let across = focus.m.normalize().any_orthonormal_vector();
        let along = focus.m.normalize().cross(across);
        let at = |lean: f64| {
            let mut surfaces = Surfaces { materials: vec![plain([0.7; 3])], ..Surfaces::default() };
            for (i, j) in (0..24).flat_map(|i| (0..24).map(move |j| (i, j))) {
                let corner = |x: i32, y: i32| {
                    let (x, y) = (f64::from(x) - 12.0, f64::from(y) - 12.0);
                    let p = focus.m * (-focus.e / focus.m.length_squared()) + x * across + y * along;
                    optics.world_from_lens().point(p * (1.0 + lean))
                };
                let corners = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                quad(&mut surfaces, corners, 1.0, 0);
            }
            let mut scene = scene(&camera, surfaces, 96, 64);
            scene.sky.zenith = scene.sky.horizon;
            scene
        };
        for (lean, is_blurred) in [(0.0, false), (0.3, true)] {
            let plan = RenderPlan::new(&at(lean));
            println!("{tilt}, {swing}, {lean}: {}", plan.effects()[0].because);
            assert_eq!(plan.active().has(EffectName::Defocus), is_blurred, "{:?}", plan.effects()[0]);
            let (_, counts) = render(&at(lean), Execution::default()).unwrap();
            assert_eq!(counts.left_out.has(EffectName::Defocus), !is_blurred);
        }
    }
}

/// A black card close before the lens, so large that its corners lie far out of view, of which only the rim of the lens sees an edge; all
/// else is sharp.
#[test]
fn what_only_the_rim_of_the_lens_sees_is_in_view() {
    for (tilt, f_number, side, is_in) in [
        (10.0, 2.0, 0.032, true),
        (0.0, 2.0, 0.035, true),
        (0.0, 2.8, 0.035, true),
        (0.0, 2.8, 0.5, false),
        (10.0, 2.0, 0.5, false),
    ] {
        let setting = Setting { front: [tilt, 0.0], f_number, stretch: 1.03, ..ALIGNED };
        let camera = camera(DVec3::ZERO, DVec3::NEG_Z, 150.0, setting);
        let optics = Optics::new(&camera).unwrap();
        let focus = optics.focus_plane();
        let across = focus.m.normalize().any_orthonormal_vector();
        let along = focus.m.normalize().cross(across);
        let middle = focus.m * (-focus.e / focus.m.length_squared());
        let corner =
            |x: f64, y: f64| optics.world_from_lens().point(middle + 40.0 * (x * across + y * along));
        let mut surfaces =
            Surfaces { materials: vec![plain([0.9; 3]), plain([0.0; 3])], ..Surfaces::default() };
        quad(
            &mut surfaces,
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            1.0,
            0,
        );
        let card = [(side, -10.0), (10.0, -10.0), (10.0, 10.0), (side, 10.0)];
        quad(&mut surfaces, card.map(|(x, y)| DVec3::new(x, y, -0.05)), 1.0, 1);
        let mut scene = scene(&camera, surfaces, 64, 256);
        (scene.sun, scene.sky.ambient) = (None, DVec3::ONE);
        scene.sky.zenith = scene.sky.horizon;
        let plan = RenderPlan::new(&scene);
        assert_eq!(plan.active().has(EffectName::Defocus), is_in, "{side}: {:?}", plan.effects()[0]);
        let whole = draw(&scene);
        scene.render.effects.all = true;
        let change = gap(&whole, &draw(&scene));
        assert!(change < 0.002, "{tilt} degrees, f/{f_number}, {side}: {change}");
        // The card is there to be seen, or not.
        scene.render.effects =
            EffectChoice { without: [EffectName::Defocus].into_iter().collect(), ..Default::default() };
        assert_eq!(gap(&whole, &draw(&scene)) > 0.01, is_in, "{side}");
    }
}

/// A card close before the lens and beside its axis, behind a film so small that its blur is hundreds of times as wide: no place of the lens that
/// looks along the axis sees it.
#[test]
fn what_is_blurred_over_far_more_than_the_film_is_in_view() {
    let mut camera =
        camera(DVec3::ZERO, DVec3::NEG_Z, 100.0, Setting { f_number: 2.0, stretch: 1.02, ..ALIGNED });
    (camera.film.width, camera.film.height) = (Length::millimetres(9.0), Length::millimetres(7.2));
    camera.near = Length::millimetres(5.0);
    let distance = 0.1 * 1.02 / 0.02;
    // 9 mm off the axis; or beyond what the lens can show.
    for (turned, side, off) in [
        (0.0, 0.004, 0.009),
        (0.7, 0.004, 0.009),
        (2.0, 0.004, 0.009),
        (0.0, 1e-4, 0.009),
        (0.0, 0.004, 0.09),
    ] {
        let is_in = off < 0.05;
        let mut surfaces =
            Surfaces { materials: vec![plain([0.9; 3]), plain([0.0; 3])], ..Surfaces::default() };
        let wall = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
        quad(&mut surfaces, wall.map(|(x, y)| DVec3::new(x, y, -distance)), 1.0, 0);
        let (sin, cos) = (libm::sin(turned), libm::cos(turned));
        let card = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| {
            let (x, y) = (off + side * x, side * y);
            DVec3::new(cos * x - sin * y, sin * x + cos * y, -0.02)
        });
        quad(&mut surfaces, card, 1.0, 1);
        let mut scene = scene(&camera, surfaces, 40, 256);
        (scene.sun, scene.sky.ambient) = (None, DVec3::ONE);
        scene.sky.zenith = scene.sky.horizon;
        let plan = RenderPlan::new(&scene);
        assert_eq!(
            plan.active().has(EffectName::Defocus),
            is_in,
            "{turned} {side} {off}: {:?}",
            plan.effects()[0]
        );
    }
}

/// Ground that the sun grazes and vertex normals show as bright as day: a penumbra is long there, and to be seen.
#[test]
fn penumbras_on_what_normals_turn_to_the_sun_are_in() {
    for (height, diameter, is_in) in [(3.0_f64, 0.53, true), (1.0, 0.05, true), (60.0, 0.02, false)] {
        let setting = Setting { f_number: 500.0, ..ALIGNED };
        let camera = camera(DVec3::new(0.0, 8.0, 0.01), DVec3::ZERO, 80.0, setting);
        let mut surfaces = Surfaces { materials: vec![plain([0.9; 3])], ..Surfaces::default() };
        let ground = [(-6.0, 6.0), (6.0, 6.0), (6.0, -6.0), (-6.0, -6.0)];
        quad(&mut surfaces, ground.map(|(x, z)| DVec3::new(x, 0.0, z)), 1.0, 0);
        let angle = height.to_radians();
        let (low, high) = (libm::cos(angle), libm::sin(angle));
        let toward = DVec3::new(0.92 * low, high, 0.39 * low).normalize();
        surfaces.normals.push(toward.as_vec3());
        surfaces.attributes.iter_mut().for_each(|attributes| attributes.normals = [0; 3]);
        for i in 0..8 {
            let z = 1.1 * f64::from(i) - 4.0;
            let fence = [(-4.0, 0.0, z), (3.5, 0.0, z + 3.0), (3.5, 0.06, z + 3.0), (-4.0, 0.06, z)];
            quad(&mut surfaces, fence.map(|(x, y, z)| DVec3::new(x, y, z)), 1.0, 0);
        }
        surfaces.build_hierarchy();
        let mut scene = scene(&camera, surfaces, 80, 256);
        let sun = scene.sun.as_mut().unwrap();
        (sun.toward, sun.color, sun.shadows, sun.angular_diameter) =
            (toward, DVec3::ONE, true, Angle::degrees(diameter));
        scene.sky.ambient = DVec3::ZERO;
        let plan = RenderPlan::new(&scene);
        assert_eq!(plan.active().has(EffectName::SoftShadows), is_in, "{height}: {:?}", plan.effects());
        let change = change(&scene);
        assert!(change < plan.tolerance(), "{height}, {diameter}: {change}");
    }
}

/// A chart of nothing but black and white bars, three to fifteen pixels wide. Along rows of pixels, each edge between two of them,
/// even the smallest blur takes light across: there, and there alone, more changes than is stated.
#[test]
fn also_of_a_test_chart_little_is_left_out() {
    use EffectName::{ApertureShape, Defocus};
    let chart = |effect: EffectName, step: i32, blades: u32, turn: f64| {
        let mut surfaces =
            Surfaces { materials: vec![plain([1.0; 3]), plain([0.0; 3])], ..Surfaces::default() };
        let setting =
            Setting { f_number: 1.4 * libm::exp2(f64::from(step) / 32.0), stretch: 1.03, ..ALIGNED };
        // In focus at 5.15 m; 6.15 m away a pixel is 1.2 mm x 6150 / 154.5.
        let (mut y, pixel, mut random) = (-64.0, 1.2e-3 * 6.15 / 0.1545, Random(9));
        let (sine, cosine) = libm::sincos(turn.to_radians());
        let mut number = 0;
        while y < 64.0 {
            let next = y + (3.0 + 13.0 * random.next()).floor();
            let at = |x: f64, y: f64| {
                DVec3::new(cosine * x - sine * y, sine * x + cosine * y, 0.0) * pixel
                    + DVec3::new(0.0, 0.0, -6.15)
            };
            quad(
                &mut surfaces,
                [at(-90.0, y), at(90.0, y), at(90.0, next), at(-90.0, next)],
                1.0,
                number % 2,
            );
            (y, number) = (next, number + 1);
        }
        let camera = camera(DVec3::ZERO, DVec3::NEG_Z, 150.0, setting);
        let mut scene = scene(&camera, surfaces, 100, 256);
        scene.sun = None;
        scene.sky.ambient = DVec3::ONE;
        if effect == ApertureShape {
            scene.blades = Some(Blades { count: blades, rotation: Angle::degrees(7.0) });
        }
        scene
    };
    for (effect, blades) in [(Defocus, 0), (ApertureShape, 3), (ApertureShape, 5), (ApertureShape, 8)] {
        for turn in [0.0, 7.0] {
            let small = (0..480).map(|step| chart(effect, step, blades, turn));
            let scene = small.into_iter().find(|scene| !RenderPlan::new(scene).active().has(effect)).unwrap();
            let change = change(&scene);
            let plan = RenderPlan::new(&scene);
            println!("{effect}, {blades} blades, {turn} degrees: {change:.5}, {}", plan.effects()[0].because);
            let most = plan.tolerance() * if turn == 0.0 { 3.0 } else { 1.0 };
            assert!(change > 0.0 && change <= most, "{effect}, {blades} blades, {turn} degrees: {change}");
        }
    }
}

#[test]
fn what_nothing_shades_has_no_shadows() {
    let camera = camera(DVec3::new(0.0, 3.0, 2.0), DVec3::ZERO, 150.0, ALIGNED);
    let of = |height: f64, degrees: f64, color: f64, with: &[EffectName]| {
        let mut surfaces = Surfaces { materials: vec![plain([0.8; 3])], ..Surfaces::default() };
        let corners = [(-50.0, 50.0), (50.0, 50.0), (50.0, -50.0), (-50.0, -50.0)];
        quad(&mut surfaces, corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 1.0, 0);
        // Out of view, and in the sun's way.
        let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
        quad(&mut surfaces, corners.map(|(x, z)| DVec3::new(x + height, height, z)), 1.0, 0);
        surfaces.build_hierarchy();
        let mut scene = scene(&camera, surfaces, 32, 16);
        let sun = scene.sun.as_mut().unwrap();
        (sun.toward, sun.color, sun.shadows) = (DVec3::new(1.0, 1.0, 0.0), DVec3::splat(color), true);
        sun.angular_diameter = Angle::degrees(degrees);
        scene.render.effects.with = with.iter().copied().collect();
        scene
    };
    let (shadows, soft) = (EffectName::Shadows, EffectName::SoftShadows);
    for (height, degrees, color, with, is_in) in [
        (0.0, 0.0, 1.0, &[][..], [false, false]),
        (0.0, 0.5, 1.0, &[], [false, false]),
        // The disk lights otherwise than its middle, and is nothing without shadows.
        (0.0, 40.0, 1.0, &[], [true, true]),
        (0.0, 0.5, 1.0, &[soft], [true, true]),
        (0.0, 0.5, 1.0, &[shadows], [true, false]),
        (20.0, 0.5, 1.0, &[], [true, true]),
        (20.0, 0.0, 1.0, &[], [true, false]),
        (20.0, 40.0, 0.0, &[], [false, false]),
    ] {
        let scene = of(height, degrees, color, with);
        let plan = RenderPlan::new(&scene);
        assert_eq!([shadows, soft].map(|name| plan.active().has(name)), is_in, "{:?}", plan.effects());
        let (picture, counts) = render(&scene, Execution::default()).unwrap();
        assert_eq!(counts.left_out.has(shadows), !is_in[0], "{:?}", plan.effects());
        let mut shaded = scene;
        shaded.render.effects.with = [shadows].into_iter().collect();
        let change = gap(&picture, &draw(&shaded));
        // But for rounding.
        assert!(is_in[0] || change < 1e-6, "{change}: {:?}", plan.effects());
    }
}

/// Small effects are hidden by others, if these are drawn.
#[test]
fn what_is_left_out_by_name_hides_nothing() {
    use EffectName::{Antialiasing, ApertureShape, Defocus, Diffraction, SoftShadows};
    let is_in = |scene: &Scene, effect: EffectName| {
        let plan = RenderPlan::new(scene);
        assert_eq!(render(scene, Execution::default()).unwrap().1.left_out, plan.left_out());
        plan.active().has(effect)
    };
    for effect in [Defocus, ApertureShape, SoftShadows, Diffraction] {
        let mut scene = largest_left_out(effect, 1);
        assert!(!is_in(&scene, effect), "{effect}");
        scene.render.effects.without = [Antialiasing].into_iter().collect();
        assert!(is_in(&scene, effect), "{effect}: {:?}", RenderPlan::new(&scene).effects());
    }
    // A ring of 1.2 pixels under a blur of hundreds.
    let setting = Setting { f_number: 16.0, stretch: 1.3, ..ALIGNED };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    let mut surfaces = yard(&mut Random(1), 60);
    surfaces.find_patches();
    let mut blurred = scene(&camera, surfaces, 480, 4);
    blurred.optics = Optics::new(&Camera {
        film: FilmSize { width: Length::millimetres(9.0), height: Length::millimetres(7.2) },
        ..camera
    })
    .unwrap();
    blurred.render.diffraction = true;
    assert!(!is_in(&blurred, Diffraction));
    blurred.render.effects.without = [Defocus].into_iter().collect();
    assert!(is_in(&blurred, Diffraction), "{:?}", RenderPlan::new(&blurred).effects());
}

#[test]
fn blur_is_measured_by_the_shorter_side_of_a_pixel() {
    let mut scene = largest_left_out(EffectName::Defocus, 1);
    scene.render.height *= 10;
    let plan = RenderPlan::new(&scene);
    assert!(plan.active().has(EffectName::Defocus), "{:?}", plan.effects()[0]);
}

/// A lamp beside the film, farther than half of its width, of which diffraction sends light all over the picture.
#[test]
fn a_lamp_that_only_diffraction_brings_in_is_seen() {
    let camera = camera(DVec3::ZERO, DVec3::NEG_Z, 150.0, Setting { f_number: 90.0, ..ALIGNED });
    let film = [6.0, 4.8].map(Length::millimetres);
    let camera = Camera { film: FilmSize { width: film[0], height: film[1] }, ..camera };
    let at = |millimetres: f64| {
        let mut lamp = plain([0.0; 3]);
        lamp.emission = [2000.0; 3];
        let mut surfaces = Surfaces { materials: vec![lamp], ..Surfaces::default() };
        let away = camera.extension.as_metres();
        let corner = |x: f64, y: f64| DVec3::new((millimetres + x) * 1e-3, y * 1e-3, -away) * (5.0 / away);
        quad(
            &mut surfaces,
            [corner(0.0, -1.0), corner(0.6, -1.0), corner(0.6, 1.0), corner(0.0, 1.0)],
            1.0,
            0,
        );
        let mut scene = scene(&camera, surfaces, 40, 1024);
        (scene.sun, scene.sky.ambient, scene.sky.zenith, scene.sky.horizon) =
            (None, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        scene.render.diffraction = true;
        scene
    };
    for (millimetres, is_in) in [(4.6, true), (30.0, false)] {
        let mut scene = at(millimetres);
        let plan = RenderPlan::new(&scene);
        assert_eq!(plan.active().has(EffectName::Diffraction), is_in, "{:?}", plan.effects());
        // Few samples go so far, and of so many all pixels have the same.
        let has_light = (0..20).any(|seed| {
            scene.render.seed = seed;
            let picture = draw(&scene);
            let mut places = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
            places.any(|(x, y)| picture.pixel(x, y)[0] > 0.0)
        });
        assert_eq!(has_light, is_in);
    }
}

#[test]
fn what_is_not_in_view_is_not_lit_by_a_wide_sun() {
    let camera = camera(DVec3::new(0.0, 0.0, 10.0), DVec3::new(0.0, 0.0, 20.0), 150.0, ALIGNED);
    let mut surfaces = Surfaces { materials: vec![plain([0.8; 3])], ..Surfaces::default() };
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    quad(&mut surfaces, corners.map(|(x, y)| DVec3::new(x, y, 0.0)), 1.0, 0);
    surfaces.build_hierarchy();
    let mut scene = scene(&camera, surfaces, 32, 16);
    let sun = scene.sun.as_mut().unwrap();
    (sun.toward, sun.shadows, sun.angular_diameter) = (DVec3::new(0.0, 0.1, 1.0), true, Angle::degrees(20.0));
    let plan = RenderPlan::new(&scene);
    for name in [EffectName::Shadows, EffectName::SoftShadows] {
        assert!(!plan.active().has(name) && plan.left_out().has(name), "{:?}", plan.effects());
    }
    assert_eq!(render(&scene, Execution::default()).unwrap().1.left_out, plan.left_out());
}

#[test]
fn each_effect_can_be_left_out() {
    let scene = at(5.6, 7, 2.0);
    let with = draw(&scene);
    for name in [EffectName::Antialiasing, EffectName::Textures, EffectName::Defocus] {
        let mut scene = at(5.6, 7, 2.0);
        scene.render.effects = EffectChoice { without: [name].into_iter().collect(), ..Default::default() };
        assert!(!RenderPlan::new(&scene).active().has(name));
        assert!(gap(&with, &draw(&scene)) > 0.002, "{name} makes no difference");
    }
}

/// Without holes they are filled, without textures a surface has their mean.
#[test]
fn what_is_left_out_is_replaced_by_what_is_stated() {
    let camera = camera(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 150.0, ALIGNED);
    let wall =
        |z: f64| [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| DVec3::new(x, y, z));
    let texture = |texels: [[u16; 4]; 2]| {
        let level = Level { width: 2, height: 1, texels: texels.to_vec() };
        Some(std::sync::Arc::new(Texture::from_level(level).unwrap()))
    };
    let with = |surfaces: Surfaces, without: Option<EffectName>| {
        let mut scene = scene(&camera, surfaces, 24, 16);
        scene.sun = None;
        scene.sky.ambient = DVec3::ONE;
        scene.render.effects = EffectChoice { without: without.into_iter().collect(), ..Default::default() };
        let picture = draw(&scene);
        let pixels = (0..picture.height()).flat_map(|y| (0..24).map(move |x| (x, y)));
        pixels.flat_map(|(x, y)| picture.pixel(x, y)).map(f64::from).collect::<Vec<_>>()
    };
    let all = |values: &[f64], expected: f64| values.iter().all(|value| (value - expected).abs() < 1e-4);

    // A black pane that is nothing but a hole, before a lamp.
    let mut holed = Surfaces { materials: vec![plain([0.0; 3]), plain([0.0; 3])], ..Default::default() };
    holed.materials[0].emission = [1.0; 3];
    holed.materials[1].opacity_map = texture([[u16::MAX, 0, 0, 0]; 2]);
    quad(&mut holed, wall(-1.0), 1.0, 0);
    quad(&mut holed, wall(0.0), 1.0, 1);
    assert!(all(&with(holed.clone(), None), 1.0));
    assert!(all(&with(holed, Some(EffectName::Holes)), 0.0));

    let mut textured = Surfaces { materials: vec![plain([1.0; 3])], ..Default::default() };
    textured.materials[0].diffuse_map =
        texture([[0x4000, 0x4000, 0x4000, u16::MAX], [0xc000, 0xc000, 0xc000, u16::MAX]]);
    quad(&mut textured, wall(0.0), 9.0, 0);
    let seen = with(textured.clone(), None);
    assert!(seen.iter().any(|&value| value < 0.3) && seen.iter().any(|&value| value > 0.7));
    assert!(all(&with(textured, Some(EffectName::Textures)), 0.5));
}

#[test]
fn the_shape_of_an_aperture_brings_the_blur_that_shows_it() {
    let mut scene = at(4000.0, 7, 0.0);
    scene.blades = Some(Blades { count: 5, rotation: Angle::degrees(7.0) });
    let two = [EffectName::ApertureShape, EffectName::Defocus];
    assert!(two.into_iter().all(|effect| !RenderPlan::new(&scene).active().has(effect)));
    let without = draw(&scene);
    scene.render.effects.with = [EffectName::ApertureShape].into_iter().collect();
    assert!(two.into_iter().all(|effect| RenderPlan::new(&scene).active().has(effect)));
    assert!(gap(&without, &draw(&scene)) > 0.0);
    // Diffraction shows it, too.
    scene.render.diffraction = true;
    let plan = RenderPlan::new(&scene);
    assert!(plan.active().has(EffectName::Diffraction) && !plan.active().has(EffectName::Defocus));
}

#[test]
fn what_only_casts_shadows_into_view_is_in() {
    let (keep, folder) = folder(CAMERA);
    let mesh = "mtllib m.mtl\nv -10 -10 0\nv 10 -10 0\nv 0 20 0\nusemtl wall\nf 1 2 3\nv -40 -40 80\nv 40 -40 80\nv 0 60 80\nusemtl \
                pane\nf 4 5 6\n";
    std::fs::write(folder.join("t.obj"), mesh).unwrap();
    std::fs::write(folder.join("m.mtl"), "newmtl wall\nKd 1 1 1\nnewmtl pane\nKd 1 1 1\nd 0.5\n").unwrap();
    // A flat picture, of which explain measures fewer rays to the sun.
    let camera = CAMERA.replace("film = \"4x5\"", "film_mm = [120.0, 30.0]");
    for (sun, is_in) in [("shadows = true\n", true), ("shadows = false\n", false)] {
        let text = format!(
            "{camera}[[mesh]]\npath = \"t.obj\"\n[sun]\ntoward = [0, 0, 1]\ncolor = [1, 1, 1]\n{sun}"
        );
        std::fs::write(folder.join("scene.toml"), text).unwrap();
        let json = run(&folder, &["explain", "scene.toml", "--json"]).expect(0, &[]).json();
        let coverage =
            json["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "coverage").unwrap();
        assert_eq!(coverage["active"], is_in, "{coverage}");
        let change = coverage["change_rms"].as_f64().unwrap();
        assert_eq!(change > 0.1, is_in, "{coverage}");
    }
    drop(keep);
}

#[test]
fn what_is_nowhere_is_out_without_a_filter_too() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    let effects = |scene: String, flags: &[&str]| {
        std::fs::write(folder.join("a.toml"), scene).unwrap();
        let words = [&["explain", "a.toml", "--json"], flags].concat();
        let json = run(&folder, &words).expect(0, &[]).json();
        move |name: &str| {
            let found = json["effects"].as_array().unwrap().iter().find(|e| e["effect"] == name).unwrap();
            (found["active"].as_bool().unwrap(), found["because"].as_str().unwrap().to_owned())
        }
    };
    // Points instead of squares hide no blur and no penumbra; where nothing is in view there are none.
    let sun = "[sun]\ntoward = [0.3, 1, 0.4]\ncolor = [1, 1, 1]\nangular_diameter_deg = 2\nshadows = true\n";
    let away = format!("{CAMERA}{SMALL}{sun}").replace("[0.0, 1.6, 0.0]", "[0.0, 1.6, 99.0]");
    assert!(away.contains("99.0"), "{away}");
    let found = effects(away, &["--without", "antialiasing"]);
    for name in ["defocus", "shadows", "soft-shadows"] {
        assert!(!found(name).0, "{name}: {}", found(name).1);
    }
    // A pane out of view casts no shadow where there is no light.
    let black = sun.replace("[1, 1, 1]", "[0, 0, 0]");
    std::fs::write(folder.join("p.obj"), "mtllib p.mtl\nusemtl p\nv 0 0 99\nv 1 0 99\nv 0 1 99\nf 1 2 3\n")
        .unwrap();
    std::fs::write(folder.join("p.mtl"), "newmtl p\nd 0.4\n").unwrap();
    for (sun, is_in) in [(&black, false), (&sun.to_owned(), true)] {
        let found = effects(format!("{CAMERA}{SMALL}[[mesh]]\npath = \"p.obj\"\n{sun}"), &[]);
        assert_eq!(found("coverage").0, is_in, "{}", found("coverage").1);
    }
}

#[test]
fn explain_tells_every_effect() {
    // Focused before the triangle, which stands at the distance of the camera's own extension.
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}").replace("152.3", "156"));
    let found = run(&folder, &["explain", "scene.toml", "--json", "--width", "800"]);
    let json = found.expect(0, &[]).json();
    let effects = json["effects"].as_array().unwrap();
    let names: Vec<_> = effects.iter().map(|e| e["effect"].as_str().unwrap()).collect();
    assert_eq!(names, EffectName::ALL.map(EffectName::name));
    assert!(effects.iter().all(|e| e["active"].is_boolean() && e["because"].is_string()));
    assert_eq!(effects[0]["active"], true);
    // The triangle's image stands at 150 x 10000 / 9850 = 152.284 mm; 26.786 mm x 3.716 / 152.284 = 0.6536 mm are 4.357 of 0.15 mm.
    let because = effects[0]["because"].as_str().unwrap();
    let blur: f64 = because.split(' ').nth(2).unwrap().parse().unwrap();
    assert!(because.starts_with("largest blur ") && (blur / 4.357 - 1.0).abs() < 0.01, "{because}");
    assert_eq!((&json["width"], &json["probe"]["samples"]), (&800.into(), &64.into()));
    // Also tall film is shown whole, and its pixels are square: 10 x 120 mm.
    let tall = format!("{CAMERA}{SMALL}").replace("film = \"4x5\"", "film_mm = [10.0, 120.0]");
    std::fs::write(folder.join("tall.toml"), tall).unwrap();
    let json_of_tall = run(&folder, &["explain", "tall.toml", "--json"]).expect(0, &[]).json();
    let size = ["width", "height"].map(|side| json_of_tall["probe"][side].as_u64().unwrap());
    assert_eq!(size, [53, 640]);
    assert!(effects[0]["cost"].is_number() && effects[0]["change_rms"].as_f64().unwrap() > 0.0);
    // Through a pinhole 156 mm before a film of 120 x 96 mm a corner has 1 - cos^4 = 1 - 1 / (1 + 5904 / 24336)^2 = 0.352 less light.
    let pinhole = CAMERA.replace("f_number = 5.6", "pinhole = true").replace("152.3", "156");
    let small = SMALL.replace("samples", "falloff = true\nsamples");
    std::fs::write(folder.join("pinhole.toml"), format!("{pinhole}{small}")).unwrap();
    let because = |json: &serde_json::Value| {
        let found = json["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "falloff");
        found.unwrap()["because"].as_str().unwrap().to_owned()
    };
    let said = because(&run(&folder, &["explain", "pinhole.toml", "--json"]).expect(0, &[]).json());
    assert!(said.contains("by up to 0.35"), "{said}");
    let text = run(&folder, &["explain", "scene.toml"]);
    assert!(text.expect(0, &[]).out.contains("antialiasing    in"), "{}", text.out);

    run(&folder, &["render", "scene.toml", "-o", "o.png", "--without", "defocus", "--stats", "s.json"])
        .expect(0, &[]);
    let stats: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["effects"][0]["active"], false);
    assert!(stats["effects"][0]["because"].as_str().unwrap().contains("--without defocus"));
    run(&folder, &["explain", "scene.toml", "--without", "bokeh"]).expect(64, &["aperture-shape"]);
    run(&folder, &["explain", "scene.toml", "--with", "shadows"]).expect(64, &["[sun]"]);
    run(&folder, &["explain", "scene.toml", "--with", "holes", "--without", "holes"])
        .expect(64, &["--without"]);
    run(&folder, &["explain", "scene.toml", "--with", "soft-shadows", "--without", "shadows"])
        .expect(64, &["--without shadows"]);
    run(&folder, &["explain", "scene.toml", "--with", "aperture-shape", "--without", "defocus"])
        .expect(64, &["--without defocus"]);
    let small =
        run(&folder, &["explain", "scene.toml", "--json", "--max-error", "0.001"]).expect(0, &[]).json();
    assert_eq!(small["tolerance_rms"], 0.0005);
    run(&folder, &["explain", "scene.toml", "--max-error", "0"]).expect(64, &["positive"]);
    run(&folder, &["explain", "nothing.toml"]).expect(2, &["nothing.toml"]);
    // Diffraction that this scene cannot have, and does not ask for.
    let leaning = CAMERA.replace("5.6", "3000");
    let scene = format!("{leaning}[camera.rear]\ntilt_deg = 45\n{SMALL}");
    std::fs::write(folder.join("leaning.toml"), scene).unwrap();
    let json = run(&folder, &["explain", "leaning.toml", "--json"]).expect(0, &[]).json();
    let diffraction = json["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "diffraction");
    assert!(diffraction.unwrap()["cost"].is_null() && json["effects"][1]["change_rms"].is_number());
    run(&folder, &["render", "leaning.toml", "-o", "o.png", "--with", "diffraction", "--width", "160"])
        .expect(2, &["render.diffraction"]);
}
