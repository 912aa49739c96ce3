//! What each kind of name may and may not reach.

use super::*;

fn kind<T: std::fmt::Debug>(result: Result<T>) -> ErrorKind {
    result.expect_err("must be refused").kind()
}

#[test]
fn memory_follows_the_same_rules() {
    let files =
        Memory::new().with("a/s.toml", &b"s"[..]).with("m/t.obj", &b"t"[..]).with("m/x/y.png", &b"y"[..]);
    let folder = Path::new("a");
    assert_eq!(files.named(folder, "../m/t.obj").ok(), Some(PathBuf::from("m/t.obj")));
    for refused in ["/m/t.obj", "C:\\t.obj", "../../t.obj", "t.obj", "../m", "", "http://a/b"] {
        assert_eq!(kind(files.named(folder, refused)), ErrorKind::Invalid, "{refused}");
    }
    let m = Path::new("m");
    let fences = [PathBuf::from("m"), PathBuf::from("a")];
    assert_eq!(files.asset(m, "x\\y.png", &fences).ok(), Some(PathBuf::from("m/x/y.png")));
    assert!(files.asset(m, "../a/s.toml", &fences).is_ok());
    assert_eq!(kind(files.asset(m, "../a/s.toml", &fences[..1])), ErrorKind::Invalid);
    assert_eq!(kind(files.read(Path::new("m/t.obj"), 0)), ErrorKind::TooLarge);
}

#[cfg(unix)]
#[test]
fn links_devices_folders_and_pipes_are_refused() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let top = tempfile::tempdir()?;
    let inside = top.path().join("in");
    fs::create_dir_all(inside.join("sub"))?;
    fs::write(inside.join("a.png"), "a")?;
    fs::write(top.path().join("secret.png"), "s")?;
    std::os::unix::fs::symlink(top.path().join("secret.png"), inside.join("link.png"))?;
    std::os::unix::fs::symlink("/dev/zero", inside.join("zero.png"))?;
    let _listener = std::os::unix::net::UnixListener::bind(inside.join("socket"))?;
    let fences = [inside.clone()];

    let files = Files::new();
    assert!(files.asset(&inside, "sub\\..\\a.png", &fences).is_ok());
    for refused in
        ["link.png", "zero.png", "../secret.png", "/dev/zero", "sub", ".", "socket", "none", "a.png/b"]
    {
        assert_eq!(kind(files.asset(&inside, refused, &fences)), ErrorKind::Invalid, "{refused}");
    }
    assert!(files.named(&inside, "../secret.png").is_ok(), "a scene may climb");
    for refused in ["/dev/zero", "zero.png", "sub", "socket", "a\0b"] {
        assert_eq!(kind(files.named(&inside, refused)), ErrorKind::Invalid, "{refused}");
    }

    let rooted = Files::under(&inside)?;
    assert!(rooted.named(&inside, "a.png").is_ok());
    for refused in ["../secret.png", "link.png"] {
        let error = rooted.named(&inside, refused).expect_err("outside the root");
        assert!(error.message().contains(refused) && error.kind() == ErrorKind::Invalid, "{error}");
    }
    assert_eq!(kind(rooted.argument(&top.path().join("secret.png"))), ErrorKind::Invalid);

    assert_eq!(kind(files.read(&inside.join("socket"), 10)), ErrorKind::Invalid);
    assert_eq!(kind(files.read(&inside.join("gone"), 10)), ErrorKind::Io);
    assert_eq!(files.read(&inside.join("a.png"), 10)?.as_ref(), b"a");
    Ok(())
}
