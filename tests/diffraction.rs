//! Diffraction against closed forms: Airy's rings and their light, the transform of a polygon, rays of a star, a film that leans.

mod common;

use common::scenes::{Random, Setting, camera, plain, quad, scene, yard};
use glam::{DVec2, DVec3};
use groundglass::camera::{Aperture, FilmSize};
use groundglass::optics::WAVELENGTH;
use groundglass::plan::RenderPlan;
use groundglass::quantity::{Angle, FNumber, Length};
use groundglass::render::{Execution, render, replay};
use groundglass::sampling::{ApertureShape, Diffraction, diffraction_square, intensity};
use groundglass::scene::{Blades, Budget, EffectName, Scene, Surfaces};
use groundglass::{Exposure, Optics};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Airy's dark rings: zeros of J1.
const RINGS: [f64; 2] = [3.831_705_970_2, 7.015_586_669_8];

fn square(x: f64) -> f64 {
    x * x
}

/// The light within `k` of Airy's pattern (Rayleigh): 1 - J0^2 - J1^2.
fn encircled(k: f64) -> f64 {
    1.0 - square(libm::j0(k)) - square(libm::j1(k))
}

fn polygon(blades: u32, rotation: f64) -> ApertureShape {
    ApertureShape::Polygon { blades, rotation }
}

fn points(pattern: &Diffraction, count: u32) -> Vec<DVec2> {
    (0..count).map(|k| DVec2::from_array(pattern.from_square(diffraction_square(3, 4, k)))).collect()
}

#[test]
fn a_disk_sends_light_as_airy_says() {
    let pattern = Diffraction::new(&ApertureShape::Disk);
    assert!((encircled(RINGS[0]) - 0.838).abs() < 5e-4 && (encircled(RINGS[1]) - 0.910).abs() < 5e-4);
    // Forty rings: the fortieth zero of J1 is 126.4.
    assert!(pattern.kept() > 0.995 && pattern.reach() > 126.45);
    assert!((pattern.kept() - encircled(pattern.reach())).abs() < 1e-4, "{}", pattern.kept());
    let count = 1 << 16;
    let mut found: Vec<f64> = points(&pattern, count).iter().map(|k| k.length()).collect();
    found.sort_by(f64::total_cmp);
    let mut worst = 0.0f64;
    for (i, &k) in found.iter().enumerate() {
        worst = worst.max((i as f64 / f64::from(count) - encircled(k) / pattern.kept()).abs());
    }
    println!("{:.2} % kept, largest gap of the encircled light {worst:.1e}", 100.0 * pattern.kept());
    assert!(worst < 3e-4);
}

#[test]
fn a_polygons_transform_is_the_integral_over_it() {
    // The map from the unit square is true to area, so a mean over the square is one over the aperture.
    let side = 400;
    for shape in [polygon(3, 0.2), polygon(5, 0.0), polygon(8, -1.0), ApertureShape::Disk] {
        for k in [DVec2::new(0.3, 0.1), DVec2::new(2.0, -3.0), DVec2::new(-7.0, 1.0), DVec2::new(0.0, 11.0)] {
            let (mut real, mut imaginary) = (0.0, 0.0);
            for i in 0..side * side {
                let square = [i % side, i / side].map(|c| (c as f32 + 0.5) / side as f32);
                let s = DVec2::from_array(shape.from_square(square).map(f64::from));
                let (sine, cosine) = libm::sincos(k.dot(s));
                real += cosine;
                imaginary -= sine;
            }
            let wanted = (real * real + imaginary * imaginary) / square(f64::from(side * side));
            let found = intensity(&shape, k.to_array());
            assert!((found - wanted).abs() < 1e-4, "{shape:?} {k}: {found} {wanted}");
        }
    }
}

