//! The command line. In: arguments; out: files, text on standard output, errors on standard error, and an
//! exit code. One file per verb, and `book` of `diagram`; what verbs share: `input` (scenes), `figure_file` (figures),
//! `effects` and `values` (arguments), `output` and `limited` (whole files), `report` (errors and text), `progress`, `machine` (threads, memory,
//! clocks) and `interrupt`. Only the library's public API is used here.

mod book;
mod builtin;
mod check;
mod cost;
mod diagram;
mod effects;
mod explain;
mod figure_file;
mod input;
mod interrupt;
mod limited;
mod machine;
mod new;
mod notes;
mod optics;
mod optics_json;
mod optics_words;
mod output;
mod probe;
mod progress;
mod render;
mod render_files;
mod render_words;
mod replay;
mod report;
mod schema;
mod solve;
mod stability;
mod stats;
mod values;

use clap::{Parser, Subcommand};
use groundglass::error::Result;
use std::process::ExitCode;

/// View camera pictures, diagrams and answers from one exact model.
#[derive(Debug, Parser)]
#[command(name = "groundglass", version, max_term_width = 100, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 something is stale (--check); 2 the scene, figure or an asset is wrong, missing, refused \
or too large for memory, or has no solution; 3 a file cannot be read or written; 64 wrong usage; 75 interrupted.";

#[derive(Debug, Subcommand)]
enum Verb {
    /// Says what a camera does: planes, lines, depth of field, and the matrices of lens points
    ///
    /// What lies above, right of or in front of the lens does so along the camera's rail, wherever that looks; inclinations are from the
    /// world's horizontal.
    Optics(optics::Arguments),
    /// Finds the movements that make a plane sharp
    ///
    /// What lies above, right of or in front of the lens does so along the camera's rail, wherever that looks; inclinations are from the
    /// world's horizontal.
    Solve(solve::Arguments),
    /// Renders a scene to PNG or EXR
    Render(render::Arguments),
    /// Draws a figure, or a scene's camera, its planes and lines in section
    Diagram(diagram::Arguments),
    /// Loads a scene and its assets and says what is in them; renders nothing
    Check(check::Arguments),
    /// Says which effects are in a scene's picture, why, what each costs and what leaving it out changes
    Explain(explain::Arguments),
    /// Measures what accuracy costs in time on a scene, and writes charts, a table and a page
    Cost(cost::Arguments),
    /// Prints the JSON schema of the scene file
    Schema(schema::Arguments),
    /// Writes a first scene for an OBJ model
    New(new::Arguments),
    /// Draws how exact the optics are, beside textbook formulas
    Stability(stability::Arguments),
}

/// Parses the arguments of this process, runs the verb and reports its error, if any.
pub(crate) fn run() -> ExitCode {
    interrupt::watch();
    // A picture decoder that panics is caught, and its picture left out with a warning: nothing more to say.
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !groundglass::scene::is_decoding() {
            usual(panic);
        }
    }));
    let done = match Arguments::try_parse() {
        Ok(arguments) => dispatch(&arguments.verb),
        Err(error) => return report::usage(&error),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(report::STALE),
        Err(error) => report::failure(&error),
    }
}

/// Runs the verb; whether what it checked is up to date.
fn dispatch(verb: &Verb) -> Result<bool> {
    match verb {
        Verb::Diagram(arguments) => return diagram::run(arguments),
        Verb::Optics(arguments) => optics::run(arguments),
        Verb::Solve(arguments) => solve::run(arguments),
        Verb::Render(arguments) => render::run(arguments),
        Verb::Check(arguments) => check::run(arguments),
        Verb::Explain(arguments) => explain::run(arguments),
        Verb::Cost(arguments) => cost::run(arguments),
        Verb::Schema(arguments) => schema::run(arguments),
        Verb::New(arguments) => new::run(arguments),
        Verb::Stability(arguments) => stability::run(arguments),
    }
    .map(|()| true)
}
