//! Memory is asked for before it is used: `--memory`, a limit of the address space, and what hostile files ask for.
//! Whatever the limit, the program ends with 0 or 2, and takes no more than it was allowed.

#![cfg(target_os = "linux")]

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, SMALL, TRIANGLE, command, folder, run, shared};
use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{PoisonError, RwLock};

const MIB: u64 = 1 << 20;

/// What is timed by the clock runs alone, all else side by side.
static BESIDE: RwLock<()> = RwLock::new(());

/// Runs a command beside others; its exit code (none when a signal ended it), its errors, and the most memory it had at once.
fn watched(command: Command) -> (Option<i32>, String, u64) {
    // A test that failed meanwhile leaves nothing half done.
    let _beside = BESIDE.read().unwrap_or_else(PoisonError::into_inner);
    watch(command)
}

fn watch(mut command: Command) -> (Option<i32>, String, u64) {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    // A child may be seen for a moment in the memory of the thread that began it, and under its name (Linux wakes the parent of a
    // `vfork` before the new program has its own memory): that is what the tests of this process take together.
    let ours = format!("Name:\t{}", fs::read_to_string("/proc/thread-self/comm").unwrap());
    let mut peak = 0;
    let code = loop {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let text = if text.starts_with(&ours) { "" } else { &text };
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
        peak = peak.max(kib.unwrap_or(0) * 1024);
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    };
    let mut errors = String::new();
    child.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
    (code, errors, peak)
}

/// Below a limit that is too small the program says so, above it works, and it never takes more.
fn sweep(folder: &Path, words: &[&str], limits: &[u64]) {
    let mut done = 0;
    for &limit in limits {
        let words: Vec<String> = words
            .iter()
            .map(|word| (*word).to_owned())
            .chain(["--memory".into(), limit.to_string()])
            .collect();
        let (code, errors, peak) = watched(command(folder, &words.iter().map(|w| &**w).collect::<Vec<_>>()));
        println!("{words:?}: {code:?}, {} of {} MiB; {}", peak / MIB, limit / MIB, errors.trim());
        assert!(
            code == Some(0) || (code == Some(2) && errors.contains("error: ")),
            "{limit}: {code:?} {errors}"
        );
        // The program itself takes about this much before it can ask.
        assert!(peak <= limit.max(24 * MIB), "{words:?}: {} MiB taken", peak / MIB);
        done += usize::from(code == Some(0));
    }
    assert!(0 < done && done < limits.len(), "{done} of {} done", limits.len());
}

#[test]
fn a_limit_is_kept_by_pictures_of_any_size() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    let words =
        ["render", "scene.toml", "-o", "o.png", "--width", "4000", "--samples", "2", "--threads", "2"];
    sweep(&folder, &words, &[16, 64, 128, 200, 300, 400].map(|m| m * MIB));
    let words =
        ["render", "scene.toml", "-o", "o.exr", "--width", "4000", "--samples", "2", "--threads", "2"];
    sweep(&folder, &words, &[64, 128, 200, 300, 400].map(|m| m * MIB));
}

#[test]
fn a_limit_is_kept_by_meshes_of_any_size() {
    let tower = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tower.toml");
    let (_keep, folder) = folder("");
    let scene = |name: &str, limits: &[u64]| {
        let limits: Vec<u64> = limits.iter().map(|m| m * MIB).collect();
        sweep(&folder, &["check", name], &limits);
        let size = ["-o", "o.png", "--width", "160", "--samples", "4", "--threads", "2"];
        sweep(&folder, &[&["render", name][..], &size[..]].concat(), &limits);
    };
    scene(tower, &[20, 40, 60, 80, 120, 200, 400]);
    if sponza(&folder) {
        scene("sponza.toml", &[100, 200, 300, 400, 600, 900]);
    }
}

