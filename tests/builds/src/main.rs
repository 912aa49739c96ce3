//! The hashes of `tests/common/hashes.rs` from a debug build of the library and nothing else.

#[path = "../../common/hashes.rs"]
mod hashes;

fn main() -> groundglass::Result<()> {
    print!("{}", hashes::all(None, None)?);
    Ok(())
}
