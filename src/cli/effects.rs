//! `--all-effects`, `--with EFFECT` and `--without EFFECT`: what a user says of effects beside the scene's keys.

use groundglass::Angle;
use groundglass::error::{Error, ErrorKind, Result};
use groundglass::scene::{EffectChoice, EffectName, Scene};

/// The sun as it is seen from the Earth, in degrees: for `--with soft-shadows` where the scene gives it no disk.
const SUN_DEGREES: f64 = 0.533;

#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct EffectArguments {
    /// Compute every effect that the scene asks for, also those too small to be seen
    #[arg(long)]
    pub(super) all_effects: bool,
    /// Compute this effect, though the scene does not ask for it or it is small; may be repeated
    #[arg(long, value_name = "EFFECT")]
    pub(super) with: Vec<EffectName>,
    /// Leave this effect out, though the scene asks for it; may be repeated
    #[arg(long, value_name = "EFFECT")]
    pub(super) without: Vec<EffectName>,
}

impl EffectArguments {
    pub(super) fn is_empty(&self) -> bool {
        !self.all_effects && self.with.is_empty() && self.without.is_empty()
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
            match effect {
                EffectName::Falloff => scene.render.falloff = true,
                EffectName::Shadows | EffectName::SoftShadows => match &mut scene.sun {
                    Some(sun) => {
                        if !std::mem::replace(&mut sun.shadows, true) {
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