/// Writes a scene of Sponza into a folder, where it can be had.
fn sponza(folder: &Path) -> bool {
    let Some(model) = shared("data/scenes/sponza/sponza.obj") else { return false };
    let model = model.canonicalize().unwrap();
    // A scene names its meshes by relative paths.
    let up = "../".repeat(folder.canonicalize().unwrap().components().count() - 1);
    let path = format!("{up}{}", model.to_str().unwrap().trim_start_matches('/'));
    let camera = CAMERA
        .replace("[0.0, 1.6, 10.0]", "[-10.0, 2.0, 0.0]")
        .replace("[0.0, 1.6, 0.0]", "[10.0, 3.0, 0.0]");
    fs::write(folder.join("sponza.toml"), format!("{camera}[[mesh]]\npath = \"{path}\"\nscale = 0.01\n"))
        .unwrap();
    true
}

fn png(path: &Path, side: u32, value: u8) {
    let mut file = fs::File::create(path).unwrap();
    let mut encoder = png::Encoder::new(&mut file, side, side);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().unwrap();
    let mut stream = writer.stream_writer().unwrap();
    let row = vec![value; side as usize];
    (0..side).for_each(|_| stream.write_all(&row).unwrap());
    stream.finish().unwrap();
}

/// Four textures of 8192 x 8192, a few kilobytes each as files, 700 MB each once decoded.
#[test]
fn many_large_textures_are_refused_before_they_are_decoded() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    let (mut obj, mut mtl) = ("mtllib t.mtl\n".to_owned(), String::new());
    for i in 0..4 {
        png(&folder.join(format!("{i}.png")), 8192, i);
        mtl.push_str(&format!("newmtl m{i}\nmap_Kd {i}.png\n"));
        obj.push_str(&format!("usemtl m{i}\n{}", if i == 0 { TRIANGLE } else { "f 1/1 2/2 3/3\n" }));
    }
    fs::write(folder.join("t.mtl"), mtl).unwrap();
    fs::write(folder.join("t.obj"), obj).unwrap();
    for limit in ["200MiB", "600MiB", "1GiB"] {
        let (code, errors, peak) = watched(command(&folder, &["check", "scene.toml", "--memory", limit]));
        println!("{limit}: {code:?}, {} MiB; {errors}", peak / MIB);
        assert!(code == Some(2) && errors.contains(".png") && errors.contains("memory"), "{code:?} {errors}");
        assert!(peak < 1024 * MIB, "{} MiB", peak / MIB);
    }
}

/// A million triangles, each across the whole of a large picture: more pairs of triangle and tile than memory holds.
#[test]
fn triangles_that_fill_the_picture_are_refused_when_too_many() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    let faces = "f 1 2 3\n".repeat(300_000);
    fs::write(folder.join("t.obj"), format!("v -90 -90 0\nv 90 -90 0\nv 0 90 0\n{faces}")).unwrap();
    let words =
        ["render", "scene.toml", "-o", "o.png", "--width", "4000", "--samples", "1", "--memory", "1GiB"];
    let (code, errors, peak) = watched(command(&folder, &words));
    println!("{code:?}, {} MiB; {errors}", peak / MIB);
    assert!(
        code == Some(2) && errors.contains("memory") && peak < 1024 * MIB,
        "{code:?} {} {errors}",
        peak / MIB
    );
}

/// A limit of the address space, as a cluster sets it: 0 or 2 whatever it is, never an abort.
#[test]
fn any_limit_of_the_address_space_ends_in_0_or_2() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    let mut scenes = vec!["scene.toml", concat!(env!("CARGO_MANIFEST_DIR"), "/examples/tower.toml")];
    scenes.extend(sponza(&folder).then_some("sponza.toml"));
    let (mut refused, mut done) = (0, 0);
    for scene in scenes {
        for megabytes in [60, 90, 120, 160, 200, 260, 330, 420, 540, 700, 900, 1200, 1600, 2400] {
            let mut limited = Command::new("prlimit");
            limited.arg(format!("--as={}", megabytes * MIB)).arg(env!("CARGO_BIN_EXE_groundglass"));
            limited
                .args(["render", scene, "-o", "o.png", "--width", "400", "--samples", "4"])
                .current_dir(&folder);
            let (code, errors, _) = watched(limited);
            println!("{megabytes} MiB: {code:?} {}", errors.trim());
            match code {
                Some(0) => done += 1,
                Some(2) if errors.contains("error: ") => refused += 1,
                _ => panic!("{megabytes} MiB: {code:?} {errors}"),
            }
        }
    }
    assert!(done > 0 && refused > 0, "{done} done, {refused} refused");
}

