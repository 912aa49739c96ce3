//! Prints the table of docs/effects.md: what leaving each effect out changes in each example scene.
//!
//! `cargo run --release --example effects_table`

use groundglass::quantity::Angle;
use groundglass::scene::{Budget, EffectChoice, EffectName};
use groundglass::{Execution, Exposure, Result, Scene, render};
use std::path::Path;

/// Samples of a pixel; the width is the scene's own.
const SAMPLES: u32 = 64;

/// The sun as it is seen from the Earth.
const SUN_DEGREES: f64 = 0.533;

fn main() -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut names: Vec<_> = std::fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            entry.ok()?.file_name().into_string().ok()?.strip_suffix(".toml").map(String::from)
        })
        .collect();
    names.sort();
    let title = EffectName::ALL.map(EffectName::name).join(" | ");
    println!("| scene | {title} |\n|---|{}", "---|".repeat(EffectName::ALL.len()));
    for name in names {
        let scene = Scene::read(folder.join(format!("{name}.toml")))?;
        let cells: Result<Vec<String>> =
            EffectName::ALL.into_iter().map(|effect| change(&scene, effect)).collect();
        println!("| {name} | {} |", cells?.join(" | "));
    }
    Ok(())
}

/// The root mean square difference between the picture with an effect and without, linear light; in brackets where the scene's
/// own keys do not ask for it, or its plan leaves it out.
fn change(scene: &Scene, effect: EffectName) -> Result<String> {
    let mut scene = scene.clone();
    scene.render.budget = Budget::Samples(SAMPLES);
    let is_in = groundglass::plan::RenderPlan::new(&scene).active().has(effect);
    match effect {
        EffectName::Falloff => scene.render.falloff = true,
        EffectName::Diffraction => scene.render.diffraction = true,
        EffectName::ApertureShape if scene.blades.is_none() => return Ok("-".into()),
        EffectName::Shadows | EffectName::SoftShadows => {
            let Some(sun) = &mut scene.sun else { return Ok("-".into()) };
            if !std::mem::replace(&mut sun.shadows, true) {
                scene.surfaces.build_hierarchy();
            }
            let is_point = sun.angular_diameter.as_degrees() == 0.0;
            if effect == EffectName::SoftShadows && is_point {
                sun.angular_diameter = Angle::degrees(SUN_DEGREES);
            }
        }
        _ => {}
    }
    let one = [effect].into_iter().collect();
    let seed = scene.render.seed;
    let mut draw = |choice: EffectChoice, more: u64| {
        (scene.render.effects, scene.render.seed) = (choice, seed + more);
        render(&scene, Execution::default()).map(|(picture, _)| picture)
    };
    let with = EffectChoice { with: one, ..EffectChoice::default() };
    let without = EffectChoice { without: one, ..EffectChoice::default() };
    let (ours, theirs) = ([draw(with, 0)?, draw(with, 1)?], [draw(without, 0)?, draw(without, 1)?]);
    let [change, most] = Exposure::rms_change(ours.each_ref(), theirs.each_ref(), scene.render.exposure_ev);
    // What cannot be told from chance.
    let change = if most > 1.5 * change {
        format!("<{:.4}", (1e4 * most).ceil() / 1e4)
    } else {
        format!("{change:.4}")
    };
    Ok(if is_in { change } else { format!("({change})") })
}
