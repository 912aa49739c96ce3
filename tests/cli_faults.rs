//! What goes wrong while the program works, for real: a full disk, a limit on files, a folder that turns read-only or
//! vanishes, signals at any moment, an end without warning. The exit code is the contract's, the old output stays, and
//! nothing strays.

#![cfg(target_os = "linux")]

#[path = "common/program.rs"]
mod program;

use program::{CAMERA, SMALL, command, finish, folder, heard, names, run};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A small deterministic generator.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

/// A scene whose picture is of this width.
fn scene(width: u32, samples: u32) -> (tempfile::TempDir, std::path::PathBuf) {
    folder(
        &format!("{CAMERA}{SMALL}")
            .replace("width = 16", &format!("width = {width}"))
            .replace("samples = 2", &format!("samples = {samples}")),
    )
}

/// Runs a script where it may mount file systems of its own, if the system lets us.
fn in_own_mounts(folder: &Path, script: &str) -> Option<(String, String)> {
    let mut shell = Command::new("unshare");
    shell.args(["-rm", "sh", "-c", script, "sh", env!("CARGO_BIN_EXE_groundglass")]).current_dir(folder);
    let mut probe = Command::new("unshare");
    let probed = probe.args(["-rm", "sh", "-c", "mount -t tmpfs none /mnt"]).stderr(Stdio::null()).status();
    if !probed.is_ok_and(|status| status.success()) {
        println!("skipped: no file system can be mounted here");
        return None;
    }
    let done = shell.output().unwrap();
    Some((
        String::from_utf8_lossy(&done.stdout).into_owned(),
        String::from_utf8_lossy(&done.stderr).into_owned(),
    ))
}

#[test]
fn a_full_disk_is_3_and_keeps_the_old_output() {
    let (_keep, folder) = scene(400, 1);
    // A disk of 16 KiB, with an old picture on it; the new ones do not fit.
    let script = "mkdir disk && mount -t tmpfs -o size=16k none disk && echo old > disk/o.exr && cp disk/o.exr disk/o.svg
        \"$1\" render scene.toml -o disk/o.exr; echo code $?
        \"$1\" diagram scene.toml -o disk/o.svg --text paths; echo code $?
        \"$1\" render scene.toml -o o.png --stats disk/s.json; echo code $?
        head -c 100 disk/o.exr; head -c 100 disk/o.svg; ls -A disk
        rm -f disk/s.json; head -c 70000 /dev/zero > disk/fill
        \"$1\" render scene.toml -o o.png --stats disk/s.json; echo code $?
        ls -A disk";
    let Some((out, errors)) = in_own_mounts(&folder, script) else { return };
    println!("{out}\n{errors}");
    let codes: Vec<&str> = out.lines().filter_map(|line| line.strip_prefix("code ")).collect();
    assert_eq!(codes, ["3", "3", "0", "3"], "{errors}");
    assert!(out.contains("old\nold\n") && !out.contains(".part"), "{out}");
    assert!(errors.contains("no space left") && !errors.contains("panicked"), "{errors}");
}

#[test]
fn a_read_only_disk_is_3() {
    let (_keep, folder) = scene(16, 1);
    let script = "mkdir disk && mount -t tmpfs none disk && cp scene.toml t.obj disk && echo old > disk/o.png
        mount -o remount,ro disk && cd disk
        for out in o.png new.png none/new.png; do \"$1\" render scene.toml -o $out; echo code $?; done
        \"$1\" render scene.toml; echo code $?
        \"$1\" diagram scene.toml -o o.svg; echo code $?
        \"$1\" solve scene.toml --distance 8 --write s.toml; echo code $?
        \"$1\" new t.obj; echo code $?
        \"$1\" check scene.toml >&2; echo code $?
        cat o.png; ls -A";
    let Some((out, errors)) = in_own_mounts(&folder, script) else { return };
    println!("{out}\n{errors}");
    let codes: Vec<&str> = out.lines().filter_map(|line| line.strip_prefix("code ")).collect();
    assert_eq!(codes, ["3", "3", "3", "3", "3", "3", "3", "0"], "{errors}");
    assert!(
        out.ends_with("old\no.png\nscene.toml\nt.obj\n") && errors.contains("read-only"),
        "{out} {errors}"
    );
}

