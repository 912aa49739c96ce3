//! What is fuzzed: any bytes in, nothing out; a panic is a finding. One function a target. The fuzzers in
//! `fuzz_targets/` call them, and so does `tests/fuzz_seeds.rs` with every seed and every past finding, as an
//! ordinary test without a fuzzer.

use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::diagram::{Changes, FigureFile};
use groundglass::geometry::HomogeneousPoint;
use groundglass::glam::DVec3;
use groundglass::render::SimdLevel;
use groundglass::scene::{
    AssetLoader, Document, Memory, Model, NONE, SceneFile, Source, parse, with_movements,
};
use groundglass::{
    Adjust, Angle, Execution, FNumber, FocusTarget, Length, Optics, Result, Scene, render, solve, upright,
};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// A target's name and function.
pub type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 7] = [
    ("scene_toml", scene_toml),
    ("figure_toml", figure_toml),
    ("obj", obj),
    ("mtl", mtl),
    ("texture", texture),
    ("optics", optics),
    ("render_tiny", render_tiny),
];

/// Files in memory, from which no more than so much may come.
struct Small(Memory);

impl Source for Small {
    fn argument(&self, path: &Path) -> Result<PathBuf> {
        self.0.argument(path)
    }

    fn named(&self, folder: &Path, written: &str) -> Result<PathBuf> {
        self.0.named(folder, written)
    }

    fn asset(&self, folder: &Path, written: &str, fences: &[PathBuf]) -> Result<PathBuf> {
        self.0.asset(folder, written, fences)
    }

    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>> {
        self.0.read(file, limit)
    }

    fn room(&self) -> Option<u64> {
        Some(64 << 20)
    }
}

const TRIANGLE: &str = "v -1 0 0\nv 1 0 0\nv 0 3 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

/// A scene file: read, judged, solved, written with its movements, and read again.
pub fn scene_toml(data: &[u8]) {
    let Ok(document) = Document::from_bytes(data, "s.toml") else { return };
    let Ok(scene) = SceneFile::from_document(document).and_then(|file| file.describe()) else { return };
    let _ = scene.picture_size(None);
    let Ok(optics) = scene.optics() else { return };
    ask(&optics);
    if let Ok(text) = with_movements(scene.document.text(), optics.camera(), |path| format!("x/{path}")) {
        let again = parse(&text, "t.toml").and_then(|file| file.describe());
        again.and_then(|scene| scene.optics()).expect("a solved scene is a scene");
    }
}

/// A figure file: read and drawn by every painter.
pub fn figure_toml(data: &[u8]) {
    let Ok(document) = Document::from_bytes(data, "f.toml") else { return };
    let Ok(file) = FigureFile::from_document(document) else { return };
    let files = Memory::new()
        .with("t.obj", format!("{TRIANGLE}f 1 2 3\n").into_bytes())
        .with("n.csv", &b"a,b\n1,2\n2,3\n"[..])
        .with("n.json", &b"[{\"a\": 1, \"b\": 2}]"[..])
        .with("s.toml", SCENE.as_bytes());
    let Ok(figure) = file.draw(&Small(files), Path::new(""), Changes::default()) else { return };
    let _ = (figure.to_svg(), figure.to_pdf(), figure.to_png(0.5));
}

fn load(files: Memory) -> Option<std::sync::Arc<Model>> {
    let files = Small(files);
    let mut loader = AssetLoader::new(&files, Path::new(""));
    let model = loader.load_obj("a.obj").ok()?;
    let within =
        |list: [u32; 3], count: usize| list == [NONE; 3] || list.iter().all(|&i| (i as usize) < count);
    for triangle in &model.triangles {
        assert!(triangle.positions.iter().all(|&i| (i as usize) < model.positions.len()));
        assert!(within(triangle.normals, model.normals.len()));
        assert!(within(triangle.texcoords, model.texcoords.len()));
        assert!((triangle.material as usize) < model.materials.len());
    }
    assert!(!model.triangles.is_empty() && model.normals.iter().all(|n| n.is_finite() && n.length() > 0.0));
    assert!(model.positions.iter().all(|p| p.is_finite()) && model.texcoords.iter().all(|t| t.is_finite()));
    Some(model)
}

/// A model.
pub fn obj(data: &[u8]) {
    let mtl = "newmtl a\nKd 1 0 0\nmap_Kd -s 2 2 t.png\nnewmtl b\nd 0.5\nTr 0.5\n";
    load(Memory::new().with("a.obj", data.to_vec()).with("a.mtl", mtl.as_bytes()));
}

/// A material library, of a model that uses four materials of the usual names.
pub fn mtl(data: &[u8]) {
    let obj = format!(
        "mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1 2 3\nusemtl a b\nf 1 2 3\nusemtl #\nf 1 2 3\n"
    );
    let files = Memory::new().with("a.obj", obj.into_bytes()).with("a.mtl", data.to_vec());
    load(files.with("t.png", TEXEL));
}