#[test]
fn a_square_is_a_product_of_slits() {
    // Corners on the unit circle at 45 degrees: sides of sqrt(2), each a slit's sinc^2.
    let shape = polygon(4, FRAC_PI_4);
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(x) / x };
    let mut random = Random(1);
    for round in 0..2000 {
        let size = [1e-7, 1e-3, 1.0, 200.0][round % 4];
        let k = [random.range(-size, size), if round % 3 == 0 { 0.0 } else { random.range(-size, size) }];
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let wanted = square(sinc(k[0] * half) * sinc(k[1] * half));
        let found = intensity(&shape, k);
        assert!((found - wanted).abs() < 1e-11, "{k:?}: {found} {wanted}");
    }
    // And sampled: along each axis as a slit sends it.
    let pattern = Diffraction::new(&shape);
    let count = 1 << 17;
    let found = points(&pattern, count);
    for zero in 1..4 {
        // The slit's dark lines, at multiples of pi over half its width.
        let edge = f64::from(zero) * PI * std::f64::consts::SQRT_2;
        let steps = 4000;
        let slit = |to: f64| -> f64 {
            (0..steps)
                .map(|i| {
                    let x = (f64::from(i) + 0.5) / f64::from(steps) * to * std::f64::consts::FRAC_1_SQRT_2;
                    2.0 * square(sinc(x)) * to * std::f64::consts::FRAC_1_SQRT_2 / f64::from(steps) / PI
                })
                .sum()
        };
        for axis in 0..2 {
            let inside = found.iter().filter(|k| k[axis].abs() < edge).count() as f64 / f64::from(count);
            // What is cut off is 0.4 %, nearly all of it along the two axes.
            let (low, high) = (slit(edge) - 1e-3, slit(edge) / pattern.kept() + 1e-3);
            assert!((low..high).contains(&inside), "{zero}: {inside} outside {low}..{high}");
        }
    }
}

#[test]
fn the_sampled_pattern_of_a_polygon_is_its_transform() {
    for blades in [3, 4, 5, 6, 7, 12, 100] {
        let shape = polygon(blades, 0.3);
        let pattern = Diffraction::new(&shape);
        println!("{blades} blades: {:.3} % kept within {:.0}", 100.0 * pattern.kept(), pattern.reach());
        assert!((0.995..0.9975).contains(&pattern.kept()), "{blades}: {}", pattern.kept());
        let (count, bins, half) = (1u32 << 17, 24usize, 12.0);
        let mut found = vec![0u32; bins * bins];
        for k in points(&pattern, count) {
            assert!(k.length() <= pattern.reach() * (1.0 + 1e-9));
            let place = (k + half) / (2.0 * half) * bins as f64;
            if place.min_element() >= 0.0 && place.max_element() < bins as f64 {
                found[place.y as usize * bins + place.x as usize] += 1;
            }
        }
        let fine = 12;
        let cell = 2.0 * half / (bins * fine) as f64;
        let all = TAU * TAU / shape.area() * pattern.kept();
        let mut worst = 0.0f64;
        for (bin, &found) in found.iter().enumerate() {
            let mut share = 0.0;
            for i in 0..fine * fine {
                let at = |bin: usize, i: usize| ((bin * fine + i) as f64 + 0.5) * cell - half;
                share += intensity(&shape, [at(bin % bins, i % fine), at(bin / bins, i / fine)]);
            }
            let wanted = share * cell * cell / all * f64::from(count);
            worst = worst.max((f64::from(found) - wanted).abs() / (wanted + 4.0).sqrt());
        }
        println!("{blades} blades: a bin is off by {worst:.2} times what chance would make it");
        assert!(worst < 4.0, "{blades} blades: {worst}");
    }
}

#[test]
fn five_blades_make_ten_rays_that_turn_with_them() {
    for (blades, rays, rotation) in
        [(5u32, 10usize, 0.0), (5, 10, 0.3), (6, 6, 0.1), (7, 14, -0.2), (4, 4, 0.5)]
    {
        let pattern = Diffraction::new(&polygon(blades, rotation));
        let bins = 180;
        let mut by_angle = vec![0u32; bins];
        for k in points(&pattern, 1 << 18).into_iter().filter(|k| k.length() > 60.0) {
            let turn = libm::atan2(k.x, k.y) / TAU;
            by_angle[((turn - turn.floor()) * bins as f64) as usize % bins] += 1;
        }
        let mean = by_angle.iter().sum::<u32>() / bins as u32;
        let is_bright = |at: usize| by_angle[at % bins] > 3 * mean;
        let starts: Vec<usize> = (0..bins).filter(|&at| is_bright(at + 1) && !is_bright(at)).collect();
        assert_eq!(starts.len(), rays, "{blades} blades");
        for start in starts {
            let end = (start + 1..).find(|&at| !is_bright(at)).unwrap();
            let middle = 0.5 * (start + 1 + end) as f64 / bins as f64 * TAU;
            // Each side's normal, halfway between two corners, and what is opposite.
            let spacing = TAU / rays as f64;
            let offset = rotation + PI / f64::from(blades);
            let off = (middle - offset) / spacing;
            assert!((off - off.round()).abs() * spacing < 0.02, "{blades} blades: a ray at {middle}");
        }
    }
}

