//! Inputs that are extreme in one way each, made in code: what a rasterizer may choke on.

use super::scenes::{Random, Setting, camera, plain, scene};
use glam::DVec3;
use groundglass::camera::Camera;
use groundglass::quantity::Length;
use groundglass::scene::{Attributes, NONE, Scene, Surfaces};

/// Focused at about 4.5 m.
pub const ORDINARY: Setting =
    Setting { front: [0.0, 0.0], rear: [0.0, 0.0], f_number: 2.8, stretch: 1.034, rise: 0.0 };

/// A way to be extreme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extreme {
    /// Not at all: small triangles before the camera, most of them within the depth of field.
    Ordinary,
    /// One triangle over the whole film.
    One,
    /// Every triangle over the whole film, one behind the other, each tilted a little.
    Layers,
    /// All under one pixel.
    Dust,
    /// A tenth of the picture long, and a thousandth of that wide.
    Slivers,
    /// f/0.5, and nothing in focus.
    Blurred,
    /// All around the camera, through lens and near plane.
    Inside,
    /// Cells of a floor that passes through the near plane and behind the camera.
    Floor,
    /// The lens shifted by the film's width.
    Shifted,
    /// Nine tenths of the triangles beside the picture.
    Beside,
}

impl Extreme {
    pub const ALL: [Self; 10] = [
        Self::Ordinary,
        Self::One,
        Self::Layers,
        Self::Dust,
        Self::Slivers,
        Self::Blurred,
        Self::Inside,
        Self::Floor,
        Self::Shifted,
        Self::Beside,
    ];

    /// About as many triangles, in a picture of `width` pixels.
    pub fn scene(self, triangles: usize, width: u32, samples: u32) -> Scene {
        let eye = DVec3::new(0.0, 1.0, 4.0);
        let mut look = camera(eye, DVec3::new(0.0, 1.0, 0.0), 150.0, ORDINARY);
        let mut field = Field::new();
        match self {
            Self::Ordinary => field.scatter(triangles, DVec3::new(0.0, 1.0, -0.5), DVec3::new(1.8, 1.4, 1.0)),
            Self::One => field.layer(-1.0, 0.0),
            Self::Layers => {
                for i in 0..triangles {
                    let tilt = field.random.range(-0.02, 0.02);
                    field.layer(-1.0 - 8.0 * i as f64 / triangles as f64, tilt);
                }
            }
            Self::Dust => {
                field.layer(-3.0, 0.0);
                field.scatter(triangles, DVec3::new(0.1, 1.1, -0.5), DVec3::splat(1e-4));
            }
            Self::Slivers => {
                for _ in 0..triangles {
                    let at = DVec3::new(0.0, 1.0, -0.5) + field.random.point(1.0) * DVec3::new(1.8, 1.4, 1.0);
                    let along = field.random.point(1.0).normalize() * 0.2;
                    let across = field.random.point(2e-4);
                    field.triangle([at - along, at + along, at + across]);
                }
            }
            Self::Blurred => {
                look = camera(
                    eye,
                    DVec3::new(0.0, 1.0, 0.0),
                    150.0,
                    Setting { f_number: 0.5, stretch: 1.2, ..ORDINARY },
                );
                field.scatter(triangles, DVec3::new(0.0, 1.0, -0.5), DVec3::new(1.8, 1.4, 1.0));
            }
            Self::Inside => field.scatter(triangles, eye, DVec3::splat(0.6)),
            Self::Floor => {
                let cells = ((triangles / 2) as f64).sqrt() as i32;
                let corner = |x: i32, z: i32| {
                    let (x, z) = (f64::from(x) / f64::from(cells), f64::from(z) / f64::from(cells));
                    DVec3::new(8.0 * x - 4.0, 0.96, 6.0 - 12.0 * z)
                };
                for (x, z) in (0..cells).flat_map(|z| (0..cells).map(move |x| (x, z))) {
                    let [a, b, c, d] =
                        [corner(x, z), corner(x + 1, z), corner(x + 1, z + 1), corner(x, z + 1)];
                    field.triangle([a, b, c]);
                    field.triangle([a, c, d]);
                }
            }
            Self::Shifted => {
                look.front.shift = Length::millimetres(120.0);
                // What is seen lies beside: film and lens see through the shifted centre.
                field.scatter(triangles, DVec3::new(3.8, 1.0, -0.5), DVec3::new(1.8, 1.4, 1.0));
            }
            Self::Beside => {
                field.scatter(triangles / 10, DVec3::new(0.0, 1.0, -0.5), DVec3::new(1.8, 1.4, 1.0));
                field.scatter(
                    triangles - triangles / 10,
                    DVec3::new(40.0, 1.0, -0.5),
                    DVec3::new(20.0, 20.0, 9.0),
                );
            }
        }
        field.take(&look, width, samples)
    }
}

