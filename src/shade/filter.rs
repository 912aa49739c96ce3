//! Texture look-up: trilinear, two levels finer than the pixel's own footprint.

use crate::scene::{Level, Texture};
use glam::{Vec2, Vec4};

/// Where a sample looks into a texture, and what one pixel spans there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// Texture coordinates, `v` up.
    pub uv: Vec2,
    /// Their change with one pixel to the right and down, for a fixed lens point.
    pub dx: Vec2,
    pub dy: Vec2,
}

/// The two levels of a texture that a look-up mixes.
#[derive(Clone, Copy)]
pub(crate) struct Levels<'a> {
    pub low: &'a Level,
    pub high: &'a Level,
    /// Share of `high`; 0 where only `low` counts.
    pub share: f32,
}

/// The levels for a footprint: those of a quarter of the pixel's shorter side, whatever the number of samples.
///
/// Many samples then average to the box-filtered texture. (A footprint of the whole pixel would blur twice.)
#[inline]
pub(crate) fn levels<'a>(texture: &'a Texture, footprint: &Footprint) -> Option<Levels<'a>> {
    let base = texture.levels.first()?;
    let size = Vec2::new(base.width as f32, base.height as f32);
    let side = |d: Vec2| (d * size).length_squared();
    // log2 of a square is twice the level.
    let level = 0.5 * linear_log2(side(footprint.dx).min(side(footprint.dy)) * (1.0 / 16.0));
    let last = texture.levels.len() - 1;
    if level <= 0.0 || last == 0 {
        return Some(Levels { low: base, high: base, share: 0.0 });
    }
    let low = (level as usize).min(last);
    let high = (low + 1).min(last);
    let share = if high == low { 0.0 } else { level - low as f32 };
    Some(Levels { low: &texture.levels[low], high: &texture.levels[high], share })
}

impl Levels<'_> {
    /// Linear red, green, blue and opacity at `uv`, repeated in both directions.
    #[inline]
    pub(crate) fn sample(&self, uv: Vec2) -> Vec4 {
        let near = bilinear(self.low, uv);
        if self.share == 0.0 { near } else { near + (bilinear(self.high, uv) - near) * self.share }
    }
}

/// [`levels`] and [`Levels::sample`] for one sample.
pub(crate) fn sample(texture: &Texture, footprint: &Footprint) -> Vec4 {
    levels(texture, footprint).map_or(Vec4::ONE, |levels| levels.sample(footprint.uv))
}

/// log2 by exponent and mantissa, straight between powers of two: at most 0.09 below, the same everywhere.
fn linear_log2(x: f32) -> f32 {
    if !(x.is_finite() && x > f32::MIN_POSITIVE) {
        // A footprint of no size looks into the finest level, one without bound into the coarsest.
        return if x.is_infinite() { 64.0 } else { 0.0 };
    }
    let bits = x.to_bits();
    ((bits >> 23) as f32 - 127.0) + (f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0)
}

/// The largest whole number not above `t`. By conversion: without SSE4.1 the instruction is a call.
#[inline]
fn floor(t: f32) -> f32 {
    // Beyond 2^23 every number is whole, and the conversion would saturate.
    if t.abs() >= 8_388_608.0 || t.is_nan() {
        return t;
    }
    let whole = t as i32 as f32;
    if whole > t { whole - 1.0 } else { whole }
}

#[inline]
fn bilinear(level: &Level, uv: Vec2) -> Vec4 {
    let axis = |t: f32, size: u32| {
        let t = t - floor(t);
        // A coordinate that is not a number looks at the first texel.
        let at = if t.is_finite() { t * size as f32 - 0.5 } else { 0.0 };
        let low = floor(at);
        // At lies between -0.5 and size - 0.5, so one step either way wraps.
        let first = if low < 0.0 { size as usize - 1 } else { low as usize };
        let second = if first + 1 >= size as usize { 0 } else { first + 1 };
        (first, second, at - low)
    };
    let (x0, x1, fx) = axis(uv.x, level.width);
    // v runs up, rows run down.
    let (y0, y1, fy) = axis(1.0 - (uv.y - floor(uv.y)), level.height);
    let width = level.width as usize;
    let texel = |x: usize, y: usize| {
        let [r, g, b, a] = level.texels.get(y * width + x).copied().unwrap_or_default();
        Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
    };
    let [a, b, c, d] = [texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1)];
    let top = a + (b - a) * fx;
    let bottom = c + (d - c) * fx;
    (top + (bottom - top) * fy) * (1.0 / 65535.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker() -> Texture {
        let white = [65535; 4];
        let black = [0, 0, 0, 65535];
        Texture {
            levels: vec![
                Level { width: 2, height: 2, texels: vec![white, black, black, white] },
                Level { width: 1, height: 1, texels: vec![[32768, 32768, 32768, 65535]] },
            ],
            has_holes: false,
        }
    }

    fn look(uv: Vec2, pixel: f32) -> f32 {
        let (dx, dy) = (Vec2::new(pixel, 0.0), Vec2::new(0.0, pixel));
        let footprint = Footprint { uv, dx, dy };
        sample(&checker(), &footprint).x
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
    fn a_pixel_of_four_texels_looks_into_the_finest_level_and_one_of_eight_into_the_next() {
        assert_eq!(look(Vec2::new(0.25, 0.75), 2.0), 1.0);
        assert!((look(Vec2::new(0.25, 0.75), 4.0) - 0.5).abs() < 1e-4);
        assert!((look(Vec2::new(0.25, 0.75), 3.0) - 0.718_75).abs() < 1e-4);
    }

    #[test]
    fn nonsense_coordinates_are_harmless() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3.4e38] {
            assert!(look(Vec2::new(bad, bad), bad).is_finite());
        }
    }
}
