//! `groundglass explain SCENE`: which effects are in its picture, because of which number, what each costs and what leaving
//! it out changes.
//!
//! Cost and change are measured: small pictures of the scene with and without each effect, of the same samples.

use super::effects::EffectArguments;
use super::input::{self, MemoryArguments, SceneArguments};
use super::machine;
use super::probe::{self, PROBE, Probe, Shadowed};
use super::values::{Pixels, Positive};
use super::{interrupt, optics_words, report};
use groundglass::error::Result;
use groundglass::plan::RenderPlan;
use groundglass::render::Execution;
use groundglass::scene::{Budget, EffectName, EffectSet, Scene};
use serde::Serialize;

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
    /// The picture that is planned, pixels.
    width: u32,
    height: u32,
    /// The pictures that costs and changes are of.
    probe: ProbeSize,
    /// What may change by all that is left out as too small: RMS over the picture, linear light.
    tolerance_rms: f64,
    /// What is left out as too small.
    left_out: Vec<&'static str>,
    effects: Vec<Row>,
    scene_hash: String,
    version: &'static str,
}

#[derive(Serialize)]
struct ProbeSize {
    width: u32,
    height: u32,
    samples: u32,
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
    let threads = machine::threads(None);
    let input = input::read(&arguments.scene)?.within(arguments.memory, threads);
    let mut scene = input.load_at(arguments.width.map(|width| width.0))?;
    if let Some(error) = arguments.max_error {
        scene.render.budget = Budget::MaxError(error.0);
    }
    arguments.effects.apply(&mut scene)?;
    report::warnings(&scene.warnings);
    report::warnings(&optics_words::scene_warnings(&scene, &input.name()));
    let memory = input.room();
    let explanation = interrupt::polled(|cancel| {
        explain(
            &mut scene,
            Execution { threads: Some(threads), memory, cancel: Some(cancel), ..Execution::default() },
        )
    })
    .map_err(|error| error.in_file(input.name()))?;
    if arguments.json { report::print_json(&explanation) } else { report::print(&words(&explanation)) }
}

