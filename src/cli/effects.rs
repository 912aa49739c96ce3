//! `--all-effects`, `--with EFFECT` and `--without EFFECT`: what a user says of effects beside the scene's keys.

use super::notes::words_of_effects;
use groundglass::Angle;
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::scene::{EffectChoice, EffectName, EffectSet, Scene};
use std::fmt;

/// The sun as it is seen from the Earth, in degrees: for `--with soft-shadows` where the scene gives it no disk.
const SUN_DEGREES: f64 = 0.533;

#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct EffectArguments {
    /// Compute every effect that the scene asks for, also those too small to be seen
    #[arg(long)]
    pub(super) all_effects: bool,
    /// Compute this effect, though the scene does not ask for it or it is small, and what shows it: shadows with soft-shadows, defocus
    /// with aperture-shape; may be repeated
    #[arg(long, value_name = "EFFECT")]
    pub(super) with: Vec<EffectName>,
    #[arg(long, value_name = "EFFECT", help = help_of_without())]
    pub(super) without: Vec<EffectName>,
}

fn help_of_without() -> String {
    let names = EffectName::ALL.map(EffectName::name).join(", ");
    format!("Leave this effect out, though the scene asks for it; may be repeated. Effects: {names}")
}

/// As on the command line.
impl fmt::Display for EffectArguments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let set = |effects: &[EffectName]| effects.iter().copied().collect();
        let choice =
            EffectChoice { all: self.all_effects, with: set(&self.with), without: set(&self.without) };
        let words = words_of_effects(choice);
        if words.is_empty() {
            f.write_str("with no such flag")
        } else {
            write!(f, "with {}", words.join(" "))
        }
    }
}

impl EffectArguments {
    pub(super) fn is_empty(&self) -> bool {
        !self.all_effects && self.with.is_empty() && self.without.is_empty()
    }

    /// Whether the same pictures come of them.
    pub(super) fn asks_the_same(&self, other: &Self) -> bool {
        let sets = |arguments: &Self| {
            let set = |effects: &[EffectName]| effects.iter().copied().collect::<EffectSet>();
            (arguments.all_effects, set(&arguments.with), set(&arguments.without))
        };
        sets(self) == sets(other)
    }

    /// Whether neither blur nor diffraction, which show the shape of an aperture, are to be drawn.
    fn hides_apertures(&self, scene: &Scene) -> bool {
        let diffraction = EffectName::Diffraction;
        let is_asked = scene.render.diffraction || self.with.contains(&diffraction);
        self.without.contains(&EffectName::Defocus) && (!is_asked || self.without.contains(&diffraction))
    }

    /// Puts them into the scene.
    pub(super) fn apply(&self, scene: &mut Scene) -> Result<()> {
        let wrong = |effect: EffectName, why: &str, remedy: &str| {
            Err(Error::new(ErrorKind::Usage, format!("--with {effect}: {why}")).remedy(remedy.to_owned()))
        };
        for &effect in &self.with {
            if self.without.contains(&effect) {
                return wrong(effect, "also given to --without", "keep one of the two");
            }
            if effect == EffectName::SoftShadows && self.without.contains(&EffectName::Shadows) {
                return wrong(effect, "there are none with --without shadows", "keep one of the two");
            }
            if effect == EffectName::ApertureShape && self.hides_apertures(scene) {
                return wrong(effect, "nothing shows it with --without defocus", "keep one of the two");
            }
            match effect {
                EffectName::Falloff => scene.render.falloff = true,
                EffectName::Shadows | EffectName::SoftShadows => match &mut scene.sun {
                    Some(sun) => {
                        sun.shadows = true;
                        if scene.surfaces.hierarchy.is_none() {
                            scene.surfaces.build_hierarchy();
                        }
                        if effect == EffectName::SoftShadows && sun.angular_diameter.as_degrees() == 0.0 {
                            sun.angular_diameter = Angle::degrees(SUN_DEGREES);
                        }
                    }
                    None => return wrong(effect, "the scene has no sun", "add a [sun] table"),
                },
                EffectName::Defocus | EffectName::Diffraction | EffectName::ApertureShape
                    if scene.optics.aperture_radius() == 0.0 =>
                {
                    return wrong(effect, "the camera is a pinhole", "give it an f_number");
                }
                EffectName::Diffraction => scene.render.diffraction = true,
                EffectName::ApertureShape if scene.blades.is_none() => {
                    return wrong(
                        effect,
                        "the aperture has no blades",
                        "add a [camera.aperture] table with blades",
                    );
                }
                EffectName::Defocus
                | EffectName::Antialiasing
                | EffectName::Textures
                | EffectName::Holes
                | EffectName::Coverage
                | EffectName::ApertureShape => {}
            }
        }
        scene.render.effects = EffectChoice {
            all: self.all_effects,
            with: self.with.iter().copied().collect(),
            without: self.without.iter().copied().collect(),
        };
        Ok(())
    }
}
