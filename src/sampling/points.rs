//! Sequences of points to choose from: what a picture uses, and others to compare it with.
//!
//! In: the number of a point and a key. Out: four coordinates of the unit cube, two for the lens and two for the pixel.

use super::sobol::{hash, scrambled_sobol, unit};
use std::fmt;
use std::str::FromStr;

/// Where a sample's four coordinates come from: two on the lens, two in the pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointSet {
    /// Sobol's sequence, Owen-scrambled: what pictures use.
    #[default]
    Sobol,
    /// Halton's sequence in bases 2, 3, 5 and 7 (Numer. Math. 2 (1960), 84-90), shifted by chance.
    Halton,
    /// An extensible rank-1 lattice, shifted by chance: generating vector of R. Cools, F. Y. Kuo and D. Nuyens (SIAM J. Sci.
    /// Comput. 28 (2006), 2162-2188), base 2, up to 2^20 points.
    Rank1,
    /// Independent random points.
    Random,
}

impl PointSet {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Sobol, Self::Halton, Self::Rank1, Self::Random];

    /// Its name, as in a table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Halton => "halton",
            Self::Rank1 => "rank-1",
            Self::Random => "random",
        }
    }

    /// The coordinates of point `index`, each in 0..1, of the set that `key` names.
    pub fn point(self, index: u32, key: u64) -> [f32; 4] {
        let chance = |dimension: usize, salt: u64| hash(hash(key, salt), dimension as u64) as u32;
        match self {
            Self::Sobol => scrambled_sobol(index, key),
            Self::Halton => std::array::from_fn(|d| {
                let point =
                    if d == 0 { index.reverse_bits() } else { radical_inverse(index, [2, 3, 5, 7][d]) };
                unit(point.wrapping_add(chance(d, 21)))
            }),
            Self::Rank1 => std::array::from_fn(|d| {
                unit(index.reverse_bits().wrapping_mul(LATTICE[d]).wrapping_add(chance(d, 22)))
            }),
            Self::Random => std::array::from_fn(|d| unit(chance(d, 23 + (u64::from(index) << 8)))),
        }
    }
}

impl fmt::Display for PointSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PointSet {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|set| set.name() == text);
        found.ok_or_else(|| format!("the point sets are {}", Self::ALL.map(Self::name).join(", ")))
    }
}

const LATTICE: [u32; 4] = [1, 182_667, 469_891, 498_753];

/// The digits of `index` in `base` mirrored at the point, as a fraction of 2^32.
fn radical_inverse(index: u32, base: u32) -> u32 {
    let (mut rest, mut digits, mut power) = (u64::from(index), 0u64, 1u64);
    while rest != 0 {
        digits = digits * u64::from(base) + rest % u64::from(base);
        power *= u64::from(base);
        rest /= u64::from(base);
    }
    ((u128::from(digits) << 32) / u128::from(power)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radical_inverses_are_known_fractions() {
        let found = [1, 2, 3, 4, 10].map(|index| f64::from(radical_inverse(index, 3)) / 4_294_967_296.0);
        for (found, wanted) in
            found.into_iter().zip([1.0 / 3.0, 2.0 / 3.0, 1.0 / 9.0, 4.0 / 9.0, 10.0 / 27.0])
        {
            assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
        }
    }

    #[test]
    fn even_points_integrate_better_than_chance() {
        let error = |set: PointSet| -> f64 {
            let n = 1024;
            let squares = (0..32).map(|key| {
                let sum: f64 =
                    (0..n).map(|k| set.point(k, key).iter().map(|&x| f64::from(x)).product::<f64>()).sum();
                let gap = 16.0 * sum / f64::from(n) - 1.0;
                gap * gap
            });
            (squares.sum::<f64>() / 32.0).sqrt()
        };
        let [sobol, halton, rank1, random] = PointSet::ALL.map(error);
        println!("sobol {sobol:.5}, halton {halton:.5}, rank-1 {rank1:.5}, random {random:.5}");
        assert!(8.0 * sobol < random && 3.0 * halton < random && 3.0 * rank1 < random);
        // The standard deviation of a product of four numbers, 16 times over: sqrt((4/3)^4 - 1) = 1.47.
        assert!((random * 32.0 / 1.47 - 1.0).abs() < 0.4, "{random}");
    }
}
