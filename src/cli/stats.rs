//! The numbers of `render --stats`, and the clocks behind them.

use groundglass::picture::{Allocation, Exposure};
use groundglass::scene::{EffectName, Scene};
use serde::Serialize;

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
    /// (triangle, tile) pairs.
    pub(super) bin_entries: usize,
    pub(super) samples: u64,
    /// Groups of samples that were shaded together.
    pub(super) shading_requests: u64,
    /// Blocks whose samples may have missed a small bright light.
    pub(super) unseen_light_blocks: u64,
    pub(super) stages: groundglass::render::Stages,
    pub(super) scene_hash: String,
    pub(super) version: &'static str,
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

/// User and system time of all threads of this process so far, in seconds; 0 where the system does not say.
pub(super) fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    {
        0.0
    }
}

/// Bytes of memory that this process can still have without swapping, by the system's count, the control group's
/// limit and the limit of the address space; `None` where nothing of that is told.
pub(super) fn available_memory() -> Option<u64> {
    let text = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let field = |text: &str, name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(name))?;
        number(line.split_whitespace().next()?)
    };
    let free = field(&text("/proc/meminfo"), "MemAvailable:").map(|kib| kib.saturating_mul(1024));
    let group = |limit: &str, used: &str| Some(number(&text(limit))?.saturating_sub(number(&text(used))?));
    let groups = [
        group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        group("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ];
    let used = field(&text("/proc/self/status"), "VmSize:").map_or(0, |kib| kib.saturating_mul(1024));
    let space = field(&text("/proc/self/limits"), "Max address space").map(|most| most.saturating_sub(used));
    [free, space].into_iter().chain(groups).flatten().min()
}

/// Notes that go into a picture file: how it was made, and nothing of clock, threads or machine.
pub(super) fn notes(scene: &Scene, exposure: &Exposure) -> Vec<(&'static str, String)> {
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
        ("groundglass.effects", effects_note(scene)),
        (
            "groundglass.estimated_rms_error",
            exposure.rms_error().map_or("unknown".to_owned(), |error| format!("{error:.6}")),
        ),
    ]
}

/// What the user said of effects, in the words of the command line.
fn effects_note(scene: &Scene) -> String {
    let choice = scene.render.effects;
    let mut words = Vec::new();
    if choice.all {
        words.push("--all-effects".to_owned());
    }
    for (flag, set) in [("with", choice.with), ("without", choice.without)] {
        let named = EffectName::ALL.into_iter().filter(|&effect| set.has(effect));
        words.extend(named.map(|effect| format!("--{flag} {effect}")));
    }
    if words.is_empty() { "as the scene asks".to_owned() } else { words.join(" ") }
}
