//! Texture look-ups for up to 16 samples at a time that see one surface: places in, summed colours out.
//!
//! In: places, from [`super::fetch_queue`], [`super::textured`] and [`super::shadowed`], and a level and how to read it
//! ([`super::mip_level`]). Out: `sum texel` over the even and over the odd samples of a group and, where the light differs between them,
//! `sum texel light`; for [`super::cutout`] which are holes. A texel is that of column `floor(start + size s + part)`, modulo `size`, and
//! its row, or lies between four ([`super::interpolate`]).
//!
//! Places are computed for all 16 at once; the texels are fetched one by one, and those of one group, where none are
//! interpolated, summed in whole numbers. One generic source for every SIMD level, product and sum apart, so the same bits. (In
//! WebAssembly the look-ups are functions by themselves: with everything in one, the build took more than ten minutes.)

use super::interpolate::{Around, Between};
use super::mip_level::Choice;
use super::texel::{FULL, texel, wrap};
use crate::raster::LANES;
use crate::scene::{Texture, outline};
use fearless_simd::{Simd, SimdBase, SimdFloat, f32x16, u32x16};
use glam::Vec4;

/// The sums of the colours of the even and the odd samples among `lanes`, which look right and down from the
/// texture's anchor.
#[cfg_attr(not(target_family = "wasm"), inline(always))]
#[cfg_attr(target_family = "wasm", inline(never))]
pub(crate) fn sums<S: Simd>(
    simd: S,
    choice: Choice<'_>,
    [right, down]: [f32x16<S>; 2],
    lanes: u16,
    odd: u16,
) -> [Vec4; 2] {
    let halves = [lanes & !odd, lanes & odd];
    if choice.nearest {
        let (texels, places) = (&choice.level.texels[..], nearest_texels(simd, choice, right, down));
        [sum(texels, &places, halves[0]), sum(texels, &places, halves[1])]
    } else {
        Between::new(simd, choice, &Around::new(simd, choice, [right, down])).sums(halves)
    }
}

/// Which of 16 places are in a part of the texture that is smooth.
#[inline(always)]
pub(super) fn smooth<S: Simd>(
    simd: S,
    map: &Texture,
    choice: Choice<'_>,
    [right, down]: [f32x16<S>; 2],
) -> u16 {
    let [columns, rows] = within(simd, choice, right, down);
    let (columns, rows) = (columns.to_array(), rows.to_array());
    let mut found = 0;
    for lane in 0..LANES {
        found |= u16::from(map.smooth.around(columns[lane], rows[lane])) << lane;
    }
    found
}

/// The number of the texel that each of 16 places lies in.
#[inline(always)]
pub(super) fn nearest_texels<S: Simd>(
    simd: S,
    choice: Choice<'_>,
    right: f32x16<S>,
    down: f32x16<S>,
) -> [u32; LANES] {
    let [column, row] = within(simd, choice, right, down);
    (row * u32x16::splat(simd, choice.level.width) + column).to_array()
}

/// The column and the row of the texel that each of 16 places lies in.
#[inline(always)]
fn within<S: Simd>(simd: S, choice: Choice<'_>, right: f32x16<S>, down: f32x16<S>) -> [u32x16<S>; 2] {
    let column = (right * choice.right.size + choice.right.part).floor();
    let row = (down * choice.down.size + choice.down.part).floor();
    [wrap(simd, choice.right, column), wrap(simd, choice.down, row)]
}

/// The colour of each of `lanes`, which look right and down from the texture's anchor.
#[cfg_attr(not(target_family = "wasm"), inline(always))]
#[cfg_attr(target_family = "wasm", inline(never))]
pub(crate) fn each<S: Simd>(
    simd: S,
    choice: Choice<'_>,
    [right, down]: [f32x16<S>; 2],
    lanes: u16,
    out: &mut [Vec4; LANES],
) {
    let texels = &choice.level.texels[..];
    let mut rest = lanes;
    if choice.nearest {
        let places = nearest_texels(simd, choice, right, down);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            out[lane] = texel(texels, places[lane] as usize) * FULL;
        }
    } else {
        let around = Around::new(simd, choice, [right, down]);
        let between = Between::new(simd, choice, &around);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            out[lane] = between.at(lane);
        }
    }
}

