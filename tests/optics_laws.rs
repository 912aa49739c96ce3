//! Laws of the view camera over random cameras: untilted, tilted by 1e-12 degrees or by much, at the
//! origin or a million metres from it.

use glam::{DMat3, DVec3};
use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::error::{Error, ErrorKind};
use groundglass::geometry::{HomogeneousPoint, Line, Plane};
use groundglass::optics::{Adjust, DepthOfField, FocusTarget, Limit, Optics, solve, upright};
use groundglass::quantity::{Angle, FNumber, Length};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn turn() -> impl Strategy<Value = f64> {
    prop_oneof![3 => -35.0..35.0f64, 1 => Just(0.0), 1 => Just(1e-12), 1 => -1e-6..1e-6f64]
}

fn standard() -> impl Strategy<Value = Standard> {
    (turn(), turn(), -20.0..20.0f64, -20.0..20.0f64).prop_map(|(tilt, swing, rise, shift)| Standard {
        tilt: Angle::degrees(tilt),
        swing: Angle::degrees(swing),
        rise: Length::millimetres(rise),
        shift: Length::millimetres(shift),
    })
}

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
        .prop_map(|(x, y, z)| DVec3::new(x, y, z))
        .prop_filter("a direction", |v| v.length() > 0.2)
}

prop_compose! {
    fn camera()(
        front in standard(), rear in standard(), focal in 20.0..400.0f64, stretch in 1.02..2.5f64,
        number in 1.0..64.0f64, view in direction(), far in prop_oneof![Just(0.0), Just(1e6)],
    ) -> Camera {
        let eye = DVec3::new(far, 1.6 - 0.5 * far, 10.0);
        let up = if view.x.abs() + view.z.abs() > 0.1 { DVec3::Y } else { DVec3::X };
        Camera {
            rail: Camera::rail_frame(eye, eye + view, up).unwrap(),
            front,
            rear,
            extension: Length::millimetres(focal * stretch),
            focal_length: Length::millimetres(focal),
            aperture: Aperture::FNumber(FNumber::new(number).unwrap()),
            film: FilmSize { width: Length::millimetres(120.0), height: Length::millimetres(96.0) },
            near: Length::millimetres(0.1 * focal),
        }
    }
}

/// Scale-free distance of two planes as 4-vectors with lengths in units of `f`, up to sign.
fn plane_gap(a: Plane, b: Plane, f: f64) -> f64 {
    let unit = |p: Plane| p.m.extend(p.e / f).normalize();
    let (a, b) = (unit(a), unit(b));
    (a - b).length().min((a + b).length())
}

fn line_gap(a: Line, b: Line, f: f64) -> f64 {
    let unit = |l: Line| {
        let m = l.moment / f;
        let scale = (l.direction.length_squared() + m.length_squared()).sqrt();
        (l.direction / scale, m / scale)
    };
    let (a, b) = (unit(a), unit(b));
    let gap = |s: f64| ((a.0 - b.0 * s).length_squared() + (a.1 - b.1 * s).length_squared()).sqrt();
    gap(1.0).min(gap(-1.0))
}

