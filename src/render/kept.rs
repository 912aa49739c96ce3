//! What is kept of a tile's sums from round to round. In: sums of even and odd samples. Out: the same, or their mean.
//!
//! Where no block of a tile got more than its first run, the mean is all that is kept: memory that is touched for the first
//! time takes 7 ns a pixel and half, which was 4 % of a picture with the error of 16 samples. Should such a block go on
//! after all, as one in a hundred does, its first run is drawn again. (The mean and not the total: that is what the picture
//! shows, and a first run's samples are a power of two, by which a number can be divided and multiplied again.)

use super::resolve::{AREA, BLOCKS, ByBlock, Sum, WIDTH, means_of};
use super::too_large;
use crate::error::Result;
use crate::picture::BLOCK;
use glam::Vec3;

/// Blocks of a tile, one bit each.
pub(super) type Blocks = u16;

/// A tile of pixels.
pub(super) type Half = [[f32; 3]; AREA];

/// Odd samples of a tile, pixel by pixel; nothing where they are not kept apart. (Memory for all of a picture that the system has given
/// and got back before is cleared once more, which took 2 % of the city with the error of 64 samples.)
pub(super) type Odd = Vec<[f32; 3]>;

/// A tile: even samples, or all, and odd ones.
pub(super) type Kept<'a> = (&'a mut Half, &'a mut Odd);

/// The block of a tile that such a row of pixels is part of.
fn block_of(row: usize) -> usize {
    row / (BLOCK * BLOCKS) as usize * BLOCKS as usize + row % BLOCKS as usize
}

/// The sums of a tile of which the blocks `apart` were kept as they are, and of the others the total, as of even samples; of a
/// tile without such blocks the means of as many samples as each began with.
pub(super) fn load((even, odd): (&Half, &Odd), apart: Blocks, first: &ByBlock<u32>, sums: &mut [Sum]) {
    if apart == 0 {
        let rows = sums.as_chunks_mut::<WIDTH>().0.iter_mut().zip(even.as_chunks::<WIDTH>().0);
        for (row, (sums, even)) in rows.enumerate() {
            let samples = first[block_of(row)] as f32;
            let total = |mean: &[f32; 3]| (Vec3::from_array(*mean) * samples).to_array();
            sums.iter_mut().zip(even).for_each(|(sum, mean)| *sum = [total(mean), [0.0; 3]]);
        }
    } else {
        sums.iter_mut().zip(even.iter().zip(odd)).for_each(|(sum, (&even, &odd))| *sum = [even, odd]);
    }
}

/// Keeps the sums of the blocks `apart` as they are, and of the others the total; of a tile without such blocks the means of as
/// many samples as each began with.
///
/// # Errors
/// [`crate::error::ErrorKind::TooLarge`] where there is no memory left.
pub(super) fn save(sums: &[Sum], apart: Blocks, first: &ByBlock<u32>, (even, odd): Kept<'_>) -> Result<()> {
    if apart == 0 && first.iter().all(|samples| *samples == first[0]) {
        means_of(sums, first[0], even);
        return Ok(());
    }
    if apart == 0 {
        let rows = sums.as_chunks::<WIDTH>().0.iter().zip(even.as_chunks_mut::<WIDTH>().0);
        for (row, (sums, even)) in rows.enumerate() {
            for (sum, even) in sums.iter().zip(even) {
                let [a, b] = sum.map(Vec3::from_array);
                *even = ((a + b) / first[block_of(row)] as f32).to_array();
            }
        }
        return Ok(());
    }
    odd.clear();
    odd.try_reserve_exact(AREA).map_err(|_| too_large())?;
    let rows = sums.as_chunks::<WIDTH>().0.iter().zip(even.as_chunks_mut::<WIDTH>().0);
    for (row, (sums, even)) in rows.enumerate() {
        let mut odd_half = [[0.0; 3]; WIDTH];
        if apart >> block_of(row) & 1 == 1 {
            for x in 0..WIDTH {
                [even[x], odd_half[x]] = sums[x];
            }
        } else {
            for x in 0..WIDTH {
                let [a, b] = sums[x].map(Vec3::from_array);
                even[x] = (a + b).to_array();
            }
        }
        odd.extend_from_slice(&odd_half);
    }
    Ok(())
}

/// Makes what was kept the means of so many samples: in place of the even ones.
pub(super) fn means((even, odd): (&mut Half, &Odd), apart: Blocks, samples: &ByBlock<u32>) {
    if apart == 0 {
        return;
    }
    let rows = even.as_chunks_mut::<WIDTH>().0.iter_mut().zip(odd.as_chunks::<WIDTH>().0);
    for (row, (even, odd)) in rows.enumerate() {
        let n = samples[block_of(row)].max(1) as f32;
        for (even, odd) in even.as_flattened_mut().iter_mut().zip(odd.as_flattened()) {
            *even = (*even + odd) / n;
        }
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
        let mixed = std::array::from_fn(|block| if block % 3 == 0 { 16 } else { 4 });
        for (apart, first) in
            [0, 1, 0x8421, Blocks::MAX].into_iter().flat_map(|apart| [(apart, [4; 16]), (apart, mixed)])
        {
            let (mut even, mut odd) = (tile(0.0), Odd::new());
            let mut loaded = vec![Sum::default(); AREA];
            save(&sums, apart, &first, (&mut even, &mut odd)).unwrap();
            load((&even, &odd), apart, &first, &mut loaded);
            let is_in = |at: usize| apart >> (at / 256 * 4 + at % 32 / 8) & 1 == 1;
            for (at, (loaded, sum)) in loaded.iter().zip(&sums).enumerate() {
                let total = [0, 1, 2].map(|channel| sum[0][channel] + sum[1][channel]);
                let wanted = if is_in(at) { *sum } else { [total, [0.0; 3]] };
                assert_eq!(*loaded, wanted, "{apart:x} {at}");
            }
            means((&mut even, &odd), apart, &first);
            let is_mean = |at: usize| {
                (even[at][1] * first[at / 256 * 4 + at % 32 / 8] as f32 - sums[at][0][1] - sums[at][1][1])
                    .abs()
                    < 1e-3
            };
            assert!((0..AREA).all(is_mean), "{apart:x}");
        }
    }

    #[test]
    fn of_a_mean_the_odd_half_takes_no_memory() {
        let (mut even, mut odd) = (tile(0.0), Odd::new());
        save(&vec![[[1.0; 3]; 2]; AREA], 0, &[2; 16], (&mut even, &mut odd)).unwrap();
        assert!(even[7] == [1.0; 3] && odd.capacity() == 0);
        means((&mut even, &odd), 0, &[2; 16]);
        assert_eq!(even[7], [1.0; 3]);
    }
}
