//! Shapes that glow before black, so that a pixel's value counts samples: closed meshes, tessellated planes.

use super::common::scenes::{Random, plain};
use glam::{DMat3, DVec3};
use groundglass::camera::Camera;
use groundglass::optics::Optics;
use groundglass::render::{Execution, render};
use groundglass::scene::{Attributes, Material, NONE, Scene, Surfaces};
use std::collections::BTreeMap;

pub type Triangle = [DVec3; 3];

/// Red, green or blue light and nothing else.
fn glow(channel: usize) -> Material {
    let mut material = plain([0.0; 3]);
    material.emission[channel] = 1.0;
    material
}

/// Triangles with the channel each glows in; vertices at one place are one vertex.
pub fn surfaces(all: &[(Triangle, usize)]) -> Surfaces {
    let mut surfaces = Surfaces { materials: (0..3).map(glow).collect(), ..Surfaces::default() };
    let mut known: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    for (triangle, channel) in all {
        let corners = triangle.map(|p| {
            *known.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                surfaces.positions.push(p);
                surfaces.positions.len() as u32 - 1
            })
        });
        surfaces.triangles.push(corners);
        surfaces.attributes.push(Attributes {
            normals: [NONE; 3],
            texcoords: [NONE; 3],
            material: *channel as u32,
        });
    }
    surfaces
}

/// How many samples of each pixel see each of the three channels.
pub fn counts(camera: &Camera, all: &[(Triangle, usize)], width: u32, samples: u32) -> Vec<[u32; 3]> {
    let mut scene: Scene = super::common::scenes::scene(camera, surfaces(all), width, samples);
    scene.optics = Optics::new(camera).unwrap();
    // Parts of a surface are drawn one by one and compared: each through the whole lens, however little that blurs it.
    scene.render.effects.all = true;
    scene.sun = None;
    scene.sky.ambient = DVec3::ZERO;
    scene.sky.horizon = DVec3::ZERO;
    scene.sky.zenith = DVec3::ZERO;
    let (picture, _) = render(&scene, Execution::default()).unwrap();
    let pixels = (0..scene.render.height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            picture.pixel(x, y).map(|value| {
                let count = f64::from(value) * f64::from(samples);
                assert!((count - count.round()).abs() < 1e-2, "{count} of {samples} samples");
                count.round() as u32
            })
        })
        .collect()
}

/// The samples that see one channel, summed over the picture.
pub fn total(counts: &[[u32; 3]], channel: usize) -> u64 {
    counts.iter().map(|c| u64::from(c[channel])).sum()
}

/// A turn about a random axis.
pub fn rotation(random: &mut Random) -> DMat3 {
    let x = (random.point(1.0) + DVec3::new(0.0, 0.0, 1e-3)).normalize();
    let y = x.cross(random.point(1.0)).normalize();
    DMat3::from_cols(x, y, x.cross(y))
}

/// A closed mesh about the origin that every ray from there meets once: a sphere of 20 * 4^levels triangles, each
/// vertex moved to a random distance.
pub fn closed(random: &mut Random, levels: u32, near: f64, far: f64) -> Vec<Triangle> {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let turn = rotation(random);
    let corners: Vec<DVec3> = [(0.0, 1.0, g), (1.0, g, 0.0), (g, 0.0, 1.0)]
        .iter()
        .flat_map(|&(x, y, z)| {
            [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(s, t)| match (x, y, z) {
                (0.0, ..) => DVec3::new(0.0, s * y, t * z),
                (_, _, 0.0) => DVec3::new(s * x, t * y, 0.0),
                _ => DVec3::new(s * x, 0.0, t * z),
            })
        })
        .map(|p| turn * p)
        .collect();
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let t = [corners[i], corners[j], corners[k]];
                let is_edge = |a: DVec3, b: DVec3| (a - b).length() < 2.1;
                if is_edge(t[0], t[1]) && is_edge(t[1], t[2]) && is_edge(t[2], t[0]) {
                    triangles.push(t.map(DVec3::normalize));
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    for _ in 0..levels {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                // The sum of two does not depend on their order: neighbours get the same vertex.
                let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let seed = random.next();
    let moved = |p: DVec3| {
        // The same for a vertex wherever it occurs.
        let bits = p.to_array().map(f64::to_bits);
        let key = bits.iter().fold(seed.to_bits(), |sum, b| (sum ^ b).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        p * (near + (far - near) * Random(key).next())
    };
    triangles.into_iter().map(|t| t.map(moved)).collect()
}

/// A tessellated part of a plane: `columns` and `rows` are the places of its lines along `u` and `v`; inner vertices are
/// moved by up to `jitter` of a cell. Each triangle comes with its class, 0 to 7: those of one class share no vertex.
pub fn sheet(
    random: &mut Random,
    origin: DVec3,
    [u, v]: [DVec3; 2],
    columns: &[f64],
    rows: &[f64],
    jitter: f64,
) -> Vec<(Triangle, usize)> {
    let (m, n) = (columns.len(), rows.len());
    let mut points = Vec::new();
    for j in 0..n {
        for i in 0..m {
            let inner = i > 0 && j > 0 && i + 1 < m && j + 1 < n;
            let mut shift = |line: &[f64], k: usize| {
                if inner {
                    random.range(-jitter, jitter) * (line[k + 1] - line[k]).min(line[k] - line[k - 1])
                } else {
                    0.0
                }
            };
            let (x, y) = (columns[i] + shift(columns, i), rows[j] + shift(rows, j));
            points.push(origin + u * x + v * y);
        }
    }
    let mut triangles = Vec::new();
    for j in 0..n - 1 {
        for i in 0..m - 1 {
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| points[j * m + i]);
            let class = 4 * (j % 2) + 2 * (i % 2);
            triangles.push(([a, b, c], class));
            triangles.push(([a, c, d], class + 1));
        }
    }
    triangles
}

/// Samples of each pixel that a sheet covers, counted class by class: each triangle for itself.
pub fn covered(camera: &Camera, sheet: &[(Triangle, usize)], width: u32, samples: u32) -> Vec<u32> {
    let mut sums = Vec::new();
    for class in 0..8 {
        let part: Vec<_> = sheet.iter().filter(|t| t.1 == class).map(|t| (t.0, 0)).collect();
        let part = counts(camera, &part, width, samples);
        sums.resize(part.len(), 0);
        for (sum, count) in sums.iter_mut().zip(part) {
            *sum += count[0];
        }
    }
    sums
}

/// Evenly spaced numbers.
pub fn even(low: f64, high: f64, steps: usize) -> Vec<f64> {
    (0..=steps).map(|i| low + (high - low) * i as f64 / steps as f64).collect()
}
