//! Geometry: a normalised OBJ in, positions, normals, coordinates and triangles out.
//!
//! `tobj` reads the records (as polygons, with an index list for each attribute); the normaliser's face records, in
//! the same order, tell which attributes a face has and where it stands in the file.

use std::collections::HashMap;
use std::io::{BufRead, Cursor, Read};
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::material::Mapping;
use super::mesh::{NONE, Triangle};
use super::normalize::{Face, Normalized};
use super::triangulate::{WORK_PER_FILE, triangulate};
use super::warnings::Warnings;
use crate::error::{Error, Result};

/// What faces become with one material of the normalised list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    /// Index of the model's material.
    pub(crate) material: u32,
    /// Where its maps lie, unless that changes nothing.
    pub(crate) mapping: Option<Mapping>,
    /// Whether it has a map.
    pub(crate) textured: bool,
    /// Whether whole repeats may be left out of its coordinates, which keeps digits.
    pub(crate) near: bool,
}

/// A model without its materials.
#[derive(Debug, Default)]
pub(crate) struct Geometry {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) texcoords: Vec<Vec2>,
    pub(crate) triangles: Vec<Triangle>,
}

impl Geometry {
    /// Bytes of memory that it takes.
    pub(crate) fn bytes(&self) -> u64 {
        let vertices = self.positions.len() * size_of::<DVec3>();
        let attributes = self.normals.len() * size_of::<Vec3>() + self.texcoords.len() * size_of::<Vec2>();
        (vertices + attributes + self.triangles.len() * size_of::<Triangle>()) as u64
    }
}

/// Lets `tobj` read the text that `write` sends piece by piece: at the same time, where there are two threads.
///
/// # Errors
/// Those of `write`, and [`Invalid`](crate::error::ErrorKind::Invalid) where `tobj` does not take what it gets.
pub(crate) fn read<T: Send>(
    write: impl FnOnce(Sender<String>) -> Result<T> + Send,
) -> Result<(T, tobj::Mesh)> {
    // What writes begins here and waits for nothing: with one thread, reading comes after it.
    let (send, receive) = channel();
    let (written, models) = rayon::join(
        move || write(send),
        move || {
            let no_materials = |_: &Path| Ok((Vec::new(), Default::default()));
            tobj::load_obj_buf(&mut Pieces::new(receive), &tobj::LoadOptions::default(), no_materials)
        },
    );
    let written = written?;
    let (models, _) = models.map_err(|e| Error::invalid(e.to_string()))?;
    Ok((written, models.into_iter().next().map(|model| model.mesh).unwrap_or_default()))
}

/// Text that comes piece by piece, until nobody is left to send it.
struct Pieces {
    from: Receiver<String>,
    piece: Cursor<String>,
}

impl Pieces {
    fn new(from: Receiver<String>) -> Self {
        Self { from, piece: Cursor::default() }
    }
}

impl Read for Pieces {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Pieces {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.piece.fill_buf()?.is_empty() {
            let Ok(piece) = self.from.recv() else { break };
            self.piece = Cursor::new(piece);
        }
        self.piece.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.piece.consume(count);
    }
}

