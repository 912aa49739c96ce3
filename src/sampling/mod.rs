//! Sample points: one nested low-discrepancy sequence, keyed by (seed, stream, index) and nothing else,
//! and the maps from the unit square to the aperture's disk or polygon, the sun's disk and the pattern of diffraction.
//!
//! The sequence is Sobol's in base 2 (directions of S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008),
//! 2635-2654), Owen-scrambled by hashing (B. Burley, "Practical hash-based Owen scrambling", JCGT 9(4),
//! 2020; the hash is N. Vegdahl's improvement of Laine and Karras's). Its first two dimensions are the
//! lens, so of every power of two of consecutive points the even half and the odd half, scrambled apart, put equally
//! many in each elementary interval.

mod aperture;
mod cone;
mod diffraction;
mod points;
pub mod runs;
mod sobol;

pub use aperture::{ApertureShape, disk_from_square};
pub(crate) use cone::{cone_direction, sun_shift, sun_square};
pub use diffraction::{Diffraction, diffraction_square, intensity};
pub use points::PointSet;
pub use sobol::{chance, hash, scrambled_sobol, scrambled_sobol_pair, shuffled_radical_inverse};

/// One sample: a lens point and a place in the pixel, both as exact single-precision numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// In the unit square; [`ApertureShape::from_square`] maps it to the lens.
    pub square: [f32; 2],
    /// In the aperture, fractions of its circle's radius, `u` along `ex`, `v` along `ey`.
    pub lens: [f32; 2],
    /// In the pixel: 0..1 to the right and 0..1 downward.
    pub pixel: [f32; 2],
}

/// The most pixels on a side of a picture: what numbers of 16 bits tell apart, with a sign.
pub const MAX_SIDE: u32 = 32_767;

/// Pixels on the side of the fixed grid of squares that share their lens points.
pub const GRID: u32 = 32;

/// The block of pixels, width and height, that have sample sets of their own, repeated over a square of the
/// grid. From 9 samples a pixel on it is a single pixel: the whole square shares one set.
pub fn block(samples: u32) -> (u32, u32) {
    match samples {
        0 | 1 => (4, 4),
        2 => (4, 2),
        3 | 4 => (2, 2),
        5..=8 => (2, 1),
        _ => (1, 1),
    }
}

/// The stream of samples that pixel `(x, y)` of a picture with `samples` samples a pixel draws from.
pub fn pixel_stream(x: u32, y: u32, samples: u32) -> u64 {
    let square = u64::from(y / GRID) << 32 | u64::from(x / GRID);
    let (width, height) = block(samples);
    match (y % height) * width + x % width {
        0 => square,
        inside => hash(square, u64::from(inside)),
    }
}

/// Sample `index` of the stream `stream` (a tile's number, say) of a picture with this `seed`.
///
/// Even and odd indices belong to two independently scrambled sequences, whose difference estimates the
/// error of their mean. Each is nested: more samples continue fewer.
pub fn sample(seed: u64, stream: u64, index: u32) -> Sample {
    sample_through(&ApertureShape::Disk, seed, stream, index)
}

/// As [`sample`], for an aperture of any shape: the same points of the square, mapped to it.
pub fn sample_through(shape: &ApertureShape, seed: u64, stream: u64, index: u32) -> Sample {
    sample_of(PointSet::Sobol, shape, seed, stream, index)
}

/// As [`sample_through`], of points to choose.
pub fn sample_of(points: PointSet, shape: &ApertureShape, seed: u64, stream: u64, index: u32) -> Sample {
    let key = hash(hash(seed, stream), u64::from(index & 1));
    let [a, b, x, y] = points.point(index >> 1, key);
    Sample { square: [a, b], lens: shape.from_square([a, b]), pixel: [x, y] }
}

/// What names pixel `(x, y)` of a picture, for what is chosen for it alone.
pub(crate) fn pixel_key(seed: u64, x: u32, y: u32) -> u64 {
    hash(hash(seed, u64::from(x)), u64::from(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which of `cells` (a power of two) equal rectangles of the unit square a point lies in. The rectangles
    /// are elementary intervals, as square as can be.
    fn square_cell(square: [f32; 2], cells: u32) -> usize {
        let bits = cells.trailing_zeros();
        let across = 1u32 << bits.div_ceil(2);
        let down = 1u32 << (bits / 2);
        let column = ((square[0] * across as f32) as u32).min(across - 1);
        let row = ((square[1] * down as f32) as u32).min(down - 1);
        (row * across + column) as usize
    }

    #[test]
    fn elementary_intervals_hold_equally_many_points() {
        for n in [32u32, 128, 1024] {
            for replicate in 0..2 {
                let mut counts = vec![0; (n / 4) as usize];
                for k in 0..n {
                    let s = sample(7, 3, 2 * k + replicate);
                    counts[square_cell(s.square, n / 4)] += 1;
                }
                assert!(counts.iter().all(|&count| count == 4), "{counts:?}");
            }
        }
    }

    #[test]
    fn strata_are_kept_in_a_polygon() {
        // Four points in each elementary interval of the square, whose images are equal areas: sector by sector of
        // a square aperture, 1024 points fall as evenly as the intervals that its sides cut allow.
        let shape = ApertureShape::Polygon { blades: 4, rotation: 0.3 };
        let (corners, mut counts) = (shape.corners(), [0i32; 4]);
        for k in 0..1024 {
            let s = sample_through(&shape, 7, 3, 2 * k);
            assert_eq!((s.square, s.pixel), (sample(7, 3, 2 * k).square, sample(7, 3, 2 * k).pixel));
            let [u, v] = s.lens.map(f64::from);
            let right = |c: &[f64; 2]| c[0] * v - c[1] * u <= 0.0;
            counts[(0..4).position(|i| right(&corners[i]) && !right(&corners[(i + 1) % 4])).unwrap_or(0)] +=
                1;
        }
        assert!(counts.iter().all(|count| (count - 256).abs() <= 8), "{counts:?}");
    }

    #[test]
    fn a_sample_needs_only_its_key() {
        assert_eq!(sample(1, 2, 3), sample(1, 2, 3));
        assert_ne!(sample(1, 2, 3), sample(1, 3, 3));
        assert_ne!(sample(1, 2, 3), sample(2, 2, 3));
    }

    #[test]
    fn the_sequence_integrates_better_than_chance() {
        // The mean of x y over pixel and lens square is 1/4; 1024 random points would be off by about 0.007.
        let n = 1024;
        let mean: f64 = (0..n)
            .map(|k| {
                let s = sample(5, 0, k);
                f64::from(s.square[0]) * f64::from(s.square[1]) * 4.0 * f64::from(s.pixel[0] * s.pixel[1])
            })
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - 0.25).abs() < 2e-3, "{mean}");
    }
}
