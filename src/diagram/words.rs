//! Numbers in words and in files. In: metres and page millimetres. Out: text by one fixed rule each.

use crate::quantity::Length;

/// A page coordinate: three decimals at most, no trailing zeros, no `-0`.
pub(crate) fn coordinate(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" || text.is_empty() { "0".to_owned() } else { text.to_owned() }
}

/// A number that reads back to the same double, no `-0`.
pub(crate) fn exact(value: f64) -> String {
    format!("{}", value + 0.0)
}

/// Three significant digits, without trailing zeros after the point; a proper minus sign.
pub(crate) fn short(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() {
        return if size == 0.0 { "0".to_owned() } else { "∞".to_owned() };
    }
    let mut exponent = libm::floor(libm::log10(size)) as i32;
    // What rounds up to the next power of ten has one digit more before the point.
    if format!("{:.2}", size / libm::exp10(f64::from(exponent))).starts_with("10") {
        exponent += 1;
    }
    if !(-4..6).contains(&exponent) {
        return scientific(value, exponent);
    }
    let decimals = usize::try_from(2 - exponent).unwrap_or(0);
    let mut text = format!("{size:.decimals$}");
    if text.contains('.') {
        text = text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    if value < 0.0 { format!("−{text}") } else { text }
}

fn scientific(value: f64, exponent: i32) -> String {
    // In two steps: ten to the power of the least number's exponent is none.
    let half = exponent / 2;
    let mantissa = value.abs() / libm::exp10(f64::from(half)) / libm::exp10(f64::from(exponent - half));
    let digits: String = exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        })
        .collect();
    let sign = if value < 0.0 { "−" } else { "" };
    format!("{sign}{mantissa:.2}·10{digits}")
}

/// A length with its unit: millimetres below a metre, kilometres from ten thousand metres on.
pub(crate) fn length(metres: f64) -> String {
    let size = metres.abs();
    if size < 0.9995 {
        format!("{} mm", short(metres * 1000.0))
    } else if size < 9995.0 {
        format!("{} m", short(metres))
    } else {
        format!("{} km", short(metres / 1000.0))
    }
}

/// A length of which others differ by `apart` metres: as [`length`], and to a tenth of that if it says less.
pub(crate) fn length_among(metres: f64, apart: f64) -> String {
    let text = length(metres);
    let Some((number, unit)) = text.split_once(' ') else { return text };
    let unit_size = match unit {
        "mm" => 1e-3,
        "m" => 1.0,
        _ => return text,
    };
    let needed = libm::ceil(-libm::log10(0.1 * apart / unit_size));
    let written = number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    // Nobody reads more than four.
    let needed = if needed.is_finite() { needed.clamp(0.0, 4.0) as usize } else { 0 };
    if needed <= written {
        return text;
    }
    format!("{:.needed$} {unit}", metres / unit_size).replace('-', "−")
}

/// How far film and lens stand apart: of less than ten metres to a hundredth of a millimetre, for half a millimetre may be what stands between
/// ten metres and infinity; of less than fifty millimetres to a thousandth, for of such lenses it takes less.
pub(crate) fn extension(extension: Length) -> String {
    let millimetres = extension.as_millimetres();
    if !(0.995..9999.5).contains(&millimetres) {
        return length(extension.as_metres());
    }
    let text = format!("{millimetres:.*}", if millimetres < 50.0 { 3 } else { 2 });
    format!("{} mm", text.trim_end_matches('0').trim_end_matches('.'))
}

/// A scale: `1:125`, or `2:1` for a magnified drawing.
pub(crate) fn ratio(denominator: f64) -> String {
    if denominator >= 1.0 {
        format!("1:{}", short(denominator))
    } else {
        format!("{}:1", short(1.0 / denominator))
    }
}

/// The smallest denominator of a customary scale that is at least `least`.
pub(crate) fn customary_scale(least: f64) -> f64 {
    round_up(least, &[1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])
}

/// The largest of 1, 2, 5 times a power of ten that is at most `most`.
pub(crate) fn round_length(most: f64) -> f64 {
    let power = libm::exp10(libm::floor(libm::log10(most)));
    [5.0, 2.0].into_iter().map(|m| m * power).find(|&x| x <= most * (1.0 + 1e-9)).unwrap_or(power)
}

fn round_up(least: f64, mantissas: &[f64]) -> f64 {
    let power = libm::exp10(libm::floor(libm::log10(least)));
    let found = mantissas.iter().map(|m| m * power).find(|&x| x >= least * (1.0 - 1e-9));
    found.unwrap_or(least)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_the_digits_that_tell_them_apart() {
        assert_eq!([0.23916, 0.24086].map(|m| length_among(m, 0.00169)), ["239.2 mm", "240.9 mm"]);
        assert_eq!([1.2998, 1.3002].map(|m| length_among(m, 0.0004)), ["1.2998 m", "1.3002 m"]);
        assert_eq!([8.42, 12.3].map(|m| length_among(m, 3.9)), ["8.42 m", "12.3 m"]);
        assert_eq!([f64::INFINITY, 0.0, f64::NAN].map(|apart| length_among(2.5, apart)), ["2.5 m"; 3]);
        assert_eq!(length_among(2e4, 1.0), "20 km");
    }

    #[test]
    fn coordinates_have_one_form() {
        for (value, text) in
            [(1.0, "1"), (-0.0001, "0"), (-1.25, "-1.25"), (0.1 + 0.2, "0.3"), (100.0, "100"), (0.0, "0")]
        {
            assert_eq!(coordinate(value), text);
        }
        assert_eq!(exact(-0.0), "0");
        assert_eq!(exact(0.1 + 0.2).parse::<f64>().unwrap(), 0.1 + 0.2);
    }

    #[test]
    fn extensions_keep_what_focuses() {
        for (millimetres, text) in [
            (150.0, "150 mm"),
            (150.5, "150.5 mm"),
            (227.4391, "227.44 mm"),
            (0.0268, "0.0268 mm"),
            (12345.6, "12.3 m"),
            (-20.0, "−20 mm"),
        ] {
            assert_eq!(extension(Length::millimetres(millimetres)), text);
        }
    }

    #[test]
    fn lengths_have_three_digits_and_a_unit() {
        for (metres, text) in [
            (0.15, "150 mm"),
            (1.4347, "1.43 m"),
            (0.99999, "1 m"),
            (9.999, "10 m"),
            (12.0, "12 m"),
            (143.2, "143 m"),
            (0.0268, "26.8 mm"),
            (123_456.0, "123 km"),
            (-2.0, "−2 m"),
            (8.6e15, "8.60·10¹² km"),
            (5e-324, "4.94·10⁻³²¹ mm"),
        ] {
            assert_eq!(length(metres), text);
        }
    }

    #[test]
    fn scales_are_customary() {
        for (least, text) in [(1.0, "1:1"), (1.01, "1:1.25"), (101.0, "1:125"), (0.41, "2:1"), (33.0, "1:40")]
        {
            assert_eq!(ratio(customary_scale(least)), text);
        }
        assert_eq!((round_length(1.0), round_length(4.9), round_length(73.0)), (1.0, 2.0, 50.0));
    }
}
