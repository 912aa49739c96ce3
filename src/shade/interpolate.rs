//! Bilinear interpolation at up to 16 places of one level of a texture: what lies between the four texels around each.
//!
//! In: places, from [`super::fetch`] and [`super::fetch_queue`], and a level and how to read it ([`super::mip_level`]). Out: the colour at
//! each, their sums, or which are holes. `a + (b - a) fx + (c - a) fy + (a - b - c + d) fx fy`, with `a`, `b` the upper and `c`, `d` the
//! lower texels; `fx` is what `size s + part - 1/2` has beyond a whole number, `fy` the same downward.
//!
//! Places are computed for all 16 at once; texels are fetched place by place, left and right together, since they lie side by
//! side in memory. One generic source for every SIMD level, product and sum apart, so the same bits.

use super::lanes::total;
use super::mip_level::Choice;
use super::texel::{FULL, texel, wrap};
use crate::raster::LANES;
use fearless_simd::{
    Simd, SimdBase, SimdCvtFloat, SimdFloat, SimdMask, SimdSplit, f32x8, f32x16, i32x8, u32x16,
};
use glam::Vec4;

/// Where the four texels around each of 16 places lie, and how near the place is to the right and the lower ones.
#[derive(Clone, Copy)]
pub(super) struct Around {
    left_top: [u32; LANES],
    shares: [[f32; LANES]; 2],
    /// Lanes whose texels lie on both sides of the texture's border.
    across: u16,
}

impl Around {
    pub(super) const NOWHERE: Self = Self { left_top: [0; LANES], shares: [[0.0; LANES]; 2], across: 0 };

    /// At places right and down from the texture's anchor.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, choice: Choice<'_>, [right, down]: [f32x16<S>; 2]) -> Self {
        let right = right * choice.right.size + choice.right.part - 0.5;
        let down = down * choice.down.size + choice.down.part - 0.5;
        let (left, top) = (right.floor(), down.floor());
        let (x, y) = (wrap(simd, choice.right, left), wrap(simd, choice.down, top));
        let (width, height) = (choice.level.width.max(1), choice.level.height.max(1));
        let is_last = x.simd_ge(u32x16::splat(simd, width - 1)) | y.simd_ge(u32x16::splat(simd, height - 1));
        Self {
            left_top: (y * u32x16::splat(simd, width) + x).to_array(),
            shares: [(right - left).to_array(), (down - top).to_array()],
            across: is_last.to_bitmask() as u16,
        }
    }

    /// The numbers of the left top texels.
    #[inline(always)]
    pub(super) fn places(&self) -> &[u32; LANES] {
        &self.left_top
    }
}

/// What lies between the four texels around each of 16 places.
pub(super) struct Between<'a, S: Simd> {
    simd: S,
    texels: &'a [[u16; 4]],
    width: usize,
    around: &'a Around,
}

