//! Triangles between the samples: where a tile has many more of them than samples, most meet none.
//!
//! In: corners of 16 triangles ([`super::waiting`]), and a tile's samples. Out: the triangles that a sample may meet, for
//! [`super::setup`]. One that is smaller than the way from a sample to the next (`width height density < 1`, `density` samples in
//! a square pixel) is looked for at each lens point, as [`super::scatter`] does; where none sees it it need not be set up, nor
//! kept for each batch to come by. Which triangles these are is decided by the same numbers that place them for
//! [`super::scatter`], with the same margin: nothing that is seen is left out.

use super::batch::{Batch, Pattern};
use super::film::TileFilm;
use super::scatter::{MARGIN, ranges};
use super::setup::{Corner, Corners, Image, Images, corner, corners, images};
use super::{LANES, TILE};
use crate::simd::at_level;
use fearless_simd::{Level, Simd, SimdBase, SimdMask, f32x16};

/// So many triangles for each sample of a tile's are worth it. (A preview of the table top, 160 pixels wide, takes half the time,
/// and a million triangles under one pixel two fifths. With a half of this, previews of 640 pixels were no faster.)
const CROWD: f32 = 8.0;

/// The samples that a tile's triangles may meet.
#[derive(Default)]
pub(super) struct Sieve {
    batches: Vec<Batch>,
    /// Width and height of a block of pixels.
    block_size: (u32, u32),
    /// Samples in a square pixel.
    density: f32,
}

impl Sieve {
    /// Takes the samples of `pattern`; tells whether it is worth it for so many triangles in a tile.
    pub(super) fn set(&mut self, pattern: &Pattern, triangles: usize) -> bool {
        let [across, down] = pattern.block_bits;
        let samples: u32 = pattern.batches.iter().map(|batch| batch.live.count_ones()).sum();
        self.block_size = (1 << across, 1 << down);
        self.density = samples as f32 / (1 << (across + down)) as f32;
        let is_crowded = triangles as f32 > CROWD * self.density * (TILE * TILE) as f32;
        if is_crowded {
            self.batches.clone_from(&pattern.batches);
        }
        is_crowded
    }

    /// Which of `those` triangles, or quads with a fourth corner, a sample may meet; all of their corners have to have images.
    pub(super) fn met(
        &self,
        level: Level,
        film: &TileFilm,
        v: (&Corners, Option<&Corner>),
        those: u16,
    ) -> u16 {
        at_level!(level, simd => met(simd, self, film, v, those))
    }
}

#[inline(always)]
fn met<S: Simd>(
    simd: S,
    sieve: &Sieve,
    film: &TileFilm,
    (v, fourth): (&Corners, Option<&Corner>),
    those: u16,
) -> u16 {
    let mut at: Images = [[[[0.0; LANES]; 3]; 3]; 3];
    let mut placed = images(simd, film, (&corners(simd, v, 0), &corners(simd, v, 8)), &mut at);
    let mut last: Image = [[[0.0; LANES]; 3]; 3];
    if let Some(fourth) = fourth {
        let both = (&[corner(simd, fourth, 0)], &[corner(simd, fourth, 8)]);
        placed &= images(simd, film, both, std::array::from_mut(&mut last));
    }
    let last = fourth.map(|_| &last);
    let small = (extent(simd, (&at, last), 0) * extent(simd, (&at, last), 1) * sieve.density)
        .simd_lt(f32x16::splat(simd, 1.0))
        .to_bitmask() as u16;
    let (columns, rows) = (TILE / sieve.block_size.0, TILE / sieve.block_size.1);
    let blocks = [0, columns as i32 - 1, 0, rows as i32 - 1];
    let mut met = those;
    let mut rest = those & small & placed;
    while rest != 0 {
        let t = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let mut is_met = false;
        // A loop, for closures are not compiled for the level.
        for batch in &sieve.batches {
            let seeing =
                ranges(simd, (&at, last), t, batch, sieve.block_size, blocks).some().to_bitmask() as u16;
            is_met = seeing & batch.live != 0;
            if is_met {
                break;
            }
        }
        met &= !(u16::from(!is_met) << t);
    }
    met
}

