//! `groundglass check SCENE`: loads a scene and its assets and says what is in them.

use super::input::{self, MemoryArguments, SceneArguments};
use super::{machine, optics_words, report};
use groundglass::error::Result;
use groundglass::scene::Scene;
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    /// Print JSON instead of text
    #[arg(long)]
    pub(super) json: bool,
}

/// The JSON of the contract.
#[derive(Serialize)]
struct Found<'a> {
    meshes: Vec<Mesh<'a>>,
    warnings: Vec<Warning<'a>>,
}

#[derive(Serialize)]
struct Mesh<'a> {
    path: &'a str,
    triangles: usize,
    materials: usize,
    textures: usize,
    bounds_m: [[f64; 3]; 2],
}

#[derive(Serialize)]
struct Warning<'a> {
    file: &'a str,
    line: Option<usize>,
    message: &'a str,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let input = input::read(&arguments.scene)?.within(arguments.memory, machine::threads(None));
    let scene = input.load()?;
    let cautions = optics_words::scene_warnings(&scene, &input.name());
    if arguments.json {
        report::warnings(&cautions);
        report::print_json(&found(&scene))
    } else {
        let warnings = [&scene.warnings[..], &cautions].concat();
        report::warnings(&warnings);
        report::print(&words(&scene, warnings.len()))
    }
}

fn found(scene: &Scene) -> Found<'_> {
    Found {
        meshes: scene
            .meshes
            .iter()
            .map(|mesh| Mesh {
                path: &mesh.path,
                triangles: mesh.triangles,
                materials: mesh.materials,
                textures: mesh.textures,
                bounds_m: mesh.bounds.map(|corner| corner.to_array()),
            })
            .collect(),
        warnings: scene
            .warnings
            .iter()
            .map(|w| Warning { file: &w.file, line: w.line, message: &w.message })
            .collect(),
    }
}

fn words(scene: &Scene, warnings: usize) -> String {
    let mut text = String::new();
    for mesh in &scene.meshes {
        let [low, high] = mesh.bounds;
        text.push_str(&format!(
            "{}: {}, {}, {}, {} x {} x {}\n",
            mesh.path,
            counted(mesh.triangles, "triangle"),
            counted(mesh.materials, "material"),
            counted(mesh.textures, "texture"),
            optics_words::length(high.x - low.x),
            optics_words::length(high.y - low.y),
            optics_words::length(high.z - low.z),
        ));
    }
    text.push_str(&counted(warnings, "warning"));
    text.push('\n');
    text
}

/// `1 triangle`, `2 triangles`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