/// `ulimit -f`: the system would end the program by a signal.
#[test]
fn a_limit_on_the_length_of_files_is_3() {
    let (_keep, folder) = scene(200, 1);
    fs::write(folder.join("o.exr"), "old").unwrap();
    let before = names(&folder);
    let limited = |bytes: u32, rest: &str| {
        let program = env!("CARGO_BIN_EXE_groundglass");
        let mut shell = Command::new("sh");
        shell.current_dir(&folder).args(["-c", &format!("exec prlimit --fsize={bytes} '{program}' {rest}")]);
        finish(shell)
    };
    limited(10_000, "render scene.toml -o o.exr").expect(3, &["o.exr", "file too large"]);
    limited(0, "render scene.toml -o p.png").expect(3, &["p.png", "file too large"]);
    limited(1_000, "diagram scene.toml -o d.svg").expect(3, &["d.svg", "file too large"]);
    limited(300, "optics scene.toml --json > o.json").expect(3, &["standard output"]);
    limited(0, "check none.toml 2> err.txt").expect(2, &[]);
    for name in ["o.json", "err.txt"] {
        fs::remove_file(folder.join(name)).unwrap();
    }
    assert_eq!((names(&folder), fs::read(folder.join("o.exr")).unwrap()), (before, b"old".to_vec()));
    limited(10_000_000, "render scene.toml -o o.exr").expect(0, &[]);
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let (_keep, folder) = scene(16, 1);
    for words in [
        &["optics", "scene.toml", "--json"][..],
        &["schema"],
        &["render", "scene.toml", "-o", "o.png"],
        &["--help"],
    ] {
        let mut child =
            command(&folder, words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(0), "{words:?}");
    }
    assert_eq!(names(&folder), ["o.png", "scene.toml", "t.obj"]);
}

