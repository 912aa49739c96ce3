//! Which of the effects that a scene asks for are too small to be seen: numbers against thresholds. In: a scene. Out: yes or no,
//! without looking at more of the scene than it takes.

use super::seen::{MARGIN, Seen};
use super::{TOLERANCE, asks, diffraction, tolerance};
use crate::scene::{EffectName, Material, Scene, bounds};
use glam::DVec3;
use std::cell::OnceCell;

/// Blur below this many pixels is not worth a lens: half of it is under the pixel's own box filter. (A disk of diameter d
/// adds d^2 / 16 to the variance along an axis, and a pixel's square has 1/12: at a quarter of a pixel that is 5 % more.)
pub(super) const BLUR_PX: f64 = 0.25;

/// Of a blur below this many pixels the shape is not seen.
const SHAPE_PX: f64 = 1.0;

/// A penumbra below this many pixels is an edge.
const PENUMBRA_PX: f64 = 0.25;

/// Weights of falloff within this of 1 are not seen.
const FALLOFF: f64 = 0.002;

/// A scene, and what is known of its view so far.
pub(super) struct View<'a> {
    pub(super) scene: &'a Scene,
    /// Lengths in pixels that are taken for nothing, over the usual ones; changes of light go by its square.
    pub(super) scale: f64,
    seen: OnceCell<Seen>,
}

impl<'a> View<'a> {
    pub(super) fn of(scene: &'a Scene) -> Self {
        Self { scene, scale: (tolerance(scene) / TOLERANCE).sqrt(), seen: OnceCell::new() }
    }

    /// What the picture shows: this looks at all triangles, once.
    pub(super) fn seen(&self) -> &Seen {
        self.seen.get_or_init(|| Seen::new(self.scene))
    }

    /// How bright the brightest light in view is; at least white, 1. Of a light so many times as bright so small a part makes
    /// a pixel white.
    pub(super) fn light(&self) -> f64 {
        if brightest(self.scene, |_| true) > 1.0 {
            let is_seen =
                |material: usize| self.seen().materials.get(material).is_some_and(|&is_seen| is_seen);
            brightest(self.scene, is_seen)
        } else {
            1.0
        }
    }

    /// The largest blur in view, pixels.
    pub(super) fn blur(&self) -> f64 {
        self.seen().blur.map_or(0.0, |blur| blur[0])
    }

    /// Whether a blur reaches its threshold, which light makes smaller than the usual one. (What is in view is asked for only where
    /// the brightest light of the scene, in view or not, would make the difference.)
    fn has_blur_of(&self, usual: f64) -> bool {
        let has = |light: f64| match (self.seen.get(), self.scale * usual / light) {
            (Some(_), threshold) => self.blur() >= threshold,
            (None, threshold) => Seen::has_blur_of(self.scene, threshold),
        };
        let most = brightest(self.scene, |_| true);
        has(1.0) || (most > 1.0 && has(most) && has(self.light()))
    }

    /// How wide the sun's disk is at a distance of one; 0 without a sun.
    fn sun(&self) -> f64 {
        let half = self.scene.sun.as_ref().map_or(0.0, |sun| 0.5 * sun.angular_diameter.as_radians());
        2.0 * libm::tan(half.min(1.5))
    }

    /// The widest penumbra: the sun's disk over the longest way light can go between two surfaces, as large as it is drawn, in
    /// pixels. Measured square to the light: where that grazes a surface its penumbra is longer, and as much darker.
    pub(super) fn penumbra(&self) -> f64 {
        self.sun() * self.seen().shadow
    }

    /// Whether the widest penumbra reaches its threshold.
    fn has_penumbra(&self) -> bool {
        match self.seen.get() {
            Some(_) => self.penumbra() >= self.penumbra_threshold(),
            None => Seen::has_shadow_of(self.scene, self.penumbra_threshold() / self.sun()),
        }
    }

