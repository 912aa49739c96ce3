//! Thirty odd files of our own, by the rules that the manifest of odd files is judged by: what loads, with how many
//! triangles, whether it warns, and what is a clear error with its line.

use groundglass::error::ErrorKind;
use groundglass::scene::{AssetLoader, Memory};
use std::path::Path;
use std::time::Instant;

enum Expect {
    /// Triangles, without a warning.
    Loads(usize),
    /// Triangles, and a warning that says this.
    Warns(usize, &'static str),
    /// An error at this line, or at none.
    Fails(Option<usize>),
}
use Expect::{Fails, Loads, Warns};

const V: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn judge(wrong: &mut Vec<String>, what: &str, files: Vec<(&str, Vec<u8>)>, expected: &Expect) {
    let memory = files.into_iter().fold(Memory::new(), |memory, (name, bytes)| memory.with(name, bytes));
    let begun = Instant::now();
    let mut loader = AssetLoader::new(&memory, Path::new("")).with_memory(1 << 30);
    let loaded = loader.load_obj("a.obj");
    let warnings: Vec<String> = loader.warnings().iter().map(ToString::to_string).collect();
    let good = match (expected, &loaded) {
        (Loads(count), Ok(model)) => model.triangles.len() == *count && warnings.is_empty(),
        (Warns(count, words), Ok(model)) => {
            model.triangles.len() == *count && warnings.iter().any(|warning| warning.contains(words))
        }
        (Fails(line), Err(error)) => {
            error.kind() == ErrorKind::Invalid && error.place().line == *line && error.place().file.is_some()
        }
        _ => false,
    };
    if !good || begun.elapsed().as_secs() >= 5 {
        let got = loaded.map(|model| model.triangles.len()).map_err(|error| error.to_string());
        wrong.push(format!("{what}: {got:?}, {warnings:?}, {:?}", begun.elapsed()));
    }
}

/// A face with so many teeth, each as far aslant as the whole is wide: 2 corners each, and 3.
fn teeth(count: usize) -> String {
    let teeth: String = (0..count).map(|i| format!("v {i} 0 0\nv {} 1 0\n", i + count)).collect();
    let corners: String = (1..=2 * count + 3).map(|i| format!(" {i}")).collect();
    format!("{teeth}v {count} 0 0\nv {count} -1 0\nv 0 -1 0\nf{corners}\n")
}

#[test]
fn odd_meshes_load_warn_or_fail_as_the_rules_say() {
    let with = |rest: &str| vec![("a.obj", format!("{V}{rest}").into_bytes())];
    let bytes = |bytes: &[u8]| vec![("a.obj", bytes.to_vec())];
    let mtl = |obj: &str, mtl: &str| {
        vec![("a.obj", format!("mtllib a.mtl\n{V}{obj}").into_bytes()), ("a.mtl", mtl.as_bytes().to_vec())]
    };
    let utf16: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_be_bytes).collect();
    /// A name, files by name, and what they give.
    type Case<'a> = (&'a str, Vec<(&'a str, Vec<u8>)>, Expect);
    let cases: Vec<Case<'_>> = vec![
        ("old Mac line ends", bytes(b"v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r"), Loads(1)),
        ("old Mac line ends in the MTL only", mtl("usemtl a\nf 1 2 3\n", "newmtl a\rKd 1 0 0\r"), Loads(1)),
        ("UTF-16 big-endian", bytes(&utf16), Fails(None)),
        ("CR CR LF", with("f 1 2 3\r\r\nf 1 3 4\r\r\n"), Loads(2)),
        (
            "statements in capitals are unknown, and told",
            with("F 1 2 3\nf 1 2 3\n"),
            Warns(1, "is written `f`"),
        ),
        ("no space after f", with("f1 2 3\nf 1 2 3\n"), Loads(1)),
        ("indices with a plus sign", with("f +1 +2 +3\n"), Loads(1)),
        ("indices with leading zeros", with("f 001 0002 3\n"), Loads(1)),
        ("fractional index", with("f 1.0 2.0 3.0\n"), Fails(Some(5))),
        ("hexadecimal number", with("v 0x10 0 0\nf 1 2 3\n"), Fails(Some(5))),
        ("decimal comma", with("v 1,5 0 0\nf 1 2 3\n"), Fails(Some(5))),
        ("denormal and negative zero", with("v 5e-324 -0 -0.0\nf 1 2 5\n"), Loads(1)),
        ("infinite vertex, used", with("v inf 0 0\nf 1 2 5\n"), Fails(Some(6))),
        ("all corners one vertex", with("f 1 1 1 1\n"), Loads(2)),
        ("relative index past the start", with("f -1 -2 -5\n"), Fails(Some(5))),
        ("smallest 64-bit index and one less", with("f 1 2 -9223372036854775809\n"), Fails(Some(5))),
        ("a face of two corners", with("f 1 2\nf 1 2 3\n"), Warns(1, "fewer than three")),
        ("an empty face", with("f\nf 1 2 3\n"), Warns(1, "fewer than three")),
        ("comment inside a face", with("f 1 2 3 # 4\n"), Loads(1)),
        ("comment glued to a corner", with("f 1 2 3#4\n"), Loads(1)),
        ("a comment that ends in a back slash", with("f 1 2 3 # of C:\\models\\\nf 1 3 4\n"), Loads(2)),
        ("the same, glued to a corner", with("f 1 2 3#C:\\models\\\nf 1 3 4\n"), Loads(2)),
        (
            "a library of a million words",
            with(&format!("mtllib{}\nf 1 2 3\n", " a".repeat(1_000_000))),
            Warns(1, "more than 256"),
        ),
        (
            "an outline of ten thousand slanted teeth",
            bytes(teeth(10_000).as_bytes()),
            Warns(20_001, "too tangled"),
        ),
        ("continued comment does not continue", with("# c \\\nf 1 2 3\n"), Loads(1)),
        ("normal index only beyond", with("vn 0 0 1\nf 1//1 2//1 3//2\n"), Warns(1, "normal")),
        ("nan normal, used", with("vn nan 0 0\nf 1//1 2//1 3//1\n"), Warns(1, "normal")),
        (
            "free-form surface beside a face",
            with("vp 0.1 0.2\ncstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nend\nf 1 2 3\n"),
            Warns(1, "curv"),
        ),
        (
            "groups without faces, levels of detail",
            with("g\no\ng a b c\nlod 3\nd_interp on\nf 1 2 3\n"),
            Loads(1),
        ),
        ("a quote in a library's name", with("mtllib \"a.mtl\"\nf 1 2 3\n"), Warns(1, "a.mtl")),
        ("a URL as a library", with("mtllib https://a.example/a.mtl\nf 1 2 3\n"), Warns(1, "URL")),
        ("a library that is the mesh itself", with("mtllib a.obj\nusemtl a\nf 1 2 3\n"), Warns(1, "a.obj")),
        ("a colour that is nan", mtl("usemtl a\nf 1 2 3\n", "newmtl a\nKd nan 0 0\n"), Warns(1, "a.mtl:2")),
        ("coverage beyond 1", mtl("usemtl a\nf 1 2 3\n", "newmtl a\nd 7\n"), Warns(1, "a.mtl:2")),
        ("a halo and a factor", mtl("usemtl a\nf 1 2 3\n", "newmtl a\nd -halo 0.5\n"), Warns(1, "a.mtl:2")),
        (
            "a material twice, the last counts",
            mtl("usemtl a\nf 1 2 3\n", "newmtl a\nKd 1 0 0\nnewmtl a\nKd 0 1 0\n"),
            Warns(1, "a.mtl:3"),
        ),
        (
            "tabs and trailing spaces in names",
            mtl("usemtl \ta\t \nf 1 2 3\n", "newmtl\ta \t\nKd 1 0 0\n"),
            Loads(1),
        ),
        (
            "a texture with a NUL in its name",
            mtl("usemtl a\nf 1 2 3\n", "newmtl a\nmap_Kd t\0.png\n"),
            Warns(1, "a.mtl:2"),
        ),
        (
            "a texture whose name drives a terminal",
            mtl("usemtl a\nf 1 2 3\n", "newmtl a\nmap_Kd \u{1b}[2J.png\n"),
            Warns(1, "\\u{1b}[2J.png"),
        ),
        (
            "only a scalar map",
            mtl("usemtl a\nf 1 2 3\n", "newmtl a\nmap_Ns t.png\nbump t.png\nrefl -type sphere t.png\n"),
            Loads(1),
        ),
        ("a zip file", bytes(b"PK\x03\x04\x14\0\0\0\x08\0a.obj"), Fails(None)),
        ("binary glTF", bytes(b"glTF\x02\0\0\0\x10\0\0\0\0\0\0\0JSON{}"), Fails(None)),
        ("ten thousand groups of one face", with(&"g x\nf 1 2 3\n".repeat(10_000)), Loads(10_000)),
        ("a star of 4001 corners", star(4001), Loads(3999)),
    ];
    let (mut wrong, count) = (Vec::new(), cases.len());
    for (what, files, expected) in cases {
        judge(&mut wrong, what, files, &expected);
    }
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n"));
}

