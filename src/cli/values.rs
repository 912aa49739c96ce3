//! Numbers on the command line: `1,2,3;4,5,6`. In: a word; out: validated values, or what is wrong with it,
//! which the argument parser reports as wrong usage.

use clap::builder::{PathBufValueParser, TypedValueParser};
use glam::DVec3;
use groundglass::render::SimdLevel;
use groundglass::sampling::runs::MOST_SAMPLES;
use std::path::PathBuf;
use std::str::FromStr;

/// `u,v;u,v`: lens points in the unit disk.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LensPoints(pub(super) Vec<[f64; 2]>);

/// `px,py,pz;nx,ny,nz`: a point and a unit normal.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlaneValue {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
}

/// `x,y,z;x,y,z;x,y,z`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PointsValue(pub(super) [DVec3; 3]);

/// Metres, positive; infinity allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distance(pub(super) f64);

/// The name of a file or folder to write. It may begin with a hyphen; with two it is a flag, before which the name was forgotten.
pub(super) fn output() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match path.as_os_str().as_encoded_bytes() {
        [b'-', b'-', ..] => Err(format!("a name is needed; write ./{} if that is it", path.display())),
        _ => Ok(path),
    })
}

/// A whole number from 1 to `most`.
fn counted(text: &str, most: u32) -> Result<u32, String> {
    let number = text.trim().parse().ok().filter(|number| (1..=most).contains(number));
    number.ok_or_else(|| format!("a whole number from 1 to {most} is needed"))
}

/// Samples of a pixel.
pub(super) fn samples(text: &str) -> Result<u32, String> {
    counted(text, MOST_SAMPLES)
}

/// Threads.
pub(super) fn threads(text: &str) -> Result<u16, String> {
    counted(text, 1024).map(|number| number as u16)
}

/// The most lens points of one call.
const MOST_POINTS: usize = 65_536;

/// Groups separated by semicolons, each of `N` finite numbers separated by commas.
fn groups<const N: usize>(text: &str) -> Result<Vec<[f64; N]>, String> {
    text.split(';')
        .map(|group| {
            let numbers: Vec<f64> = group
                .split(',')
                .map(|word| match word.trim().parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(value),
                    _ => Err(format!("`{}` is not a finite number", word.trim())),
                })
                .collect::<Result<_, _>>()?;
            let count = numbers.len();
            <[f64; N]>::try_from(numbers)
                .map_err(|_| format!("`{}` has {count} numbers, and {N} are needed", group.trim()))
        })
        .collect()
}

/// Farthest from the origin, metres, along each axis: as in scene files.
const FARTHEST: f64 = 1e12;

/// Points no farther than scene files may have them.
fn near<const N: usize>(points: [[f64; 3]; N]) -> Result<[DVec3; N], String> {
    match points.as_flattened().iter().find(|x| x.abs() > FARTHEST) {
        Some(far) => Err(format!("{far:e} is farther than {FARTHEST:e} m")),
        None => Ok(points.map(DVec3::from_array)),
    }
}

impl FromStr for LensPoints {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let points = groups::<2>(text)?;
        if points.len() > MOST_POINTS {
            return Err(format!("at most {MOST_POINTS} points"));
        }
        // The rim itself belongs to the lens, also when its coordinates were rounded outward.
        match points.iter().find(|[u, v]| u * u + v * v > 1.0 + 1e-12) {
            Some([u, v]) => Err(format!("{u},{v} is outside the aperture, the disk u^2 + v^2 <= 1")),
            None => Ok(Self(points)),
        }
    }
}

impl FromStr for PlaneValue {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let [point, normal] = <[[f64; 3]; 2]>::try_from(groups::<3>(text)?)
            .map_err(|_| "a point and a normal are needed: px,py,pz;nx,ny,nz".to_string())?;
        let [point] = near([point])?;
        let normal = DVec3::from_array(normal);
        // Scaled first, so that squares neither overflow nor vanish.
        let scale = normal.abs().max_element();
        match (normal / scale).try_normalize() {
            Some(normal) if scale > 0.0 => Ok(Self { point, normal }),
            _ => Err("the normal is zero".into()),
        }
    }
}

impl FromStr for PointsValue {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        <[[f64; 3]; 3]>::try_from(groups::<3>(text)?)
            .map_err(|points| format!("{} points given, and three are needed", points.len()))
            .and_then(near)
            .map(Self)
    }
}

impl FromStr for Distance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().parse::<f64>() {
            Ok(value) if value > 0.0 => Ok(Self(value)),
            _ => Err("a distance is a positive number of metres, or inf".into()),
        }
    }
}

/// Bytes: `2GiB`, `500MB`, `1.5G`, `1000000`. K, M and G alone are powers of 1024, as in `KiB`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bytes(pub(super) u64);

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        // From the end: an exponent belongs to the number.
        let end = text.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len();
        let (number, unit) = text.split_at(end);
        let unit = match unit.to_ascii_lowercase().as_str() {
            "" | "b" => 1.0,
            "k" | "kib" => 1024.0,
            "kb" => 1e3,
            "m" | "mib" => 1024.0 * 1024.0,
            "mb" => 1e6,
            "g" | "gib" => 1024.0 * 1024.0 * 1024.0,
            "gb" => 1e9,
            "t" | "tib" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
            "tb" => 1e12,
            _ => return Err("the unit is B, KiB, MiB, GiB, TiB, KB, MB, GB or TB, such as 2GiB".into()),
        };
        match number.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value >= 0.0 => Ok(Self((value * unit) as u64)),
            _ => Err("an amount of memory is a number and a unit, such as 2GiB".into()),
        }
    }
}