    /// No less than [`Self::penumbra`], without a look at each triangle: light that goes through all of the scene, to its point
    /// nearest to the camera, drawn as large as at the film's corner.
    fn farthest_penumbra(&self) -> f64 {
        let (scene, optics) = (self.scene, &self.scene.optics);
        let [low, high] = bounds(scene.surfaces.positions.iter().copied());
        let extent = if low.cmple(high).all() { (high - low).length() } else { 0.0 };
        let eye = optics.world_from_lens().point(DVec3::ZERO);
        let nearest = (eye.clamp(low.min(high), high.max(low)) - eye).length();
        let nearest = nearest.max(optics.camera().near.as_metres());
        let film = optics.camera().film;
        let (width, height) = (film.width.as_metres(), film.height.as_metres());
        // As much more of the plane as is looked at.
        let corners = FILM.map(|(x, y)| optics.film_point(MARGIN * x * width, MARGIN * y * height).length());
        let farthest = corners.into_iter().fold(0.0, f64::max);
        let pixel = width / f64::from(scene.render.width);
        let magnification = farthest * farthest / optics.film_plane().e.abs() / nearest / pixel;
        self.sun() * extent * magnification
    }

    pub(super) fn blur_threshold(&self) -> f64 {
        self.scale * BLUR_PX / self.light()
    }

    pub(super) fn shape_threshold(&self) -> f64 {
        self.scale * SHAPE_PX / self.light()
    }

    pub(super) fn penumbra_threshold(&self) -> f64 {
        let sun = self.scene.sun.as_ref().map_or(DVec3::ZERO, |sun| sun.color);
        let given = |material: &Material| material.diffuse.map(f64::from).into_iter().fold(0.0, f64::max);
        let most = self.scene.surfaces.materials.iter().map(given).fold(0.0, f64::max) * sun.max_element();
        self.scale * PENUMBRA_PX / shown(self.scene, most)
    }

    pub(super) fn falloff_threshold(&self) -> f64 {
        self.scale * self.scale * FALLOFF
    }

    pub(super) fn has_diffraction(&self) -> bool {
        diffraction::is_in(self)
    }

    /// Whether the lens is more than a point.
    pub(super) fn has_lens(&self) -> bool {
        !self.scene.render.effects.without.has(EffectName::Defocus)
    }

    /// Whether an effect that is asked for is too small to be seen. What files bring, such as textures, never is.
    pub(super) fn is_small(&self, name: EffectName) -> bool {
        let scene = self.scene;
        match name {
            EffectName::Defocus => !self.has_falloff_over_lens() && !self.has_blur_of(BLUR_PX),
            EffectName::ApertureShape => {
                let shows = || self.has_falloff_over_lens() || self.has_blur_of(SHAPE_PX);
                !(self.has_diffraction() || self.has_lens() && shows())
            }
            EffectName::SoftShadows => {
                scene.render.effects.without.has(EffectName::Shadows)
                    || self.farthest_penumbra() < self.penumbra_threshold()
                    || !self.has_penumbra()
            }
            EffectName::Falloff => largest_falloff(scene) < self.falloff_threshold(),
            EffectName::Diffraction => !diffraction::is_seen(self),
            EffectName::Antialiasing
            | EffectName::Textures
            | EffectName::Holes
            | EffectName::Coverage
            | EffectName::Shadows => false,
        }
    }

    /// Whether falloff is wanted, and light through the whole lens, on the mean over its area, is so much less than through its
    /// centre alone that it shows.
    pub(super) fn has_falloff_over_lens(&self) -> bool {
        let scene = self.scene;
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
        FILM.map(less).into_iter().fold(0.0, f64::max) >= self.falloff_threshold()
    }
}

/// The brightest light that materials of these numbers give, their own and that of sun and sky, or the sky does itself, as shown;
/// at least white.
pub(super) fn brightest(scene: &Scene, counts: impl Fn(usize) -> bool) -> f64 {
    let materials = scene.surfaces.materials.iter().enumerate().filter(|(number, _)| counts(*number));
    let lights = materials.map(|(_, material)| f64::from(scene.most_light(material).max_element()));
    let sky = scene.sky.horizon.max(scene.sky.zenith).max_element();
    shown(scene, lights.fold(sky, f64::max))
}

/// So much light as the picture shows it, at least white.
fn shown(scene: &Scene, light: f64) -> f64 {
    (light * libm::exp2(scene.render.exposure_ev)).max(1.0)
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
pub(super) fn largest_falloff(scene: &Scene) -> f64 {
    let center = weight_of_light(scene, (0.0, 0.0), (0.0, 0.0));
    let lens = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
    let far = |film: (f64, f64)| {
        let each = lens.map(|lens| (weight_of_light(scene, film, lens) / center - 1.0).abs());
        each.into_iter().fold(0.0, f64::max)
    };
    FILM.map(far).into_iter().fold(0.0, f64::max)
}
