//! The effects of a picture by name, and which of them a user wants beside what the scene's keys say.

use std::fmt;
use std::str::FromStr;

/// What light does on its way that a picture may show or leave out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EffectName {
    /// Blur by the aperture.
    Defocus,
    /// The mean over a pixel's square.
    Antialiasing,
    /// `map_Kd`.
    Textures,
    /// Alpha below a half, in `map_Kd` or `map_d`.
    Holes,
    /// `d`, or 1 - `Tr`.
    Coverage,
    /// The sun is hidden by surfaces.
    Shadows,
    /// The sun has a disk.
    SoftShadows,
    /// Aperture blades.
    ApertureShape,
    /// Less light toward the corners.
    Falloff,
    /// Light bends at the aperture.
    Diffraction,
}

impl EffectName {
    /// All of them, in the order in which they are told.
    pub const ALL: [Self; 10] = [
        Self::Defocus,
        Self::Antialiasing,
        Self::Textures,
        Self::Holes,
        Self::Coverage,
        Self::Shadows,
        Self::SoftShadows,
        Self::ApertureShape,
        Self::Falloff,
        Self::Diffraction,
    ];

    /// As in `--without NAME` and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Defocus => "defocus",
            Self::Antialiasing => "antialiasing",
            Self::Textures => "textures",
            Self::Holes => "holes",
            Self::Coverage => "coverage",
            Self::Shadows => "shadows",
            Self::SoftShadows => "soft-shadows",
            Self::ApertureShape => "aperture-shape",
            Self::Falloff => "falloff",
            Self::Diffraction => "diffraction",
        }
    }
}

impl fmt::Display for EffectName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for EffectName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|effect| effect.name() == text);
        found.ok_or_else(|| format!("the effects are {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// Some of the effects.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct EffectSet(u16);

impl EffectSet {
    /// All of them.
    pub const ALL: Self = Self((1 << EffectName::ALL.len()) - 1);

    /// Whether it holds this one.
    pub fn has(self, effect: EffectName) -> bool {
        self.0 >> effect as u16 & 1 == 1
    }

    /// Those that it holds, in their order.
    pub fn iter(self) -> impl Iterator<Item = EffectName> {
        EffectName::ALL.into_iter().filter(move |&effect| self.has(effect))
    }

    /// All that it does not hold.
    #[must_use]
    pub fn others(self) -> Self {
        Self(Self::ALL.0 & !self.0)
    }

    /// With or without this one.
    #[must_use]
    pub fn set(self, effect: EffectName, is_in: bool) -> Self {
        let bit = 1 << effect as u16;
        Self(if is_in { self.0 | bit } else { self.0 & !bit })
    }
}

impl FromIterator<EffectName> for EffectSet {
    fn from_iter<I: IntoIterator<Item = EffectName>>(effects: I) -> Self {
        effects.into_iter().fold(Self::default(), |set, effect| set.set(effect, true))
    }
}

impl fmt::Debug for EffectSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.iter().map(EffectName::name).collect();
        write!(f, "[{}]", names.join(" "))
    }
}

/// What the user says of effects beside the scene's keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EffectChoice {
    /// Nothing that the scene asks for is left out as too small to be seen.
    pub all: bool,
    /// In, however small, where the scene asks for it: light that falls off, bends or casts shadows is asked for by keys of its own
    /// (`falloff` and `diffraction` of [`PictureSettings`](super::PictureSettings), `shadows` of [`Sun`](super::Sun)).
    pub with: EffectSet,
    /// Left out, whatever the scene asks for, and `with` says.
    pub without: EffectSet,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_sets() {
        for effect in EffectName::ALL {
            assert_eq!(effect.name().parse(), Ok(effect));
            assert!(EffectSet::ALL.has(effect) && !EffectSet::ALL.set(effect, false).has(effect));
        }
        assert!("bokeh".parse::<EffectName>().unwrap_err().contains("aperture-shape"));
        let two: EffectSet = [EffectName::Holes, EffectName::Defocus].into_iter().collect();
        assert_eq!(format!("{two:?}"), "[defocus holes]");
        assert!(two.others().iter().all(|effect| !two.has(effect)) && two.others().others() == two);
    }
}
