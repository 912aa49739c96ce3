//! A picture without files: scene and model from memory, pixels into memory, and then, for the looking, a PNG.
//!
//! `cargo run --release --example render_to_memory -- blocks.png`

use groundglass::scene::{Memory, parse};
use groundglass::{Execution, render};
use std::{fmt::Write as _, path::Path};

const SCENE: &str = r#"
[camera]
eye_m = [0.35, 0.5, 0.9]
look_at_m = [0.0, 0.02, 0.0]
focal_length_mm = 150
f_number = 2.8
film = "4x5"

[focus]
plane = { point_m = [0, 0, 0], normal = [0, 1, 0] }

[[mesh]]
path = "blocks.obj"

[sun]
toward = [-0.5, 1.0, 0.6]
color = [0.7, 0.7, 0.65]

[sky]
horizon = [0.2, 0.26, 0.34]

[render]
width = 480
samples = 256
"#;

/// A checkered ground and, on it, a row of blocks (metres; only faces that the camera sees).
fn model() -> String {
    let mut obj = String::new();
    let mut quad = |corners: [[f64; 3]; 4]| {
        for [x, y, z] in corners {
            let _ = writeln!(obj, "v {x} {y} {z}");
        }
        obj.push_str("f -4 -3 -2 -1\n");
    };
    for i in -16..16 {
        for j in (-16..16).filter(|j| (i + j) % 2 == 0) {
            let (x, z, s) = (f64::from(i) * 0.05, f64::from(j) * 0.05, 0.05);
            quad([[x, 0.0, z + s], [x + s, 0.0, z + s], [x + s, 0.0, z], [x, 0.0, z]]);
        }
    }
    for k in -3..4 {
        let (x, z, s, h) = (f64::from(k) * 0.04, f64::from(k) * -0.1, 0.03, 0.1);
        quad([[x, 0.0, z + s], [x + s, 0.0, z + s], [x + s, h, z + s], [x, h, z + s]]);
        quad([[x + s, 0.0, z + s], [x + s, 0.0, z], [x + s, h, z], [x + s, h, z + s]]);
        quad([[x, h, z + s], [x + s, h, z + s], [x + s, h, z], [x, h, z]]);
    }
    obj
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let source = Memory::new().with("blocks.obj", model().into_bytes());
    let scene = parse(SCENE, "blocks.toml")?.describe()?.load(&source, Path::new(""), None)?;
    let (exposure, counts) = render(&scene, Execution::default())?;

    let pixels: Vec<u8> = exposure.to_srgb8(scene.render.exposure_ev);
    println!(
        "{} x {} pixels, {} bytes, {} triangles, RMS error about {:.4}",
        exposure.width(),
        exposure.height(),
        pixels.len(),
        counts.triangles,
        exposure.rms_error().unwrap_or(f64::NAN),
    );
    if let Some(path) = std::env::args_os().nth(1) {
        exposure.write_png(scene.render.exposure_ev, &[], std::fs::File::create(path)?)?;
    }
    Ok(())
}
