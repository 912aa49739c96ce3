//! `groundglass solve SCENE`: the movements that make a plane sharp. A target on the command line replaces the
//! file's; `--write` writes the scene with the movements found and without the target.

use super::input::{self, SceneArguments};
use super::optics_json::{self, Movements, SensitivityJson};
use super::values::{Distance, PlaneValue, PointsValue};
use super::{new, optics_words, output, report};
use clap::ValueEnum;
use groundglass::camera::Camera;
use groundglass::error::{Error, ErrorKind, Place, Result};
use groundglass::optics::{Adjust, FocusTarget, Optics, Unsolvable, solve, upright};
use groundglass::scene::{Focus, with_movements};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("target").multiple(false))]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Make this plane sharp: a point and a normal, world metres
    #[arg(long, value_name = "PX,PY,PZ;NX,NY,NZ", group = "target", allow_hyphen_values = true)]
    pub(super) plane: Option<PlaneValue>,
    /// Make the plane through three points sharp, world metres
    #[arg(long, value_name = "X,Y,Z;X,Y,Z;X,Y,Z", group = "target", allow_hyphen_values = true)]
    pub(super) points: Option<PointsValue>,
    /// Focus at this distance along the lens axis, in metres (inf allowed)
    #[arg(long, value_name = "M", group = "target", allow_hyphen_values = true)]
    pub(super) distance: Option<Distance>,
    /// The standard to turn; the file's by default
    #[arg(long, value_name = "STANDARD")]
    pub(super) adjust: Option<AdjustValue>,
    /// Keep uprights upright: tilt the film parallel to `up` first (perspective correction)
    #[arg(long)]
    pub(super) upright: bool,
    /// Print JSON instead of text
    #[arg(long)]
    pub(super) json: bool,
    /// Write the scene with the movements found, comments kept
    #[arg(long, value_name = "FILE")]
    pub(super) write: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum AdjustValue {
    /// The lens standard
    Front,
    /// The film standard
    Rear,
}

impl Arguments {
    /// The target to solve for: the command line's, else the file's.
    pub(super) fn focus(&self, file: Option<&Focus>) -> Option<Focus> {
        let given = match (&self.plane, &self.points, &self.distance) {
            (Some(plane), ..) => Some(FocusTarget::Plane { point: plane.point, normal: plane.normal }),
            (_, Some(points), _) => Some(FocusTarget::Points(points.0)),
            (.., Some(distance)) => Some(FocusTarget::Distance(distance.0)),
            _ => None,
        };
        let adjust = match self.adjust {
            Some(AdjustValue::Front) => Some(Adjust::Front),
            Some(AdjustValue::Rear) => Some(Adjust::Rear),
            None => None,
        };
        let adjust = adjust.or(file.map(|focus| focus.adjust)).unwrap_or_default();
        match (given, file) {
            (Some(target), _) => {
                let key = match target {
                    FocusTarget::Plane { .. } => "--plane",
                    FocusTarget::Points(_) => "--points",
                    FocusTarget::Distance(_) => "--distance",
                };
                let place = Place { key: Some(key.to_owned()), ..Place::default() };
                Some(Focus { target, adjust, place })
            }
            (None, Some(focus)) => Some(Focus { adjust, ..focus.clone() }),
            (None, None) => None,
        }
    }
}

/// The JSON of `solve --json`.
#[derive(Serialize)]
struct Answer {
    solved: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
    /// The movements found; those of the nearest plane when the wanted one cannot be had.
    #[serde(flatten)]
    movements: Option<Found>,
    #[serde(skip_serializing_if = "Option::is_none")]
    miss_m: Option<f64>,
}

#[derive(Serialize)]
struct Found {
    front: Movements,
    rear: Movements,
    extension_mm: f64,
    focus_plane: [f64; 4],
    sensitivity: Option<SensitivityJson>,
}