/// The sum of the texels at the places of `lanes`, 1 for full.
#[inline(always)]
pub(super) fn sum(texels: &[[u16; 4]], places: &[u32; LANES], lanes: u16) -> Vec4 {
    let mut sum = [0u32; 4];
    let mut add = |lane: usize| {
        if let Some(texel) = texels.get(places[lane] as usize) {
            for (sum, &value) in sum.iter_mut().zip(texel) {
                *sum += u32::from(value);
            }
        }
    };
    match lanes {
        0 => return Vec4::ZERO,
        0x00ff => (0..8).for_each(add),
        0xff00 => (8..16).for_each(add),
        _ => {
            let mut rest = lanes;
            while rest != 0 {
                add(rest.trailing_zeros() as usize % LANES);
                rest &= rest - 1;
            }
        }
    }
    // Up to 16 sixteen-bit numbers: exact.
    Vec4::from_array(sum.map(|sum| sum as f32)) * FULL
}

/// Which of `lanes` look at an opacity of less than a half, interpolated.
#[inline(always)]
pub(crate) fn holes<S: Simd>(simd: S, choice: Choice<'_>, at: [f32x16<S>; 2], lanes: u16) -> u16 {
    let around = Around::new(simd, choice, at);
    let (mut all, mut some) = (0, 0);
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let four = choice.outline.get(around.places()[lane] as usize).copied().unwrap_or(outline::SOME);
        all |= u16::from(four & 1) << lane;
        some |= u16::from(four >> 1) << lane;
    }
    if some == 0 { all } else { all | Between::new(simd, choice, &around).holes(some) }
}

