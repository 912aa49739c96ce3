//! Hard cases of the camera's optics, each with the reason it is hard, against an oracle in 320 bits that shares no
//! code with the library.
//!
//! The measure is the problem's own conditioning. Every number that a case is given is moved by one ulp, in the
//! oracle, and what each moves the answer by is added up, with half an ulp of the answer itself: no algorithm in
//! double precision can promise less than some of that. A stable one stays within a small multiple, [`BOUND`].
//! `cargo test --release --test hard_cases -- --nocapture` prints the table.

#[path = "hard_cases/cases.rs"]
mod cases;
#[path = "hard_cases/decisions.rs"]
mod decisions;
#[path = "hard_cases/infinity.rs"]
mod infinity;
#[path = "hard_cases/input.rs"]
mod input;
#[path = "hard_cases/inverse.rs"]
mod inverse;
#[path = "hard_cases/oracle.rs"]
mod oracle;
#[path = "hard_cases/ours.rs"]
mod ours;
#[path = "hard_cases/planes.rs"]
mod planes;
#[path = "hard_cases/points.rs"]
mod points;
#[path = "hard_cases/solves.rs"]
mod solves;
#[path = "hard_cases/textbook.rs"]
mod textbook;
#[path = "hard_cases/wide.rs"]
mod wide;

use cases::Case;
use input::{COUNT, Input};
use oracle::Groups;
use wide::{Big, V3, big, near};

/// The multiple of its conditioning within which every answer of the library stays.
const BOUND: f64 = 4.0;

/// The largest difference in a group.
fn gap(a: &[Big], b: &[Big], projective: bool) -> f64 {
    let most = |sign: f64| {
        a.iter().zip(b).map(|(x, y)| near(&(x.clone() - big(sign) * y.clone())).abs()).fold(0.0, f64::max)
    };
    if projective { most(1.0).min(most(-1.0)) } else { most(1.0) }
}

/// What moving each number by an ulp, and rounding the answer, does to each group.
fn units(case: &Case, want: &Groups) -> Vec<f64> {
    let mut units: Vec<f64> =
        want.iter().map(|g| 0.5 * f64::EPSILON * oracle::size(g) + f64::from_bits(1)).collect();
    for i in 0..COUNT {
        let value = case.input.0[i];
        if value == 0.0 {
            continue;
        }
        let moved = |to: f64| {
            let mut input = Input(case.input.0);
            input.0[i] = to;
            (case.problem.oracle)(&input)
        };
        let moves = |other: Option<Groups>| -> Vec<f64> {
            match other {
                Some(other) => {
                    want.iter().zip(&other).map(|(a, b)| gap(a, b, case.problem.projective)).collect()
                }
                // An ulp away there is no answer: any error is the problem's own.
                None => vec![f64::INFINITY; want.len()],
            }
        };
        let (up, down) = (moves(moved(value.next_up())), moves(moved(value.next_down())));
        for (unit, (up, down)) in units.iter_mut().zip(up.into_iter().zip(down)) {
            *unit += if up.is_finite() && down.is_finite() { up.max(down) } else { up.min(down) };
        }
    }
    units
}

/// The largest error of an answer over its groups, relative and in units; None where there is no answer.
fn judge(case: &Case, want: &Groups, units: &[f64], got: Option<Groups>) -> Option<[f64; 2]> {
    let got = got?;
    let mut worst = [0.0f64; 2];
    for ((want, got), unit) in want.iter().zip(&got).zip(units) {
        let error = gap(want, got, case.problem.projective);
        let size = oracle::size(want);
        worst[0] = worst[0].max(if size > 0.0 { error / size } else { error });
        worst[1] = worst[1].max(error / unit);
    }
    Some(worst)
}

fn shown(value: Option<f64>) -> String {
    value.map_or("none".into(), |value| if value == 0.0 { "0".into() } else { format!("{value:.1e}") })
}

