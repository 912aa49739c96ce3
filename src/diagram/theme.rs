//! Colours and line weights by what they mean. In: nothing. Out: one [`Theme`] that the figures draw with.
//!
//! Hues are those of M. Okabe and K. Ito, *Color Universal Design* (2008), told apart by colour-blind readers
//! too; lettering uses darker shades of the same hues, so that small type keeps its contrast.

use super::display_list::{Color, Recoloring, Stroke};
use crate::error::{Error, Result};

/// A hue with its shade for lettering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hue {
    /// For lines and areas.
    pub line: Color,
    /// For words.
    pub word: Color,
}

const fn hue(line: u32, word: u32) -> Hue {
    Hue { line: Color::hex(line), word: Color::hex(word) }
}

/// What an SVG may change of a theme's colours when it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adapts {
    /// Nothing.
    No,
    /// Where the reader prefers dark pages it takes the colours of [`Theme::DARK`].
    ToDarkPages,
    /// It has no paper, and its ink is the colour of the text around it (`currentColor`).
    ToText,
}

/// The colours of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Theme {
    /// The page.
    pub paper: Color,
    /// Words, the film, the camera.
    pub ink: Color,
    /// Captions, axis, leaders.
    pub quiet: Color,
    /// Frames and guides.
    pub faint: Color,
    /// Lens and lens plane.
    pub lens: Hue,
    /// The glass itself.
    pub glass: Color,
    /// Film plane.
    pub film: Hue,
    /// Plane of sharp focus.
    pub focus: Hue,
    /// Depth of field: wedge, near and far planes.
    pub depth: Hue,
    /// Hinge line and its two planes.
    pub hinge: Hue,
    /// Rays.
    pub ray: Hue,
    /// The subject.
    pub subject: Hue,
    /// Bellows and boards.
    pub body: Color,
    /// What may change when it is shown.
    pub adapts: Adapts,
}

/// The themes by name, with what each is for.
pub const THEMES: [(&str, &str, Theme); 6] = [
    ("print", "dark lines on white paper", Theme::PRINT),
    ("screen", "as print; turns dark where the reader prefers dark pages (SVG)", Theme::SCREEN),
    ("dark", "light lines on a dark page", Theme::DARK),
    ("text", "no paper; the ink is that of the text around it (SVG, currentColor)", Theme::TEXT),
    ("contrast", "black and deep colours on white, at least 7 to 1", Theme::CONTRAST),
    ("grey", "greys alone, told apart by weight and dashes", Theme::GREY),
];

impl Theme {
    /// Dark lines on white paper.
    pub const PRINT: Self = Self {
        paper: Color::hex(0xFF_FF_FF),
        ink: Color::hex(0x11_11_11),
        quiet: Color::hex(0x55_55_55),
        faint: Color::hex(0xB4_B4_B4),
        lens: hue(0x00_72_B2, 0x00_5A_8E),
        glass: Color::hex(0x56_B4_E9),
        film: hue(0x33_33_33, 0x11_11_11),
        focus: hue(0xD5_5E_00, 0xA8_48_00),
        depth: hue(0x00_9E_73, 0x00_70_50),
        hinge: hue(0xB8_58_90, 0x93_40_70),
        ray: hue(0xE6_9F_00, 0x8A_5F_00),
        subject: hue(0x6A_6A_6A, 0x55_55_55),
        body: Color::hex(0x88_88_88),
        adapts: Adapts::No,
    };

    /// [`Theme::PRINT`] on light pages, [`Theme::DARK`] on dark ones.
    pub const SCREEN: Self = Self { adapts: Adapts::ToDarkPages, ..Self::PRINT };

    /// Light lines on a dark page.
    pub const DARK: Self = Self {
        paper: Color::hex(0x16_18_1B),
        ink: Color::hex(0xEC_EC_EC),
        quiet: Color::hex(0xAF_AF_AF),
        faint: Color::hex(0x55_59_5E),
        lens: hue(0x4F_A8_E0, 0x7C_C4_F0),
        glass: Color::hex(0x2F_7F_B4),
        film: hue(0xC8_C8_C8, 0xEC_EC_EC),
        focus: hue(0xFF_7F_2A, 0xFF_A0_62),
        depth: hue(0x1F_BF_92, 0x4F_D4_AF),
        hinge: hue(0xD8_84_B6, 0xE6_A6_CB),
        ray: hue(0xD8_9F_1A, 0xF0_C0_4A),
        subject: hue(0x9A_9A_9A, 0xAF_AF_AF),
        body: Color::hex(0x7C_7C_7C),
        adapts: Adapts::No,
    };

