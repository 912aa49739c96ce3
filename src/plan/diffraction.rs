//! Whether diffraction can be seen: its first dark ring against the pixel, the smallest blur in view and the brightest light.

use super::asks;
use super::light::{FILM, brightest};
use super::reason::{beside, digits, pixels};
use super::small::View;
use crate::sampling::Diffraction;
use crate::scene::{EffectName, Scene};

/// The first dark ring below this many pixels across is under the pixel's own filter: of a ring `D` pixels across, about
/// `0.08 D` of the light goes farther than a pixel (`2 / (pi k)` beyond the frequency `k`). (At 0.1 of a pixel bars of black and white 3 pixels
/// wide change by 0.0024, as much less as the ring is smaller.)
const AIRY_PX: f64 = 0.08;

/// Diffraction this much smaller than the smallest blur in view is under the blur.
const AIRY_OF_BLUR: f64 = 0.02;

/// The frequency of Airy's first dark ring, the first zero of J1, at an aperture of radius 1.
const FIRST_DARK: f64 = 3.831_705_970_207_512;

/// Whether it is seen, and the number that says so.
pub(super) fn reason(view: &View<'_>) -> (bool, String) {
    let (scene, seen) = (view.scene, view.seen());
    if scene.optics.aperture_radius() == 0.0 {
        return (false, "a pinhole: 0 mm across has no rings".into());
    }
    if seen.triangles == 0 {
        return (false, "0 triangles in view, threshold 1".into());
    }
    let ring = first_ring(scene);
    // A blur that is not drawn hides nothing.
    let blur = seen.blur.filter(|_| view.has_lens()).map_or(0.0, |blur| blur[1]);
    // What a light sends far is seen if it is only bright enough.
    let light = view.light();
    let (threshold, under) = (threshold(view, light), view.scale * view.scale * AIRY_OF_BLUR / light);
    let because = format!(
        "first dark ring {} px across, threshold {} px and {} of the smallest blur in view, {}, for light up to {}",
        beside(ring, threshold),
        digits(threshold),
        digits(under),
        pixels(blur),
        digits(light)
    );
    (ring >= threshold && ring >= under * blur, because)
}

/// Whether it is large enough to be seen. What is seen is asked for only where the ring is large enough for the brightest light
/// of the scene, in view or not.
pub(super) fn is_seen(view: &View<'_>) -> bool {
    first_ring(view.scene) >= threshold(view, brightest(view.scene, |_| true)) && reason(view).0
}

/// Whether it is in the picture, whatever says so.
pub(super) fn is_in(view: &View<'_>) -> bool {
    let (choice, name) = (view.scene.render.effects, EffectName::Diffraction);
    asks(view.scene, name)
        && !choice.without.has(name)
        && (choice.all || choice.with.has(name) || is_seen(view))
}

/// How far the first dark ring of a disk is across, pixels: at the corners or the middle of the film, whichever is largest.
fn first_ring(scene: &Scene) -> f64 {
    let film = scene.optics.camera().film;
    let [x, y] = widest(scene);
    let [width, height] = [scene.render.width, scene.render.height].map(f64::from);
    2.0 * FIRST_DARK * (x * width / film.width.as_metres()).max(y * height / film.height.as_metres())
}

/// How far light is sent beyond the sides of the film at most, metres: 0 where there is no diffraction to be.
pub(super) fn reach(scene: &Scene) -> [f64; 2] {
    let name = EffectName::Diffraction;
    if !asks(scene, name) || scene.render.effects.without.has(name) {
        return [0.0; 2];
    }
    let pattern = Diffraction::reach_of(&scene.aperture_shape());
    widest(scene).map(|unit| unit * pattern)
}

/// How far a frequency of one goes on the film, across and up, metres: at its corners or its middle, whichever is farthest.
fn widest(scene: &Scene) -> [f64; 2] {
    let film = scene.optics.camera().film;
    let (width, height) = (film.width.as_metres(), film.height.as_metres());
    let of = |(x, y): (f64, f64)| {
        let film_from_k = scene.optics.diffraction_at(x * width, y * height);
        [film_from_k.row(0).length(), film_from_k.row(1).length()]
    };
    FILM.map(of).into_iter().fold([0.0; 2], |most, of| [most[0].max(of[0]), most[1].max(of[1])])
}

/// The smallest ring that is seen with light of this brightness, pixels.
fn threshold(view: &View<'_>, light: f64) -> f64 {
    if view.has_filter() { view.scale * view.scale * AIRY_PX / light } else { 0.0 }
}