impl<'a, S: Simd> Between<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, choice: Choice<'a>, around: &'a Around) -> Self {
        let width = choice.level.width.max(1) as usize;
        Self { simd, texels: &choice.level.texels, width, around }
    }

    /// The sums of the colours at each half of the lanes.
    #[inline(always)]
    pub(super) fn sums(&self, halves: [u16; 2]) -> [Vec4; 2] {
        let simd = self.simd;
        let lanes = halves[0] | halves[1];
        let first = lanes.trailing_zeros() as usize % LANES;
        let all = u32x16::load_array_ref(simd, &self.around.left_top);
        let same = all.simd_eq(u32x16::splat(simd, self.around.left_top[first])).to_bitmask() as u16;
        if same & lanes != lanes {
            // No closure here: it would not be compiled for the SIMD level (6 to 9 % of all time on the city and Sponza).
            return [self.sum(halves[0]), self.sum(halves[1])];
        }
        // All between the same four texels.
        let [a, b, c, d] = self.corners(first).map(|place| texel(self.texels, place) * FULL);
        if a == b && a == c && a == d {
            return halves.map(|half| a * half.count_ones() as f32);
        }
        let [fx, fy] = self.shares();
        let both = fx * fy;
        let mut sums = [Vec4::ZERO; 2];
        for (sum, half) in sums.iter_mut().zip(halves) {
            let x = total(simd, fx, half);
            let y = total(simd, fy, half);
            let xy = total(simd, both, half);
            *sum = a * half.count_ones() as f32 + (b - a) * x + (c - a) * y + (a - b - c + d) * xy;
        }
        sums
    }

    /// The sum of the colours at `lanes`. Left and right columns are summed apart: what lies between them is linear.
    #[inline(always)]
    fn sum(&self, lanes: u16) -> Vec4 {
        let zero = f32x8::splat(self.simd, 0.0);
        let (mut plain, mut shared) = (zero, zero);
        // No call within, or the sums would go through memory.
        let mut rest = lanes & !self.around.across;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let columns = self.columns(lane);
            plain += columns;
            shared += columns * self.around.shares[0][lane];
        }
        let (left, _) = plain.split();
        let (minus, right) = shared.split();
        let mut sum = Vec4::from_array((left + (right - minus)).to_array());
        let mut rest = lanes & self.around.across;
        while rest != 0 {
            sum += self.across(rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
        sum * FULL
    }

    #[inline(always)]
    fn shares(&self) -> [f32x16<S>; 2] {
        let [right, down] = &self.around.shares;
        [f32x16::load_array_ref(self.simd, right), f32x16::load_array_ref(self.simd, down)]
    }

    /// The colour at a lane.
    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> Vec4 {
        if self.around.across >> lane & 1 == 1 {
            return self.across(lane) * FULL;
        }
        let (left, right) = self.columns(lane).split();
        Vec4::from_array((left + (right - left) * self.around.shares[0][lane % LANES]).to_array()) * FULL
    }

    /// What lies between the upper and the lower texels, on the left and on the right; 65535 for full. For lanes whose texels
    /// are not across a border.
    #[inline(always)]
    fn columns(&self, lane: usize) -> f32x8<S> {
        let first = self.around.left_top[lane % LANES] as usize;
        if let Some(rows) = self.texels.get(first..first + self.width + 2)
            && let (Some(top), Some(bottom)) = (rows.first_chunk(), rows.last_chunk())
        {
            let (top, bottom) = (numbers(self.simd, top), numbers(self.simd, bottom));
            return top + (bottom - top) * self.around.shares[1][lane % LANES];
        }
        f32x8::splat(self.simd, 0.0)
    }

    /// The colour at a lane whose texels are across a border, 65535 for full.
    #[inline(always)]
    fn across(&self, lane: usize) -> Vec4 {
        let shares = [self.around.shares[0][lane % LANES], self.around.shares[1][lane % LANES]];
        across(self.texels, self.width, self.around.left_top[lane % LANES] as usize, shares)
    }

    /// The places of a lane's four texels: left top, right top, left bottom, right bottom.
    #[inline(always)]
    fn corners(&self, lane: usize) -> [usize; 4] {
        let first = self.around.left_top[lane % LANES] as usize;
        if self.around.across >> lane & 1 == 1 {
            return around_border(first, self.width, self.texels.len());
        }
        [first, first + 1, first + self.width, first + self.width + 1]
    }

    /// Which of `lanes` look at an opacity of less than a half.
    #[inline(always)]
    pub(super) fn holes(&self, lanes: u16) -> u16 {
        let simd = self.simd;
        let mut alphas = [[0.0; LANES]; 4];
        let mut rest = lanes;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let corners = self.corners(lane);
            for (alphas, corner) in alphas.iter_mut().zip(corners) {
                alphas[lane] = texel(self.texels, corner).w;
            }
        }
        let [a, b, c, d] = [
            f32x16::load_array_ref(simd, &alphas[0]),
            f32x16::load_array_ref(simd, &alphas[1]),
            f32x16::load_array_ref(simd, &alphas[2]),
            f32x16::load_array_ref(simd, &alphas[3]),
        ];
        let [fx, fy] = self.shares();
        let top = a + (b - a) * fx;
        let bottom = c + (d - c) * fx;
        let half = f32x16::splat(simd, 0.5 * 65535.0);
        (top + (bottom - top) * fy).simd_lt(half).to_bitmask() as u16 & lanes
    }
}

/// The places of four texels, where the last column is followed by the first, and the last row: by itself, for few come by.
#[inline(never)]
fn around_border(first: usize, width: usize, all: usize) -> [usize; 4] {
    let row = first / width * width;
    let right = if first + 1 == row + width { row } else { first + 1 };
    let down = if row + width == all { 0 } else { row + width };
    [first, right, down + (first - row), down + (right - row)]
}

/// What lies between four such texels, 65535 for full.
#[inline(never)]
fn across(texels: &[[u16; 4]], width: usize, first: usize, shares: [f32; 2]) -> Vec4 {
    let places = around_border(first, width, texels.len());
    let [a, b, c, d] = places.map(|place| texel(texels, place));
    let (left, right) = (a + (c - a) * shares[1], b + (d - b) * shares[1]);
    left + (right - left) * shares[0]
}

/// Two texels as numbers, channel by channel.
#[inline(always)]
fn numbers<S: Simd>(simd: S, texels: &[[u16; 4]; 2]) -> f32x8<S> {
    let mut whole = [0; 8];
    for (whole, &channel) in whole.iter_mut().zip(texels.as_flattened()) {
        *whole = i32::from(channel);
    }
    f32x8::float_from(i32x8::load_array(simd, whole))
}
