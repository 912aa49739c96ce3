//! How far from the lens a section cuts a line and which way, in words. In: a section and a line. Out: words.
//!
//! A section that is not square to a line cuts it farther off than it is. What stands beside a drawing is what can be measured in
//! it, and says so.

use super::section::{Pierce, SectionPlane, View};
use super::words;
use crate::geometry::Line;

/// A cut so little farther off than the line itself is as far, in three digits.
const SQUARE: f64 = 1.0005;

/// Where a section cuts a line.
pub(crate) struct Cut {
    /// From the lens centre, with its unit.
    pub(crate) distance: String,
    pub(crate) way: String,
    /// Whether the line itself is as far off: the section is square to it.
    pub(crate) is_square: bool,
}

/// The cut at the section point `p`.
pub(crate) fn cut(section: &SectionPlane, line: Line, p: [f64; 2]) -> Cut {
    let (drawn, is_square) = (libm::hypot(p[0], p[1]), is_square(section, line));
    let distance = words::length(if is_square { line.distance_from_origin() } else { drawn });
    Cut { distance, way: whither(section, p), is_square }
}

/// Whether a distance from the lens to the line can be measured in the section.
pub(crate) fn is_square(section: &SectionPlane, line: Line) -> bool {
    let near = SQUARE * line.distance_from_origin();
    matches!(section.pierce(line), Pierce::At(p) if libm::hypot(p[0], p[1]) <= near)
}

/// A distance is said to lie one way if it does in three digits, as a part of what lies the other way.
const ASIDE: f64 = 0.1;

/// The way to a section point in words: along the section's own up, along the rail, or both.
fn whither(section: &SectionPlane, p: [f64; 2]) -> String {
    let along = if p[0] >= 0.0 { "ahead" } else { "behind" };
    if p[1].abs() < ASIDE * p[0].abs() {
        return along.to_owned();
    }
    let upward = upward(section, p);
    if p[0].abs() < ASIDE * p[1].abs() {
        return upward.to_owned();
    }
    format!("{} and {along}", upward.replace(" and ", ", "))
}

/// The way to a section point along the section's own up.
fn upward(section: &SectionPlane, p: [f64; 2]) -> &'static str {
    // Above and right of the camera, as the photographer has them.
    let (up, right) = (p[1] * section.v.y, p[1] * section.v.x);
    let both = section.view == View::Oblique && up.abs().min(right.abs()) > 0.35 * up.abs().max(right.abs());
    match (up >= 0.0, right > 0.0) {
        (true, true) if both => "above and right",
        (true, false) if both => "above and left",
        (false, true) if both => "below and right",
        (false, false) if both => "below and left",
        (is_up, _) if section.view != View::Top && up.abs() >= right.abs() => {
            if is_up {
                "above"
            } else {
                "below"
            }
        }
        (_, true) => "to the right",
        (_, false) => "to the left",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::diagram::section::Section;
    use crate::optics::Optics;
    use crate::quantity::Angle;
    use glam::DVec3;

    #[test]
    fn what_is_said_is_what_the_section_shows() {
        let mut camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z * 10.0).unwrap();
        (camera.front.tilt, camera.front.swing) = (Angle::degrees(10.0), Angle::degrees(15.0));
        let optics = Optics::new(&camera).unwrap();
        let line = optics.hinge_line();
        let j = optics.hinge_distance().unwrap();
        for (choice, square) in [(Section::Auto, true), (Section::Side, false), (Section::Top, false)] {
            let section = SectionPlane::new(&optics, choice);
            let Pierce::At(p) = section.pierce(line) else { panic!("{choice:?}") };
            let cut = cut(&section, line, p);
            assert_eq!((cut.is_square, is_square(&section, line)), (square, square), "{choice:?}");
            let drawn = libm::hypot(p[0], p[1]);
            assert_eq!(cut.distance, words::length(drawn), "{choice:?}");
            assert!(if square { (drawn / j - 1.0).abs() < 1e-9 } else { drawn > 1.01 * j }, "{choice:?}");
            // The way is that to the point, in space.
            let at: DVec3 = section.u * p[0] + section.v * p[1];
            for (word, along) in [("above", at.y), ("below", -at.y), ("right", at.x), ("left", -at.x)] {
                assert!(!cut.way.contains(word) || along > 0.0, "{choice:?}: {} {at}", cut.way);
            }
            let has = |words: [&str; 2]| words.iter().any(|word| cut.way.contains(word));
            let both = has(["above", "below"]) && has(["left", "right"]);
            assert_eq!(both, choice == Section::Auto, "{choice:?}: {}", cut.way);
            // One way only where nearly all of the distance lies along it.
            let is_along = p[0].abs() > 0.1 * p[1].abs();
            assert_eq!(
                cut.way.contains("ahead") || cut.way.contains("behind"),
                is_along,
                "{choice:?}: {} {p:?}",
                cut.way
            );
        }
    }
}
