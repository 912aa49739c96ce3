//! Which of the effects that a scene asks for are too small to be seen: numbers against thresholds. In: a scene. Out: yes or no,
//! without looking at more of the scene than it takes.

use super::frame::{around, pixel};
use super::light::{self, brightest};
use super::seen::{Seen, sun_width};
use super::{TOLERANCE, asks, diffraction, grazing, tolerance};
use crate::scene::{EffectName, Scene, bounds};
use glam::DVec3;
use std::cell::OnceCell;

/// Blur below this many pixels is not worth a lens: it is under the pixel's own box filter. (A disk of diameter d adds d^2 / 16 to
/// the variance along an axis, and a pixel's square has 1/12: at this many pixels that is 1.1 % more.)
pub(super) const BLUR_PX: f64 = 0.12;

/// A penumbra below this many pixels is an edge, as blur is.
const PENUMBRA_PX: f64 = BLUR_PX;

/// Weights of falloff within this of 1 are not seen.
const FALLOFF: f64 = 0.002;

/// Of a blur below this many pixels the aperture's shape is not seen: its variance is as far from that of the disk around it as that
/// of a blur of [`BLUR_PX`] is from none. (Along an axis, of a radius of 1: a disk has 1/4, a regular polygon of `n` corners
/// `(2 + cos(2 pi / n)) / 12`.) Three blades 0.17 pixels, five 0.25, eight 0.38; of many blades no more than a pixel.
fn shape_px(scene: &Scene) -> f64 {
    let corners = scene.blades.map_or(f64::INFINITY, |blades| f64::from(blades.count));
    let variance = (2.0 + libm::cos(std::f64::consts::TAU / corners)) / 12.0;
    (BLUR_PX / (1.0 - 4.0 * variance).sqrt()).min(1.0)
}

