//! The picture in double precision, sample by sample: what the renderer's single precision and shared work are compared
//! with. Scene in, picture out.
//!
//! It takes the renderer's sample points, meets triangles by rays in world coordinates, and shares no drawing code with it, nor
//! with the oracle of the tests, which meets them in homogeneous coordinates and tells what is in doubt.
//! A texture can be read here in other ways than the renderer's, so that their price can be seen too.

mod surface;
mod tree;

use super::super::machine;
use super::rows;
use glam::DVec3;
use groundglass::error::Result;
use groundglass::picture::{Allocation, Exposure};
use groundglass::plan::RenderPlan;
use groundglass::render::Execution;
use groundglass::sampling;
use groundglass::scene::{EffectName, EffectSet, Scene};
use surface::{Eye, Filter};
use tree::Tree;

/// Ways to read a texture, with what a study calls them.
pub(super) const FILTERS: [(Filter, &str); 4] = [
    (Filter::Renderer, "64 bits"),
    (Filter::Trilinear, "64 bits, trilinear texels"),
    (Filter::Bilinear, "64 bits, finest texels, bilinear"),
    (Filter::Nearest, "64 bits, finest texels, nearest"),
];

/// Why what is drawn here is not a picture of the scene, of which these effects are `drawn`, in words that go on after the name of this
/// renderer; none where it is.
pub(super) fn differs(scene: &Scene, drawn: EffectSet) -> Option<String> {
    let not_known = [EffectName::Coverage, EffectName::Diffraction];
    let names = |effects: &mut dyn Iterator<Item = EffectName>| {
        let names: Vec<&str> = effects.map(EffectName::name).collect();
        (!names.is_empty()).then(|| names.join(" and "))
    };
    let missing = names(&mut not_known.into_iter().filter(|&effect| drawn.has(effect)));
    // What would be there if nothing were left out.
    let without = scene.render.effects.without;
    let mut left_out = without.iter().filter(|effect| !not_known.contains(effect)).peekable();
    let wanted = left_out.peek().map(|_| {
        let mut whole = scene.clone();
        whole.render.effects.without = EffectSet::default();
        RenderPlan::new(&whole).active()
    });
    let too_much = names(&mut left_out.filter(|&effect| wanted.is_some_and(|wanted| wanted.has(effect))));
    let missing = missing.map(|names| format!("has no {names}"));
    let too_much = too_much.map(|names| format!("cannot leave out {names}"));
    let reasons: Vec<String> = missing.into_iter().chain(too_much).collect();
    (!reasons.is_empty()).then(|| reasons.join(" and "))
}

/// `samples` of each pixel.
pub(super) fn draw(
    scene: &Scene,
    filter: Filter,
    samples: u32,
    execution: Execution<'_>,
) -> Result<Exposure> {
    let (width, height) = (scene.render.width, scene.render.height);
    let pixels = machine::on_threads(execution.threads, || {
        let tree = Tree::new(&scene.surfaces);
        let pixel = |i: u32, j: u32| pixel(scene, &tree, filter, samples, (i, j)).as_vec3().to_array();
        rows::pixels(height, &execution, |j| (0..width).map(|i| pixel(i, j)).collect())
    })??;
    Exposure::from_rows(width, height, &pixels, Allocation::Uniform(samples))
}

/// The mean of a pixel's samples.
fn pixel(scene: &Scene, tree: &Tree<'_>, filter: Filter, samples: u32, (i, j): (u32, u32)) -> DVec3 {
    let optics = &scene.optics;
    let stream = sampling::pixel_stream(i, j, samples);
    let (seed, shape) = (scene.render.seed, scene.aperture_shape());
    let film = optics.camera().film;
    let step = [
        -film.width.as_metres() / f64::from(scene.render.width),
        film.height.as_metres() / f64::from(scene.render.height),
    ];
    let corner = [0.5 * film.width.as_metres(), -0.5 * film.height.as_metres()];
    let mut sum = DVec3::ZERO;
    for k in 0..samples {
        let sample = sampling::sample_of(scene.render.points, &shape, seed, stream, k);
        let radius = optics.aperture_radius();
        let [u, v] = sample.lens.map(|c| f64::from(c) * radius);
        let x = corner[0] + step[0] * (f64::from(i) + f64::from(sample.pixel[0]));
        let y = corner[1] + step[1] * (f64::from(j) + f64::from(sample.pixel[1]));
        let ray = |x: f64, y: f64| {
            let ray = optics.ray(u, v, x, y);
            let pose = optics.world_from_lens();
            (pose.point(ray.origin), pose.vector(ray.direction).normalize())
        };
        let (from, direction) = ray(x, y);
        let eye = Eye { from, direction, right: ray(x + step[0], y).1, down: ray(x, y + step[1]).1 };
        let toward = scene.sun_direction((i, j), stream, k);
        let falloff = if scene.render.falloff { falloff(scene, (u, v), (x, y)) } else { 1.0 };
        sum += surface::radiance(scene, tree, filter, &eye, toward) * falloff;
    }
    sum / f64::from(samples)
}

/// `cos(lens) cos(film) / r^2`, relative to the lens centre and the film centre.
fn falloff(scene: &Scene, (u, v): (f64, f64), (x, y): (f64, f64)) -> f64 {
    let optics = &scene.optics;
    let weight = |s: DVec3, p: DVec3| {
        let r = p - s;
        let along = |n: DVec3| n.dot(r).abs();
        along(optics.axis()) * along(optics.film_normal()) / (r.length_squared() * r.length_squared())
    };
    weight(optics.lens_point(u, v), optics.film_point(x, y)) / weight(DVec3::ZERO, optics.film_center())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::input::Input;

    #[test]
    fn what_it_cannot_draw_is_told() -> Result<()> {
        let mut scene = Input::builtin()?.load()?;
        let mut told = |without: &[EffectName]| {
            scene.render.effects.without = without.iter().copied().collect();
            differs(&scene, RenderPlan::new(&scene).active())
        };
        assert_eq!(told(&[]), None);
        // The tower has none of these.
        assert_eq!(told(&[EffectName::Holes, EffectName::Falloff, EffectName::Coverage]), None);
        let left_out = [EffectName::Defocus, EffectName::Textures];
        assert_eq!(told(&left_out).as_deref(), Some("cannot leave out defocus and textures"));
        Ok(())
    }
}
