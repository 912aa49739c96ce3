//! The maps: which question, over which two numbers, and the errors of three ways to answer it in each cell.

use super::classic;
use super::formulas::{self as wide, FOCAL};
use super::number::{Number, error};
use super::wide::Wide;
use crate::camera::{Aperture, Camera, Standard};
use crate::optics::{Adjust, FocusTarget, Optics, solve};
use crate::quantity::{Angle, FNumber, Length};
use glam::DVec3;

/// Relative errors of the library, of the textbook and of single precision; `None` where there is no answer.
pub(crate) type Errors = [Option<f64>; 3];

/// An axis: its title, and its values from 10^first to 10^last, two or so in a decade.
pub(crate) struct Span {
    pub(crate) title: &'static str,
    pub(crate) first: f64,
    pub(crate) last: f64,
    pub(crate) steps: usize,
}

pub(crate) struct Question {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    pub(crate) textbook: &'static str,
    pub(crate) x: Span,
    pub(crate) y: Span,
    pub(crate) cell: fn(f64, f64) -> Errors,
}

/// From 1e-16 to 89 degrees.
const fn tilts(title: &'static str) -> Span {
    Span { title, first: -16.0, last: 1.949_390_006_644_912_8, steps: 36 }
}

const DISTANCES: Span = Span { title: "focus distance (m)", first: -0.7, last: 7.0, steps: 16 };

pub(crate) const QUESTIONS: [Question; 5] = [
    Question {
        name: "focus-plane",
        title: "Plane of sharp focus",
        textbook: "textbook: hinge point and angle",
        x: tilts("tilt of the lens (degrees)"),
        y: DISTANCES,
        cell: focus_plane,
    },
    Question {
        name: "hinge-distance",
        title: "Distance of the hinge line",
        textbook: "textbook: f / sin(arccos)",
        x: tilts("tilt of the lens (degrees)"),
        y: DISTANCES,
        cell: hinge_distance,
    },
    Question {
        name: "blur",
        title: "Blur of a point 1 % beyond the focus plane, 4 cm from the axis on the film",
        textbook: "textbook: difference of two images",
        x: tilts("tilt of the lens (degrees)"),
        y: Span { title: "f-number", first: -0.5, last: 6.0, steps: 13 },
        cell: blur,
    },
    Question {
        name: "lens-for-plane",
        title: "Tilt and extension for a wanted plane",
        textbook: "textbook: angles",
        x: tilts("lean of the plane (degrees)"),
        y: DISTANCES,
        cell: lens_for,
    },
    Question {
        name: "double-root",
        title: "Film distance for a plane that passes the lens at little more than f",
        textbook: "textbook: school's quadratic formula",
        x: tilts("tilt of the film (degrees)"),
        y: Span { title: "distance of the plane over f, less 1", first: -16.0, last: 2.0, steps: 18 },
        cell: film_for_level,
    },
];

pub(crate) const POINTS: Question = Question {
    name: "three-points",
    title: "Plane through three points nearly on one line",
    textbook: "textbook: plain cross product",
    x: tilts("corner between the points (degrees)"),
    y: Span { title: "distance of the points (m)", first: 0.0, last: 6.0, steps: 12 },
    cell: three_points,
};

pub(super) fn camera(tilt: f64, extension: f64) -> Option<Camera> {
    let mut camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z).ok()?;
    camera.focal_length = Length::metres(FOCAL);
    camera.front = Standard { tilt: Angle::degrees(tilt), ..Standard::default() };
    camera.extension = Length::metres(extension);
    Some(camera)
}

/// The extension that focuses at `distance` along the lens's axis: part of the question, so its rounding is not judged.
pub(super) fn extension(tilt: f64, distance: f64) -> f64 {
    libm::cos(tilt.to_radians()) * FOCAL * (distance / (distance - FOCAL))
}

/// The errors of three answers.
fn judge(want: Option<Vec<Wide>>, projective: bool, got: [Option<Vec<Wide>>; 3]) -> Errors {
    let Some(want) = want else { return [None; 3] };
    got.map(|got| error(&got?, &want, projective))
}

fn wide<T: Number, const N: usize>(values: [T; N]) -> Vec<Wide> {
    values.into_iter().map(T::wide).collect()
}

fn doubles(values: &[f64]) -> Option<Vec<Wide>> {
    values.iter().map(|&x| x.is_finite().then(|| Wide::of(x))).collect()
}

fn focus_plane(tilt: f64, distance: f64) -> Errors {
    let extension = extension(tilt, distance);
    let ours = || {
        let plane = Optics::new(&camera(tilt, extension)?).ok()?.focus_plane();
        doubles(&[plane.m.x, plane.m.y, plane.m.z, plane.e / FOCAL])
    };
    let single = wide(wide::focus_plane::<f32>(tilt, extension));
    let got = [ours(), classic::focus_plane(tilt, extension).map(wide), Some(single)];
    judge(Some(wide(wide::focus_plane::<Wide>(tilt, extension))), true, got)
}

