//! The camera of a first scene. In: statistics of a model and a scale; out: where the camera stands, what it
//! focuses on and how wide its lens is open.

use super::starter_measure::Statistics;
use crate::camera::{Aperture, Camera, FilmSize, Standard, unit};
use crate::geometry::Pose;
use crate::optics::{Adjust, FocusTarget, Optics, solve};
use crate::quantity::{FNumber, Length};
use glam::{DMat3, DVec3};

/// Film of the generated camera: 4x5 inch.
const FILM_M: [f64; 2] = [0.120, 0.096];
/// Room left around the model.
const MARGIN: f64 = 1.08;
/// Largest blur of what is in the frame, as a share of the picture's width.
const BLUR: f64 = 0.02;
/// f-numbers to choose from.
pub(super) const STOPS: [f64; 10] = [1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0];

/// What the camera shall be, in metres.
pub(super) struct View {
    pub(super) eye: DVec3,
    pub(super) look_at: DVec3,
    pub(super) focal: f64,
    pub(super) near: f64,
    /// A point and the normal of the plane that is to be sharp.
    pub(super) focus: [DVec3; 2],
    pub(super) why: &'static str,
    pub(super) sun: DVec3,
    /// The f-number for which the blur is [`BLUR`].
    pub(super) f_number: f64,
    /// Whether the camera stands inside, so that no other scale would show more blur.
    pub(super) inside: bool,
}

/// The camera for a model of these `bounds` (its own units) at `scale`.
pub(super) fn view_of(statistics: &Statistics, bounds: [DVec3; 2], scale: f64) -> View {
    let [lo, hi] = bounds.map(|corner| corner * scale);
    let ground = statistics.ground.map(|level| level * scale);
    let wall = |axis: usize, side: usize| statistics.cover[axis][side].inward > 0.6;
    let open = |axis: usize, side: usize| {
        let cover = statistics.cover[axis][side];
        cover.inward + cover.outward < 0.25
    };
    let walls: Vec<(usize, usize)> = [(2, 1), (0, 1), (0, 0), (2, 0)].into();
    let opening = walls.iter().find(|&&(axis, side)| {
        open(axis, side) && walls.iter().all(|&(a, s)| (a, s) == (axis, side) || wall(a, s))
    });
    // Nobody stands in what is lower than a tenth of its length.
    let floor = wall(1, 0) && hi.y - lo.y > 0.1 * (hi.x - lo.x).max(hi.z - lo.z);
    let mut points: Vec<DVec3> = statistics.outline.iter().map(|&corner| corner * scale).collect();
    if points.is_empty() || opening.is_some() {
        points = corners(lo, hi).into();
    }
    let mut view = match (opening, statistics.sheet) {
        (Some(&(axis, side)), _) if floor => into_room(&points, [lo, hi], axis, side),
        _ if floor && walls.iter().all(|&(axis, side)| wall(axis, side)) => inside_room(lo, hi, ground),
        (_, Some([centre, normal])) if normal.y.abs() < 0.8 => facing_sheet(&points, centre * scale, normal),
        (_, sheet) => outside(&points, ground, sheet.map(|[centre, normal]| [centre * scale, normal])),
    };
    // All of a sheet is sharp: no aperture and no scale would blur it.
    if statistics.sheet.is_none() {
        view.f_number = f_number(&view, &points);
    }
    view
}

