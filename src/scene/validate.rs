//! From a [`SceneFile`] (shape and ranges are right) to a [`SceneDescription`]: what only several keys
//! together can tell, units, directions and defaults. The camera's part is in `validate_camera`.

use super::description::{Budget, Focus, MeshEntry, RenderSettings, SceneDescription, Sky, Sun};
use super::document::Document;
use super::file::{AdjustWord, FocusTable, MeshTable, RenderTable, SceneFile, SunTable};
use super::validate_camera;
use crate::camera::{Aperture, unit};
use crate::error::Result;
use crate::optics::{Adjust, FocusTarget};
use crate::quantity::{Angle, Length};
use glam::DVec3;

/// Samples for each pixel when the file names neither samples nor an error nor a time.
pub(super) const DEFAULT_SAMPLES: u32 = 256;

impl SceneFile {
    /// The scene that the file describes, in metres and radians, with every default filled.
    ///
    /// # Errors
    /// [`Invalid`](crate::error::ErrorKind::Invalid), with line, key and remedy, when keys are missing, exclude each
    /// other, or have values that no camera or scene can have. Whether the focus target can be
    /// reached is the solver's to say.
    pub fn describe(&self) -> Result<SceneDescription> {
        let (document, tables) = (&self.document, &self.tables);
        let focus = tables.focus.as_ref().map(|table| focus(document, table)).transpose()?.flatten();
        let camera = validate_camera::camera(document, &tables.camera, focus.as_ref())?;
        let film_mm = validate_camera::film_mm(document, &tables.camera)?;
        let render = render(document, &tables.render)?;
        if render.diffraction && camera.aperture == Aperture::Pinhole {
            return Err(document
                .error("render.diffraction", "a pinhole here has no extent, so light cannot bend at it")
                .remedy("give f_number instead of pinhole, or set diffraction = false"));
        }
        let circle = tables.focus.as_ref().and_then(|table| table.circle_of_confusion_mm);
        let circle = circle.map_or(Length::metres(camera.film.usual_circle()), Length::millimetres);
        Ok(SceneDescription {
            document: document.clone(),
            up: direction(document, "camera.up", tables.camera.up)?,
            film_mm,
            blades: validate_camera::blades(&tables.camera),
            focus,
            circle_of_confusion: circle,
            meshes: tables
                .mesh
                .iter()
                .enumerate()
                .map(|(index, table)| mesh(document, index, table))
                .collect::<Result<_>>()?,
            sun: tables.sun.as_ref().map(|table| sun(document, table)).transpose()?,
            sky: Sky::from(&tables.sky),
            render,
            camera,
        })
    }
}

/// A direction of any length, made a unit vector.
pub(crate) fn direction(document: &Document, key: &str, value: [f64; 3]) -> Result<DVec3> {
    unit(DVec3::from_array(value)).ok_or_else(|| {
        let name = key.rsplit('.').next().unwrap_or(key);
        document
            .error(key, "a zero vector has no direction")
            .remedy(format!("for example {name} = [0.0, 1.0, 0.0]"))
    })
}

fn focus(document: &Document, table: &FocusTable) -> Result<Option<Focus>> {
    let given = [
        ("distance_m", table.distance_m.is_some()),
        ("plane", table.plane.is_some()),
        ("points_m", table.points_m.is_some()),
    ];
    let mut given = given.iter().filter(|(_, given)| *given).map(|(name, _)| *name);
    let (name, second) = (given.next(), given.next());
    if let (Some(first), Some(second)) = (name, second) {
        return Err(document
            .error(&format!("focus.{second}"), format!("[focus] has two targets, `{first}` and `{second}`"))
            .remedy("keep one of distance_m, plane, points_m"));
    }
    let target = match (table.distance_m, &table.plane, table.points_m) {
        (Some(distance), ..) => FocusTarget::Distance(distance),
        (_, Some(plane), _) => FocusTarget::Plane {
            point: DVec3::from_array(plane.point_m),
            normal: direction(document, "focus.plane.normal", plane.normal)?,
        },
        (.., Some(points)) => FocusTarget::Points(points.map(DVec3::from_array)),
        (None, None, None) => {
            return match table.adjust {
                None => Ok(None),
                Some(_) => Err(document
                    .error("focus.adjust", "`adjust` says how to reach a target, and [focus] has none")
                    .remedy("add distance_m, plane or points_m, or remove adjust")),
            };
        }
    };
    let adjust = match table.adjust {
        Some(AdjustWord::Rear) => Adjust::Rear,
        Some(AdjustWord::Front) | None => Adjust::Front,
    };
    let place = document.place(&format!("focus.{}", name.unwrap_or_default()));
    Ok(Some(Focus { target, adjust, place }))
}

fn mesh(document: &Document, index: usize, table: &MeshTable) -> Result<MeshEntry> {
    let key = format!("mesh[{index}].path");
    let mut start = table.path.chars();
    let (first, second) = (start.next(), start.next());
    // The same on every system: `C:` and a back slash lead out on one of them.
    let drive = second == Some(':') && first.is_some_and(|letter| letter.is_ascii_alphabetic());
    if drive || matches!(first, Some('/' | '\\')) {
        return Err(document
            .error(&key, "an absolute path")
            .remedy("write the path from the scene file's folder, for example \"models/tower.obj\""));
    }
    if table.path.contains(['\0', '\n']) {
        return Err(document.error(&key, "a path with a control character").remedy("correct the path"));
    }
    Ok(MeshEntry {
        path: table.path.clone(),
        scale: table.scale,
        rotate_y: Angle::degrees(table.rotate_y_deg),
        translate: DVec3::from_array(table.translate_m),
    })
}

fn sun(document: &Document, table: &SunTable) -> Result<Sun> {
    Ok(Sun {
        toward: direction(document, "sun.toward", table.toward)?,
        color: DVec3::from_array(table.color),
        shadows: table.shadows,
        angular_diameter: Angle::degrees(table.angular_diameter_deg),
    })
}

fn render(document: &Document, table: &RenderTable) -> Result<RenderSettings> {
    let budget = match (table.samples, table.max_error, table.time_budget_s) {
        (None, None, None) => Budget::Samples(DEFAULT_SAMPLES),
        (Some(samples), None, None) => Budget::Samples(samples),
        (None, Some(error), None) => Budget::MaxError(error),
        (None, None, Some(seconds)) => Budget::Seconds(seconds),
        (_, error, seconds) => {
            let second = if seconds.is_some() { "time_budget_s" } else { "max_error" };
            let first = if table.samples.is_some() { "samples" } else { "max_error" };
            debug_assert!(error.is_some() || seconds.is_some());
            return Err(document
                .error(&format!("render.{second}"), format!("`{first}` and `{second}` exclude each other"))
                .remedy("keep one of samples, max_error, time_budget_s"));
        }
    };
    Ok(RenderSettings {
        width: table.width,
        budget,
        exposure_ev: table.exposure_ev,
        falloff: table.falloff,
        diffraction: table.diffraction,
        seed: table.seed,
    })
}
