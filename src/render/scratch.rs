//! What a thread keeps from tile to tile, and the sums of the tile that it draws.
//!
//! For [`super::draw`]. In: a tile's sums so far. Out: these with what was drawn. In between they are held as registers hold them, and of
//! long runs in two parts: `sum = far + near`.

use super::looks::Looks;
use super::pattern::Splits;
use super::resolve::Sum;
use crate::raster::group::Groups;
use crate::raster::visibility::REGION;
use crate::raster::{self, TILE};
use crate::sampling::runs::Run;
use crate::shade::LookUps;
use glam::Vec4;
use std::cell::RefCell;
use std::sync::Mutex;

/// A run of samples, how it is sorted into batches, and the regions of the tile that take part (bit `8 row + column`).
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub run: Run,
    pub splits: Splits,
    pub wanted: u64,
}

/// What one thread reuses from tile to tile.
#[derive(Default)]
pub(super) struct TileScratch {
    pub raster: raster::tile::TileScratch,
    pub groups: Groups,
    pub looks: RefCell<Looks>,
    pub look_ups: LookUps,
    /// What stood before the sun last.
    pub last_occluder: u32,
    /// The sums with the step that is being drawn, as registers hold them; and those of samples that look by themselves.
    pub sums: Vec<[Vec4; 2]>,
    pub beside: Vec<[Vec4; 2]>,
    /// Of long runs those of what was drawn before.
    far: [Vec<[Vec4; 2]>; 2],
}

impl TileScratch {
    /// Begins a long run: what was drawn before is kept apart.
    pub(super) fn keep_far(&mut self) {
        for (drawn, far) in [&self.sums, &self.beside].into_iter().zip(&mut self.far) {
            far.clear();
            far.resize(drawn.len(), [Vec4::ZERO; 2]);
        }
        self.move_far();
    }

    /// Adds what was drawn since to what is kept apart.
    pub(super) fn move_far(&mut self) {
        move_on(&mut self.sums, &mut self.far[0]);
        move_on(&mut self.beside, &mut self.far[1]);
    }

    /// Brings both together.
    pub(super) fn join_far(&mut self) {
        move_on(&mut self.far[0], &mut self.sums);
        move_on(&mut self.far[1], &mut self.beside);
    }
}

/// A scratch that goes back to its picture. (Rayon's `map_init` makes its value anew each time that it divides the work, and moves it
/// from function to function: a scratch holds a number for each surface of the scene, and takes 19 KB itself.)
pub(super) struct Borrowed<'a> {
    /// Made when first asked for.
    scratch: Option<Box<TileScratch>>,
    idle: &'a Mutex<Vec<Box<TileScratch>>>,
}

impl<'a> Borrowed<'a> {
    /// One of these, or a new one.
    pub(super) fn of(idle: &'a Mutex<Vec<Box<TileScratch>>>) -> Self {
        Self { scratch: idle.lock().ok().and_then(|mut idle| idle.pop()), idle }
    }

    pub(super) fn get(&mut self) -> &mut TileScratch {
        self.scratch.get_or_insert_default()
    }
}

impl Drop for Borrowed<'_> {
    fn drop(&mut self) {
        if let (Some(scratch), Ok(mut idle)) = (self.scratch.take(), self.idle.lock()) {
            idle.push(scratch);
        }
    }
}

/// Adds sums to others, and begins them again.
fn move_on(from: &mut [[Vec4; 2]], to: &mut [[Vec4; 2]]) {
    for (from, to) in from.iter_mut().zip(to) {
        *to = [to[0] + from[0], to[1] + from[1]];
        *from = [Vec4::ZERO; 2];
    }
}

/// Makes `drawn` the sums that a step goes on from, except where earlier steps drew.
pub(super) fn take_up(step: &Step, held: u64, sums: &mut [Sum], drawn: &mut Vec<[Vec4; 2]>) {
    drawn.resize(sums.len(), [Vec4::ZERO; 2]);
    each_wanted(step.wanted & !held, sums, drawn, |sums, drawn| {
        *drawn =
            if step.run.first == 0 { [Vec4::ZERO; 2] } else { sums.map(|[r, g, b]| Vec4::new(r, g, b, 0.0)) };
    });
}

/// Makes what a step drew the sums.
pub(super) fn put_down(step: &Step, sums: &mut [Sum], drawn: &mut [[Vec4; 2]]) {
    each_wanted(step.wanted, sums, drawn, |sums, drawn| {
        *sums = drawn.map(|half| half.truncate().to_array());
    });
}

/// Does something with each pixel's sums in the regions of 4 x 4 pixels that are `wanted`: of pictures whose blocks are single pixels.
fn each_wanted<A, B>(wanted: u64, sums: &mut [A], drawn: &mut [B], with: impl Fn(&mut A, &mut B)) {
    let row = (TILE * REGION as u32) as usize;
    for (y, (sums, drawn)) in sums.chunks_exact_mut(row).zip(drawn.chunks_exact_mut(row)).enumerate() {
        let columns = wanted >> (8 * y) & 0xff;
        let pixels = sums.chunks_exact_mut(REGION).zip(drawn.chunks_exact_mut(REGION)).enumerate();
        for (_, (sums, drawn)) in pixels.filter(|(x, _)| columns >> (x % 8) & 1 == 1) {
            sums.iter_mut().zip(drawn).for_each(|(sums, drawn)| with(sums, drawn));
        }
    }
}
