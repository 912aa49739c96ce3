//! Texture look-up: trilinear, two levels finer than the pixel's own footprint, or as wide as what samples
//! that share the look-up span.

use super::Spread;
use crate::scene::{Level, Texture};
use glam::{Vec2, Vec4};

/// Where a sample looks into a texture, and what pixel and lens span there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// Texture coordinates, `v` up.
    pub uv: Vec2,
    /// Their change with one pixel to the right and down, for a fixed lens point.
    pub dx: Vec2,
    pub dy: Vec2,
    /// Their change with a lens point that moves by the aperture's radius, for a fixed film point.
    pub du: Vec2,
    pub dv: Vec2,
}

/// Width of a shared look-up's filter in standard deviations of what the samples span, squared, over that
/// of a trilinear look-up at level 0 (box times tent: 1/4 texel squared).
const SHARED_WIDTH: f32 = 4.0;

/// Linear red, green, blue and opacity, repeated in both directions.
///
/// A sample by itself looks at the level of a quarter of the pixel's shorter side, whatever the number of
/// samples: many samples then average to the box-filtered texture. (A footprint of the whole pixel would
/// blur twice.) Samples that share a look-up need a filter as wide as the narrow side of what they span.
#[inline]
pub(crate) fn sample(texture: &Texture, footprint: &Footprint, spread: Spread) -> Vec4 {
    let Some(base) = texture.levels.first() else { return Vec4::ONE };
    let size = Vec2::new(base.width as f32, base.height as f32);
    let [dx, dy] = [footprint.dx * size, footprint.dy * size];
    // Squared widths in texels of the finest level.
    let mut square = dx.length_squared().min(dy.length_squared()) * (1.0 / 16.0);
    if spread != Spread::default() {
        let [du, dv] = [footprint.du * size, footprint.dv * size];
        // The covariance of what the samples see, and its smaller root.
        let (xx, yy, xy) = {
            let part =
                |f: fn(Vec2) -> f32| spread.x * f(dx) + spread.y * f(dy) + spread.lens * (f(du) + f(dv));
            (part(|d| d.x * d.x), part(|d| d.y * d.y), part(|d| d.x * d.y))
        };
        let (half, off) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let small = half - (off * off + xy * xy).sqrt();
        square = square.max(SHARED_WIDTH * small);
    }
    // log2 of a square is twice the level.
    let level = 0.5 * linear_log2(square);
    let last = texture.levels.len() - 1;
    if level <= 0.0 || last == 0 {
        return bilinear(base, footprint.uv);
    }
    let low = (level as usize).min(last);
    let high = (low + 1).min(last);
    let share = (level - low as f32).clamp(0.0, 1.0);
    let (near, far) =
        (bilinear(&texture.levels[low], footprint.uv), bilinear(&texture.levels[high], footprint.uv));
    near + (far - near) * share
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

#[inline]
fn bilinear(level: &Level, uv: Vec2) -> Vec4 {
    let axis = |t: f32, size: u32| {
        let t = t - t.floor();
        // A coordinate that is not a number looks at the first texel.
        let at = if t.is_finite() { t * size as f32 - 0.5 } else { 0.0 };
        let low = at.floor();
        // At lies between -0.5 and size - 0.5, so one step either way wraps.
        let first = if low < 0.0 { size as usize - 1 } else { low as usize };
        let second = if first + 1 >= size as usize { 0 } else { first + 1 };
        (first, second, at - low)
    };
    let (x0, x1, fx) = axis(uv.x, level.width);
    // v runs up, rows run down.
    let (y0, y1, fy) = axis(1.0 - (uv.y - uv.y.floor()), level.height);
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
        let footprint = Footprint { uv, dx, dy, du: dx, dv: dy };
        sample(&checker(), &footprint, Spread::default()).x
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
