//! How much light changes by an effect: of falloff, of the sky through the whole lens, of the sun's disk. In: a scene. Out: parts of
//! white, as the picture shows them, at most; no more of the scene is looked at than materials.

use crate::geometry::HomogeneousPoint;
use crate::scene::{Material, Scene};
use glam::DVec3;

/// The brightest light that materials of these numbers give, their own and that of sun and sky, or the sky does itself, as shown;
/// at least white.
pub(super) fn brightest(scene: &Scene, counts: impl Fn(usize) -> bool) -> f64 {
    let materials = scene.surfaces.materials.iter().enumerate().filter(|(number, _)| counts(*number));
    let lights = materials.map(|(_, material)| f64::from(scene.most_light(material).max_element()));
    let sky = scene.sky.horizon.max(scene.sky.zenith).max_element();
    shown(scene, lights.fold(sky, f64::max)).max(1.0)
}

/// So much light as the picture shows it.
fn shown(scene: &Scene, light: f64) -> f64 {
    light * libm::exp2(scene.render.exposure_ev)
}

/// The most sunlight that a material gives back, as shown.
pub(super) fn of_sun(scene: &Scene) -> f64 {
    let sun = scene.sun.as_ref().map_or(DVec3::ZERO, |sun| sun.color);
    let given = |material: &Material| material.diffuse.map(f64::from).into_iter().fold(0.0, f64::max);
    let most = scene.surfaces.materials.iter().map(given).fold(0.0, f64::max);
    shown(scene, most * sun.max_element())
}

/// The film's corners, centre, and the middles of its sides: on film that leans steeply most light falls there.
pub(super) const FILM: [(f64, f64); 9] = [
    (-0.5, -0.5),
    (0.5, -0.5),
    (-0.5, 0.5),
    (0.5, 0.5),
    (0.0, 0.0),
    (-0.5, 0.0),
    (0.5, 0.0),
    (0.0, -0.5),
    (0.0, 0.5),
];

/// The weight of light from a lens point, in aperture radii, to a point of [`FILM`]: not normalized.
fn weight_of_light(scene: &Scene, (x, y): (f64, f64), (u, v): (f64, f64)) -> f64 {
    let optics = &scene.optics;
    let film = optics.camera().film;
    let lens = optics.lens_point(u, v) * optics.aperture_radius();
    let r = optics.film_point(x * film.width.as_metres(), y * film.height.as_metres()) - lens;
    optics.axis().dot(r).abs() * optics.film_normal().dot(r).abs() / (r.length_squared() * r.length_squared())
}

/// How far the weight of light is from 1, at most, at the film's corners through the middle and the rim of the lens.
pub(super) fn largest_falloff(scene: &Scene) -> f64 {
    let center = weight_of_light(scene, (0.0, 0.0), (0.0, 0.0));
    let lens = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
    let far = |film: (f64, f64)| {
        let each = lens.map(|lens| (weight_of_light(scene, film, lens) / center - 1.0).abs());
        each.into_iter().fold(0.0, f64::max)
    };
    FILM.map(far).into_iter().fold(0.0, f64::max)
}

/// How far light through the whole lens, on the mean over its area, is from that through its centre, at most.
pub(super) fn falloff_over_lens(scene: &Scene) -> f64 {
    let center = weight_of_light(scene, (0.0, 0.0), (0.0, 0.0));
    let less = |film: (f64, f64)| {
        let mean = RING.map(|lens| weight_of_light(scene, film, lens)).iter().sum::<f64>() / 4.0;
        ((mean - weight_of_light(scene, film, (0.0, 0.0))) / center).abs()
    };
    FILM.map(less).into_iter().fold(0.0, f64::max)
}

/// A ring that halves the lens's area has the disk's mean of all up to cubes, and the variance of what is linear.
pub(crate) const RING: [(f64, f64); 4] = {
    let ring = std::f64::consts::FRAC_1_SQRT_2;
    [(ring, 0.0), (-ring, 0.0), (0.0, ring), (0.0, -ring)]
};

/// How far the sky through the whole lens, on the mean over its area, is from the sky through its centre, at most, if it is in view.
pub(super) fn sky_over_lens(scene: &Scene) -> f64 {
    let (optics, sky) = (&scene.optics, &scene.sky);
    let climb = (sky.zenith - sky.horizon).abs().max_element();
    if climb == 0.0 || optics.aperture_radius() == 0.0 {
        return 0.0;
    }
    let up = scene.up.normalize();
    let rise = |film: DVec3, (u, v): (f64, f64)| {
        let object = optics.object_of(HomogeneousPoint::finite(film));
        let away = object.xyz - optics.lens_point(u, v) * optics.aperture_radius() * object.w;
        let away = if optics.axis().dot(away) < 0.0 { -away } else { away };
        up.dot(optics.world_from_lens().vector(away).normalize())
    };
    let size = scene.optics.camera().film;
    let places =
        FILM.map(|(x, y)| optics.film_point(x * size.width.as_metres(), y * size.height.as_metres()));
    let (mut change, mut moved, mut low, mut high) = (0.0f64, 0.0f64, f64::INFINITY, f64::NEG_INFINITY);
    for film in places {
        let middle = rise(film, (0.0, 0.0));
        let mean = RING.map(|lens| rise(film, lens).max(0.0)).iter().sum::<f64>() / 4.0;
        change = change.max((mean - middle.max(0.0)).abs());
        for rim in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].map(|lens| rise(film, lens)) {
            moved = moved.max((rim - middle).abs());
            (low, high) = (low.min(rim), high.max(rim));
        }
    }
    // At the horizon the lower half of the lens sees no more than it: of a disk of radius r the mean of max(0, y) is 2 r / (3 pi).
    if low < 0.0 && high > 0.0 {
        change = change.max(moved * 2.0 / (3.0 * std::f64::consts::PI));
    }
    let change = shown(scene, climb) * change;
    if change.is_finite() { change } else { f64::INFINITY }
}

/// How far sunlight from the whole disk is from that of its middle, at most, where nothing stands before it. With `h` half of the
/// disk's diameter, over directions uniform in its solid angle: of a surface square to it the mean of the cosine is
/// `(1 + cos h) / 2`, not 1; of one along it `(h - sin h cos h) / (2 pi (1 - cos h))`, not 0.
pub(super) fn softening(scene: &Scene) -> f64 {
    let half = scene.sun.as_ref().map_or(0.0, |sun| 0.5 * sun.angular_diameter.as_radians());
    if half <= 0.0 {
        return 0.0;
    }
    let (sine, cosine) = libm::sincos(0.5 * half);
    let (square, product) = (sine * sine, 2.0 * sine * cosine * (cosine - sine) * (cosine + sine));
    // For a small disk 2 h / (3 pi), of which the difference leaves nothing.
    let along = if half < 1e-3 {
        2.0 * half / (3.0 * std::f64::consts::PI)
    } else {
        (half - product) / (4.0 * std::f64::consts::PI * square)
    };
    of_sun(scene) * along.max(square)
}
