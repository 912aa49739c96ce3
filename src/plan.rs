//! Which effects a scene calls for, and because of what number.

use crate::scene::Scene;
use serde::Serialize;

/// Blur below this many pixels is not worth a lens: half of it is under the pixel's own box filter.
const BLUR_THRESHOLD_PX: f64 = 0.25;

/// One effect: whether it is in the picture, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// Its name, such as `defocus`.
    pub effect: &'static str,
    /// Whether it is computed.
    pub active: bool,
    /// The number that decided, against its threshold.
    pub because: String,
}

/// The effects of a scene, in a fixed order.
pub fn effects(scene: &Scene) -> Vec<Effect> {
    let materials = &scene.surfaces.materials;
    let count = |test: &dyn Fn(&crate::scene::Material) -> bool| materials.iter().filter(|m| test(m)).count();
    let textured = count(&|m| m.diffuse_map.is_some());
    let holed = count(&|m| [&m.diffuse_map, &m.opacity_map].into_iter().flatten().any(|map| map.has_holes));
    let covered = count(&|m| m.coverage < 1.0);
    let effect = |effect, active, because| Effect { effect, active, because };
    vec![
        defocus(scene),
        effect("antialiasing", true, "the samples of a pixel lie all over its square".into()),
        effect(
            "textures",
            textured > 0,
            format!("{textured} of {} materials have a map_Kd", materials.len()),
        ),
        effect("holes", holed > 0, format!("{holed} materials have a texture with opacity below 0.5")),
        effect("coverage", covered > 0, format!("{covered} materials have d below 1")),
        effect("shadows", false, "sun.shadows = false".into()),
        effect("soft-shadows", false, "sun.shadows = false".into()),
        aperture_shape(scene),
        effect("falloff", scene.render.falloff, format!("render.falloff = {}", scene.render.falloff)),
        effect("diffraction", false, "render.diffraction = false".into()),
    ]
}

fn aperture_shape(scene: &Scene) -> Effect {
    let (active, because) = match scene.blades {
        Some(blades) if scene.optics.aperture_radius() > 0.0 => (true, format!("{} blades", blades.count)),
        Some(_) => (false, "a pinhole has no shape".into()),
        None => (false, "no [camera.aperture] table: a disk".into()),
    };
    Effect { effect: "aperture-shape", active, because }
}

fn defocus(scene: &Scene) -> Effect {
    let radius = scene.optics.aperture_radius();
    if radius == 0.0 {
        return Effect { effect: "defocus", active: false, because: "a pinhole".into() };
    }
    // The largest blur among the corners of the meshes' boxes that the lens sees.
    let pixel = scene.optics.camera().film.width.as_metres() / f64::from(scene.render.width);
    let corners = scene.meshes.iter().flat_map(|mesh| {
        (0..8).map(|i| {
            let pick = |axis: usize| mesh.bounds[(i >> axis) & 1][axis];
            glam::DVec3::new(pick(0), pick(1), pick(2))
        })
    });
    let largest = corners
        .filter_map(|corner| scene.optics.blur_of(scene.optics.world_from_lens().point_inverse(corner)))
        .map(|blur| blur.largest / pixel)
        .fold(0.0, f64::max);
    let because =
        format!("largest blur of a mesh's box corner {largest:.1} px, threshold {BLUR_THRESHOLD_PX} px");
    // Box corners behind the lens have no blur to measure, so the lens stays in until a plan looks closer.
    Effect { effect: "defocus", active: true, because }
}
