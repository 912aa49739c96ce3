//! Memory that drawing takes, asked for before it is used: sizes in, an error or go-ahead out.

use super::diffraction::RINGS;
use super::highlights::Highlights;
use super::lamps;
use super::prepared::Sequence;
use super::{Execution, too_large};
use crate::error::{Error, ErrorKind, Result, memory};
use crate::picture::BLOCK;
use crate::raster::TILE;
use crate::raster::bin::Bins;
use crate::raster::candidate::MOST_SURFACES;
use crate::sampling::Diffraction;
use crate::sampling::runs::{FIRST_RUN, MOST_SAMPLES};
use crate::scene::Scene;
use bytemuck::Zeroable;
use bytemuck::allocation::try_zeroed_vec;

/// Bytes for each triangle: whether it is cut out, its place in the order, its box where it crosses the frustum, and the
/// lists of tiles, in which it has 16 entries at most and few as a rule. This is asked for, since nobody knows before how many;
/// what is taken of it is a third as a rule (`docs/performance.md` says how much; `tests/cli_memory.rs` holds it to 400).
const TRIANGLE: u64 = 700;

/// Bytes for each triangle of a tile that a thread sets up; its lists may have grown to double.
const SETUP: u64 = 2 * 672;

/// The same where most are far out of focus: of these a tile lists those that it sees, with a bit for each lens point.
const LISTED: u64 = 2 * (12 + LISTED_UP_TO as u64 / 8);

/// Bytes for each sample of a run, a thread: where it lies, and sorted into batches.
const SAMPLE: u64 = 160;

/// With more samples than these they may be set up like others.
const LISTED_UP_TO: u32 = 512;

/// Cells of the lens for each of which a vertex has a box of its own: the most there are.
const CELLS: u64 = 16;

/// What may yet be taken.
pub(super) struct Room {
    left: u64,
    threads: u64,
    /// Bytes for each triangle far out of focus, a thread.
    loose: u64,
}

impl Room {
    /// Asks for the picture, for vertices and triangles, and for what each thread holds whatever a tile has in it.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`], saying how much it is.
    pub(super) fn new(scene: &Scene, sequence: Sequence, execution: &Execution<'_>) -> Result<Self> {
        let count = |length: usize| length as u64;
        let (vertices, triangles) = (scene.surfaces.positions.len(), scene.surfaces.triangles.len());
        if triangles >= MOST_SURFACES {
            let message = format!("a scene of {triangles} triangles is too large to draw");
            return Err(Error::new(ErrorKind::TooLarge, message)
                .remedy(format!("leave out meshes: less than {MOST_SURFACES} can be drawn")));
        }
        let tiles = |side: u32| u64::from(side.div_ceil(TILE));
        let tiles = tiles(scene.render.width) * tiles(scene.render.height);
        let pixels = tiles * u64::from(TILE * TILE);
        // Of more threads than tiles some draw nothing.
        let threads = count(rayon::current_num_threads()).min(tiles);
        // The exposure, with the sums of a picture that comes in rounds.
        let (pixel, samples) = match sequence {
            Sequence::Uniform(samples) => (12, samples),
            Sequence::Runs(longest) => (26, longest),
        };
        let pixel = pixel + if execution.error_map { 4 } else { 0 };
        // Corners and boxes in the sun's frame.
        let shadows = scene.sun.as_ref().is_some_and(|sun| sun.shadows);
        let shadows = if shadows { count(vertices) * 12 + count(triangles) * 120 } else { 0 };
        let pattern = if scene.render.diffraction { Diffraction::MEMORY } else { 0 };
        // Before they are compacted twice as much.
        let lights = if lamps::may_be_any(scene) {
            let disks = if scene.render.diffraction { RINGS.len() as u64 } else { 1 };
            pixels / u64::from(BLOCK * BLOCK) * (disks + 1) * Highlights::BLOCK_BYTES
        } else {
            0
        };
        let shared = pattern
            + lights
            + shadows
            + pixels * pixel
            + count(vertices) * (24 + 8 * CELLS)
            + count(triangles) * TRIANGLE;
        // Where it met each surface, the samples of a pixel, sorted, and what a tile shows, with its groups.
        let each = count(triangles) * 8 + u64::from(samples) * SAMPLE + (3 << 20);
        let (need, most) = (shared + threads * each, execution.memory.unwrap_or(u64::MAX));
        if need > most {
            let (width, height) = (scene.render.width, scene.render.height);
            let message = format!(
                "a picture of {width} x {height} pixels of {triangles} triangles needs about {} to draw, and {} are left",
                memory(need),
                memory(most)
            );
            return Err(Error::new(ErrorKind::TooLarge, message)
                .remedy("ask for a smaller width or fewer threads, or allow more memory"));
        }
        let loose = if samples > LISTED_UP_TO { SETUP } else { LISTED };
        Ok(Self { left: most - need, threads, loose })
    }

    /// Asks for what the threads need to set up their tiles; tells how many samples of a run, a power of two, there is room for then.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] when the fullest are too full.
    pub(super) fn check_tiles(&self, bins: &Bins) -> Result<u32> {
        let each = (bins.fullest() as u64).saturating_mul(SETUP);
        let loose = (bins.loose() as u64).saturating_mul(self.loose);
        let need = each.saturating_add(loose).saturating_mul(self.threads);
        if need > self.left {
            let message = format!(
                "so many triangles may be seen at one place that drawing it takes {}, and {} are left",
                memory(need),
                memory(self.left)
            );
            return Err(Error::new(ErrorKind::TooLarge, message)
                .remedy("thin out the meshes, ask for fewer threads, or allow more memory"));
        }
        Ok(longest_run((self.left - need) / self.threads.max(1)))
    }
}

/// That many zeros, if there is room. The system gives them page by page as they are used: filling a large picture here would
/// take seconds, and a small one 4 % of the time of 64 samples.
pub(super) fn zeroed<T: Zeroable>(count: usize) -> Result<Vec<T>> {
    try_zeroed_vec(count).map_err(|()| too_large())
}

/// How many samples, a power of two, of a run fit into so many bytes; those of a first run are asked for before.
fn longest_run(bytes: u64) -> u32 {
    1 << (bytes / SAMPLE).clamp(FIRST_RUN.into(), MOST_SAMPLES.into()).ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_as_long_as_there_is_memory_for() {
        assert_eq!(longest_run(0), FIRST_RUN);
        assert_eq!(longest_run(u64::MAX), MOST_SAMPLES);
        for bytes in [5000, 1 << 20, 100_000_000] {
            let samples = u64::from(longest_run(bytes));
            assert!(samples.is_power_of_two() && samples * SAMPLE <= bytes && bytes < 2 * samples * SAMPLE);
        }
    }
}
