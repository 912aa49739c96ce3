//! The sun of one picture: its frame, its disk, and what stands before it as one surface sees it.
//!
//! In: rays to the sun from places of one surface, of [`super::shadowed`]. Out: which of them it does not reach. What they cross
//! comes from [`super::shadows`]; nothing is stopped by the lit surface itself, by what does not reach beyond its plane, where
//! alpha is below a half, or, by chance, where coverage is below 1. A point of the unit square, mapped to the disk at the
//! distance `r` from its middle, is the direction with `cos = 1 - r^2 (1 - cos a)` from the sun's centre, `a` being the sun's
//! angular radius.

use super::mip_level::Choice;
use super::shadows::{Occluders, SunRays, Weights};
use crate::raster::LANES;
use crate::sampling::{chance, hash};
use crate::scene::{Material, NONE, Sun, Surfaces};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, f32x16};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// The sun as shadows need it.
pub(crate) struct ShadowSun<'a> {
    surfaces: &'a Surfaces,
    materials: &'a [Material],
    /// Lens frame.
    positions: &'a [DVec3],
    occluders: Occluders,
    /// The sun frame's axes in the lens frame.
    axes: [DVec3; 3],
    /// 1 less the cosine of the disk's angular radius; 0 for a point.
    one_minus_cos: f32,
}

/// The plane of a surface in one tile: where the samples meet it, and what it is for what may shade it.
#[derive(Clone, Debug)]
pub(crate) struct SurfacePlane {
    /// `1/t` of the rays is `facing / distance`: about the tile's centre, as the rasterizer has them.
    pub facing: [f32; 9],
    pub distance: [f32; 3],
    /// A point of it and its unit normal, lens frame.
    pub origin: DVec3,
    pub normal: DVec3,
    /// The patch of the triangle that stands for it.
    pub patch: u32,
}

/// Which rays a packet holds, for what is decided ray by ray.
pub(super) struct Asking<'q> {
    pub plane: &'q SurfacePlane,
    /// Lanes that leave the surface on the side of its normal.
    pub above: u16,
    /// Names each lane's pixel, and the number of its sample.
    pub keys: &'q [u64; LANES],
    pub index: &'q [u32; LANES],
}

impl<'a> ShadowSun<'a> {
    /// Nothing for a sun without a direction. `lens_from_world` turns directions.
    pub(crate) fn new(
        (surfaces, materials): (&'a Surfaces, &'a [Material]),
        positions: &'a [DVec3],
        sun: &Sun,
        lens_from_world: impl Fn(DVec3) -> DVec3,
    ) -> Option<Self> {
        let toward = crate::camera::unit(lens_from_world(sun.toward))?;
        let (x, y) = toward.any_orthonormal_pair();
        let axes = [x, y, toward];
        let occluders = Occluders::new(surfaces, positions, axes);
        let half = libm::sin(0.25 * sun.angular_diameter.as_radians());
        Some(Self {
            surfaces,
            materials,
            positions,
            occluders,
            axes,
            one_minus_cos: (2.0 * half * half) as f32,
        })
    }

    /// 1 less the cosine of the disk's angular radius.
    pub(super) fn one_minus_cos(&self) -> f32 {
        self.one_minus_cos
    }

    /// Whether it has a disk.
    pub(crate) fn is_soft(&self) -> bool {
        self.one_minus_cos > 0.0
    }

    /// The rows that turn the lens frame to the sun's.
    pub(super) fn rows(&self) -> [Vec3; 3] {
        self.axes.map(DVec3::as_vec3)
    }

    /// The flat patch of a triangle; itself where patches may be thick.
    fn patch(&self, t: u32) -> u32 {
        let patches = &self.surfaces.patches;
        if patches.are_flat() { patches.of(t).0 } else { t }
    }

    /// The plane of the surface that triangle `t` stands for.
    pub(crate) fn plane(&self, t: u32, (facing, distance): ([f32; 9], [f32; 3])) -> SurfacePlane {
        let [a, b, c] = self.surfaces.triangles[t as usize].map(|i| self.positions[i as usize]);
        SurfacePlane {
            facing,
            distance,
            origin: a,
            normal: crate::camera::unit((b - a).cross(c - a)).unwrap_or(DVec3::Z),
            patch: self.patch(t),
        }
    }

    /// The lanes of `alive` whose rays do not reach the sun.
    pub(super) fn stopped(
        &self,
        level: Level,
        rays: &SunRays,
        alive: u16,
        last: &mut u32,
        asking: &Asking<'_>,
    ) -> u16 {
        let from =
            |lane: usize| DVec3::from_array([0, 1, 2].map(|axis: usize| f64::from(rays.from[axis][lane])));
        let far: [f64; LANES] = std::array::from_fn(|lane| from(lane).length());
        let stops =
            |triangle: u32, lanes: u16, weights: &Weights| self.stops(triangle, lanes, weights, &far, asking);
        self.occluders.stopped(level, rays, !self.is_soft(), alive, last, &stops)
    }

