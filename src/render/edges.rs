//! What an edge along rows or columns of pixels may hide. In: the sums of a tile. Out: for each block at least so much squared error.
//!
//! All pixels of a tile share their places within a pixel and on the lens. Along an edge that runs as pixels do they therefore err
//! alike, and where the two halves of the samples happen to agree the whole row seems to be right: a block's stated error is one
//! throw then, mostly of 0. (A white rectangle on black, in focus, stopped at 16 samples in such rows, with up to 12 times the error
//! that was asked for.) What such an edge errs is known beforehand: each half has one sample in each of `n / 2` slices of the
//! pixel, so of a step of contrast `c` within the pixel its mean misses `c^2 f (1 - f) / (n / 2)^2`, where the edge cuts the slice at
//! `f`; with two halves and any `f`, `c^2 / (3 n^2)`.

use super::picture::Picture;
use super::resolve::{BLOCKS, ByBlock};
use crate::picture::BLOCK;
use crate::raster::TILE;
use glam::Vec3;

/// Times the error of a sharp edge: one that is blurred over a pixel or two errs as much with half of its contrast in a pixel.
const BLURRED: f64 = 4.0;

impl Picture<'_> {
    /// Raises the errors of the blocks with `samples` to what their edges may hide.
    pub(super) fn raise_edges(
        &self,
        (tx, ty): (u32, u32),
        sums: &[[Vec3; 2]],
        samples: (&ByBlock<u32>, &ByBlock<u32>),
        squared: &mut ByBlock<f64>,
    ) {
        let (all, changed) = samples;
        let size =
            [self.view.width - tx * TILE, self.view.height - ty * TILE].map(|size| size.min(TILE) as usize);
        let block_of = |x: usize, y: usize| y / BLOCK as usize * BLOCKS as usize + x / BLOCK as usize;
        let mut shown = [Vec3::ZERO; (TILE * TILE) as usize];
        for y in 0..size[1] {
            for x in 0..size[0] {
                let at = y * TILE as usize + x;
                let n = all[block_of(x, y)].max(1);
                let Some([a, b]) = sums.get(at) else { continue };
                shown[at] = ((*a + *b) * (self.gain / n as f32)).clamp(Vec3::ZERO, Vec3::ONE);
            }
        }
        let mut steps = ByBlock::<f64>::default();
        for axis in 0..2 {
            for across in 0..size[1 - axis] {
                let place = |along: usize| if axis == 0 { (along, across) } else { (across, along) };
                let value = |along: usize| {
                    let (x, y) = place(along);
                    shown[y * TILE as usize + x]
                };
                // From each pixel of the line to the next.
                let mut changes = [Vec3::ZERO; TILE as usize];
                for along in 1..size[axis] {
                    changes[along - 1] = (value(along) - value(along - 1)).abs();
                }
                for along in 0..size[axis] {
                    let (x, y) = place(along);
                    let block = block_of(x, y);
                    if changed[block] == 0 {
                        continue;
                    }
                    // What changes at the pixel beyond what changes beside it: an even slope has no edge.
                    let mut step = Vec3::ZERO;
                    if along >= 2 {
                        step += changes[along - 1] - changes[along - 2];
                    }
                    if along + 2 < size[axis] {
                        step += changes[along] - changes[along + 1];
                    }
                    steps[block] += f64::from(step.max(Vec3::ZERO).length_squared());
                }
            }
        }
        for block in 0..steps.len() {
            if changed[block] > 1 {
                let n = f64::from(changed[block]);
                let least = BLURRED * steps[block] / (3.0 * n * n);
                squared[block] = squared[block].max(least);
            }
        }
    }
}