fn explain(scene: &mut Scene, execution: Execution<'_>) -> Result<Explanation> {
    let plan = machine::on_threads(execution.threads, || RenderPlan::new(scene))?;
    let (active, scene_hash) = (plan.active(), scene.hash());
    let (width, height) = (scene.render.width, scene.render.height);
    let absent = EffectName::ALL.map(|name| is_absent(&plan, scene, name));
    // What each effect is measured by: the places of two pictures, if the scene can have it.
    let (mut probes, mut pairs) = (vec![Probe::new(scene, active)], Vec::new());
    let mut shadowed = Shadowed::default();
    // Soft shadows are compared with hard ones, also where there are none.
    let mut hard = 0;
    for (name, absent) in EffectName::ALL.into_iter().zip(absent) {
        // Nothing can be measured where the picture would be refused.
        let found = if absent || scene.optics.film_reaches_aperture() {
            None
        } else {
            other(scene, active, name, &mut shadowed)
        };
        pairs.push(found.map(|other| {
            probes.push(other);
            let place = probes.len() - 1;
            if name == EffectName::Shadows && !active.has(name) {
                hard = place;
            }
            [if name == EffectName::SoftShadows { hard } else { 0 }, place]
        }));
    }
    if pairs.iter().any(Option::is_some) {
        probe::measure(scene, &mut probes, &mut shadowed, execution)?;
    }
    let effects = plan.effects().iter().zip(absent).zip(pairs).map(|((effect, absent), pair)| {
        let measured = match pair.map(|pair| pair.map(|place| &probes[place])) {
            _ if absent => Some(([0.0; 2], [0.0; 2])),
            Some([base, other]) if base.is_refused || other.is_refused => None,
            Some([base, other]) => {
                let [more, error] = base.extra_time(other);
                let cost = if effect.active { 0.0 - more } else { more };
                let known = if cost.abs() <= error { 0.0 } else { cost };
                Some(([known, cost + error], base.change(other)))
            }
            None => None,
        };
        Row {
            effect: effect.effect,
            active: effect.active,
            because: effect.because.clone(),
            cost: measured.map(|([cost, _], _)| cost),
            cost_at_most: measured.map(|([_, most], _)| most),
            change_rms: measured.map(|(_, [change, _])| change),
            change_rms_at_most: measured.map(|(_, [_, most])| most),
        }
    });
    let [probe_width, probe_height] = probes[0].size();
    Ok(Explanation {
        width,
        height,
        probe: ProbeSize { width: probe_width, height: probe_height, samples: PROBE.1 },
        tolerance_rms: plan.tolerance(),
        left_out: plan.left_out().iter().map(EffectName::name).collect(),
        effects: effects.collect(),
        scene_hash,
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// Whether nothing in view has the effect, so that it neither costs nor changes anything.
fn is_absent(plan: &RenderPlan, scene: &Scene, name: EffectName) -> bool {
    let of_materials = [EffectName::Textures, EffectName::Holes, EffectName::Coverage].contains(&name);
    of_materials && !plan.active().has(name) && !scene.render.effects.without.has(name)
}

/// What the scene is compared with: an active effect left out; another one added, as `--with` does. None where the scene
/// cannot have it.
fn other(scene: &mut Scene, active: EffectSet, name: EffectName, shadowed: &mut Shadowed) -> Option<Probe> {
    if active.has(name) {
        return Some(Probe::new(scene, active.set(name, false)));
    }
    let before = (scene.render, scene.sun);
    // Of a picture without shadows other triangles are shaded together.
    let is_shadow = matches!(name, EffectName::Shadows | EffectName::SoftShadows);
    let has_own = is_shadow && scene.surfaces.hierarchy.is_none();
    if has_own {
        shadowed.exchange(&mut scene.surfaces);
    }
    let with = EffectArguments { with: vec![name], ..EffectArguments::default() }.apply(scene);
    let active = if name == EffectName::SoftShadows { active.set(EffectName::Shadows, true) } else { active };
    let mut probe = Probe::new(scene, active.set(name, true));
    (scene.render, scene.sun) = before;
    if has_own {
        shadowed.exchange(&mut scene.surfaces);
        probe.is_shadowed = true;
    }
    with.is_ok().then_some(probe)
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
            // Hardly to be told from chance.
            Some(0.0) => match row.cost_at_most {
                Some(most) if most >= 0.005 => bracketed(row, format!("<{:.0} %", 100.0 * most)),
                _ => "0 %".into(),
            },
            Some(cost) if row.active => format!("{:+.0} %", 100.0 * cost),
            Some(cost) => format!("({:+.0} %)", 100.0 * cost),
        };
        let change = match (row.change_rms, row.change_rms_at_most) {
            (Some(_), Some(0.0)) => "0".into(),
            // Hardly to be told from chance.
            (Some(change), Some(most)) if most > 1.5 * change => {
                bracketed(row, format!("<{:.4}", (1e4 * most).ceil() / 1e4))
            }
            (Some(change), _) => bracketed(row, format!("{change:.4}")),
            (None, _) => "-".into(),
        };
        text += &format!("{:<15} {state:<4} {cost:>8}  {change:>9}  {}\n", row.effect, row.because);
    }
    text += &format!(
        "\ntime: what the effect adds to the picture's time, < where that cannot be told from chance;\nchange: RMS between with and \
         without, linear light, without noise; < where it cannot be told from noise;\nin parentheses, of what is out: what it would add and change; - where the scene \
         cannot have it; soft shadows are compared with hard ones. Both of pictures of {} x {} pixels with {} samples{}.\n",
        explanation.probe.width,
        explanation.probe.height,
        explanation.probe.samples,
        if explanation.probe.width < explanation.width {
            ",\nwhose pixels are larger: in the picture itself blur may change more, anti-aliasing less"
        } else {
            ""
        },
    );
    let tolerance = report::rms(explanation.tolerance_rms);
    text += &match explanation.left_out.as_slice() {
        [] => {
            format!("Nothing that the scene asks for is left out as too small (a change of {tolerance}).\n")
        }
        names => {
            format!("Left out as too small, {} may change the picture by {tolerance}.\n", names.join(", "))
        }
    };
    for row in &explanation.effects {
        let known = row.change_rms.zip(row.change_rms_at_most).filter(|(change, most)| *most <= 1.5 * change);
        let more = known.filter(|(change, _)| *change > explanation.tolerance_rms);
        if let Some((change, _)) = more.filter(|_| explanation.left_out.contains(&row.effect)) {
            text += &format!(
                "In the pictures measured here {} changes more, {}: `--with {}` keeps it.\n",
                row.effect,
                report::rms(change),
                row.effect
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use groundglass::render::render;

    #[test]
    fn asking_what_shadows_would_cost_leaves_the_scene_as_it_was() {
        let mut scene = Scene::read("examples/wall.toml").unwrap();
        (scene.render.width, scene.render.height) = (16, 13);
        scene.render.budget = Budget::Samples(1);
        let count = |scene: &Scene| render(scene, Execution::default()).unwrap().1.surfaces;
        let (before, mut shadowed) = (count(&scene), Shadowed::default());
        for name in [EffectName::Shadows, EffectName::SoftShadows] {
            let probe = other(&mut scene, EffectSet::default(), name, &mut shadowed).unwrap();
            assert!(probe.is_shadowed && scene.surfaces.hierarchy.is_none());
            assert_eq!(count(&scene), before, "{name}");
        }
        // With shadows surfaces lie in one plane each.
        shadowed.exchange(&mut scene.surfaces);
        assert!(scene.surfaces.hierarchy.is_some() && count(&scene) > before);
    }
}
