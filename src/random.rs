//! Numbers that tests draw their cases from: the same in every run and on every machine.

/// A linear congruential generator (Knuth's multiplier, as in PCG: O'Neill 2014, HMC-CS-2014-0905), of which the high bits are good.
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        self.0
    }

    /// From 0 to 1, which it never is.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// From -1 to 1, which it never is; single precision holds it.
    pub(crate) fn signed(&mut self) -> f64 {
        (self.bits() >> 40) as f64 / 8_388_608.0 - 1.0
    }
}
