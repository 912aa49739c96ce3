//! Triangle set-up: edge functions and depth of one triangle about the centre of one tile.
//!
//! In double precision relative to the tile's centre, kept in single: the constants are then small
//! wherever the sign is in doubt, and an edge's place is good to about 1e-5 of a pixel.

use super::TILE;
use super::view::View;
use glam::DVec3;
use rayon::prelude::*;

/// A function bilinear in lens point (1, u, v) and place in the tile (1, x, y): coefficients of
/// `1, u, v, x, xu, xv, y, yu, yv`; `x`, `y` in pixels from the tile's centre.
pub(crate) type Bilinear = [f32; 9];

/// A vertex on the film, `x w`, `y w` and `w`, each as coefficients of `1, u, v`; pixels from the picture's corner.
pub(crate) type Image = [[f64; 3]; 3];

/// The images of all vertices.
pub(crate) fn images(view: &View, positions: &[DVec3]) -> Vec<Image> {
    let family = &view.pixel_from_lens;
    positions
        .par_iter()
        .map(|position| {
            let p = position.extend(1.0);
            [0, 1, 2].map(|row| [0, 1, 2].map(|part: usize| family[part][row].dot(p)))
        })
        .collect()
}

/// One triangle in one tile.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    /// The triangle's number.
    pub triangle: u32,
    /// Edge `i` lies opposite to corner `i`: its function, over the sum of the three, is that corner's weight.
    pub edges: [Bilinear; 3],
    /// `D.N`.
    pub facing: Bilinear,
    /// Corners on the film, `x w`, `y w` and `w` as coefficients of `1, u, v`; pixels from the tile's centre.
    /// `None` where a corner has no image for some lens point.
    pub corners: Option<[[[f32; 3]; 3]; 3]>,
    /// `N.(v0 - s)`: coefficients of `1, u, v`. Depth is ordered by `1/t = facing / plane`.
    pub plane: [f32; 3],
}

/// The film about one tile's centre.
pub(crate) struct TileFilm {
    /// The tile's centre, and the steps to the next pixel right and down.
    pub p: DVec3,
    pub dx: DVec3,
    pub dy: DVec3,
    weight: [f64; 3],
    radius: f64,
    center: [f64; 2],
    /// `1/t` of the near plane at the centre, and its change with a pixel to the right and down.
    pub near: [f32; 3],
}

impl TileFilm {
    pub(crate) fn new(view: &View, tile_x: u32, tile_y: u32) -> Self {
        let center = |tile: u32| f64::from(tile * TILE) + 0.5 * f64::from(TILE);
        let p = view.film + view.film_dx * center(tile_x) + view.film_dy * center(tile_y);
        let (dx, dy) = (view.film_dx, view.film_dy);
        let f = view.focal_length;
        Self {
            p,
            dx,
            dy,
            weight: [1.0 + p.z / f, dx.z / f, dy.z / f],
            radius: view.radius,
            center: [center(tile_x), center(tile_y)],
            // Along the axis the ray advances -p.z for each unit of t.
            near: [p.z, dx.z, dy.z].map(|z| (-z / view.near) as f32),
        }
    }

    /// `q_w s.m - p.m + s.(d x p)` as nine coefficients. Negating `m` and `d` negates each exactly.
    fn bilinear(&self, m: DVec3, d: DVec3) -> [f64; 9] {
        let row = |p: DVec3, weight: f64| {
            [
                -(p.x * m.x + p.y * m.y + p.z * m.z),
                self.radius * (weight * m.x + (d.y * p.z - d.z * p.y)),
                self.radius * (weight * m.y + (d.z * p.x - d.x * p.z)),
            ]
        };
        let [a, b, c] =
            [row(self.p, self.weight[0]), row(self.dx, self.weight[1]), row(self.dy, self.weight[2])];
        [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
    }

    /// The edge functions in double precision, each opposite to its corner.
    fn edges(&self, v: [DVec3; 3]) -> [[f64; 9]; 3] {
        [(1, 2), (2, 0), (0, 1)].map(|(a, b)| self.bilinear(v[a].cross(v[b]), v[b] - v[a]))
    }

    /// [`Self::edges`] by a common power of two that keeps them within single precision.
    pub(crate) fn scaled_edges(&self, v: [DVec3; 3]) -> [[f64; 9]; 3] {
        let edges = self.edges(v);
        let scale = scale(&edges);
        edges.map(|e| e.map(|c| c * scale))
    }

    /// Sets up a triangle; `images` are those of its corners where all lie in the frustum. `None` when its edges
    /// show that it misses the tile for every lens point.
    pub(crate) fn setup(&self, triangle: u32, v: [DVec3; 3], images: Option<[&Image; 3]>) -> Option<Setup> {
        let edges = self.edges(v);
        let normal = (v[1] - v[0]).cross(v[2] - v[0]);
        let plane = [normal.dot(v[0]), -normal.x * self.radius, -normal.y * self.radius];
        let facing = self.bilinear(normal, DVec3::ZERO);

        let side = if plane[0] > libm::hypot(plane[1], plane[2]) {
            1.0
        } else if -plane[0] > libm::hypot(plane[1], plane[2]) {
            -1.0
        } else {
            0.0
        };
        if side != 0.0 && edges.iter().any(|e| side * e[0] + reach(e) * (1.0 + 1e-6) < 0.0) {
            return None;
        }
        let scale = scale(&edges);
        let corners = images.map(|images| {
            images.map(|&[x, y, w]| {
                let about = |row: [f64; 3], center: f64| {
                    std::array::from_fn(|part| (row[part] - center * w[part]) as f32)
                };
                [about(x, self.center[0]), about(y, self.center[1]), w.map(|w| w as f32)]
            })
        });
        let depth_scale = power_of_two_near(plane[0].abs() + plane[1].abs() + plane[2].abs());
        Some(Setup {
            triangle,
            corners,
            edges: edges.map(|e| e.map(|c| (c * scale) as f32)),
            facing: facing.map(|c| (c * depth_scale) as f32),
            plane: plane.map(|c| (c * depth_scale) as f32),
        })
    }
}

/// A common power of two keeps single precision away from its ends and changes no sign.
fn scale(edges: &[[f64; 9]; 3]) -> f64 {
    power_of_two_near(edges.iter().map(|e| e[0].abs() + reach(e)).fold(0.0, f64::max))
}

/// How far a function can be from its value at tile centre and lens centre.
fn reach(e: &[f64; 9]) -> f64 {
    let half = 0.5 * f64::from(TILE);
    let swing = |i: usize| e[i + 1].abs() + e[i + 2].abs();
    swing(0) + half * (e[3].abs() + swing(3) + e[6].abs() + swing(6))
}

/// A power of two that brings `x` to between 1 and 2, within the doubles' range.
fn power_of_two_near(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52) & 0x7ff;
    // 2^-(exponent - 1023); denormals and infinities are left alone.
    if exponent == 0 || exponent >= 2046 { 1.0 } else { f64::from_bits((2046 - exponent) << 52) }
}
