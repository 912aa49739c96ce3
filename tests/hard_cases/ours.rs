//! The library's answers in the oracle's shape. Its numbers are made unit in 320 bits, so that only what the library
//! rounded is judged.

use super::input::{Input, Key};
use super::oracle::Groups;
use super::wide::{Big, big, unit};
use glam::DVec3;
use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::geometry::{HomogeneousPoint, Line, Plane};
use groundglass::optics::{Adjust, FocusTarget, Limit, Optics, solve};
use groundglass::quantity::{Angle, FNumber, Length};

pub const FILM: [f64; 2] = [0.12, 0.096];

pub fn camera(input: &Input) -> Option<Camera> {
    let get = |key| input.get(key);
    let mm = Length::millimetres;
    let standard = |tilt, swing, rise, shift| Standard {
        tilt: Angle::degrees(get(tilt)),
        swing: Angle::degrees(get(swing)),
        rise: mm(get(rise)),
        shift: mm(get(shift)),
    };
    let vector = |key| DVec3::from_array(input.three(key));
    Some(Camera {
        rail: Camera::rail_frame(vector(Key::EyeX), vector(Key::AtX), vector(Key::UpX)).ok()?,
        front: standard(Key::FrontTilt, Key::FrontSwing, Key::FrontRise, Key::FrontShift),
        rear: standard(Key::RearTilt, Key::RearSwing, Key::RearRise, Key::RearShift),
        extension: mm(get(Key::Extension)),
        focal_length: mm(get(Key::Focal)),
        aperture: Aperture::FNumber(FNumber::new(get(Key::Number)).ok()?),
        film: FilmSize { width: Length::metres(FILM[0]), height: Length::metres(FILM[1]) },
        near: Length::metres(1e-3),
    })
}

pub fn optics(input: &Input) -> Option<Optics> {
    Optics::new(&camera(input)?).ok()
}

/// None where a number is not finite.
fn bigs(values: &[f64]) -> Option<Vec<Big>> {
    values.iter().map(|&x| x.is_finite().then(|| big(x))).collect()
}

fn four(plane: Plane, f: f64) -> Option<Vec<Big>> {
    let mut all = bigs(&[plane.m.x, plane.m.y, plane.m.z, plane.e])?;
    all[3] = all[3].clone() / big(f);
    Some(unit(all))
}

fn six(line: Line, f: f64) -> Option<Vec<Big>> {
    let (d, m) = (line.direction, line.moment);
    let mut all = bigs(&[d.x, d.y, d.z, m.x, m.y, m.z])?;
    for part in &mut all[3..] {
        *part = part.clone() / big(f);
    }
    Some(unit(all))
}

pub fn focus_plane(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    Some(vec![four(optics.focus_plane(), optics.focal_length())?])
}

pub fn scheimpflug(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    Some(vec![six(optics.scheimpflug_line(), optics.focal_length())?])
}

pub fn hinge(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    Some(vec![six(optics.hinge_line(), optics.focal_length())?])
}

pub fn hinge_distance(input: &Input) -> Option<Groups> {
    Some(vec![bigs(&[optics(input)?.hinge_distance()?])?])
}

pub fn limits(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    let limits = optics.depth_of_field(input.get(Key::C))?;
    let f = optics.focal_length();
    Some(vec![four(limits.near, f)?, four(limits.far, f)?])
}

fn projected(clip: glam::DVec4) -> Option<Vec<Big>> {
    let clip = bigs(&[clip.x, clip.y, clip.w])?;
    let size = |i: usize| big(0.0) - clip[i].clone() * big(0.5 * FILM[i]);
    Some(vec![size(0), size(1), clip[2].clone()])
}

fn affine(clip: glam::DVec4) -> Option<Groups> {
    let [x, y, w] = <[Big; 3]>::try_from(projected(clip)?).ok()?;
    (w != Big::ZERO).then(|| vec![vec![x / w.clone(), y / w]])
}

fn lens_point(input: &Input, optics: &Optics) -> (f64, f64) {
    let r = optics.aperture_radius();
    (input.get(Key::U) * r, input.get(Key::V) * r)
}

fn point(input: &Input) -> DVec3 {
    DVec3::from_array(input.three(Key::Px))
}

pub fn film_point(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    let (u, v) = lens_point(input, &optics);
    affine(optics.projection(u, v).project(point(input)))
}

pub fn clip(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    let (u, v) = lens_point(input, &optics);
    let [x, y, w] = <[Big; 3]>::try_from(projected(optics.projection(u, v).project(point(input)))?).ok()?;
    Some(vec![vec![x, y], vec![w]])
}

pub fn world_point(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    let (u, v) = lens_point(input, &optics);
    affine(optics.projection_from_world(u, v).project(point(input)))
}

pub fn blur(input: &Input) -> Option<Groups> {
    let blur = optics(input)?.blur_of(point(input))?;
    Some(vec![bigs(&[blur.largest])?, bigs(&[blur.smallest])?])
}

pub fn image(input: &Input) -> Option<Groups> {
    let optics = optics(input)?;
    let image = optics.image_of(HomogeneousPoint::finite(point(input)));
    let f = big(optics.focal_length());
    let [x, y, z, w] = <[Big; 4]>::try_from(bigs(&[image.xyz.x, image.xyz.y, image.xyz.z, image.w])?).ok()?;
    Some(vec![unit(vec![x / f.clone(), y / f.clone(), z / f, w])])
}

pub fn rail_frame(input: &Input) -> Option<Groups> {
    let axes = camera(input)?.rail.axes;
    [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| bigs(&axis.to_array())).into_iter().collect()
}

fn movements(solved: Option<Camera>, adjust: Adjust) -> Option<Groups> {
    let solved = solved?;
    let standard = if adjust == Adjust::Front { solved.front } else { solved.rear };
    Some(vec![
        bigs(&[standard.tilt.as_degrees(), standard.swing.as_degrees()])?,
        bigs(&[solved.extension.as_metres()])?,
    ])
}

pub fn solved(input: &Input, target: FocusTarget, adjust: Adjust) -> Result<Camera, Option<Limit>> {
    solve(&camera(input).ok_or(None)?, &target, adjust).map_err(|why| Some(why.limit))
}

pub fn target(input: &Input) -> FocusTarget {
    FocusTarget::Plane { point: point(input), normal: DVec3::from_array(input.three(Key::Qx)) }
}

pub fn points(input: &Input) -> FocusTarget {
    FocusTarget::Points([Key::Px, Key::Qx, Key::Rx].map(|key| DVec3::from_array(input.three(key))))
}

pub fn distance(input: &Input) -> Option<Groups> {
    let solved = solved(input, FocusTarget::Distance(input.get(Key::C)), Adjust::Front).ok()?;
    Some(vec![bigs(&[solved.extension.as_metres()])?])
}

pub fn front_plane(input: &Input) -> Option<Groups> {
    movements(solved(input, target(input), Adjust::Front).ok(), Adjust::Front)
}

pub fn front_points(input: &Input) -> Option<Groups> {
    movements(solved(input, points(input), Adjust::Front).ok(), Adjust::Front)
}

pub fn rear_plane(input: &Input) -> Option<Groups> {
    movements(solved(input, target(input), Adjust::Rear).ok(), Adjust::Rear)
}
