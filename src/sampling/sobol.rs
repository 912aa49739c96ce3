//! Hash-based Owen-scrambled Sobol points in eight dimensions, in integers alone.
//!
//! In: the number of a point and a key. Out: its coordinates in 2^-32: the exclusive or of the direction numbers of the set bits of its
//! number, each bit flipped by a hash of those above it (sources: [`super`]). The first two dimensions of any 2^k points that
//! begin at a multiple of 2^k lie as evenly as can be.

/// Direction numbers of dimensions 2 to 8 (dimension 1 is the bit reversal), Joe and Kuo's.
const DIRECTIONS: [[u32; 32]; 7] = [
    directions(1, 0, [1, 0, 0, 0, 0]),
    directions(2, 1, [1, 3, 0, 0, 0]),
    directions(3, 1, [1, 3, 1, 0, 0]),
    directions(3, 2, [1, 1, 1, 0, 0]),
    directions(4, 1, [1, 1, 3, 3, 0]),
    directions(4, 4, [1, 3, 5, 13, 0]),
    directions(5, 2, [1, 1, 5, 5, 17]),
];

const fn directions(degree: usize, polynomial: u32, m: [u32; 5]) -> [u32; 32] {
    let mut v = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        if i < degree {
            v[i] = m[i] << (31 - i);
        } else {
            v[i] = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if (polynomial >> (degree - 1 - k)) & 1 == 1 {
                    v[i] ^= v[i - k];
                }
                k += 1;
            }
        }
        i += 1;
    }
    v
}

/// A well-mixed 64-bit hash of two numbers (the finaliser of SplitMix64, S. Vigna).
pub fn hash(a: u64, b: u64) -> u64 {
    let mut z = a.wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_add(b.wrapping_mul(0xd1b5_4a32_d192_ed03));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Owen's nested uniform scramble of the binary digits of `x`, most significant first.
fn owen_scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

pub(super) fn unit(x: u32) -> f32 {
    // 24 bits: every value is exact and below 1.
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The four coordinates of Sobol point `index`, each in 0..1, scrambled by `key`.
pub fn scrambled_sobol(index: u32, key: u64) -> [f32; 4] {
    let mut point = [index.reverse_bits(), 0, 0, 0];
    let mut rest = index;
    let mut bit = 0;
    while rest != 0 {
        if rest & 1 == 1 {
            for (value, direction) in point[1..].iter_mut().zip(&DIRECTIONS) {
                *value ^= direction[bit];
            }
        }
        rest >>= 1;
        bit += 1;
    }
    let mut dimension = 0;
    point.map(|value| {
        dimension += 1;
        unit(owen_scramble(value, hash(key, dimension) as u32))
    })
}

/// Coordinates `pair` of the same point beyond those four, counted in pairs from 0: each in 2^-32.
pub fn scrambled_sobol_pair(index: u32, key: u64, pair: usize) -> [u32; 2] {
    [3 + 2 * pair, 4 + 2 * pair].map(|dimension| {
        let mut value = 0;
        let mut rest = index;
        for direction in DIRECTIONS.get(dimension).unwrap_or(&DIRECTIONS[0]) {
            value ^= if rest & 1 == 1 { *direction } else { 0 };
            rest >>= 1;
        }
        owen_scramble(value, hash(key, dimension as u64 + 2) as u32)
    })
}

/// What decides by chance for sample `index`: in 0..1, stratified in each half of the samples, independent for other
/// keys and of the sample's place.
pub fn chance(index: u32, key: u64) -> f32 {
    shuffled_radical_inverse(index >> 1, hash(key, u64::from(index & 1)))
}

/// A one-dimensional stratified sequence in 0..1 whose order and digits are scrambled by `key`: sequences
/// of different keys are independent of each other.
pub fn shuffled_radical_inverse(index: u32, key: u64) -> f32 {
    // An order in which the first digit of the result depends on all of the index: the sample's other dimensions are
    // radical inverses of it too, and would go with it.
    let shuffled = owen_scramble(index, hash(key, 11) as u32);
    unit(owen_scramble(shuffled.reverse_bits(), hash(key, 12) as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unscrambled_directions_are_those_of_joe_and_kuo() {
        // Second dimension: 1, 3, 5, 15 over falling powers of two; third: 1, 3, 5, 15 with its own polynomial.
        let leading = |v: &[u32; 32]| [v[0] >> 31, v[1] >> 30, v[2] >> 29, v[3] >> 28];
        assert_eq!(leading(&DIRECTIONS[0]), [1, 3, 5, 15]);
        assert_eq!(leading(&DIRECTIONS[1]), [1, 3, 3, 9]);
        assert_eq!(leading(&DIRECTIONS[2]), [1, 3, 1, 5]);
    }

    #[test]
    fn every_dimension_is_stratified() {
        for dimension in 0..4 {
            let mut seen = [false; 256];
            for k in 0..256 {
                let cell = (scrambled_sobol(k, 99)[dimension] * 256.0) as usize;
                assert!(!std::mem::replace(&mut seen[cell], true));
            }
        }
        let mut seen = [false; 64];
        for k in 0..64 {
            let cell = (shuffled_radical_inverse(k, 5) * 64.0) as usize;
            assert!(!std::mem::replace(&mut seen[cell], true));
        }
    }

    #[test]
    fn chance_does_not_go_with_the_place_of_a_sample() {
        // Of the samples in each half of a dimension, half pass: over many keys the deviation is that of chance.
        let n = 256;
        for dimension in 0..4 {
            let mut square = 0.0;
            for key in 0..64 {
                let passed = (0..n).filter(|&index| {
                    let place = scrambled_sobol(index >> 1, hash(9, u64::from(index & 1)))[dimension];
                    place < 0.5 && chance(index, hash(17, key)) < 0.5
                });
                let off = passed.count() as f64 / f64::from(n) - 0.25;
                square += off * off / 64.0;
            }
            // A fair coin for each sample would give 0.027; one that goes with the place, 0.25.
            assert!(square.sqrt() < 0.03, "dimension {dimension}: {}", square.sqrt());
        }
    }

    #[test]
    fn chance_is_stratified_in_each_half() {
        for half in 0..2 {
            let count = (0..128).filter(|&k| chance(2 * k + half, 77) < 0.25).count();
            assert_eq!(count, 32);
        }
    }

    #[test]
    fn keys_give_independent_sequences() {
        // The joint share of two surfaces with coverage 1/2 each must be 1/4.
        let n = 4096;
        let mut both = 0;
        for pair in 0..64 {
            both += (0..64)
                .filter(|&k| {
                    shuffled_radical_inverse(k, 2 * pair) < 0.5
                        && shuffled_radical_inverse(k, 2 * pair + 1) < 0.5
                })
                .count();
        }
        assert!((f64::from(both as u32) / f64::from(n) - 0.25).abs() < 0.02, "{both}");
    }
}
