//! Which effects a scene calls for, because of which number against which threshold.
//!
//! The scene's keys say what is wanted. The plan drops what cannot be seen in this picture, and adds nothing that a key
//! switches off. What it drops changes the picture by no more than [`RenderPlan::tolerance`].

mod diffraction;
mod frame;
mod grazing;
mod light;
mod reason;
mod seen;
mod small;

pub(crate) use light::RING;

use crate::scene::{Budget, EffectName, EffectSet, Scene};
use serde::Serialize;
use small::View;

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
    left_out: EffectSet,
    tolerance: f64,
}

/// What is drawn of what a scene asks for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Decision {
    pub(crate) active: EffectSet,
    /// Asked for, and too small to be seen.
    pub(crate) left_out: EffectSet,
}

impl RenderPlan {
    /// The plan of a scene, with its numbers. It looks at all triangles.
    ///
    /// # Panics
    /// Where [`Surfaces::check`](crate::scene::Surfaces::check) would refuse them: never of what was loaded.
    pub fn new(scene: &Scene) -> Self {
        let view = View::of(scene, &|| false);
        let choice = scene.render.effects;
        let mut effects = Vec::with_capacity(EffectName::ALL.len());
        let (mut active, mut left_out) = (EffectSet::default(), EffectSet::default());
        for name in EffectName::ALL {
            let (asked, is_seen, because) = reason::reason(&view, name);
            let (is_in, because) = if choice.without.has(name) {
                (false, format!("--without {name}; {because}"))
            } else if !asked {
                (false, because)
            } else if is_seen {
                let is_told = choice.with.has(name);
                (true, if is_told { format!("{because}; --with {name} asks for it") } else { because })
            } else if choice.all && view.is_small(name) {
                (true, format!("{because}; --all-effects keeps it"))
            } else if let Some(kept) = keeps(&view, name).filter(|_| view.is_small(name)) {
                let word = if kept == name { "asks for" } else { "keeps" };
                (true, format!("{because}; --with {kept} {word} it"))
            } else {
                (false, because)
            };
            active = active.set(name, is_in);
            let is_dropped = asked && !is_in && !choice.without.has(name) && view.is_small(name);
            left_out = left_out.set(name, is_dropped && !is_moot(choice.without, name));
            effects.push(Effect { effect: name.name(), active: is_in, because });
        }
        Self { effects, active, left_out, tolerance: tolerance(scene) }
    }

    /// What is drawn, and what of it is left out as too small: what [`RenderPlan::new`] finds, without its words and as fast as
    /// may be. What is not in view, such as textures, costs nothing and stays in. Once it is to `stop` it may be wrong, for nothing is
    /// drawn then.
    pub(crate) fn decide(scene: &Scene, stop: &(dyn Fn() -> bool + Sync)) -> Decision {
        let (choice, view) = (scene.render.effects, View::of(scene, stop));
        let mut decision = Decision::default();
        for name in EffectName::ALL {
            if !asks(scene, name) || choice.without.has(name) {
                continue;
            }
            if choice.all || keeps(&view, name).is_some() || !view.is_small(name) {
                decision.active = decision.active.set(name, true);
            } else if !is_moot(choice.without, name) {
                decision.left_out = decision.left_out.set(name, true);
            }
        }
        decision
    }

    /// The effects in a fixed order.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// Those that are computed.
    pub fn active(&self) -> EffectSet {
        self.active
    }

    /// Those that the scene asks for and that are too small to be seen.
    pub fn left_out(&self) -> EffectSet {
        self.left_out
    }

    /// How much the picture may change by what was dropped: root mean square over the picture, linear light.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

/// Whether that without which an effect is nowhere seen is left out, too.
fn is_moot(without: EffectSet, name: EffectName) -> bool {
    match name {
        EffectName::ApertureShape => without.has(EffectName::Defocus),
        EffectName::SoftShadows => without.has(EffectName::Shadows),
        _ => false,
    }
}

/// What the user asks for by name that keeps an effect, however small: itself, or what without it is nowhere seen: the shape of an
/// aperture without blur or diffraction, the sun's disk without shadows.
fn keeps(view: &View<'_>, name: EffectName) -> Option<EffectName> {
    let (shape, disk) = (EffectName::ApertureShape, EffectName::SoftShadows);
    let with = view.scene.render.effects.with;
    let needs_blur = || asks(view.scene, shape) && !view.has_diffraction();
    match name {
        _ if with.has(name) => Some(name),
        EffectName::Defocus if with.has(shape) && needs_blur() => Some(shape),
        EffectName::Shadows if with.has(disk) && asks(view.scene, disk) => Some(disk),
        _ => None,
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