#[test]
fn every_case_stays_within_a_small_multiple_of_its_conditioning() {
    let cases = cases::all();
    // As README.md and docs/stability.md say.
    assert_eq!(cases.len(), 79);
    println!(
        "{:<46} {:<28} {:>8} {:>8} {:>8} {:>9} {:>9}  why it is hard",
        "case", "asked", "unit", "error", "in units", "textbook", "in units"
    );
    let mut wrong = Vec::new();
    let (mut worst, mut textbook_fails) = (0.0f64, 0);
    for case in &cases {
        let want = (case.problem.oracle)(&case.input)
            .unwrap_or_else(|| panic!("{}: the oracle has no answer", case.name));
        let units = units(case, &want);
        let ours = judge(case, &want, &units, (case.problem.ours)(&case.input));
        let textbook = judge(case, &want, &units, (case.problem.textbook)(&case.input));
        let relative =
            units.iter().zip(&want).map(|(u, w)| u / oracle::size(w).max(1e-300)).fold(0.0, f64::max);
        println!(
            "{:<46} {:<28} {:>8} {:>8} {:>8} {:>9} {:>9}  {}",
            case.name,
            case.problem.name,
            shown(Some(relative)),
            shown(ours.map(|o| o[0])),
            ours.map_or("none".into(), |o| format!("{:.2}", o[1])),
            shown(textbook.map(|t| t[0])),
            shown(textbook.map(|t| t[1])),
            case.why
        );
        let units_off = ours.map_or(f64::INFINITY, |o| o[1]);
        worst = worst.max(units_off);
        textbook_fails += usize::from(textbook.is_none_or(|t| t[1] > BOUND));
        if units_off.is_nan() || units_off > BOUND {
            wrong.push(format!("{} ({}): {units_off:.2} units", case.name, case.problem.name));
        }
    }
    println!(
        "{} cases: the library at most {worst:.2} units off, allowed {BOUND}; the textbook formulas beyond that in {textbook_fails}",
        cases.len()
    );
    assert!(textbook_fails >= 30, "the cases are not hard: textbook formulas fail in {textbook_fails}");
    assert!(wrong.is_empty(), "beyond {BOUND} units:\n{}", wrong.join("\n"));
}

#[test]
fn decisions_at_a_limit_are_the_oracles() {
    let all = decisions::all();
    assert_eq!(all.len(), 12);
    for decision in all {
        println!("{:<46} {:<18} {}", decision.name, decision.want, decision.why);
        assert!(decision.oracle, "{}: the oracle says otherwise", decision.name);
        assert!(decision.ours, "{}: the library decides otherwise than `{}`", decision.name, decision.want);
    }
}

#[test]
fn the_oracle_keeps_more_than_a_hundred_bits() {
    // sin(30 degrees) and 45 degrees back and forth, and a plane through three points of it.
    let (sine, _) = wide::sin_cos(30.0);
    assert_eq!(near(&(sine - big(0.5))), 0.0);
    let (s, c) = wide::sin_cos(45.0);
    assert!(near(&(wide::angle(&s, &c) - big(45.0))).abs() < 1e-90);
    let [p, q, r] = [[1.0, 2.0, 1e-20], [-3.0, 1e20, 0.5], [7.0, 7.0, 7.0]].map(V3::of);
    let (m, e) = wide::plane_through([(p.clone(), big(1.0)), (q, big(2.0)), (r, big(0.0))]);
    assert!(near(&(m.dot(&p) + e)).abs() < 1e-60);
}

#[test]
fn a_million_wanted_planes_are_met() {
    let found = inverse::forward_after_inverse(1_000_000);
    println!(
        "{} planes met ({} that no movement reaches left out): worst gap {:.1e}, worst miss {:.1e} of the distance, for each focal length of distance",
        found.solved, found.refused, found.gap, found.miss
    );
    // The movements and the extension are doubles: their own rounding moves a plane D away by D/f ulps of it.
    assert!(found.gap < 1e-14 && found.miss < 1e-14, "{:e} {:e}", found.gap, found.miss);
}
