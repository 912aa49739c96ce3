//! The aperture: from the unit square to the unit disk or a regular polygon in it, area for area.
//!
//! In: points of the unit square, from [`super::points`]. Out: lens points, fractions of the radius. With `a`, `b` the square's coordinates
//! from -1 to 1 and `|a| > |b|` the disk's point has the radius `a` and the angle `pi/4 b/a`, else `b` and `pi/4 (2 - a/b)` (Shirley and
//! Chiu 1997).

use std::f64::consts::{FRAC_PI_4, TAU};

/// The shape of the lens's opening; lengths are fractions of its circle's radius.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ApertureShape {
    /// The whole disk.
    #[default]
    Disk,
    /// A regular polygon with its corners on the circle.
    Polygon {
        /// Number of corners, 3 to 1000: of fewer there is no such shape, of more no pattern of diffraction.
        blades: u32,
        /// Radians. 0: a corner at `+ey`; positive turns `+ey` toward `+ex`.
        rotation: f64,
    },
}

impl ApertureShape {
    /// The point `(u, v)`, `u` along `ex`, `v` along `ey`, of a point in the unit square: equal areas to equal areas,
    /// neighbours to neighbours.
    ///
    /// For a polygon the concentric map's disk is bent sector by sector: a circle becomes a polygon of its size, and
    /// along its side the place goes with the angle. A sector and its triangle are then both swept at a constant rate.
    pub fn from_square(&self, square: [f32; 2]) -> [f32; 2] {
        let Some((radius, angle)) = polar_from_square(square) else { return [0.0, 0.0] };
        let point = match *self {
            Self::Disk => {
                let (sine, cosine) = libm::sincos(angle);
                [cosine, sine]
            }
            Self::Polygon { blades, rotation } => {
                // Of a negative radius the opposite place; corners stay at their angles.
                let (sign, angle) = if radius < 0.0 { (-1.0, angle + 0.5 * TAU) } else { (1.0, angle) };
                let turn = (0.25 * TAU - rotation - angle) / TAU * f64::from(blades);
                let first = turn.floor();
                let [a, b] = [first, first + 1.0].map(|corner| corner_at(blades, rotation, corner));
                let share = turn - first;
                [sign * (a[0] + (b[0] - a[0]) * share), sign * (a[1] + (b[1] - a[1]) * share)]
            }
        };
        point.map(|c| (radius * c) as f32)
    }

    /// The corners of a polygon, the first at `rotation`, going from `ey` toward `ex`; none of a disk.
    pub fn corners(&self) -> Vec<[f64; 2]> {
        match *self {
            Self::Disk => Vec::new(),
            Self::Polygon { blades, rotation } => {
                (0..blades).map(|k| corner_at(blades, rotation, f64::from(k))).collect()
            }
        }
    }

    /// Its area over that of the square of the radius.
    pub fn area(&self) -> f64 {
        match *self {
            Self::Disk => 0.5 * TAU,
            Self::Polygon { blades, .. } => {
                let n = f64::from(blades);
                0.5 * n * libm::sin(TAU / n)
            }
        }
    }
}

/// Corner number `k` of a polygon, any whole number.
fn corner_at(blades: u32, rotation: f64, k: f64) -> [f64; 2] {
    let n = f64::from(blades);
    // Within one turn, so that corner 0 and corner n are the same bits.
    let (sine, cosine) = libm::sincos(rotation + TAU * ((k - n * (k / n).floor()) / n));
    [sine, cosine]
}

/// The concentric map of P. Shirley and K. Chiu (J. Graphics Tools 2(3), 1997): the unit square to the
/// unit disk, equal areas to equal areas, neighbours to neighbours.
pub fn disk_from_square(square: [f32; 2]) -> [f32; 2] {
    ApertureShape::Disk.from_square(square)
}

