//! Hashes of what the library makes: answers, figures, pictures. In: how to render; out: lines of name and hash. Every
//! build on every platform gives the same lines (`tests/same_bytes.rs`, `examples/same_bytes.rs`, `tests/builds`).

use groundglass::diagram::{Changes, FigureFile, KINDS};
use groundglass::glam::{DVec3, Vec3};
use groundglass::picture::{Allocation, Exposure};
use groundglass::render::SimdLevel;
use groundglass::scene::{Document, Memory, parse};
use groundglass::{
    Adjust, Angle, Aperture, Camera, Execution, FNumber, FocusTarget, Length, Optics, Result, Standard,
    render, solve,
};
use std::path::Path;

/// FNV-1a with 64 bits.
#[derive(Clone, Copy)]
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self
    }

    fn numbers(self, numbers: impl IntoIterator<Item = f64>) -> Self {
        numbers.into_iter().fold(self, |hash, number| hash.bytes(&number.to_bits().to_le_bytes()))
    }
}

fn line(text: &mut String, name: &str, hash: Hash) {
    text.push_str(&format!("{name} {:016x}\n", hash.0));
}

/// All lines; pictures are drawn on `threads` threads at a SIMD level.
///
/// # Errors
/// None but a bug's.
pub fn all(threads: Option<usize>, simd: Option<SimdLevel>) -> Result<String> {
    let mut text = String::new();
    line(&mut text, "optics", optics()?);
    for kind in KINDS.iter() {
        line(&mut text, &format!("figure {}", kind.name), figure(kind.starter)?);
    }
    text.push_str(&pictures(threads, simd)?);
    Ok(text)
}

/// A small deterministic generator (SplitMix64).
struct Random(u64);

