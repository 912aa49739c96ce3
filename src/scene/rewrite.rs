//! A scene file with the movements that a solver found: comments and order stay, the target goes.

use crate::camera::{Camera, Standard};
use crate::error::{Error, Result};
use std::ops::Range;
use toml_edit::{Document, DocumentMut, Item, Key, TableLike, TomlError, value};

/// The text of a scene file with the movements and the extension of `camera`, and without a focus target.
///
/// What already has the wanted value is left as it is written. `mesh_path` maps each mesh's path, for a
/// file that is written into another folder.
///
/// # Errors
/// [`crate::error::ErrorKind::Invalid`] when the text is not a scene file.
pub fn with_movements(text: &str, camera: &Camera, mesh_path: impl Fn(&str) -> String) -> Result<String> {
    let not_toml = |error: TomlError| Error::invalid(format!("not TOML: {error}"));
    let text_before = text;
    let text = without_target(text, &Document::parse(text).map_err(not_toml)?);
    let mut document: DocumentMut = text.parse().map_err(not_toml)?;
    let root = document
        .get_mut("camera")
        .and_then(Item::as_table_like_mut)
        .ok_or_else(|| Error::invalid("no [camera] table").at_key("camera"))?;
    set(root, "extension_mm", camera.extension.as_millimetres());
    for (name, standard) in [("front", &camera.front), ("rear", &camera.rear)] {
        write_standard(root, name, standard);
    }
    rename_meshes(&mut document, &mesh_path);
    Ok(as_written(text_before, document.to_string()))
}

/// The text with the line ends and the byte order mark of the one before, which rewriting leaves out.
fn as_written(before: &str, text: String) -> String {
    let ends = before.matches("\r\n").count();
    let is_crlf = ends > 0 && ends == before.matches('\n').count();
    let text = if is_crlf { text.replace("\r\n", "\n").replace('\n', "\r\n") } else { text };
    if before.starts_with('\u{feff}') && !text.starts_with('\u{feff}') {
        format!("\u{feff}{text}")
    } else {
        text
    }
}

/// The keys of the focus target.
const TARGET: [&str; 4] = ["distance_m", "plane", "points_m", "adjust"];

/// The text without the lines of the focus target, and of a table that has nothing else; comments of lines of their own stay, as a
/// title before the table may be the file's.
fn without_target(text: &str, document: &Document<&str>) -> String {
    let Some((name, focus)) = document.get_key_value("focus") else { return text.to_owned() };
    let Some(table) = focus.as_table_like() else { return text.to_owned() };
    let is_target = |key: &str| TARGET.contains(&key);
    let is_whole = table.iter().all(|(key, _)| is_target(key));
    let mut cuts: Vec<Range<usize>> = Vec::new();
    match focus {
        Item::Table(table) => {
            for (key, item) in table.iter().filter(|(key, _)| is_target(key)) {
                lines_of(text, table.key(key), item, &mut cuts);
            }
            if is_whole && !table.is_dotted() {
                cuts.extend(lines(text, table.span()));
            }
        }
        _ if is_whole => lines_of(text, Some(name), focus, &mut cuts),
        // Within one line keys come and go without comments.
        _ => {
            let mut document = document.clone().into_mut();
            if let Some(table) = document.get_mut("focus").and_then(Item::as_table_like_mut) {
                for key in TARGET {
                    table.remove(key);
                }
            }
            return document.to_string();
        }
    }
    cuts.sort_by_key(|cut| cut.start);
    let mut kept = String::with_capacity(text.len());
    let mut done = 0;
    for cut in cuts {
        kept.push_str(text.get(done..cut.start).unwrap_or_default());
        done = cut.end.max(done);
    }
    kept.push_str(&text[done..]);
    kept
}

/// The lines that a key and its item take, in whatever form it is written.
fn lines_of(text: &str, key: Option<&Key>, item: &Item, cuts: &mut Vec<Range<usize>>) {
    if let Item::Table(table) = item {
        table.iter().for_each(|(key, item)| lines_of(text, table.key(key), item, cuts));
        if !table.is_dotted() {
            cuts.extend(lines(text, table.span()));
        }
    } else if let Some((key, item)) = key.and_then(Key::span).zip(item.span()) {
        cuts.extend(lines(text, Some(key.start..item.end)));
    }
}