/// A picture on a model; the first byte chooses the ending of its name.
pub fn texture(data: &[u8]) {
    let Some((&first, data)) = data.split_first() else { return };
    let name =
        format!("t.{}", ["png", "jpg", "bmp", "tga", "gif", "webp", "PNG", ""][usize::from(first % 8)]);
    let map = if first & 8 == 0 { "map_Kd" } else { "map_d" };
    let obj = format!("mtllib a.mtl\nusemtl a\n{TRIANGLE}f 1/1 2/2 3/3\n");
    let files = Memory::new()
        .with("a.obj", obj.into_bytes())
        .with("a.mtl", format!("newmtl a\n{map} {name}\n").into_bytes())
        .with(&name, data.to_vec());
    let Some(model) = load(files) else { return };
    for texture in [&model.materials[0].diffuse_map, &model.materials[0].opacity_map].into_iter().flatten() {
        for level in texture.levels.iter() {
            assert_eq!(level.texels.len() as u64, u64::from(level.width) * u64::from(level.height));
        }
        assert!(texture.levels.last().is_some_and(|level| level.width * level.height == 1));
    }
}

/// Bytes as numbers of every kind: bits of a double, or something handy.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    fn next(&mut self) -> f64 {
        const HANDY: [f64; 16] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            1e-12,
            1e-300,
            5e-324,
            1e12,
            1e300,
            f64::MAX,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
            1e-6,
            -2.0,
        ];
        match self.byte() {
            0..=39 => f64::from_bits(u64::from_le_bytes(std::array::from_fn(|_| self.byte()))),
            kind @ 40..=79 => HANDY[usize::from(kind % 16)],
            80..=159 => (f64::from(self.byte()) - 128.0) / 16.0,
            _ => (f64::from(self.byte()) + 256.0 * f64::from(self.byte()) - 32768.0) / 1024.0,
        }
    }

    /// Usually near `about`.
    fn near(&mut self, about: f64) -> f64 {
        match self.byte() {
            0..=31 => self.next(),
            offset => about * (1.0 + (f64::from(offset) - 143.0) / 300.0),
        }
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }

    fn standard(&mut self) -> Standard {
        let still = self.byte();
        let mut length = |bit: u8, scale: f64| if still & bit == 0 { 0.0 } else { self.next() * scale };
        Standard {
            tilt: Angle::degrees(length(1, 10.0)),
            swing: Angle::degrees(length(2, 10.0)),
            rise: Length::millimetres(length(4, 10.0)),
            shift: Length::millimetres(length(8, 10.0)),
        }
    }
}

/// Everything that optics answer.
fn ask(optics: &Optics) {
    let world = optics.world_from_lens();
    for point in [DVec3::ZERO, DVec3::NEG_Z, DVec3::new(1.0, -2.0, -1e9), DVec3::new(0.0, 1e-9, -0.15)] {
        let _ = (optics.blur_of(point), optics.image_of(HomogeneousPoint::finite(point)));
        let _ = optics.projection(0.3, -0.2).project(point);
    }
    for c in [0.0, 1e-4, 1.0, f64::INFINITY, f64::NAN] {
        let _ = (optics.depth_of_field(c), optics.merklinger_limits(c), optics.untilted_limits(c));
    }
    let _ = (world.plane(optics.focus_plane()), world.plane(optics.front_focal_plane()));
    let _ = (world.line(optics.scheimpflug_line()), world.line(optics.hinge_line()), optics.hinge_distance());
    let _ = (optics.film_reaches_aperture(), optics.lens_point(0.1, 0.2), optics.film_point(0.01, -0.02));
    let _ = (optics.projection_from_world(0.0, 0.0).matrix(), optics.ray(0.1, 0.1, 0.0, 0.01));
}

/// Cameras of every kind, and planes to make sharp.
pub fn optics(data: &[u8]) {
    let mut numbers = Numbers(data);
    let (eye, look_at, up) = (numbers.point(), numbers.point(), numbers.point());
    let Ok(rail) =
        Camera::rail_frame(eye, look_at, up).or_else(|_| Camera::rail_frame(DVec3::Z, DVec3::ZERO, DVec3::Y))
    else {
        return;
    };
    let aperture = match FNumber::new(numbers.near(5.6)) {
        Ok(number) => Aperture::FNumber(number),
        Err(_) => Aperture::Pinhole,
    };
    let camera = Camera {
        rail,
        front: numbers.standard(),
        rear: numbers.standard(),
        extension: Length::metres(numbers.near(0.152)),
        focal_length: Length::metres(numbers.near(0.15)),
        aperture,
        film: FilmSize {
            width: Length::metres(numbers.near(0.12)),
            height: Length::metres(numbers.near(0.096)),
        },
        near: Length::metres(numbers.near(0.015)),
    };
    if let Ok(optics) = Optics::new(&camera) {
        ask(&optics);
    }
    let targets = [
        FocusTarget::Distance(numbers.next()),
        FocusTarget::Plane { point: numbers.point(), normal: numbers.point() },
        FocusTarget::Points([numbers.point(), numbers.point(), numbers.point()]),
    ];
    let upright = upright(&camera, DVec3::Y).ok();
    for target in targets {
        for adjust in [Adjust::Front, Adjust::Rear] {
            for camera in std::iter::once(&camera).chain(&upright) {
                match solve(camera, &target, adjust) {
                    Ok(solved) => ask(&Optics::new(&solved).expect("a solved camera has optics")),
                    Err(why) => {
                        let nearest = why.nearest.as_ref().map(|nearest| Optics::new(&nearest.camera));
                        nearest.into_iter().flatten().for_each(|optics| ask(&optics));
                        assert!(!why.to_string().is_empty());
                    }
                }
            }
        }
    }
}

