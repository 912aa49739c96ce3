//! Coverage and depth, bit for bit, against all triangles one by one: what bins, order, regions, boxes lens point by lens point,
//! sieves and vector instructions leave out or arrange otherwise changes nothing. (That the functions themselves are right is
//! for the oracle in double precision, `tests/oracle.rs`.)

use super::pattern::{Splits, pattern};
use super::prepared::{Prepared, Sequence};
use super::{Execution, draw};
use crate::error::Result;
use crate::random::Random;
use crate::raster::batch::Batch;
use crate::raster::film::TileFilm;
use crate::raster::geometry::Geometry;
use crate::raster::part::Part;
use crate::raster::tile::TileScratch;
use crate::raster::visibility::{EVERYWHERE, NOTHING};
use crate::raster::{LANES, TILE};
use crate::sampling;
use crate::scene::{LoadSettings, Memory, Scene, parse};
use crate::simd::SimdLevel;
use std::fmt::Write;
use std::path::Path;

/// A camera one metre before the origin, with some keys of its own, and faces, each by its corners in metres.
fn scene<const N: usize>(keys: &str, width: u32, faces: &[[[f64; 3]; N]]) -> Result<Scene> {
    let mut mesh = String::new();
    for [x, y, z] in faces.as_flattened() {
        let _ = writeln!(mesh, "v {x} {y} {z}");
    }
    for face in 0..faces.len() {
        mesh.push('f');
        (1..=N).for_each(|corner| mesh += &format!(" {}", N * face + corner));
        mesh.push('\n');
    }
    let text = format!(
        "[camera]\neye_m = [0.0, 0.0, 1.0]\nlook_at_m = [0.0, 0.0, 0.0]\nfocal_length_mm = 150.0\nfilm = \"4x5\"\n{keys}\n\
         [[mesh]]\npath = \"a.obj\"\n"
    );
    let files = Memory::new().with("a.obj", mesh.into_bytes());
    let settings = LoadSettings { width: Some(width), ..Default::default() };
    let mut scene = parse(&text, "a.toml")?.describe()?.load_with(&files, Path::new(""), settings)?;
    // Each triangle a surface of its own; or the two of a quad, which are drawn as one.
    scene.render.share_shading = N == 4;
    assert_eq!(scene.surfaces.patches.quads.is_empty(), N == 3);
    Ok(scene)
}

/// Triangles of about `size`, around the origin and, `near` the lens, through it and behind it.
fn triangles(count: usize, size: f64, near: bool) -> Vec<[[f64; 3]; 3]> {
    let mut numbers = Random(7);
    let mut random = |size: f64| numbers.signed() * size;
    let mut one = |middle: f64| {
        let middle = [random(0.4), random(0.4), middle + random(0.6)];
        [0; 3].map(|_| middle.map(|middle| middle + random(size)))
    };
    (0..count).map(|at| one(if near && at % 3 == 0 { 1.0 } else { 0.0 })).collect()
}

/// Convex plane quadrilaterals of about `size`, likewise.
fn quads(count: usize, size: f64, near: bool) -> Vec<[[f64; 3]; 4]> {
    let each = triangles(count, size, near).into_iter();
    each.map(|[a, b, c]| {
        // The diagonals cross in `a`.
        let along = |to: [f64; 3], by: f64| [0, 1, 2].map(|axis| a[axis] + by * (to[axis] - a[axis]));
        [along(b, 0.4), along(c, 0.5), along(b, -0.7), along(c, -0.3)]
    })
    .collect()
}

/// A triangle's functions at a lens point and place in the block, as `raster::kernel` has them: the value at the tile's centre, and
/// the changes with `x` and `y`.
fn at_lens(e: [f32; 9], [u, v, jx, jy]: [f32; 4], factor: f32) -> [f32; 3] {
    let part = |i: usize| u * e[i + 1] + v * e[i + 2] + e[i];
    let [c, cx, cy] = [part(0), part(3), part(6)];
    [(c + cx * jx + cy * jy) * factor, cx * factor, cy * factor]
}