    /// The part of a `triangle` that solid surfaces leave in the light of the sun's middle, about: sixteen rays, for what is said of lights
    /// that no sample has met.
    pub(crate) fn reaches(&self, level: Level, triangle: u32) -> f64 {
        let corners = self.surfaces.triangles[triangle as usize].map(|i| self.positions[i as usize]);
        let mut rays = SunRays::default();
        for lane in 0..LANES {
            // Four rows, each point in a sixteenth of the triangle.
            let row = lane.isqrt();
            let (column, row) = ((lane - row * row) as f64, row as f64);
            let down = (row + 0.6) / 4.0;
            let across = (column + 0.5) / (2.0 * row + 1.0);
            let from = corners[0].lerp(corners[1].lerp(corners[2], across), down);
            for (axis, to) in self.axes.iter().enumerate() {
                rays.from[axis][lane] = to.dot(from) as f32;
            }
        }
        let stops = |t: u32, lanes: u16, _: &Weights| {
            let attributes = &self.surfaces.attributes[t as usize];
            let is_solid = !self.materials[attributes.material as usize].is_cutout();
            if is_solid && self.patch(t) != self.patch(triangle) { lanes } else { 0 }
        };
        let mut first = u32::MAX;
        let stopped = self.occluders.stopped(level, &rays, true, 0xffff, &mut first, &stops);
        f64::from(LANES as u32 - stopped.count_ones()) / LANES as f64
    }

    /// The lanes of `lanes`, which begin so `far` from the lens and cross triangle `t`, that it stops. Each by itself: what others are
    /// still asked about depends on what stopped rays before, and so on what a thread drew before.
    fn stops(&self, t: u32, lanes: u16, weights: &Weights, far: &[f64; LANES], asking: &Asking<'_>) -> u16 {
        if self.patch(t) == asking.plane.patch {
            return 0;
        }
        // A surface that does not reach beyond the plane of the one that is lit cannot stand before the sun: it is
        // the same surface again, or its neighbour on a bulge. "Beyond" means by more than the places are wrong.
        let corners = self.surfaces.triangles[t as usize].map(|i| self.positions[i as usize]);
        let rise = corners.map(|corner| asking.plane.normal.dot(corner - asking.plane.origin));
        let reach = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
        let (low, high) = (rise[0].min(rise[1]).min(rise[2]), rise[0].max(rise[1]).max(rise[2]));
        let (mut rest, mut lanes) = (lanes, lanes);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let beyond = if asking.above >> lane & 1 == 1 { high } else { -low };
            lanes &= !(u16::from(beyond <= ROUNDING * reach.max(far[lane])) << lane);
        }
        let attributes = &self.surfaces.attributes[t as usize];
        let material = &self.materials[attributes.material as usize];
        if lanes != 0 && material.is_cutout() {
            lanes = self.solid(t, material, lanes, weights, asking);
        }
        lanes
    }

    /// As the eye's rays pass holes and coverage, so do the sun's: alpha interpolated in the finest level, for there is
    /// no footprint; coverage by chance, each surface and each sample by itself.
    fn solid(&self, t: u32, material: &Material, lanes: u16, weights: &Weights, asking: &Asking<'_>) -> u16 {
        let attributes = &self.surfaces.attributes[t as usize];
        let uv = (attributes.texcoords[0] != NONE && material.holed_maps().next().is_some())
            .then(|| attributes.texcoords.map(|i| self.surfaces.texcoords[i as usize].as_dvec2()));
        let mut solid = lanes;
        let mut rest = lanes;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let passes = uv.is_some_and(|[a, b, c]| {
                let [u, v, w] = [0, 1, 2].map(|i: usize| f64::from(weights[i][lane]));
                is_hole(material, (a * u + b * v + c * w) / (u + v + w))
            }) || (material.coverage < 1.0 && {
                let key = hash(hash(asking.keys[lane], SUNWARD), u64::from(t));
                chance(asking.index[lane], key) >= material.coverage
            });
            solid &= !(u16::from(passes) << lane);
        }
        solid
    }
}

/// How far from a plane single precision may have put a place, and a file's six digits a corner, over their
/// distance from the lens.
const ROUNDING: f64 = 1e-6;

/// Keeps the choices of the sun's rays apart from those of the eye's.
const SUNWARD: u64 = 0x5u64 << 60;

/// Whether light passes at these texture coordinates.
fn is_hole(material: &Material, uv: DVec2) -> bool {
    material.holed_maps().any(|(map, mapping)| {
        // Right and down from the left top corner, without whole turns.
        let uv = mapping.at(uv);
        let at = DVec2::new(uv.x, 1.0 - uv.y);
        let at = (at - at.floor()).as_vec2();
        Choice::alpha(map, 0, [0, 0]).is_some_and(|choice| choice.read(Vec2::new(at.x, at.y)).w < 0.5)
    })
}

