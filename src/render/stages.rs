//! Where the time goes: seconds by stage, measured where the caller lends a clock.

use serde::Serialize;

/// Seconds that the stages took, summed over the threads; all 0 without [`Execution::clock`](super::Execution::clock).
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Stages {
    /// Vertices into the lens frame.
    pub transform: f64,
    /// Boxes, order and bins of triangles.
    pub bin: f64,
    /// The samples of each tile, and the edge functions of its triangles.
    pub setup: f64,
    /// Coverage and depth, holes included.
    pub coverage: f64,
    /// Samples sorted by what they see.
    pub group: f64,
    /// Light and texture.
    pub shading: f64,
    /// Sums to means, and the error.
    pub resolve: f64,
}

impl Stages {
    pub(super) fn add(&mut self, more: &Self) {
        let Self { transform, bin, setup, coverage, group, shading, resolve } = more;
        self.transform += transform;
        self.bin += bin;
        self.setup += setup;
        self.coverage += coverage;
        self.group += group;
        self.shading += shading;
        self.resolve += resolve;
    }
}

/// Measures stages where there is a clock.
#[derive(Clone, Copy)]
pub(super) struct Stopwatch<'a> {
    clock: Option<&'a (dyn Fn() -> f64 + Sync)>,
    last: f64,
}

impl<'a> Stopwatch<'a> {
    pub(super) fn start(clock: Option<&'a (dyn Fn() -> f64 + Sync)>) -> Self {
        Self { clock, last: clock.map_or(0.0, |clock| clock()) }
    }

    /// Adds the time since the last call.
    pub(super) fn lap(&mut self, stage: &mut f64) {
        if let Some(clock) = self.clock {
            let now = clock();
            *stage += now - self.last;
            self.last = now;
        }
    }

    pub(super) fn clock(&self) -> Option<&'a (dyn Fn() -> f64 + Sync)> {
        self.clock
    }
}
