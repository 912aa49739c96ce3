//! Axes of charts. In: the values, a scale, a length on the page. Out: the map from values to page millimetres, the
//! ticks at 1, 2, 5 or decades, and how they are written.

use crate::diagram::words::short;
use crate::error::{Error, Result};

/// How values run along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    Log,
}

/// The range of an axis: both ends, in values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) scale: Scale,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// A tick; `label` is empty for a minor one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// The map of an axis: page = at + per * u, where u is the value or its decimal logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    pub(crate) range: Range,
    /// Where it begins and ends on the page.
    pub(crate) ends: [f64; 2],
    pub(crate) at: f64,
    pub(crate) per: f64,
}

/// Where a value stands along its scale.
pub(crate) fn along(scale: Scale, value: f64) -> f64 {
    if scale == Scale::Log { libm::log10(value) } else { value }
}

impl Range {
    /// The range that holds all values, out to round ends; a given end stays what it is.
    ///
    /// # Errors
    /// When there is no value, or an end that a scale cannot have.
    pub(crate) fn holding(values: &[f64], scale: Scale, given: [Option<f64>; 2], room: f64) -> Result<Self> {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = (given[0].unwrap_or(low), given[1].unwrap_or(high));
        if !(low.is_finite() && high.is_finite()) {
            return Err(Error::invalid("no series has a point").remedy("give [[series]] with x and y"));
        }
        // Also of values beyond an end that is given.
        let least = values.iter().copied().fold(low.min(high), f64::min);
        if scale == Scale::Log && least <= 0.0 {
            return Err(Error::invalid(format!("{least} cannot stand on a logarithmic axis"))
                .remedy("use scale = \"linear\", or leave out what is not positive"));
        }
        let largest = low.abs().max(high.abs());
        if largest > 1e100 || (largest > 0.0 && largest < 1e-100) || (scale == Scale::Log && low < 1e-100) {
            return Err(Error::invalid("the numbers are too extreme to be drawn").remedy("use another unit"));
        }
        // What no digits tell apart.
        let is_one = high - low <= 1e-12 * largest;
        if low > high || (is_one && given[0].is_some() && given[1].is_some()) {
            return Err(match given {
                [Some(_), None] => Error::invalid(format!("`min` is {low}, and no value is above {high}"))
                    .remedy("give a lower min, or leave it out"),
                [None, Some(_)] => Error::invalid(format!("`max` is {high}, and no value is below {low}"))
                    .remedy("give a higher max, or leave it out"),
                _ => Error::invalid(format!("the axis would run from {low} to {high}"))
                    .remedy("give a min clearly below max"),
            });
        }
        let mut range = Self { scale, low, high };
        if is_one {
            // A single value stands in the middle.
            let half = if low == 0.0 { 1.0 } else { 0.5 * low.abs() };
            range = match scale {
                Scale::Log => Self { low: low / 2.0, high: high * 2.0, ..range },
                Scale::Linear => Self { low: low - half, high: high + half, ..range },
            };
        }
        let even = |low: f64, high: f64| {
            let step = step(low, high, room);
            let steps = [low / step, high / step];
            let ends = [
                libm::floor(steps[0] + 1e-9 + rounding(steps[0])) * step,
                libm::ceil(steps[1] - 1e-9 - rounding(steps[1])) * step,
            ];
            // By rounding they may lie within the data.
            [ends[0].min(low), ends[1].max(high)]
        };
        // A little more than the data, so that no marker stands on the frame.
        let more = 0.07 * (range.high - range.low);
        let [mut from, mut to] = match (scale, even(range.low - more, range.high + more)) {
            (Scale::Linear, _) => even(range.low, range.high),
            // Where values differ by less than a factor of two 1, 2 and 5 are too far apart.
            (Scale::Log, ends) if range.high < 2.0 * range.low && ends[0] > 0.5 * range.low => ends,
            (Scale::Log, _) => [round(0.93 * range.low, false), round(1.07 * range.high, true)],
        };
        from = given[0].unwrap_or(from);
        to = given[1].unwrap_or(to);
        Ok(Self { scale, low: from, high: to })
    }

    /// Whether a value lies on the axis.
    fn holds(&self, value: f64) -> bool {
        let (u, a, b) = (along(self.scale, value), along(self.scale, self.low), along(self.scale, self.high));
        let slack = 1e-9 * (b - a) + rounding(a.abs().max(b.abs()));
        u >= a - slack && u <= b + slack
    }

