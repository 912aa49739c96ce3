//! The inverse: which movements make a wanted plane sharp, or which limit stops them.

use super::Optics;
use super::products::normal_of;
use crate::camera::{Camera, Standard, unit};
use crate::error::Error;
use crate::geometry::Plane;
use crate::quantity::{Angle, Length};
use glam::DVec3;
use std::fmt;
use std::ops::RangeInclusive;

/// What shall be sharp; points and planes in world coordinates, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FocusTarget {
    /// The focus plane crosses the lens axis at this distance (may be infinite); no standard is turned.
    Distance(f64),
    /// The plane through `point` with this `normal` (any length).
    Plane {
        /// A point of the plane.
        point: DVec3,
        /// Its normal.
        normal: DVec3,
    },
    /// The plane through three points.
    Points([DVec3; 3]),
}

/// Which standard a solver turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adjust {
    /// Front tilt and swing (and the extension); the film keeps its direction.
    #[default]
    Front,
    /// Rear tilt and swing (and the extension); the lens keeps its direction.
    Rear,
}

/// The limit that stops a solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Limit {
    /// A number of the camera that is kept is not finite, or not positive where it must be.
    Camera,
    /// The three points lie on one line; or the plane's normal is zero; or they are not finite.
    NoPlane,
    /// What is up is zero or not finite; or the film would face backwards to be parallel to it.
    Upright,
    /// The wanted plane passes through the lens centre.
    ThroughLens,
    /// The hinge line would lie nearer to the lens than the focal length (`J < f`).
    HingeTooNear,
    /// The wanted plane has no real image behind the lens.
    NoRealImage,
    /// A standard would face backwards.
    Backwards,
    /// The film would stand on or before the lens along the rail, or more than 1e15 m behind it.
    Extension,
}

/// The plane parallel to the wanted one that can be had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// That plane, in world coordinates, unit normal.
    pub plane: Plane,
    /// How far it lies from the wanted plane, metres.
    pub miss: f64,
    /// The camera that has it sharp.
    pub camera: Camera,
}

/// Why no movement does it, and what can be had instead.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsolvable {
    /// The limit met.
    pub limit: Limit,
    /// The limit in words, with its numbers.
    pub message: String,
    /// The nearest plane that can be had, where one was found.
    pub nearest: Option<Box<Nearest>>,
}

impl fmt::Display for Unsolvable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Unsolvable {}

impl Unsolvable {
    /// What can be done about it, in words.
    pub fn remedy(&self) -> String {
        match (&self.nearest, self.limit) {
            (Some(nearest), _) => {
                format!("the nearest parallel plane that can be sharp lies {} away", metres(nearest.miss))
            }
            (None, Limit::NoPlane) => {
                "give three points that are not on one line, or a point and a normal that is not zero, none too far away"
                    .to_owned()
            }
            (None, Limit::Camera) => "mend the camera".to_owned(),
            (None, Limit::Upright) => "give another direction for up, or turn the camera".to_owned(),
            (None, Limit::NoRealImage) => {
                "ask for what lies farther away than the focal length, or move the camera".to_owned()
            }
            (None, _) => "ask for another plane, or move the camera".to_owned(),
        }
    }
}

impl From<Unsolvable> for Error {
    fn from(unsolvable: Unsolvable) -> Self {
        let remedy = unsolvable.remedy();
        match unsolvable.limit {
            Limit::Camera => Self::invalid(unsolvable.message).remedy(remedy),
            _ => Self::no_solution(unsolvable.message).remedy(remedy),
        }
    }
}

/// The camera with movements and extension such that `target` is in focus. Lens centre, and the
/// standard that is not adjusted, stay as they are. A plane that lies behind the camera, or crosses no part of the picture, has such a
/// camera too: [`Optics::cautions`](super::Optics::cautions) then says that nothing in the picture is sharp.
///
/// # Errors
/// [`Unsolvable`] says which limit stops it and what can be had instead.
pub fn solve(camera: &Camera, target: &FocusTarget, adjust: Adjust) -> Result<Camera, Unsolvable> {
    check(camera)?;
    if let FocusTarget::Distance(distance) = *target {
        return focus_at(camera, distance);
    }
    let plane = wanted_plane(camera, target)?;
    match solve_plane(camera, plane, adjust) {
        Ok(solved) => Ok(solved),
        Err((limit, message)) => {
            let nearest = nearest_parallel(camera, plane, adjust).map(Box::new);
            Err(Unsolvable { limit, message, nearest })
        }
    }
}