#[test]
fn the_film_is_displaced_as_the_phase_says() {
    let mut random = Random(8);
    for _ in 0..300 {
        let mut angle = || random.range(-25.0, 25.0);
        let setting = Setting {
            front: [angle(), angle()],
            rear: [angle(), angle()],
            f_number: 32.0,
            stretch: 1.1,
            rise: angle(),
        };
        let optics = Optics::new(&camera(DVec3::ZERO, DVec3::NEG_Z, 150.0, setting)).unwrap();
        let (x, y) = (random.range(-0.06, 0.06), random.range(-0.05, 0.05));
        let k = DVec2::new(random.range(-9.0, 9.0), random.range(-9.0, 9.0));
        let d = optics.diffraction_at(x, y) * k;
        let ((fx, fy), p) = (optics.film_axes(), optics.film_point(x, y));
        let d = fx * d.x + fy * d.y;
        let (r, c) = (p.length(), p.normalize());
        let t = d - c * d.dot(c);
        let s = DVec2::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0));
        let radius = optics.aperture_radius();
        let phase = TAU * optics.lens_point(s.x * radius, s.y * radius).dot(t) / (WAVELENGTH * r);
        assert!((phase - s.dot(k)).abs() < 1e-9, "{phase} {}", s.dot(k));
    }
}

/// A square light of a pixel at `(x, y)` pixels from the middle of the picture, sharp, in the dark; Airy's first dark ring,
/// or what it is for blades, `ring` pixels from its middle, on a film tilted by `tilt` degrees of so many pixels.
fn star(size: u32, (x, y): (f64, f64), ring: f64, tilt: f64, samples: u32) -> (Scene, f64) {
    let (film, stretch, f) = (1e-3, 1.25, 0.1);
    let pixel = film / f64::from(size);
    let f_number = ring * pixel * f / (1.22 * WAVELENGTH * f * stretch);
    let setting = Setting { front: [0.0; 2], rear: [tilt, 0.0], f_number, stretch, rise: 0.0 };
    let mut camera = camera(DVec3::ZERO, DVec3::NEG_Z, 1e3 * f, setting);
    camera.film = FilmSize { width: Length::metres(film), height: Length::metres(film) };
    camera.aperture = Aperture::FNumber(FNumber::new(f_number).unwrap());
    let mut surfaces = Surfaces { materials: vec![plain([0.0; 3])], ..Default::default() };
    surfaces.materials[0].emission = [1.0; 3];
    // Twice the extension is f / (stretch - 1) times as far as the object, and as much larger.
    let distance = f * stretch / (stretch - 1.0);
    let to_object = pixel * distance / (f * stretch);
    let (center, half) = (DVec3::new(x, -y, 0.0) * to_object - DVec3::Z * distance, 0.5 * to_object);
    let corner = |dx: f64, dy: f64| center + DVec3::new(dx, dy, 0.0) * half;
    quad(&mut surfaces, [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], 1.0, 0);
    let mut scene = scene(&camera, surfaces, size, samples);
    scene.render.height = size;
    scene.sun = None;
    (scene.sky.ambient, scene.sky.horizon, scene.sky.zenith) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    scene.render.diffraction = true;
    // The light's image, square pixels.
    let area = 1.0 / libm::cos(tilt.to_radians());
    (scene, area)
}

fn draw(scene: &Scene) -> Exposure {
    render(scene, Execution::default()).unwrap().0
}