/// The whole lines that these bytes lie on.
fn lines(text: &str, bytes: Option<Range<usize>>) -> Option<Range<usize>> {
    let Range { start, end } = bytes?;
    let start = text[..start].rfind('\n').map_or(0, |at| at + 1);
    Some(start..text[end..].find('\n').map_or(text.len(), |at| end + at + 1))
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
            let rounding = if key.ends_with("_mm") { 1e-12 * number.abs() } else { 0.0 };
            if (before - number).abs() > rounding {
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
    fn comments_before_the_target_stay() {
        let rest = "[camera]\nextension_mm = 1\n";
        for (focus, want) in [
            (
                "# title\n\n# target\n[focus] # goes\n# far\ndistance_m = 3 # goes\n# end\n",
                "# title\n\n# target\n# far\n# end\n",
            ),
            (
                "# title\n[focus]\nplane.point_m = [\n  0, # x\n  0, 0]\n# n\nplane.normal = [0, 1, 0]\n",
                "# title\n# n\n",
            ),
            (
                "# title\n[focus]\n# kept\ncircle_of_confusion_mm = 0.1\n",
                "# title\n[focus]\n# kept\ncircle_of_confusion_mm = 0.1\n",
            ),
            ("# title\nfocus.distance_m = 3\n# b\nfocus.adjust = \"rear\"\n", "# title\n# b\n"),
            ("# title\r\nfocus = { distance_m = 3, adjust = \"front\" }\r\n# b\r\n", "# title\r\n# b\r\n"),
            (
                "# title\nfocus = { distance_m = 3, circle_of_confusion_mm = 0.1 }\n",
                "# title\nfocus = { circle_of_confusion_mm = 0.1 }\n",
            ),
            (
                "# title\n[focus]\nadjust = \"front\"\n[focus.plane]\n# p\npoint_m = [0, 0, 0]\nnormal = [0, 1, 0]\n",
                "# title\n# p\n",
            ),
        ] {
            let text = format!("{focus}{rest}");
            let out = without_target(&text, &Document::parse(text.as_str()).unwrap());
            assert_eq!(out.strip_suffix(rest), Some(want), "{text}");
        }
        let last =
            without_target("[focus]\ndistance_m = 3", &Document::parse("[focus]\ndistance_m = 3").unwrap());
        assert_eq!(last, "");
    }

    #[test]
    fn line_ends_and_byte_order_marks_stay() {
        let text = "\u{feff}# title\r\n[camera]\r\nextension_mm = 1\r\n[focus]\r\ndistance_m = 3\r\n";
        let out = with_movements(text, &camera(), str::to_owned).unwrap();
        assert!(out.starts_with("\u{feff}# title\r\n") && out.matches('\n').count() > 3, "{out:?}");
        assert_eq!(out.matches("\r\n").count(), out.matches('\n').count(), "{out:?}");
    }

    #[test]
    fn the_last_digit_of_an_angle_is_written() {
        let mut camera = camera();
        camera.front.tilt = Angle::degrees(6.500000000000001);
        let text = "[camera]\nextension_mm = 1\n[camera.front]\ntilt_deg = 6.5\n[camera.rear]\nrise_mm = 12.000000000000002\n";
        let out = with_movements(text, &camera, str::to_owned).unwrap();
        assert!(out.contains("6.500000000000001") && out.contains("12.000000000000002"), "{out}");
    }

    #[test]
    fn an_emptied_focus_table_goes_too() {
        let text = "camera = { extension_mm = 1 }\n[focus]\ndistance_m = 3\nadjust = \"rear\"\n";
        let out = with_movements(text, &camera(), str::to_owned).unwrap();
        assert!(!out.contains("focus") && out.contains("152.25"), "{out}");
        assert!(with_movements("x = 1", &camera(), str::to_owned).is_err());
    }
}
