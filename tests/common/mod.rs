//! What several tests share.

#![allow(dead_code, reason = "each test binary uses its part")]

pub mod extremes;
pub mod oracle;
pub mod scenes;

use groundglass::Exposure;

/// Root mean square difference of pictures of one size clamped to 0..1.
pub fn gap(a: &Exposure, b: &Exposure) -> f64 {
    let places = (0..a.height()).flat_map(|y| (0..a.width()).map(move |x| (x, y)));
    let of = |(x, y): (u32, u32)| {
        let (a, b) = (a.pixel(x, y), b.pixel(x, y));
        let squares = [0, 1, 2].map(|i| f64::from(a[i].clamp(0.0, 1.0)) - f64::from(b[i].clamp(0.0, 1.0)));
        squares.map(|gap| gap * gap).iter().sum::<f64>()
    };
    (places.map(of).sum::<f64>() / (3.0 * f64::from(a.width()) * f64::from(a.height()))).sqrt()
}