/// The camera with its rear standard tilted so that the film is parallel to `up` (world), as for
/// perspective correction: verticals stay parallel in the picture. `up` has any length, and means the same as its opposite. What is sharp
/// changes with the film: [`solve()`] for it afterwards.
///
/// # Errors
/// [`Unsolvable`] when the film would face backwards, or `up` has no direction.
pub fn upright(camera: &Camera, up: DVec3) -> Result<Camera, Unsolvable> {
    check(camera)?;
    let Some(up) = unit(up) else {
        return Err(fail(Limit::Upright, "up has no direction: it is zero, or not finite".into()));
    };
    let u = camera.rail.vector_inverse(up);
    let u = if u.y < 0.0 { -u } else { u };
    let (swing_sine, swing_cosine) = camera.rear.swing.sin_cos();
    // n.u = -cos t sin s u_x + sin t u_y + cos t cos s u_z = 0.
    let tilt = libm::atan2(swing_sine * u.x - swing_cosine * u.z, u.y);
    let rear = Standard { tilt: Angle::radians(tilt), ..camera.rear };
    if rear.rotation().z_axis.z > 0.0 {
        Ok(Camera { rear, ..*camera })
    } else {
        Err(fail(Limit::Upright, "the film would have to face backwards to stand parallel to up".into()))
    }
}

/// Whether the camera has the numbers that are kept.
fn check(camera: &Camera) -> Result<(), Unsolvable> {
    super::check(camera).map_err(|error| fail(Limit::Camera, error.message().to_owned()))
}

fn fail(limit: Limit, message: String) -> Unsolvable {
    Unsolvable { limit, message, nearest: None }
}

/// Metres in words, in a unit that reads well.
fn metres(value: f64) -> String {
    match value.abs() {
        v if v < 0.001 => format!("{value:.3e} m"),
        v if v < 1.0 => format!("{} mm", decimals(value * 1000.0)),
        _ => format!("{} m", decimals(value)),
    }
}

