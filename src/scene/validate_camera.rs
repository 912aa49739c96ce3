//! The camera's tables to a [`Camera`]: rail frame, standards, aperture and film. In: tables whose
//! numbers are in range; out: the camera, or an error with line, key and remedy.

use super::description::{Blades, Focus};
use super::document::Document;
use super::file::{CameraTable, StandardTable};
use crate::camera::{Aperture, Camera, FilmSize, Standard};
use crate::error::Result;
use crate::optics::{Adjust, FocusTarget};
use crate::quantity::{Angle, FNumber, Length};
use glam::DVec3;

/// `focus` tells which movements the solver will replace: those are not judged.
pub(crate) fn camera(document: &Document, table: &CameraTable, focus: Option<&Focus>) -> Result<Camera> {
    let rail = Camera::rail_frame(
        DVec3::from_array(table.eye_m),
        DVec3::from_array(table.look_at_m),
        DVec3::from_array(table.up),
    )
    .map_err(|error| {
        let key = format!("camera.{}", error.place().key.as_deref().unwrap_or_default());
        let place = document.place(&key);
        error.at(place)
    })?;
    let [width, height] = film_mm(document, table)?.map(Length::millimetres);
    let focal_length = Length::millimetres(table.focal_length_mm);
    let turned = match focus {
        Some(Focus { target: FocusTarget::Plane { .. } | FocusTarget::Points(_), adjust, .. }) => {
            Some(*adjust)
        }
        _ => None,
    };
    let extension = match table.extension_mm {
        Some(extension) => Length::millimetres(extension),
        None if focus.is_some() => focal_length,
        None => {
            return Err(document
                .error(
                    "camera.extension_mm",
                    "nothing says where the film is: neither `extension_mm` nor a [focus] target",
                )
                .remedy(
                    "add `extension_mm = 152.3` to [camera], or [focus] with distance_m, plane or points_m",
                ));
        }
    };
    Ok(Camera {
        rail,
        front: standard(document, "camera.front", &table.front, turned == Some(Adjust::Front))?,
        rear: standard(document, "camera.rear", &table.rear, turned == Some(Adjust::Rear))?,
        extension,
        focal_length,
        aperture: aperture(document, table)?,
        film: FilmSize { width, height },
        near: table.near_m.map_or(Length::metres(focal_length.as_metres() / 10.0), Length::metres),
    })
}

fn standard(document: &Document, key: &str, table: &StandardTable, solved: bool) -> Result<Standard> {
    let standard = Standard {
        tilt: Angle::degrees(table.tilt_deg),
        swing: Angle::degrees(table.swing_deg),
        rise: Length::millimetres(table.rise_mm),
        shift: Length::millimetres(table.shift_mm),
    };
    // The cosine of 90 degrees is 6e-17 in f64, not 0.
    if !solved && standard.rotation().z_axis.z <= f64::EPSILON {
        let name = if table.tilt_deg.abs() >= table.swing_deg.abs() { "tilt_deg" } else { "swing_deg" };
        let part = if key.ends_with("front") { "lens" } else { "film" };
        return Err(document
            .error(&format!("{key}.{name}"), format!("the {part} faces backwards or sideways"))
            .remedy("keep tilt and swing between -90 and 90 degrees"));
    }
    Ok(standard)
}

fn aperture(document: &Document, table: &CameraTable) -> Result<Aperture> {
    match (table.f_number, table.pinhole) {
        (Some(_), Some(true)) => Err(document
            .error("camera.pinhole", "`f_number` and `pinhole` exclude each other")
            .remedy("remove one of them")),
        (Some(number), _) => FNumber::new(number).map(Aperture::FNumber).map_err(|error| {
            let place = document.place("camera.f_number");
            error.at(place)
        }),
        (None, Some(true)) => Ok(Aperture::Pinhole),
        (None, _) => Err(document
            .error("camera.f_number", "[camera] lacks the key `f_number` (or `pinhole`)")
            .remedy("add `f_number = 5.6`, or `pinhole = true`")),
    }
}

/// Width and height of the film in millimetres.
pub(crate) fn film_mm(document: &Document, table: &CameraTable) -> Result<[f64; 2]> {
    match (table.film_mm, &table.film) {
        (Some(_), Some(_)) => Err(document
            .error("camera.film", "`film_mm` and `film` exclude each other")
            .remedy("remove one of them")),
        (Some(size), None) => Ok(size),
        (None, Some(name)) => {
            let film = FilmSize::named(name).map_err(|error| {
                let place = document.place("camera.film");
                error.at(place)
            })?;
            Ok([film.width.as_millimetres(), film.height.as_millimetres()])
        }
        (None, None) => Err(document
            .error("camera.film_mm", "[camera] lacks the key `film_mm` (or `film`)")
            .remedy("add `film_mm = [120.0, 96.0]`, or `film = \"4x5\"`")),
    }
}

pub(crate) fn blades(table: &CameraTable) -> Option<Blades> {
    let table = table.aperture.as_ref()?;
    Some(Blades { count: table.blades, rotation: Angle::degrees(table.rotation_deg) })
}
