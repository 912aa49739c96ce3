//! Ways to answer a question of the optics, to be timed, with the error of each: exact formulas in double and in single
//! precision, a textbook's, and for the blur the paraxial wedge. Clocks are the caller's.

use super::classic;
use super::formulas::{self, FOCAL};
use super::maps::{QUESTIONS, Question, blurred_point, extension};
use super::number::Number;

/// A lens of 150 mm at f/5.6, tilted and focused at 10 m: what a question is asked of.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    tilt: f64,
    extension: f64,
    point: [f64; 3],
}

impl Asked {
    /// Of a lens that is tilted by so many degrees.
    pub fn at(tilt: f64) -> Self {
        let extension = extension(tilt, DISTANCE);
        Self { tilt, extension, point: blurred_point(tilt, extension) }
    }
}

/// A question, a way to answer it, and how wrong that is.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// What is asked.
    pub question: &'static str,
    /// How it is answered.
    pub way: &'static str,
    /// Answers it; all that is found is added up.
    pub run: fn(Asked) -> f64,
    /// The largest relative error for tilts from 0.1 to 30 degrees, and for all from 1e-16 to 89; infinite where there is an answer
    /// that this way does not find.
    pub errors: [f64; 2],
}

/// Exact in double precision, exact in single precision, as a textbook does it.
const WAYS: [&str; 3] = ["exact, 64 bits", "exact, 32 bits", "textbook, 64 bits"];

/// The place of a question among the maps', and its answers in the order of the ways.
type Runs = (usize, [fn(Asked) -> f64; 3]);

/// Metres to the focus, and the f-number.
const DISTANCE: f64 = 10.0;
const NUMBER: f64 = 5.6;

/// All ways to answer each question.
pub fn answers() -> Vec<Answer> {
    let runs: [Runs; 4] = [
        (0, [exact_plane::<f64>, exact_plane::<f32>, |to| sum(classic::focus_plane(to.tilt, to.extension))]),
        (1, [exact_hinge::<f64>, exact_hinge::<f32>, |to| sum(classic::hinge_distance(to.tilt))]),
        (
            2,
            [exact_blur::<f64>, exact_blur::<f32>, |to| {
                sum(classic::blur(to.tilt, to.extension, NUMBER, to.point))
            }],
        ),
        (3, [exact_lens::<f64>, exact_lens::<f32>, |to| sum(classic::lens_for(leaning(to), DISTANCE))]),
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
        let known = all.map(Asked::at).map(|to| (paraxial(to), exact_blur::<f64>(to).abs()));
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

fn sum<T: Number, const N: usize>(values: Option<[T; N]>) -> f64 {
    values.map_or(0.0, |values| values.into_iter().map(|value| value.wide().near()).sum())
}

fn exact_plane<T: Number>(to: Asked) -> f64 {
    sum(Some(formulas::focus_plane::<T>(to.tilt, to.extension)))
}

fn exact_hinge<T: Number>(to: Asked) -> f64 {
    sum(Some(formulas::hinge_distance::<T>(to.tilt)))
}

fn exact_blur<T: Number>(to: Asked) -> f64 {
    sum(formulas::blur::<T>(to.tilt, to.extension, NUMBER, to.point))
}

/// The normal of a plane that leans as the lens does.
fn leaning(to: Asked) -> [f64; 3] {
    let (s, c) = libm::sincos(to.tilt.to_radians());
    [0.0, s, c]
}

fn exact_lens<T: Number>(to: Asked) -> f64 {
    sum(formulas::lens_for::<T>(leaning(to), DISTANCE))
}

/// The circle of confusion whose wedge has the point on its limit: `scale n.x - (e/f) a.x + e = 0`, `c = A |1 - scale|`.
/// (See [`crate::optics::Optics::depth_of_field`].)
fn paraxial(to: Asked) -> f64 {
    let [_, y, z] = to.point;
    let [_, s, c] = leaning(to);
    let e = -to.extension;
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
        for to in [0.0, 0.5, 2.0, 20.0].map(Asked::at) {
            let tilt = to.tilt;
            let mut camera = camera(tilt, to.extension).unwrap();
            camera.aperture =
                crate::camera::Aperture::FNumber(crate::quantity::FNumber::new(NUMBER).unwrap());
            let optics = Optics::new(&camera).unwrap();
            let point = glam::DVec3::from_array(to.point);
            let limits = optics.depth_of_field(paraxial(to)).unwrap();
            let on = |m: glam::DVec3, e: f64| (m.dot(point) + e).abs() < 1e-12;
            assert!(on(limits.near.m, limits.near.e) || on(limits.far.m, limits.far.e), "{tilt}");
            let exact = optics.blur_of(point).unwrap().largest;
            assert!((exact_blur::<f64>(to).abs() / exact - 1.0).abs() < 1e-9, "{tilt}");
        }
    }

    #[test]
    fn exact_formulas_are_exact_and_single_precision_is_not() {
        for answer in answers() {
            println!("{}, {}: {:?}", answer.question, answer.way, answer.errors);
            let [ordinary, worst] = answer.errors;
            assert!(ordinary <= worst && (answer.run)(Asked::at(5.0)).is_finite());
            match answer.way {
                // The blur 1 % beyond the focus loses two digits, by its own conditioning.
                "exact, 64 bits" => assert!(ordinary < 1e-12),
                "exact, 32 bits" => assert!((1e-9..1e-2).contains(&ordinary)),
                _ => {}
            }
        }
    }
}
