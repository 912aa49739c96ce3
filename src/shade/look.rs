//! One surface in one tile, ready to shade: texture coordinates and normal as bilinear functions of lens point and place, like
//! the edge functions that they are sums of.
//!
//! In: the corners of the triangle that stands for the surface, with what they have ([`LookParts`], from `render::looks`), and
//! its edge functions `e_i` (`raster::film`). Out: a [`Look`], for [`super::run`], [`super::shadowed`] and [`super::cutout`].
//! What is `a_i` at corner `i`, opposite to edge `i`, is `(sum a_i e_i) / (sum e_i)` between them: kept are the nine coefficients
//! of `sum a_i e_i`, and for texture coordinates of `sum e_i`.

use super::mip_level::Anchor;
use super::rays::{Places, Rays};
use super::sun::SurfacePlane;
use crate::scene::Mapping;
use fearless_simd::{Simd, SimdBase, SimdMask, f32x16};
use glam::{DVec2, DVec3, DVec4, Vec3, Vec4};

/// Coefficients of `1, u, v, x, xu, xv, y, yu, yv`, four functions side by side.
pub(crate) type Bilinear4 = [Vec4; 9];

/// Texture coordinates right and down from an anchor, and 1, each times the sum of the edge functions.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub functions: Bilinear4,
    pub anchor: Anchor,
}

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    pub material: u32,
    /// Where its textures lie.
    pub texture: Option<Placed>,
    /// Where `map_d` lies by itself: seldom.
    pub opacity: Option<Box<Placed>>,
    /// The normal times that sum; for flat triangles `face` counts.
    pub normal: Option<Bilinear4>,
    pub face: Vec3,
    /// The light on the side of `face`, and on the other.
    pub lit: [Vec3; 2],
    /// Where the surface lies; with shadows only.
    pub plane: Option<SurfacePlane>,
}

/// What a look is made of, as it lies in the scene.
pub(crate) struct LookParts {
    /// The triangle that stands for the surface.
    pub triangle: u32,
    pub material: u32,
    /// Its corners in the lens frame, and those of a triangle of the surface that may be seen.
    pub corners: [DVec3; 3],
    pub seen: [DVec3; 3],
    /// Texture coordinates of the corners, where a texture shows, and normals, where it has some.
    pub texcoords: Option<[DVec2; 3]>,
    pub normals: Option<[Vec3; 3]>,
    /// Where `map_d` lies by them, if elsewhere.
    pub opacity: Option<Mapping>,
}

impl LookParts {
    /// Whether it looks different in different places.
    pub(super) fn vary(&self) -> bool {
        self.texcoords.is_some() || self.normals.is_some_and(|[a, b, c]| a != b || b != c)
    }

    /// Square to the triangle, of any length.
    fn across(&self) -> DVec3 {
        (self.corners[1] - self.corners[0]).cross(self.corners[2] - self.corners[0])
    }

    /// The texture coordinates between which the triangle that is seen has its own.
    fn range(&self, uv: [DVec2; 3]) -> [DVec2; 2] {
        if self.seen == self.corners {
            return [uv[0].min(uv[1]).min(uv[2]), uv[0].max(uv[1]).max(uv[2])];
        }
        let across = self.across();
        let at = self.seen.map(|p| {
            let weight = |i: usize| {
                let (a, b) = (self.corners[(i + 1) % 3] - p, self.corners[(i + 2) % 3] - p);
                a.cross(b).dot(across) / across.length_squared()
            };
            let at = uv[0] * weight(0) + uv[1] * weight(1) + uv[2] * weight(2);
            if at.is_finite() { at } else { uv[0] }
        });
        [at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2])]
    }
}

impl Look {
    /// From the edge functions about the tile's centre of the triangle that stands for the surface.
    pub(crate) fn new(edges: &[[f64; 9]; 3], parts: &LookParts) -> Self {
        let sum = |corner: [DVec4; 3]| -> Bilinear4 {
            std::array::from_fn(|k| {
                (corner[0] * edges[0][k] + corner[1] * edges[1][k] + corner[2] * edges[2][k]).as_vec4()
            })
        };
        let &LookParts { material, texcoords, normals, opacity, .. } = parts;
        let placed = |t: [DVec2; 3]| {
            let weights = DVec3::new(edges[0][0], edges[1][0], edges[2][0]);
            let center = (t[0] * weights.x + t[1] * weights.y + t[2] * weights.z) / weights.element_sum();
            let [low, high] = parts.range(t);
            let center = if center.is_finite() { center.clamp(low, high) } else { low };
            // Down is against v. A 256th is exact in single precision, and so is what is left of the corners.
            let start = (DVec2::new(center.x, 1.0 - center.y) * 256.0).round();
            let anchor = (start - (start / 256.0).floor() * 256.0).to_array().map(|part| part as u32 & 255);
            let start = start / 256.0;
            let functions = sum(t.map(|uv| DVec4::new(uv.x - start.x, (1.0 - uv.y) - start.y, 1.0, 0.0)));
            Placed { functions, anchor }
        };
        let elsewhere = |mapping: Mapping| Some(Box::new(placed(texcoords?.map(|uv| mapping.at(uv)))));
        // Equal normals make a flat triangle: nothing to interpolate.
        let flat = normals.filter(|[a, b, c]| a == b && b == c);
        Self {
            material,
            texture: texcoords.map(placed),
            opacity: opacity.and_then(elsewhere),
            normal: normals.filter(|_| flat.is_none()).map(|n| sum(n.map(|n| n.as_dvec3().extend(0.0)))),
            face: match flat {
                Some([n, ..]) => n,
                None => crate::camera::unit(parts.across()).unwrap_or(DVec3::Z).as_vec3(),
            },
            lit: [Vec3::ZERO; 2],
            plane: None,
        }
    }

    /// Which of 16 places see the back of a flat surface of which all samples see one side.
    #[inline(always)]
    pub(super) fn away<S: Simd>(&self, simd: S, rays: &Rays, at: &Places<S>) -> u16 {
        let [rx, ry, rz] = rays.at_all(simd, at);
        let face = self.face;
        (rx * face.x + ry * face.y + rz * face.z).simd_gt(f32x16::splat(simd, 0.0)).to_bitmask() as u16
    }

    /// Whether it is flat, and lit otherwise on one side than on the other.
    pub(crate) fn sides_differ(&self) -> bool {
        self.normal.is_none() && self.lit[0] != self.lit[1]
    }

    /// Of a flat surface only the side of `face` is seen, or (`is_away`) only the other.
    pub(crate) fn show(&mut self, is_away: bool) {
        self.lit = [self.lit[usize::from(is_away)]; 2];
    }

    /// Has each sample see for itself which side of a flat surface it looks at, as where normals are interpolated.
    pub(crate) fn light_each(&mut self) {
        let mut normal = [Vec4::ZERO; 9];
        normal[0] = self.face.extend(0.0);
        self.normal = Some(normal);
    }
}