/// Seconds: `2s`, `1.5s`, `500ms`, `2min`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seconds(pub(super) f64);

impl FromStr for Seconds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (number, unit) = [("ms", [1.0, 1e3]), ("min", [60.0, 1.0]), ("s", [1.0; 2]), ("", [1.0; 2])]
            .iter()
            .find_map(|&(suffix, unit)| Some((text.strip_suffix(suffix)?, unit)))
            .unwrap_or((text, [1.0; 2]));
        // Over 1000, not times a thousandth: 350 ms are 0.35 s and not a little more.
        let [times, over] = unit;
        match number.trim().parse::<f64>() {
            Ok(value) if value > 0.0 && (value * times / over).is_finite() => Ok(Self(value * times / over)),
            _ => Err("a time is a positive number of seconds, such as 2s or 1.5s, of ms or of min".into()),
        }
    }
}

/// A number of pixels; beyond `u32` the largest, which is refused as too large later, not as wrong usage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pixels(pub(super) u32);

impl FromStr for Pixels {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        match text.parse() {
            Ok(0) => Err("a picture is at least 1 pixel wide".into()),
            Ok(pixels) => Ok(Self(pixels)),
            Err(_) if is_number => Ok(Self(u32::MAX)),
            Err(_) => Err("a whole number of pixels is needed".into()),
        }
    }
}

/// A SIMD level that this machine has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Simd(pub(super) SimdLevel);

impl FromStr for Simd {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = |levels: &mut dyn Iterator<Item = SimdLevel>| {
            levels.map(SimdLevel::name).collect::<Vec<_>>().join(", ")
        };
        let mut available = SimdLevel::ALL.into_iter().filter(|level| level.is_available());
        match SimdLevel::ALL.into_iter().find(|level| level.name() == text) {
            Some(level) if level.is_available() => Ok(Self(level)),
            Some(_) => Err(format!("this machine lacks it; it has {}", names(&mut available))),
            None => Err(format!("no such level; this machine has {}", names(&mut available))),
        }
    }
}

/// A finite number above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Positive(pub(super) f64);

impl FromStr for Positive {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().parse::<f64>() {
            Ok(value) if value > 0.0 && value.is_finite() => Ok(Self(value)),
            _ => Err("a positive, finite number is needed".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_or_refused() {
        assert_eq!("0,0; -0.5,1e-3".parse(), Ok(LensPoints(vec![[0.0, 0.0], [-0.5, 1e-3]])));
        for wrong in ["", "1", "1,2,3", "nan,0", "inf,0", "2,0", "0,0;", "a,b"] {
            assert!(wrong.parse::<LensPoints>().is_err(), "{wrong}");
        }
        let plane: PlaneValue = "1,2,3;0,1e-300,0".parse().unwrap();
        assert_eq!((plane.point, plane.normal), (DVec3::new(1.0, 2.0, 3.0), DVec3::Y));
        for wrong in ["1,2,3", "1,2,3;0,0,0", "1,2,3;0,1,0;0,0,0"] {
            assert!(wrong.parse::<PlaneValue>().is_err(), "{wrong}");
        }
        assert!("0,0,0;1,0,0;0,1,0".parse::<PointsValue>().is_ok());
        assert!("0,0,0;1,0,0".parse::<PointsValue>().is_err());
        assert_eq!("inf".parse(), Ok(Distance(f64::INFINITY)));
        for wrong in ["0", "-1", "nan", "x"] {
            assert!(wrong.parse::<Distance>().is_err() && wrong.parse::<Positive>().is_err(), "{wrong}");
        }
        for (text, seconds) in [("2s", 2.0), ("500 ms", 0.5), ("2min", 120.0), ("1.5", 1.5)] {
            assert_eq!(text.parse(), Ok(Seconds(seconds)));
        }
        for (text, pixels) in
            [("1", 1), ("960", 960), ("1000000000", 1_000_000_000), ("99999999999", u32::MAX)]
        {
            assert_eq!(text.parse(), Ok(Pixels(pixels)));
        }
        for wrong in ["", "0", "-1", "1.5", "1e3", "x"] {
            assert!(wrong.parse::<Pixels>().is_err(), "{wrong}");
        }
        assert!("s".parse::<Seconds>().is_err() && "-1s".parse::<Seconds>().is_err());
        for (text, bytes) in [
            ("4096", 4096),
            ("3KB", 3000),
            ("3 KiB", 3072),
            ("1.5MB", 1_500_000),
            ("2MiB", 2 << 20),
            ("4GB", 4_000_000_000),
            ("1GiB", 1 << 30),
            ("1TB", 1_000_000_000_000),
            ("1TiB", 1 << 40),
            ("1e3KB", 1_000_000),
        ] {
            assert_eq!(text.parse::<Bytes>().map(|found| found.0), Ok(bytes), "{text}");
        }
        for wrong in ["", "GiB", "-1", "1e", "2 parsecs", "inf", "1e3e3KB", "ä"] {
            assert!(wrong.parse::<Bytes>().is_err(), "{wrong}");
        }
    }
}
