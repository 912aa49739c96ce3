//! The aperture: from the unit square to the unit disk, area for area.

use std::f64::consts::FRAC_PI_4;

/// The concentric map of P. Shirley and K. Chiu (J. Graphics Tools 2(3), 1997): the unit square to the
/// unit disk, equal areas to equal areas, neighbours to neighbours.
pub fn disk_from_square(square: [f32; 2]) -> [f32; 2] {
    let a = 2.0 * f64::from(square[0]) - 1.0;
    let b = 2.0 * f64::from(square[1]) - 1.0;
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    let (radius, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_4 * (2.0 - a / b)) };
    let (sine, cosine) = libm::sincos(angle);
    [(radius * cosine) as f32, (radius * sine) as f32]
}

/// Which of `cells` (a power of two) equal rectangles of the unit square a point lies in. The rectangles
/// are elementary intervals, as square as can be.
pub fn square_cell(square: [f32; 2], cells: u32) -> usize {
    let bits = cells.trailing_zeros();
    let across = 1u32 << bits.div_ceil(2);
    let down = 1u32 << (bits / 2);
    let column = ((square[0] * across as f32) as u32).min(across - 1);
    let row = ((square[1] * down as f32) as u32).min(down - 1);
    (row * across + column) as usize
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
}
