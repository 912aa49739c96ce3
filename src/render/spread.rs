//! Over which blocks of the picture the light of a small surface is spread. In: a region of the picture, an ellipse. Out: the
//! part of each block that it covers, for [`super::highlights`].
//!
//! Of an ellipse with the half-axes `M` the moments `M M^T` add where one spread follows another; at `y` from its middle it is
//! covered from `m - h` to `m + h`, `m = y M_xy / M_yy`, `h = sqrt(det / M_yy (1 - y^2 / M_yy))`, of the matrix `M M^T`.

use crate::picture::BLOCK;
use glam::{DMat2, DVec2};
use std::f64::consts::PI;

/// An ellipse of even light that stands for any spread of it: same centre, same area, same second moments.
///
/// Second moments add where one spread follows another, so shape, blur, and the pixel's own square need no
/// convolution. An ellipse with the half-axes `M` has the covariance `M M^T / 4`; this keeps `M M^T`. Pixels.
#[derive(Clone, Copy)]
pub(super) struct Spread {
    center: DVec2,
    moments: DMat2,
}

/// `a a^T`.
fn outer(a: DVec2) -> DMat2 {
    DMat2::from_cols(a * a.x, a * a.y)
}

impl Spread {
    /// A triangle in the picture, as pixels see it.
    pub(super) fn of(triangle: [DVec2; 3]) -> Self {
        let center = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        // A triangle's covariance is a twelfth of that of its corners, a pixel's square has 1/12.
        let corners = triangle.map(|corner| outer(corner - center));
        let moments = (corners[0] + corners[1] + corners[2] + DMat2::IDENTITY) * (4.0 / 12.0);
        Self { center, moments }
    }

    /// Several, each with so much light, as one.
    pub(super) fn together(parts: &[(f64, Self)]) -> Self {
        let all: f64 = parts.iter().map(|(light, _)| light).sum();
        let center = parts.iter().map(|(light, spread)| spread.center * (light / all)).sum::<DVec2>();
        // The covariance of their centres is a quarter of what is kept, too.
        let moments = parts
            .iter()
            .map(|(light, spread)| (spread.moments + outer(spread.center - center) * 4.0) * (light / all));
        Self { center, moments: moments.fold(DMat2::ZERO, |sum, part| sum + part) }
    }

    /// Where it lies, in squares about as wide as it is spread: two in the same square are hardly to be told apart.
    pub(super) fn square(&self) -> (i64, i64, i64) {
        let size = libm::log2(self.area().max(1.0)).round() * 0.5;
        let side = libm::exp2(size);
        ((2.0 * size) as i64, (self.center.x / side).floor() as i64, (self.center.y / side).floor() as i64)
    }

    /// Spread again over an ellipse with these half-axes.
    pub(super) fn over(self, axes: [DVec2; 2]) -> Self {
        Self { moments: self.moments + outer(axes[0]) + outer(axes[1]), ..self }
    }

    /// Square pixels.
    pub(super) fn area(&self) -> f64 {
        PI * self.moments.determinant().max(0.0).sqrt()
    }

    /// How far it goes from its centre at most, to the right and down.
    fn reach(&self) -> DVec2 {
        DVec2::new(self.moments.x_axis.x.sqrt(), self.moments.y_axis.y.sqrt())
    }

    /// Tells, for each row of blocks that it covers within `size` pixels, the part of a block, as changes from
    /// block to block: `change(row, column, by)`.
    pub(super) fn cover(&self, size: [u32; 2], mut change: impl FnMut(usize, usize, f64)) {
        let (reach, width) = (self.reach(), f64::from(size[0]));
        let last = self.center.y + reach.y - 0.5;
        if !(self.center + reach).is_finite() || last < 0.0 || reach.y <= 0.0 {
            return;
        }
        let block = f64::from(BLOCK);
        let slope = self.moments.x_axis.y / self.moments.y_axis.y;
        let half = (self.moments.determinant().max(0.0) / self.moments.y_axis.y).sqrt();
        let first = (self.center.y - reach.y - 0.5).ceil().max(0.0);
        if first >= f64::from(size[1]) {
            return;
        }
        for row in first as u32..=(last as u32).min(size[1] - 1) {
            let y = f64::from(row) + 0.5 - self.center.y;
            let inside = half * (1.0 - y * y / (reach.y * reach.y)).max(0.0).sqrt();
            let middle = self.center.x + slope * y;
            let [left, right] = [middle - inside, middle + inside].map(|x| x.clamp(0.0, width) / block);
            // From `left` on blocks are covered, from `right` on no longer: the block of each is covered in part.
            for (at, sign) in [(left, 1.0), (right, -1.0)] {
                let part = (1.0 - at.fract()) / block;
                change((row / BLOCK) as usize, at as usize, sign * part);
                change((row / BLOCK) as usize, at as usize + 1, sign * (1.0 / block - part));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_covers_its_area_and_no_more() {
        let triangle = [DVec2::new(60.0, 40.0), DVec2::new(62.0, 40.0), DVec2::new(60.0, 43.0)];
        let size = [160, 96];
        for axes in [[DVec2::ZERO; 2], [DVec2::new(9.0, 4.0), DVec2::new(-3.0, 7.0)]] {
            let spread = Spread::of(triangle).over(axes);
            let mut blocks = vec![[0.0f64; 23]; 12];
            spread.cover(size, |row, column, by| blocks[row][column] += by);
            let (mut all, mut moment) = (0.0, 0.0);
            for row in &blocks {
                let mut part = 0.0;
                for (column, change) in row.iter().enumerate() {
                    part += change;
                    assert!((-1e-12..1.0 + 1e-12).contains(&part));
                    all += 64.0 * part;
                    moment += 64.0 * part * 8.0 * (column as f64 + 0.5);
                }
            }
            // Rows of pixels cut it, so a small one is off by more.
            assert!((all / spread.area() - 1.0).abs() < 0.2, "{all} for {}", spread.area());
            assert!((moment / all - spread.center.x).abs() < 4.0);
        }
        // A disk of diameter 40 as it is: half-axes 20 and hardly more.
        let disk = Spread::of([DVec2::splat(50.0); 3]).over([DVec2::X * 20.0, DVec2::Y * 20.0]);
        assert!((disk.area() / (PI * 400.0) - 1.0).abs() < 1e-3);
        // What lies outside is cut off.
        let mut sum = 0.0;
        Spread::of([DVec2::new(-500.0, 9.0); 3]).cover(size, |_, _, by| sum += by);
        assert_eq!(sum, 0.0);
    }
}
