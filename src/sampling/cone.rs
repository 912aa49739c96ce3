//! Directions in a cone, such as the sun's disk: which of them a sample takes, and the map from the unit square.
//!
//! In: seed, stream and number of a sample, and its pixel's key; points of the unit square. Out: these points, and unit vectors
//! `(x s, y s, 1 - h r^2)`, with `x`, `y` of the unit disk, `r^2 = x^2 + y^2`, `h = 1 - cos(half angle)` and `s = sqrt(h (2 - h r^2))`.

use super::aperture::disk_from_square;
use super::sobol::{hash, scrambled_sobol_pair};

/// Where in the sun's disk sample `index` of a stream looks, in 2^-32: two more dimensions of the sample sequence.
pub fn sun_square(seed: u64, stream: u64, index: u32) -> [u32; 2] {
    let key = hash(hash(seed, stream), u64::from(index & 1));
    scrambled_sobol_pair(index >> 1, key, 0)
}

/// What an exclusive or with [`sun_square`] of sample `index` makes a pixel's own, as evenly spread as before: pixels that share their
/// lens points then do not share their suns, and a penumbra has no steps.
///
/// The even samples have one shift and the odd ones another. With one for both a tile whose two sets happened to coincide was twice as
/// noisy as its neighbours, and its halves agreed: tiles showed, and those that did stated less than they erred.
pub fn sun_shift(pixel_key: u64, index: u32) -> [u32; 2] {
    let bits = hash(pixel_key, 0x6 << 60 | u64::from(index & 1));
    [bits as u32, (bits >> 32) as u32]
}

/// The unit vector about `z`, no farther from it than `half_angle` (radians), of a point of the unit square: uniform in
/// solid angle.
pub fn cone_direction(square: [f32; 2], half_angle: f64) -> [f64; 3] {
    let [x, y] = disk_from_square(square).map(f64::from);
    // 1 - cos is uniform, as the area of a cap goes with its height (Archimedes).
    let sine = libm::sin(0.5 * half_angle);
    let (one_minus_cos, r2) = (2.0 * sine * sine, x * x + y * y);
    let out = (one_minus_cos * (2.0 - r2 * one_minus_cos)).sqrt();
    [x * out, y * out, 1.0 - r2 * one_minus_cos]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_uniform_in_the_cone() {
        // Bands of equal height hold equally many, and so do sectors; the mean height is that of the cap.
        for half_angle in [0.004, 0.5, std::f64::consts::FRAC_PI_2] {
            let n = 1024;
            let (mut bands, mut sectors, mut mean) = ([0; 8], [0; 8], 0.0);
            let cap = 1.0 - libm::cos(half_angle);
            for i in 0..n * n {
                let square = [i % n, i / n].map(|c| (c as f32 + 0.5) / n as f32);
                let [x, y, z] = cone_direction(square, half_angle);
                assert!((x * x + y * y + z * z - 1.0).abs() < 1e-12);
                bands[((8.0 * (1.0 - z) / cap) as usize).min(7)] += 1;
                sectors[(8.0 * (libm::atan2(y, x) / std::f64::consts::TAU + 0.5)) as usize % 8] += 1;
                mean += z / f64::from(n * n);
            }
            let want = f64::from(n * n) / 8.0;
            for count in bands.into_iter().chain(sectors) {
                assert!((f64::from(count) / want - 1.0).abs() < 0.02, "{bands:?} {sectors:?}");
            }
            assert!((mean - (1.0 - 0.5 * cap)).abs() < 1e-4 * cap, "{mean}");
        }
    }

    #[test]
    fn no_stream_has_a_noisier_penumbra_than_the_others_nor_hides_it() {
        // Pixels of a tile each see the part of the disk with x < t, t from 0 to 1.
        let pixels = 1024u32;
        for stream in 0..64 {
            let (mut erred, mut stated) = (0.0, 0.0);
            for pixel in 0..pixels {
                let seen = |index: u32| {
                    let shift = sun_shift(u64::from(pixel), index);
                    let x = f64::from(sun_square(7, stream, index)[0] ^ shift[0]) / 4_294_967_296.0;
                    f64::from(u8::from(x < (f64::from(pixel) + 0.5) / f64::from(pixels)))
                };
                let half = |first: u32| (first..16).step_by(2).map(seen).sum::<f64>() / 8.0;
                let (even, odd) = (half(0), half(1));
                let truth = (f64::from(pixel) + 0.5) / f64::from(pixels);
                let (off, gap) = (0.5 * (even + odd) - truth, 0.5 * (even - odd));
                erred += off * off;
                stated += gap * gap;
            }
            let rms = (erred / f64::from(pixels)).sqrt();
            assert!((0.028..0.044).contains(&rms), "stream {stream}: {rms}");
            assert!(
                (0.8..1.25).contains(&(stated / erred).sqrt()),
                "stream {stream}: {}",
                (stated / erred).sqrt()
            );
        }
    }

    #[test]
    fn a_shifted_square_is_as_even() {
        let shift = sun_shift(1234, 0);
        let mut counts = [0; 64];
        for index in (0..512).step_by(2) {
            let [x, y] = sun_square(3, 4, index);
            let cell = ((x ^ shift[0]) >> 29) * 8 + ((y ^ shift[1]) >> 29);
            counts[cell as usize] += 1;
        }
        assert!(counts.iter().all(|&count| count == 4), "{counts:?}");
    }
}