/// A scene, and what is known of its view so far.
pub(super) struct View<'a> {
    pub(super) scene: &'a Scene,
    /// Lengths in pixels that are taken for nothing, over the usual ones; changes of light go by its square.
    pub(super) scale: f64,
    seen: OnceCell<Seen>,
    grazing: OnceCell<f64>,
    /// Whether the plan is no longer wanted.
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> View<'a> {
    pub(super) fn of(scene: &'a Scene, stop: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self {
            scene,
            scale: (tolerance(scene) / TOLERANCE).sqrt(),
            seen: OnceCell::new(),
            grazing: OnceCell::new(),
            stop,
        }
    }

    /// What the picture shows: this looks at all triangles, once.
    pub(super) fn seen(&self) -> &Seen {
        self.seen.get_or_init(|| Seen::new(self.scene, self.stop))
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

    /// A length in pixels that is not seen, which light makes smaller than the usual one. 0 where pixels do not hide it: they are points.
    fn threshold(&self, usual: f64, light: f64) -> f64 {
        if self.has_filter() { self.scale * usual / light } else { 0.0 }
    }

    /// Whether a pixel is the mean over its square.
    pub(super) fn has_filter(&self) -> bool {
        !self.scene.render.effects.without.has(EffectName::Antialiasing)
    }

    /// Whether a blur reaches its threshold. (What is in view is asked for only where the brightest light of the scene, in view or
    /// not, would make the difference.)
    fn has_blur_of(&self, usual: f64) -> bool {
        if self.seen.get().is_some() {
            return self.blur() > 0.0 && self.blur() >= self.threshold(usual, self.light());
        }
        // Without a filter each blur shows, and none does not.
        let least = |light: f64| self.threshold(usual, light).max(f64::MIN_POSITIVE);
        let has = |light: f64| Seen::has_blur_of(self.scene, least(light), self.stop);
        has(1.0) || {
            let most = brightest(self.scene, |_| true);
            most > 1.0 && has(most) && self.blur() >= self.threshold(usual, self.light())
        }
    }

    /// The widest penumbra: the sun's disk over the longest way light can go between two surfaces, as large as it is drawn, in
    /// pixels. Measured square to the light: where that grazes a surface its penumbra is longer, and as much darker; but for normals that
    /// say otherwise, [`Self::grazing`].
    pub(super) fn penumbra(&self) -> f64 {
        (sun_width(self.scene) * self.seen().shadow).min(self.farthest_penumbra())
    }

    /// How much the picture changes where the sun grazes what normals turn to it, RMS.
    pub(super) fn grazing(&self) -> f64 {
        *self.grazing.get_or_init(|| grazing::change(self.scene, self.stop))
    }

    /// Whether the widest penumbra reaches its threshold, or others change as much as shows.
    fn has_penumbra(&self) -> bool {
        self.has_wide_penumbra() || self.grazing() >= tolerance(self.scene)
    }

    fn has_wide_penumbra(&self) -> bool {
        match self.seen.get() {
            Some(_) => self.penumbra() > 0.0 && self.penumbra() >= self.penumbra_threshold(),
            None => {
                self.farthest_penumbra() >= self.penumbra_threshold()
                    && Seen::has_shadow_of(
                        self.scene,
                        (self.penumbra_threshold() / sun_width(self.scene)).max(f64::MIN_POSITIVE),
                        self.stop,
                    )
            }
        }
    }

    /// Whether some material gives sunlight back: no light has no shadow.
    pub(super) fn has_sunlight(&self) -> bool {
        light::of_sun(self.scene) > 0.0
    }

    /// Whether the sun's light goes through any of the scene to what is in view. (It may meet nothing on its way.)
    fn has_shadow(&self) -> bool {
        match self.seen.get() {
            Some(seen) => seen.shadow > 0.0,
            None => Seen::has_shadow_of(self.scene, f64::MIN_POSITIVE, self.stop),
        }
    }

    /// A bound without a look at each triangle: light that goes through all of the scene, to its point
    /// nearest to the camera, drawn as large as at the film's corner.
    fn farthest_penumbra(&self) -> f64 {
        let (scene, optics) = (self.scene, &self.scene.optics);
        let [low, high] = bounds(scene.surfaces.positions.iter().copied());
        let extent = if low.cmple(high).all() { (high - low).length() } else { 0.0 };
        let eye = optics.world_from_lens().point(DVec3::ZERO);
        let nearest = (eye.clamp(low.min(high), high.max(low)) - eye).length();
        let nearest = nearest.max(optics.camera().near.as_metres());
        // As much of the plane as is looked at.
        let [right, up] = around(scene);
        let corners = light::FILM.map(|(x, y)| optics.film_point(2.0 * x * right, 2.0 * y * up).length());
        let farthest = corners.into_iter().fold(0.0, f64::max);
        let magnification = farthest * farthest / optics.film_plane().e.abs() / nearest / pixel(scene);
        sun_width(self.scene) * extent * magnification
    }

    pub(super) fn blur_threshold(&self) -> f64 {
        self.threshold(BLUR_PX, self.light())
    }

    pub(super) fn shape_threshold(&self) -> f64 {
        self.threshold(shape_px(self.scene), self.light())
    }

    pub(super) fn penumbra_threshold(&self) -> f64 {
        self.threshold(PENUMBRA_PX, light::of_sun(self.scene).max(1.0))
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
            EffectName::Defocus => {
                !self.has_falloff_over_lens() && !self.has_sky_over_lens() && !self.has_blur_of(BLUR_PX)
            }
            EffectName::ApertureShape => {
                let shows = || {
                    self.has_falloff_over_lens()
                        || self.has_sky_over_lens()
                        || self.has_blur_of(shape_px(scene))
                };
                !(self.has_diffraction() || self.has_lens() && shows())
            }
            EffectName::Shadows => !self.has_sunlight() || !(self.has_shadow() || self.has_soft_light()),
            EffectName::SoftShadows => {
                scene.render.effects.without.has(EffectName::Shadows)
                    || !self.has_sunlight()
                    || !(self.has_soft_light() || self.has_penumbra())
            }
            EffectName::Falloff => light::largest_falloff(scene) < self.falloff_threshold(),
            EffectName::Diffraction => !diffraction::is_seen(self),
            EffectName::Antialiasing | EffectName::Textures | EffectName::Holes | EffectName::Coverage => {
                false
            }
        }
    }

    /// Whether falloff is wanted, and light through the whole lens, on the mean over its area, is so much less than through its
    /// centre alone that it shows.
    pub(super) fn has_falloff_over_lens(&self) -> bool {
        let scene = self.scene;
        asks(scene, EffectName::Falloff)
            && !scene.render.effects.without.has(EffectName::Falloff)
            && light::falloff_over_lens(scene) >= self.falloff_threshold()
    }

    /// Whether the sky, which is out of focus as what is far away is, looks another through the whole lens.
    pub(super) fn has_sky_over_lens(&self) -> bool {
        light::sky_over_lens(self.scene) >= self.falloff_threshold()
    }

    /// Whether surfaces in view that nothing shades are lit otherwise by the sun's disk than by its middle.
    fn has_soft_light(&self) -> bool {
        light::softening(self.scene) >= self.falloff_threshold() && self.seen().triangles > 0
    }
}
