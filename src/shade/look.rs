//! One triangle in one tile, ready to shade: texture coordinates and normal as bilinear functions of lens
//! point and place, like the edge functions that they are sums of.

use super::Place;
use super::filter::Footprint;
use crate::raster::setup::Setup;
use glam::{Vec2, Vec3, Vec4};

/// Coefficients of `1, u, v, x, xu, xv, y, yu, yv`, four functions side by side.
type Bilinear4 = [Vec4; 9];

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    pub material: u32,
    /// `u`, `v` and 1, each times the sum of the edge functions.
    texture: Option<Bilinear4>,
    /// The normal times that sum; for flat triangles `face` counts.
    normal: Option<Bilinear4>,
    pub face: Vec3,
    /// The light on the side of `face`, and on the other.
    pub lit: [Vec3; 2],
}

impl Look {
    pub(crate) fn new(
        setup: &Setup,
        material: u32,
        texcoords: Option<[Vec2; 3]>,
        normals: Option<[Vec3; 3]>,
        face: Vec3,
    ) -> Self {
        let sum = |corner: [Vec4; 3]| -> Bilinear4 {
            std::array::from_fn(|k| {
                corner[0] * setup.edges[0][k] + corner[1] * setup.edges[1][k] + corner[2] * setup.edges[2][k]
            })
        };
        let texture = texcoords.map(|t| {
            // Textures repeat: whole turns are dropped, so that large coordinates keep their digits.
            let base = t[0].floor();
            let base = if base.is_finite() { base } else { Vec2::ZERO };
            sum(t.map(|uv| (uv - base).extend(1.0).extend(0.0)))
        });
        // Equal normals make a flat triangle: nothing to interpolate.
        let flat = normals.is_some_and(|[a, b, c]| a == b && b == c);
        Self {
            material,
            texture,
            normal: if flat { None } else { normals.map(|n| sum(n.map(|n| n.extend(0.0)))) },
            face: if let (true, Some(n)) = (flat, normals) { n[0] } else { face },
            lit: [Vec3::ZERO; 2],
        }
    }

    /// The interpolated unit normal; `None` for a flat triangle.
    #[inline]
    pub(crate) fn normal(&self, place: Place) -> Option<Vec3> {
        let [c, cx, cy] = at_lens(self.normal.as_ref()?, place);
        let n = (c + cx * place.x + cy * place.y).truncate();
        let length = n.dot(n).sqrt();
        // The sum of the edge functions has the sign of the side that is seen, and so has the length.
        Some(if length > 0.0 && length.is_finite() { n / length } else { self.face })
    }

    /// Texture coordinates and how they change from pixel to pixel; `None` where there is no texture.
    #[inline]
    pub(crate) fn footprint(&self, place: Place) -> Option<Footprint> {
        let k = self.texture.as_ref()?;
        let [c, cx, cy] = at_lens(k, place);
        let at = c + cx * place.x + cy * place.y;
        let inverse = if at.z == 0.0 { 0.0 } else { 1.0 / at.z };
        let uv = Vec2::new(at.x, at.y) * inverse;
        let slope = |d: Vec4| (Vec2::new(d.x, d.y) - uv * d.z) * inverse;
        Some(Footprint { uv, dx: slope(cx), dy: slope(cy) })
    }

    /// Texture coordinates alone; the origin where there is no texture.
    #[inline]
    pub(crate) fn uv(&self, place: Place) -> Vec2 {
        let Some(k) = &self.texture else { return Vec2::ZERO };
        let [c, cx, cy] = at_lens(k, place);
        let at = c + cx * place.x + cy * place.y;
        if at.z == 0.0 { Vec2::ZERO } else { Vec2::new(at.x, at.y) / at.z }
    }
}

#[inline]
fn at_lens(k: &Bilinear4, Place { u, v, .. }: Place) -> [Vec4; 3] {
    [k[0] + k[1] * u + k[2] * v, k[3] + k[4] * u + k[5] * v, k[6] + k[7] * u + k[8] * v]
}
