//! The program `groundglass`: see [`cli`].

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
