//! Where the time goes: seconds by stage, measured where the caller lends a clock.

use serde::Serialize;

/// Seconds by the clock that the stages took, all 0 without [`Execution::clock`](super::Execution::clock). Those of tiles, from
/// `setup` to `resolve`, are summed over the threads: where others use the processors too they add up to more than the CPU time.
/// The others are the time that passed, however many threads had a part in it.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Stages {
    /// Which effects are in: [`RenderPlan`](crate::plan::RenderPlan).
    pub plan: f64,
    /// Vertices into the lens frame.
    pub transform: f64,
    /// Boxes, order and bins of triangles.
    pub bin: f64,
    /// What surfaces look like, the hierarchy for the sun's shadows, small bright lights.
    pub prepare: f64,
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
    /// In rounds, what is done between them and at the end: which blocks get how many samples, and the picture from its sums.
    pub rounds: f64,
}

impl Stages {
    pub(super) fn add(&mut self, more: &Self) {
        let Self { plan, transform, bin, prepare, setup, coverage, group, shading, resolve, rounds } = more;
        self.plan += plan;
        self.transform += transform;
        self.bin += bin;
        self.prepare += prepare;
        self.setup += setup;
        self.coverage += coverage;
        self.group += group;
        self.shading += shading;
        self.resolve += resolve;
        self.rounds += rounds;
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

    /// What passed since the last call is no stage's.
    pub(super) fn skip(&mut self) {
        self.lap(&mut 0.0);
    }

    pub(super) fn clock(&self) -> Option<&'a (dyn Fn() -> f64 + Sync)> {
        self.clock
    }
}
