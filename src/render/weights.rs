//! What falloff, and the sky seen through a wide lens close up, make samples err by. In: a tile. Out: a part of its light, squared, and
//! squared light, for [`super::edges`]; and whether there is any.
//!
//! Falloff weighs each sample by its lens point, and all pixels of a tile share their lens points: all of its light is wrong by one throw,
//! which two halves of the samples may agree on. (Rounds passed over tiles that did: at f/2 pictures ended with up to 1.6 times the error
//! that was asked for, and stated half of it.) Of weights with a variance `v`, parts of their mean, scrambled nets miss about `v n^(-2.6)`
//! times a constant, found by measuring: the lens's two dimensions alone, and smooth (Owen 1997: `n^-3`, but for logarithms). The sky,
//! which is out of focus as all that is far away, changes over the lens as weights do where what is near is in focus: at 1:1 and f/1.4
//! pictures of it ended with up to 1.6 times the error that was asked for, and stated half of it.

use super::prepared::Prepared;
use crate::plan::RING;
use crate::raster::TILE;
use glam::DVec3;

/// The constant.
const MISSED: f64 = 4.0;

/// Weights that vary by less than a hundredth, squared, make samples err less than anything else does.
const LEAST: f64 = 1e-4;

/// A sky that varies by less over the lens, RMS of its channels as shown, makes samples err by less than its own first samples tell.
const LEAST_SKY: f64 = 0.008;

/// The squared error that so many samples make of such a variance, as a part of squared light.
pub(super) fn missed_by_weights(samples: u32) -> f64 {
    MISSED / libm::pow(f64::from(samples.max(1)), 2.6)
}

impl Prepared<'_> {
    /// Whether light is weighed, and otherwise from lens point to lens point, as far as shows.
    pub(super) fn has_weights(&self) -> bool {
        self.falloff.is_some() && self.corners().into_iter().any(|(x, y)| self.variance(x, y) > LEAST)
    }

    /// Whether the sky changes over the lens, as far as shows.
    pub(super) fn has_sky_over_lens(&self) -> bool {
        let least = 3.0 * LEAST_SKY * LEAST_SKY;
        self.corners().into_iter().any(|(x, y)| self.sky_variance(x, y) > least)
    }

    fn corners(&self) -> [(f64, f64); 4] {
        let (width, height) = (f64::from(self.view.width), f64::from(self.view.height));
        [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)]
    }

    /// The variance of the weights over the lens in the middle of a tile, as a part of their squared mean.
    pub(super) fn variance_of(&self, tile: (u32, u32)) -> f64 {
        let (x, y) = middle(tile);
        self.variance(x, y)
    }

    /// The variance of the sky over the lens in the middle of a tile, all channels together, as shown.
    pub(super) fn sky_variance_of(&self, tile: (u32, u32)) -> f64 {
        let (x, y) = middle(tile);
        self.sky_variance(x, y)
    }

    /// The same at a place of the picture, pixels.
    fn sky_variance(&self, x: f64, y: f64) -> f64 {
        let view = &self.view;
        let film = view.film + view.film_dx * x + view.film_dy * y;
        let weight = film.z / view.focal_length + 1.0;
        let ring = RING.map(|(u, v)| DVec3::new(u, v, 0.0) * (view.radius * weight) - film);
        f64::from(self.gain) * f64::from(self.gain) * self.shader.sky_variance(ring)
    }

    /// The variance of the weights over the lens at a place of the picture, pixels, as a part of their squared mean.
    fn variance(&self, x: f64, y: f64) -> f64 {
        let view = &self.view;
        let normal = view.film_dx.cross(view.film_dy);
        let film = view.film + view.film_dx * x + view.film_dy * y;
        let weights = RING.map(|(u, v)| {
            let r = film - DVec3::new(u, v, 0.0) * view.radius;
            (r.z * normal.dot(r)).abs() / (r.length_squared() * r.length_squared())
        });
        let mean = weights.iter().sum::<f64>() / 4.0;
        let square = weights.iter().map(|weight| (weight - mean) * (weight - mean)).sum::<f64>() / 4.0;
        if mean > 0.0 { square / (mean * mean) } else { 0.0 }
    }
}

/// The middle of a tile, pixels.
fn middle(tile: (u32, u32)) -> (f64, f64) {
    let at = |at: u32| (f64::from(at) + 0.5) * f64::from(TILE);
    (at(tile.0), at(tile.1))
}