/// The light of the pixels whose middles satisfy `is_in`, from the picture's middle, to the right and down.
fn light(picture: &Exposure, is_in: impl Fn(f64, f64) -> bool) -> f64 {
    let (width, height) = (picture.width(), picture.height());
    let mut sum = 0.0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let from = |at: u32, size: u32| f64::from(at) + 0.5 - 0.5 * f64::from(size);
        if is_in(from(x, width), from(y, height)) {
            sum += f64::from(picture.pixel(x, y)[0]);
        }
    }
    sum
}

#[test]
fn a_point_of_light_shows_airys_rings() {
    let (scene, area) = star(64, (0.0, 0.0), 8.0, 0.0, 65_536);
    let picture = draw(&scene);
    let kept = Diffraction::new(&ApertureShape::Disk).kept();
    for (zero, wanted) in RINGS.into_iter().zip([0.838, 0.910]) {
        let radius = 8.0 * zero / RINGS[0];
        let found = light(&picture, |x, y| libm::hypot(x, y) < radius) / area * kept;
        println!("within {radius:.1} pixels: {found:.4} of the light, in theory {wanted}");
        assert!((found - wanted).abs() < 6e-3, "{found} {wanted}");
    }
    // The darkest ring between the middle and the first bright one lies at 1.22 lambda r / A.
    let ring = |radius: f64| {
        let is_in = |x: f64, y: f64| (libm::hypot(x, y) - radius).abs() < 0.5;
        light(&picture, is_in) / (TAU * radius)
    };
    let darkest = (10..24).map(|i| 0.5 * f64::from(i)).min_by(|a, b| ring(*a).total_cmp(&ring(*b))).unwrap();
    println!("darkest at {darkest} pixels, {:.4} of the middle", ring(darkest) / ring(1.0));
    assert!((darkest - 8.0).abs() <= 0.5 && ring(darkest) < 0.01 * ring(1.0));
}

#[test]
fn on_a_film_that_leans_the_rings_are_stretched() {
    for tilt in [50.0f64, -35.0] {
        let (scene, area) = star(64, (0.0, 0.0), 8.0, tilt, 65_536);
        let picture = draw(&scene);
        let kept = Diffraction::new(&ApertureShape::Disk).kept();
        let long = 8.0 / libm::cos(tilt.to_radians());
        let ellipse = |x: f64, y: f64| libm::hypot(x / 8.0, y / long) < 1.0;
        let found = light(&picture, ellipse) / area * kept;
        println!("tilted by {tilt}: {found:.4} within the first dark ring, in theory 0.838");
        assert!((found - 0.838).abs() < 6e-3, "{found}");
        // Upright, not across.
        let about = |(a, b): (f64, f64)| {
            light(&picture, |x, y| (x.abs() - a).abs() < 1.5 && (y.abs() - b).abs() < 1.5)
        };
        let (aside, above) = (about((8.0, 0.0)), about((0.0, 8.0)));
        println!("eight pixels aside {aside:.5}, above {above:.5}");
        assert!(above > 4.0 * aside, "{aside} {above}");
    }
}

#[test]
fn light_from_beside_the_picture_gets_in() {
    // Five pixels beyond the right edge: what reaches the picture is the integral of the pattern over it.
    let (scene, area) = star(64, (37.0, 3.0), 6.0, 0.0, 16_384);
    let picture = draw(&scene);
    let pattern = Diffraction::new(&ApertureShape::Disk);
    let (to_k, fine) = (RINGS[0] / 6.0, 4);
    let mut wanted = 0.0;
    for i in 0..(64 * fine * 64 * fine) {
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(fine) - 32.0;
        let k = DVec2::new(at(i % (64 * fine)) - 37.0, at(i / (64 * fine)) - 3.0) * to_k;
        wanted += intensity(&ApertureShape::Disk, k.to_array());
    }
    let cell = square(to_k / f64::from(fine));
    wanted *= area * cell / (4.0 * PI * pattern.kept());
    let found = light(&picture, |_, _| true);
    println!("{found:.5} of light gets in, in theory {wanted:.5}");
    assert!((found / wanted - 1.0).abs() < 0.05, "{found} {wanted}");
}