    /// Refuses ticks that are given and lie off the axis.
    ///
    /// # Errors
    /// With the first of them.
    pub(crate) fn check_ticks(&self, given: &[f64]) -> Result<()> {
        match given.iter().find(|&&tick| !self.holds(tick)) {
            None => Ok(()),
            Some(tick) => {
                let [low, high] = [self.low, self.high].map(short);
                Err(Error::invalid(format!(
                    "the tick {tick} lies off the axis, which runs from {low} to {high}"
                ))
                .remedy("leave it out, or let the axis run farther"))
            }
        }
    }

    /// Ticks for an axis on which this many labels have room, or those that are given.
    pub(crate) fn ticks(&self, room: f64, given: &[f64]) -> Vec<Tick> {
        let inside = |value: f64| self.holds(value);
        // One value on an axis does not tell how it runs.
        let are_enough = |values: &Vec<f64>| values.iter().filter(|&&v| inside(v)).count() >= 2;
        let majors: Vec<f64> = match (given.is_empty(), self.scale) {
            (false, _) => {
                let mut rising = given.to_vec();
                rising.sort_by(f64::total_cmp);
                rising.dedup();
                rising
            }
            // Between given ends there may be fewer round values than have room.
            (true, Scale::Linear) => (0..8)
                .map(|i| self.steps(room.max(1.0) * f64::from(1 << i)))
                .find(are_enough)
                .unwrap_or_else(|| self.steps(room)),
            // Every decade, and then 1, 2, 5, before all: labels that have no room go, and those of decades are to stay.
            (true, Scale::Log) => [room, libm::log10(self.high / self.low), f64::INFINITY]
                .into_iter()
                .map(|room| self.decades(room))
                .chain([self.minors()])
                .find(are_enough)
                .unwrap_or_else(|| self.steps(room)),
        };
        let majors: Vec<f64> = majors.into_iter().filter(|&v| inside(v)).collect();
        // In even steps they are written as such.
        let scale = if self.high < 2.0 * self.low { Scale::Linear } else { self.scale };
        let mut ticks: Vec<Tick> =
            majors.iter().zip(labels(&majors, scale)).map(|(&value, label)| Tick { value, label }).collect();
        if self.scale == Scale::Log && given.is_empty() {
            for value in self.minors() {
                if inside(value) && !majors.iter().any(|&m| (m / value - 1.0).abs() < 1e-9) {
                    ticks.push(Tick { value, label: String::new() });
                }
            }
        }
        ticks
    }

    /// Even steps, of which this many have room.
    fn steps(&self, room: f64) -> Vec<f64> {
        let step = step(self.low, self.high, room);
        let [low, high] = [self.low, self.high].map(|end| end / step);
        let first = libm::ceil(low - 1e-9 - rounding(low)) as i64;
        let last = high + 1e-9 + rounding(high);
        (0..200)
            .map(|i| (first + i) as f64)
            .take_while(|&steps| steps <= last)
            .map(|steps| steps * step)
            .collect()
    }

    /// Decades, or 1, 2, 5 in each where there is room.
    fn decades(&self, room: f64) -> Vec<f64> {
        let (a, b) = (libm::log10(self.low), libm::log10(self.high));
        let (first, last) = (libm::floor(a + 1e-9) as i32, libm::ceil(b - 1e-9) as i32);
        let whole: Vec<i32> = (first..=last).collect();
        if 3.0 * (b - a) <= room || b - a < 1.2 {
            return whole.iter().flat_map(|&n| [1.0, 2.0, 5.0].map(|m| m * power(n))).collect();
        }
        let every = (libm::ceil((b - a) / room.max(1.0)) as i32).max(1);
        whole.into_iter().filter(|n| n.rem_euclid(every) == 0).map(power).collect()
    }

    fn minors(&self) -> Vec<f64> {
        let (a, b) = (libm::log10(self.low), libm::log10(self.high));
        // Where decades stand close, only they are marked.
        let digits: &[f64] =
            if b - a > 6.0 { &[1.0] } else { &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0] };
        let (first, last) = (libm::floor(a) as i32, libm::ceil(b) as i32);
        (first..=last).flat_map(|n| digits.iter().map(move |m| m * power(n))).collect()
    }
}