/// Builds the geometry; `target` answers for an index into the normalised materials, or [`NONE`].
///
/// # Errors
/// When a face uses a vertex that is not finite.
pub(crate) fn build(
    (normalized, mesh): (&Normalized, &tobj::Mesh),
    target: impl Fn(u32) -> Target,
    file: &str,
    warnings: &mut Warnings,
) -> Result<Geometry> {
    let attributes = Attributes::new(mesh);
    let mut geometry = Geometry {
        positions: triples(&mesh.positions).collect(),
        normals: attributes.normals.iter().map(|n| n.unwrap_or(Vec3::Z)).collect(),
        texcoords: attributes
            .texcoords
            .iter()
            .map(|uv| narrow(uv.unwrap_or_default()).unwrap_or_default())
            .collect(),
        triangles: Vec::new(),
    };
    let count: usize = normalized.faces.iter().map(|face| face.corners - 2).sum();
    geometry.triangles.reserve_exact(count);

    // Coordinates of their own: a material's, or of a face far from the texture's first repeat.
    let mut mapped: HashMap<(u32, u32, [i64; 2]), Option<u32>> = HashMap::new();
    let mut work = WORK_PER_FILE;
    let mut begin = 0;
    let (mut corners, mut texcoords) = (Vec::new(), Vec::new());
    for face in &normalized.faces {
        let range = begin..begin + face.corners;
        begin = range.end;
        let disagree = || Error::invalid("a face is read in two ways").at_line(face.line);
        let indices = mesh.indices.get(range.clone()).ok_or_else(disagree)?;
        corners.clear();
        for &index in indices {
            let position = geometry.positions.get(index as usize).copied().ok_or_else(disagree)?;
            if !position.is_finite() {
                return Err(Error::invalid("a face uses a vertex that is not a finite number")
                    .at_line(face.line)
                    .remedy("correct that vertex, or export the model again"));
            }
            corners.push(position);
        }
        let Target { material, mapping, textured, near } = target(face.material);
        if textured && !face.texcoords {
            let message =
                || "a face has no texture coordinates; its material's texture is not seen".to_owned();
            warnings.add(file, Some(face.line), "no vt", message);
        }
        let normals = attributes.normals_of(face, mesh, range.clone(), file, warnings);
        texcoords.clear();
        if let Some(list) = attributes.texcoords_of(face, mesh, range, file, warnings) {
            let uv = |index: u32| {
                let uv = attributes.texcoords.get(index as usize).copied().flatten()?;
                Some(mapping.unwrap_or(Mapping::IDENTITY).at(uv))
            };
            let mut far = far_repeats(list.iter().filter_map(|&index| uv(index)));
            if far != [0; 2] && !near {
                let message = || {
                    "texture coordinates so far from 0 lose digits: `map_d` has a scale of its own".to_owned()
                };
                warnings.add(file, Some(face.line), "far vt", message);
                far = [0; 2];
            }
            if mapping.is_none() && far == [0; 2] {
                texcoords.extend_from_slice(list);
            } else {
                let owner = if mapping.is_none() { NONE } else { material };
                texcoords.extend(list.iter().filter_map(|&index| {
                    *mapped.entry((owner, index, far)).or_insert_with(|| {
                        geometry.texcoords.push(narrow(uv(index)? - DVec2::from(far.map(|n| n as f64)))?);
                        Some(geometry.texcoords.len() as u32 - 1)
                    })
                }));
            }
        }
        let pick = |list: Option<&[u32]>, of: [usize; 3]| {
            list.filter(|list| list.len() == face.corners).map_or([NONE; 3], |list| of.map(|i| list[i]))
        };
        let before = work;
        let is_enough = triangulate(&corners, &mut work, |of| {
            geometry.triangles.push(Triangle {
                positions: pick(Some(indices), of),
                normals: pick(normals, of),
                texcoords: pick(Some(&texcoords), of),
                material,
            });
        });
        if work == 0 && before > 0 {
            let message =
                || "the outlines of faces from here on are too tangled and may be filled wrongly".to_owned();
            warnings.add(file, Some(face.line), "tangled", message);
        } else if !is_enough && work > 0 {
            let message = || "the outline of this face is too tangled and may be filled wrongly".to_owned();
            warnings.add(file, Some(face.line), "tangled face", message);
        }
    }
    Ok(geometry)
}

/// `tobj`'s normals and texture coordinates, none where they cannot be used.
struct Attributes {
    normals: Vec<Option<Vec3>>,
    finite_normals: Vec<bool>,
    texcoords: Vec<Option<DVec2>>,
}

impl Attributes {
    fn new(mesh: &tobj::Mesh) -> Self {
        let texcoords = mesh.texcoords.chunks_exact(2).map(|uv| DVec2::new(uv[0], uv[1]));
        Self {
            normals: triples(&mesh.normals).map(usable_normal).collect(),
            finite_normals: triples(&mesh.normals).map(DVec3::is_finite).collect(),
            texcoords: texcoords.map(|uv| narrow(uv).map(|_| uv)).collect(),
        }
    }

