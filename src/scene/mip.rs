//! Mip levels: a level's texels in, the next smaller one's out, by the exact area-weighted box filter.
//!
//! A level of w texels is followed by one of max(1, w / 2) rounded down. In units of 1 / (w w') of the edge a source
//! texel is w' long and a target texel w, so the shares in which they overlap are whole numbers, for odd sizes too;
//! they add up to w, and the mean over the picture is kept but for rounding. Whole numbers: the same everywhere.

use rayon::prelude::*;

use super::texture::Level;

/// The level after `level`, or none after 1 x 1.
pub(crate) fn next_level(level: &Level) -> Option<Level> {
    let (w, h) = (level.width as usize, level.height as usize);
    if w * h <= 1 {
        return None;
    }
    let (width, height) = ((w / 2).max(1), (h / 2).max(1));
    let columns: Vec<Vec<(usize, u64)>> = (0..width).map(|i| overlaps(w, width, i)).collect();
    let area = (w * h) as u64;
    let mut texels = vec![[0u16; 4]; width * height];
    texels.par_chunks_mut(width).enumerate().for_each(|(j, row)| {
        let rows = overlaps(h, height, j);
        for (texel, columns) in row.iter_mut().zip(&columns) {
            let mut sum = [0u64; 4];
            for &(y, wy) in &rows {
                for &(x, wx) in columns {
                    let source = level.texels[y * w + x];
                    for (sum, value) in sum.iter_mut().zip(source) {
                        *sum += wx * wy * u64::from(value);
                    }
                }
            }
            // A mean of 16-bit numbers is one.
            *texel = sum.map(|sum| ((sum + area / 2) / area) as u16);
        }
    });
    Some(Level { width: width as u32, height: height as u32, texels })
}

/// The source texels (of `from`) that target texel `i` (of `to`) covers, each with its share; shares add up to `from`.
fn overlaps(from: usize, to: usize, i: usize) -> Vec<(usize, u64)> {
    let (start, end) = (i * from, (i + 1) * from);
    (start / to..end.div_ceil(to))
        .map(|j| (j, ((j + 1) * to).min(end) - (j * to).max(start)))
        .map(|(j, share)| (j, share as u64))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_cover_each_source_texel_once() {
        for (from, to) in [(7, 3), (8, 4), (5, 2), (3, 1), (1, 1), (2, 1), (4095, 2047)] {
            let mut covered = vec![0u64; from];
            for i in 0..to {
                let shares = overlaps(from, to, i);
                assert_eq!(shares.iter().map(|s| s.1).sum::<u64>(), from as u64);
                shares.iter().for_each(|&(j, share)| covered[j] += share);
            }
            assert!(covered.iter().all(|&c| c == to as u64), "{from} -> {to}");
        }
    }

    #[test]
    fn the_last_level_is_the_mean() {
        for (width, height) in [(37u32, 19u32), (64, 1), (1, 5), (16, 16)] {
            let texels: Vec<[u16; 4]> = (0..width * height)
                .map(|i| [(i * 7919 % 65536) as u16, 65535, 0, (i * 31 % 65536) as u16])
                .collect();
            let mean = |c: usize| texels.iter().map(|t| f64::from(t[c])).sum::<f64>() / texels.len() as f64;
            let means = [mean(0), mean(1), mean(2), mean(3)];
            let mut level = Level { width, height, texels: texels.clone() };
            let mut steps = 0;
            while let Some(next) = next_level(&level) {
                level = next;
                steps += 1;
            }
            assert_eq!((level.width, level.height, level.texels.len()), (1, 1, 1));
            for (found, mean) in level.texels[0].into_iter().zip(means) {
                assert!((f64::from(found) - mean).abs() <= 0.5 * f64::from(steps), "{found} {mean}");
            }
        }
    }
}
