//! Ways to answer a question of the optics, to be timed, with the error of each: exact formulas in double and in single
//! precision, a textbook's, and for the blur the paraxial wedge. Clocks are the caller's.

use super::classic;
use super::formulas::{self, FOCAL};
use super::maps::{QUESTIONS, Question, blurred_point, extension};
use super::number::Number;
use super::wide::Wide;

/// A question, a way to answer it, and how wrong that is.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// What is asked.
    pub question: &'static str,
    /// How it is answered.
    pub way: &'static str,
    /// Answers it for a lens tilted by so many degrees; all that is found is added up.
    pub run: fn(f64) -> f64,
    /// The largest relative error for tilts from 0.1 to 30 degrees, and for all from 1e-16 to 89 (of the blur up to 0.9: beyond
    /// that its point is not before the lens); infinite where there is an answer that this way does not find.
    pub errors: [f64; 2],
}

/// Exact in double precision, exact in single precision, as a textbook does it.
const WAYS: [&str; 3] = ["exact, 64 bits", "exact, 32 bits", "textbook, 64 bits"];

/// The place of a question among the maps', and its answers in the order of the ways.
type Runs = (usize, [fn(f64) -> f64; 3]);

/// Metres to the focus, and the f-number.
const DISTANCE: f64 = 10.0;
const NUMBER: f64 = 5.6;

/// All ways to answer each question.
pub fn answers() -> Vec<Answer> {
    let runs: [Runs; 4] = [
        (0, [exact_plane::<f64>, exact_plane::<f32>, |t| wides(classic::focus_plane(t, focused(t)))]),
        (1, [exact_hinge::<f64>, exact_hinge::<f32>, |t| wides(classic::hinge_distance(t))]),
        (
            2,
            [exact_blur::<f64>, exact_blur::<f32>, |t| {
                wides(classic::blur(t, focused(t), NUMBER, blurred_point(t, focused(t))))
            }],
        ),
        (
            3,
            [exact_lens::<f64>, exact_lens::<f32>, |t| {
                let (s, c) = libm::sincos(t.to_radians());
                wides(classic::lens_for([0.0, s, c], DISTANCE))
            }],
        ),
    ];
    let mut answers = Vec::new();
    for (at, runs) in runs {
        let question = &QUESTIONS[at];
        for (column, (way, run)) in WAYS.into_iter().zip(runs).enumerate() {
            answers.push(Answer { question: question.title, way, run, errors: errors(question, column) });
        }
    }
    let wedge = [0.1..=30.0, 0.0..=89.0].map(|tilts: std::ops::RangeInclusive<f64>| {
        let all = values(&QUESTIONS[2]).filter(|t| tilts.contains(t));
        let all = all.filter(|&t| (QUESTIONS[2].cell)(t, NUMBER) != [None; 3]);
        let known = all.map(|t| (paraxial(t), exact_blur::<f64>(t).abs()));
        known.map(|(wedge, exact)| (wedge / exact - 1.0).abs()).fold(0.0, worse)
    });
    answers.push(Answer {
        question: QUESTIONS[2].title,
        way: "paraxial wedge, 64 bits",
        run: paraxial,
        errors: wedge,
    });
    answers
}

/// What is no number is worse than any.
fn worse(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

fn values(question: &Question) -> impl Iterator<Item = f64> {
    question.x.values()
}

fn errors(question: &Question, column: usize) -> [f64; 2] {
    let y = if question.name == "blur" { NUMBER } else { DISTANCE };
    // The maps' columns: library, textbook, single.
    let column = [0, 2, 1][column];
    [0.1..=30.0, 0.0..=89.0].map(|tilts: std::ops::RangeInclusive<f64>| {
        let all = values(question).filter(|t| tilts.contains(t)).map(|t| (question.cell)(t, y));
        // What nobody can answer is no fault of a way.
        let all = all.filter(|cell| *cell != [None; 3]);
        all.map(|cell| cell[column].unwrap_or(f64::INFINITY)).fold(0.0, worse)
    })
}

fn focused(tilt: f64) -> f64 {
    extension(tilt, DISTANCE)
}

fn sum<T: Number>(values: Vec<T>) -> f64 {
    values.into_iter().map(|value| value.wide().near()).sum()
}

fn wides(values: Option<Vec<Wide>>) -> f64 {
    values.map_or(0.0, sum)
}

fn exact_plane<T: Number>(tilt: f64) -> f64 {
    sum(formulas::focus_plane::<T>(tilt, focused(tilt)))
}

fn exact_hinge<T: Number>(tilt: f64) -> f64 {
    sum(formulas::hinge_distance::<T>(tilt))
}

fn exact_blur<T: Number>(tilt: f64) -> f64 {
    let extension = focused(tilt);
    formulas::blur::<T>(tilt, extension, NUMBER, blurred_point(tilt, extension)).map_or(0.0, sum)
}

fn exact_lens<T: Number>(tilt: f64) -> f64 {
    let (s, c) = libm::sincos(tilt.to_radians());
    formulas::lens_for::<T>([0.0, s, c], DISTANCE).map_or(0.0, sum)
}

/// The circle of confusion whose wedge has the point on its limit: `scale n.x - (e/f) a.x + e = 0`, `c = A |1 - scale|`.
/// (See [`crate::optics::Optics::depth_of_field`].)
fn paraxial(tilt: f64) -> f64 {
    let extension = focused(tilt);
    let [_, y, z] = blurred_point(tilt, extension);
    let (s, c) = libm::sincos(tilt.to_radians());
    let e = -extension;
    let scale = (e / FOCAL * (-s * y - c * z) - e) / z;
    FOCAL / NUMBER * (1.0 - scale).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Optics;
    use crate::stability::maps::camera;

    #[test]
    fn the_wedge_is_that_of_the_optics() {
        for tilt in [0.0, 0.5, 2.0] {
            let mut camera = camera(tilt, focused(tilt)).unwrap();
            camera.aperture =
                crate::camera::Aperture::FNumber(crate::quantity::FNumber::new(NUMBER).unwrap());
            let optics = Optics::new(&camera).unwrap();
            let point = glam::DVec3::from_array(blurred_point(tilt, focused(tilt)));
            let limits = optics.depth_of_field(paraxial(tilt)).unwrap();
            let on = |m: glam::DVec3, e: f64| (m.dot(point) + e).abs() < 1e-12;
            assert!(on(limits.near.m, limits.near.e) || on(limits.far.m, limits.far.e), "{tilt}");
            let exact = optics.blur_of(point).unwrap().largest;
            assert!((exact_blur::<f64>(tilt).abs() / exact - 1.0).abs() < 1e-9, "{tilt}");
        }
    }

    #[test]
    fn exact_formulas_are_exact_and_single_precision_is_not() {
        for answer in answers() {
            println!("{}, {}: {:?}", answer.question, answer.way, answer.errors);
            let [ordinary, worst] = answer.errors;
            assert!(ordinary <= worst && (answer.run)(5.0).is_finite());
            match answer.way {
                // The blur 1 % beyond the focus loses two digits, by its own conditioning.
                "exact, 64 bits" => assert!(ordinary < 1e-12),
                "exact, 32 bits" => assert!((1e-9..1e-2).contains(&ordinary)),
                _ => {}
            }
        }
    }
}
