//! What each kind of name may and may not reach on a disk, also when it changes between being found and being read.

use super::*;
use std::os::unix::fs::symlink;
use std::sync::atomic::{AtomicBool, Ordering};

type Done = std::result::Result<(), Box<dyn std::error::Error>>;

fn kind<T: std::fmt::Debug>(result: Result<T>) -> ErrorKind {
    result.expect_err("must be refused").kind()
}

#[test]
fn links_devices_folders_and_pipes_are_refused() -> Done {
    let top = tempfile::tempdir()?;
    let top = top.path().canonicalize()?;
    let inside = top.join("in");
    fs::create_dir_all(inside.join("sub"))?;
    fs::write(inside.join("a.png"), "a")?;
    fs::write(top.join("secret.png"), "s")?;
    symlink(top.join("secret.png"), inside.join("link.png"))?;
    symlink(&top, inside.join("way"))?;
    symlink("/dev/zero", inside.join("zero.png"))?;
    symlink("round", inside.join("round"))?;
    let _listener = std::os::unix::net::UnixListener::bind(inside.join("socket"))?;
    let made = std::process::Command::new("mkfifo").arg(inside.join("pipe")).status();
    let fences = [inside.clone()];

    let files = Files::new();
    assert!(files.asset(&inside, "sub\\..\\a.png", &fences).is_ok());
    for refused in [
        "link.png",
        "way/secret.png",
        "zero.png",
        "../secret.png",
        "..\\secret.png",
        "/dev/zero",
        "/etc/passwd",
        "sub",
        ".",
        "..",
        "",
        "socket",
        "none",
        "a.png/b",
        "file:///etc/passwd",
        "http://a/b.png",
        "\\\\host\\share\\a.png",
        "C:\\a.png",
        "a\0b",
        "\u{1b}[2J",
        "con:",
    ] {
        assert_eq!(kind(files.asset(&inside, refused, &fences)), ErrorKind::Invalid, "{refused:?}");
    }
    if made.is_ok_and(|status| status.success()) {
        assert_eq!(kind(files.asset(&inside, "pipe", &fences)), ErrorKind::Invalid);
        assert_eq!(kind(files.named(&inside, "pipe")), ErrorKind::Invalid);
    }
    assert!(kind(files.named(&inside, "round")) != ErrorKind::TooLarge, "a link to itself");
    assert!(files.named(&inside, &"x/".repeat(100_000)).is_err(), "a name longer than the system takes");
    assert!(files.named(&inside, "../secret.png").is_ok(), "a scene may climb");
    for refused in ["/dev/zero", "zero.png", "sub", "socket", "a\0b", "https://a/b"] {
        assert_eq!(kind(files.named(&inside, refused)), ErrorKind::Invalid, "{refused}");
    }

    let rooted = Files::under(&inside)?;
    assert!(rooted.named(&inside, "a.png").is_ok());
    for refused in ["../secret.png", "link.png", "way/secret.png"] {
        let error = rooted.named(&inside, refused).expect_err("outside the root");
        assert!(error.message().contains(refused) && error.kind() == ErrorKind::Invalid, "{error}");
    }
    assert_eq!(kind(rooted.argument(&top.join("secret.png"))), ErrorKind::Invalid);
    assert_eq!(kind(rooted.read(&top.join("secret.png"), 10)), ErrorKind::Invalid);
    assert!(Files::under(&inside.join("a.png")).is_err() && Files::under(&inside.join("none")).is_err());

    assert_eq!(kind(files.read(&inside.join("socket"), 10)), ErrorKind::Invalid);
    assert_eq!(kind(files.read(&inside.join("gone"), 10)), ErrorKind::Io);
    assert_eq!(files.read(&inside.join("a.png"), 10)?.as_ref(), b"a");
    assert_eq!(files.length(&inside.join("a.png"))?, 1);
    Ok(())
}

/// Names need not be UTF-8 to be read, and control characters in them are nothing special.
#[test]
fn odd_names_are_read() -> Done {
    use std::os::unix::ffi::OsStrExt;
    let top = tempfile::tempdir()?;
    let files = Files::new();
    for name in [&b"caf\xe9.png"[..], b"a\nb", b" ", b"-o", b"*", b"\xff\xfe"] {
        let path = top.path().join(std::ffi::OsStr::from_bytes(name));
        fs::write(&path, "x")?;
        let found = files.argument(&path)?;
        assert_eq!(files.read(&found, 1)?.as_ref(), b"x", "{name:?}");
    }
    Ok(())
}

#[cfg(target_os = "linux")]
#[test]
fn the_kernels_own_files_are_refused() -> Done {
    let files = Files::new();
    for path in ["/proc/self/environ", "/proc/self/status", "/proc/version", "/sys/kernel/notes"] {
        let Ok(found) = files.argument(Path::new(path)) else { continue };
        let error = files.read(&found, 1 << 20).expect_err(path);
        assert!(error.kind() == ErrorKind::Invalid && error.message().contains("kernel"), "{error}");
    }
    Ok(())
}

