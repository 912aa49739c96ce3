//! The picture that a pinhole and a blur make: what a program does that has one picture and its depths. It is here so that its
//! price, the error that no time takes away, can be seen beside the truth.
//!
//! Each pixel of a pinhole picture is spread over a disk of the size that the blur of its depth has; the disks are added and
//! divided by the sum of their weights (M. Potmesil and I. Chakravarty, "A lens and aperture camera model for synthetic image
//! generation", Computer Graphics 15(3), 1981, 297-305).

use super::super::machine;
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
    // How far the pixels of a row are spread at most.
    let widest = |row: &[f32]| row.iter().copied().fold(0.0, f32::max);
    let most: Vec<f32> = radii.chunks(picture.width() as usize).map(widest).collect();
    let row = |j: u32| blurred(&picture, (&radii, &most), j);
    let pixels = machine::on_threads(execution.threads, || rows::pixels(picture.height(), &execution, row))??;
    Exposure::from_rows(picture.width(), picture.height(), &pixels, Allocation::clone(picture.samples()))
}

/// Row `j` of the picture with its pixels spread over disks of these `radii`, `most` in each row.
fn blurred(picture: &Exposure, (radii, most): (&[f32], &[f32]), j: u32) -> Vec<[f32; 3]> {
    let width = picture.width() as usize;
    // What a disk adds to its row begins at one pixel and ends at another: sums along the row then give the light of each. (Added pixel by
    // pixel it took time as the fourth power of the width, 5 seconds for 240 pixels.)
    let mut changes = vec![DVec4::ZERO; width + 1];
    for (y, (radii, &most)) in radii.chunks(width).zip(most).enumerate() {
        let dy = j as f32 - y as f32;
        if dy.abs() > most {
            continue;
        }
        for (x, &radius) in radii.iter().enumerate().filter(|(_, radius)| dy.abs() <= **radius) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_is_spread_evenly_over_its_disk() {
        let (width, height) = (19_u32, 13_u32);
        let value = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
        let pixels: Vec<[f32; 3]> =
            (0..width * height).map(|i| [value(i), value(i + 999), 40.0 * value(i)]).collect();
        let picture = Exposure::from_rows(width, height, &pixels, Allocation::Uniform(1)).unwrap();
        let radii: Vec<f32> = (0..width * height).map(|i| LEAST + 7.0 * value(i + 5000)).collect();
        let most: Vec<f32> =
            radii.chunks(width as usize).map(|row| row.iter().copied().fold(0.0, f32::max)).collect();
        for j in 0..height {
            for (i, found) in (0..width).zip(blurred(&picture, (&radii, &most), j)) {
                let mut sum = DVec4::ZERO;
                for (at, (color, &radius)) in pixels.iter().zip(&radii).enumerate() {
                    let [dx, dy] =
                        [(at as u32 % width).abs_diff(i), (at as u32 / width).abs_diff(j)].map(f64::from);
                    let radius = f64::from(radius);
                    if dx * dx + dy * dy <= radius * radius {
                        let weight = 1.0 / (std::f64::consts::PI * radius * radius);
                        sum += (Vec3::from(*color).as_dvec3() * weight).extend(weight);
                    }
                }
                let off = Vec3::from(found).as_dvec3() - sum.truncate() / sum.w;
                assert!(off.abs().max_element() < 1e-5, "{i} {j}: {off}");
            }
        }
    }
}
