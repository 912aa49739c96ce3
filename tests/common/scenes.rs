//! Scenes made in code: cameras of every kind before geometry that is hard to draw.

use glam::{DVec3, Vec2};
use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::optics::Optics;
use groundglass::quantity::{Angle, FNumber, Length};
use groundglass::scene::{
    Attributes, Budget, Level, Mapping, Material, NONE, PictureSettings, Scene, Sky, Sun, Surfaces, Texture,
};
use std::sync::Arc;

/// A small deterministic generator (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn point(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.range(-size, size), self.range(-size, size), self.range(-size, size))
    }
}

/// Degrees of tilt and swing of front and rear, f-number (0: pinhole), extension over focal length.
#[derive(Clone, Copy)]
pub struct Setting {
    pub front: [f64; 2],
    pub rear: [f64; 2],
    pub f_number: f64,
    pub stretch: f64,
    pub rise: f64,
}

/// Nothing turned or moved.
pub const ALIGNED: Setting =
    Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 5.6, stretch: 1.02, rise: 0.0 };

pub fn camera(eye: DVec3, look_at: DVec3, focal_mm: f64, setting: Setting) -> Camera {
    let standard = |[tilt, swing]: [f64; 2], rise: f64| Standard {
        tilt: Angle::degrees(tilt),
        swing: Angle::degrees(swing),
        rise: Length::millimetres(rise),
        shift: Length::millimetres(-0.3 * rise),
    };
    Camera {
        rail: Camera::rail_frame(eye, look_at, DVec3::Y).unwrap(),
        front: standard(setting.front, setting.rise),
        rear: standard(setting.rear, 0.0),
        extension: Length::millimetres(focal_mm * setting.stretch),
        focal_length: Length::millimetres(focal_mm),
        aperture: if setting.f_number == 0.0 {
            Aperture::Pinhole
        } else {
            Aperture::FNumber(FNumber::new(setting.f_number).unwrap())
        },
        film: FilmSize { width: Length::millimetres(120.0), height: Length::millimetres(96.0) },
        near: Length::millimetres(0.1 * focal_mm),
    }
}

/// A texture of random texels with its mip levels, square.
pub fn noise(random: &mut Random, size: u32, holes: bool) -> Texture {
    let texels = (0..size * size)
        .map(|_| {
            let mut c = [0u16; 4].map(|_| (random.next() * 65535.0) as u16);
            c[3] = if holes && random.next() < 0.4 { 0 } else { 65535 };
            c
        })
        .collect();
    Texture::from_level(Level { width: size, height: size, texels }).unwrap()
}

/// The linear light that 8-bit sRGB holds instead of this one (not of the darkest).
pub fn eight_bits(linear: f64) -> f64 {
    let code = (255.0 * (1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055)).round() / 255.0;
    libm::pow((code + 0.055) / 1.055, 2.4)
}

/// A palette as low-poly models have them: fields of one colour and of a straight slope from one to another, in 8-bit sRGB.
pub fn palette(random: &mut Random, size: u32) -> Texture {
    const FIELD: u32 = 32;
    let fields: Vec<[[f64; 3]; 3]> = (0..size.div_ceil(FIELD) * size.div_ceil(FIELD))
        .map(|i| {
            let mut color = |low: f64, high: f64| [0; 3].map(|_| random.range(low, high));
            let slope = if i % 2 == 0 { 0.0 } else { 0.4 };
            [color(0.3, 0.6), color(-slope, slope), color(-slope, slope)]
        })
        .collect();
    let texel = |x: u32, y: u32| {
        let [base, right, down] = fields[(y / FIELD * size.div_ceil(FIELD) + x / FIELD) as usize];
        let [u, v] = [x, y].map(|c| f64::from(c % FIELD) / f64::from(FIELD) - 0.5);
        let value = |c: usize| (eight_bits(base[c] + u * right[c] + v * down[c]) * 65535.0) as u16;
        [value(0), value(1), value(2), 65535]
    };
    let texels = (0..size * size).map(|i| texel(i % size, i / size)).collect();
    Texture::from_level(Level { width: size, height: size, texels }).unwrap()
}

pub fn plain(diffuse: [f32; 3]) -> Material {
    Material {
        name: String::new(),
        diffuse,
        emission: [0.0; 3],
        diffuse_map: None,
        opacity_map: None,
        opacity_mapping: Mapping::IDENTITY,
        coverage: 1.0,
    }
}

