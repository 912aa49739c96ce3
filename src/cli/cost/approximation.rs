//! The picture that a pinhole and a blur make: what a program does that has one picture and its depths. It is here so that its
//! price, the error that no time takes away, can be seen beside the truth.
//!
//! Each pixel of a pinhole picture is spread over a disk of the size that the blur of its depth has; the disks are added and
//! divided by the sum of their weights (M. Potmesil and I. Chakravarty, "A lens and aperture camera model for synthetic image
//! generation", Computer Graphics 15(3), 1981, 297-305).

use super::rows;
use super::ways::leave_out;
use glam::{DVec3, DVec4, Vec3};
use groundglass::error::Result;
use groundglass::picture::{Allocation, Exposure};
use groundglass::render::{Execution, render};
use groundglass::scene::{EffectName, Scene};

pub(super) fn draw(scene: &mut Scene, execution: Execution<'_>) -> Result<Exposure> {
    leave_out(scene, EffectName::Defocus);
    let (picture, _) = render(scene, execution)?;
    let radii = radii(scene, &execution)?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    // How far the pixels of a row are spread at most.
    let most: Vec<f32> = radii.chunks(width).map(|row| row.iter().copied().fold(0.0, f32::max)).collect();
    let row = |j: u32| {
        let j = j as usize;
        // What a disk adds to its row begins at one pixel and ends at another: sums along the row then give the light of each.
        let mut changes = vec![DVec4::ZERO; width + 1];
        for y in 0..height {
            let dy = j as f32 - y as f32;
            if dy.abs() > most[y] {
                continue;
            }
            for x in 0..width {
                let radius = radii[y * width + x];
                if dy * dy > radius * radius {
                    continue;
                }
                let color = Vec3::from(picture.pixel(x as u32, y as u32)).as_dvec3();
                let weight = 1.0 / f64::from(std::f32::consts::PI * radius * radius);
                let light = (color * weight).extend(weight);
                let reach = (radius * radius - dy * dy).sqrt() as usize;
                changes[x.saturating_sub(reach)] += light;
                changes[(x + reach + 1).min(width)] -= light;
            }
        }
        let sums = changes[..width].iter().scan(DVec4::ZERO, |sum, &change| {
            *sum += change;
            Some((sum.truncate() / sum.w).as_vec3().to_array())
        });
        sums.collect()
    };
    let pixels = rows::on_threads(&execution, || rows::pixels(picture.height(), &execution, row))?;
    Ok(Exposure::from_rows(picture.width(), picture.height(), &pixels, Allocation::clone(picture.samples())))
}

/// How far the disks of pixels reach, at least: each holds its own pixel.
const LEAST: f32 = 0.5;

/// Half the largest diameter of the blur of what each pixel's middle sees, in pixels: [`LEAST`] where it is the sky, and no more
/// than half of the picture.
fn radii(scene: &Scene, execution: &Execution<'_>) -> Result<Vec<f32>> {
    let (width, height) = (scene.render.width as usize, scene.render.height as usize);
    let optics = &scene.optics;
    let pixel = optics.camera().film.width.as_metres() / width as f64;
    let projection = optics.projection_from_world(0.0, 0.0);
    let mut nearest = vec![0.0f64; width * height];
    let mut radii = vec![LEAST; width * height];
    for corners in &scene.surfaces.triangles {
        rows::go_on(execution)?;
        let world = corners.map(|i| scene.surfaces.positions[i as usize]);
        let clip = world.map(|p| projection.project(p));
        // What comes nearer than the lens is left out: an approximation has its price.
        if clip.iter().any(|c| c.w <= 0.0) {
            continue;
        }
        let place = |c: DVec4| {
            DVec3::new(
                0.5 * (c.x / c.w + 1.0) * width as f64,
                0.5 * (1.0 - c.y / c.w) * height as f64,
                1.0 / c.w,
            )
        };
        let [a, b, c] = clip.map(place);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        let range = |low: f64, high: f64, most: usize| {
            (low - 0.5).ceil().max(0.0) as usize
                ..((high - 0.5).floor() + 1.0).clamp(0.0, most as f64) as usize
        };
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        for j in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), height) {
            for i in range(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), width) {
                let p = glam::DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
                let side = |a: DVec3, b: DVec3| (b - a).truncate().perp_dot(p - a.truncate()) / area;
                let (u, v, w) = (side(b, c), side(c, a), side(a, b));
                let depth = u * a.z + v * b.z + w * c.z;
                let at = j * width + i;
                if u < 0.0 || v < 0.0 || w < 0.0 || depth <= nearest[at] {
                    continue;
                }
                nearest[at] = depth;
                let point = (world[0] * (u * a.z) + world[1] * (v * b.z) + world[2] * (w * c.z)) / depth;
                let blur = optics.blur_of(optics.world_from_lens().point_inverse(point));
                let radius = blur.map_or(0.0, |blur| (0.5 * blur.largest / pixel) as f32);
                radii[at] = radius.clamp(LEAST, (0.5 * width as f32).max(LEAST));
            }
        }
    }
    Ok(radii)
}
