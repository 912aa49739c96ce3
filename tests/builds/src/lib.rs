//! The hashes of `tests/common/hashes.rs`, for WebAssembly: `hashes()` gives the address of the text, `length()` its
//! length.

#[path = "../../common/hashes.rs"]
mod hashes;

use std::sync::OnceLock;

static TEXT: OnceLock<String> = OnceLock::new();

fn text() -> &'static str {
    TEXT.get_or_init(|| hashes::all(None, None).unwrap_or_else(|error| format!("error: {error}\n")))
}

#[unsafe(no_mangle)]
pub extern "C" fn hashes() -> *const u8 {
    text().as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn length() -> usize {
    text().len()
}