/// Adds a quadrilateral of two triangles with texture coordinates 0..`repeat`.
pub fn quad(surfaces: &mut Surfaces, corners: [DVec3; 4], repeat: f32, material: u32) {
    let (p, t) = (surfaces.positions.len() as u32, surfaces.texcoords.len() as u32);
    surfaces.positions.extend(corners);
    surfaces
        .texcoords
        .extend([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| Vec2::new(u, v) * repeat));
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        surfaces.triangles.push([p + a, p + b, p + c]);
        surfaces.attributes.push(Attributes {
            normals: [NONE; 3],
            texcoords: [t + a, t + b, t + c],
            material,
        });
    }
}

/// Loose triangles of every size about `center`, with vertex normals.
pub fn shards(
    surfaces: &mut Surfaces,
    random: &mut Random,
    count: usize,
    center: DVec3,
    spread: f64,
    size: f64,
) {
    for _ in 0..count {
        let at = center + random.point(spread);
        let first = surfaces.positions.len() as u32;
        let normals = surfaces.normals.len() as u32;
        // Normals of any length count alike.
        for length in [0.2, 2.0, 5.0] {
            surfaces.positions.push(at + random.point(size));
            surfaces
                .normals
                .push((random.point(1.0) + DVec3::new(0.0, 0.0, 1.5)).normalize().as_vec3() * length);
        }
        surfaces.triangles.push([first, first + 1, first + 2]);
        surfaces.attributes.push(Attributes {
            normals: [normals, normals + 1, normals + 2],
            texcoords: [NONE; 3],
            material: (random.next() * surfaces.materials.len() as f64) as u32,
        });
    }
}

/// A yard: textured ground that passes under and behind the camera, a wall, shards, a holed sheet.
pub fn yard(random: &mut Random, triangles: usize) -> Surfaces {
    let mut surfaces = Surfaces::default();
    let mut textured = plain([0.9, 0.8, 1.0]);
    textured.diffuse_map = Some(Arc::new(noise(random, 64, false)));
    let mut sheet = plain([1.0, 0.5, 0.3]);
    sheet.diffuse_map = Some(Arc::new(noise(random, 16, true)));
    let mut glow = plain([0.2, 0.2, 0.2]);
    glow.emission = [0.1, 0.3, 0.05];
    surfaces.materials = vec![plain([0.7, 0.6, 0.5]), textured, sheet, glow];
    let ground =
        [(-60.0, 40.0), (60.0, 40.0), (60.0, -80.0), (-60.0, -80.0)].map(|(x, z)| DVec3::new(x, 0.0, z));
    quad(&mut surfaces, ground, 24.0, 1);
    let wall = [(-3.0, 0.0), (4.0, 0.0), (4.0, 3.0), (-3.0, 3.0)].map(|(x, y)| DVec3::new(x, y, -6.0));
    quad(&mut surfaces, wall, 3.0, 1);
    // One normal at all corners, and not the face's: a flat triangle that is lit as its normals say.
    let n = surfaces.normals.len() as u32;
    surfaces.normals.push(DVec3::new(0.3, 0.8, -0.5).normalize().as_vec3() * 3.0);
    for attributes in surfaces.attributes.iter_mut().rev().take(2) {
        attributes.normals = [n; 3];
    }
    let holed =
        [(-1.5, 0.2), (1.0, 0.2), (1.0, 2.2), (-1.5, 2.2)].map(|(x, y)| DVec3::new(x, y, -1.0 + 0.3 * x));
    quad(&mut surfaces, holed, 1.5, 2);
    shards(&mut surfaces, random, triangles, DVec3::new(0.0, 1.0, -3.0), 3.0, 0.5);
    surfaces
}

pub fn scene(camera: &Camera, surfaces: Surfaces, width: u32, samples: u32) -> Scene {
    Scene {
        optics: Optics::new(camera).unwrap(),
        blades: None,
        up: DVec3::Y,
        surfaces,
        sun: Some(Sun {
            toward: DVec3::new(0.5, 0.8, 0.6),
            color: DVec3::new(0.72, 0.68, 0.6),
            shadows: false,
            angular_diameter: Angle::ZERO,
        }),
        sky: Sky::default(),
        render: PictureSettings {
            budget: Budget::Samples(samples),
            share_shading: false,
            ..PictureSettings::new(width, (f64::from(width) * 0.8).round() as u32)
        },
        circle_of_confusion: Length::millimetres(0.1),
        meshes: Vec::new(),
        warnings: Vec::new(),
        assets_digest: [0; 32],
    }
}
