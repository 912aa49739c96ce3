//! Where diffraction sends light: Fraunhofer's pattern of a disk or a regular polygon, and the map from the unit square to it.
//!
//! In: the shape of the aperture, its circle's radius 1, and points of the unit square. Out: spatial frequencies `k`, radians
//! to the radius, along the axes of the lens, with density proportional to `|integral over the aperture of exp(-i k.s) ds|^2`.
//! What `k` is on the film is [`crate::optics::Optics::diffraction_at`].
//!
//! A disk gives Airy's pattern `(2 J1(k) / k)^2`; a polygon's integral is a sum over its sides, by Gauss's theorem. Both are
//! cut off where 0.4 % of the light lies outside: beyond `|k| = K` there is a share of `P / (pi a K)`, with `P` the perimeter and
//! `a` the area (each side sends light along its normal as `1/k^2`), so that a disk keeps 50 rings. What is kept is renormalised.

use super::aperture::ApertureShape;
use super::sobol::{hash, scrambled_sobol_pair};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// The share of the light beyond the cut-off.
const CUT_OFF: f64 = 0.004;

/// Steps from the middle to the cut-off: a thirtieth of a ring each.
const STEPS: usize = 1600;

/// Where in the pattern sample `index` of a stream goes: two more dimensions of the sample sequence, each in 0..1.
pub fn diffraction_square(seed: u64, stream: u64, index: u32) -> [f64; 2] {
    let key = hash(hash(seed, stream), u64::from(index & 1));
    scrambled_sobol_pair(index >> 1, key, 1).map(|bits| f64::from(bits) / 4_294_967_296.0)
}

/// A density that is linear between equally spaced nodes, with its integral.
#[derive(Clone, Debug)]
struct Linear {
    density: Vec<f64>,
    /// The share of the whole before each node.
    before: Vec<f64>,
    /// The integral over all, in spacings.
    total: f64,
}

impl Linear {
    fn new(density: Vec<f64>) -> Self {
        let mut sum = 0.0;
        let mut before = Vec::with_capacity(density.len());
        before.push(0.0);
        for pair in density.windows(2) {
            sum += 0.5 * (pair[0] + pair[1]);
            before.push(sum);
        }
        if sum > 0.0 {
            before.iter_mut().for_each(|share| *share /= sum);
        }
        Self { density, before, total: sum }
    }

    /// The interval and the place in it, 0..=1, before which a share `u` of the whole lies.
    fn place(&self, u: f64) -> (usize, f64) {
        let last = self.density.len().saturating_sub(2);
        let i = self.before.partition_point(|&share| share <= u).saturating_sub(1).min(last);
        let (a, b) = (self.density[i], self.density[i + 1]);
        let width = self.before[i + 1] - self.before[i];
        let y = if width > 0.0 { ((u - self.before[i]) / width).clamp(0.0, 1.0) } else { 0.5 };
        let root = a + (a * a + (b * b - a * a) * y).max(0.0).sqrt();
        (i, if root > 0.0 { ((a + b) * y / root).min(1.0) } else { y })
    }
}

/// Nodes between which straight lines hold as much light as the curve through the given ones: a line is off by a twelfth of
/// the second difference, in the mean.
fn unsmoothed(mut nodes: Vec<f64>) -> Vec<f64> {
    let mut before = nodes.first().copied().unwrap_or_default();
    for i in 1..nodes.len().saturating_sub(1) {
        let here = nodes[i];
        nodes[i] = (here - (nodes[i + 1] - 2.0 * here + before) / 12.0).max(0.0);
        before = here;
    }
    nodes
}

/// Fraunhofer's pattern of an aperture, ready to be sampled.
#[derive(Clone, Debug)]
pub struct Diffraction {
    /// The distance of neighbouring nodes of `radial`.
    step: f64,
    /// Light by `|k|`.
    radial: Linear,
    /// Of a polygon, node by node of `radial`: light by angle, in one of the `copies` into which symmetry divides the turn.
    angular: Vec<Linear>,
    copies: f64,
    rotation: f64,
    kept: f64,
}

impl Diffraction {
    /// The pattern of an aperture. A polygon's takes about a tenth of a second to prepare, and some megabytes.
    pub fn new(shape: &ApertureShape) -> Self {
        let area = shape.area();
        let step = Self::reach_of(shape) / STEPS as f64;
        // Parseval: the integral of the pattern, 1 at its middle, over all k.
        let all = TAU * TAU / area;
        match *shape {
            ApertureShape::Disk => {
                let nodes = (0..=STEPS).map(|i| i as f64 * step);
                let radial =
                    Linear::new(unsmoothed(nodes.map(|k| TAU * k * intensity(shape, [k, 0.0])).collect()));
                let kept = radial.total * step / all;
                Self { step, radial, angular: Vec::new(), copies: 1.0, rotation: 0.0, kept }
            }
            ApertureShape::Polygon { blades, rotation } => {
                // Mirrored at each axis of the polygon, and at its middle, as every |F|^2 is.
                let copies = f64::from(if blades % 2 == 1 { 4 * blades } else { 2 * blades });
                let wedge = TAU / copies;
                let upright = Polygon::new(blades, 0.0);
                let angular: Vec<Linear> = (0..=STEPS)
                    .into_par_iter()
                    .map(|i| {
                        let k = i as f64 * step;
                        let columns = (k * wedge / step).ceil().max(1.0);
                        let at = |column: u32| {
                            let (sine, cosine) = libm::sincos(f64::from(column) / columns * wedge);
                            upright.intensity([k * sine, k * cosine])
                        };
                        Linear::new((0..=columns as u32).map(at).collect())
                    })
                    .collect();
                let mean = |row: &Linear| row.total / (row.density.len() - 1) as f64;
                let density = angular.iter().enumerate().map(|(i, row)| TAU * (i as f64 * step) * mean(row));
                let radial = Linear::new(unsmoothed(density.collect()));
                let kept = radial.total * step / all;
                Self { step, radial, angular, copies, rotation, kept }
            }
        }
    }

