//! The picture that a pinhole and a blur make: what a program does that has one picture and its depths. It is here so that its
//! price, the error that no time takes away, can be seen beside the truth.
//!
//! Each pixel of a pinhole picture is spread over a disk of the size that the blur of its depth has; the disks are added and
//! divided by the sum of their weights (M. Potmesil and I. Chakravarty, "A lens and aperture camera model for synthetic image
//! generation", Computer Graphics 15(3), 1981, 297-305).

use super::super::machine;
use super::rows;
use super::ways::leave_out;
use glam::{DMat3, DVec3, DVec4, Vec3};
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

/// How far away the sky is taken to be, in focal lengths: its blur is that of infinity to a part in a thousand million.
const SKY: f64 = 1e9;

/// Of a triangle that reaches behind the lens, what is in front by this part of its farthest corner's distance.
const NEAREST: f64 = 1e-6;

/// Half the largest diameter of the blur of what each pixel's middle sees, in pixels; no more than half of the picture.
fn radii(scene: &Scene, execution: &Execution<'_>) -> Result<Vec<f32>> {
    let (width, height) = (scene.render.width as usize, scene.render.height as usize);
    let optics = &scene.optics;
    let pixel = optics.camera().film.width.as_metres() / width as f64;
    let projection = optics.projection_from_world(0.0, 0.0);
    let radius_of = |point: DVec3| {
        let radius = optics.blur_of(point).map_or(0.0, |blur| (0.5 * blur.largest / pixel) as f32);
        radius.clamp(LEAST, (0.5 * width as f32).max(LEAST))
    };
    let mut nearest = vec![0.0f64; width * height];
    let mut radii = vec![LEAST; width * height];
    for corners in &scene.surfaces.triangles {
        rows::go_on(execution)?;
        let world = corners.map(|i| scene.surfaces.positions[i as usize]);
        let clip = world.map(|p| projection.project(p));
        for (world, clip) in in_front(world, clip) {
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
                    radii[at] = radius_of(optics.world_from_lens().point_inverse(point));
                }
            }
        }
    }
    // What no triangle was met in is the sky.
    let [x, y, _, w] = optics.projection(0.0, 0.0).matrix().transpose().to_cols_array_2d();
    let lens_from_pixel =
        DMat3::from_cols_array_2d(&[x, y, w].map(|[a, b, c, _]| [a, b, c])).transpose().inverse();
    for (at, radius) in radii.iter_mut().enumerate().filter(|&(at, _)| nearest[at] == 0.0) {
        let (i, j) = ((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
        let toward = DVec3::new(2.0 * i / width as f64 - 1.0, 1.0 - 2.0 * j / height as f64, 1.0);
        let toward = (lens_from_pixel * toward).normalize_or_zero();
        *radius = radius_of(toward * (SKY * optics.focal_length()));
    }
    Ok(radii)
}

/// The triangles of what of one is in front of the lens, as points and as what they are in the picture.
fn in_front(world: [DVec3; 3], clip: [DVec4; 3]) -> impl Iterator<Item = ([DVec3; 3], [DVec4; 3])> {
    let least = NEAREST * clip.iter().map(|c| c.w).fold(0.0, f64::max);
    // A triangle that one plane cuts has four corners at most.
    let (mut shown, mut count) = ([(DVec3::ZERO, DVec4::ZERO); 4], 0);
    let mut show = |corner| {
        shown[count] = corner;
        count += 1;
    };
    for (i, k) in [(0, 1), (1, 2), (2, 0)] {
        let (a, b) = (clip[i].w - least, clip[k].w - least);
        if a > 0.0 {
            show((world[i], clip[i]));
        }
        if (a > 0.0) != (b > 0.0) {
            let t = a / (a - b);
            show((world[i].lerp(world[k], t), clip[i].lerp(clip[k], t)));
        }
    }
    (2..count).map(move |i| {
        let [a, b, c] = [0, i - 1, i].map(|i| shown[i]);
        ([a.0, b.0, c.0], [a.1, b.1, c.1])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use groundglass::scene::{Memory, parse};
    use std::path::Path;

    /// The radii of pixels of a 60 mm picture, 60 wide and 40 high, of a plane 1 m below a lens of 50 mm at f/2 that is focused at 1 m;
    /// the plane ends `behind` the lens, in metres, or before it.
    fn radii_over_a_floor(behind: f64) -> Vec<f32> {
        let scene = "[camera]\neye_m = [0, 0, 0]\nlook_at_m = [0, 0, -1]\nfocal_length_mm = 50\nf_number = 2\nfilm_mm = [60, 40]\n\
                     [focus]\ndistance_m = 1\n[render]\nwidth = 60\n[[mesh]]\npath = \"floor.obj\"\n";
        let corners = [(-90.0, behind), (90.0, behind), (90.0, -90.0), (-90.0, -90.0)];
        let floor: String = corners.iter().map(|(x, z)| format!("v {x} -1 {z}\n")).collect();
        let files = Memory::new().with("floor.obj", (floor + "f 1 2 3 4\n").into_bytes());
        let scene = parse(scene, "a.toml").and_then(|file| file.describe());
        let scene = scene.and_then(|scene| scene.load(&files, Path::new(""), None)).unwrap();
        radii(&scene, &Execution::default()).unwrap()
    }

    #[test]
    fn the_sky_and_what_goes_on_behind_the_lens_are_blurred_as_all_else() {
        let radii = radii_over_a_floor(50.0);
        // Of what is at `d` the blur is A f |1 - D / d| / (D - f), for the aperture A and the distance D in focus; a pixel is 1 mm.
        let blur = |depth: f64| 25.0 * 0.05 / 0.95 * (1.0 - 1.0 / depth).abs() * 0.5;
        for j in 0..40 {
            let below = (f64::from(j) - 19.5) * 0.95 / 50.0;
            let depth = if below > 0.0 && 1.0 / below < 90.0 { 1.0 / below } else { f64::INFINITY };
            for i in 0..60 {
                let (found, want) = (f64::from(radii[j as usize * 60 + i]), blur(depth).max(LEAST.into()));
                assert!((found - want).abs() < 1e-5 * want, "{i} {j}: {found} {want}");
            }
        }
        assert_eq!(radii, radii_over_a_floor(-0.5));
    }

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