impl Found {
    fn new(camera: &Camera) -> Result<Self> {
        let optics = Optics::new(camera)?;
        Ok(Self {
            front: (&camera.front).into(),
            rear: (&camera.rear).into(),
            extension_mm: camera.extension.as_millimetres(),
            focus_plane: optics_json::plane(optics.world_from_lens().plane(optics.focus_plane())),
            sensitivity: SensitivityJson::of(&optics),
        })
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let input = input::read(&arguments.scene)?;
    let scene = &input.scene;
    let Some(focus) = arguments.focus(scene.focus.as_ref()) else {
        return Err(Error::invalid("the scene names nothing to make sharp")
            .in_file(input.name())
            .at_key("focus")
            .remedy(
                "give plane, points_m or distance_m in a [focus] table, or --plane, --points or --distance",
            ));
    };
    let mut camera = scene.camera;
    if arguments.upright {
        // A distance turns no standard, whatever the file says of planes.
        let is_moot = arguments.adjust.is_none() && matches!(focus.target, FocusTarget::Distance(_));
        if focus.adjust == Adjust::Rear && !is_moot {
            return Err(Error::new(
                ErrorKind::Usage,
                "--upright sets the rear standard, so the front one must be adjusted",
            )
            .remedy("give --adjust front"));
        }
        camera = match upright(&camera, scene.up) {
            Ok(camera) => camera,
            Err(why) => return refuse(arguments, &input.name(), Place::default(), why),
        };
    }
    let solved = match solve(&camera, &focus.target, focus.adjust) {
        Ok(solved) => solved,
        Err(why) => return refuse(arguments, &input.name(), focus.place, why),
    };
    let optics = Optics::new(&solved)?;
    if let Some(target) = &arguments.write {
        write(&input, &solved, target)?;
    }
    report::warnings(&optics_words::warnings(&optics, &input.name()));
    if arguments.json {
        let movements = Some(Found::new(&solved)?);
        return report::print_json(&Answer {
            solved: true,
            limit: None,
            message: None,
            movements,
            miss_m: None,
        });
    }
    let mut text = optics_words::optics_words(&optics, scene.circle_of_confusion.as_metres(), scene.up);
    if let Some(target) = &arguments.write {
        text.push_str(&format!("\nwrote {}\n", target.display()));
    }
    report::print(&text)
}

/// No movement does it: says which limit stops it, and the nearest plane that can be had.
fn refuse(arguments: &Arguments, file: &str, place: Place, why: Unsolvable) -> Result<()> {
    if arguments.json {
        report::print_json(&Answer {
            solved: false,
            limit: Some(format!("{:?}", why.limit)),
            message: Some(why.message.clone()),
            movements: why.nearest.as_ref().and_then(|nearest| Found::new(&nearest.camera).ok()),
            miss_m: why.nearest.as_ref().map(|nearest| nearest.miss),
        })?;
    }
    let mut remedy = why.remedy();
    if let Some(nearest) = &why.nearest {
        let [x, y, z, e] = optics_json::plane(nearest.plane);
        // What rounding left of a zero.
        let [x, y, z] = [x, y, z].map(|v| if v.abs() < 1e-15 { 0.0 } else { v });
        // Without signs of zeros.
        let [px, py, pz] = [x, y, z].map(|v| 0.0 - e * v);
        remedy.push_str(&format!(
            ": --plane \"{px},{py},{pz};{x},{y},{z}\" (front {}; rear {})",
            optics_words::movements(&nearest.camera.front),
            optics_words::movements(&nearest.camera.rear),
        ));
    }
    if arguments.upright {
        remedy.push_str("; without --upright more can be had");
    }
    Err(Error::no_solution(why.message).at(place).in_file(file).remedy(remedy))
}

/// Writes the scene with the movements found and without its target.
fn write(input: &input::Input, camera: &Camera, target: &Path) -> Result<()> {
    let from = input.path.parent().unwrap_or(Path::new("."));
    let to = output::folder(target)?;
    let back = new::relative(&to, from)?;
    let moved = |path: &str| match input.find(path) {
        _ if to == from => path.to_owned(),
        Some(file) => new::relative(&to, &file).unwrap_or_else(|_| path.to_owned()),
        // A mesh that is not there: from the old folder, as it was written.
        None => format!("{back}/{path}"),
    };
    let text = with_movements(input.scene.document.text(), camera, moved)?;
    // The scene itself may be replaced by its solution, but nothing that is no scene.
    let is_scene = || {
        let text = std::fs::read_to_string(target).unwrap_or_default();
        let table: Option<toml::Table> = text.parse().ok();
        // A figure file, which has a kind, may have a camera too.
        table.is_some_and(|table| {
            table.get("camera").is_some_and(toml::Value::is_table) && !table.contains_key("kind")
        })
    };
    if target.is_file() && !output::is_same(target, &input.path) && !is_scene() {
        return Err(Error::invalid("there is a file of this name already, and it is no scene")
            .in_file(target.display().to_string())
            .remedy("give another name with --write"));
    }
    let meshes: Vec<PathBuf> = input.scene.meshes.iter().filter_map(|mesh| input.find(&mesh.path)).collect();
    output::write_text(target, &meshes, &text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Whole {
        #[command(flatten)]
        arguments: Arguments,
    }

    fn focus(words: &[&str], file: Option<&Focus>) -> Option<Focus> {
        let words = ["solve", "s.toml"].iter().chain(words);
        Whole::try_parse_from(words).unwrap().arguments.focus(file)
    }

    #[test]
    fn the_command_line_replaces_the_files_target() {
        let file = Focus {
            target: FocusTarget::Distance(3.0),
            adjust: Adjust::Rear,
            place: groundglass::error::Place { line: Some(7), ..Default::default() },
        };
        assert_eq!(focus(&[], None), None);
        assert_eq!(focus(&[], Some(&file)), Some(file.clone()));
        let front = focus(&["--adjust", "front"], Some(&file)).unwrap();
        assert_eq!((front.adjust, front.place.line), (Adjust::Front, Some(7)));
        let given = focus(&["--points", "-1,0,0;1,0,0;0,1,0"], Some(&file)).unwrap();
        assert!(matches!(given.target, FocusTarget::Points(_)) && given.adjust == Adjust::Rear);
        assert_eq!((given.place.line, given.place.key.as_deref()), (None, Some("--points")));
        let given = focus(&["--distance", "inf"], None).unwrap();
        assert_eq!(given.target, FocusTarget::Distance(f64::INFINITY));
        assert!(Whole::try_parse_from(["s", "s.toml", "--distance", "1", "--plane", "0,0,0;0,1,0"]).is_err());
    }
}