    /// The cut-off of the pattern of an aperture: see [`Self::reach`].
    pub fn reach_of(shape: &ApertureShape) -> f64 {
        perimeter(shape) / (PI * shape.area() * CUT_OFF)
    }

    /// The cut-off: the largest `|k|`.
    pub fn reach(&self) -> f64 {
        self.step * STEPS as f64
    }

    /// The share of the light within the cut-off, before it is renormalised.
    pub fn kept(&self) -> f64 {
        self.kept
    }

    /// The `|k|` within which a share of the light, 0 to 1, lies.
    pub fn radius_of(&self, share: f64) -> f64 {
        let (i, t) = self.radial.place(share);
        (i as f64 + t) * self.step
    }

    /// The `k` of a point of the unit square, along `ex` and `ey`: equal areas to equal shares of the light.
    pub fn from_square(&self, square: [f64; 2]) -> [f64; 2] {
        let (i, t) = self.radial.place(square[0]);
        let k = (i as f64 + t) * self.step;
        let angle = match self.angular.get(i..i + 2) {
            None => TAU * square[1],
            Some(rows) => {
                let turned = square[1] * self.copies;
                let (copy, rest) = (turned.floor(), turned - turned.floor());
                // Between two rows the density is a mixture of theirs.
                let (a, b) = ((1.0 - t) * self.radial.density[i], t * self.radial.density[i + 1]);
                let first = if a + b > 0.0 { a / (a + b) } else { 0.5 };
                let (row, rest) = if rest < first {
                    (&rows[0], rest / first)
                } else {
                    (&rows[1], (rest - first) / (1.0 - first))
                };
                let (column, t) = row.place(rest);
                let place = (column as f64 + t) / (row.density.len() - 1) as f64;
                // Every second copy is mirrored.
                let place = if copy % 2.0 == 0.0 { place } else { 1.0 - place };
                self.rotation + TAU * (copy + place) / self.copies
            }
        };
        let (sine, cosine) = libm::sincos(angle);
        [k * sine, k * cosine]
    }

    /// Bytes that the pattern of any aperture takes at most, about.
    pub(crate) const MEMORY: u64 = 20 << 20;
}

/// The pattern at `k`, 1 in the middle: `|integral over the aperture of exp(-i k.s) ds|^2` over the square of the area, for an
/// aperture of radius 1.
pub fn intensity(shape: &ApertureShape, k: [f64; 2]) -> f64 {
    match *shape {
        ApertureShape::Disk => {
            let k = libm::hypot(k[0], k[1]);
            let amplitude = if k < 1e-6 { 1.0 } else { 2.0 * libm::j1(k) / k };
            amplitude * amplitude
        }
        ApertureShape::Polygon { blades, rotation } => Polygon::new(blades, rotation).intensity(k),
    }
}

fn perimeter(shape: &ApertureShape) -> f64 {
    match *shape {
        ApertureShape::Disk => TAU,
        ApertureShape::Polygon { blades, .. } => 2.0 * f64::from(blades) * libm::sin(PI / f64::from(blades)),
    }
}

struct Polygon {
    corners: Vec<[f64; 2]>,
    area: f64,
}

impl Polygon {
    fn new(blades: u32, rotation: f64) -> Self {
        let shape = ApertureShape::Polygon { blades, rotation };
        Self { corners: shape.corners(), area: shape.area() }
    }

    /// The divergence of `i k / |k|^2 exp(-i k.s)` is `exp(-i k.s)`: its flux through a side with ends at phases `p` and `q` is
    /// `i (k x side) / |k|^2` times the mean of `exp(-i phase)` along it, `(exp(-ip) - exp(-iq)) / (i (q - p))`.
    fn intensity(&self, k: [f64; 2]) -> f64 {
        let square = k[0] * k[0] + k[1] * k[1];
        if square < 1e-12 {
            return 1.0;
        }
        let corner = |c: &[f64; 2]| {
            let phase = k[0] * c[0] + k[1] * c[1];
            (*c, phase, libm::sincos(phase))
        };
        let Some(mut from) = self.corners.last().map(corner) else { return 1.0 };
        let (mut real, mut imaginary) = (0.0, 0.0);
        for to in self.corners.iter().map(corner) {
            let ((a, p, (sin_p, cos_p)), (b, q, (sin_q, cos_q))) = (from, to);
            let flux = k[0] * (b[1] - a[1]) - k[1] * (b[0] - a[0]);
            let phases = q - p;
            // The mean of cos and of -sin.
            let (cosine, sine) = if phases.abs() > 0.03 {
                ((sin_q - sin_p) / phases, (cos_q - cos_p) / phases)
            } else {
                let (sine, cosine) = libm::sincos(0.5 * (p + q));
                let square = phases * phases;
                let less = 1.0 - square * (1.0 / 24.0 - square / 1920.0);
                (cosine * less, -sine * less)
            };
            real += flux * cosine;
            imaginary += flux * sine;
            from = to;
        }
        (real * real + imaginary * imaginary) / (square * square * self.area * self.area)
    }
}
