//! One triangle in one tile, ready to shade: texture coordinates and normal as bilinear functions of lens
//! point and place, like the edge functions that they are sums of.

use super::filter::Anchor;
use super::sun::SurfacePlane;
use glam::{DVec2, DVec3, DVec4, Vec3, Vec4};

/// Coefficients of `1, u, v, x, xu, xv, y, yu, yv`, four functions side by side.
pub(crate) type Bilinear4 = [Vec4; 9];

/// The cosine of two and a half degrees.
const NEARLY_FLAT: f32 = 0.999;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    pub material: u32,
    /// Texture coordinates right and down from `anchor`, and 1, each times the sum of the edge functions.
    pub texture: Option<Bilinear4>,
    pub anchor: Anchor,
    /// The normal times that sum; for flat triangles `face` counts.
    pub normal: Option<Bilinear4>,
    pub face: Vec3,
    /// Whether its normals differ so much that the light on it changes with what the texture shows.
    pub is_curved: bool,
    /// The light on the side of `face`, and on the other.
    pub lit: [Vec3; 2],
    /// Where the surface lies; with shadows only.
    pub plane: Option<SurfacePlane>,
}

impl Look {
    /// From the edge functions about the tile's centre. Texture coordinates are `u`, `v` of the corners; where
    /// the triangle is seen they lie between those of `range`.
    pub(crate) fn new(
        edges: &[[f64; 9]; 3],
        material: u32,
        texcoords: Option<[DVec2; 3]>,
        range: [DVec2; 2],
        normals: Option<[Vec3; 3]>,
        face: Vec3,
    ) -> Self {
        let sum = |corner: [DVec4; 3]| -> Bilinear4 {
            std::array::from_fn(|k| {
                (corner[0] * edges[0][k] + corner[1] * edges[1][k] + corner[2] * edges[2][k]).as_vec4()
            })
        };
        let mut anchor = [0; 2];
        let texture = texcoords.map(|t| {
            let weights = DVec3::new(edges[0][0], edges[1][0], edges[2][0]);
            let center = (t[0] * weights.x + t[1] * weights.y + t[2] * weights.z) / weights.element_sum();
            let center = if center.is_finite() { center.clamp(range[0], range[1]) } else { range[0] };
            // Down is against v. A 256th is exact in single precision, and so is what is left of the corners.
            let start = (DVec2::new(center.x, 1.0 - center.y) * 256.0).round();
            anchor = (start - (start / 256.0).floor() * 256.0).to_array().map(|part| part as u32 & 255);
            let start = start / 256.0;
            sum(t.map(|uv| DVec4::new(uv.x - start.x, (1.0 - uv.y) - start.y, 1.0, 0.0)))
        });
        // Equal normals make a flat triangle: nothing to interpolate.
        let flat = normals.is_some_and(|[a, b, c]| a == b && b == c);
        Self {
            material,
            texture,
            anchor,
            normal: if flat { None } else { normals.map(|n| sum(n.map(|n| n.as_dvec3().extend(0.0)))) },
            face: if let (true, Some(n)) = (flat, normals) { n[0] } else { face },
            is_curved: normals.is_some_and(|[a, b, c]| a.dot(b).min(b.dot(c)).min(c.dot(a)) < NEARLY_FLAT),
            lit: [Vec3::ZERO; 2],
            plane: None,
        }
    }
}
