//! A render that is told to stop stops soon, at any moment of it, on scenes of every kind.

#![cfg(unix)]

#[path = "common/scenes.rs"]
#[allow(dead_code, reason = "shared with tests that use the rest")]
mod scenes;

use glam::DVec3;
use groundglass::Execution;
use groundglass::error::ErrorKind;
use groundglass::render::render;
use groundglass::scene::{AssetLoader, Attributes, Files, NONE, Placement, Scene, Surfaces};
use scenes::{Random, Setting, camera, plain, scene, yard};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const SETTING: Setting =
    Setting { front: [3.0, 1.0], rear: [0.0, -2.0], f_number: 4.0, stretch: 1.05, rise: 5.0 };

/// Seconds that all threads of this process have worked so far.
fn worked() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// The time from asking to stop until `render` has returned, at moments all over the run.
fn worst_stop(name: &str, scene: &Scene, whole: Option<Duration>) -> Duration {
    let whole = whole.unwrap_or_else(|| {
        let begun = Instant::now();
        render(scene, Execution::default()).unwrap();
        begun.elapsed()
    });
    let mut worst = Duration::ZERO;
    for part in 0..16 {
        let stop = AtomicBool::new(false);
        let took = std::thread::scope(|threads| {
            let asked = threads.spawn(|| {
                std::thread::sleep(whole.mul_f64((f64::from(part) + 0.5) / 17.0));
                stop.store(true, Ordering::Relaxed);
                (Instant::now(), worked())
            });
            let done = render(scene, Execution { cancel: Some(&stop), ..Execution::default() });
            let (returned, at_end) = (Instant::now(), worked());
            let (asked, at_start) = asked.join().unwrap();
            match done {
                Err(error) => assert_eq!(error.kind(), ErrorKind::Cancelled),
                Ok(_) => return Duration::ZERO,
            }
            // On a machine that does other things besides, the work that was done counts: without them it takes no longer.
            returned.saturating_duration_since(asked).min(at_end.saturating_sub(at_start))
        });
        worst = worst.max(took);
    }
    println!("{name}: of {whole:?}, the longest stop took {worst:?}");
    worst
}

fn sponza(width: u32, samples: u32) -> Option<Scene> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/scenes/sponza");
    if !folder.exists() {
        println!("skipped: ../shared is missing");
        return None;
    }
    let files = Files::new();
    let model = AssetLoader::new(&files, &folder).load_obj("sponza.obj").unwrap();
    let mut surfaces = Surfaces::default();
    surfaces.add(&model, &Placement { scale: 0.01, ..Placement::default() }).unwrap();
    surfaces.find_patches();
    let view = camera(DVec3::new(-10.0, 2.0, 0.0), DVec3::new(10.0, 3.0, 0.0), 120.0, SETTING);
    let mut scene = scene(&view, surfaces, width, samples);
    scene.render.share_shading = true;
    Some(scene)
}

#[test]
fn a_render_that_is_stopped_says_so() {
    let view = camera(DVec3::new(0.0, 1.0, 8.0), DVec3::new(0.0, 1.0, 0.0), 150.0, SETTING);
    let many = scene(&view, yard(&mut Random(2), 200), 64, 1_000_000);
    let stop = AtomicBool::new(true);
    let stopped = render(&many, Execution { cancel: Some(&stop), ..Execution::default() });
    assert_eq!(stopped.unwrap_err().kind(), ErrorKind::Cancelled);
}

#[test]
fn progress_counts_each_tile_once() {
    let view = camera(DVec3::new(0.0, 1.0, 8.0), DVec3::new(0.0, 1.0, 0.0), 150.0, SETTING);
    let scene = scene(&view, yard(&mut Random(2), 200), 96, 16);
    let height = scene.render.height;
    let (tiles, told) = (3 * height.div_ceil(32) as usize, Mutex::new(Vec::new()));
    let tell = |done, all| told.lock().unwrap().push((done, all));
    render(&scene, Execution { progress: Some(&tell), ..Execution::default() }).unwrap();
    let mut told = told.into_inner().unwrap();
    told.sort_unstable();
    assert_eq!(told, (1..=tiles).map(|done| (done, tiles)).collect::<Vec<_>>());
}

/// A minute of wall-clock times, which a busy machine spoils: `cargo test --release --test cancel -- --ignored`.
#[test]
#[ignore = "times the machine for a minute and a half; run it with nothing beside"]
fn a_render_stops_within_50_ms() {
    let mut wrong = Vec::new();
    let mut bar = |name: &str, scene: &Scene, whole: Option<Duration>| {
        let took = worst_stop(name, scene, whole);
        if took > Duration::from_millis(50) {
            wrong.push(format!("{name}: {took:?}"));
        }
    };
    if let Some(scene) = sponza(1920, 64) {
        bar("Sponza, 1920 wide, 64 samples", &scene, None);
    }
    let view = camera(DVec3::new(0.0, 1.0, 8.0), DVec3::new(0.0, 1.0, 0.0), 150.0, SETTING);
    let seconds = Duration::from_secs(2);
    let busy = scene(&view, yard(&mut Random(1), 600_000), 400, 64);
    bar("600,000 triangles about one place", &busy, Some(seconds));
    // So bright that the plan looks for what is in view, and whatever is small may be a lamp. What stands before lamps is put in order in one
    // go, a tenth of a second; to make the hierarchy first would take half a second.
    let mut bright = busy;
    bright.surfaces.build_hierarchy();
    bright.render.exposure_ev = 5.0;
    let took = worst_stop("the same, five stops brighter", &bright, Some(seconds));
    assert!(took < Duration::from_millis(300), "{took:?}");
    // Every triangle in every tile.
    let mut full = Surfaces { materials: vec![plain([0.5; 3])], ..Surfaces::default() };
    for i in 0..40_000 {
        let z = -f64::from(i) * 1e-4;
        for (x, y) in [(-90.0, -90.0), (90.0, -90.0), (0.0, 90.0)] {
            full.positions.push(DVec3::new(x, y, z));
        }
        full.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        full.attributes.push(Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material: 0 });
    }
    bar("40,000 triangles, each over the whole picture", &scene(&view, full, 400, 64), Some(seconds));
    let many = scene(&view, yard(&mut Random(2), 200), 64, 1_000_000);
    bar("a million samples a pixel", &many, Some(seconds));
    let wide = scene(&view, yard(&mut Random(3), 2_000), 12_000, 1);
    bar("12,000 x 9,600 pixels", &wide, Some(seconds));
    assert!(wrong.is_empty(), "{wrong:?}");
}
