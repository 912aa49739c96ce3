//! The library's formulas once more, for any kind of number: in single precision they are what is compared, in twice the
//! digits they are the references. A tilt of the front standard alone; origin at the lens centre, metres.

use super::number::{Number, V};

/// The lens's focal length in all maps.
pub(crate) const FOCAL: f64 = 0.15;

/// The lens axis of a lens tilted by so many degrees.
fn axis<T: Number>(tilt: f64) -> V<T> {
    let (s, c) = T::sin_cos(tilt);
    V([T::of(0.0), -s, -c])
}

/// The focus plane `(n - (e/f) a, e/f)`, lengths in focal lengths.
pub(crate) fn focus_plane<T: Number>(tilt: f64, extension: f64) -> [T; 4] {
    let ratio = -T::of(extension) / T::of(FOCAL);
    let m = V::of([0.0, 0.0, 1.0]).minus(axis::<T>(tilt).times(ratio));
    [m.0[0], m.0[1], m.0[2], ratio]
}

/// The hinge line's distance `f / |n x a|`.
pub(crate) fn hinge_distance<T: Number>(tilt: f64) -> [T; 1] {
    let across = V::<T>::of([0.0, 0.0, 1.0]).cross(axis(tilt));
    [T::of(FOCAL) / across.dot(across).root()]
}

/// The largest diameter of the blur of a point in the plane x = 0: see the optics' `blur_of`.
pub(crate) fn blur<T: Number>(tilt: f64, extension: f64, number: f64, point: [f64; 3]) -> Option<[T; 1]> {
    let (a, n, x) = (axis::<T>(tilt), V::<T>::of([0.0, 0.0, 1.0]), V::<T>::of(point));
    let (f, e, one) = (T::of(FOCAL), -T::of(extension), T::of(1.0));
    let radius = T::of(FOCAL) / T::of(number) * T::of(0.5);
    let (along, depth) = (n.dot(x), a.dot(x));
    let sigma = (n.minus(a.times(e / f)).dot(x) + e) / -along;
    let edge = |s: V<T>| {
        let ns = n.dot(s);
        let p = x.times(ns / along).minus(s);
        (p.0[0], p.0[1], ns * (one - depth / f) / -along)
    };
    // The lens's axes: ex square to the section, ey in it.
    let u = edge(V([radius, T::of(0.0), T::of(0.0)]));
    let v = edge(V([T::of(0.0), -a.0[2] * radius, a.0[1] * radius]));
    // The section is the ellipse's own axis of symmetry: u is across it, v along it.
    let k = one - v.2 * v.2;
    let (center, half) = (-(v.1 * v.2) / k, T::of(0.5));
    let (across, upward) = (u.0 * u.0 / k, center * center + v.1 * v.1 / k);
    let gap = (across - upward) * half;
    let large = (across + upward) * half + (gap * gap).root();
    let size = T::of(2.0) * sigma * large.root();
    (k.wide().near() > 0.0).then(|| [if sigma.wide().near() < 0.0 { -size } else { size }])
}

/// For the plane with this normal that crosses the rail's axis at `distance`: the sine of the lens's tilt and
/// the extension, with the film upright.
pub(crate) fn lens_for<T: Number>(normal: [f64; 3], distance: f64) -> Option<[T; 2]> {
    let m = V::<T>::of(normal);
    let m = m.times(T::of(1.0) / m.dot(m).root());
    let g = m.0[2] * T::of(distance);
    solved(m, g, V::of([0.0, 0.0, 1.0])).map(|(a, e)| [-a.0[1], -e])
}

/// For a film tilted by `tilt` degrees and a level plane above the lens at f (1 + `over`): the film's distance.
pub(crate) fn film_for_level<T: Number>(tilt: f64, height: f64) -> Option<[T; 1]> {
    let (s, c) = T::sin_cos(tilt);
    let found = solved(V::of([0.0, 1.0, 0.0]), -T::of(height), V([T::of(0.0), s, c]))?;
    Some([-found.1])
}

/// The inverse for a wanted plane (m, g) with a unit normal and a film normal n.
fn solved<T: Number>(m: V<T>, g: T, n: V<T>) -> Option<(V<T>, T)> {
    let f = T::of(FOCAL);
    let across = m.minus(n.times(n.dot(m)));
    let size = if g.wide().near() < 0.0 { -g } else { g };
    let sine = across.dot(across).root() * f / size;
    let one = T::of(1.0);
    let along = f * n.dot(m);
    let far = if sine.wide().near() > 0.5 && size.wide().near() >= FOCAL {
        Some(((size - f) * (size + f) + along * along) / (size * size))
    } else {
        None
    };
    let inside = far.unwrap_or((one - sine) * (one + sine));
    if inside.wide().near() < 0.0 {
        return None;
    }
    let cosine = inside.root();
    let a = n.times(-cosine).minus(across.times(f / g));
    let e = g / (n.dot(m) - g / f * cosine);
    (e.wide().near() < 0.0).then_some((a, e))
}

/// The normal of three points' plane.
pub(crate) fn normal<T: Number>(points: [[f64; 3]; 3]) -> [T; 3] {
    let [p, q, r] = points.map(V::<T>::of);
    let n = q.minus(p).cross(r.minus(p));
    let turned = if n.0[2].wide().near() < 0.0 { n.times(T::of(-1.0)) } else { n };
    turned.0
}