const SCENE: &str = "[camera]\neye_m = [0, 1, 4]\nlook_at_m = [0, 1, 0]\nfocal_length_mm = 150\nf_number = 4\nfilm = \"4x5\"\n\
extension_mm = 155\n[[mesh]]\npath = \"t.obj\"\n";

/// A tiny picture of any triangles before any camera: the same at the narrowest and the widest SIMD level.
pub fn render_tiny(data: &[u8]) {
    let mut numbers = Numbers(data);
    let [width, samples, threads] = [17, 20, 2].map(|most| u32::from(numbers.byte()) % most + 1);
    let mut scene = String::new();
    for (key, about) in
        [("focal_length_mm", 150.0), ("f_number", 4.0), ("extension_mm", 155.0), ("near_m", 0.015)]
    {
        scene.push_str(&format!("{key} = {:?}\n", numbers.near(about)));
    }
    let [front, rear] = [numbers.standard(), numbers.standard()];
    for (name, standard) in [("front", front), ("rear", rear)] {
        let [tilt, swing, rise] =
            [standard.tilt.as_degrees(), standard.swing.as_degrees(), standard.rise.as_millimetres()];
        scene.push_str(&format!(
            "{name} = {{ tilt_deg = {tilt:?}, swing_deg = {swing:?}, rise_mm = {rise:?} }}\n"
        ));
    }
    let falloff = numbers.byte() & 1 == 1;
    let text = format!(
        "[camera]\neye_m = [0, 1, 4]\nlook_at_m = [0, 1, 0]\nfilm = \"4x5\"\n{scene}[sun]\ntoward = [1, 1, 1]\ncolor = [1, 1, 1]\n\
         [render]\nwidth = {width}\nsamples = {samples}\nfalloff = {falloff}\n[[mesh]]\npath = \"a.obj\"\n"
    )
    .replace("NaN", "nan");
    let mut obj = String::from("mtllib a.mtl\nvt 0 0\nvt 1 0\nvt 0 1\n");
    for i in 0..usize::from(numbers.byte() % 24) + 3 {
        // Mostly before the camera, that they are seen.
        let p = if numbers.byte() & 7 == 0 {
            numbers.point()
        } else {
            numbers.point().clamp(DVec3::splat(-9.0), DVec3::splat(9.0))
        };
        obj.push_str(&format!("v {} {} {}\n", p.x, p.y, p.z));
        if i >= 2 {
            obj.push_str(["usemtl a\n", "usemtl b\n", "", ""][usize::from(numbers.byte() % 4)]);
            obj.push_str("f -3/1 -2/2 -1/3\n");
        }
    }
    let files = Memory::new()
        .with("a.obj", obj.into_bytes())
        .with("a.mtl", &b"newmtl a\nmap_Kd t.png\nnewmtl b\nd 0.5\nKe 1 2 3\n"[..])
        .with("t.png", TEXEL);
    let loaded = parse(&text, "s.toml").and_then(|file| file.describe());
    let Ok(scene) = loaded.and_then(|scene| scene.load(&Small(files), Path::new(""), None)) else { return };
    let draw = |scene: &Scene, threads: u32, simd: SimdLevel| {
        let execution = Execution {
            threads: Some(threads as usize),
            memory: Some(256 << 20),
            simd: Some(simd),
            ..Execution::default()
        };
        render(scene, execution).ok().map(|(exposure, _)| {
            let pixels = (0..exposure.height()).flat_map(|y| (0..exposure.width()).map(move |x| (x, y)));
            pixels.map(|(x, y)| exposure.pixel(x, y).map(f32::to_bits)).collect::<Vec<_>>()
        })
    };
    let first = draw(&scene, threads, SimdLevel::best());
    assert!(first == draw(&scene, 1, SimdLevel::Scalar), "the picture depends on threads or SIMD level");
    let finite = |pixel: &[u32; 3]| pixel.iter().all(|&bits| f32::from_bits(bits).is_finite());
    assert!(first.is_none_or(|pixels| pixels.iter().all(finite)), "a pixel is no number");
}

/// One texel, half transparent (PNG).
const TEXEL: &[u8] = b"\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x01\x00\x00\x00\x01\x08\x06\x00\x00\x00\x1f\x15\xc4\x89\x00\x00\x00\x0d\x49\x44\x41\x54\x78\xda\x63\x38\x91\x62\xd4\x00\x00\x05\x35\x01\xdf\xac\x3c\xf1\xcb\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82";