/// Radius, of either sign, and angle; nothing for the centre.
fn polar_from_square(square: [f32; 2]) -> Option<(f64, f64)> {
    let a = 2.0 * f64::from(square[0]) - 1.0;
    let b = 2.0 * f64::from(square[1]) - 1.0;
    if a == 0.0 && b == 0.0 {
        return None;
    }
    Some(if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_4 * (2.0 - a / b)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_areas_go_to_equal_areas() {
        // Count a grid of the square by rings and sectors of the disk of equal area.
        let n = 2048;
        let mut ring = [0u32; 8];
        let mut sector = [0u32; 8];
        for i in 0..n {
            for j in 0..n {
                let [u, v] = disk_from_square([(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32]);
                let r2 = f64::from(u * u + v * v);
                assert!(r2 <= 1.000_001);
                ring[((r2 * 8.0) as usize).min(7)] += 1;
                let turn = libm::atan2(f64::from(v), f64::from(u)) / std::f64::consts::TAU + 0.5;
                sector[((turn * 8.0) as usize).min(7)] += 1;
            }
        }
        let want = f64::from(n * n) / 8.0;
        for count in ring.iter().chain(&sector) {
            assert!((f64::from(*count) / want - 1.0).abs() < 0.02, "{ring:?} {sector:?}");
        }
    }

    fn shapes() -> Vec<ApertureShape> {
        [(3, 0.0), (4, 0.3), (5, 0.2), (6, -1.0), (7, 0.0), (11, 9.0), (64, 0.1)]
            .map(|(blades, rotation)| ApertureShape::Polygon { blades, rotation })
            .to_vec()
    }

    /// Twice the area of a triangle, signed.
    fn twice([a, b, c]: [[f64; 2]; 3]) -> f64 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    #[test]
    fn a_polygons_corners_stand_where_the_contract_says() {
        let top = ApertureShape::Polygon { blades: 5, rotation: 0.0 }.corners();
        assert!(top[0][0].abs() < 1e-15 && (top[0][1] - 1.0).abs() < 1e-15);
        let turned = ApertureShape::Polygon { blades: 4, rotation: 0.1 }.corners();
        assert!(turned[0][0] > 0.0, "positive turns +ey toward +ex");
        for shape in shapes() {
            let corners = shape.corners();
            let n = corners.len();
            let area: f64 =
                (0..n).map(|i| -0.5 * twice([[0.0, 0.0], corners[i], corners[(i + 1) % n]])).sum();
            assert!((area - shape.area()).abs() < 1e-12);
        }
    }

    #[test]
    fn small_cells_of_the_square_keep_their_area_in_a_polygon() {
        // Area and orientation of a cell's image from its corners: exact but where a corner's ray or a diagonal of
        // the square cuts the cell.
        let n = 512;
        for shape in shapes() {
            let at =
                |i: i32, j: i32| shape.from_square([i as f32 / n as f32, j as f32 / n as f32]).map(f64::from);
            let want = shape.area() / f64::from(n * n);
            let (mut off, mut total) = (0, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    let area = 0.5 * (twice([a, b, c]) + twice([a, c, d]));
                    assert!(area > 0.0, "{shape:?} folds over at {i} {j}");
                    off += i32::from((area / want - 1.0).abs() > 0.03);
                    total += area;
                }
            }
            assert!((total / shape.area() - 1.0).abs() < 1e-4, "{shape:?}: {total}");
            assert!(f64::from(off) < 0.03 * f64::from(n * n), "{shape:?}: {off} cells are off");
        }
    }

    #[test]
    fn the_density_in_a_polygon_is_uniform_and_symmetric() {
        for shape in shapes() {
            let corners = shape.corners();
            let n = corners.len();
            // Per sector, cells of equal area: by the size of the polygon through a point, and the place on its side.
            let side = 2048;
            let mut counts = vec![0u32; n * 16];
            let mut mean = [0.0; 2];
            for i in 0..side * side {
                let square = [i % side, i / side].map(|c| (c as f32 + 0.5) / side as f32);
                let p = shape.from_square(square).map(f64::from);
                mean = [mean[0] + p[0], mean[1] + p[1]];
                let sector = (0..n).find_map(|k| {
                    let (a, b) = (corners[k], corners[(k + 1) % n]);
                    let whole = twice([[0.0; 2], a, b]);
                    let x = twice([[0.0; 2], p, b]) / whole;
                    let y = twice([[0.0; 2], a, p]) / whole;
                    (x >= 0.0 && y >= 0.0 && x + y > 0.0).then_some((k, x + y, y / (x + y)))
                });
                let Some((k, size, along)) = sector else { continue };
                assert!(size < 1.0 + 1e-6, "{shape:?}: {p:?} lies outside");
                let ring = ((size * size * 4.0) as usize).min(3);
                counts[k * 16 + ring * 4 + ((along * 4.0) as usize).min(3)] += 1;
            }
            let want = f64::from(side * side) / counts.len() as f64;
            let worst = counts.iter().map(|&c| (f64::from(c) / want - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < 0.05, "{shape:?}: a cell holds {worst} more or less than its share");
            let center = libm::hypot(mean[0], mean[1]) / f64::from(side * side);
            assert!(center < 1e-4, "{shape:?}: the mean is {center} off the centre");
        }
    }
}
