//! The JSON of `optics --json`: world frame, metres, every number printed so that it reads back exactly.

use glam::DVec3;
use groundglass::camera::Standard;
use groundglass::geometry::{Line, Plane};
use groundglass::optics::Optics;
use serde::Serialize;

#[derive(Serialize)]
pub(crate) struct OpticsJson {
    lens: Lens,
    film: Film,
    front: Movements,
    rear: Movements,
    extension_mm: f64,
    focus_plane: [f64; 4],
    scheimpflug_line: LineJson,
    hinge_line: LineJson,
    dof: Dof,
    hinge_distance: Option<f64>,
    pinhole_matrix: [f64; 16],
    #[serde(skip_serializing_if = "Option::is_none")]
    sample_matrices: Option<Vec<SampleMatrix>>,
    sensitivity: Option<SensitivityJson>,
}

/// How far the plane of focus moves, square to itself, at `far_end` (world) with a change of 0.01 degrees or 0.01 mm;
/// metres.
#[derive(Serialize)]
pub(crate) struct SensitivityJson {
    far_end: [f64; 3],
    front_tilt: f64,
    front_swing: f64,
    rear_tilt: f64,
    rear_swing: f64,
    extension: f64,
}

impl SensitivityJson {
    pub(crate) fn of(optics: &Optics) -> Option<Self> {
        let found = optics.sensitivity()?;
        Some(Self {
            far_end: optics.world_from_lens().point(found.far_end).to_array(),
            front_tilt: found.front[0],
            front_swing: found.front[1],
            rear_tilt: found.rear[0],
            rear_swing: found.rear[1],
            extension: found.extension,
        })
    }
}

#[derive(Serialize)]
struct Lens {
    center: [f64; 3],
    axis: [f64; 3],
    ex: [f64; 3],
    ey: [f64; 3],
    focal_length: f64,
    aperture_diameter: f64,
}

#[derive(Serialize)]
struct Film {
    center: [f64; 3],
    normal: [f64; 3],
    fx: [f64; 3],
    fy: [f64; 3],
    width: f64,
    height: f64,
}

#[derive(Serialize)]
pub(crate) struct Movements {
    tilt_deg: f64,
    swing_deg: f64,
    rise_mm: f64,
    shift_mm: f64,
}

#[derive(Serialize)]
struct LineJson {
    direction: [f64; 3],
    moment: [f64; 3],
}

#[derive(Serialize)]
struct Dof {
    circle_of_confusion: f64,
    near_plane: Option<[f64; 4]>,
    far_plane: Option<[f64; 4]>,
}

#[derive(Serialize)]
struct SampleMatrix {
    u: f64,
    v: f64,
    matrix: [f64; 16],
}

impl From<&Standard> for Movements {
    fn from(standard: &Standard) -> Self {
        Self {
            tilt_deg: standard.tilt.as_degrees(),
            swing_deg: standard.swing.as_degrees(),
            rise_mm: standard.rise.as_millimetres(),
            shift_mm: standard.shift.as_millimetres(),
        }
    }
}

pub(crate) fn plane(plane: Plane) -> [f64; 4] {
    let unit = plane.normalized();
    [unit.m.x, unit.m.y, unit.m.z, unit.e]
}

fn line(line: Line) -> LineJson {
    let unit = line.normalized();
    LineJson { direction: unit.direction.to_array(), moment: unit.moment.to_array() }
}

/// `circle_of_confusion` in metres; `samples` in fractions of the aperture's radius.
pub(crate) fn optics_json(
    optics: &Optics,
    circle_of_confusion: f64,
    samples: Option<&[[f64; 2]]>,
) -> OpticsJson {
    let world = optics.world_from_lens();
    let camera = optics.camera();
    let out = |v: DVec3| world.vector(v).to_array();
    let (ex, ey) = optics.lens_axes();
    let (fx, fy) = optics.film_axes();
    let dof = optics.depth_of_field(circle_of_confusion);
    let matrix = |u: f64, v: f64| {
        let radius = optics.aperture_radius();
        let rows = optics.projection_from_world(u * radius, v * radius).rows;
        std::array::from_fn(|i| rows[i / 4][i % 4])
    };
    OpticsJson {
        lens: Lens {
            center: world.origin.to_array(),
            axis: out(optics.axis()),
            ex: out(ex),
            ey: out(ey),
            focal_length: optics.focal_length(),
            aperture_diameter: camera.aperture_diameter(),
        },
        film: Film {
            center: camera.film_frame().origin.to_array(),
            normal: out(optics.film_normal()),
            fx: out(fx),
            fy: out(fy),
            width: camera.film.width.as_metres(),
            height: camera.film.height.as_metres(),
        },
        front: (&camera.front).into(),
        rear: (&camera.rear).into(),
        extension_mm: camera.extension.as_millimetres(),
        focus_plane: plane(world.plane(optics.focus_plane())),
        scheimpflug_line: line(world.line(optics.scheimpflug_line())),
        hinge_line: line(world.line(optics.hinge_line())),
        dof: Dof {
            circle_of_confusion,
            near_plane: dof.map(|dof| plane(world.plane(dof.near))),
            far_plane: dof.map(|dof| plane(world.plane(dof.far))),
        },
        hinge_distance: optics.hinge_distance(),
        pinhole_matrix: matrix(0.0, 0.0),
        sample_matrices: samples.map(|samples| {
            samples.iter().map(|&[u, v]| SampleMatrix { u, v, matrix: matrix(u, v) }).collect()
        }),
        sensitivity: SensitivityJson::of(optics),
    }
}