#[test]
fn a_uniform_sky_stays_as_it_is() {
    let (mut scene, _) = star(40, (0.0, 0.0), 3.0, 20.0, 24);
    scene.surfaces = Surfaces::default();
    (scene.sky.horizon, scene.sky.zenith) = (DVec3::new(0.7, 0.5, 0.3), DVec3::new(0.7, 0.5, 0.3));
    scene.render.effects.all = true;
    assert!(RenderPlan::new(&scene).active().has(EffectName::Diffraction));
    for budget in [Budget::Samples(3), Budget::Samples(24), Budget::MaxError(0.01), Budget::Samples(65_536)] {
        scene.render.budget = budget;
        // Rounding of many sums, which no halves tell, shows in any pixel.
        let side = if budget == Budget::Samples(65_536) { 4 } else { 40 };
        (scene.render.width, scene.render.height) = (side, side);
        let picture = draw(&scene);
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            for (found, wanted) in picture.pixel(x, y).into_iter().zip([0.7, 0.5, 0.3]) {
                assert!((found - wanted).abs() < 1e-6, "{x},{y}: {found}");
            }
        }
    }
}

fn bits(picture: &Exposure) -> Vec<[u32; 3]> {
    let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| picture.pixel(x, y).map(f32::to_bits)).collect()
}

fn garden(f_number: f64, width: u32, samples: u32) -> Scene {
    let setting = Setting { front: [3.0, 0.0], rear: [0.0; 2], f_number, stretch: 1.03, rise: 0.0 };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    let mut scene = scene(&camera, yard(&mut Random(3), 60), width, samples);
    scene.render.diffraction = true;
    scene
}

#[test]
fn an_effect_left_out_leaves_nothing_behind() {
    let mut scene = garden(8.0, 96, 16);
    assert!(!RenderPlan::new(&scene).active().has(EffectName::Diffraction));
    let dropped = bits(&draw(&scene));
    scene.render.diffraction = false;
    assert!(dropped == bits(&draw(&scene)));
    // Computed all the same, it changes less than is taken for nothing.
    scene.render.diffraction = true;
    let planned = draw(&scene);
    scene.render.effects.all = true;
    let change = planned.rms_difference(&draw(&scene), 0.0);
    println!("left out: {change:.5}");
    assert!(change > 0.0 && change < RenderPlan::new(&scene).tolerance());
}

#[test]
fn the_plan_keeps_what_can_be_seen() {
    let is_in = |scene: &Scene, name| RenderPlan::new(scene).active().has(name);
    let mut scene = garden(400.0, 400, 16);
    assert!(is_in(&scene, EffectName::Diffraction));
    // A star has the aperture's shape, however sharp the picture.
    scene.blades = Some(Blades { count: 5, rotation: Angle::ZERO });
    assert!(is_in(&scene, EffectName::ApertureShape));
    let five = bits(&draw(&scene));
    scene.blades = Some(Blades { count: 5, rotation: Angle::degrees(36.0) });
    assert!(five != bits(&draw(&scene)));
    scene.render.effects.without = [EffectName::Diffraction].into_iter().collect();
    assert!(!is_in(&scene, EffectName::Diffraction));
    // A small light is seen where grey things are not.
    let mut scene = garden(8.0, 96, 16);
    for material in &mut scene.surfaces.materials {
        material.emission = [1e4; 3];
    }
    assert!(is_in(&scene, EffectName::Diffraction));
}

#[test]
fn rounds_and_their_replay_are_the_same_bytes() {
    let mut scene = garden(300.0, 70, 16);
    scene.render.budget = Budget::MaxError(0.01);
    let first = draw(&scene);
    let again =
        replay(&scene, first.samples(), Execution { threads: Some(1), ..Execution::default() }).unwrap().0;
    assert!(bits(&first) == bits(&again));
    let true_error = {
        scene.render.budget = Budget::Samples(4096);
        scene.render.seed = 77;
        first.rms_difference(&draw(&scene), 0.0)
    };
    println!("asked for 0.01, stated {:?}, true {true_error:.5}", first.rms_error());
    assert!(true_error < 0.012);
}
