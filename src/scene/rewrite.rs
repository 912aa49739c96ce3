//! A scene file with the movements that a solver found: comments and order stay, the target goes.

use crate::camera::{Camera, Standard};
use crate::error::{Error, Result};
use toml_edit::{DocumentMut, Item, TableLike, value};

/// The text of a scene file with the movements and the extension of `camera`, and without a focus target.
///
/// What already has the wanted value is left as it is written. `mesh_path` maps each mesh's path, for a
/// file that is written into another folder.
///
/// # Errors
/// [`crate::error::ErrorKind::Invalid`] when the text is not a scene file.
pub fn with_movements(text: &str, camera: &Camera, mesh_path: impl Fn(&str) -> String) -> Result<String> {
    let mut document: DocumentMut =
        text.parse().map_err(|error| Error::invalid(format!("not TOML: {error}")))?;
    let root = document
        .get_mut("camera")
        .and_then(Item::as_table_like_mut)
        .ok_or_else(|| Error::invalid("no [camera] table").at_key("camera"))?;
    set(root, "extension_mm", camera.extension.as_millimetres());
    for (name, standard) in [("front", &camera.front), ("rear", &camera.rear)] {
        write_standard(root, name, standard);
    }
    if let Some(focus) = document.get_mut("focus").and_then(Item::as_table_like_mut) {
        for key in ["distance_m", "plane", "points_m", "adjust"] {
            focus.remove(key);
        }
        if focus.is_empty() {
            document.remove("focus");
        }
    }
    rename_meshes(&mut document, &mesh_path);
    Ok(document.to_string())
}

fn write_standard(root: &mut dyn TableLike, name: &str, standard: &Standard) {
    let wanted = [
        ("tilt_deg", standard.tilt.as_degrees()),
        ("swing_deg", standard.swing.as_degrees()),
        ("rise_mm", standard.rise.as_millimetres()),
        ("shift_mm", standard.shift.as_millimetres()),
    ];
    if root.get(name).is_none() {
        if wanted.iter().all(|(_, number)| *number == 0.0) {
            return;
        }
        root.insert(name, toml_edit::table());
    }
    if let Some(table) = root.get_mut(name).and_then(Item::as_table_like_mut) {
        for (key, number) in wanted {
            let before = table.get(key).and_then(number_of).unwrap_or(0.0);
            // Rise and shift pass through metres; a last-digit change of them is no movement.
            if (before - number).abs() > 1e-12 * number.abs() {
                set(table, key, number);
            }
        }
    }
}

fn number_of(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64))
}

fn set(table: &mut dyn TableLike, key: &str, number: f64) {
    match table.get_mut(key) {
        // Keeps the comment behind the value.
        Some(Item::Value(old)) => {
            let decor = old.decor().clone();
            *old = number.into();
            *old.decor_mut() = decor;
        }
        _ => {
            table.insert(key, value(number));
        }
    }
}

fn rename_meshes(document: &mut DocumentMut, mesh_path: &impl Fn(&str) -> String) {
    let Some(meshes) = document.get_mut("mesh") else { return };
    let rename = |table: &mut dyn TableLike| {
        if let Some(path) = table.get("path").and_then(Item::as_str).map(mesh_path)
            && let Some(Item::Value(old)) = table.get_mut("path")
            && old.as_str() != Some(&path)
        {
            let decor = old.decor().clone();
            *old = path.into();
            *old.decor_mut() = decor;
        }
    };
    if let Some(tables) = meshes.as_array_of_tables_mut() {
        for table in tables.iter_mut() {
            rename(table);
        }
    } else if let Some(array) = meshes.as_array_mut() {
        for item in array.iter_mut() {
            if let Some(table) = item.as_inline_table_mut() {
                rename(table);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aperture, FilmSize};
    use crate::quantity::{Angle, Length};
    use glam::DVec3;

    fn camera() -> Camera {
        Camera {
            rail: Camera::rail_frame(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap(),
            front: Standard { tilt: Angle::degrees(6.5), ..Standard::default() },
            rear: Standard { rise: Length::millimetres(12.0), ..Standard::default() },
            extension: Length::millimetres(152.25),
            focal_length: Length::millimetres(150.0),
            aperture: Aperture::Pinhole,
            film: FilmSize::named("4x5").unwrap(),
            near: Length::millimetres(15.0),
        }
    }

    #[test]
    fn comments_stay_and_the_target_goes() {
        let text = "# a tower\n[camera]\neye_m = [0, 1, 2] # here\n[camera.rear]\nrise_mm = 12 # kept\n\
                    [focus]\nplane = { point_m = [0, 0, 0], normal = [0, 1, 0] }\n\
                    circle_of_confusion_mm = 0.1\n[[mesh]]\npath = \"a.obj\"\n";
        let out = with_movements(text, &camera(), |path| format!("../{path}")).unwrap();
        for kept in ["# a tower", "# here", "rise_mm = 12 # kept", "circle_of_confusion_mm = 0.1"] {
            assert!(out.contains(kept), "{out}");
        }
        for added in ["extension_mm = 152.25", "tilt_deg = 6.5", "path = \"../a.obj\""] {
            assert!(out.contains(added), "{out}");
        }
        assert!(!out.contains("plane") && !out.contains("swing"), "{out}");
    }

    #[test]
    fn an_emptied_focus_table_goes_too() {
        let text = "camera = { extension_mm = 1 }\n[focus]\ndistance_m = 3\nadjust = \"rear\"\n";
        let out = with_movements(text, &camera(), str::to_owned).unwrap();
        assert!(!out.contains("focus") && out.contains("152.25"), "{out}");
        assert!(with_movements("x = 1", &camera(), str::to_owned).is_err());
    }
}