    /// A face whose normals are not all usable has none: quietly if one is zero.
    fn normals_of<'m>(
        &self,
        face: &Face,
        mesh: &'m tobj::Mesh,
        range: std::ops::Range<usize>,
        file: &str,
        warnings: &mut Warnings,
    ) -> Option<&'m [u32]> {
        let list = mesh.normal_indices.get(range).filter(|_| face.normals)?;
        if list.iter().any(|&i| self.finite_normals.get(i as usize) != Some(&true)) {
            let message = || "a face uses a normal that is not finite; its own is used".to_owned();
            warnings.add(file, Some(face.line), "vn", message);
        }
        list.iter().all(|&i| matches!(self.normals.get(i as usize), Some(Some(_)))).then_some(list)
    }

    fn texcoords_of<'m>(
        &self,
        face: &Face,
        mesh: &'m tobj::Mesh,
        range: std::ops::Range<usize>,
        file: &str,
        warnings: &mut Warnings,
    ) -> Option<&'m [u32]> {
        let list = mesh.texcoord_indices.get(range).filter(|_| face.texcoords)?;
        let usable = list.iter().all(|&i| matches!(self.texcoords.get(i as usize), Some(Some(_))));
        if !usable {
            let message =
                || "a face uses a texture coordinate that is not finite; it gets no texture".to_owned();
            warnings.add(file, Some(face.line), "vt", message);
        }
        usable.then_some(list)
    }
}

fn triples(flat: &[f64]) -> impl Iterator<Item = DVec3> + '_ {
    flat.chunks_exact(3).map(|p| DVec3::new(p[0], p[1], p[2]))
}

/// Repeats of a texture that are taken off coordinates together.
pub(super) const STEP: f64 = 128.0;

/// How many repeats of its texture a face lies from the first, where so many leave single precision too few digits (beyond 256 a
/// thirtieth of a texel of 1024): a multiple of 128, so that neighbours mostly have the same, and still continue one another.
fn far_repeats(uv: impl Iterator<Item = DVec2> + Clone) -> [i64; 2] {
    if uv.clone().all(|uv| uv.abs().max_element() < 2.0 * STEP) {
        return [0; 2];
    }
    let first = uv.into_iter().next().unwrap_or_default();
    // What is larger than integers hold has no digits left.
    first.to_array().map(|c| (STEP * (c / STEP).round().clamp(-1e16, 1e16)) as i64)
}

/// The coordinate in f32, if it is finite there.
fn narrow(uv: DVec2) -> Option<Vec2> {
    Some(uv.as_vec2()).filter(|uv| uv.is_finite())
}

