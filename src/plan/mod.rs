//! Which effects a scene calls for, because of which number against which threshold.
//!
//! The scene's keys say what is wanted. The plan drops what cannot be seen in this picture, and adds nothing that a key
//! switches off. What it drops changes the picture by no more than [`RenderPlan::tolerance`].

mod diffraction;
mod seen;

use crate::scene::{Budget, EffectName, EffectSet, Scene, bounds};
use glam::DVec3;
use seen::Seen;
use serde::Serialize;
use std::cell::OnceCell;

/// Blur below this many pixels is not worth a lens: half of it is under the pixel's own box filter. (A disk of diameter d
/// adds d^2 / 16 to the variance along an axis, and a pixel's square has 1/12: at a quarter of a pixel that is 5 % more.)
const BLUR_PX: f64 = 0.25;

/// Of a blur below this many pixels the shape is not seen.
const SHAPE_PX: f64 = 1.0;

/// A penumbra below this many pixels is an edge.
const PENUMBRA_PX: f64 = 0.25;

/// Weights of falloff within this of 1 are not seen.
const FALLOFF: f64 = 0.002;

/// Root mean square change of the picture that is taken for nothing, where the scene names no error.
const TOLERANCE: f64 = 0.002;

/// One effect: whether it is in the picture, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// Its name, such as `defocus`.
    pub effect: &'static str,
    /// Whether it is computed.
    pub active: bool,
    /// The number that decided, against its threshold.
    pub because: String,
}

/// What a picture is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderPlan {
    effects: Vec<Effect>,
    active: EffectSet,
    tolerance: f64,
}

impl RenderPlan {
    /// The plan of a scene, with its numbers. It looks at all triangles.
    pub fn new(scene: &Scene) -> Self {
        let seen = Seen::new(scene);
        let tolerance = tolerance(scene);
        let scale = (tolerance / TOLERANCE).sqrt();
        let choice = scene.render.effects;
        let mut effects = Vec::with_capacity(EffectName::ALL.len());
        let mut active = EffectSet::default();
        for name in EffectName::ALL {
            let (asked, is_seen, because) = reason(scene, &seen, name, scale);
            let (is_in, because) = if choice.without.has(name) {
                (false, format!("--without {name}"))
            } else if !asked {
                (false, because)
            } else if is_seen {
                (true, because)
            } else if choice.all {
                (true, format!("{because}; --all-effects keeps it"))
            } else if choice.with.has(name) {
                (true, format!("{because}; --with {name} keeps it"))
            } else {
                (false, because)
            };
            active = active.set(name, is_in);
            effects.push(Effect { effect: name.name(), active: is_in, because });
        }
        Self { effects, active, tolerance }
    }

    /// What [`RenderPlan::new`] finds active, without its words and as fast as may be.
    pub(crate) fn active_in(scene: &Scene) -> EffectSet {
        let choice = scene.render.effects;
        let scale = (tolerance(scene) / TOLERANCE).sqrt();
        let seen = OnceCell::new();
        let has_diffraction =
            || diffraction::is_in(scene, scale * scale, || seen.get_or_init(|| Seen::new(scene)));
        // Only these are worth leaving out; what is not in view costs nothing anyway.
        let dropped = |name: EffectName| {
            let small = || match name {
                EffectName::Defocus => {
                    !Seen::has_blur_of(scene, scale * BLUR_PX) && !has_falloff_over_lens(scene, scale)
                }
                EffectName::ApertureShape => {
                    !Seen::has_blur_of(scene, scale * SHAPE_PX)
                        && !has_falloff_over_lens(scene, scale)
                        && !has_diffraction()
                }
                EffectName::SoftShadows => penumbra(scene) < scale * PENUMBRA_PX,
                EffectName::Falloff => largest_falloff(scene) < scale * scale * FALLOFF,
                EffectName::Diffraction => !has_diffraction(),
                _ => false,
            };
            asks(scene, name) && !choice.all && !choice.with.has(name) && small()
        };
        EffectName::ALL
            .into_iter()
            .filter(|&name| asks(scene, name) && !choice.without.has(name) && !dropped(name))
            .collect()
    }

    /// The effects in a fixed order.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// Those that are computed.
    pub fn active(&self) -> EffectSet {
        self.active
    }