/// A folder with `sub/a.png` and `b.png`, and one outside with files of the same names that must not be read.
fn good_and_secret(top: &Path) -> std::io::Result<(PathBuf, PathBuf)> {
    let (inside, outside) = (top.join("in"), top.join("out"));
    for (folder, text) in [(&inside, "good"), (&outside, "secret")] {
        fs::create_dir_all(folder.join("sub"))?;
        fs::write(folder.join("sub/a.png"), text)?;
        fs::write(folder.join("b.png"), text)?;
    }
    Ok((inside, outside))
}

/// What was found is what is read: a link or pipe that takes its place in between, or a folder's on the way, is not
/// followed.
#[test]
fn what_is_swapped_after_it_was_found_is_not_followed() -> Done {
    let top = tempfile::tempdir()?;
    let top = top.path().canonicalize()?;
    let (inside, outside) = good_and_secret(&top)?;
    let files = Files::under(&inside)?;
    let found = files.asset(&inside, "sub/a.png", std::slice::from_ref(&inside))?;
    assert_eq!(files.read(&found, 9)?.as_ref(), b"good");

    fs::remove_file(inside.join("sub/a.png"))?;
    symlink(outside.join("sub/a.png"), inside.join("sub/a.png"))?;
    assert!(files.read(&found, 9).is_err(), "the file has become a link");
    fs::remove_file(inside.join("sub/a.png"))?;
    if std::process::Command::new("mkfifo").arg(inside.join("sub/a.png")).status().is_ok_and(|s| s.success())
    {
        assert!(files.read(&found, 9).is_err(), "the file has become a pipe");
        fs::remove_file(inside.join("sub/a.png"))?;
    }
    fs::remove_dir(inside.join("sub"))?;
    symlink(outside.join("sub"), inside.join("sub"))?;
    assert!(files.read(&found, 9).is_err(), "its folder has become a link");
    Ok(())
}

/// The same in a race: another thread swaps folder and link as fast as it can.
#[cfg(target_os = "linux")]
#[test]
fn a_race_between_check_and_open_is_never_won() -> Done {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    let top = tempfile::tempdir()?;
    let top = top.path().canonicalize()?;
    let (inside, outside) = good_and_secret(&top)?;
    symlink(outside.join("sub"), inside.join("link"))?;
    symlink(outside.join("b.png"), inside.join("link.png"))?;
    let swap =
        |a: &str, b: &str| renameat_with(CWD, inside.join(a), CWD, inside.join(b), RenameFlags::EXCHANGE);
    if swap("sub", "link").and_then(|()| swap("sub", "link")).is_err() {
        println!("skipped: this file system cannot exchange two names");
        return Ok(());
    }
    let stop = AtomicBool::new(false);
    let (mut good, mut refused) = (0, 0);
    std::thread::scope(|threads| {
        threads.spawn(|| {
            while !stop.load(Ordering::Relaxed) {
                let _ = swap("sub", "link").and_then(|()| swap("b.png", "link.png"));
            }
        });
        let files = Files::new();
        for name in ["sub/a.png", "b.png"].iter().cycle().take(20_000) {
            let found = files.asset(&inside, name, std::slice::from_ref(&inside));
            match found.and_then(|found| files.read(&found, 9).map(|bytes| bytes.into_owned())) {
                Ok(bytes) => {
                    assert_eq!(bytes, b"good", "{name}");
                    good += 1;
                }
                Err(_) => refused += 1,
            }
        }
        stop.store(true, Ordering::Relaxed);
    });
    println!("{good} read, {refused} refused, none from outside");
    assert!(good > 0 && refused > 0);
    Ok(())
}

/// Whole or not at all: never a part of a file that was cut or grew meanwhile.
#[test]
fn a_file_that_changes_while_it_is_read_is_an_error() -> Done {
    const LENGTH: u64 = 64 << 20;
    let top = tempfile::tempdir()?;
    let path = top.path().canonicalize()?.join("a.obj");
    let files = Files::new();
    let (mut whole, mut changed) = (0, 0);
    for step in 0..24 {
        // Sparse: quick to make, as slow to read as any.
        let file = fs::File::create(&path)?;
        file.set_len(LENGTH)?;
        std::thread::scope(|threads| {
            threads.spawn(|| {
                std::thread::sleep(std::time::Duration::from_millis(step));
                file.set_len(if step % 2 == 0 { LENGTH / 2 } else { 2 * LENGTH })
            });
            match files.read(&path, LENGTH) {
                Ok(bytes) => {
                    assert!([LENGTH, LENGTH / 2].contains(&(bytes.len() as u64)), "{}", bytes.len());
                    whole += 1;
                }
                Err(error) => {
                    let good = [ErrorKind::Io, ErrorKind::TooLarge].contains(&error.kind());
                    assert!(good, "{error}");
                    changed += usize::from(error.message().contains("changed"));
                }
            }
        });
    }
    println!("{whole} whole, {changed} changed");
    assert!(changed > 0);
    Ok(())
}