fn corners(lo: DVec3, hi: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|corner| {
        let pick = |bit: usize| if corner >> bit & 1 == 0 { lo[bit] } else { hi[bit] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// The rail of a camera that looks along `-back`, with the points centred in the frame and filling it; the
/// extension follows from the focus, hence the rounds.
fn fit(points: &[DVec3], back: DVec3, focal: f64, focus: impl Fn(DVec3) -> [DVec3; 2]) -> View {
    let back = unit(back).unwrap_or(DVec3::Z);
    let right = unit(DVec3::Y.cross(back)).unwrap_or(DVec3::X);
    let up = back.cross(right);
    // Offsets from the first point, so that a model far from the origin keeps its digits.
    let origin = points.first().copied().unwrap_or_default();
    let most = |v: DVec3| points.iter().map(|&p| v.dot(p - origin)).fold(f64::NEG_INFINITY, f64::max);
    let (nearest, farthest) = (most(back), -most(-back));
    // The place along `axis` from which the outermost points appear equally far from the middle.
    let centred = |axis: DVec3, depth: f64| {
        let (mut low, mut high) = (-most(-axis), most(axis));
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            let place = |&p: &DVec3| (axis.dot(p - origin) - middle) / (depth - back.dot(p - origin));
            let (least, greatest) =
                points.iter().map(place).fold((0.0_f64, 0.0_f64), |(l, g), at| (l.min(at), g.max(at)));
            if least + greatest > 0.0 { low = middle } else { high = middle }
        }
        axis * ((low + high) / 2.0)
    };
    let mut extension = focal;
    let mut view = View::new(origin, origin - back, focal, focus(origin));
    for _ in 0..20 {
        // |(p - eye).axis| <= slope * depth, for both edges of both axes: four planes that touch the points.
        let slopes = FILM_M.map(|film| film / (2.0 * extension * MARGIN));
        let mut depth = nearest + 3.0 * focal;
        for (axis, slope) in [right, up].into_iter().zip(slopes) {
            let (plus, minus) = (most(axis + slope * back), most(slope * back - axis));
            depth = depth.max((plus + minus) / (2.0 * slope));
        }
        let eye = centred(right, depth) + centred(up, depth);
        view.eye = origin + eye + back * depth;
        view.look_at = view.eye - back * (depth - (nearest + farthest) / 2.0);
        view.near = (depth - nearest) / 2.0;
        view.focus = focus(view.look_at);
        let Some(solved) = camera(&view, STOPS[5]) else { break };
        extension = solved.extension.as_metres();
    }
    view
}

impl View {
    fn new(eye: DVec3, look_at: DVec3, focal: f64, focus: [DVec3; 2]) -> Self {
        let (near, why, sun) = (focal / 10.0, "", DVec3::new(-0.4, 1.0, 0.7));
        Self { eye, look_at, focal, near, focus, why, sun, f_number: STOPS[4], inside: false }
    }

    /// The nearest of [`STOPS`].
    pub(super) fn stop(&self) -> f64 {
        STOPS.into_iter().find(|stop| stop * 1.19 > self.f_number).unwrap_or(STOPS[9])
    }
}

/// The camera of `view` with its movements solved; `None` where nothing does it.
fn camera(view: &View, f_number: f64) -> Option<Camera> {
    let back = unit(view.eye - view.look_at)?;
    let right = unit(DVec3::Y.cross(back))?;
    let [width, height] = FILM_M.map(Length::metres);
    let camera = Camera {
        rail: Pose { origin: view.eye, axes: DMat3::from_cols(right, back.cross(right), back) },
        front: Standard::default(),
        rear: Standard::default(),
        extension: Length::metres(view.focal),
        focal_length: Length::metres(view.focal),
        aperture: Aperture::FNumber(FNumber::new(f_number).ok()?),
        film: FilmSize { width, height },
        near: Length::metres(view.near),
    };
    let [point, normal] = view.focus;
    solve(&camera, &FocusTarget::Plane { point, normal }, Adjust::Front).ok()
}

/// The f-number at which no point in the frame is blurred more than [`BLUR`].
fn f_number(view: &View, points: &[DVec3]) -> f64 {
    // Small enough an aperture that every blur is an ellipse, and proportional to it.
    const TRIAL: f64 = 64.0;
    let Some(optics) = camera(view, TRIAL).and_then(|camera| Optics::new(&camera).ok()) else {
        return STOPS[4];
    };
    let in_frame = |center: [f64; 2]| center.iter().zip(FILM_M).all(|(c, size)| c.abs() <= 0.5 * size);
    let blur = |&p: &DVec3| optics.blur_of(optics.world_from_lens().point_inverse(p));
    let blurs = points.iter().filter_map(blur).filter(|b| in_frame(b.center)).map(|b| b.largest);
    let most = blurs.fold(0.0, f64::max);
    if most > 0.0 && most.is_finite() { TRIAL * most / (BLUR * FILM_M[0]) } else { STOPS[4] }
}

fn outside(points: &[DVec3], ground: Option<f64>, sheet: Option<[DVec3; 2]>) -> View {
    let back = DVec3::new(0.35, 0.45, 1.0);
    let (lo, hi) = extent(points);
    let size = hi - lo;
    let level = ground.unwrap_or(lo.y);
    let view = match (sheet, size.y < 0.5 * size.x.max(size.z)) {
        (Some(sheet), _) => View {
            why: "the plane that the model lies near: the lens tilts until all of it is sharp",
            ..fit(points, back, 0.150, |_| sheet)
        },
        // From higher up, so that what is flat fills the frame.
        (None, true) => View {
            why: "the ground: the lens tilts forward until all of it is sharp",
            ..fit(points, back + DVec3::new(0.0, 0.2, 0.0), 0.150, |middle| {
                [DVec3::new(middle.x, level, middle.z), DVec3::Y]
            })
        },
        (None, false) => View {
            why: "an upright plane through the model's front half, facing the camera",
            ..fit(points, back, 0.150, |_| {
                let toward = unit(DVec3::new(back.x, 0.0, back.z)).unwrap_or(DVec3::Z);
                let along = toward.dot(size / 2.0);
                [(lo + hi) / 2.0 + toward * (0.4 * along), toward]
            })
        },
    };
    // Where the ground passes too near to the lens for its focal length, an upright plane always does.
    if camera(&view, STOPS[0]).is_some() { view } else { upright(points, back) }
}

fn upright(points: &[DVec3], back: DVec3) -> View {
    let (lo, hi) = extent(points);
    View {
        why: "a plane through the model's middle, square to the view",
        ..fit(points, back, 0.150, |_| [(lo + hi) / 2.0, back])
    }
}

fn facing_sheet(points: &[DVec3], centre: DVec3, normal: DVec3) -> View {
    let front = DVec3::new(0.1, 0.0, 1.0).dot(normal) >= 0.0;
    let normal = if front { normal } else { -normal };
    let right = unit(DVec3::Y.cross(normal)).unwrap_or(DVec3::X);
    let back = normal + 0.45 * right + 0.25 * DVec3::Y;
    let view = View {
        why: "the plane that the model lies in: the lens turns until all of it is sharp",
        sun: normal + DVec3::new(-0.4, 0.6, 0.1),
        ..fit(points, back, 0.150, |_| [centre, normal])
    };
    if camera(&view, STOPS[0]).is_some() { view } else { upright(points, back) }
}

fn extent(points: &[DVec3]) -> (DVec3, DVec3) {
    let first = points.first().copied().unwrap_or_default();
    points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)))
}