    /// How much the picture may change by what was dropped: root mean square over the picture, linear light.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

/// A half of the error that is asked for at most: what is dropped must not rule it.
fn tolerance(scene: &Scene) -> f64 {
    match scene.render.budget {
        Budget::MaxError(error) => TOLERANCE.min(0.5 * error),
        _ => TOLERANCE,
    }
}

/// Whether the scene's keys ask for an effect; what files bring, such as textures, is always asked for.
fn asks(scene: &Scene, name: EffectName) -> bool {
    let has_lens = scene.optics.aperture_radius() > 0.0;
    let sun = scene.sun.as_ref().filter(|sun| sun.shadows);
    match name {
        EffectName::Defocus => has_lens,
        EffectName::Antialiasing | EffectName::Textures | EffectName::Holes | EffectName::Coverage => true,
        EffectName::Shadows => sun.is_some(),
        EffectName::SoftShadows => sun.is_some_and(|sun| sun.angular_diameter.as_radians() > 0.0),
        EffectName::ApertureShape => scene.blades.is_some() && has_lens,
        EffectName::Falloff => scene.render.falloff,
        EffectName::Diffraction => scene.render.diffraction && has_lens,
    }
}

/// Whether it is asked for, whether it is seen, and the number that says so.
fn reason(scene: &Scene, seen: &Seen, name: EffectName, scale: f64) -> (bool, bool, String) {
    let asked = asks(scene, name);
    let count = |list: &dyn Fn(usize) -> bool| (0..seen.materials.len()).filter(|&i| list(i)).count();
    let material = |i: usize| &scene.surfaces.materials[i];
    let in_view = count(&|i| seen.materials[i]);
    let materials = |found: usize, what: &str| {
        (asked, found > 0, format!("{found} of {in_view} materials in view have {what}, threshold 1"))
    };
    // What the sun's light goes through may lie out of view.
    let casts = seen.triangles > 0
        && asks(scene, EffectName::Shadows)
        && !scene.render.effects.without.has(EffectName::Shadows);
    let casting = |has: &dyn Fn(usize) -> bool, (in_view, anywhere): (&[bool], &[bool]), what: &str| {
        let found = count(&|i| in_view[i] && has(i));
        let out_of_view = count(&|i| anywhere[i] && has(i));
        if found > 0 || !casts || out_of_view == 0 {
            return materials(found, what);
        }
        let of = count(&|i| seen.anywhere[0][i]);
        (
            asked,
            true,
            format!("{out_of_view} of {of} materials that may cast shadows have {what}, threshold 1"),
        )
    };
    let largest = seen.blur.map_or(0.0, |blur| blur[0]);
    // Of a light so many times as bright as white so small a part makes a pixel white.
    let light = diffraction::brightest_seen(scene, seen);
    let by_light = |because: String| match light > 1.0 {
        true => format!("{because} for light up to {light:.1}"),
        false => because,
    };
    match name {
        EffectName::Defocus if !asked => (false, false, "a pinhole".into()),
        EffectName::Defocus => {
            let threshold = scale * BLUR_PX / light;
            let because =
                by_light(format!("largest blur {}, threshold {} px", pixels(largest), digits(threshold)));
            let has_falloff = has_falloff_over_lens(scene, scale);
            let because = if has_falloff { because + ", and falloff shows the lens" } else { because };
            (true, largest >= threshold || has_falloff, because)
        }
        EffectName::Antialiasing => (true, true, "each pixel is the mean over its square".into()),
        EffectName::Textures => {
            materials(count(&|i| seen.textured[i] && material(i).diffuse_map.is_some()), "a map_Kd")
        }
        EffectName::Holes => {
            let is_holed = |i: usize| material(i).holed_maps().next().is_some();
            casting(&is_holed, (&seen.textured, &seen.anywhere[1]), "a texture with alpha below 0.5")
        }
        EffectName::Coverage => {
            casting(&|i| material(i).coverage < 1.0, (&seen.materials, &seen.anywhere[0]), "d below 1")
        }
        EffectName::Shadows | EffectName::SoftShadows if scene.sun.is_none() => {
            (false, false, "no [sun] table".into())
        }
        EffectName::Shadows | EffectName::SoftShadows
            if scene.sun.as_ref().is_some_and(|sun| !sun.shadows) =>
        {
            (false, false, "sun.shadows = false".into())
        }
        EffectName::Shadows => {
            (true, seen.triangles > 0, format!("{} triangles in view, threshold 1", seen.triangles))
        }
        EffectName::SoftShadows if scene.render.effects.without.has(EffectName::Shadows) => {
            (asked, false, "no shadows are drawn".into())
        }
        EffectName::SoftShadows if !asked => (false, false, "sun.angular_diameter_deg = 0".into()),
        EffectName::SoftShadows => {
            let (width, threshold) = (penumbra(scene), scale * PENUMBRA_PX);
            let because = format!("penumbra up to {}, threshold {threshold:.2} px", pixels(width));
            (true, width >= threshold, because)
        }
        EffectName::ApertureShape => match scene.blades {
            None => (false, false, "no [camera.aperture] table: a disk".into()),
            Some(_) if !asked => (false, false, "a pinhole has no shape".into()),
            Some(_) if scene.render.effects.without.has(EffectName::Defocus) => {
                (asked, false, "without defocus the lens is a point".into())
            }
            Some(blades) => {
                let threshold = scale * SHAPE_PX / light;
                let because = by_light(format!(
                    "{} blades, largest blur {}, threshold {} px",
                    blades.count,
                    pixels(largest),
                    digits(threshold)
                ));
                let has_star = diffraction::is_in(scene, scale * scale, || seen);
                let has_falloff = has_falloff_over_lens(scene, scale);
                let because = match (has_star, has_falloff) {
                    (true, true) => because + ", and diffraction and falloff show it",
                    (true, false) => because + ", and diffraction shows it",
                    (false, true) => because + ", and falloff shows it",
                    (false, false) => because,
                };
                (true, largest >= threshold || has_star || has_falloff, because)
            }
        },
        EffectName::Falloff if !asked => (false, false, "render.falloff = false".into()),
        EffectName::Falloff => {
            let (most, threshold) = (largest_falloff(scene), scale * scale * FALLOFF);
            (true, most >= threshold, format!("light changes by up to {most:.4}, threshold {threshold:.4}"))
        }
        EffectName::Diffraction if !scene.render.diffraction => {
            (false, false, "render.diffraction = false".into())
        }
        EffectName::Diffraction => {
            let (is_seen, because) = diffraction::reason(scene, seen, scale * scale);
            (asked, is_seen, because)
        }
    }
}

fn pixels(number: f64) -> String {
    if number.is_finite() { format!("{} px", digits(number)) } else { "beyond measure".into() }
}

/// Two digits after the point, or as many as a small number needs to show two.
fn digits(number: f64) -> String {
    let places = match number {
        number if (1e-9..0.1).contains(&number) => (1.0 - libm::floor(libm::log10(number))) as usize,
        _ => 2,
    };
    format!("{number:.places$}")
}

/// The widest penumbra: the sun's disk over the longest way light can go between two surfaces, as large as the nearest
/// of them is drawn. Pixels.
fn penumbra(scene: &Scene) -> f64 {
    let Some(sun) = &scene.sun else { return 0.0 };
    let [low, high] = bounds(&scene.surfaces.positions);
    let extent = if low.cmple(high).all() { (high - low).length() } else { 0.0 };
    let eye = scene.optics.world_from_lens().point(DVec3::ZERO);
    let nearest = (eye.clamp(low.min(high), high.max(low)) - eye).length();
    let nearest = nearest.max(scene.optics.camera().near.as_metres());
    let film = &scene.optics.camera().film;
    let pixel = film.width.as_metres() / f64::from(scene.render.width);
    let drawn = scene.optics.film_plane().e.abs() / nearest / pixel;
    2.0 * libm::tan((0.5 * sun.angular_diameter.as_radians()).min(1.5)) * extent * drawn
}

/// The film's corners and centre.
const FILM: [(f64, f64); 5] = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.0, 0.0)];