/// Four decimals at most.
fn decimals(value: f64) -> String {
    format!("{value:.4}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn focus_at(camera: &Camera, distance: f64) -> Result<Camera, Unsolvable> {
    let f = camera.focal_length.as_metres();
    if distance.is_nan() || distance <= f {
        return Err(fail(
            Limit::NoRealImage,
            format!(
                "a distance of {} is not beyond the focal length of {}: no real image",
                metres(distance),
                metres(f)
            ),
        ));
    }
    let n = camera.rear.rotation().z_axis;
    let a = -camera.front.rotation().z_axis;
    // S.(a D) = 0 solved for e; f / (1 - f/D) holds at D = infinity too. Nearer than 2 f the difference D - f has no
    // error, whatever is left of it.
    let share = if distance < 2.0 * f { (distance - f) / distance } else { 1.0 - f / distance };
    let e = n.dot(a) * (f / share);
    with_film_plane(camera, camera.rear, e).map_err(|(limit, message)| fail(limit, message))
}

/// The wanted plane in lens space with a unit normal.
fn wanted_plane(camera: &Camera, target: &FocusTarget) -> Result<Plane, Unsolvable> {
    let is_finite = match target {
        FocusTarget::Plane { point, normal } => point.is_finite() && normal.is_finite(),
        FocusTarget::Points(points) => points.iter().all(|point| point.is_finite()),
        FocusTarget::Distance(_) => true,
    };
    if !is_finite {
        return Err(fail(Limit::NoPlane, "the wanted plane has numbers that are not finite".into()));
    }
    let lens = camera.lens_frame().origin;
    let (point, normal, doubt) = match *target {
        FocusTarget::Plane { point, normal } => (point, unit(normal), 0.0),
        FocusTarget::Points(points) => {
            // The same directions, where products neither vanish nor overflow.
            let most = points.iter().fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
            let scale =
                if most > 0.0 { libm::exp2(-libm::floor(libm::log2(most)).max(-1000.0)) } else { 1.0 };
            let [p, q, r] = points.map(|p| p * scale);
            let (side, other) = (q - p, r - p);
            let normal = normal_of([p, q, r]);
            let longest = side.length().max(other.length()).max((r - q).length());
            // What rounding of the coordinates alone can leave of the cross product.
            let size = p.abs().max_element().max(q.abs().max_element()).max(r.abs().max_element());
            (points[0], unit(normal), 8.0 * f64::EPSILON * (size + longest) * longest - normal.length())
        }
        FocusTarget::Distance(_) => return Err(fail(Limit::NoPlane, "a distance is no plane".into())),
    };
    let Some(normal) = normal.filter(|_| doubt < 0.0 || matches!(target, FocusTarget::Plane { .. })) else {
        let message = match target {
            FocusTarget::Points(_) => "the three points lie on one line: many planes hold them",
            _ => "the plane's normal is zero",
        };
        return Err(fail(Limit::NoPlane, message.into()));
    };
    let (m, e) = (camera.rail.vector_inverse(normal), -normal.dot(point - lens));
    if !e.is_finite() {
        return Err(fail(
            Limit::NoPlane,
            "the wanted plane lies too far away to be told from infinity".into(),
        ));
    }
    Ok(Plane { m, e })
}

type Stop = (Limit, String);

fn solve_plane(camera: &Camera, plane: Plane, adjust: Adjust) -> Result<Camera, Stop> {
    let f = camera.focal_length.as_metres();
    let Plane { m, e: g } = plane;
    if g.abs() <= 1e-12 * f {
        return Err((Limit::ThroughLens, "the wanted plane passes through the lens centre".into()));
    }
    match adjust {
        Adjust::Front => {
            let n = camera.rear.rotation().z_axis;
            let (a, e) = lens_axis_for(n, m, g, f)?;
            let turned = camera.front.turned_to(-a);
            if a.z >= 0.0 {
                return Err((
                    Limit::Backwards,
                    format!(
                        "the lens would have to face backwards, {:.2} degrees away from the rail",
                        libm::acos(-a.z).to_degrees()
                    ),
                ));
            }
            with_film_plane(&Camera { front: turned, ..*camera }, camera.rear, e)
        }
        Adjust::Rear => {
            let a = -camera.front.rotation().z_axis;
            let (n, e) = film_plane_for(a, m, g, f)?;
            if n.z <= 0.0 {
                let mut message = format!(
                    "the film would have to face backwards, {:.2} degrees away from the rail",
                    libm::acos(n.z).to_degrees()
                );
                let crossing = -g / m.dot(a);
                if crossing > 0.0 && crossing < f {
                    message.push_str(&format!(
                        ": the plane crosses the lens axis {} before the lens, nearer than the focal length of {}, and has no real image \
                         there",
                        metres(crossing),
                        metres(f)
                    ));
                }
                return Err((Limit::Backwards, message));
            }
            with_film_plane(camera, camera.rear.turned_to(n), e)
        }
    }
}

/// Lens axis and film offset for the wanted plane `(m, g)`, `|m| = 1`, and a film with normal `n`.
///
/// The contract's quadratic `k^2 (|m|^2 - g^2/f^2) - 2k (n.m) + 1 = 0` in `1/k`, whose roots give
/// `a = -+ n cos - m_perp f/g`, `sin = |m_perp| f/|g| = f/J`: no cancellation, and `a.n < 0` is a sign.
fn lens_axis_for(n: DVec3, m: DVec3, g: f64, f: f64) -> Result<(DVec3, f64), Stop> {
    let across = m - n * n.dot(m);
    let across = across - n * n.dot(across);
    let sine = across.length() * (f / g.abs());
    if sine > 1.0 {
        return Err((
            Limit::HingeTooNear,
            format!(
                "the hinge line would lie {} from the lens centre, nearer than the focal length of {} (J < f)",
                metres(g.abs() / across.length()),
                metres(f)
            ),
        ));
    }
    // cos^2 = 1 - sin^2. A plane farther than f has J > f however it leans; with |m|^2 = 1 its cosine is then a sum of
    // positive terms, (g - f)(g + f) + (f n.m)^2 over g^2, exact to the last where the roots nearly coincide.
    let far = g.abs();
    let cosine = if sine > 0.5 && far >= f {
        let along = f * n.dot(m);
        ((far - f) * (far + f) + along * along).sqrt() / far
    } else {
        ((1.0 - sine) * (1.0 + sine)).sqrt()
    };
    let a = -cosine * n - (f / g) * across;
    let inverse_k = n.dot(m) - (g / f) * cosine;
    let e = g / inverse_k;
    if !(e < 0.0 && e.is_finite()) {
        return Err((Limit::NoRealImage, no_real_image(g, f)));
    }
    Ok((a, e))
}

/// Film normal and offset for the wanted plane `(m, g)` and a lens with axis `a`: `(m + (g/f) a, g)`.
fn film_plane_for(a: DVec3, m: DVec3, g: f64, f: f64) -> Result<(DVec3, f64), Stop> {
    let normal = m + (g / f) * a;
    let length = normal.length();
    // The front focal plane itself is imaged at infinity.
    if length <= 4.0 * f64::EPSILON * (1.0 + g.abs() / f) {
        return Err((Limit::NoRealImage, no_real_image(g, f)));
    }
    let sign = if g < 0.0 { 1.0 } else { -1.0 };
    Ok((normal * (sign / length), -g.abs() / length))
}

fn no_real_image(g: f64, f: f64) -> String {
    format!(
        "the wanted plane has no real image behind the lens: it passes {} from the lens centre, focal length {}",
        metres(g.abs()),
        metres(f)
    )
}

/// Extensions in metres, as scene files allow them. What is less is mostly rounding, of a film through the rail's origin; what is more, of a
/// plane through the lens's focal point.
const EXTENSIONS: RangeInclusive<f64> = 1e-12..=1e15;

/// Puts the film on the plane `(n, e)` of `rear` by the extension alone.
fn with_film_plane(camera: &Camera, rear: Standard, e: f64) -> Result<Camera, Stop> {
    let moved = Camera { rear, extension: Length::ZERO, ..*camera };
    let stopped = |error: Error| (Limit::Backwards, error.message().to_owned());
    super::check_facing(&moved).map_err(stopped)?;
    let n = rear.rotation().z_axis;
    let beside = moved.film_from_lens();
    let extension = (-e - n.dot(beside)) / n.z;
    if !EXTENSIONS.contains(&extension) {
        return Err((
            Limit::Extension,
            if extension < 0.0 {
                format!("the film would have to stand {} before the lens along the rail", metres(-extension))
            } else {
                format!("the film would have to stand {} behind the lens along the rail", metres(extension))
            },
        ));
    }
    Ok(Camera { extension: Length::metres(extension), ..moved })
}

/// The solvable plane nearest to `plane` among those parallel to it.
fn nearest_parallel(camera: &Camera, plane: Plane, adjust: Adjust) -> Option<Nearest> {
    let f = camera.focal_length.as_metres();
    // One that lies behind the lens, or nowhere in the picture, or cannot be rendered, is of no use.
    let is_seen = |solved: &Camera| {
        Optics::new(solved)
            .is_ok_and(|optics| optics.far_end().0.is_some() && !optics.film_reaches_aperture())
    };
    let at = |offset: f64| {
        solve_plane(camera, Plane { e: plane.e + offset, ..plane }, adjust).ok().filter(is_seen)
    };
    let mut best: Option<(f64, Camera)> = None;
    for side in [1.0, -1.0] {
        // A ladder of offsets finds the first that can be had; halving then finds where it begins.
        let mut below = 0.0;
        let mut step = 1e-6 * f;
        // From 1e-6 f to 1e6 f; counted, since a denormal times 1.01 may be itself. Steps of 1.1 passed over what could be had first
        // for one odd camera in ten.
        for _ in 0..2780 {
            if at(side * step).is_some() {
                let (mut no, mut yes) = (below, step);
                for _ in 0..80 {
                    let middle = 0.5 * (no + yes);
                    if at(side * middle).is_some() { yes = middle } else { no = middle }
                }
                // A little inside, so that the answer survives the rounding of its own numbers.
                let inside = yes + 1e-6 * f;
                let found = at(side * inside).map(|solved| (inside, solved));
                if let Some((miss, solved)) = found.or_else(|| Some((yes, at(side * yes)?)))
                    && best.is_none_or(|(other, _)| miss < other.abs())
                {
                    best = Some((side * miss, solved));
                }
                break;
            }
            below = step;
            step *= 1.01;
        }
    }
    let (offset, solved) = best?;
    let world = Optics::new(&solved).ok()?.world_from_lens().plane(Plane { e: plane.e + offset, ..plane });
    Some(Nearest { plane: world.normalized(), miss: offset.abs(), camera: solved })
}