/// Small files that ask for much: each ends soon, in little memory.
#[test]
fn bombs_are_small_and_soon_over() {
    let scene = format!("{CAMERA}{SMALL}");
    let obj = |text: String| text.into_bytes();
    let giant = |width: u32, height: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        bytes.extend(width.to_be_bytes());
        bytes.extend(height.to_be_bytes());
        bytes.extend(b"\x08\x06\0\0\0");
        let crc = crc32(&bytes[12..]);
        bytes.extend(crc.to_be_bytes());
        bytes
    };
    let textured = || obj(format!("mtllib t.mtl\nusemtl m\n{TRIANGLE}"));
    /// A name, files by name, and the exit code.
    type Case<'a> = (&'a str, Vec<(&'a str, Vec<u8>)>, i32);
    let cases: Vec<Case<'_>> = vec![
        (
            "a picture that claims 1e9 texels",
            vec![("t.obj", textured()), ("k.png", giant(40_000, 25_000))],
            0,
        ),
        ("one that claims 2^62", vec![("t.obj", textured()), ("k.png", giant(0x7fff_ffff, 0x7fff_ffff))], 0),
        ("one of 8192 x 8192 without data", vec![("t.obj", textured()), ("k.png", giant(8192, 8192))], 0),
        ("indices to 2^63", vec![("t.obj", obj("v 0 0 0\nf 9223372036854775807 1 1\n".into()))], 2),
        (
            "a face of ten million corners",
            vec![("t.obj", obj(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf {}\n", "1 2 3 ".repeat(3_333_333))))],
            2,
        ),
        ("continued for ever", vec![("t.obj", obj(format!("v 0 0 0\nf 1 {}", "\\\n".repeat(5_000_000))))], 2),
        (
            "materials without end",
            vec![("t.obj", textured()), ("t.mtl", obj("newmtl m\n".repeat(7_000_000)))],
            0,
        ),
        (
            "libraries without end",
            vec![(
                "t.obj",
                obj(format!(
                    "{}{TRIANGLE}",
                    (0..300_000).fold(String::new(), |s, i| s + &format!("mtllib {i}.mtl\n"))
                )),
            )],
            0,
        ),
    ];
    for (what, files, expected) in cases {
        let (_keep, folder) = folder(&scene);
        fs::write(folder.join("t.mtl"), "newmtl m\nmap_Kd k.png\n").unwrap();
        for (name, bytes) in files {
            fs::write(folder.join(name), bytes).unwrap();
        }
        let _alone = BESIDE.write().unwrap_or_else(PoisonError::into_inner);
        let begun = std::time::Instant::now();
        let (code, errors, peak) = watch(command(&folder, &["check", "scene.toml", "--memory", "1GiB"]));
        println!("{what}: {code:?}, {:?}, {} MiB; {:.200}", begun.elapsed(), peak / MIB, errors.trim());
        assert_eq!(code, Some(expected), "{what}: {errors}");
        assert!(peak < 1024 * MIB && begun.elapsed().as_secs() < 5, "{what}: {} MiB", peak / MIB);
    }
}

/// Lines and files of gigabytes, sparse: over at once.
#[test]
fn files_of_gigabytes_are_soon_over() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    for (name, bytes) in
        [("t.obj", 2u64 << 30), ("t.obj", (1 << 30) - 1), ("scene.toml", 2 << 30), ("t.obj", 1 << 42)]
    {
        let before = fs::read(folder.join(name)).unwrap();
        let file = fs::File::create(folder.join(name)).unwrap();
        if file.set_len(bytes).is_err() {
            println!("skipped: the file system takes no file of {bytes} bytes");
            continue;
        }
        let _alone = BESIDE.write().unwrap_or_else(PoisonError::into_inner);
        // What reading it alone takes here and now, if it is read at all.
        let begun = std::time::Instant::now();
        let read = if bytes < 1 << 30 { fs::read(folder.join(name)).unwrap().len() } else { 0 };
        let (reading, begun) = (begun.elapsed(), std::time::Instant::now());
        let (code, errors, peak) = watch(command(&folder, &["check", "scene.toml"]));
        println!(
            "{read} bytes read in {reading:?}; {name} of {bytes} bytes: {code:?}, {:?}, {} MiB; {errors}",
            begun.elapsed(),
            peak / MIB
        );
        assert!(code == Some(2) && errors.contains("longer"), "{code:?} {errors}");
        assert!(begun.elapsed() < 3 * reading + std::time::Duration::from_secs(5) && peak < 1100 * MIB);
        fs::write(folder.join(name), before).unwrap();
    }
}

#[test]
fn a_limit_is_a_number_with_a_unit() {
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}"));
    for limit in ["2GiB", "500MB", "1.5g", "4000000000", "1 TiB"] {
        run(&folder, &["check", "scene.toml", "--memory", limit]).expect(0, &[]);
    }
    for limit in ["", "x", "-1", "2 parsecs", "nan", "inf", "1e999"] {
        run(&folder, &["check", "scene.toml", &format!("--memory={limit}")]).expect(64, &["--memory"]);
    }
    for limit in ["0", "1", "1MiB"] {
        run(&folder, &["check", "scene.toml", "--memory", limit]).expect(2, &["allow more memory"]);
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(
            crc ^ u32::from(byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 },
        )
    })
}