impl Random {
    fn range(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * (((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn point(&mut self, size: f64) -> DVec3 {
        DVec3::new(self.range(-size, size), self.range(-size, size), self.range(-size, size))
    }

    fn standard(&mut self) -> Standard {
        let mut within = |most: f64| self.range(-most, most);
        Standard {
            tilt: Angle::degrees(within(20.0)),
            swing: Angle::degrees(within(20.0)),
            rise: Length::millimetres(within(30.0)),
            shift: Length::millimetres(within(30.0)),
        }
    }
}

/// Cameras with all movements, and what the solvers make of them.
fn optics() -> Result<Hash> {
    let (mut random, mut hash) = (Random(1), Hash::new());
    for _ in 0..400 {
        let mut camera = Camera::looking_at(random.point(10.0), random.point(3.0))?;
        camera.front = random.standard();
        camera.rear = random.standard();
        camera.extension = Length::millimetres(random.range(151.0, 300.0));
        camera.aperture = Aperture::FNumber(FNumber::new(random.range(1.0, 64.0))?);
        let mut cameras = vec![camera];
        let plane = FocusTarget::Plane { point: random.point(4.0), normal: random.point(1.0) };
        for adjust in [Adjust::Front, Adjust::Rear] {
            cameras.extend(solve(&camera, &plane, adjust));
        }
        for camera in &cameras {
            let optics = Optics::new(camera)?;
            let world = optics.world_from_lens();
            let plane = world.plane(optics.focus_plane());
            let lines = [optics.scheimpflug_line(), optics.hinge_line()].map(|line| world.line(line));
            hash = hash.numbers(plane.m.to_array()).numbers([plane.e]);
            for line in lines {
                hash = hash.numbers(line.direction.to_array()).numbers(line.moment.to_array());
            }
            hash = hash.numbers(optics.projection_from_world(0.3, -0.4).matrix().to_cols_array());
            hash = hash.numbers(optics.blur_of(random.point(5.0)).map(|blur| blur.largest));
        }
    }
    Ok(hash)
}

/// What the kinds of figures name: scenes, pictures of them, and a table.
fn files() -> Result<Memory> {
    let picture = |height: u32| {
        let rows: Vec<[f32; 3]> =
            (0..70 * height).map(|i| [i as f32 / 4000.0, (i % 70) as f32 / 70.0, 0.2]).collect();
        let mut png = Vec::new();
        Exposure::from_rows(70, height, &rows, Allocation::Uniform(1))?.write_png(0.0, &[], &mut png)?;
        Ok::<_, groundglass::Error>(png)
    };
    let film_leans = SCENE.replace("[[mesh]]", "adjust = \"rear\"\n[[mesh]]");
    let level = SCENE.replace("plane = { point_m = [0, 0, 0], normal = [0, 1, 0] }", "distance_m = 1.1");
    Ok(Memory::new()
        .with("figure-1/a.toml", level.into_bytes())
        .with("figure-1/b.toml", SCENE.as_bytes())
        .with("figure-1/c.toml", film_leans.into_bytes())
        .with("figure-1/m.obj", model().into_bytes())
        .with("tower.toml", SCENE.as_bytes())
        .with("m.obj", model().into_bytes())
        .with("pictures/tower.png", picture(56)?)
        .with("pictures/upright-before.png", picture(60)?)
        .with("pictures/upright-after.png", picture(60)?)
        .with("heat-map.csv", include_bytes!("../../diagrams/heat-map.csv").as_slice()))
}

/// A figure by all three painters.
fn figure(source: &str) -> Result<Hash> {
    let document = Document::from_bytes(source.replace("../examples/", "").as_bytes(), "f.toml")?;
    let files = files()?;
    let figure = FigureFile::from_document(document)?.draw(&files, Path::new(""), Changes::default())?;
    Ok(Hash::new().bytes(figure.to_svg()?.as_bytes()).bytes(&figure.to_pdf()?).bytes(&figure.to_png(2.0)?))
}

const SCENE: &str = "[camera]
eye_m = [0.35, 0.5, 0.9]
look_at_m = [0.0, 0.02, 0.0]
focal_length_mm = 150
f_number = 2.8
film = \"4x5\"
[focus]
plane = { point_m = [0, 0, 0], normal = [0, 1, 0] }
[[mesh]]
path = \"m.obj\"
[sun]
toward = [-0.5, 1.0, 0.6]
color = [0.7, 0.7, 0.65]
[render]
width = 70
";

/// Ground that passes under the camera, walls with texture, normals, holes and coverage, and loose triangles.
fn model() -> String {
    let mut random = Random(2);
    let mut obj = String::from("mtllib m.mtl\nvt 0 0\nvt 4 0\nvt 4 4\nvt 0 4\n");
    let mut quad = |material: &str, corners: [[f64; 3]; 4]| {
        for [x, y, z] in corners {
            obj.push_str(&format!("v {x} {y} {z}\n"));
        }
        obj.push_str(&format!("usemtl {material}\nf -4/1 -3/2 -2/3 -1/4\n"));
    };
    quad("brick", [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]]);
    quad("brick", [[-0.4, 0.0, -0.3], [0.4, 0.0, -0.3], [0.4, 0.4, -0.3], [-0.4, 0.4, -0.3]]);
    quad("half", [[-0.1, 0.0, 0.1], [0.2, 0.0, 0.1], [0.2, 0.2, 0.1], [-0.1, 0.2, 0.1]]);
    quad("holes", [[-0.3, 0.0, -0.1], [0.0, 0.0, 0.0], [0.0, 0.2, 0.0], [-0.3, 0.2, -0.1]]);
    for _ in 0..60 {
        let at = random.point(0.3);
        for _ in 0..3 {
            let (p, n) =
                (at + random.point(0.06), Vec3::from_array(random.point(1.0).to_array().map(|v| v as f32)));
            obj.push_str(&format!("v {} {} {}\nvn {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z));
        }
        obj.push_str("usemtl red\nf -3//-3 -2//-2 -1//-1\n");
    }
    obj
}

fn pictures(threads: Option<usize>, simd: Option<SimdLevel>) -> Result<String> {
    let mut text = String::new();
    let mtl = "newmtl brick\nmap_Kd brick.png\nnewmtl half\nKd 0.9 0.8 0.2\nd 0.4\nnewmtl red\nKd 0.8 0.2 0.1\nKe 0 0.1 0\n\
               newmtl holes\nmap_Kd brick.png\nmap_d brick.png\n";
    let files = Memory::new()
        .with("m.obj", model().into_bytes())
        .with("m.mtl", mtl.as_bytes())
        .with("brick.png", &include_bytes!("../../examples/tower/textures/brick.png")[..]);
    // Each way of sampling: several pixels a batch, one, several batches; with and without falloff.
    for (samples, falloff) in [(1, false), (4, true), (16, false), (50, false), (256, true)] {
        let text_of = format!("{SCENE}samples = {samples}\nfalloff = {falloff}\n");
        let scene = parse(&text_of, "s.toml")?.describe()?.load(&files, Path::new(""), None)?;
        let (exposure, _) = render(&scene, Execution { threads, simd, ..Execution::default() })?;
        let pixels = (0..exposure.height()).flat_map(|y| (0..exposure.width()).map(move |x| (x, y)));
        let values = pixels.flat_map(|(x, y)| exposure.pixel(x, y)).map(f64::from);
        let hash = Hash::new().numbers(values).numbers(exposure.rms_error());
        let (mut png, mut exr) = (Vec::new(), std::io::Cursor::new(Vec::new()));
        exposure.write_png(0.5, &[("Software", "groundglass".to_owned())], &mut png)?;
        exposure.write_exr(&[("Software", "groundglass".to_owned())], &mut exr)?;
        line(&mut text, &format!("picture {samples}"), hash.bytes(&png).bytes(&exr.into_inner()));
    }
    Ok(text)
}
