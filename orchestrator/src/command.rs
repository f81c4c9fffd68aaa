//! The commands of the program, a file for each; `Command` lists them.

mod conform;
mod convert;
mod doctor;
mod explain;
mod inspect;
mod isolated;
mod pack;
mod progress;
mod recover;
mod replay;
mod run;
mod schema;
mod standalone;
mod submit;
mod supervised;
mod sweep;
mod test;
mod tire;
mod view;

use std::io::{ErrorKind, Write as _};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use clap::Subcommand;
use diagnostics::{Error, PrintableError, is_obeyed, shown};

/// A command with its arguments.
#[derive(Subcommand)]
pub enum Command {
    /// Run scenarios; exit code 0 when all checks pass, 1 when one fails, 2 when the input is wrong, 3
    /// when an FMU fails.
    Run(run::Arguments),
    /// Run variants of a scenario, as its [sweep] says; exit code 0 when enough of them pass, 1 when a check fails, 2 when the input is
    /// wrong, 3 when an FMU fails.
    Sweep(sweep::Arguments),
    /// Run a variant of a sweep again, with everything recorded.
    Replay(replay::Arguments),
    /// Run scenarios as tests, several at a time, a line for each.
    Test(test::Arguments),
    /// Build FMU packages of the workspace and pack them, or pack a scenario as a system of SSP or as one FMU.
    Pack(pack::Arguments),
    /// Print the description of an FMU, or the channels of a recording or a log.
    Inspect(inspect::Arguments),
    /// Judge an FMU by the rules of its version of FMI, a line for each; exit code 0 when it breaks none, 1 when it
    /// breaks one, 2 when it cannot be opened.
    Conform(conform::Arguments),
    /// Look for errors in the log of a drive: units, signs, clocks, offsets; exit code 0 when nothing certain or likely is
    /// wrong, 1 when something is, 2 when the input is wrong.
    Doctor(Box<doctor::Arguments>),
    /// Open a run in the Rerun viewer, or two runs over each other.
    View(view::Arguments),
    /// Write the signals of a recording as a table, Parquet or CSV, as MDF 4, or for MoTeC i2.
    Convert(convert::Arguments),
    /// Look at a tire: key figures and a page with curves of a `.tir` file, or of two side by side; convert its axes.
    Tire(tire::Arguments),
    /// Make a valid recording of one that a killed run left.
    Recover(recover::Arguments),
    /// Print the JSON schema of scenario files, for editors.
    Schema(schema::Arguments),
    /// Explain a key of scenario files.
    Explain(explain::Arguments),
    /// For runs: run an FMU in a process of its own.
    #[command(hide = true)]
    Isolated(isolated::Arguments),
}

impl Command {
    /// Runs the command; prints an error and returns the exit code.
    pub fn run(&self) -> u8 {
        let result = match self {
            Command::Run(arguments) => run::run(arguments),
            Command::Sweep(arguments) => sweep::run(arguments),
            Command::Replay(arguments) => replay::run(arguments),
            Command::Test(arguments) => test::run(arguments),
            Command::Pack(arguments) => pack::run(arguments),
            Command::Inspect(arguments) => inspect::run(arguments),
            Command::Conform(arguments) => conform::run(arguments),
            Command::Doctor(arguments) => doctor::run(arguments),
            Command::View(arguments) => view::run(arguments),
            Command::Convert(arguments) => convert::run(arguments),
            Command::Tire(arguments) => tire::run(arguments),
            Command::Recover(arguments) => recover::run(arguments),
            Command::Schema(arguments) => schema::run(arguments),
            Command::Explain(arguments) => explain::run(arguments),
            Command::Isolated(arguments) => isolated::run(arguments),
        };
        let code = result.unwrap_or_else(report_error);
        // Whoever asked for it must not take half of it for all.
        if code == 0 && UNPRINTED.load(Relaxed) { UNWRITTEN } else { code }
    }
}

/// Mistakes that are printed; the others are counted.
const PRINTED: usize = 20;

/// Prints an error, or each of several, and returns the exit code.
fn report_error(error: Error) -> u8 {
    let code = error.exit_code();
    let errors = error.split();
    let (count, more) = (errors.len(), errors.len().saturating_sub(PRINTED));
    for error in errors.into_iter().take(PRINTED) {
        eprintln!("{:?}", miette::Report::new(PrintableError::of(&error)));
    }
    match (count, more) {
        (..=1, _) => {}
        (_, 0) => eprintln!("{count} mistakes"),
        _ => eprintln!("and {more} more, {count} mistakes"),
    }
    code
}

/// Whether standard output did not take something.
static UNPRINTED: AtomicBool = AtomicBool::new(false);
/// The exit code when a result could not be written.
const UNWRITTEN: u8 = 2;

/// Prints to standard output; a reader that has gone away has seen enough. Texts of others are shown, not obeyed.
fn print(text: &str) {
    put(&shown(text));
}

fn put(text: &str) {
    let mut output = std::io::stdout();
    let written = output.write_all(text.as_bytes()).and_then(|()| output.flush());
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe && !UNPRINTED.swap(true, Relaxed) => {
            tell(&format!("standard output: could not write: {error}"));
        }
        _ => {}
    }
}

/// Prints JSON, in which texts of others are escaped as JSON has it.
fn print_json(value: &serde_json::Value) {
    let mut text = String::new();
    for character in format!("{value:#}\n").chars() {
        match is_obeyed(character) {
            // All of these have four digits.
            true => text += &format!("\\u{:04x}", u32::from(character)),
            false => text.push(character),
        }
    }
    put(&text);
}

/// Prints a line to standard error. Texts of others are shown, not obeyed.
fn tell(line: &str) {
    eprintln!("{}", shown(line));
}

fn this_program() -> Result<PathBuf, Error> {
    std::env::current_exe()
        .map_err(|error| Error::input(format!("cannot find this program: {error}")))
}
