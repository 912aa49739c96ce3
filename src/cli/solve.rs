//! `groundglass solve SCENE`: the movements that make a plane sharp. A target on the command line replaces the
//! file's; `--write` writes the scene with the movements found and without the target.

use super::input::{self, SceneArguments};
use super::values::{Distance, PlaneValue, PointsValue};
use clap::ValueEnum;
use groundglass::error::Result;
use groundglass::optics::{Adjust, FocusTarget};
use groundglass::scene::Focus;
use std::path::PathBuf;

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
    /// Stand the film upright first (tilting the rear), so that verticals stay parallel in the picture
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
    #[cfg_attr(not(test), expect(dead_code, reason = "for the body"))]
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
            (Some(target), _) => Some(Focus { target, adjust, place: Default::default() }),
            (None, Some(focus)) => Some(Focus { adjust, ..focus.clone() }),
            (None, None) => None,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let _input = input::read(&arguments.scene)?;
    // TODO body: solve for `arguments.focus(..)`, print, write.
    Err(super::not_built("solve"))
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
        assert_eq!(given.place.line, None);
        let given = focus(&["--distance", "inf"], None).unwrap();
        assert_eq!(given.target, FocusTarget::Distance(f64::INFINITY));
        assert!(Whole::try_parse_from(["s", "s.toml", "--distance", "1", "--plane", "0,0,0;0,1,0"]).is_err());
    }
}