fn hinge_distance(tilt: f64, distance: f64) -> Errors {
    let extension = extension(tilt, distance);
    let ours = || doubles(&[Optics::new(&camera(tilt, extension)?).ok()?.hinge_distance()?]);
    let single = wide(wide::hinge_distance::<f32>(tilt));
    let got = [ours(), classic::hinge_distance(tilt).map(wide), Some(single)];
    judge(Some(wide(wide::hinge_distance::<Wide>(tilt))), false, got)
}

fn blur(tilt: f64, number: f64) -> Errors {
    let extension = extension(tilt, 10.0);
    let point = blurred_point(tilt, extension);
    let ours = || {
        let mut camera = camera(tilt, extension)?;
        camera.aperture = Aperture::FNumber(FNumber::new(number).ok()?);
        doubles(&[Optics::new(&camera).ok()?.blur_of(DVec3::from_array(point))?.largest])
    };
    // Where the point is not before every lens point, nobody has an answer.
    let Some(found) = ours() else { return [None; 3] };
    let single = wide::blur::<f32>(tilt, extension, number, point).map(wide);
    let textbook = classic::blur(tilt, extension, number, point).map(wide);
    let want = wide::blur::<Wide>(tilt, extension, number, point).map(wide);
    judge(want, false, [Some(found), textbook, single])
}

/// The object of a film point 4 cm above the lens's axis, and a hundredth farther: it lies before the lens at any tilt. (That of a point
/// 4 cm below the rail's axis lies behind it from 0.9 degrees on.)
pub(super) fn blurred_point(tilt: f64, extension: f64) -> [f64; 3] {
    let (s, c) = libm::sincos(tilt.to_radians());
    let on_film = DVec3::new(0.0, 0.04 + extension * s / c, extension);
    let weight = 1.0 + DVec3::new(0.0, -s, -c).dot(on_film) / FOCAL;
    (on_film * (1.01 / weight)).to_array()
}

fn lens_for(lean: f64, distance: f64) -> Errors {
    let (s, c) = libm::sincos(lean.to_radians());
    let normal = [0.0, s, c];
    let ours = || {
        let target =
            FocusTarget::Plane { point: DVec3::new(0.0, 0.0, -distance), normal: DVec3::from_array(normal) };
        let found = solve(&camera(0.0, FOCAL)?, &target, Adjust::Front).ok()?;
        Some(vec![Wide::sin_cos(found.front.tilt.as_degrees()).0, Wide::of(found.extension.as_metres())])
    };
    let Some(want) = wide::lens_for::<Wide>(normal, distance) else { return [None; 3] };
    // Each of the two by its own size.
    let single = wide::lens_for::<f32>(normal, distance).map(wide);
    [ours(), classic::lens_for(normal, distance).map(wide), single].map(|got| {
        let got = got?;
        let errors = (0..2).map(|i| error(&got[i..=i], &want[i..=i], false));
        errors.collect::<Option<Vec<f64>>>().map(|errors| errors.into_iter().fold(0.0, f64::max))
    })
}

fn film_for_level(tilt: f64, over: f64) -> Errors {
    let height = FOCAL * (1.0 + over);
    let ours = || {
        let mut camera = camera(0.0, FOCAL)?;
        camera.rear.tilt = Angle::degrees(tilt);
        let point = DVec3::new(0.0, height, 0.0);
        let found = solve(&camera, &FocusTarget::Plane { point, normal: DVec3::Y }, Adjust::Front).ok()?;
        doubles(&[-Optics::new(&found).ok()?.film_plane().e])
    };
    let single = wide::film_for_level::<f32>(tilt, height).map(wide);
    let textbook = classic::film_for_level(tilt, height).map(wide);
    judge(wide::film_for_level::<Wide>(tilt, height).map(wide), false, [ours(), textbook, single])
}

fn three_points(corner: f64, distance: f64) -> Errors {
    let (s, c) = libm::sincos(corner.to_radians());
    let (along, across) = (DVec3::new(0.9, 0.3, 0.2), DVec3::new(-0.3, 0.9, 0.1));
    let p = DVec3::new(-0.31, -0.17, -distance);
    let points = [p, p + along * 1.1, p + (along * c + across * s) * 0.7].map(|p| p.to_array());
    let ours = || {
        let target = FocusTarget::Points(points.map(DVec3::from_array));
        let found = solve(&camera(0.0, FOCAL)?, &target, Adjust::Rear).ok()?;
        let m = Optics::new(&found).ok()?.focus_plane().m;
        let m = if m.z < 0.0 { -m } else { m };
        doubles(&m.to_array())
    };
    let single = Some(wide(wide::normal::<f32>(points)));
    judge(Some(wide(wide::normal::<Wide>(points))), true, [ours(), classic::normal(points).map(wide), single])
}