/// Small triangles, each blurred over four tenths of the picture's width; the lens tilted and swung by `front`, degrees.
pub fn loose(triangles: usize, width: u32, samples: u32, front: [f64; 2]) -> Scene {
    let (eye, at) = (DVec3::new(0.0, 1.0, 4.0), DVec3::new(0.0, 1.0, 0.0));
    let mut field = Field::new();
    for _ in 0..triangles {
        let middle = at + field.random.point(0.4);
        let corners = [0; 3].map(|_| middle + field.random.point(0.03));
        field.triangle(corners);
    }
    let camera = camera(eye, at, 150.0, Setting { f_number: 0.5, stretch: 1.2, front, ..ORDINARY });
    field.take(&camera, width, samples)
}

/// Triangles a fifth of a pixel in size all over the picture, in focus or blurred over a few pixels.
pub fn crowd(triangles: usize, width: u32, samples: u32, setting: Setting) -> Scene {
    let (eye, at) = (DVec3::new(0.0, 1.0, 4.0), DVec3::new(0.0, 1.0, 0.0));
    let side = 3.6 / f64::from(width) * 0.15;
    let mut field = Field::new();
    for _ in 0..triangles {
        let middle = at + field.random.point(1.0) * DVec3::new(1.8, 1.4, 0.5);
        let corners = [0; 3].map(|_| middle + field.random.point(side));
        field.triangle(corners);
    }
    let mut scene = field.take(&camera(eye, at, 150.0, setting), width, samples);
    // In so small a picture hardly anything is out of focus.
    scene.render.effects.all = true;
    scene
}

struct Field {
    random: Random,
    surfaces: Surfaces,
}

impl Field {
    fn new() -> Self {
        let materials = vec![plain([0.7, 0.6, 0.5]), plain([0.3, 0.5, 0.7]), plain([0.6, 0.2, 0.3])];
        Self { random: Random(4), surfaces: Surfaces { materials, ..Surfaces::default() } }
    }

    fn triangle(&mut self, corners: [DVec3; 3]) {
        let surfaces = &mut self.surfaces;
        let first = surfaces.positions.len() as u32;
        let material = surfaces.triangles.len() as u32 % 3;
        surfaces.positions.extend(corners);
        surfaces.triangles.push([first, first + 1, first + 2]);
        surfaces.attributes.push(Attributes { normals: [NONE; 3], texcoords: [NONE; 3], material });
    }

    /// Triangles, each a few hundredths of `size`, that fill a box of twice `size`.
    fn scatter(&mut self, triangles: usize, center: DVec3, size: DVec3) {
        let side = size.max_element() * (20.0 / triangles as f64).sqrt();
        for _ in 0..triangles {
            let at = center + self.random.point(1.0) * size;
            let corners = [0; 3].map(|_| at + self.random.point(side));
            self.triangle(corners);
        }
    }

    /// A triangle over all that the camera sees, at `z`.
    fn layer(&mut self, z: f64, tilt: f64) {
        let depth = |x: f64, y: f64| z + tilt * (x + y);
        self.triangle(
            [(-30.0, -20.0), (30.0, -20.0), (0.0, 50.0)].map(|(x, y)| DVec3::new(x, y, depth(x, y))),
        );
    }

    fn take(self, camera: &Camera, width: u32, samples: u32) -> Scene {
        scene(camera, self.surfaces, width, samples)
    }
}