/// Directions in the sun's disk, uniform in solid angle, in the sun frame, of points of the unit square:
/// [`crate::sampling::cone_direction`] sixteenfold.
#[inline(always)]
pub(super) fn directions<S: Simd>(simd: S, one_minus_cos: f32, square: &[[f32; LANES]; 2]) -> [f32x16<S>; 3] {
    // The concentric map, as in `sampling::aperture`.
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, 1.0);
    let a = f32x16::load_array_ref(simd, &square[0]) * 2.0 - 1.0;
    let b = f32x16::load_array_ref(simd, &square[1]) * 2.0 - 1.0;
    let wide = a.abs().simd_gt(b.abs());
    let (radius, less) = (wide.select(a, b), wide.select(b, a));
    let angle = radius.simd_ne(zero).select(less / radius, zero) * std::f32::consts::FRAC_PI_4;
    // Taylor's series: the next terms are below 4e-7 at a quarter of a half turn.
    let q = angle * angle;
    let sine = angle * (one - q * (1.0 / 6.0) * (one - q * (1.0 / 20.0) * (one - q * (1.0 / 42.0))));
    let cosine =
        one - q * 0.5 * (one - q * (1.0 / 12.0) * (one - q * (1.0 / 30.0) * (one - q * (1.0 / 56.0))));
    let (x, y) = (wide.select(cosine, sine) * radius, wide.select(sine, cosine) * radius);
    // The height above the disk's rim is uniform: 1 - cos = r^2 (1 - cos of the rim).
    let less = radius * radius * one_minus_cos;
    let out = ((zero - less + 2.0) * one_minus_cos).sqrt();
    [x * out, y * out, one - less]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::cone_direction;
    use crate::scene::Attributes;
    use crate::simd::{SimdLevel, at_level};

    /// A sheet 11 micrometres above what is lit: seen from 12.3 m that is as much as places are wrong, from 10.5 m it is more.
    #[test]
    fn what_stops_a_ray_does_not_depend_on_what_others_are_asked() {
        let height = 1.1e-5;
        let positions =
            [[5.0, height, -9.5], [9.5, height, -5.0], [9.5, height, -9.5]].map(DVec3::from_array);
        let surfaces = Surfaces {
            positions: positions.to_vec(),
            triangles: vec![[0, 1, 2]],
            attributes: vec![Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material: 0 }],
            ..Surfaces::default()
        };
        let materials = [Material::default_surface()];
        let sun =
            Sun { toward: DVec3::Y, color: DVec3::ONE, shadows: true, angular_diameter: Default::default() };
        let sun = ShadowSun::new((&surfaces, &materials), &positions, &sun, |v| v).unwrap();
        let mut rays = SunRays::default();
        for (lane, at) in [8.7, 7.42].into_iter().enumerate() {
            let from = DVec3::new(at, 0.0, -at);
            for (axis, way) in sun.axes.into_iter().enumerate() {
                rays.from[axis][lane] = way.dot(from) as f32;
            }
        }
        let plane = SurfacePlane {
            facing: [0.0; 9],
            distance: [0.0; 3],
            origin: DVec3::ZERO,
            normal: DVec3::Y,
            patch: 7,
        };
        let asking = Asking { plane: &plane, above: 0b11, keys: &[0; LANES], index: &[0; LANES] };
        let stopped =
            |alive: u16| sun.stopped(SimdLevel::best().level(), &rays, alive, &mut u32::MAX.clone(), &asking);
        assert_eq!([0b01, 0b10, 0b11].map(stopped), [0b00, 0b10, 0b10]);
    }

    #[test]
    fn sixteen_directions_equal_single_ones() {
        for degrees in [0.5, 30.0, 90.0_f64] {
            let half = libm::sin(0.5 * degrees.to_radians());
            for start in 0..40 {
                let place = |i: usize, by: usize| ((start * LANES + i) * by % 641) as f32 / 641.0;
                let square = [std::array::from_fn(|i| place(i, 97)), std::array::from_fn(|i| place(i, 211))];
                let one_minus_cos = (2.0 * half * half) as f32;
                let [x, y, z] = at_level!(SimdLevel::best().level(), simd => {
                    directions(simd, one_minus_cos, &square).map(|c| c.to_array())
                });
                for i in 0..LANES {
                    let want = cone_direction([square[0][i], square[1][i]], degrees.to_radians());
                    for (found, want) in [x[i], y[i], z[i]].into_iter().zip(want) {
                        assert!((f64::from(found) - want).abs() < 1e-6, "{found} {want}");
                    }
                }
            }
        }
    }
}
