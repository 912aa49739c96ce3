//! The ways to spend time on a picture that a study compares, and the settings of each.

use super::{approximation, reference};
use groundglass::error::Result;
use groundglass::picture::Exposure;
use groundglass::render::{Execution, render};
use groundglass::sampling::PointSet;
use groundglass::scene::{Budget, EffectName, EffectSet, Scene};

/// One way at one setting.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Step {
    /// What it is called in table and charts.
    pub(super) way: String,
    pub(super) setting: Setting,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Setting {
    /// So many samples of every pixel.
    Samples(u32),
    /// The error that so many uniform samples stated.
    ErrorOf(u32),
    /// A pinhole picture of so many samples, blurred by what each pixel's depth asks for.
    Approximation(u32),
    /// So many samples of every pixel in double precision.
    Double(u32),
}

impl Setting {
    pub(super) fn name(self) -> String {
        match self {
            Self::Samples(n) | Self::Double(n) => format!("N = {n}"),
            Self::ErrorOf(n) => format!("error of N = {n}"),
            // Of another name than until the sky was blurred: rows of a study that is gone on with are of one way.
            Self::Approximation(n) => format!("blurred pinhole of N = {n}"),
        }
    }
}

/// The way that all others are compared with.
pub(super) const UNIFORM: &str = "uniform";
pub(super) const ADAPTIVE: &str = "adaptive";
const UNSHARED: &str = "unshared shading";
pub(super) const APPROXIMATION: &str = "pinhole and blur";

/// In which turn a quick study, which may not come to all of them, measures a step: first what its words are made of, then each
/// way once, then the rest of the ladder, and at last what takes long.
pub(super) fn turn(step: &Step) -> u32 {
    let is_ladder = step.way == UNIFORM || step.way == ADAPTIVE;
    match step.setting {
        Setting::Samples(16 | 64) | Setting::ErrorOf(16 | 64) if is_ladder => 0,
        Setting::Approximation(_) => 1,
        Setting::Samples(64) => 2,
        Setting::Samples(_) | Setting::ErrorOf(_) => 3,
        Setting::Double(_) => 4,
    }
}

/// All steps of a scene with these effects, in the order in which they are told and, where all are, measured; those in double precision
/// where that draws the scene.
pub(super) fn ladder(active: EffectSet, has_double: bool, quick: bool) -> Vec<Step> {
    let counts: &[u32] = if quick { &[4, 16, 64, 256] } else { &[4, 16, 64, 256, 1024] };
    let few: &[u32] = if quick { &[16, 64] } else { &[16, 64, 256] };
    let step = |way: &str, setting| Step { way: way.to_owned(), setting };
    let mut steps: Vec<Step> = counts.iter().map(|&n| step(UNIFORM, Setting::Samples(n))).collect();
    // The error of 4 samples is reached by the first 16.
    steps.extend(counts[1..].iter().map(|&n| step(ADAPTIVE, Setting::ErrorOf(n))));
    if active.has(EffectName::Defocus) {
        // Two, so that what more samples leave is told from chance.
        steps.extend([16, 256].map(|n| step(APPROXIMATION, Setting::Approximation(n))));
    }
    if has_double {
        let textured = active.has(EffectName::Textures);
        let filters = &reference::FILTERS[..if textured { reference::FILTERS.len() } else { 1 }];
        steps.extend(filters.iter().map(|(_, way)| step(way, Setting::Double(16))));
    }
    for name in active.iter() {
        steps.push(step(&format!("without {name}"), Setting::Samples(64)));
    }
    for set in PointSet::ALL.into_iter().filter(|&set| set != PointSet::default()) {
        steps.extend(few.iter().map(|&n| step(&format!("{set} points"), Setting::Samples(n))));
    }
    steps.extend(few.iter().map(|&n| step(UNSHARED, Setting::Samples(n))));
    steps
}

/// Draws a step's picture; `error` is what [`Setting::ErrorOf`] asks for. The scene is as it was afterwards. (A copy of it was
/// some hundredths of the time.)
pub(super) fn draw(scene: &mut Scene, step: &Step, error: f64, execution: Execution<'_>) -> Result<Exposure> {
    let settings = scene.render;
    let drawn = draw_as_told(scene, step, error, execution);
    scene.render = settings;
    drawn
}

/// Draws without an effect, whatever else is asked for.
pub(super) fn leave_out(scene: &mut Scene, name: EffectName) {
    let effects = &mut scene.render.effects;
    (effects.with, effects.without) = (effects.with.set(name, false), effects.without.set(name, true));
}

fn draw_as_told(scene: &mut Scene, step: &Step, error: f64, execution: Execution<'_>) -> Result<Exposure> {
    if let Some(set) = PointSet::ALL.into_iter().find(|set| step.way == format!("{set} points")) {
        scene.render.points = set;
    }
    if let Some(name) = EffectName::ALL.into_iter().find(|name| step.way == format!("without {name}")) {
        leave_out(scene, name);
    }
    scene.render.share_shading = step.way != UNSHARED;
    match step.setting {
        Setting::Samples(n) => scene.render.budget = Budget::Samples(n),
        Setting::ErrorOf(_) => scene.render.budget = Budget::MaxError(error),
        Setting::Approximation(n) => {
            scene.render.budget = Budget::Samples(n);
            return approximation::draw(scene, execution);
        }
        Setting::Double(n) => {
            let found = reference::FILTERS.into_iter().find(|(_, way)| step.way == *way);
            let (filter, _) = found.unwrap_or(reference::FILTERS[0]);
            return reference::draw(scene, filter, n, execution);
        }
    }
    Ok(render(scene, execution)?.0)
}