/// A model of many triangles takes no more than 400 bytes for each of them, file, vertices, bins and all, beside what any picture
/// takes.
#[test]
fn a_triangle_takes_no_more_than_400_bytes() {
    const SIDE: u64 = 600;
    let peak = |side: u64, samples: &str| {
        let (_keep, folder) = folder("");
        let mut mesh = String::new();
        for i in 0..=side {
            for j in 0..=side {
                let [x, y] = [i, j].map(|c| 3.0 * (c as f64 / side as f64 - 0.5));
                // Bumps, so that no two triangles are one surface.
                mesh += &format!("v {x:.6} {y:.6} {:.6}\n", 0.2 * libm::sin(9.0 * x) * libm::sin(7.0 * y));
            }
        }
        for i in 0..side {
            for j in 1..=side {
                let at = i * (side + 1) + j;
                mesh += &format!(
                    "f {at} {} {}\nf {} {at} {}\n",
                    at + 1,
                    at + side + 1,
                    at + side + 2,
                    at + side + 1
                );
            }
        }
        fs::write(folder.join("t.obj"), mesh).unwrap();
        fs::write(folder.join("scene.toml"), format!("{CAMERA}[[mesh]]\npath = \"t.obj\"\n")).unwrap();
        let words =
            ["render", "scene.toml", "-o", "o.png", "--width", "320", "--samples", samples, "--threads", "2"];
        let (code, errors, peak) = watched(command(&folder, &words));
        assert_eq!(code, Some(0), "{errors}");
        peak
    };
    for samples in ["1", "64"] {
        let (few, many) = (peak(2, samples), peak(SIDE, samples));
        let each = (many - few) / (2 * SIDE * SIDE);
        println!("N = {samples}: {} and {} MiB, {each} bytes a triangle", few / MIB, many / MIB);
        assert!(each <= 400, "{each} bytes");
        // Or nothing was measured.
        assert!(each >= 40, "{each} bytes");
    }
}
