//! A long run of the library in one process: memory stays flat, and no thread is left behind.

#![cfg(target_os = "linux")]

use groundglass::error::ErrorKind;
use groundglass::scene::{Memory, parse};
use groundglass::{Execution, render};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const SCENE: &str = "[camera]\neye_m = [0, 1, 4]\nlook_at_m = [0, 1, 0]\nfocal_length_mm = 150\nf_number = 4\nfilm = \"4x5\"\n\
    extension_mm = 155\n[[mesh]]\npath = \"a.obj\"\n[render]\nwidth = 40\nsamples = 20\n";

fn status(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix(name)).unwrap();
    line.trim_start_matches(':').split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn memory_is_flat_and_no_thread_stays_over_500_renders() {
    let before = status("Threads");
    let quads: String =
        (0..500).map(|i| format!("v {i} 0 -9\nv {i} 2 -9\nv -1 2 {i}\nf -3/1 -2/1 -1/1\n")).collect();
    let files = Memory::new()
        .with("a.obj", format!("mtllib a.mtl\nusemtl a\nvt 0 0\n{quads}").into_bytes())
        .with("a.mtl", &b"newmtl a\nmap_Kd brick.png\n"[..])
        .with("brick.png", &include_bytes!("../examples/tower/textures/brick.png")[..]);
    let draw = |round: u64| {
        let scene = parse(SCENE, "s.toml").and_then(|file| file.describe());
        let scene = scene.and_then(|scene| scene.load(&files, Path::new(""), None)).unwrap();
        let stop = AtomicBool::new(round % 5 == 4);
        let execution = Execution { threads: Some(2), cancel: Some(&stop), ..Execution::default() };
        match render(&scene, execution) {
            Ok((exposure, _)) => {
                exposure.write_png(0.0, &[], std::io::sink()).unwrap();
                assert!(round % 5 != 4);
            }
            Err(error) => assert_eq!(error.kind(), ErrorKind::Cancelled),
        }
    };
    let most_of = |rounds: std::ops::Range<u64>| {
        let after = |round| {
            draw(round);
            status("VmRSS")
        };
        rounds.map(after).max().unwrap()
    };
    // Until the allocator has seen all that it will. It gives memory back and takes it again: what counts is the most.
    let (start, begun) = (most_of(0..200), Instant::now());
    let end = most_of(0..500);
    println!("{start} KiB at most before, {end} KiB in 500 renders; {:?}", begun.elapsed());
    assert!(end < start + 2048, "{start} KiB became {end} KiB");
    let after = status("Threads");
    assert!(after <= before, "{before} threads became {after}");
}
