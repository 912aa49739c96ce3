//! The sRGB transfer function (IEC 61966-2-1): from codes, 0 to 1, to linear light and back.

/// The light of a code.
pub(crate) fn decode(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { libm::pow((code + 0.055) / 1.055, 2.4) }
}

/// The code of a light.
pub(crate) fn encode(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_the_others_inverse_and_both_have_known_values() {
        for code in (0..=255).map(|code| f64::from(code) / 255.0) {
            assert!((encode(decode(code)) - code).abs() < 1e-7, "{code}");
        }
        // The middle grey of 8 bits, and where the line ends.
        assert!((decode(188.0 / 255.0) - 0.502_886).abs() < 1e-6);
        assert!((decode(0.04045) - 0.003_130_8).abs() < 1e-7);
        assert_eq!([decode(0.0), decode(1.0), encode(0.0)], [0.0, 1.0, 0.0]);
    }
}