/// As [`sums`], of each sample's colour times its weight, and of that times its share of light: both from one reading of the texels.
#[cfg_attr(not(target_family = "wasm"), inline(always))]
#[cfg_attr(target_family = "wasm", inline(never))]
pub(crate) fn weighed_and_lit<S: Simd>(
    simd: S,
    choice: Choice<'_>,
    at: [f32x16<S>; 2],
    (lanes, odd): (u16, u16),
    [weights, lights]: [&[f32; LANES]; 2],
) -> [[Vec4; 2]; 2] {
    let mut colors = [Vec4::ZERO; LANES];
    each(simd, choice, at, lanes, &mut colors);
    let mut sums = [[Vec4::ZERO; 2]; 2];
    let mut rest = lanes;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let half = usize::from(odd >> lane & 1);
        let color = colors[lane] * weights[lane];
        sums[0][half] += color;
        sums[1][half] += color * lights[lane];
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::batch::Batch;
    use crate::scene::Level;
    use crate::shade::coordinates::Coordinates;
    use crate::shade::look::Bilinear4;
    use crate::simd::{SimdLevel, at_level};
    use glam::Vec2;

    /// Texels at random, a third of them holes.
    fn texture(width: u32, height: u32) -> Texture {
        let channel = |i: u32, c: u32| (hash(i * 4 + c) >> 16) as u16;
        let alpha =
            |i: u32| if hash(i).is_multiple_of(3) { channel(i, 3) / 2 } else { 32768 + channel(i, 3) / 2 };
        let texels = (0..width * height).map(|i| [channel(i, 0), channel(i, 1), channel(i, 2), alpha(i)]);
        Texture::from_level(Level { width, height, texels: texels.collect() }).unwrap()
    }

    #[test]
    fn sixteen_look_ups_equal_single_ones() {
        // Sizes that are powers of two have a way of their own.
        for (width, height) in [(7, 5), (8, 4), (8, 5), (1, 1), (2, 64)] {
            look_ups(texture(width, height));
        }
    }

    #[test]
    fn holes_are_where_the_interpolated_opacity_is_less_than_a_half() {
        for map in [texture(7, 5), texture(8, 4), texture(64, 64)] {
            let choice = Choice::alpha(&map, 0, [77, 200]).unwrap();
            let place = |i: usize| hash(i as u32) as f32 / 2_147_483_648.0 - 1.0;
            let mut met = 0;
            for first in (0..6400).step_by(2 * LANES) {
                let [right, down] = [0, LANES]
                    .map(|axis| std::array::from_fn::<_, LANES, _>(|lane| place(first + axis + lane)));
                let lanes = hash(first as u32) as u16;
                let found = at_level!(SimdLevel::best().level(), simd => {
                    holes(simd, choice, [right, down].map(|at| f32x16::load_array(simd, at)), lanes)
                });
                for (lane, (right, down)) in right.into_iter().zip(down).enumerate() {
                    let alpha = choice.read(Vec2::new(right, down)).w;
                    let is_hole = found >> lane & 1 == 1;
                    assert!((alpha - 0.5).abs() < 1e-6 || is_hole == (lanes >> lane & 1 == 1 && alpha < 0.5));
                    met += u32::from(is_hole);
                }
            }
            assert!(met > 200, "{met}");
        }
    }

    fn look_ups(texture: Texture) {
        let random = |seed: u32| std::array::from_fn(|i| hash(seed + i as u32) as f32 / 4_294_967_296.0);
        let batch = Batch {
            cell: 0,
            u: random(100),
            v: random(200),
            x: random(300),
            y: random(400),
            pixel: [0; LANES],
            index: [0; LANES],
            live: 0xffff,
            odd: 0xff00,
        };
        let k: Bilinear4 = std::array::from_fn(|i| {
            let [a, b, ..]: [f32; LANES] = random(1000 + 2 * i as u32);
            Vec4::new(3.0 * a - 2.0, 3.0 * b - 2.0, if i == 0 { 1.0 } else { 0.01 * a }, 0.0)
        });
        for (lanes, nearest) in [(0xffff, false), (0x00ff, true), (0x8421, true), (0x0001, false)] {
            let fine = Choice::colour(&texture, 0, [77, 200]).unwrap();
            let choice = Choice { nearest, ..fine };
            let mut wanted = [Vec4::ZERO; 2];
            for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
                let (u, v, x, y) = (batch.u[lane], batch.v[lane], batch.x[lane] + 3.0, batch.y[lane] - 2.0);
                let at = |k: &[Vec4]| k[0] + k[1] * u + k[2] * v;
                let at = at(&k[..3]) + at(&k[3..6]) * x + at(&k[6..]) * y;
                wanted[usize::from(lane >= 8)] += choice.read(Vec2::new(at.x, at.y) / at.z);
            }
            let found = at_level!(SimdLevel::best().level(), simd => {
                let coordinates = Coordinates::of_batch(simd, &k, &batch);
                let spots = coordinates.at(simd, f32x16::splat(simd, 3.0), f32x16::splat(simd, -2.0));
                sums(simd, choice, spots.usable(simd), lanes, batch.odd)
            });
            let alone = at_level!(SimdLevel::best().level(), simd => {
                let coordinates = Coordinates::of_batch(simd, &k, &batch);
                let spots = coordinates.at(simd, f32x16::splat(simd, 3.0), f32x16::splat(simd, -2.0));
                let mut out = [Vec4::ZERO; LANES];
                each(simd, choice, spots.usable(simd), lanes, &mut out);
                out
            });
            for half in 0..2 {
                let sum: Vec4 = alone[8 * half..8 * half + 8].iter().sum();
                assert!((sum - wanted[half]).abs().max_element() < 1e-3, "each of {lanes:x}");
                assert!((found[half] - wanted[half]).abs().max_element() < 1e-3, "{lanes:x}");
            }
        }
    }

    fn hash(x: u32) -> u32 {
        let x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
        let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
        x ^ x >> 16
    }
}
