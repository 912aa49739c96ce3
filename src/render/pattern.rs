//! The samples of a tile, sorted into batches of 16 that lie close together on the lens and in the pixel.
//!
//! In: a tile, and a run of the sequence of samples (`sampling`). Out: a [`Pattern`] (`raster::view`), for [`super::draw`], or
//! first for [`super::diffraction`]. A sample's cluster is the number with the binary digits `floor(2^k c) mod 2`, `k` = 1, 2 and
//! so on, of its four coordinates `c` in turn; every 16 of a cluster are a batch.
//!
//! Samples are split in turn by place on the lens (a, then b) and in the pixel (x, then y):
//! elementary intervals of the four-dimensional sequence, of which each holds the same number of points
//! (Sobol's has quality t = 3 in four dimensions, so any interval of 8 points' volume holds 8). A batch is
//! then both tight on the lens, which keeps triangles' boxes small, and tight in what its samples see of a
//! texture, so that they may share a look-up.

use crate::raster::LANES;
use crate::raster::batch::{Batch, LensCell, Pattern};
use crate::sampling::runs::Run;
use crate::sampling::{self, ApertureShape, PointSet, Sample};

/// How often each dimension of a sample is halved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Splits {
    /// Pixel x, lens a, pixel y, lens b.
    bits: [u32; 4],
    /// How often the lens is halved along each axis into cells whose triangles are told apart.
    lens_bits: [u32; 2],
}

/// From so many samples on the lens is divided into cells: their boxes take longer to make than to do without before. (At 64 as
/// many as 2 % of a picture's time, 7 % of what is blurred at f/0.5; at 256 they save 2 % and 5 %.)
const CELLS_FROM: u32 = 256;

/// More cells of the lens would cost more in boxes than they save in visits.
const MOST_LENS_BITS: u32 = 2;

impl Splits {
    /// One cluster for each 16 samples.
    pub(super) fn new(samples: u32) -> Self {
        let splits = (samples / LANES as u32).max(1).ilog2();
        let bits = ORDER.map(|turn| (splits + 3 - turn) / 4);
        Self { bits, lens_bits: [0; 2] }
    }

    /// Those of all samples of a picture; with diffraction, which divides cells further, only four cells of the lens.
    pub(super) fn uniform(samples: u32, has_diffraction: bool) -> Self {
        let all = Self::new(samples);
        let most = if has_diffraction { 1 } else { MOST_LENS_BITS };
        let lens_bits = if samples < CELLS_FROM { [0; 2] } else { [1, 3].map(|i| all.bits[i].min(most)) };
        Self { lens_bits, ..all }
    }

    /// The steps in which a picture of so many samples is drawn: all at once or, where that would leave batches half
    /// empty, by the powers of two that they are the sum of. (96 in one took 12.8 ns a sample on the tower, 64 take 9.5.)
    pub(super) fn steps(samples: u32, has_diffraction: bool) -> Vec<(Run, Self)> {
        let lanes = LANES as u32;
        let clusters = Self::new(samples).clusters() as u32;
        let at_once = clusters * samples.div_ceil(clusters).div_ceil(lanes);
        if at_once * 8 < samples.div_ceil(lanes) * 9 {
            let all = Run { first: 0, count: samples };
            return vec![(all, Self::uniform(samples, has_diffraction))];
        }
        let mut first = 0;
        std::iter::from_fn(|| {
            let left = samples - first;
            let count = if left < lanes { left } else { 1 << left.ilog2() };
            let run = Run { first, count };
            first += count;
            (count > 0).then(|| (run, Self::new(count)))
        })
        .collect()
    }

    /// The number of clusters.
    fn clusters(self) -> usize {
        1 << self.bits.iter().sum::<u32>()
    }

    /// The cluster of a sample, and the cell of the lens that it lies in.
    fn place(self, sample: &Sample) -> (usize, usize) {
        let coordinates = [sample.pixel[0], sample.square[0], sample.pixel[1], sample.square[1]];
        let interval = |dimension: usize, bits: u32| {
            ((coordinates[dimension] * (1u32 << bits) as f32) as usize).min((1 << bits) - 1)
        };
        // Split by split, so that clusters with neighbouring numbers lie close together, too.
        let splits = self.bits.iter().sum::<u32>();
        let cluster = (0..splits).fold(0, |sum, split| {
            let dimension = DIMENSIONS[split as usize % 4];
            sum << 1 | interval(dimension, split / 4 + 1) & 1
        });
        let [a, b] = self.lens_bits;
        (cluster, interval(3, b) << a | interval(1, a))
    }

