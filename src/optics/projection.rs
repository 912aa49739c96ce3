//! One perspective projection for each lens point, affine in that point, and the ray it stands for.

use super::Optics;
use glam::{DMat4, DVec3, DVec4};

/// A clip matrix: `clip = M (x, y, z, 1)`, `x/w` in -1..1 left to right, `y/w` bottom to top, `z` = near
/// (reversed depth: 1 at `w = near`, 0 at infinity).
///
/// P. Haeberli and K. Akeley, "The accumulation buffer", SIGGRAPH 1990, and B. A. Barsky and E. Pasztor,
/// "Rendering skewed plane of sharp focus and associated depth of field", SIGGRAPH 2004 sketches, draw one
/// picture with one such matrix for each lens point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// The rows of the matrix.
    pub rows: [DVec4; 4],
}

impl Projection {
    /// As a glam matrix (columns).
    pub fn matrix(&self) -> DMat4 {
        DMat4::from_cols(self.rows[0], self.rows[1], self.rows[2], self.rows[3]).transpose()
    }

    /// The clip coordinates of a point.
    pub fn project(&self, point: DVec3) -> DVec4 {
        let p = point.extend(1.0);
        DVec4::new(self.rows[0].dot(p), self.rows[1].dot(p), self.rows[2].dot(p), self.rows[3].dot(p))
    }
}

/// A ray from a lens point into the scene, in lens space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The lens point.
    pub origin: DVec3,
    /// Toward the scene, not unit: its component along the lens axis is the film point's distance
    /// behind the lens plane.
    pub direction: DVec3,
}

impl Optics {
    /// The projection through the lens point `u ex + v ey` (metres) of points in lens space.
    ///
    /// Its `w` is `w_s(X) = n.(s - x) - (n.s)(a.x)/f`.
    pub fn projection(&self, u: f64, v: f64) -> Projection {
        let s = self.lens_point(u, v);
        let focus = self.focus_plane();
        let ns = self.n.dot(s);
        let w = (-self.n - (ns / self.f) * self.a).extend(ns);
        let row = |axis: DVec3, size: f64| {
            let (along_s, along_center) = (axis.dot(s), axis.dot(self.film_center));
            let q = ((ns + self.e) * axis - along_s * focus.m).extend(-along_s * focus.e);
            // The film is turned by half a turn to show the scene upright, hence the minus.
            (q - along_center * w) * (-2.0 / size)
        };
        let film = self.camera.film;
        Projection {
            rows: [
                row(self.fx, film.width.as_metres()),
                row(self.fy, film.height.as_metres()),
                DVec4::new(0.0, 0.0, 0.0, self.camera.near.as_metres()),
                w,
            ],
        }
    }

    /// [`Self::projection`] for points in world coordinates.
    pub fn projection_from_world(&self, u: f64, v: f64) -> Projection {
        let Projection { rows } = self.projection(u, v);
        let world = |row: DVec4| {
            let m = self.world.vector(row.truncate());
            m.extend(row.w - m.dot(self.world.origin))
        };
        Projection { rows: rows.map(world) }
    }

    /// The ray that meets the film at the point `(x, y)` (film frame, metres) and leaves the lens at
    /// `u ex + v ey` (metres): through the film point's conjugate `q`, which the thin lens makes the
    /// same for every lens point.
    pub fn ray(&self, u: f64, v: f64, x: f64, y: f64) -> Ray {
        let s = self.lens_point(u, v);
        let p = self.film_point(x, y);
        // q = (p, 1 + a.p/f); q_w s - q points forward whether q is real, virtual or at infinity.
        let weight = 1.0 + self.a.dot(p) / self.f;
        Ray { origin: s, direction: weight * s - p }
    }
}
