//! The named cases: what is asked, of which camera, and why that is hard.

use super::input::Input;
use super::oracle::{self, Groups};
use super::{infinity, ours, planes, points, solves, textbook};

type Answer = fn(&Input) -> Option<Groups>;

/// A question with three ways to its answer.
#[derive(Clone, Copy)]
pub struct Problem {
    pub name: &'static str,
    pub oracle: Answer,
    pub ours: Answer,
    pub textbook: Answer,
    /// Whether groups are the same up to sign.
    pub projective: bool,
}

macro_rules! problems {
    ($($name:ident: $text:literal, $function:ident, $projective:literal;)*) => {
        $(pub const $name: Problem = Problem {
            name: $text,
            oracle: oracle::$function,
            ours: ours::$function,
            textbook: textbook::$function,
            projective: $projective,
        };)*
    };
}

problems! {
    FOCUS: "focus plane", focus_plane, true;
    SCHEIMPFLUG: "Scheimpflug line", scheimpflug, true;
    HINGE: "hinge line", hinge, true;
    J: "hinge distance", hinge_distance, false;
    LIMITS: "near and far planes", limits, true;
    POINT: "film point", film_point, false;
    CLIP: "film point, homogeneous", clip, false;
    WORLD: "film point of a world point", world_point, false;
    BLUR: "blur", blur, false;
    IMAGE: "image point", image, true;
    RAIL: "rail frame", rail_frame, false;
    DISTANCE: "extension for a distance", distance, false;
    FRONT: "lens for a plane", front_plane, false;
    POINTS: "lens for three points", front_points, false;
    REAR: "film for a plane", rear_plane, false;
}

pub struct Case {
    pub name: &'static str,
    pub why: &'static str,
    pub problem: Problem,
    pub input: Input,
}

/// All cases in the order of the report.
pub fn all() -> Vec<Case> {
    [planes::all(), infinity::all(), points::all(), solves::all()].into_iter().flatten().collect()
}