    /// The cells of the lens, each with a circle around it.
    pub(super) fn lens_cells(self, shape: &ApertureShape, radius: f64) -> Vec<LensCell> {
        let [a, b] = self.lens_bits;
        let (across, down) = (1u32 << a, 1u32 << b);
        if a + b == 0 || radius == 0.0 {
            return vec![
                LensCell { u: 0.0, v: 0.0, radius: 1.0, displacement: [0.0; 2] };
                (across * down) as usize
            ];
        }
        let map = |x: f64, y: f64| {
            let [u, v] = shape.from_square([x as f32, y as f32]);
            (f64::from(u), f64::from(v))
        };
        (0..across * down)
            .map(|cell| {
                let (column, row) = (f64::from(cell % across), f64::from(cell / across));
                let at = |x: f64, y: f64| map((column + x) / f64::from(across), (row + y) / f64::from(down));
                // The map is continuous and one to one, so the farthest point lies on the cell's border.
                let steps = 64;
                let border: Vec<_> = (0..=steps)
                    .flat_map(|i| {
                        let t = f64::from(i) / f64::from(steps);
                        [at(t, 0.0), at(t, 1.0), at(0.0, t), at(1.0, t)]
                    })
                    .collect();
                // A polygon's corner may lie between two steps, no farther from the nearer than they from each other.
                let between = match shape {
                    ApertureShape::Disk => 0.0,
                    ApertureShape::Polygon { .. } => border
                        .iter()
                        .zip(&border[4..])
                        .map(|(p, q)| libm::hypot(p.0 - q.0, p.1 - q.1))
                        .fold(0.0, f64::max),
                };
                let middle = |low: f64, high: f64| 0.5 * (low + high);
                let range = |pick: fn(&(f64, f64)) -> f64| {
                    let values = border.iter().map(pick);
                    middle(
                        values.clone().fold(f64::INFINITY, f64::min),
                        values.fold(f64::NEG_INFINITY, f64::max),
                    )
                };
                let (u, v) = (range(|p| p.0), range(|p| p.1));
                let reach = border.iter().map(|&(bu, bv)| libm::hypot(bu - u, bv - v)).fold(0.0, f64::max);
                LensCell { u, v, radius: (reach + between) * 1.001 + 1e-4, displacement: [0.0; 2] }
            })
            .collect()
    }
}

/// In which turn each dimension is split: the lens first, since what is out of focus shows more triangles
/// within the aperture than within a pixel (2.5 groups a pixel and batch on the tower instead of 3.1).
const ORDER: [u32; 4] = [2, 0, 3, 1];

/// The dimension of each turn.
const DIMENSIONS: [usize; 4] = [1, 3, 0, 2];

/// Where the samples of a picture come from.
#[derive(Clone, Copy)]
pub(super) struct Points {
    pub set: PointSet,
    pub shape: ApertureShape,
    pub seed: u64,
}

