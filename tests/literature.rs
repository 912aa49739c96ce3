//! Numbers that others published, with their sources.
//!
//! * H. M. Merklinger, "View Camera Focus and Depth of Field", View Camera, July/August 1996, pp 55-57 (part I)
//!   and September/October 1996, pp 56-58 (part II); *Focusing the View Camera*, 1993.
//! * Wikipedia, "Scheimpflug principle" (formulas after Merklinger 1996).
//! * Tilt chart of a 24 mm PC-E lens, as published on a photographer's page of 11 October 2012.
//! * Summerhayes's rule as told by J. Kasson, "Scheimpflug for dummies".
//! * Training manual 14209 (Photography, Basic): depth of field of a 155 mm lens at 10 feet.

use glam::{DMat3, DVec3};
use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::geometry::Pose;
use groundglass::optics::{Adjust, FocusTarget, Optics, solve};
use groundglass::quantity::{Angle, FNumber, Length};

const FOOT: f64 = 0.3048;

fn camera(focal_mm: f64, f_number: f64, front_deg: f64, rear_deg: f64, extension_mm: f64) -> Camera {
    let tilted = |degrees| Standard { tilt: Angle::degrees(degrees), ..Standard::default() };
    Camera {
        rail: Pose { origin: DVec3::ZERO, axes: DMat3::IDENTITY },
        front: tilted(front_deg),
        rear: tilted(rear_deg),
        extension: Length::millimetres(extension_mm),
        focal_length: Length::millimetres(focal_mm),
        aperture: Aperture::FNumber(FNumber::new(f_number).unwrap()),
        film: FilmSize::named("4x5").unwrap(),
        near: Length::millimetres(10.0),
    }
}

fn hinge(focal_mm: f64, tilt: f64) -> f64 {
    Optics::new(&camera(focal_mm, 16.0, tilt, 0.0, focal_mm)).unwrap().hinge_distance().unwrap()
}

#[test]
fn merklinger_1996_examples_of_the_hinge_distance() {
    // Part I, examples 1 and 2: for J = 4.2 feet "near enough" 7 degrees; example 3: just over 2 feet.
    assert!((hinge(150.0, 7.0) / FOOT - 4.0381).abs() < 5e-5);
    assert!((hinge(150.0, 6.729) / FOOT - 4.2).abs() < 5e-4);
    assert!((hinge(150.0, 14.0) / FOOT - 2.0342).abs() < 5e-5);
}

#[test]
fn merklinger_1996_example_4_back_and_lens_tilted() {
    // Back 30 degrees and lens 26 degrees forward: J = 7 ft, the hinge up and forward, 30 degrees off the vertical.
    let optics = Optics::new(&camera(150.0, 16.0, 26.0, 30.0, 160.0)).unwrap();
    assert!((optics.hinge_distance().unwrap() / FOOT - 7.0549).abs() < 5e-5);
    let hinge = optics.hinge_line().nearest_to_origin().to_affine();
    assert!(hinge.y > 0.0 && hinge.z < 0.0, "up and forward: {hinge}");
    let off_vertical = libm::atan2(-hinge.z, hinge.y).to_degrees();
    assert!((off_vertical - 30.0).abs() < 1e-9, "{off_vertical}");
}

#[test]
fn merklinger_1996_hyperfocal_zone_reaches_j_each_side() {
    // Part II: hyperfocal distance f^2/(N c) of 150 mm at f/11, c = 0.1 mm, about 67 ft. There the zone measured
    // parallel to the film reaches y = (f/v') J on each side of the plane.
    let (f, number, c) = (0.15, 11.0, 1e-4);
    let hyperfocal = f * f / (number * c);
    assert!((hyperfocal / FOOT - 67.108).abs() < 5e-4);
    let mut set = camera(150.0, number, 5.0, 0.0, 150.0);
    // u' is measured along the film's normal: S cuts that axis at the hyperfocal distance.
    let (sine, cosine) = Angle::degrees(5.0).sin_cos();
    // u' = v' f / (v' cos t - f)  =>  v' = f u' / (u' cos t - f)
    let extension = f * hyperfocal / (hyperfocal * cosine - f);
    set.extension = Length::metres(extension);
    let optics = Optics::new(&set).unwrap();
    let wedge = optics.depth_of_field(c).unwrap();
    let j = f / sine;
    let at = |plane: groundglass::geometry::Plane| {
        plane.meet_ray(DVec3::new(0.0, 0.0, -hyperfocal), DVec3::Y).to_affine().y
    };
    let (focus, near, far) = (at(optics.focus_plane()), at(wedge.near), at(wedge.far));
    let wanted = f / extension * j;
    assert!((((far - focus).abs() / wanted) - 1.0).abs() < 1e-9, "{} {wanted}", far - focus);
    assert!((((near - focus).abs() / wanted) - 1.0).abs() < 1e-9, "{} {wanted}", near - focus);
}

