//! What may be asked for. In: a picture's settings, as any program may set them. Out: nothing, or what is wrong with them, with the key
//! of the scene file.

use crate::error::{Error, Result};
use crate::picture::{Allocation, check_samples, check_size};
use crate::scene::{BRIGHTEST, Budget, Scene};
use glam::DVec3;

/// The most blades of an aperture, as in scene files.
const MOST_BLADES: u32 = 1000;

/// The most stops of exposure either way, as there.
const MOST_STOPS: f64 = 100.0;

/// Whether such a picture can be.
///
/// # Errors
/// Those of [`check_size`]; [`Invalid`](crate::error::ErrorKind::Invalid) for an aperture, a budget, light or a direction that is none.
pub(super) fn check(scene: &Scene) -> Result<()> {
    let settings = &scene.render;
    if scene.blades.is_some_and(|blades| !(3..=MOST_BLADES).contains(&blades.count)) {
        return Err(Error::invalid("no such aperture can be made")
            .at_key("camera.aperture.blades")
            .remedy(format!("give 3 to {MOST_BLADES} blades")));
    }
    check_size(settings.width, settings.height).map_err(|error| error.at_key("render.width"))?;
    check_numbers(scene)?;
    match settings.budget {
        Budget::Samples(samples) => samples_of(samples),
        Budget::MaxError(error) if !(error > 0.0 && error.is_finite()) => {
            Err(Error::invalid(format!("an error of {error} cannot be reached"))
                .at_key("render.max_error")
                .remedy("give a positive, finite number, such as 0.004"))
        }
        Budget::Seconds(seconds) if !(seconds > 0.0 && seconds.is_finite()) => {
            Err(Error::invalid(format!("nothing can be planned for {seconds} s"))
                .at_key("render.time_budget_s")
                .remedy("give a positive, finite number of seconds"))
        }
        Budget::MaxError(_) | Budget::Seconds(_) => Ok(()),
    }
}

/// Whether light and directions are what they are documented to be. (Of what is no number the error that is stated would be small.)
fn check_numbers(scene: &Scene) -> Result<()> {
    let wrong = |key: &str, what: &str, remedy: &str| Err(Error::invalid(what).at_key(key).remedy(remedy));
    // As in scene files: what single precision holds, and its products.
    let is_light =
        |color: DVec3| color.to_array().iter().all(|channel| (0.0..=f64::from(BRIGHTEST)).contains(channel));
    let is_direction = |v: DVec3| v.is_finite() && v != DVec3::ZERO;
    let sky = &scene.sky;
    for (key, color) in
        [("sky.ambient", sky.ambient), ("sky.horizon", sky.horizon), ("sky.zenith", sky.zenith)]
    {
        if !is_light(color) {
            return wrong(key, "no such light", "give three numbers of 0 to 1e9");
        }
    }
    if let Some(sun) = &scene.sun {
        if !is_light(sun.color) {
            return wrong("sun.color", "no such light", "give three numbers of 0 to 1e9");
        }
        if !is_direction(sun.toward) {
            return wrong("sun.toward", "it has no direction", "give a vector that is finite and not zero");
        }
        if !(0.0..=180.0).contains(&sun.angular_diameter.as_degrees()) {
            return wrong("sun.angular_diameter_deg", "no such disk", "give 0 to 180 degrees");
        }
    }
    if !is_direction(scene.up) {
        return wrong("camera.up", "it has no direction", "give a vector that is finite and not zero");
    }
    if !(-MOST_STOPS..=MOST_STOPS).contains(&scene.render.exposure_ev) {
        return wrong("render.exposure_ev", "no such exposure", "give -100 to 100 stops");
    }
    if scene.blades.is_some_and(|blades| !blades.rotation.as_degrees().is_finite()) {
        return wrong("camera.aperture.rotation_deg", "no such angle", "give a finite number of degrees");
    }
    Ok(())
}

/// The same for the numbers of samples of a picture that is made again.
///
/// # Errors
/// As [`check`].
pub(super) fn check_allocation(samples: &Allocation) -> Result<()> {
    match samples {
        Allocation::Uniform(samples) => samples_of(*samples),
        Allocation::Blocks(_) => Ok(()),
    }
}

