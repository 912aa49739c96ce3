//! The numbers of `render --stats`, and the clocks behind them.

use super::effects::EffectArguments;
use groundglass::picture::{Allocation, Exposure};
use groundglass::scene::{Budget, EffectChoice, EffectName, EffectSet, Scene};
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

/// The middle of the numbers, which it puts in order; of an even number of them the mean of the middle two.
pub(super) fn median(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    if numbers.len() % 2 == 1 { numbers[middle] } else { 0.5 * (numbers[middle - 1] + numbers[middle]) }
}

/// Notes that go into a picture file: how it was made, and nothing of clock, threads or machine.
pub(super) fn notes(scene: &Scene, exposure: &Exposure, left_out: EffectSet) -> Vec<(&'static str, String)> {
    let camera = scene.optics.camera();
    let standard = |s: &groundglass::camera::Standard| {
        format!(
            "tilt {} deg, swing {} deg, rise {} mm, shift {} mm",
            s.tilt.as_degrees(),
            s.swing.as_degrees(),
            s.rise.as_millimetres(),
            s.shift.as_millimetres()
        )
    };
    vec![
        ("Software", format!("groundglass {}", env!("CARGO_PKG_VERSION"))),
        ("groundglass.scene_hash", scene.hash()),
        (
            "groundglass.camera",
            format!(
                "focal length {} mm, aperture {} mm, extension {} mm; front: {}; rear: {}",
                camera.focal_length.as_millimetres(),
                camera.aperture_diameter() * 1e3,
                camera.extension.as_millimetres(),
                standard(&camera.front),
                standard(&camera.rear)
            ),
        ),
        ("groundglass.samples", {
            let Samples { mean, min, max } = Samples::of(exposure.samples());
            if min == max { min.to_string() } else { format!("{mean:.2} on average, {min} to {max}") }
        }),
        ("groundglass.effects", effects_note(scene, left_out)),
        (
            "groundglass.estimated_rms_error",
            exposure.rms_error().map_or("unknown".to_owned(), |error| format!("{error:.6}")),
        ),
    ]
}

/// What the user said of effects, in the words of the command line.
pub(super) fn words_of_effects(choice: EffectChoice) -> Vec<String> {
    let mut words = Vec::new();
    if choice.all {
        words.push("--all-effects".to_owned());
    }
    for (flag, set) in [("with", choice.with), ("without", choice.without)] {
        words.extend(set.iter().map(|effect| format!("--{flag} {effect}")));
    }
    words
}

/// The same, and what the plan left out.
fn effects_note(scene: &Scene, left_out: EffectSet) -> String {
    let words = words_of_effects(scene.render.effects);
    let mut note = if words.is_empty() { "as the scene asks".to_owned() } else { words.join(" ") };
    let small: Vec<_> = left_out.iter().map(EffectName::name).collect();
    if !small.is_empty() {
        note += &format!("; left out as too small to be seen: {}", small.join(", "));
    }
    note
}