/// What a batch sees, block by block: the largest `1/t` of all triangles, those that have it, and what single precision may
/// leave wrong of it.
fn all_one_by_one(
    picture: &Prepared<'_>,
    film: &TileFilm,
    batch: &Batch,
    block: (u32, u32),
) -> Vec<[(f32, Vec<u32>, f32); LANES]> {
    let half = 0.5 * TILE as f32;
    let columns = TILE / block.0;
    let blocks = columns * (TILE / block.1);
    let mut seen = vec![std::array::from_fn(|_| (0.0, vec![NOTHING], 0.0)); blocks as usize];
    for (triangle, corners) in picture.surfaces.triangles.iter().enumerate() {
        let v = corners.map(|corner| picture.positions[corner as usize]);
        let edges = film.scaled_edges(v).map(|e| e.map(|c| c as f32));
        let (facing, plane) = film.depth(v);
        for lane in (0..LANES).filter(|lane| batch.live >> lane & 1 == 1) {
            let [u, v, jx, jy] = [batch.u, batch.v, batch.x, batch.y].map(|all| all[lane]);
            let distance = u * plane[1] + v * plane[2] + plane[0];
            if distance == 0.0 {
                continue;
            }
            let [z0, zx, zy] = at_lens(facing, [u, v, jx, jy], 1.0 / distance);
            let edges = edges.map(|e| at_lens(e, [u, v, jx, jy], 1.0f32.copysign(distance)));
            for (at, seen) in seen.iter_mut().enumerate() {
                let x = (at as u32 % columns * block.0) as f32 - half;
                let y = (at as u32 / columns * block.1) as f32 - half;
                let z = z0 + zy * y + zx * x;
                let near =
                    (jx + x) * film.near_inverse[1] + (jy + y) * film.near_inverse[2] + film.near_inverse[0];
                let is_inside = edges.iter().all(|[c, cx, cy]| c + cy * y + cx * x >= 0.0);
                let (nearest, who, doubt) = &mut seen[lane];
                if is_inside && z > 0.0 && z <= near && z >= *nearest {
                    if z > *nearest {
                        who.clear();
                    }
                    *nearest = z;
                    // Seen nearly edge-on, both of what `1/t` is the quotient of are small differences.
                    let large = (u * plane[1]).abs() + (v * plane[2]).abs() + plane[0].abs();
                    *doubt = 1e-6
                        * z
                        * (large / distance.abs() + (z0.abs() + (zy * y).abs() + (zx * x).abs()) / z);
                    who.push(triangle as u32);
                }
            }
        }
    }
    seen
}

/// Compares every sample of some tiles; tells how many see something, and how often the triangles of a tile were sifted by what
/// its samples may see.
fn compare(name: &str, scene: &Scene, samples: u32, tiles: &[(u32, u32)]) -> Result<(usize, usize)> {
    draw(scene, Sequence::Uniform(samples), &Execution::default(), |picture, _| {
        let block = sampling::block(samples);
        let geometry = Geometry {
            view: &picture.view,
            bins: &picture.bins,
            positions: picture.positions,
            surfaces: picture.surface_count,
            clock: None,
            stop: &|| false,
        };
        let (mut others, mut met, mut sifted, mut scratches) =
            (0, 0, 0, SimdLevel::ALL.map(|_| TileScratch::default()));
        for &tile in tiles {
            let film = TileFilm::new(&picture.view, tile.0, tile.1);
            for (run, splits) in Splits::steps(samples, false) {
                let pattern = pattern(&picture.points, tile, samples, run, splits, &|| false);
                let levels = SimdLevel::ALL.into_iter().zip(&mut scratches);
                for (level, scratch) in levels.filter(|(level, _)| level.is_available()) {
                    let part = Part { tile, block_size: block, wanted: EVERYWHERE };
                    scratch.prepare(level.level(), &geometry, &film, part, &pattern);
                    sifted += usize::from(scratch.serves_one_pattern());
                }
                for (number, batch) in pattern.batches.iter().enumerate() {
                    let wanted = all_one_by_one(picture, &film, batch, block);
                    let levels = SimdLevel::ALL.into_iter().zip(&mut scratches);
                    for (level, scratch) in levels.filter(|(level, _)| level.is_available()) {
                        let batch = (number, batch);
                        scratch.draw(level.level(), EVERYWHERE, &geometry, &film, batch, &|_, _| {});
                        let (seen, surfaces) = (scratch.seen(), scratch.surfaces());
                        for (at, wanted) in wanted.iter().enumerate() {
                            // What lies outside of the picture is nobody's.
                            let is_inside = |lane: &usize| {
                                let (x, y) = pattern.pixel(pattern.corner(at as u32), batch.1, *lane);
                                let [width, height] = picture.size_of(tile);
                                batch.1.live >> lane & 1 == 1 && x < width && y < height
                            };
                            for lane in (0..LANES).filter(is_inside) {
                                let (z, who, doubt) = &wanted[lane];
                                let id = seen.id[at][lane];
                                let triangle = surfaces.get(id as usize).copied().unwrap_or(NOTHING);
                                let found = seen.inverse_depth[at][lane];
                                let is_right = if scene.render.share_shading {
                                    // The plane is that of one half, and two quads may cross.
                                    let patch =
                                        |t: u32| (t != NOTHING).then(|| picture.surfaces.patches.of(t).0);
                                    let is_other = !who.iter().any(|&t| patch(t) == patch(triangle));
                                    others += usize::from(is_other);
                                    (found - z).abs() <= *doubt
                                } else {
                                    found.to_bits() == z.to_bits() && who.contains(&triangle)
                                };
                                assert!(
                                    is_right,
                                    "{name}, N = {samples}, {}, tile {tile:?}, block {at}, lane {lane}: {triangle} at {}, {who:?} at {z}",
                                    level.name(),
                                    found,
                                );
                                met += usize::from(triangle != NOTHING);
                            }
                        }
                    }
                }
            }
        }
        assert!(others <= met / 10_000, "{name}, N = {samples}: {others} of {met} see another quad");
        Ok((met, sifted))
    })
}

