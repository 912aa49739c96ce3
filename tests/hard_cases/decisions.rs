//! Cases whose answer is yes or no, or which limit: the oracle's sign decides, the library must decide alike.

use super::input::Input;
use super::input::Key::*;
use super::oracle;
use super::ours;
use super::wide::{Big, V3, big, is_zero, near, positive};
use groundglass::optics::{Adjust, Limit};

pub struct Decision {
    pub name: &'static str,
    pub why: &'static str,
    /// What the oracle says, in words.
    pub want: &'static str,
    pub oracle: bool,
    pub ours: bool,
}

fn refused(input: &Input, points: bool, adjust: Adjust, limit: Limit) -> bool {
    let target = if points { ours::points(input) } else { ours::target(input) };
    matches!(ours::solved(input, target, adjust), Err(Some(found)) if found == limit)
}

fn reaches(input: &Input) -> bool {
    let c = oracle::Camera::new(input);
    let (x, y) = (c.n.dot(&c.ex), c.n.dot(&c.ey));
    let slope = super::wide::root(&(x.clone() * x + y.clone() * y));
    c.e + c.radius * slope >= Big::ZERO
}

pub fn all() -> Vec<Decision> {
    let b = Input::base;
    let tall = |j: f64| b().at(Px, [0.0, -j, 0.0]).at(Qx, [0.0, 1.0, 0.0]);
    let wide_open = |ulps: f64| {
        // A film at 30 degrees that reaches a lens of radius 0.15 m where the extension is 0.075 m.
        b().with(Number, 0.5)
            .with(RearTilt, 60.0)
            .with(Extension, 150.0 * 3f64.sqrt() * (1.0 + ulps * f64::EPSILON))
    };
    let short = tall(0.15 * (1.0 - 1e-12));
    let on_a_line = b().at(Px, [0.1, 0.2, -10.0]).at(Qx, [0.2, 0.4, -11.0]).at(Rx, [0.3, 0.6, -12.0]);
    let through = b().at(Px, [0.3, 0.0, -1.0]).at(Qx, [1.0, 0.0, 0.3]);
    let decide = |name, why, want, oracle, ours| Decision { name, why, want, oracle, ours };
    let upright = b().at(AtX, [1.0, 2.0, 3.0]).at(UpX, [-2.0, -4.0, -6.0]);
    let has_image = |d: f64| oracle::distance(&b().with(C, d)).is_some_and(|found| positive(&found[0][0]));
    let distance = |d: f64| ours::distance(&b().with(C, d)).is_some();
    vec![
        decide(
            "J = f (1 - 1e-12)",
            "1e-12 too near for a real root",
            "J < f",
            oracle::front_plane(&short).is_none(),
            refused(&short, false, Adjust::Front, Limit::HingeTooNear),
        ),
        decide(
            "J = f",
            "one double root: the lens square to the film, which stands at infinity",
            "no image",
            oracle::front_plane(&tall(0.15)).is_none(),
            ours::front_plane(&tall(0.15)).is_none(),
        ),
        decide("distance f", "the image is at infinity", "refused", !has_image(0.15), !distance(0.15)),
        decide(
            "distance f, one ulp more",
            "the film stands 7e14 m behind",
            "solved",
            has_image(0.15f64.next_up()),
            distance(0.15f64.next_up()),
        ),
        decide(
            "tilt 90",
            "cos 90 degrees is 0, in f64 6e-17",
            "refused",
            oracle_is_sideways(90.0),
            ours::optics(&b().with(FrontTilt, 90.0)).is_none(),
        ),
        decide(
            "tilt 90, one ulp less",
            "it still faces forwards",
            "a camera",
            !oracle_is_sideways(90f64.next_down()),
            ours::optics(&b().with(FrontTilt, 90f64.next_down())).is_some(),
        ),
        decide(
            "swing -90",
            "the same to the left",
            "refused",
            oracle_is_sideways(-90.0),
            ours::optics(&b().with(RearSwing, -90.0)).is_none(),
        ),
        decide(
            "three points on one line",
            "decimal fractions: off the line by their rounding alone",
            "no plane",
            is_on_a_line(&on_a_line),
            refused(&on_a_line, true, Adjust::Front, Limit::NoPlane),
        ),
        decide(
            "a plane through the lens centre",
            "off it by rounding alone",
            "through the lens",
            is_through_lens(&through),
            refused(&through, false, Adjust::Front, Limit::ThroughLens),
        ),
        decide(
            "the film touches the aperture",
            "64 ulps short of it",
            "clear",
            !reaches(&wide_open(64.0)),
            ours::optics(&wide_open(64.0)).is_some_and(|o| !o.film_reaches_aperture()),
        ),
        decide(
            "the film cuts the aperture",
            "64 ulps beyond it",
            "reaches",
            reaches(&wide_open(-64.0)),
            ours::optics(&wide_open(-64.0)).is_some_and(|o| o.film_reaches_aperture()),
        ),
        decide(
            "up along the view",
            "no frame",
            "refused",
            is_zero(&V3::of(upright.three(AtX)).cross(&V3::of(upright.three(UpX))).length()),
            ours::camera(&upright).is_none(),
        ),
    ]
}

/// Off the line, or the lens centre, by no more than decimal fractions are rounded.
const DOUBT: f64 = 1e-15;

fn is_on_a_line(input: &Input) -> bool {
    let [p, q, r] = [Px, Qx, Rx].map(|key| V3::of(input.three(key)));
    let (a, b) = (q.minus(&p), r.minus(&p));
    a.cross(&b).length() <= a.length() * b.length() * big(DOUBT)
}

fn is_through_lens(input: &Input) -> bool {
    let (p, n) = (V3::of(input.three(Px)), V3::of(input.three(Qx)));
    let off = near(&p.dot(&n)).abs();
    off <= DOUBT * near(&(p.length() * n.length()))
}

fn oracle_is_sideways(tilt: f64) -> bool {
    !positive(&oracle::Camera::new(&Input::base().with(RearTilt, tilt)).n.0[2]) || big(tilt) < big(-90.0)
}