fn start(folder: &Path, words: &[&str]) -> Child {
    command(folder, words).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until the program listens for signals, or has ended.
fn listening(child: &mut Child) {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(20) && child.try_wait().unwrap().is_none() {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        // TERM is signal 15; INT may be ignored.
        if caught
            .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
            .is_some_and(|mask| mask & 0x4000 != 0)
        {
            return;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
}

fn signal(child: &Child, name: &'static str) {
    kill(child, heard(name));
}

fn kill(child: &Child, name: &str) {
    Command::new("kill").args([name, &child.id().to_string()]).stderr(Stdio::null()).status().unwrap();
}

#[test]
fn a_folder_that_vanishes_while_rendering_is_3() {
    let (_keep, folder) = scene(400, 20_000);
    let before = names(&folder);
    for outputs in [&["-o", "gone/o.png"][..], &["-o", "gone/o.png", "--stats", "gone/s.json"]] {
        fs::create_dir(folder.join("gone")).unwrap();
        let child = start(&folder, &[&["render", "scene.toml"], outputs].concat());
        std::thread::sleep(Duration::from_millis(100));
        fs::remove_dir_all(folder.join("gone")).unwrap();
        let done = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.code() == Some(3) && errors.contains("gone/"), "{:?} {errors}", done.status);
        assert_eq!(names(&folder), before);
    }
}

/// Whole: it ends as a PNG ends, or it is what was there.
fn is_whole(bytes: &[u8], old: &[u8]) -> bool {
    bytes == old || (bytes.starts_with(b"\x89PNG") && bytes.ends_with(b"\0\0\0\0IEND\xaeB`\x82"))
}

#[test]
fn a_signal_at_any_moment_ends_in_75_or_a_whole_picture() {
    let (_keep, folder) = scene(600, 4);
    fs::write(folder.join("o.png"), "old").unwrap();
    let words = ["render", "scene.toml", "-o", "o.png", "--stats", "s.json"];
    let begun = Instant::now();
    run(&folder, &words).expect(0, &[]);
    let whole = begun.elapsed().as_micros() as u64;
    let mut random = Random(7);
    let (mut stopped, mut done) = (0, 0);
    for round in 0..80 {
        let _ = fs::remove_file(folder.join("s.json"));
        fs::write(folder.join("o.png"), "old").unwrap();
        let mut child = start(&folder, &words);
        listening(&mut child);
        std::thread::sleep(Duration::from_micros(random.below(whole)));
        signal(&child, if round % 2 == 0 { "-INT" } else { "-TERM" });
        let ended = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&ended.stderr);
        match ended.status.code() {
            Some(75) => stopped += 1,
            Some(0) => done += 1,
            other => panic!("round {round}: {other:?} {errors}"),
        }
        assert!(!errors.contains("panicked"), "{errors}");
        let picture = fs::read(folder.join("o.png")).unwrap();
        assert!(is_whole(&picture, b"old") && (ended.status.code() != Some(0) || picture != b"old"));
        let there = names(&folder);
        assert!(
            there.iter().all(|name| ["o.png", "s.json", "scene.toml", "t.obj"].contains(&&**name)),
            "{there:?}"
        );
    }
    println!("{stopped} stopped, {done} done");
    assert!(stopped > 0);
}

/// As `nohup` has it, and a shell that starts a program in the background.
#[test]
fn signals_that_were_to_be_ignored_are() {
    let (_keep, folder) = scene(600, 2000);
    let program = env!("CARGO_BIN_EXE_groundglass");
    for (ignored, sent) in [("HUP", "-HUP"), ("INT", "-INT")] {
        let begin = |samples: &str| {
            let line =
                format!("trap '' {ignored}; exec '{program}' render scene.toml --samples {samples} -o o.png");
            let mut command = Command::new("sh");
            command.args(["-c", &line]).current_dir(&folder).stdout(Stdio::null()).stderr(Stdio::piped());
            command.spawn().unwrap()
        };
        for (samples, sent, code) in [("200", sent, 0), ("20000", "-TERM", 75)] {
            let mut child = begin(samples);
            // The shell's own masks come first.
            while !fs::read_to_string(format!("/proc/{}/cmdline", child.id()))
                .is_ok_and(|words| words.contains("render\0"))
            {
                std::thread::sleep(Duration::from_millis(1));
            }
            std::thread::sleep(Duration::from_millis(30));
            kill(&child, sent);
            assert_eq!(child.wait().unwrap().code(), Some(code), "{ignored} is ignored, {sent} sent");
        }
    }
}

#[test]
fn a_default_folder_goes_with_an_interrupted_picture() {
    let (_keep, folder) = scene(600, 100_000);
    for name in ["-INT", "-TERM"] {
        let mut child = start(&folder, &["render", "scene.toml"]);
        listening(&mut child);
        while !folder.join("groundglass-out").exists() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        signal(&child, name);
        assert_eq!(child.wait().unwrap().code(), Some(75));
        assert_eq!(names(&folder), ["scene.toml", "t.obj"]);
    }
}

#[test]
fn a_stopped_study_says_what_it_keeps() {
    let (_keep, folder) = scene(600, 16);
    let table = folder.join("study/cost.json");
    let stop_when = |words: &[&str], ready: &dyn Fn() -> bool| {
        let mut child = start(&folder, words);
        listening(&mut child);
        let begun = Instant::now();
        while !ready() && begun.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        signal(&child, "-INT");
        let out = child.wait_with_output().unwrap();
        assert_eq!(out.status.code(), Some(75));
        String::from_utf8_lossy(&out.stderr).into_owned()
    };
    let has_a_row = || fs::read_to_string(&table).is_ok_and(|text| text.contains("true_rms"));
    let told = stop_when(&["cost", "scene.toml", "-o", "study", "--width", "64"], &has_a_row);
    assert!(told.contains("keeps what was measured"), "{told}");
    // Of another study the table stays as it is until this one has something.
    let before = fs::read(&table).unwrap();
    let told = stop_when(&["cost", "scene.toml", "-o", "study", "--width", "600"], &|| true);
    assert!(!told.contains("keeps what was measured"), "{told}");
    assert_eq!(fs::read(&table).unwrap(), before);
}

/// Nothing can be tidied up then; but what has the final name is whole.
#[test]
fn killed_outright_at_100_moments_what_has_the_name_is_whole() {
    let (_keep, folder) = scene(600, 2);
    let words = ["render", "scene.toml", "-o", "o.png"];
    let begun = Instant::now();
    run(&folder, &words).expect(0, &[]);
    let took = begun.elapsed().as_micros() as u64;
    let (mut random, mut old, mut new, mut left) = (Random(11), 0, 0, 0);
    for _ in 0..100 {
        fs::write(folder.join("o.png"), "old").unwrap();
        let mut child = start(&folder, &words);
        std::thread::sleep(Duration::from_micros(random.below(took + took / 4)));
        child.kill().unwrap();
        child.wait().unwrap();
        let picture = fs::read(folder.join("o.png")).unwrap();
        assert!(is_whole(&picture, b"old"), "{} bytes", picture.len());
        *(if picture == b"old" { &mut old } else { &mut new }) += 1;
        for name in names(&folder).iter().filter(|name| name.ends_with(".part")) {
            left += 1;
            fs::remove_file(folder.join(name)).unwrap();
        }
    }
    println!(
        "{old} times the old picture, {new} times the new one, both whole; {left} unfinished files left"
    );
    assert!(old > 0);
}

/// Inputs that are cut while they are read: an error or the whole, never a part taken for the whole.
#[test]
fn an_input_that_is_cut_meanwhile_is_3_or_2() {
    let (_keep, folder) = scene(16, 1);
    let vertices: String = (0..400_000).map(|i| format!("v {i} 0 0\n")).collect();
    let whole = format!("{vertices}f 1 2 3\nf 400000 2 3\n");
    let mut random = Random(3);
    let mut seen = std::collections::BTreeMap::new();
    for _ in 0..40 {
        fs::write(folder.join("t.obj"), &whole).unwrap();
        let child = start(&folder, &["check", "scene.toml"]);
        std::thread::sleep(Duration::from_micros(random.below(12_000)));
        let half = whole.len() as u64 / 2;
        fs::OpenOptions::new().write(true).open(folder.join("t.obj")).unwrap().set_len(half).unwrap();
        let done = child.wait_with_output().unwrap();
        let code = done.status.code();
        let errors = String::from_utf8_lossy(&done.stderr).into_owned();
        // 0: read before it was cut. 2: cut before it was read, and no face is left. 3: cut between.
        assert!(
            matches!(code, Some(0 | 2)) || (code == Some(3) && errors.contains("changed")),
            "{code:?} {errors}"
        );
        *seen.entry(code).or_insert(0) += 1;
    }
    println!("{seen:?}");
}
