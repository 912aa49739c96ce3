//! The numbers of `render --stats`, and what a run was asked for.

use super::effects::EffectArguments;
use groundglass::picture::Allocation;
use groundglass::scene::{Budget, EffectName};
use serde::{Deserialize, Serialize};

#[derive(Serialize)]
pub(super) struct Stats {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) threads: usize,
    pub(super) load_seconds: f64,
    pub(super) render_seconds: f64,
    pub(super) cpu_seconds: f64,
    pub(super) samples_per_pixel: Samples,
    pub(super) estimated_rms_error: Option<f64>,
    /// For `--replay`: the samples of each block of 8 x 8 pixels, or one number for all.
    pub(super) allocation: String,
    pub(super) effects: Vec<groundglass::plan::Effect>,
    pub(super) simd: &'static str,
    pub(super) triangles: usize,
    /// What these make up: triangles that continue one another's plane and texture are one surface.
    pub(super) surfaces: usize,
    /// A triangle and a tile, or a square of tiles, each.
    pub(super) bin_entries: usize,
    pub(super) samples: u64,
    /// Groups of samples that were shaded together.
    pub(super) shading_requests: u64,
    /// Blocks whose samples may have missed a small bright light.
    pub(super) unseen_light_blocks: u64,
    pub(super) stages: groundglass::render::Stages,
    /// For `--replay`, too.
    pub(super) asked: Asked,
    pub(super) scene_hash: String,
    pub(super) version: &'static str,
}

/// What a run was asked for, by flag or key: where it was to end, and what decides which effects its picture has.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Asked {
    /// Samples for each pixel; the error that was to be reached; seconds: one of them.
    pub(super) samples: Option<u32>,
    pub(super) max_error: Option<f64>,
    pub(super) time_budget: Option<f64>,
    pub(super) all_effects: bool,
    pub(super) with: Vec<String>,
    pub(super) without: Vec<String>,
}

impl Asked {
    pub(super) fn new(budget: Budget, effects: &EffectArguments) -> Self {
        let names = |effects: &[EffectName]| effects.iter().map(|effect| effect.name().to_owned()).collect();
        let (samples, max_error, time_budget) = match budget {
            Budget::Samples(samples) => (Some(samples), None, None),
            Budget::MaxError(error) => (None, Some(error), None),
            Budget::Seconds(seconds) => (None, None, Some(seconds)),
        };
        Self {
            samples,
            max_error,
            time_budget,
            all_effects: effects.all_effects,
            with: names(&effects.with),
            without: names(&effects.without),
        }
    }
}

#[derive(Serialize)]
pub(super) struct Samples {
    pub(super) mean: f64,
    pub(super) min: u32,
    pub(super) max: u32,
}

impl Samples {
    pub(super) fn of(allocation: &Allocation) -> Self {
        let (min, max) = allocation.range();
        Self { mean: allocation.mean(), min, max }
    }
}
