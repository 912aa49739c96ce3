//! Known meshes give their known counts and bounds.

use std::path::{Path, PathBuf};

use groundglass::scene::{AssetLoader, Files, NONE};

type Bounds = [[f64; 3]; 2];

/// Triangles, materials that faces use, texture files, bounds (as the list of scenes rounds them).
fn check(folder: PathBuf, name: &str, counts: [usize; 3], bounds: Bounds, rounding: f64) {
    let source = Files::new();
    let mut loader = AssetLoader::new(&source, &folder);
    let model = loader.load_obj(name).expect("it loads");
    assert_eq!([model.triangles.len(), model.materials.len(), model.textures], counts, "{name}");
    assert_eq!(loader.warnings(), [], "{name}");
    for (found, said) in model.bounds.iter().zip(bounds) {
        for (found, said) in found.to_array().into_iter().zip(said) {
            assert!((found - said).abs() <= rounding, "{name}: {found}, not {said}");
        }
    }
    for triangle in &model.triangles {
        let inside =
            |list: [u32; 3], len: usize| list == [NONE; 3] || list.iter().all(|&i| (i as usize) < len);
        assert!(triangle.positions.iter().all(|&i| (i as usize) < model.positions.len()));
        assert!(
            inside(triangle.normals, model.normals.len())
                && inside(triangle.texcoords, model.texcoords.len())
        );
        assert!((triangle.material as usize) < model.materials.len());
    }
}

fn scene(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/scenes").join(name);
    if folder.exists() {
        return Some(folder);
    }
    println!("skipped: ../shared is missing");
    None
}

#[test]
fn tower() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tower");
    check(folder, "tower.obj", [47_346, 11, 6], [[-160.0, 0.0, -220.0], [160.0, 96.2, 140.0]], 0.05);
}

#[test]
fn sponza() {
    let Some(folder) = scene("sponza") else { return };
    let bounds = [[-1920.9, -126.4, -1182.8], [1799.9, 1429.4, 1105.4]];
    check(folder, "sponza.obj", [279_163, 26, 28], bounds, 0.0501);
}

#[test]
fn kaykit_city() {
    let Some(folder) = scene("kaykit-city") else { return };
    check(folder, "city.obj", [187_950, 1, 1], [[-104.0, 0.0, -104.0], [104.0, 24.4, 109.0]], 0.0501);
}

#[test]
fn tabletop() {
    let Some(folder) = scene("tabletop") else { return };
    check(folder, "tabletop.obj", [175_039, 10, 2], [[-0.8, -0.0605, -1.6], [0.8, 0.26, 0.8]], 0.0051);
}

#[test]
fn cornell_box() {
    let Some(folder) = scene("cornell-box") else { return };
    check(folder, "cornell_box.obj", [36, 4, 0], [[0.0; 3], [556.0, 548.8, 559.2]], 0.0501);
}