#[test]
fn wikipedia_formulas_hold() {
    for (focal, tilt, extension, number) in
        [(0.15, 6.0, 0.16, 8.0), (0.09, 2.5, 0.091, 16.0), (0.3, 12.0, 0.45, 22.0), (0.05, 20.0, 0.06, 4.0)]
    {
        let optics = Optics::new(&camera(focal * 1e3, number, tilt, 0.0, extension * 1e3)).unwrap();
        let (sine, cosine) = Angle::degrees(tilt).sin_cos();
        let j = focal / sine;
        assert!((optics.hinge_distance().unwrap() / j - 1.0).abs() < 1e-12);
        // u' = v' f / (v' cos t - f), where the focus plane cuts the film's normal through the lens.
        let u = extension * focal / (extension * cosine - focal);
        let cut = optics.focus_plane().meet_ray(DVec3::ZERO, DVec3::NEG_Z).to_affine();
        assert!((-cut.z / u - 1.0).abs() < 1e-12);
        // tan psi = u' sin t / f = u' / J: from the hinge, J below the lens, to the cut.
        let hinge = optics.hinge_line().nearest_to_origin().to_affine();
        assert!((hinge.y / -j - 1.0).abs() < 1e-12 && hinge.z.abs() < 1e-12);
        let c = 1e-4;
        let hyperfocal = focal * focal / (number * c);
        let wedge = optics.depth_of_field(c).unwrap();
        for plane in [wedge.near, wedge.far] {
            // y_n = y_f = (f/v') (u'/u_h) J at the distance u'.
            let y = plane.meet_ray(DVec3::new(0.0, 0.0, -u), DVec3::Y).to_affine().y;
            assert!((y.abs() / (focal / extension * (u / hyperfocal) * j) - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn tilt_chart_of_a_24_mm_lens() {
    // Centimetres at these degrees; the first two are rounded coarsely by their source (computed: 137.5 and 91.7).
    let chart = [
        (2.0, 69.0, 0.5),
        (2.5, 55.0, 0.5),
        (3.0, 46.0, 0.5),
        (3.5, 39.0, 0.5),
        (4.0, 34.5, 0.25),
        (5.0, 27.5, 0.25),
        (6.0, 23.0, 0.5),
        (7.0, 19.7, 0.05),
        (8.0, 17.2, 0.05),
    ];
    for (tilt, published, rounding) in chart {
        assert!((hinge(24.0, tilt) * 100.0 - published).abs() <= rounding, "{tilt} degrees");
    }
    for (focal, tilt) in [(24.0, 1.0), (45.0, 1.5), (90.0, 3.0)] {
        // Summerhayes: these put the hinge "about eye height" below the lens.
        assert!((1.3..1.8).contains(&hinge(focal, tilt)));
    }
}

#[test]
fn close_up_rule_of_a_180_mm_lens() {
    // s' = (1 + M) f, total f (2 + M + 1/M): 180 mm at 0.5x stands 270 mm from the film, 810 mm in all.
    let set =
        solve(&camera(180.0, 5.6, 0.0, 0.0, 180.0), &FocusTarget::Distance(0.54), Adjust::Front).unwrap();
    assert!((set.extension.as_millimetres() - 270.0).abs() < 1e-9);
}

#[test]
fn training_manual_14209_depth_of_field() {
    // 155 mm f/2.8 at 10 ft, hyperfocal 554 ft: 9.8 to 10.2 ft.
    let f = 0.155;
    let c = f * f / (2.8 * 554.0 * FOOT);
    let set = solve(&camera(155.0, 2.8, 0.0, 0.0, 155.0), &FocusTarget::Distance(10.0 * FOOT), Adjust::Front)
        .unwrap();
    let wedge = Optics::new(&set).unwrap().depth_of_field(c).unwrap();
    let at =
        |plane: groundglass::geometry::Plane| -plane.meet_ray(DVec3::ZERO, DVec3::NEG_Z).to_affine().z / FOOT;
    assert!((at(wedge.near) - 9.832).abs() < 5e-4, "{}", at(wedge.near));
    assert!((at(wedge.far) - 10.17).abs() < 5e-3, "{}", at(wedge.far));
}
