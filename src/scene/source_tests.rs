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
