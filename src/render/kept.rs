//! What is kept of a tile's sums from round to round. In: sums of even and odd samples. Out: the same, or their total.
//!
//! Where no block of a tile got more than its first run, the total is all that is kept: memory that is touched for the first
//! time takes 7 ns a pixel and half, which was 4 % of a picture with the error of 16 samples. Should such a block go on
//! after all, as one in a hundred does, its first run is drawn again.

use super::resolve::{ByBlock, Sum};
use crate::picture::BLOCK;
use crate::raster::TILE;
use glam::Vec4;

/// Pixels of a tile.
pub(super) const AREA: usize = (TILE * TILE) as usize;

/// Blocks of a tile, one bit each.
pub(super) type Blocks = u16;

/// A tile of pixels.
pub(super) type Half = [[f32; 3]; AREA];

/// A tile: even samples, or all, and odd ones, far from each other in memory.
pub(super) type Kept<'a> = (&'a mut Half, &'a mut Half);

/// Whether pixel `at` of a tile is in one of these blocks.
fn is_in(blocks: Blocks, at: usize) -> bool {
    let (x, y) = (at as u32 % TILE, at as u32 / TILE);
    blocks >> (y / BLOCK * (TILE / BLOCK) + x / BLOCK) & 1 == 1
}

/// The sums of a tile of which the blocks `apart` were kept as they are, and of the others the total, as of even samples.
pub(super) fn load((even, odd): (&Half, &Half), apart: Blocks, sums: &mut [Sum]) {
    if apart == 0 {
        sums.iter_mut().zip(even).for_each(|(sum, &total)| *sum = [total, [0.0; 3]]);
    } else {
        sums.iter_mut().zip(even.iter().zip(odd)).for_each(|(sum, (&even, &odd))| *sum = [even, odd]);
    }
}

/// Keeps the sums of the blocks `apart` as they are, and of the others the total.
pub(super) fn save(sums: &[Sum], apart: Blocks, (even, odd): Kept<'_>) {
    let total = |[a, b]: &Sum| std::array::from_fn(|channel| a[channel] + b[channel]);
    if apart == 0 {
        totals(sums, even);
        return;
    }
    for (at, sum) in sums.iter().enumerate().take(AREA) {
        [even[at], odd[at]] = if is_in(apart, at) { *sum } else { [total(sum), [0.0; 3]] };
    }
}

/// The totals of all sums. Four numbers at a time, of which the fourth is overwritten by the next pixel's first.
fn totals(sums: &[Sum], out: &mut Half) {
    let halves = sums.as_flattened().as_flattened().chunks_exact(6);
    let (out, mut at) = (out.as_flattened_mut(), 0);
    for (pixel, next) in halves.clone().zip(halves.skip(1)) {
        let [even, odd] = [[pixel[0], pixel[1], pixel[2], 0.0], [pixel[3], pixel[4], pixel[5], next[0]]];
        let total = Vec4::from_array(even) + Vec4::from_array(odd);
        if let Some(out) = out.get_mut(at..at + 4) {
            out.copy_from_slice(&total.to_array());
        }
        at += 3;
    }
    if let (Some([a, b]), Some(last)) = (sums.last(), out.get_mut(at..at + 3)) {
        (0..3).for_each(|channel| last[channel] = a[channel] + b[channel]);
    }
}

/// Makes what was kept the means of so many samples, 0 outside of a tile of this `size`: in place of the even ones.
pub(super) fn means((even, odd): (&mut Half, &Half), apart: Blocks, samples: &ByBlock<u32>, size: [u32; 2]) {
    for at in 0..AREA {
        let (x, y) = (at as u32 % TILE, at as u32 / TILE);
        let n = samples[(y / BLOCK * (TILE / BLOCK) + x / BLOCK) as usize].max(1) as f32;
        let other = if apart == 0 { [0.0; 3] } else { odd[at] };
        let is_inside = x < size[0] && y < size[1];
        let mean = |channel: usize| if is_inside { (even[at][channel] + other[channel]) / n } else { 0.0 };
        even[at] = std::array::from_fn(mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(value: f32) -> Box<Half> {
        let mut tile: Box<Half> = bytemuck::allocation::zeroed_box();
        tile.fill([value; 3]);
        tile
    }

    #[test]
    fn what_is_kept_comes_back_apart_or_as_the_total() {
        let sums: Vec<Sum> = (0..AREA).map(|at| [[at as f32, 1.0, 0.5], [2.0, at as f32, 0.25]]).collect();
        for apart in [0, 1, 0x8421, Blocks::MAX] {
            let (mut even, mut odd) = (tile(0.0), tile(0.0));
            let mut loaded = vec![Sum::default(); AREA];
            save(&sums, apart, (&mut even, &mut odd));
            load((&even, &odd), apart, &mut loaded);
            for (at, (loaded, sum)) in loaded.iter().zip(&sums).enumerate() {
                let total = [0, 1, 2].map(|channel| sum[0][channel] + sum[1][channel]);
                let wanted = if is_in(apart, at) { *sum } else { [total, [0.0; 3]] };
                assert_eq!(*loaded, wanted, "{apart:x} {at}");
            }
            means((&mut even, &odd), apart, &[4; 16], [TILE, 20]);
            let is_mean = |at: usize| (even[at][1] * 4.0 - sums[at][0][1] - sums[at][1][1]).abs() < 1e-3;
            assert!((0..20 * TILE as usize).all(is_mean), "{apart:x}");
            assert!(even[20 * TILE as usize..].iter().all(|pixel| *pixel == [0.0; 3]));
        }
    }

    #[test]
    fn of_a_total_the_odd_half_is_neither_written_nor_read() {
        let (mut even, mut odd) = (tile(0.0), tile(9.0));
        save(&vec![[[1.0; 3]; 2]; AREA], 0, (&mut even, &mut odd));
        assert!(even[7] == [2.0; 3] && odd[7] == [9.0; 3]);
        means((&mut even, &odd), 0, &[2; 16], [TILE; 2]);
        assert_eq!(even[7], [1.0; 3]);
    }
}
