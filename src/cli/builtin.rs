//! The scene that `render` draws when none is named: the tower, carried in the program itself.

use groundglass::scene::Memory;

/// The scene file; the same as `examples/tower.toml`.
pub(super) const SCENE: &str = include_str!("../../examples/tower.toml");

/// What errors and outputs call it.
pub(super) const NAME: &str = "tower.toml";

/// The model and its textures under the names the scene uses.
pub(super) fn assets() -> Memory {
    macro_rules! files {
        ($($name:literal),* $(,)?) => {
            Memory::new()$(.with(
                concat!("tower/", $name),
                &include_bytes!(concat!("../../examples/tower/", $name))[..],
            ))*
        };
    }
    files!(
        "tower.obj",
        "tower.mtl",
        "textures/brick.png",
        "textures/chart.png",
        "textures/concrete.png",
        "textures/paving.png",
        "textures/street.png",
        "textures/windows.png",
    )
}
