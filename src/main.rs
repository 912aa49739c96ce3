//! The program `groundglass`: see [`cli`].

#[cfg(not(target_family = "wasm"))]
mod cli;

#[cfg(not(target_family = "wasm"))]
fn main() -> std::process::ExitCode {
    cli::run()
}

/// There is no command line in a browser; the library is what runs there.
#[cfg(target_family = "wasm")]
fn main() {}