impl Axis {
    /// The axis from one page coordinate to another.
    pub(crate) fn new(range: Range, from: f64, to: f64) -> Self {
        let (a, b) = (along(range.scale, range.low), along(range.scale, range.high));
        let per = (to - from) / (b - a);
        Self { range, ends: [from, to], at: from - per * a, per }
    }

    /// The page coordinate of a value; not finite for one that the scale cannot have.
    pub(crate) fn page(&self, value: f64) -> f64 {
        // From the beginning on: where values hardly differ, `at` is far off the page and keeps few digits there.
        let Range { scale, low, .. } = self.range;
        self.ends[0] + self.per * (along(scale, value) - along(scale, low))
    }
}

/// What a few roundings may change of a value.
fn rounding(value: f64) -> f64 {
    4.0 * f64::EPSILON * value.abs()
}

/// 10 to the n, correctly rounded as its decimal text is.
fn power(n: i32) -> f64 {
    format!("1e{n}").parse().unwrap_or(f64::NAN)
}

/// The next of 1, 2, 5 times a power of ten, down or up.
fn round(value: f64, up: bool) -> f64 {
    let n = libm::floor(libm::log10(value) + 1e-12) as i32;
    let ladder = [-1, 0, 1].map(|k| [1.0, 2.0, 5.0].map(|m| m * power(n + k)));
    let mut all = ladder.into_iter().flatten();
    if up {
        all.find(|&x| x >= value * (1.0 - 1e-9)).unwrap_or(value)
    } else {
        all.rfind(|&x| x <= value * (1.0 + 1e-9)).unwrap_or(value)
    }
}

/// The least step of 1, 2, 5 times a power of ten of which at most `room` fit.
fn step(low: f64, high: f64, room: f64) -> f64 {
    // Of values that hardly differ the difference has few digits.
    round((high - low - rounding(low.abs().max(high.abs()))) / room.max(1.0), true)
}

/// So many digits tell any two numbers apart that an axis tells apart.
const MOST_DECIMALS: i32 = 18;

/// How ticks are written: all alike.
fn labels(values: &[f64], scale: Scale) -> Vec<String> {
    let small = values.iter().filter(|v| **v != 0.0).map(|v| v.abs()).fold(f64::INFINITY, f64::min);
    let large = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
    if scale == Scale::Log && (small < 0.000_99 || large > 100_001.0) && values.iter().all(|&v| is_power(v)) {
        return values
            .iter()
            .map(|&v| format!("10*^{{{}}}*", number(libm::round(libm::log10(v)), 0)))
            .collect();
    }
    if scale == Scale::Log {
        return values.iter().map(|&v| plain(v)).collect();
    }
    let step = values.windows(2).map(|w| (w[1] - w[0]).abs()).fold(f64::INFINITY, f64::min);
    let step = if step.is_finite() && step > 0.0 { step } else { large.max(1.0) };
    // Very large or small numbers share a power of ten, written with each: the axis stays readable alone.
    let exponent = libm::floor(libm::log10(large.max(1e-300)) + 1e-9) as i32;
    if !(-4..=5).contains(&exponent) {
        let unit = power(exponent);
        let decimals = decimals_of(values.iter().map(|v| v / unit), step / unit);
        return values
            .iter()
            .map(|&v| match v == 0.0 {
                true => "0".to_owned(),
                false => {
                    format!("{}·10*^{{{}}}*", number(v / unit, decimals), number(f64::from(exponent), 0))
                }
            })
            .collect();
    }
    let decimals = decimals_of(values.iter().copied(), step);
    values.iter().map(|&v| number(v, decimals)).collect()
}

fn is_power(value: f64) -> bool {
    let n = libm::log10(value);
    (n - libm::round(n)).abs() < 1e-9
}

/// Decimals that a multiple of this step needs, which was found between numbers of this size.
fn decimals(step: f64, size: f64) -> usize {
    (0..MOST_DECIMALS)
        .find(|&d| {
            let scaled = step * power(d);
            (scaled - libm::round(scaled)).abs() < 1e-12 * scaled + rounding(size) * power(d)
        })
        .unwrap_or(MOST_DECIMALS) as usize
}

