//! Texture look-up: which level, and how it is read.
//!
//! In: the width of a pixel's footprint, `d` texels of the finest level ([`super::coordinates`]). Out: the level to read,
//! and how a place in it becomes a texel, for [`super::fetch`] and [`super::interpolate`]; for a single place, its colour. Colours
//! come from level `round(log2(d / 4))`, alpha from level `floor(log2(d / 4))`, not below 0; the texel is
//! `floor(start + size s + part)`, modulo `size`, where the anchor lies at `start + part`.
//!
//! Texture coordinates run right and down here, in repeats of the texture, from an [`Anchor`] near the tile: what
//! is left is small, and single precision places it to a hundred-thousandth of a texel.

use crate::scene::{Level, Outline, Texture};
use fearless_simd::{Bytes, Select, Simd, SimdBase, f32x16, u32x16};
use glam::{Vec2, Vec4};

/// Where coordinates start, right and down from the texture's left top corner, in 256ths of the texture.
pub(crate) type Anchor = [u32; 2];

/// One direction in a level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    /// Texels.
    pub size: f32,
    pub inverse: f32,
    /// Whole texels to the anchor, and the rest.
    pub start: f32,
    pub part: f32,
    /// Where the size is a power of two: whole texels to the anchor, and the bits of a texel's number.
    pub binary: Option<(i32, i32)>,
}

/// Repeats of a texture from its anchor beyond which a place counts as no number: what is nearer is a number of texels (at most
/// 2^14 a repeat) that integers hold.
pub(super) const FARTHEST: f32 = 65536.0;

impl Side {
    fn new(size: u32, anchor: u32) -> Self {
        // At most 2^14 texels by 2^8.
        let start = size * anchor;
        Self {
            size: size as f32,
            inverse: 1.0 / size as f32,
            start: (start >> 8) as f32,
            part: (start & 255) as f32 * (1.0 / 256.0),
            binary: size.is_power_of_two().then_some(((start >> 8) as i32, size as i32 - 1)),
        }
    }

    /// The number of a texel that is `steps` whole texels from the anchor's.
    fn wrap(&self, steps: f32) -> usize {
        let texel = self.start + steps;
        // Half a texel keeps rounding away from the borders.
        let turns = floor((texel + 0.5) * self.inverse);
        (texel - self.size * turns).clamp(0.0, self.size - 1.0) as usize
    }
}

/// A level of a texture and how samples read it.
#[derive(Clone, Copy)]
pub(crate) struct Choice<'a> {
    pub level: &'a Level,
    pub right: Side,
    pub down: Side,
    /// Take the texel that a sample lies in, instead of interpolating between four.
    pub nearest: bool,
    /// Of a level to take alpha from, where its holes end.
    pub outline: &'a [u8],
}

/// Which levels hold the colours, of 16 places, where coordinates change by `dx` and `dy` from pixel to pixel, whatever the number
/// of samples; many then average to the box-filtered texture. (A footprint of the whole pixel would blur twice.)
/// From the square of the footprint's width in texels of the finest level.
///
/// Minified: the nearest texel of the level whose texels are nearest to a quarter of that width.
/// They are at most `sqrt 2` quarters wide and blur by no more than the contract's trilinear filter at a
/// quarter, since a box of width `w` has the variance `w^2 / 12` and a tent over two texels `w^2 / 6`: at an
/// eighth of its loads. Magnified (level 0): bilinear.
#[inline(always)]
pub(super) fn colour_levels<S: Simd>(simd: S, widths_squared: f32x16<S>) -> u32x16<S> {
    // log2 of a side, to the nearest whole number, is that of its square, plus one, halved and rounded down.
    half_log2s(simd, widths_squared * (2.0 / 16.0))
}

/// Which level holds the alpha, read bilinearly: the finer of the two about a quarter of the width.
/// It is compared to a threshold, so outlines would show single texels.
#[inline(always)]
pub(super) fn alpha_levels<S: Simd>(simd: S, widths_squared: f32x16<S>) -> u32x16<S> {
    half_log2s(simd, widths_squared * (1.0 / 16.0))
}

/// Texels of the finest level.
pub(crate) fn size(texture: &Texture) -> Vec2 {
    texture.levels.first().map_or(Vec2::ONE, |level| Vec2::new(level.width as f32, level.height as f32))
}

/// Half of log2, rounded down; 0 below 4 and for NaN.
#[inline(always)]
fn half_log2s<S: Simd>(simd: S, x: f32x16<S>) -> u32x16<S> {
    let exponents = (x.bitcast::<u32x16<S>>() >> 23) - 127;
    x.simd_ge(f32x16::splat(simd, 4.0)).select(exponents >> 1, u32x16::splat(simd, 0))
}

impl<'a> Choice<'a> {
    /// A level to take colours from.
    #[inline]
    pub(crate) fn colour(texture: &'a Texture, level: usize, anchor: Anchor) -> Option<Self> {
        Self::new(texture, level, anchor, level > 0)
    }

