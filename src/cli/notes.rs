//! Notes that go into picture files: how a picture was made, in words.

use super::stats::Samples;
use groundglass::picture::Exposure;
use groundglass::scene::{EffectChoice, EffectName, EffectSet, Scene};

/// Keys and texts; nothing of clock, threads or machine.
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