/// The samples of `run` in tile `(tx, ty)` of a picture with `samples` a pixel or, where they go on, at least 16.
/// They pass through an aperture of this shape. None more are made when `stop` says so.
pub(super) fn pattern(
    points: &Points,
    (tx, ty): (u32, u32),
    samples: u32,
    run: Run,
    splits: Splits,
    stop: &dyn Fn() -> bool,
) -> Pattern {
    // Below 9 samples a batch serves several pixels, so that most of its lanes are in use.
    let (block_width, block_height) = sampling::block(samples);
    let mut members: Vec<Vec<(u32, u32, usize, Sample)>> = vec![Vec::new(); splits.clusters()];
    for replicate in 0..2 {
        for pixel in 0..block_width * block_height {
            let (x, y) = (pixel % block_width, pixel / block_width);
            let stream = sampling::pixel_stream(tx * sampling::GRID + x, ty * sampling::GRID + y, samples);
            for index in (run.first + replicate..run.end()).step_by(2) {
                let sample = sampling::sample_of(points.set, &points.shape, points.seed, stream, index);
                let (cluster, cell) = splits.place(&sample);
                members[cluster].push((index, pixel, cell, sample));
                if index % 4096 < 2 && stop() {
                    break;
                }
            }
        }
    }
    let mut batches = Vec::new();
    for chunk in members.iter().flat_map(|cluster| cluster.chunks(LANES)) {
        let mut batch = Batch::of_cell(chunk[0].2);
        for (lane, &(index, pixel, _, sample)) in chunk.iter().enumerate() {
            batch.u[lane] = sample.lens[0];
            batch.v[lane] = sample.lens[1];
            batch.x[lane] = (pixel % block_width) as f32 + sample.pixel[0];
            batch.y[lane] = (pixel / block_width) as f32 + sample.pixel[1];
            batch.pixel[lane] = pixel as u8;
            batch.index[lane] = index;
            batch.live |= 1 << lane;
            batch.odd |= ((index & 1) as u16) << lane;
        }
        batches.push(batch);
        if batches.len() % 1024 == 0 && stop() {
            break;
        }
    }
    Pattern { block_bits: [block_width, block_height].map(u32::trailing_zeros), batches }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_of_a_power_of_two_hold_sixteen_samples_eight_of_each_half() {
        for samples in [16, 32, 64, 256, 1024, 4096] {
            let points = Points { set: PointSet::Sobol, shape: ApertureShape::Disk, seed: 3 };
            let pattern = pattern(
                &points,
                (5, 7),
                samples,
                Run { first: 0, count: samples },
                Splits::new(samples),
                &|| false,
            );
            assert_eq!(pattern.batches.len() as u32, samples / 16);
            for batch in &pattern.batches {
                assert_eq!((batch.live, batch.odd.count_ones()), (0xffff, 8));
            }
        }
    }

    #[test]
    fn steps_hold_each_sample_once_and_fill_their_batches() {
        for samples in 1..3000 {
            let steps = Splits::steps(samples, false);
            let mut next = 0;
            let mut batches = 0;
            for (run, splits) in &steps {
                assert_eq!(run.first, next, "{samples}");
                next += run.count;
                let clusters = splits.clusters() as u32;
                batches += clusters * run.count.div_ceil(clusters).div_ceil(16);
            }
            assert_eq!(next, samples);
            assert!(batches * 8 < samples.div_ceil(16) * 9 || steps.len() > 1, "{samples}: {batches}");
            assert!(steps.len() == 1 || batches == samples.div_ceil(16), "{samples}: {batches}");
        }
        assert_eq!(Splits::steps(64, false).len(), 1);
        assert_eq!(
            Splits::steps(100, false).iter().map(|(run, _)| run.count).collect::<Vec<_>>(),
            [64, 32, 4]
        );
    }

    #[test]
    fn every_sample_is_there_once_and_in_its_cell() {
        for samples in [1, 2, 3, 7, 8, 16, 37, 100, 500] {
            for blades in [0, 3, 4, 5, 9] {
                let shape = match blades {
                    0 => ApertureShape::Disk,
                    _ => ApertureShape::Polygon { blades, rotation: 0.4 },
                };
                check(&shape, samples);
            }
        }
    }

    fn check(shape: &ApertureShape, samples: u32) {
        let splits = Splits::uniform(samples, false);
        let cells = splits.lens_cells(shape, 1.0);
        let points = Points { set: PointSet::Sobol, shape: *shape, seed: 0 };
        let pattern = pattern(&points, (0, 0), samples, Run { first: 0, count: samples }, splits, &|| false);
        let pixels = 1 << pattern.block_bits.iter().sum::<u32>();
        let mut seen = vec![0; (samples * pixels) as usize];
        for batch in &pattern.batches {
            for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
                seen[(batch.index[lane] * pixels + u32::from(batch.pixel[lane])) as usize] += 1;
                let cell = cells[batch.cell];
                let (u, v) = (f64::from(batch.u[lane]), f64::from(batch.v[lane]));
                assert!(libm::hypot(u - cell.u, v - cell.v) <= cell.radius);
            }
        }
        assert!(seen.iter().all(|&count| count == 1), "{shape:?} {samples}");
    }
}
