//! Prints hashes of answers, figures and pictures: the same lines from every build on every platform.
//!
//! `cargo run --release --example same_bytes`

#[path = "../tests/common/hashes.rs"]
mod hashes;

fn main() -> groundglass::Result<()> {
    print!("{}", hashes::all(None, None)?);
    Ok(())
}