/// One polygon that crosses itself at every edge.
fn star(corners: usize) -> Vec<(&'static str, Vec<u8>)> {
    let mut text = String::new();
    for i in 0..corners {
        let angle = i as f64 * (corners / 2) as f64 * std::f64::consts::TAU / corners as f64;
        text.push_str(&format!("v {} {} 0\n", libm::cos(angle), libm::sin(angle)));
    }
    let indices: Vec<String> = (1..=corners).map(|i| i.to_string()).collect();
    vec![("a.obj", format!("{text}f {}\n", indices.join(" ")).into_bytes())]
}

/// Pictures as the `map_Kd` of a triangle: decoded without a warning, or a warning that names them.
#[test]
fn odd_pictures_decode_or_are_named() {
    use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
    let picture = |format: ImageFormat| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let picture = RgbImage::from_fn(5, 3, |x, y| Rgb([x as u8 * 50, y as u8 * 80, 9]));
        DynamicImage::from(picture).write_to(&mut bytes, format).expect("a picture");
        bytes.into_inner()
    };
    let png = picture(ImageFormat::Png);
    let cut = |from: &[u8], end: usize| from[..from.len().min(end)].to_vec();
    let changed = |at: usize, value: u8| {
        let mut bytes = png.clone();
        bytes[at] = value;
        bytes
    };
    let bmp = picture(ImageFormat::Bmp);
    let negative_height = {
        let mut bytes = bmp.clone();
        bytes[22..26].copy_from_slice(&(-3i32).to_le_bytes());
        bytes
    };
    let huge_bmp = {
        let mut bytes = bmp.clone();
        bytes[18..26].copy_from_slice(&[255, 255, 255, 127, 255, 255, 255, 127]);
        bytes
    };
    let cases: Vec<(&str, Vec<u8>, bool)> = vec![
        ("good.png", png.clone(), true),
        ("good.bmp", bmp.clone(), true),
        ("good.tga", picture(ImageFormat::Tga), true),
        ("good.gif", picture(ImageFormat::Gif), true),
        ("good.jpg", picture(ImageFormat::Jpeg), true),
        ("good.webp", picture(ImageFormat::WebP), true),
        ("top-down.bmp", negative_height, true),
        ("claims.bmp", huge_bmp, false),
        ("cut.bmp", cut(&bmp, 60), false),
        ("header.png", cut(&png, 33), false),
        ("crc.png", changed(29, png[29] ^ 1), false),
        ("colour-type-1.png", changed(25, 1), false),
        ("depth-0.png", changed(24, 0), false),
        ("interlace-9.png", changed(28, 9), false),
        ("signature.png", changed(0, 0), false),
        ("tail.png", [png.clone(), b"tail".to_vec()].concat(), true),
        ("bmp-named.tga", bmp, true),
        ("soi.jpg", b"\xff\xd8".to_vec(), false),
        ("riff.webp", b"RIFF\xff\xff\xff\xffWEBPVP8L".to_vec(), false),
        ("bomb.gif", b"GIF89a\xff\xff\xff\xff\xf7\0\0".to_vec(), false),
        ("short.tga", vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 127, 255, 127, 32, 0], false),
        ("svg.png", b"<svg xmlns=\"http://www.w3.org/2000/svg\"/>".to_vec(), false),
    ];
    let mut wrong = Vec::new();
    for (name, bytes, good) in cases {
        let obj = format!("mtllib a.mtl\nusemtl a\n{V}vt 0 0\nf 1/1 2/1 3/1\n");
        let mtl = format!("newmtl a\nmap_Kd {name}\n").into_bytes();
        let files = vec![("a.obj", obj.into_bytes()), ("a.mtl", mtl), (name, bytes)];
        let expected = if good { Loads(1) } else { Warns(1, name) };
        judge(&mut wrong, name, files, &expected);
    }
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
}
