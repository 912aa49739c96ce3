//! Shading of single samples, each a group of its own: where nothing is shared, as below 16 samples a pixel or with diffraction.
//!
//! In: a run of samples that see one surface in one tile, as groups, 16 at a time. Out: light added to their pixels, as in
//! [`super::run`], of one sample each: `Ke + Kd texel (ambient + sun max(0, n.l))`.
//!
//! (As groups they went through sums of even and of odd samples, one of which is none, and where normals are interpolated through
//! [`super::packed`].)

use super::look::Look;
use super::samples::{Samples, Sums};
use super::slope::Slope;
use super::textured::Textured;
use super::{Paint, Shader};
use crate::raster::LANES;
use crate::raster::group::Group;
use fearless_simd::{Simd, SimdBase};
use glam::Vec4;

#[inline(always)]
pub(super) fn surface<S: Simd>(
    simd: S,
    shader: &Shader<'_>,
    (look, samples): (&Look, &Samples<'_>),
    groups: &[Group],
    sums: &mut Sums,
) {
    let material = &shader.materials[look.material as usize];
    let Paint { diffuse, emission, ambient, sun } = shader.paint(material);
    let texture = Textured::new(material, look, samples);
    let slope = Slope::new(shader, look);
    let sides = look.lit.map(|light| diffuse * light.extend(0.0));
    for chunk in groups.chunks(LANES) {
        let at = samples.places(simd, chunk);
        let weights = samples.weights(simd, &at).map(|weights| weights.to_array());
        let weighed = |color: Vec4, i: usize| weights.as_ref().map_or(color, |weights| color * weights[i]);
        let texels = match &texture {
            Some(texture) => texture.shared(simd, chunk, &at).texels,
            None => [Vec4::ONE; LANES],
        };
        match &slope {
            Some(slope) => {
                let lights = slope.light(simd, samples.rays, &at).to_array();
                for (i, group) in chunk.iter().enumerate().take(LANES) {
                    let color = emission + (texels[i] * ambient + texels[i] * lights[i] * sun);
                    samples.add_one(group, weighed(color, i), sums);
                }
            }
            None => {
                let away = look.away(simd, samples.rays, &at);
                for (i, group) in chunk.iter().enumerate().take(LANES) {
                    let color = emission + texels[i] * sides[usize::from(away >> i & 1)];
                    samples.add_one(group, weighed(color, i), sums);
                }
            }
        }
    }
}
