//! Colours and line weights by what they mean. In: nothing. Out: one [`Theme`] that the figures draw with.
//!
//! Hues are those of M. Okabe and K. Ito, *Color Universal Design* (2008), told apart by colour-blind readers
//! too; lettering uses darker shades of the same hues, so that small type keeps its contrast.

use super::display_list::{Color, Stroke};

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
}

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
    };
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