/// How far a line is from lying in a plane: 0 when it does. Both in lens space, lengths in units of `f`.
fn incidence(line: Line, plane: Plane, f: f64) -> f64 {
    let scaled = Line { direction: line.direction, moment: line.moment / f };
    let size = (scaled.direction.length_squared() + scaled.moment.length_squared()).sqrt();
    let plane = Plane { m: plane.m, e: plane.e / f };
    let meet = scaled.meet_plane(plane);
    (meet.xyz.length_squared() + meet.w * meet.w).sqrt() / size / plane.m.extend(plane.e).length()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(20040808), ..ProptestConfig::default() })]

    #[test]
    fn three_planes_of_each_pencil_share_a_line(camera in camera()) {
        let optics = Optics::new(&camera).unwrap();
        let f = optics.focal_length();
        let scheimpflug = optics.scheimpflug_line();
        for plane in [optics.film_plane(), optics.lens_plane(), optics.focus_plane()] {
            prop_assert!(incidence(scheimpflug, plane, f) < 1e-14);
        }
        let hinge = optics.hinge_line();
        for plane in [optics.film_parallel_plane(), optics.front_focal_plane(), optics.focus_plane()] {
            prop_assert!(incidence(hinge, plane, f) < 1e-14);
        }
        let wedge = optics.depth_of_field(1e-4).unwrap();
        prop_assert!(incidence(hinge, wedge.near, f) < 1e-14);
        prop_assert!(incidence(hinge, wedge.far, f) < 1e-14);
    }

    #[test]
    fn standards_turned_alike_and_focused_at_infinity_have_the_plane_at_infinity(camera in camera()) {
        let rear = Standard { tilt: camera.front.tilt, swing: camera.front.swing, ..camera.rear };
        let camera = Camera { rear, ..camera };
        let solved = solve(&camera, &FocusTarget::Distance(f64::INFINITY), Adjust::Rear).unwrap();
        let solved = Camera { extension: solved.extension, ..camera };
        prop_assert_eq!(Optics::new(&solved).unwrap().focus_plane().m, DVec3::ZERO);
    }

    #[test]
    fn a_point_in_focus_has_one_image_for_every_lens_point(camera in camera(), x in -0.5..0.5f64, y in -0.5..0.5f64) {
        let optics = Optics::new(&camera).unwrap();
        // A film point's conjugate lies in the focus plane by definition of the image alone.
        let film = optics.film_point(x * 0.1, y * 0.1);
        let object = optics.object_of(HomogeneousPoint::finite(film));
        let focus = optics.focus_plane();
        let size = object.xyz.length() * focus.m.length() + (object.w * focus.e).abs();
        prop_assert!(focus.evaluate(object).abs() < 1e-14 * size);
        let point = object.to_affine();
        prop_assume!(object.w < -1e-3 && point.length() < 1e4);
        let wanted = optics.projection(0.0, 0.0).project(point);
        for (u, v) in [(0.7, 0.1), (-0.3, 0.9), (1.0, 0.0)] {
            let clip = optics.projection(u * optics.aperture_radius(), v * optics.aperture_radius()).project(point);
            prop_assume!(clip.w > 0.1 * wanted.w);
            // Rounding of a far point moves its image by this much.
            let slack = 1e-13 * (1.0 + point.length() / clip.w) * (1.0 + point.length() / wanted.w);
            prop_assert!((clip.x / clip.w - wanted.x / wanted.w).abs() < slack);
            prop_assert!((clip.y / clip.w - wanted.y / wanted.w).abs() < slack);
        }
        if let Some(blur) = optics.blur_of(point) {
            prop_assert!(blur.largest < 1e-9);
        }
    }

    #[test]
    fn focusing_turns_the_focus_plane_about_the_hinge(camera in camera(), more in 1.01..1.5f64) {
        let before = Optics::new(&camera).unwrap();
        let extension = Length::metres(camera.extension.as_metres() * more);
        let after = Optics::new(&Camera { extension, ..camera }).unwrap();
        let f = before.focal_length();
        prop_assert!(line_gap(before.hinge_line(), after.hinge_line(), f) < 1e-14);
        prop_assert!(incidence(before.hinge_line(), after.focus_plane(), f) < 1e-13);
    }

    #[test]
    fn projection_equals_the_traced_ray(camera in camera(), u in -0.7..0.7f64, v in -0.7..0.7f64,
                                        x in -0.05..0.05f64, y in -0.05..0.05f64, t in 1.0..200.0f64) {
        let optics = Optics::new(&camera).unwrap();
        let (u, v) = (u * optics.aperture_radius(), v * optics.aperture_radius());
        // The classical construction, apart from the library's: the image by 1/so + 1/si = 1/f on the chief
        // ray, then the straight line from the lens point through it to the film.
        let ray = optics.ray(u, v, x, y);
        prop_assume!(optics.axis().dot(ray.direction) > 1e-3);
        let point = ray.origin + ray.direction * t;
        let so = optics.axis().dot(point);
        let si = 1.0 / (1.0 / optics.focal_length() - 1.0 / so);
        prop_assume!((so - optics.focal_length()).abs() > 1e-3);
        let image = -point * (si / so);
        let film = optics.film_plane().meet_ray(ray.origin, image - ray.origin).to_affine();
        let wanted = optics.film_point(x, y);
        prop_assert!((film - wanted).length() < 1e-10, "{film} {wanted}");
        let clip = optics.projection(u, v).project(point);
        prop_assert!((-clip.x / clip.w * 0.06 - x).abs() < 1e-10);
        prop_assert!((-clip.y / clip.w * 0.048 - y).abs() < 1e-10);
        // And the weight orders depth: w = t (-(n.s + e)).
        let weight = -(optics.film_normal().dot(ray.origin) + optics.film_plane().e);
        prop_assert!((clip.w / (t * weight) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn matrices_are_affine_in_the_lens_point(camera in camera(), u in -2.0..2.0f64, v in -2.0..2.0f64) {
        let optics = Optics::new(&camera).unwrap();
        let r = optics.aperture_radius();
        let [m, m0, mu, mv] =
            [(u, v), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| optics.projection(u * r, v * r));
        for row in 0..4 {
            let affine = m0.rows[row] + u * (mu.rows[row] - m0.rows[row]) + v * (mv.rows[row] - m0.rows[row]);
            prop_assert!((affine - m.rows[row]).length() < 1e-13 * (1.0 + m0.rows[row].length()));
        }
    }

    #[test]
    fn inverse_after_forward_is_the_identity(camera in camera(), rear in any::<bool>()) {
        let adjust = if rear { Adjust::Rear } else { Adjust::Front };
        let optics = Optics::new(&camera).unwrap();
        let plane = optics.world_from_lens().plane(optics.focus_plane());
        // Where lens and film stand so that the solver's choice of root is the camera's own.
        prop_assume!(optics.axis().dot(optics.film_normal()) < -0.2);
        prop_assume!(plane.normalized().m != DVec3::ZERO);
        let lens = optics.world_from_lens().origin;
        let unit = plane.normalized();
        let point = lens - unit.m * unit.distance(lens);
        prop_assume!(unit.distance(lens).abs() < 1e5);
        let found = match solve(&camera, &FocusTarget::Plane { point, normal: unit.m }, adjust) {
            Ok(found) => found,
            Err(why) => return Err(TestCaseError::fail(format!("{why}"))),
        };
        let again = Optics::new(&found).unwrap();
        let f = optics.focal_length();
        let slack = if camera.rail.origin.length() > 1e5 { 1e-6 } else { 1e-9 };
        prop_assert!(plane_gap(again.focus_plane(), optics.focus_plane(), f) < slack);
        prop_assert!((again.axis() - optics.axis()).length() < slack * 10.0);
        prop_assert!((found.extension.as_metres() / camera.extension.as_metres() - 1.0).abs() < slack * 10.0);
    }

    #[test]
    fn forward_after_inverse_gives_the_wanted_plane(
        camera in camera(), normal in direction(), offset in direction(), away in 0.2..1e3f64, rear in any::<bool>(),
    ) {
        let adjust = if rear { Adjust::Rear } else { Adjust::Front };
        let point = camera.rail.origin + offset * away;
        match solve(&camera, &FocusTarget::Plane { point, normal }, adjust) {
            Ok(found) => {
                let optics = Optics::new(&found).unwrap();
                let wanted = optics.world_from_lens().plane_inverse(Plane::through(point, normal.normalize()));
                let slack = if camera.rail.origin.length() > 1e5 { 1e-6 } else { 1e-9 };
                let gap = plane_gap(optics.focus_plane(), wanted, optics.focal_length());
                prop_assert!(gap < slack, "{gap:e}");
            }
            Err(why) => {
                prop_assert!(!why.message.is_empty());
                if let Some(nearest) = why.nearest {
                    let optics = Optics::new(&nearest.camera).unwrap();
                    let slack = if camera.rail.origin.length() > 1e5 { 1e-6 } else { 1e-9 };
                    let wanted = optics.world_from_lens().plane_inverse(nearest.plane);
                    prop_assert!(plane_gap(optics.focus_plane(), wanted, optics.focal_length()) < slack);
                }
            }
        }
    }

    #[test]
    fn upright_film_holds_the_vertical(camera in camera()) {
        let found = upright(&camera, DVec3::Y);
        if let Ok(found) = found {
            let normal = found.film_frame().axes.z_axis;
            prop_assert!(normal.y.abs() < 1e-14);
        }
    }

    #[test]
    fn on_the_limit_planes_the_parallel_diameter_is_exactly_c(camera in camera(), x in -0.04..0.04f64, y in -0.04..0.04f64) {
        let optics = Optics::new(&camera).unwrap();
        prop_assume!(optics.film_normal().cross(optics.axis()).length() > 1e-3);
        let c = 1e-4;
        let wedge = optics.depth_of_field(c).unwrap();
        let along = optics.film_normal().cross(optics.axis()).normalize();
        let (ex, ey) = optics.lens_axes();
        let r = optics.aperture_radius();
        let (u, v) = (along.dot(ex) * r, along.dot(ey) * r);
        let chief = optics.ray(0.0, 0.0, x, y);
        for limit in [wedge.near, wedge.far] {
            let point = limit.meet_ray(chief.origin, chief.direction).to_affine();
            prop_assume!(point.is_finite() && point.length() < 1e4 && optics.axis().dot(point) > optics.focal_length());
            let image = |sign: f64| {
                let clip = optics.projection(sign * u, sign * v).project(point);
                DVec3::new(clip.x / clip.w * 0.06, clip.y / clip.w * 0.048, 0.0)
            };
            let length = (image(1.0) - image(-1.0)).length();
            prop_assert!((length / c - 1.0).abs() < 1e-6, "{length}");
        }
    }
}

fn one_camera() -> Camera {
    Camera {
        rail: Camera::rail_frame(DVec3::new(0.0, 5.0, 4.0), DVec3::new(0.0, 4.0, 0.0), DVec3::Y).unwrap(),
        front: Standard::default(),
        rear: Standard { swing: Angle::degrees(7.0), ..Standard::default() },
        extension: Length::millimetres(160.0),
        focal_length: Length::millimetres(150.0),
        aperture: Aperture::FNumber(FNumber::new(8.0).unwrap()),
        film: FilmSize { width: Length::millimetres(120.0), height: Length::millimetres(96.0) },
        near: Length::millimetres(15.0),
    }
}

/// Of a level camera with an upright film the hinge line of a level plane lies as far below or above the lens as the plane does, and no
/// nearer than the focal length.
#[test]
fn the_nearest_plane_that_can_be_had_is_the_nearest_on_either_side() {
    let rail = Camera::rail_frame(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap();
    let camera = Camera { rail, rear: Standard::default(), ..one_camera() };
    for (height, up) in [(-0.1, 1.0), (-0.1, -1.0), (0.1, 1.0), (0.1, -1.0)] {
        let target =
            FocusTarget::Plane { point: DVec3::new(3.0, height, -7.0), normal: DVec3::new(0.0, up, 0.0) };
        let why = solve(&camera, &target, Adjust::Front).unwrap_err();
        let nearest = why.nearest.expect("a plane that can be had");
        assert_eq!(why.limit, Limit::HingeTooNear);
        assert!((nearest.miss - 0.05).abs() < 1e-6, "{height}, {up}: {} m", nearest.miss);
        let Plane { m, e } = nearest.plane.normalized();
        let (slope, found) = (m.x.abs().max(m.z.abs()), -e / m.y);
        assert!(slope < 1e-12 && (found - 1.5 * height).abs() < 1e-6, "{height}, {up}: {found} m");
    }
}

#[test]
fn what_is_up_has_no_length_and_no_sign() {
    let camera = one_camera();
    let tilt = |up: DVec3| upright(&camera, up).map(|found| found.rear.tilt.as_degrees());
    let expected = tilt(DVec3::Y).unwrap();
    assert!(expected.abs() > 1.0);
    for up in [DVec3::NEG_Y, DVec3::Y * 1e-320, DVec3::Y * 1e300, DVec3::Y * -7.0] {
        assert!((tilt(up).unwrap() - expected).abs() < 1e-12, "{up}: {:?} for {expected}", tilt(up));
    }
    for none in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        assert!(tilt(none).is_err(), "{none}");
        let plane = FocusTarget::Plane { point: DVec3::ZERO, normal: none };
        let said = solve(&camera, &plane, Adjust::Front).unwrap_err();
        assert_eq!(said.message.contains("not finite"), !none.is_finite(), "{none}: {said}");
    }
}

#[test]
fn what_stops_a_solution_is_named() {
    // The standard that faces backwards, not the extension that it would take.
    for standard in [0, 1] {
        let mut camera = one_camera();
        [&mut camera.front, &mut camera.rear][standard].tilt = Angle::degrees(120.0);
        let why = solve(&camera, &FocusTarget::Distance(3.0), Adjust::Front).unwrap_err();
        assert_eq!(why.limit, Limit::Backwards, "{why}");
        assert!(why.message.contains(["front", "rear"][standard]), "{why}");
    }
    let far = FocusTarget::Plane { point: DVec3::splat(f64::MAX), normal: DVec3::ONE };
    for adjust in [Adjust::Front, Adjust::Rear] {
        let why = solve(&one_camera(), &far, adjust).unwrap_err();
        assert_eq!(why.limit, Limit::NoPlane);
        assert!(why.message.contains("too far") && why.remedy().contains("far"), "{why}: {}", why.remedy());
    }
    // What is wrong with the camera is no lack of a solution.
    let broken = Camera { focal_length: Length::metres(f64::NAN), ..one_camera() };
    let error = Error::from(solve(&broken, &FocusTarget::Distance(3.0), Adjust::Front).unwrap_err());
    assert_eq!(error.kind(), ErrorKind::Invalid);
    let wide = Aperture::FNumber(FNumber::new(1e-320).unwrap());
    let error = Optics::new(&Camera { aperture: wide, ..one_camera() }).unwrap_err();
    assert!(error.to_string().contains("camera.f_number"), "{error}");
}

#[test]
fn cameras_without_film_place_or_near_distance_have_no_optics() {
    let mut film = one_camera();
    assert!(Optics::new(&film).is_ok());
    for side in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        film.film.width = Length::millimetres(side);
        assert!(Optics::new(&film).is_err(), "film of {side} mm");
    }
    let mut near = one_camera();
    for distance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        near.near = Length::millimetres(distance);
        assert!(Optics::new(&near).is_err(), "{distance} mm");
    }
    for broken in [f64::NAN, f64::INFINITY] {
        let mut moved = one_camera();
        moved.front.rise = Length::metres(broken);
        assert!(Optics::new(&moved).is_err());
        let mut turned = one_camera();
        turned.rear.swing = Angle::degrees(broken);
        assert!(Optics::new(&turned).unwrap_err().to_string().contains("finite"));
    }
    for focal in [f64::NAN, 0.0, -0.15] {
        let broken = Camera { focal_length: Length::metres(focal), ..one_camera() };
        let why = solve(&broken, &FocusTarget::Distance(3.0), Adjust::Front).unwrap_err();
        assert_eq!(
            (why.limit, upright(&broken, DVec3::Y).unwrap_err().limit),
            (Limit::Camera, Limit::Camera)
        );
    }
    let turns: [fn(&mut Camera) -> &mut Angle; 3] =
        [|camera| &mut camera.rear.tilt, |camera| &mut camera.rear.swing, |camera| &mut camera.front.tilt];
    for turn in turns {
        let mut broken = one_camera();
        *turn(&mut broken) = Angle::degrees(f64::NAN);
        let why = solve(&broken, &FocusTarget::Distance(3.0), Adjust::Front).unwrap_err();
        assert_eq!(
            (why.limit, upright(&broken, DVec3::Y).unwrap_err().limit),
            (Limit::Camera, Limit::Camera)
        );
    }
    let optics = Optics::new(&one_camera()).unwrap();
    for c in [f64::NAN, -1e-4, f64::INFINITY] {
        assert!(optics.depth_of_field(c).is_none() && optics.merklinger_limits(c).is_none());
        assert!(optics.untilted_limits(c).is_none());
    }
    let DepthOfField { near, far } = optics.depth_of_field(0.0).unwrap();
    assert!(near == far && optics.untilted_limits(0.0).is_none());
    let mut placed = one_camera();
    placed.rail.origin.y = f64::NAN;
    assert!(Optics::new(&placed).is_err());
    let mut turned = one_camera();
    for axes in
        [DMat3::ZERO, DMat3::NAN, DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)), 2.0 * DMat3::IDENTITY]
    {
        turned.rail.axes = axes;
        assert!(Optics::new(&turned).is_err(), "{axes}");
    }
}
