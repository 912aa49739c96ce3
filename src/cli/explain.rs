//! `groundglass explain SCENE`: which effects are in its picture, because of which number, what each costs and what leaving
//! it out changes.
//!
//! Cost and change are measured: small pictures of the scene with and without each effect, of the same samples.

use super::effects::EffectArguments;
use super::input::{self, MemoryArguments, SceneArguments};
use super::values::Pixels;
use super::{interrupt, optics_words, report, stats};
use groundglass::error::Result;
use groundglass::picture::Exposure;
use groundglass::plan::RenderPlan;
use groundglass::render::{Execution, render};
use groundglass::scene::{Budget, EffectChoice, EffectName, EffectSet, Scene};
use serde::Serialize;
use std::time::Instant;

/// Width and samples of the small pictures.
const PROBE: (u32, u32) = (160, 64);

/// How often each is timed; the shortest counts.
const TIMES: u32 = 3;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    #[command(flatten)]
    pub(super) effects: EffectArguments,
    /// Width of the picture in pixels; the height follows
    #[arg(long, value_name = "PX")]
    pub(super) width: Option<Pixels>,
    /// Print JSON instead of text
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Serialize)]
struct Explanation {
    /// What may change by all that is left out as too small: RMS over the picture, linear light.
    tolerance_rms: f64,
    effects: Vec<Row>,
    scene_hash: String,
    version: &'static str,
}

#[derive(Serialize)]
struct Row {
    effect: &'static str,
    active: bool,
    because: String,
    /// The part of the time for the picture that the effect takes, or would take; null where it cannot be had.
    cost: Option<f64>,
    /// RMS change of the picture between with and without; null where it cannot be had.
    change_rms: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let threads = stats::threads(None);
    let input = input::read(&arguments.scene)?.within(arguments.memory, threads);
    let mut scene = input.load_at(arguments.width.map(|width| width.0))?;
    arguments.effects.apply(&mut scene)?;
    report::warnings(&optics_words::warnings(&scene.optics, &input.name()));
    report::warnings(&optics_words::scene_warnings(&scene, &input.name()));
    report::warnings(&scene.warnings);
    let memory = input.room();
    let explanation = interrupt::polled(|cancel| {
        explain(
            &scene,
            Execution { threads: Some(threads), memory, cancel: Some(cancel), ..Execution::default() },
        )
    })?;
    if arguments.json { report::print_json(&explanation) } else { report::print(&words(&explanation)) }
}

fn explain(scene: &Scene, execution: Execution<'_>) -> Result<Explanation> {
    let plan = RenderPlan::new(scene);
    let mut small = scene.clone();
    let height = f64::from(scene.render.height) * f64::from(PROBE.0) / f64::from(scene.render.width);
    (small.render.width, small.render.height) = (PROBE.0, (height.round() as u32).clamp(1, 4 * PROBE.0));
    small.render.budget = Budget::Samples(PROBE.1);
    // Nothing can be measured where the picture would be refused.
    let can_render = !scene.optics.film_reaches_aperture();
    let base = if can_render { Some(probe(&small, plan.active(), execution)?) } else { None };
    let mut effects = Vec::new();
    for (name, effect) in EffectName::ALL.into_iter().zip(plan.effects()) {
        // What is not asked for, or not there, is nothing to compare.
        let is_dropped = !effect.active && effect.because.contains("threshold");
        let measured = match &base {
            Some(base) if effect.active || is_dropped => {
                let other = probe(&small, plan.active().set(name, !effect.active), execution)?;
                let (with, without) = if effect.active { (base, &other) } else { (&other, base) };
                let cost = (with.seconds - without.seconds) / base.seconds;
                Some((cost, with.picture.rms_difference(&without.picture, scene.render.exposure_ev)))
            }
            _ => None,
        };
        effects.push(Row {
            effect: effect.effect,
            active: effect.active,
            because: effect.because.clone(),
            cost: measured.map(|(cost, _)| cost),
            change_rms: measured.map(|(_, change)| change),
        });
    }
    Ok(Explanation {
        tolerance_rms: plan.tolerance(),
        effects,
        scene_hash: scene.hash(),
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// A small picture and the time it took.
struct Probe {
    picture: Exposure,
    seconds: f64,
}

fn probe(scene: &Scene, active: EffectSet, execution: Execution<'_>) -> Result<Probe> {
    let mut scene = scene.clone();
    let inactive = EffectName::ALL.into_iter().filter(|&effect| !active.has(effect)).collect();
    scene.render.effects = EffectChoice { all: false, with: active, without: inactive };
    let mut best: Option<Probe> = None;
    for _ in 0..TIMES {
        let start = Instant::now();
        let (picture, _) = render(&scene, execution)?;
        let seconds = start.elapsed().as_secs_f64();
        if best.as_ref().is_none_or(|best| seconds < best.seconds) {
            best = Some(Probe { picture, seconds });
        }
    }
    // There is one: it was drawn more than no times.
    best.ok_or_else(|| groundglass::Error::invalid("nothing was drawn"))
}

fn words(explanation: &Explanation) -> String {
    let mut text = format!("{:<15} {:<4} {:>6}  {:>8}  because\n", "effect", "", "time", "change");
    for row in &explanation.effects {
        let state = if row.active { "in" } else { "out" };
        let cost = row.cost.map_or("-".into(), |cost| format!("{:+.0} %", 100.0 * cost));
        let change = row.change_rms.map_or("-".into(), |change| format!("{change:.4}"));
        text += &format!("{:<15} {state:<4} {cost:>6}  {change:>8}  {}\n", row.effect, row.because);
    }
    text += &format!(
        "\ntime: what the effect adds to the picture's time; change: RMS between with and without, linear light; both of \
         pictures\n{} pixels wide with {} samples. What is left out as too small may change the picture by {}.\n",
        PROBE.0, PROBE.1, explanation.tolerance_rms
    );
    text
}