    /// Middle tones that can be read on white and on black, and ink in the colour of the text around.
    pub const TEXT: Self = Self {
        paper: Color::hex(0xFF_FF_FF),
        ink: Color::hex(0x11_11_11),
        quiet: Color::hex(0x11_11_11),
        faint: Color::hex(0x80_80_80),
        lens: hue(0x1F_84_C4, 0x1F_84_C4),
        glass: Color::hex(0x56_B4_E9),
        film: hue(0x11_11_11, 0x11_11_11),
        focus: hue(0xD9_62_10, 0xD9_62_10),
        depth: hue(0x0F_90_6A, 0x0F_90_6A),
        hinge: hue(0xBC_60_96, 0xBC_60_96),
        ray: hue(0xB5_7D_00, 0xA8_74_00),
        subject: hue(0x7C_7C_7C, 0x7C_7C_7C),
        body: Color::hex(0x88_88_88),
        adapts: Adapts::ToText,
    };

    /// Black and deep colours on white.
    pub const CONTRAST: Self = Self {
        paper: Color::hex(0xFF_FF_FF),
        ink: Color::hex(0x00_00_00),
        quiet: Color::hex(0x22_22_22),
        faint: Color::hex(0x55_55_55),
        lens: hue(0x00_3F_9E, 0x00_3F_9E),
        glass: Color::hex(0x8F_C2_FF),
        film: hue(0x00_00_00, 0x00_00_00),
        focus: hue(0x9E_1B_00, 0x9E_1B_00),
        depth: hue(0x00_5C_3E, 0x00_5C_3E),
        hinge: hue(0x7A_00_66, 0x7A_00_66),
        ray: hue(0x6E_4A_00, 0x6E_4A_00),
        subject: hue(0x33_33_33, 0x22_22_22),
        body: Color::hex(0x44_44_44),
        adapts: Adapts::No,
    };

    /// Greys alone.
    pub const GREY: Self = Self {
        paper: Color::hex(0xFF_FF_FF),
        ink: Color::hex(0x11_11_11),
        quiet: Color::hex(0x55_55_55),
        faint: Color::hex(0xB4_B4_B4),
        lens: hue(0x4A_4A_4A, 0x3A_3A_3A),
        glass: Color::hex(0xB0_B0_B0),
        film: hue(0x22_22_22, 0x11_11_11),
        focus: hue(0x00_00_00, 0x00_00_00),
        depth: hue(0x6E_6E_6E, 0x4A_4A_4A),
        hinge: hue(0x5C_5C_5C, 0x4A_4A_4A),
        ray: hue(0x90_90_90, 0x60_60_60),
        subject: hue(0x7A_7A_7A, 0x55_55_55),
        body: Color::hex(0x9C_9C_9C),
        adapts: Adapts::No,
    };

    /// The theme of this name; [`THEMES`] lists them.
    ///
    /// # Errors
    /// When there is none; the error lists those that are.
    pub fn named(name: &str) -> Result<Self> {
        THEMES.iter().find(|theme| theme.0 == name).map(|theme| theme.2).ok_or_else(|| {
            let names: Vec<_> = THEMES.iter().map(|theme| theme.0).collect();
            Error::invalid(format!("unknown theme `{name}`")).remedy(format!("known: {}", names.join(", ")))
        })
    }

    /// Every colour, in a fixed order.
    pub fn colors(&self) -> Vec<Color> {
        let hues = [self.lens, self.film, self.focus, self.depth, self.hinge, self.ray, self.subject];
        let plain = [self.paper, self.ink, self.quiet, self.faint, self.glass, self.body];
        plain.into_iter().chain(hues.into_iter().flat_map(|hue| [hue.line, hue.word])).collect()
    }

    /// The hues of a chart's series, in order: told apart by colour-blind readers, and each with its own
    /// dashes and marker besides.
    pub(crate) fn series(&self) -> [Hue; 6] {
        let plain = Hue { line: self.ink, word: self.ink };
        [self.lens, self.focus, self.depth, self.hinge, self.ray, plain]
    }

    /// What an SVG says about the colours it may change.
    pub(crate) fn recoloring(&self) -> Recoloring {
        match self.adapts {
            Adapts::No => Recoloring::None,
            Adapts::ToText => Recoloring::ToText { ink: self.ink, paper: self.paper },
            Adapts::ToDarkPages => {
                let mut pairs: Vec<_> = self.colors().into_iter().zip(Self::DARK.colors()).collect();
                pairs.sort_unstable();
                pairs.dedup();
                Recoloring::Dark(pairs)
            }
        }
    }
}

/// Dashes of a plane that is not itself an object or an image.
pub(crate) const DASHED: &[f64] = &[1.6, 0.8];
/// The piece of a plane behind the lens, where it is only geometry.
pub(crate) const DOTTED: &[f64] = &[0.5, 0.7];
/// An axis.
pub(crate) const AXIS: &[f64] = &[3.2, 0.7, 0.5, 0.7];