#[test]
fn coverage_and_depth_are_exactly_those_of_all_triangles_one_by_one() -> Result<()> {
    let blurred = "f_number = 1.2\nextension_mm = 230.0";
    let views = [
        ("pinhole", "pinhole = true\nextension_mm = 180.0"),
        ("in focus", "f_number = 8.0\nextension_mm = 178.0"),
        ("blurred", blurred),
        (
            "lens tilted",
            "f_number = 2.8\nextension_mm = 178.0\nfront = { tilt_deg = 12.0, swing_deg = -5.0 }",
        ),
        ("film tilted", "f_number = 4.0\nextension_mm = 178.0\nrear = { tilt_deg = -20.0, rise_mm = 20.0 }"),
    ];
    for (name, keys) in views {
        for (what, count, size, near) in
            [("large", 40, 0.5, false), ("near", 60, 0.3, true), ("small", 300, 0.05, false)]
        {
            let scene = scene(keys, 96, &triangles(count, size, near))?;
            for samples in [1, 3, 7, 16, 40] {
                let (met, _) =
                    compare(&format!("{name}, {what}"), &scene, samples, &[(0, 0), (1, 1), (2, 2)])?;
                assert!(met > 1000, "{name}, {what}, N = {samples}: only {met} samples see anything");
            }
        }
    }
    for (name, keys) in views {
        for (what, count, size, near) in
            [("large", 40, 0.5, false), ("near", 60, 0.3, true), ("small", 300, 0.05, false)]
        {
            let scene = scene(keys, 96, &quads(count, size, near))?;
            for samples in [1, 7, 40] {
                let name = format!("{name}, {what} quads");
                let (met, _) = compare(&name, &scene, samples, &[(0, 0), (1, 1), (2, 2)])?;
                assert!(met > 1000, "{name}, N = {samples}: only {met} samples see anything");
            }
        }
    }
    // Regions of the lens; triangles that few lens points see; triangles between the samples.
    let regions = scene(views[3].1, 64, &triangles(60, 0.1, false))?;
    assert!(compare("regions of the lens", &regions, 256, &[(0, 1)])?.0 > 1000);
    // The last have too many batches for their lens points to be told apart.
    let all = [(3000, 3, 100), (3000, 16, 1000), (600, 40, 100), (300, 256, 100), (100, 2048, 100)];
    for (count, samples, least) in all {
        let loose = scene(blurred, 800, &triangles(count, 0.003, false))?;
        let (met, sifted) = compare("loose", &loose, samples, &[(10, 10), (13, 8)])?;
        assert!(met > least && (sifted > 0) == (samples < 2048), "N = {samples}: {met} {sifted}");
    }
    let (crowd, quads) = (triangles(40_000, 0.004, false), quads(40_000, 0.006, false));
    for crowd in [scene(views[1].1, 32, &crowd)?, scene(views[1].1, 32, &quads)?] {
        let (met, sifted) = compare("crowd", &crowd, 2, &[(0, 0)])?;
        assert!(met > 1000 && sifted > 0, "{met} {sifted}");
    }
    // Quads far out of focus are drawn by triangles.
    let loose = scene(blurred, 800, &self::quads(3000, 0.003, false))?;
    assert!(compare("loose quads", &loose, 16, &[(10, 10)])?.0 > 100);
    Ok(())
}