    /// A level to take alpha from.
    #[inline]
    pub(crate) fn alpha(texture: &'a Texture, level: usize, anchor: Anchor) -> Option<Self> {
        let choice = Self::new(texture, level, anchor, false)?;
        let outline = texture.outlines.get(level).or(texture.outlines.last());
        Some(Self { outline: outline.map_or(&[], Outline::fours), ..choice })
    }

    #[inline]
    fn new(texture: &'a Texture, level: usize, anchor: Anchor, nearest: bool) -> Option<Self> {
        let level = texture.levels.get(level).or(texture.levels.last())?;
        let (right, down) = (Side::new(level.width, anchor[0]), Side::new(level.height, anchor[1]));
        Some(Self { level, right, down, nearest, outline: &[] })
    }

    /// Linear red, green, blue and opacity at `at` from the anchor, repeated in both directions: one place by itself, as
    /// rays read it that come by alone.
    pub(crate) fn read(&self, at: Vec2) -> Vec4 {
        // NaN looks at the anchor.
        let known = |t: f32| if t.abs() < FARTHEST { t } else { 0.0 };
        let at = Vec2::new(known(at.x), known(at.y));
        let texels =
            at * Vec2::new(self.right.size, self.down.size) + Vec2::new(self.right.part, self.down.part);
        if self.nearest {
            let row = self.down.wrap(floor(texels.y));
            return self.texel(self.right.wrap(floor(texels.x)), row) * (1.0 / 65535.0);
        }
        let texels = texels - 0.5;
        let low = Vec2::new(floor(texels.x), floor(texels.y));
        let share = texels - low;
        let (x0, x1) = (self.right.wrap(low.x), self.right.wrap(low.x + 1.0));
        let (y0, y1) = (self.down.wrap(low.y), self.down.wrap(low.y + 1.0));
        let [a, b] = [self.texel(x0, y0), self.texel(x1, y0)];
        let [c, d] = [self.texel(x0, y1), self.texel(x1, y1)];
        let top = a + (b - a) * share.x;
        let bottom = c + (d - c) * share.x;
        (top + (bottom - top) * share.y) * (1.0 / 65535.0)
    }

    fn texel(&self, x: usize, y: usize) -> Vec4 {
        let texel = self.level.texels.get(y * self.level.width as usize + x).copied().unwrap_or_default();
        Vec4::from_array(texel.map(f32::from))
    }
}

/// The largest whole number not above `t`. By conversion: without SSE4.1 the instruction is a call.
fn floor(t: f32) -> f32 {
    // Beyond 2^23 every number is whole, and the conversion would saturate.
    if t.abs() >= 8_388_608.0 || t.is_nan() {
        return t;
    }
    let whole = t as i32 as f32;
    if whole > t { whole - 1.0 } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{SimdLevel, at_level};
    use std::sync::Arc;

    fn checker() -> Texture {
        let white = [65535; 4];
        let black = [0, 0, 0, 65535];
        Texture {
            levels: Arc::new([
                Level { width: 2, height: 2, texels: vec![white, black, black, white] },
                Level { width: 1, height: 1, texels: vec![[32768, 32768, 32768, 65535]] },
            ]),
            has_holes: false,
            smooth: Default::default(),
            outlines: Vec::new(),
        }
    }

    fn look(uv: Vec2, pixel: f32) -> f32 {
        let (dx, dy) = (Vec2::new(pixel, 0.0), Vec2::new(0.0, pixel));
        let texture = checker();
        let read = |anchor: Anchor| {
            let from = Vec2::new(anchor[0] as f32, anchor[1] as f32) / 256.0;
            let level = {
                let side = |d: Vec2| (d * size(&texture)).length_squared();
                let square = side(dx).min(side(dy));
                at_level!(SimdLevel::Scalar.level(), simd => {
                    colour_levels(simd, f32x16::splat(simd, square)).to_array()[0] as usize
                })
            };
            Choice::colour(&texture, level, anchor).unwrap().read(Vec2::new(uv.x, 1.0 - uv.y) - from).x
        };
        let found = read([0, 0]);
        assert!(!uv.is_finite() || (found - read([192, 64])).abs() < 1e-6);
        found
    }

    #[test]
    fn texel_centres_rows_and_repeats() {
        // Row 0 is the top of the picture, v = 1.
        assert_eq!(look(Vec2::new(0.25, 0.75), 0.0), 1.0);
        assert_eq!(look(Vec2::new(0.75, 0.75), 0.0), 0.0);
        assert_eq!(look(Vec2::new(-1.75, 2.75), 0.0), 1.0);
        assert!((look(Vec2::new(0.5, 0.75), 0.0) - 0.5).abs() < 1e-6);
        assert!((look(Vec2::new(0.0, 0.75), 0.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_pixel_of_less_than_six_texels_looks_into_the_finest_level() {
        assert_eq!(look(Vec2::new(0.25, 0.75), 2.0), 1.0);
        assert_eq!(look(Vec2::new(0.25, 0.75), 2.8), 1.0);
        assert!((look(Vec2::new(0.25, 0.75), 2.9) - 0.5).abs() < 1e-4);
    }

    #[test]
    fn nonsense_coordinates_are_harmless() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3.4e38] {
            assert!(look(Vec2::new(bad, bad), bad).is_finite());
        }
    }
}