fn samples_of(samples: u32) -> Result<()> {
    check_samples(samples).map_err(|error| error.at_key("render.samples"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use crate::picture::{BlockSamples, Exposure};
    use crate::quantity::Angle;
    use crate::render::{Execution, render, replay};
    use crate::scene::{
        AssetLoader, Attributes, Blades, Level, LoadSettings, Memory, NONE, Placement, Sun, Surfaces,
        Texture, parse,
    };
    use glam::{Vec2, Vec3};
    use std::path::Path;
    use std::sync::Arc;

    fn scene() -> Result<Scene> {
        let text = "[camera]\neye_m = [0.0, 0.0, 1.0]\nlook_at_m = [0.0, 0.0, 0.0]\nfocal_length_mm = 150.0\nf_number = 8.0\n\
                    film = \"4x5\"\nextension_mm = 180.0\n[[mesh]]\npath = \"a.obj\"\n";
        let files = Memory::new().with("a.obj", b"v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".as_slice());
        let settings = LoadSettings { width: Some(8), ..Default::default() };
        parse(text, "a.toml")?.describe()?.load_with(&files, Path::new(""), settings)
    }

    /// What is said of a scene that was changed.
    fn refused(change: impl Fn(&mut Scene)) -> Result<(ErrorKind, String)> {
        let mut scene = scene()?;
        change(&mut scene);
        let clock = || 0.0;
        let execution = Execution { clock: Some(&clock), ..Execution::default() };
        Ok(render(&scene, execution)
            .err()
            .map_or((ErrorKind::Cancelled, "drawn".into()), |e| (e.kind(), e.to_string())))
    }

    #[test]
    fn what_no_picture_can_be_is_refused_at_once() -> Result<()> {
        let budget = |budget| move |scene: &mut Scene| scene.render.budget = budget;
        for seconds in [f64::NAN, -5.0, 0.0, f64::INFINITY] {
            assert_eq!(refused(budget(Budget::Seconds(seconds)))?.0, ErrorKind::Invalid, "{seconds} s");
        }
        for error in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
            assert_eq!(
                refused(budget(Budget::MaxError(error)))?.0,
                ErrorKind::Invalid,
                "an error of {error}"
            );
        }
        for samples in [0, u32::MAX] {
            assert_eq!(refused(budget(Budget::Samples(samples)))?.0, ErrorKind::Invalid, "{samples} samples");
            let again = replay(&scene()?, &Allocation::Uniform(samples), Execution::default());
            assert!(again.is_err(), "{samples} samples");
        }
        for (size, kind) in [
            ([0, 5], ErrorKind::Invalid),
            ([5, 0], ErrorKind::Invalid),
            ([70_000, 2], ErrorKind::TooLarge),
            ([u32::MAX; 2], ErrorKind::TooLarge),
        ] {
            let found = refused(|scene| [scene.render.width, scene.render.height] = size)?;
            assert_eq!(found.0, kind, "{size:?}: {}", found.1);
        }
        for count in [0, 2, u32::MAX] {
            let blades = Blades { count, rotation: Angle::ZERO };
            assert_eq!(refused(|scene| scene.blades = Some(blades))?.0, ErrorKind::Invalid, "{count} blades");
        }
        assert_eq!(refused(|_| ())?.1, "drawn");
        let mut timed = scene()?;
        timed.render.budget = Budget::Seconds(0.1);
        let clock = || f64::NAN;
        let error = render(&timed, Execution { clock: Some(&clock), ..Execution::default() }).err();
        assert!(error.is_some_and(|error| error.to_string().contains("no clock")));
        Ok(())
    }

    /// A texture of 4 x 2 texels with its levels changed.
    fn broken_texture(change: impl Fn(&mut Vec<Level>)) -> Option<Arc<Texture>> {
        let mut texture = Texture::from_level(Level { width: 4, height: 2, texels: vec![[9; 4]; 8] })?;
        assert!(texture.is_whole());
        let mut levels = texture.levels.to_vec();
        change(&mut levels);
        texture.levels = levels.into();
        Some(Arc::new(texture))
    }

    #[test]
    fn numbers_that_are_none_are_refused() -> Result<()> {
        let sun = |change: fn(&mut Sun)| {
            move |scene: &mut Scene| {
                let mut sun = Sun {
                    toward: DVec3::Y,
                    color: DVec3::ONE,
                    shadows: false,
                    angular_diameter: Angle::ZERO,
                };
                change(&mut sun);
                scene.sun = Some(sun);
            }
        };
        assert_eq!(refused(sun(|_| ()))?.1, "drawn");
        assert_eq!(refused(sun(|sun| sun.color.x = f64::NAN))?.0, ErrorKind::Invalid);
        assert_eq!(refused(sun(|sun| sun.toward = DVec3::ZERO))?.0, ErrorKind::Invalid);
        assert_eq!(refused(sun(|sun| sun.angular_diameter = Angle::degrees(-1.0)))?.0, ErrorKind::Invalid);
        let changes: [fn(&mut Scene); 16] = [
            |scene| scene.sky.ambient.y = -1.0,
            |scene| scene.sky.zenith.y = f64::INFINITY,
            |scene| scene.sky.horizon = DVec3::splat(1e39),
            |scene| scene.render.exposure_ev = 200.0,
            |scene| scene.surfaces.materials[0].opacity_mapping.offset.x = f64::NAN,
            |scene| scene.up = DVec3::NAN,
            |scene| scene.render.exposure_ev = f64::NAN,
            |scene| scene.blades = Some(Blades { count: 5, rotation: Angle::degrees(f64::NAN) }),
            |scene| scene.surfaces.positions[1].z = f64::NAN,
            |scene| scene.surfaces.materials[0].diffuse[1] = -1.0,
            |scene| scene.surfaces.materials[0].emission[2] = f32::INFINITY,
            |scene| scene.surfaces.materials[0].coverage = 1.5,
            |scene| scene.surfaces.texcoords = vec![Vec2::new(0.5, f32::NAN)],
            |scene| scene.surfaces.normals = vec![Vec3::INFINITY],
            |scene| scene.surfaces.materials[0].diffuse_map = broken_texture(|levels| levels.clear()),
            |scene| {
                scene.surfaces.materials[0].opacity_map = broken_texture(|levels| {
                    levels[0].texels.pop();
                });
            },
        ];
        for (number, change) in changes.into_iter().enumerate() {
            assert_eq!(refused(change)?.0, ErrorKind::Invalid, "change {number}");
        }
        Ok(())
    }

    #[test]
    fn what_is_added_is_drawn_or_refused() -> Result<()> {
        let files = Memory::new().with("a.obj", b"v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".as_slice());
        let model = AssetLoader::new(&files, Path::new("")).load_obj("a.obj")?;
        for shadows in [false, true] {
            let mut scene = scene()?;
            scene.surfaces.prepare(shadows)?;
            scene.surfaces.add(&model, &Placement::default())?;
            assert!(scene.surfaces.check().is_ok() && render(&scene, Execution::default()).is_ok());
            scene.surfaces.prepare(shadows)?;
            assert!(render(&scene, Execution::default()).is_ok());
            scene.surfaces.triangles.pop();
            scene.surfaces.attributes.pop();
            let error = render(&scene, Execution::default()).err().map(|error| error.to_string());
            assert!(error.is_some_and(|error| error.contains("Surfaces::prepare")));
        }
        // Vertices that are one after welding: a quadrilateral keeps the number of its fourth.
        let mut scene = self::scene()?;
        let surfaces = &mut scene.surfaces;
        *surfaces = Surfaces { materials: surfaces.materials.clone(), ..Default::default() };
        for i in 0..200u32 {
            let at = DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0) * 0.05;
            let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
            surfaces.positions.extend(corners.map(|corner| at + corner * 0.05));
            surfaces
                .triangles
                .extend([[0, 1, 2], [0, 2, 3]].map(|corners| corners.map(|corner| 4 * i + corner)));
            let attributes = Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material: 0 };
            surfaces.attributes.extend([attributes; 2]);
        }
        surfaces.prepare(false)?;
        assert!(render(&scene, Execution::default()).is_ok());
        scene.surfaces.positions.truncate(4);
        scene.surfaces.triangles.iter_mut().flatten().for_each(|corner| *corner %= 4);
        let error = render(&scene, Execution::default()).err().map(|error| error.to_string());
        assert!(error.is_some_and(|error| error.contains("Surfaces::prepare")));
        scene.surfaces.prepare(false)?;
        assert!(render(&scene, Execution::default()).is_ok());

        let mut surfaces = self::scene()?.surfaces;
        let far = Placement { scale: 1e200, ..Placement::default() };
        assert!(surfaces.add(&model, &far).is_err() && surfaces.positions.len() == 3);
        Ok(())
    }

    #[test]
    fn surfaces_that_name_what_is_not_there_are_refused() -> Result<()> {
        let changes: [fn(&mut Scene); 6] = [
            |scene| scene.surfaces.triangles[0][1] = 3,
            |scene| scene.surfaces.attributes.clear(),
            |scene| scene.surfaces.attributes[0].material = 7,
            |scene| scene.surfaces.attributes[0].normals = [0, 0, 0],
            |scene| scene.surfaces.attributes[0].texcoords = [NONE, 0, NONE],
            |scene| scene.surfaces.materials.clear(),
        ];
        for (number, change) in changes.into_iter().enumerate() {
            assert_eq!(refused(change)?.0, ErrorKind::Invalid, "change {number}");
        }
        Ok(())
    }

    #[test]
    fn sizes_that_no_memory_holds_are_told() {
        for [width, height] in [[u32::MAX; 2], [u32::MAX, 1], [1_000_000; 2], [0, 4], [4, 0]] {
            assert!(
                Exposure::from_rows(width, height, &[], Allocation::Uniform(1)).is_err(),
                "{width} x {height}"
            );
        }
        assert!(BlockSamples::from_text(4_000_000, 4_000_000, "16: 1x16").is_err());
        assert!(BlockSamples::from_text(0, 0, "16:").is_err());
    }
}
