//! The program `groundglass` as a user runs it: words in; exit code, output and errors out.

#![allow(dead_code, reason = "each test binary uses its part")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A camera without meshes; more tables can follow.
pub const CAMERA: &str = "[camera]
eye_m = [0.0, 1.6, 10.0]
look_at_m = [0.0, 1.6, 0.0]
focal_length_mm = 150.0
f_number = 5.6
film = \"4x5\"
extension_mm = 152.3
";

/// One triangle before that camera.
pub const TRIANGLE: &str = "v -1 0 0\nv 1 0 0\nv 0 3 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";

/// A small picture and one mesh.
pub const SMALL: &str = "[render]\nwidth = 16\nsamples = 2\n[[mesh]]\npath = \"t.obj\"\n";

/// What a run gave.
pub struct Run {
    pub code: i32,
    pub out: String,
    pub err: String,
    pub took: Duration,
}

impl Run {
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e} in {}; {}", self.out, self.err))
    }

    /// Asserts the exit code, no panic, and that every word is in the text of the errors.
    #[track_caller]
    pub fn expect(&self, code: i32, words: &[&str]) -> &Self {
        assert_eq!(self.code, code, "{}", self.err);
        assert!(!self.err.contains("panicked"), "{}", self.err);
        for word in words {
            assert!(self.err.contains(word), "`{word}` is not in: {}", self.err);
        }
        assert!(self.took < Duration::from_secs(5), "{:?}", self.took);
        self
    }
}

/// The program in `folder`, with these words.
pub fn command(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_groundglass"));
    command.args(words).current_dir(folder).env("NO_COLOR", "1").stdin(Stdio::null());
    command
}

/// The signal of this name; but TERM where INT is ignored, as by a shell that starts tests in the background: what it starts
/// ignores INT too.
pub fn heard(name: &'static str) -> &'static str {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    // INT is signal 2, HUP 1.
    match name {
        "-INT" if ignored & 2 != 0 => "-TERM",
        "-HUP" if ignored & 1 != 0 => "-TERM",
        _ => name,
    }
}

/// Runs it to its end.
pub fn run(folder: &Path, words: &[&str]) -> Run {
    finish(command(folder, words))
}

/// Runs a prepared command to its end.
pub fn finish(mut command: Command) -> Run {
    let begun = Instant::now();
    let Output { status, stdout, stderr } = command.output().expect("the program starts");
    Run {
        code: status.code().expect("ended by a signal"),
        out: String::from_utf8(stdout).expect("UTF-8"),
        err: String::from_utf8_lossy(&stderr).into_owned(),
        took: begun.elapsed(),
    }
}

/// A folder with `scene.toml` and `t.obj`.
pub fn folder(scene: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.toml"), scene).expect("written");
    std::fs::write(folder.path().join("t.obj"), TRIANGLE).expect("written");
    let path = folder.path().to_path_buf();
    (folder, path)
}

/// The names in a folder, sorted, hidden ones included.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A file or folder that lies beside the repository, or none.
pub fn shared(below: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(below);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared is missing");
    None
}
