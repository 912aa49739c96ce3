//! Texture look-up: trilinear, two levels finer than the pixel's own footprint.

use crate::scene::{Level, Texture};
use glam::Vec2;

/// Where a sample looks into a texture, and what one pixel spans there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// Texture coordinates, `v` up.
    pub uv: Vec2,
    /// Their change with one pixel to the right and down, for a fixed lens point.
    pub dx: Vec2,
    pub dy: Vec2,
}

/// Linear red, green, blue and opacity, repeated in both directions.
///
/// The level is that of a quarter of the footprint's shorter side, whatever the number of samples: many
/// samples then average to the box-filtered texture. (A footprint of the whole pixel would blur twice.)
pub(crate) fn sample(texture: &Texture, footprint: &Footprint) -> [f32; 4] {
    let Some(base) = texture.levels.first() else { return [1.0; 4] };
    let size = Vec2::new(base.width as f32, base.height as f32);
    let side = |d: Vec2| (d * size).length_squared();
    let shorter = side(footprint.dx).min(side(footprint.dy)).sqrt();
    let level = linear_log2(0.25 * shorter);
    let last = texture.levels.len() - 1;
    if level <= 0.0 || last == 0 {
        return bilinear(base, footprint.uv);
    }
    let low = (level as usize).min(last);
    let high = (low + 1).min(last);
    let share = (level - low as f32).clamp(0.0, 1.0);
    let (near, far) =
        (bilinear(&texture.levels[low], footprint.uv), bilinear(&texture.levels[high], footprint.uv));
    [0, 1, 2, 3].map(|i| near[i] + (far[i] - near[i]) * share)
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

fn bilinear(level: &Level, uv: Vec2) -> [f32; 4] {
    let axis = |t: f32, size: u32| {
        let t = t - t.floor();
        // A coordinate that is not a number looks at the first texel.
        let at = if t.is_finite() { t * size as f32 - 0.5 } else { 0.0 };
        let low = at.floor();
        let first = (low as i64).rem_euclid(i64::from(size)) as usize;
        let second = if first + 1 == size as usize { 0 } else { first + 1 };
        (first, second, at - low)
    };
    let (x0, x1, fx) = axis(uv.x, level.width);
    // v runs up, rows run down.
    let (y0, y1, fy) = axis(1.0 - (uv.y - uv.y.floor()), level.height);
    let width = level.width as usize;
    let texel = |x: usize, y: usize| level.texels.get(y * width + x).copied().unwrap_or_default();
    let [a, b, c, d] = [texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1)];
    [0, 1, 2, 3].map(|i| {
        let value = |t: [u16; 4]| f32::from(t[i]);
        let top = value(a) + (value(b) - value(a)) * fx;
        let bottom = value(c) + (value(d) - value(c)) * fx;
        (top + (bottom - top) * fy) * (1.0 / 65535.0)
    })
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
        let footprint = Footprint { uv, dx: Vec2::new(pixel, 0.0), dy: Vec2::new(0.0, pixel) };
        sample(&checker(), &footprint)[0]
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
        assert!((look(Vec2::new(0.25, 0.75), 3.0) - 0.75).abs() < 1e-4);
    }

    #[test]
    fn nonsense_coordinates_are_harmless() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3.4e38] {
            assert!(look(Vec2::new(bad, bad), bad).is_finite());
        }
    }
}