/// How long triangles are along an axis of the picture, seen through the lens centre, and what may be wrong at its ends.
#[inline(always)]
fn extent<S: Simd>(simd: S, (at, last): (&Images, Option<&Image>), row: usize) -> f32x16<S> {
    let load = |row: &[f32; LANES]| f32x16::load_array_ref(simd, row);
    let a = load(&at[0][row][0]) / load(&at[0][2][0]);
    let b = load(&at[1][row][0]) / load(&at[1][2][0]);
    let c = load(&at[2][row][0]) / load(&at[2][2][0]);
    let (mut most, mut least) = (a.max(b).max(c), a.min(b).min(c));
    if let Some(last) = last {
        let d = load(&last[row][0]) / load(&last[2][0]);
        (most, least) = (most.max(d), least.min(d));
    }
    most - least + 2.0 * MARGIN
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::setup::testing::{at, edges, triangles};
    use crate::raster::view::test_view;
    use crate::simd::SimdLevel;

    /// A triangle is met where all edge functions, in double precision, say so at a sample.
    #[test]
    fn what_is_left_out_no_sample_meets_and_every_level_leaves_out_the_same() {
        let film = TileFilm::new(&test_view(), 0, 0);
        let mut numbers = Random(3);
        let mut random = || numbers.signed();
        let batch = |random: &mut dyn FnMut() -> f64, live| {
            let mut batch = Batch { live, ..Batch::of_cell(0) };
            for lane in 0..LANES {
                (batch.u[lane], batch.v[lane]) = ((0.7 * random()) as f32, (0.7 * random()) as f32);
                (batch.x[lane], batch.y[lane]) = ((1.0 + random()) as f32, (1.0 + random()) as f32);
            }
            batch
        };
        let batches = vec![batch(&mut random, 0xffff), batch(&mut random, 0x0fff)];
        let pattern = Pattern { block_bits: [1, 1], batches };
        let mut sieve = Sieve::default();
        assert!(!sieve.set(&pattern, 30_000) && sieve.set(&pattern, 60_000));
        let (mut left_out, mut met) = (0, 0);
        for round in 0..200 {
            // A pixel is 1 mm on the film, 2 to 14 mm where the triangles are.
            let size = [2e-4, 1e-3, 3e-3, 0.1][round % 4];
            let v = triangles(size, &mut random);
            let kept = sieve.met(SimdLevel::best().level(), &film, (&v, None), 0xfeff);
            assert_eq!(kept & 0x100, 0, "one that was not asked for");
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                assert_eq!(sieve.met(level.level(), &film, (&v, None), 0xfeff), kept, "{}", level.name());
            }
            for lane in (0..LANES).filter(|lane| 0xfeff >> lane & 1 == 1) {
                let edges = edges(&film, &v, lane);
                let samples = pattern.batches.iter().flat_map(|batch| {
                    (0..LANES).filter(|lane| batch.live >> lane & 1 == 1).map(move |lane| (batch, lane))
                });
                let is_met = samples.clone().any(|(batch, lane)| {
                    let (u, v) = (f64::from(batch.u[lane]), f64::from(batch.v[lane]));
                    (0..256u32).any(|block| {
                        let corner = |block: u32| f64::from(2 * block) - 16.0;
                        let x = corner(block % 16) + f64::from(batch.x[lane]);
                        let y = corner(block / 16) + f64::from(batch.y[lane]);
                        let side = edges.map(|e| at(&e, [u, v, x, y]));
                        side.iter().all(|&s| s >= 0.0) || side.iter().all(|&s| s <= 0.0)
                    })
                });
                let is_kept = kept >> lane & 1 == 1;
                assert!(is_kept || !is_met, "left out, and met: {lane} of {v:?}");
                left_out += u32::from(!is_kept);
                met += u32::from(is_met);
            }
        }
        assert!(left_out > 500 && met > 300, "{left_out} left out, {met} met");
    }
}
