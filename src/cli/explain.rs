//! `groundglass explain SCENE`: which effects are in its picture, because of which number, what each costs and what leaving
//! it out changes.
//!
//! Cost and change are measured: small pictures of the scene with and without each effect, of the same samples.

use super::effects::EffectArguments;
use super::input::{self, MemoryArguments, SceneArguments};
use super::progress::Progress;
use super::stats::{self, median};
use super::values::{Pixels, Positive};
use super::{interrupt, optics_words, report};
use groundglass::error::Result;
use groundglass::picture::Exposure;
use groundglass::plan::RenderPlan;
use groundglass::render::{Execution, render};
use groundglass::scene::{Budget, EffectChoice, EffectName, EffectSet, Scene};
use serde::Serialize;
use std::time::Instant;

/// Width and samples of the small pictures.
const PROBE: (u32, u32) = (160, 64);

/// How often two pictures are timed at least, and at most while it takes no longer than this in all.
const TIMES: [usize; 2] = [5, 40];
const SECONDS: f64 = 0.25;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    #[command(flatten)]
    pub(super) effects: EffectArguments,
    /// The error that the picture is to have: what is left out changes it by half of that at most
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub(super) max_error: Option<Positive>,
    /// Width of the picture in pixels, which decides on effects; costs and changes are of small pictures
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
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
    /// The part of the time for the picture that the effect takes, or would take: 0 where it is less than times differ by
    /// themselves, or nothing in view has it; null where the scene cannot have it.
    cost: Option<f64>,
    /// What that is at most, as far as times differ by themselves (three standard errors).
    cost_at_most: Option<f64>,
    /// RMS change of the picture between with and without, chance left out; null where the scene cannot have it.
    change_rms: Option<f64>,
    /// What that is at most: from so few samples it is not known better.
    change_rms_at_most: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let threads = stats::threads(None);
    let input = input::read(&arguments.scene)?.within(arguments.memory, threads);
    let mut scene = input.load_at(arguments.width.map(|width| width.0))?;
    if let Some(error) = arguments.max_error {
        scene.render.budget = Budget::MaxError(error.0);
    }
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
    })
    .map_err(|error| error.in_file(input.name()))?;
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
    let base = if can_render { Some(Probe::new(&small, plan.active(), execution)?) } else { None };
    let mut effects = Vec::new();
    let progress = Progress::with_lines();
    for (name, effect) in EffectName::ALL.into_iter().zip(plan.effects()) {
        progress.tell("measuring", effects.len() as u64, plan.effects().len() as u64);
        let measured = match (&base, other(&small, plan.active(), name)) {
            _ if is_absent(&plan, scene, name) => Some(([0.0; 2], [0.0; 2])),
            (Some(base), Some((small, active))) => {
                let other = Probe::new(&small, active, execution)?;
                // Soft shadows beside hard ones, also where there are none.
                let hard;
                let base = if name == EffectName::SoftShadows && !plan.active().has(EffectName::Shadows) {
                    hard = Probe::new(&small, active.set(name, false), execution)?;
                    &hard
                } else {
                    base
                };
                let [more, error] = extra_time(base, &other, execution)?;
                let cost = if effect.active { 0.0 - more } else { more };
                let known = if cost.abs() <= error { 0.0 } else { cost };
                Some(([known, cost + error], base.change(&other)))
            }
            _ => None,
        };
        effects.push(Row {
            effect: effect.effect,
            active: effect.active,
            because: effect.because.clone(),
            cost: measured.map(|([cost, _], _)| cost),
            cost_at_most: measured.map(|([_, most], _)| most),
            change_rms: measured.map(|(_, [change, _])| change),
            change_rms_at_most: measured.map(|(_, [_, most])| most),
        });
    }
    progress.finish();
    Ok(Explanation {
        tolerance_rms: plan.tolerance(),
        effects,
        scene_hash: scene.hash(),
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// Whether nothing in view has the effect, so that it neither costs nor changes anything.
fn is_absent(plan: &RenderPlan, scene: &Scene, name: EffectName) -> bool {
    let of_materials = [EffectName::Textures, EffectName::Holes, EffectName::Coverage].contains(&name);
    of_materials && !plan.active().has(name) && !scene.render.effects.without.has(name)
}

/// The scene with what is compared: an active effect left out; another one added, as `--with` does. None where the scene
/// cannot have it.
fn other(scene: &Scene, active: EffectSet, name: EffectName) -> Option<(Scene, EffectSet)> {
    let mut scene = scene.clone();
    if active.has(name) {
        return Some((scene, active.set(name, false)));
    }
    EffectArguments { with: vec![name], ..EffectArguments::default() }.apply(&mut scene).ok()?;
    let active = if name == EffectName::SoftShadows { active.set(EffectName::Shadows, true) } else { active };
    Some((scene, active.set(name, true)))
}

/// A small scene with some of its effects, and two pictures of it, of different samples.
struct Probe {
    scene: Scene,
    pictures: [Exposure; 2],
}

impl Probe {
    fn new(scene: &Scene, active: EffectSet, execution: Execution<'_>) -> Result<Self> {
        let mut scene = scene.clone();
        let inactive = active.others();
        scene.render.effects = EffectChoice { all: false, with: active, without: inactive };
        let mut twin = scene.clone();
        twin.render.seed = scene.render.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let pictures = [render(&scene, execution)?.0, render(&twin, execution)?.0];
        Ok(Self { scene, pictures })
    }

    /// The RMS difference, chance left out; and what it is at most.
    fn change(&self, other: &Self) -> [f64; 2] {
        let [ours, theirs] = [self, other].map(|probe| probe.pictures.each_ref());
        Exposure::rms_change(ours, theirs, self.scene.render.exposure_ev)
    }

    fn seconds(&self, execution: Execution<'_>) -> Result<f64> {
        let start = Instant::now();
        render(&self.scene, execution)?;
        Ok(start.elapsed().as_secs_f64())
    }
}

/// How much longer than the first picture the second takes, as a part of the first's time, and three standard errors of that. They are
/// drawn by turns, so that what slows the machine down slows both.
fn extra_time(first: &Probe, second: &Probe, execution: Execution<'_>) -> Result<[f64; 2]> {
    let (mut times, mut differences) = (Vec::new(), Vec::new());
    let start = Instant::now();
    while times.len() < TIMES[0] || times.len() < TIMES[1] && start.elapsed().as_secs_f64() < SECONDS {
        // Each goes first every other time.
        let (a, b) = if times.len() % 2 == 0 {
            let a = first.seconds(execution)?;
            (a, second.seconds(execution)?)
        } else {
            let b = second.seconds(execution)?;
            (first.seconds(execution)?, b)
        };
        times.push(a);
        differences.push(b - a);
    }
    let more = median(&mut differences);
    let mut far: Vec<f64> = differences.iter().map(|difference| (difference - more).abs()).collect();
    // Of normal noise: its standard deviation from the median distance, and the error of a median of so many.
    let error = 1.4826 * median(&mut far) * 1.2533 / (differences.len() as f64).sqrt();
    let time = median(&mut times);
    Ok([more / time, 3.0 * error / time])
}

/// In parentheses what would be, and is not.
fn bracketed(row: &Row, number: String) -> String {
    if row.active { number } else { format!("({number})") }
}

fn words(explanation: &Explanation) -> String {
    let mut text = format!("{:<15} {:<4} {:>8}  {:>9}  because\n", "effect", "", "time", "change");
    for row in &explanation.effects {
        let state = if row.active { "in" } else { "out" };
        let cost = match row.cost {
            None => "-".into(),
            Some(0.0) => "0 %".into(),
            Some(cost) if row.active => format!("{:+.0} %", 100.0 * cost),
            Some(cost) => format!("({:+.0} %)", 100.0 * cost),
        };
        let change = match (row.change_rms, row.change_rms_at_most) {
            (Some(_), Some(0.0)) => "0".into(),
            // Hardly to be told from chance.
            (Some(change), Some(most)) if most > 1.5 * change => bracketed(row, format!("<{most:.4}")),
            (Some(change), _) => bracketed(row, format!("{change:.4}")),
            (None, _) => "-".into(),
        };
        text += &format!("{:<15} {state:<4} {cost:>8}  {change:>9}  {}\n", row.effect, row.because);
    }
    text += &format!(
        "\ntime: what the effect adds to the picture's time, 0 where that cannot be told from chance;\nchange: RMS between with and \
         without, linear light, without noise; < where it cannot be told from noise;\nin parentheses, of what is out: what it would add and change; - where the scene \
         cannot have it. Both of pictures {} pixels wide with {} samples.\nWhat is left out as too small may change the picture by {}.\n",
        PROBE.0,
        PROBE.1,
        report::rms(explanation.tolerance_rms)
    );
    text
}