fn into_room(points: &[DVec3], [lo, hi]: [DVec3; 2], axis: usize, side: usize) -> View {
    let (centre, half) = ((lo + hi) / 2.0, (hi - lo) / 2.0);
    let mut back = DVec3::ZERO;
    back[axis] = if side == 1 { 1.0 } else { -1.0 };
    View {
        why: "a plane across the room, before its middle, facing the camera",
        sun: back + DVec3::new(0.2, 0.6, 0.1),
        ..fit(points, back, 0.150, |_| [centre + back * (0.25 * half[axis]), back])
    }
}

fn inside_room(lo: DVec3, hi: DVec3, ground: Option<f64>) -> View {
    let size = hi - lo;
    let axis = if size.x >= size.z { 0 } else { 2 };
    let centre = (lo + hi) / 2.0;
    let level = ground.unwrap_or(lo.y);
    let height = level + (0.4 * size.y).min(1.7);
    let (mut eye, mut look_at) = (centre, centre);
    eye[axis] = lo[axis] + 0.2 * size[axis];
    look_at[axis] = hi[axis];
    (eye.y, look_at.y) = (height, height);
    // The floor's hinge lies a camera's height below the lens, which must be more than the focal length.
    let focal = (0.090_f64).min((height - level) / 3.0).max(0.001);
    let back = if axis == 0 { DVec3::NEG_X } else { DVec3::NEG_Z };
    View {
        near: 0.05_f64.min(0.05 * size[axis]),
        why: "the floor: the lens tilts forward until all of it is sharp",
        sun: back * 0.3 + DVec3::new(0.2, 1.0, 0.2),
        inside: true,
        ..View::new(eye, look_at, focal, [DVec3::new(centre.x, level, centre.z), DVec3::Y])
    }
}