/// Widths in millimetres. From [`HEAVY`] on a line is heavy: no label touches it.
pub(crate) const HEAVY: f64 = 0.5;
pub(crate) const MEDIUM: f64 = 0.3;
pub(crate) const THIN: f64 = 0.2;
pub(crate) const HAIR: f64 = 0.13;

/// Size of the lettering in millimetres.
pub(crate) const LETTER: f64 = 2.8;
/// Size of the title.
pub(crate) const TITLE: f64 = 3.2;

/// A solid line.
pub(crate) const fn solid(color: Color, width: f64) -> Stroke {
    Stroke { color, opacity: 1.0, width, dash: &[], round: false }
}

/// A broken line.
pub(crate) const fn broken(color: Color, width: f64, dash: &'static [f64]) -> Stroke {
    Stroke { color, opacity: 1.0, width, dash, round: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(c: Color) -> [f64; 3] {
        [c.r, c.g, c.b].map(|x| crate::srgb::decode(f64::from(x) / 255.0))
    }

    /// Relative luminance and contrast of the Web Content Accessibility Guidelines 2.
    fn contrast(a: Color, b: Color) -> f64 {
        let y =
            |c: Color| linear(c).iter().zip([0.2126, 0.7152, 0.0722]).map(|(x, w)| x * w).sum::<f64>() + 0.05;
        let (a, b) = (y(a), y(b));
        if a > b { a / b } else { b / a }
    }

    /// CIE L*a*b* of linear sRGB, D65.
    fn lab(rgb: [f64; 3]) -> [f64; 3] {
        let row = |m: [f64; 3]| m.iter().zip(rgb).map(|(a, b)| a * b).sum::<f64>();
        let xyz = [
            row([0.4124, 0.3576, 0.1805]) / 0.9505,
            row([0.2126, 0.7152, 0.0722]),
            row([0.0193, 0.1192, 0.9505]) / 1.089,
        ];
        let f = xyz.map(|t| if t > 0.008_856 { libm::cbrt(t) } else { 7.787 * t + 16.0 / 116.0 });
        [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
    }

    /// Full protanopia, deuteranopia and tritanopia in linear sRGB: G. Machado, M. Oliveira and L. Fernandes, "A
    /// Physiologically-based Model for Simulation of Color Vision Deficiency", IEEE TVCG 15(6), 2009.
    const DEFICIENCIES: [[[f64; 3]; 3]; 3] = [
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ];

    #[test]
    fn hues_are_told_apart_by_colour_blind_readers() {
        for (name, _, theme) in THEMES.into_iter().filter(|(name, ..)| *name != "grey") {
            // Lines that can stand side by side with equal dashes.
            let hues = [theme.lens, theme.focus, theme.depth, theme.hinge];
            for deficiency in DEFICIENCIES {
                let seen = hues.map(|hue| {
                    let rgb = linear(hue.line);
                    lab(deficiency
                        .map(|row| row.iter().zip(rgb).map(|(a, b)| a * b).sum::<f64>().clamp(0.0, 1.0)))
                });
                for i in 0..seen.len() {
                    for j in 0..i {
                        let apart: f64 =
                            (0..3).map(|k| (seen[i][k] - seen[j][k]) * (seen[i][k] - seen[j][k])).sum();
                        println!("{name} {i} {j} {:.1}", apart.sqrt());
                        assert!(
                            apart.sqrt() > 10.0,
                            "{name}: hues {i} and {j} are {:.1} apart",
                            apart.sqrt()
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn words_and_lines_have_contrast() {
        for (name, _, theme) in THEMES {
            let papers = match theme.adapts {
                Adapts::ToText => vec![Color::hex(0xFF_FF_FF), Color::hex(0)],
                _ => vec![theme.paper],
            };
            let least = match name {
                "contrast" => [7.0, 7.0],
                // On white and on black nothing has more than 4.6.
                "text" => [3.2, 3.2],
                _ => [4.5, 2.2],
            };
            for paper in papers {
                let hues = [theme.lens, theme.focus, theme.depth, theme.hinge, theme.ray, theme.subject];
                for (i, hue) in hues.iter().enumerate() {
                    let (word, line) = (contrast(hue.word, paper), contrast(hue.line, paper));
                    assert!(word >= least[0] && line >= least[1], "{name} hue {i}: {word:.2} {line:.2}");
                }
                if theme.adapts != Adapts::ToText {
                    assert!(
                        contrast(theme.ink, paper) > 12.0 && contrast(theme.quiet, paper) > 7.0,
                        "{name}"
                    );
                }
            }
        }
    }

    #[test]
    fn each_colour_has_one_dark_counterpart() {
        let Recoloring::Dark(pairs) = Theme::SCREEN.recoloring() else { panic!("screen turns dark") };
        for pair in pairs.windows(2) {
            assert_ne!(pair[0].0, pair[1].0, "{pair:?}");
        }
    }
}