/// The normal in f32 as it is, or made unit where f32 could not square it; none if it has no direction.
fn usable_normal(n: DVec3) -> Option<Vec3> {
    let largest = n.abs().max_element();
    if !n.is_finite() || largest == 0.0 {
        return None;
    }
    let fits = (1e-15..1e15).contains(&largest);
    // Dividing by the largest part first keeps the square in range.
    Some(if fits { n.as_vec3() } else { (n / largest).normalize().as_vec3() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::normalize::normalize;

    fn run(text: &str, mapping: Option<Mapping>) -> Result<(Geometry, usize)> {
        let mut warnings = Warnings::default();
        let bytes = text.as_bytes();
        let (normalized, mesh) =
            read(|out| normalize(bytes, "a.obj", &mut warnings, u64::MAX, &|_| (), out))?;
        let geometry = build(
            (&normalized, &mesh),
            |_| Target { material: 0, mapping, textured: false, near: true },
            "a.obj",
            &mut warnings,
        )?;
        Ok((geometry, warnings.finish("a.obj").len()))
    }

    const SQUARE: &str =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\nvn 0 0 0\n";

    #[test]
    fn each_face_has_its_own_attributes_or_none() -> Result<()> {
        let (g, warnings) =
            run(&format!("{SQUARE}f 1 2 3\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf 1//1 3//1 4//2\n"), None)?;
        assert_eq!((g.triangles.len(), warnings), (4, 0));
        assert_eq!((g.triangles[0].normals, g.triangles[0].texcoords), ([NONE; 3], [NONE; 3]));
        let uv = g.triangles[2].texcoords.map(|i| g.texcoords[i as usize]);
        assert_eq!(uv, [Vec2::ZERO, Vec2::ONE, Vec2::Y]);
        assert_eq!(g.normals[g.triangles[1].normals[0] as usize], Vec3::new(0.0, 0.0, 2.0));
        assert_eq!(g.triangles[3].normals, [NONE; 3], "a zero normal is none");
        Ok(())
    }

    #[test]
    fn a_long_file_is_read_in_pieces_and_faces_may_come_before_their_vertices() -> Result<()> {
        let count = 30_000;
        let faces: String =
            (1..=count).map(|i| format!("f {} {} {}\n", 3 * i - 2, 3 * i - 1, 3 * i)).collect();
        let vertices: String = (0..count).map(|i| format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1.5\n")).collect();
        let (g, warnings) = run(&format!("{faces}{vertices}"), None)?;
        assert_eq!((g.triangles.len(), g.positions.len(), warnings), (count, 3 * count, 0));
        let last = g.triangles[count - 1].positions.map(|i| g.positions[i as usize]);
        let x = (count - 1) as f64;
        assert_eq!(last, [DVec3::X * x, DVec3::new(x, 1.0, 0.0), DVec3::new(x, 0.0, 1.5)]);
        // What is wrong at the end is told, not that the reader had to stop before the vertices came.
        let error = run(&format!("{faces}v 0 0\n{vertices}"), None).expect_err("two numbers");
        assert_eq!(error.place().line, Some(count + 1));
        Ok(())
    }

    #[test]
    fn map_scale_and_offset_are_applied() -> Result<()> {
        let mapping = Mapping { scale: DVec2::new(2.0, 3.0), offset: DVec2::new(0.5, 0.0) };
        let (g, _) = run(&format!("{SQUARE}f 1/1 2/2 3/3 4/4\n"), Some(mapping))?;
        let uv = g.triangles[0].texcoords.map(|i| g.texcoords[i as usize]);
        assert_eq!(uv, [Vec2::new(0.5, 0.0), Vec2::new(2.5, 0.0), Vec2::new(2.5, 3.0)]);
        Ok(())
    }

    #[test]
    fn coordinates_far_from_the_first_repeat_keep_their_digits() -> Result<()> {
        for (far, mapping) in [
            (0.0, None),
            (255.0, None),
            (5000.0, None),
            (-1e6, None),
            (1e9, None),
            (3000.0, Some(Mapping { offset: DVec2::new(1e7, 0.0), ..Mapping::IDENTITY })),
        ] {
            let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
            let vt = |u: f64, v: f64| format!("vt {} {}\n", far + u, v - far);
            let text = [vt(0.3, 0.1), vt(1.3, 0.1), vt(1.3, 0.9), vt(0.3, 0.9)].concat();
            let (g, warnings) = run(&format!("{vertices}{text}f 1/1 2/2 3/3 4/4\n"), mapping)?;
            assert_eq!(warnings, 0);
            for triangle in &g.triangles {
                let uv = triangle.texcoords.map(|i| g.texcoords[i as usize]);
                let at = triangle.positions.map(|i| g.positions[i as usize]);
                for (uv, at) in uv.into_iter().zip(at) {
                    let want = DVec2::new(0.3 + at.x, 0.1 + 0.8 * at.y);
                    let off = (uv.as_dvec2() - want) - (uv.as_dvec2() - want).round();
                    assert!(off.abs().max_element() < 4e-5, "{far}: {uv}, not {want}");
                }
            }
        }
        // Neighbours continue one another: a corner of both has one coordinate.
        let strip = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 300 0\nvt 301 0\nvt 300 1\nvt 301 1\n";
        let (g, _) = run(&format!("{strip}f 1/1 2/2 3/3\nf 2/2 4/4 3/3\n"), None)?;
        assert_eq!(g.triangles[0].texcoords[1], g.triangles[1].texcoords[0]);
        Ok(())
    }

    #[test]
    fn what_is_not_finite_is_refused_or_dropped() -> Result<()> {
        let error = run(&format!("{SQUARE}v nan 0 0\nf 1 2 3\nf 1 2 5\n"), None).expect_err("not finite");
        assert_eq!(error.place().line, Some(13));
        assert!(run(&format!("{SQUARE}v nan 0 0\nf 1 2 3\n"), None).is_ok(), "no face uses it");
        let (g, warnings) = run(&format!("{SQUARE}vt inf 0\nvn nan 0 0\nf 1/5/3 2/2/1 3/3/1\n"), None)?;
        assert_eq!((g.triangles[0].texcoords, g.triangles[0].normals, warnings), ([NONE; 3], [NONE; 3], 2));
        Ok(())
    }
}