/// The weight of light from a lens point, in aperture radii, to a point of [`FILM`]: not normalized.
fn weight_of_light(scene: &Scene, (x, y): (f64, f64), (u, v): (f64, f64)) -> f64 {
    let optics = &scene.optics;
    let film = optics.camera().film;
    let lens = optics.lens_point(u, v) * optics.aperture_radius();
    let r = optics.film_point(x * film.width.as_metres(), y * film.height.as_metres()) - lens;
    optics.axis().dot(r).abs() * optics.film_normal().dot(r).abs() / (r.length_squared() * r.length_squared())
}

/// How far the weight of light is from 1, at most, at the film's corners through the middle and the rim of the lens.
fn largest_falloff(scene: &Scene) -> f64 {
    let center = weight_of_light(scene, (0.0, 0.0), (0.0, 0.0));
    let lens = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
    let far = |film: (f64, f64)| {
        let each = lens.map(|lens| (weight_of_light(scene, film, lens) / center - 1.0).abs());
        each.into_iter().fold(0.0, f64::max)
    };
    FILM.map(far).into_iter().fold(0.0, f64::max)
}

/// Whether falloff is wanted, and light through the whole lens, on the mean over its area, is so much less than through its
/// centre alone that it shows.
fn has_falloff_over_lens(scene: &Scene, scale: f64) -> bool {
    if !asks(scene, EffectName::Falloff) || scene.render.effects.without.has(EffectName::Falloff) {
        return false;
    }
    let center = weight_of_light(scene, (0.0, 0.0), (0.0, 0.0));
    // A ring that halves the area has the disk's mean of all up to cubes.
    let ring = std::f64::consts::FRAC_1_SQRT_2;
    let lens = [(ring, 0.0), (-ring, 0.0), (0.0, ring), (0.0, -ring)];
    let less = |film: (f64, f64)| {
        let mean = lens.map(|lens| weight_of_light(scene, film, lens)).iter().sum::<f64>() / 4.0;
        ((mean - weight_of_light(scene, film, (0.0, 0.0))) / center).abs()
    };
    FILM.map(less).into_iter().fold(0.0, f64::max) >= scale * scale * FALLOFF
}