/// Decimals that all of these values need, and a step between them.
fn decimals_of(values: impl Iterator<Item = f64>, step: f64) -> usize {
    let (mut most, mut large) = (0, 0.0);
    for value in values.map(f64::abs).filter(|&value| value != 0.0) {
        (most, large) = (most.max(decimals(value, value)), f64::max(large, value));
    }
    most.max(decimals(step, large))
}

fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.chars().all(|c| matches!(c, '0' | '.'));
    if value < 0.0 && !is_zero { format!("−{text}") } else { text }
}

/// As short as it can be exactly; what would be zeros and little else, with a power of ten.
fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if value.abs() >= 1e-9 {
        return number(value, decimals(value.abs(), value));
    }
    let exponent = libm::floor(libm::log10(value.abs()) + 1e-9);
    let digits = value / power(exponent as i32);
    format!("{}·10*^{{{}}}*", number(digits, decimals(digits.abs(), digits)), number(exponent, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn majors(low: f64, high: f64, scale: Scale, room: f64) -> String {
        let range = Range::holding(&[low, high], scale, [None, None], room).unwrap();
        let ticks = range.ticks(room, &[]);
        let labels: Vec<_> = ticks.iter().filter(|t| !t.label.is_empty()).map(|t| t.label.clone()).collect();
        labels.join(" ")
    }

    #[test]
    fn ticks_stand_at_round_values() {
        assert_eq!(majors(0.0, 9.3, Scale::Linear, 5.0), "0 2 4 6 8 10");
        assert_eq!(majors(-0.31, 0.44, Scale::Linear, 5.0), "−0.4 −0.2 0.0 0.2 0.4 0.6");
        assert_eq!(majors(0.0013, 0.31, Scale::Log, 4.0), "0.001 0.01 0.1");
        assert_eq!(majors(16.0, 4096.0, Scale::Log, 5.0), "10 100 1000");
        assert_eq!(majors(3e-7, 4e-3, Scale::Log, 6.0), "10*^{−6}* 10*^{−5}* 10*^{−4}* 10*^{−3}*");
        assert_eq!(majors(2.0, 9.0, Scale::Log, 6.0), "1 2 5 10");
        // Less than a factor of two apart.
        assert_eq!(majors(1.01, 1.05, Scale::Log, 6.0), "1.00 1.01 1.02 1.03 1.04 1.05 1.06");
        assert_eq!(majors(4.0, 4.4, Scale::Log, 5.0), "4.0 4.2 4.4");
        // Steps to 0 are none of a logarithmic axis.
        let range = Range::holding(&[1.0, 1.9], Scale::Log, [None; 2], 1.0).unwrap();
        assert_eq!((range.low, range.high), (0.5, 5.0));
        assert_eq!(majors(0.0, 3e7, Scale::Linear, 4.0), "0 1·10*^{7}* 2·10*^{7}* 3·10*^{7}*");
        let logs = |low: f64, high: f64| {
            let ticks = Range { low, high, scale: Scale::Log }.ticks(1.6, &[]);
            ticks
                .iter()
                .map(|tick| tick.label.as_str())
                .filter(|l| !l.is_empty())
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert_eq!(logs(2.2, 4500.0), "10 100 1000");
        assert_eq!(logs(2.2, 45.0), "5 10 20");
        let between = |low: f64, high: f64, room: f64| {
            let ticks = Range { low, high, scale: Scale::Linear }.ticks(room, &[]);
            ticks.iter().map(|tick| tick.label.as_str()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(between(1.1, 1.9, 1.0), "1.2 1.4 1.6 1.8");
        assert_eq!(between(0.3, 1.4, 1.0), "0.5 1.0");
        assert_eq!(majors(5.0, 5.0, Scale::Linear, 4.0), "2 4 6 8");
    }

    #[test]
    fn labels_say_the_values_that_they_stand_at() {
        let written = |values: &[f64], scale| labels(values, scale).join(" ");
        assert_eq!(written(&[0.5, 1.5, 2.5], Scale::Linear), "0.5 1.5 2.5");
        assert_eq!(written(&[0.25, 0.75], Scale::Linear), "0.25 0.75");
        assert_eq!(written(&[0.5], Scale::Linear), "0.5");
        assert_eq!(written(&[0.0, 0.5, 1.0], Scale::Log), "0 0.5 1");
        assert_eq!(written(&[1e-14, 5e-14], Scale::Log), "1·10*^{−14}* 5·10*^{−14}*");
        assert_eq!(written(&[0.0, 0.1, 0.1 + 0.2], Scale::Linear), "0.0 0.1 0.3");
        assert_eq!(written(&[123456.789], Scale::Linear), "123456.789");
        assert_eq!(written(&[1_234_567.1], Scale::Linear), "1.2345671·10*^{6}*");
    }

    #[test]
    fn all_values_lie_on_their_axis_and_labels_tell_them_apart() {
        let bases = [1.0, 1013.25, 632.8, 3600.5, 20000.1, 299_792.4, 2_461_000.1, 5e-4, -50000.0];
        for base in bases {
            for part in [1e-2, 1e-5, 1e-7, 1e-9, 2e-12] {
                for room in [2.0, 4.0, 9.0] {
                    let values: Vec<f64> = (0..4).map(|i| base * (1.0 + f64::from(i) * part)).collect();
                    let range = Range::holding(&values, Scale::Linear, [None, None], room).unwrap();
                    assert!(values.iter().all(|&v| range.low <= v && v <= range.high), "{base} {part}");
                    let ticks = range.ticks(room, &[]);
                    assert!(ticks.len() >= 2, "{base} {part} {room}");
                    let is_short = |tick: &Tick| part < 1e-11 || !tick.label.contains("000000000000");
                    assert!(ticks.iter().all(is_short), "{ticks:?}");
                    assert!(ticks.windows(2).all(|pair| pair[0].label != pair[1].label), "{ticks:?}");
                }
            }
        }
    }

    #[test]
    fn a_part_of_a_decade_has_ticks() {
        let written = |low: f64, high: f64| {
            let range = Range { scale: Scale::Log, low, high };
            let ticks = range.ticks(5.0, &[]).into_iter().filter(|tick| !tick.label.is_empty());
            ticks.map(|tick| tick.label).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(written(2.1, 4.9), "3 4");
        assert_eq!(written(1.2, 1.8), "1.2 1.4 1.6 1.8");
        assert_eq!(written(0.0021, 0.009), "0.003 0.004 0.005 0.006 0.007 0.008 0.009");
        let range = Range { scale: Scale::Log, low: 1.0, high: 100.0 };
        assert_eq!(range.ticks(5.0, &[100.0, 10.0, 1.0, 10.0]), range.ticks(5.0, &[1.0, 10.0, 100.0]));
    }

    #[test]
    fn ranges_hold_their_values_and_given_ends_stay() {
        for scale in [Scale::Linear, Scale::Log] {
            for (low, high) in [(0.013, 7.7), (1.0, 1.0), (3e-9, 2e-9), (1e6, 3e6)] {
                let values = [low, high];
                let range = Range::holding(&values, scale, [None, None], 5.0).unwrap();
                assert!(values.iter().all(|&v| range.low <= v * 1.000_001 && range.high >= v * 0.999_999));
                assert!(range.ticks(5.0, &[]).len() >= 2);
            }
        }
        let range = Range::holding(&[1.0, 9.7], Scale::Linear, [Some(0.5), None], 5.0).unwrap();
        assert_eq!((range.low, range.high), (0.5, 10.0));
        assert!(Range::holding(&[], Scale::Linear, [None, None], 5.0).is_err());
        assert!(Range::holding(&[0.0, 1.0], Scale::Log, [None, None], 5.0).is_err());
        assert!(Range::holding(&[-1.0, 1.0], Scale::Log, [Some(0.1), None], 5.0).is_err());
        assert!(Range::holding(&[1e-310, 2e-310], Scale::Linear, [None, None], 5.0).is_err());
        let said = Range::holding(&[1.0, 2.0], Scale::Linear, [Some(3.0), None], 5.0).unwrap_err();
        assert!(said.to_string().contains("`min` is 3, and no value is above 2"), "{said}");
        assert!(Range::holding(&[1.0], Scale::Linear, [Some(2.0), Some(2.0)], 5.0).is_err());
    }

    #[test]
    fn ends_of_an_axis_are_its_ends_on_the_page() {
        let range = Range { scale: Scale::Log, low: 0.01, high: 1000.0 };
        let axis = Axis::new(range, 20.0, 120.0);
        for (value, page) in [(0.01, 20.0), (1.0, 60.0), (1000.0, 120.0)] {
            assert!((axis.page(value) - page).abs() < 1e-9);
        }
    }
}
