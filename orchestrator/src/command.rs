//! The commands of the program, a file for each; `CliCommand` lists them.

mod bless;
mod conform;
mod convert;
mod doctor;
mod examples;
mod explain;
mod init;
mod inspect;
mod isolated;
mod lap;
mod pack;
mod progress;
mod recover;
mod replay;
mod run;
mod schema;
mod session;
mod standalone;
mod submit;
mod supervised;
mod sweep;
mod test;
mod tire;
mod track;
mod view;
mod why;

use std::io::{ErrorKind, Write as _};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use clap::Subcommand;
use diagnostics::{
    Error, PrintableError, escape_for_terminal, is_terminal_control, print_raw_to_stderr, print_to_stderr,
};

/// A command with its arguments.
#[derive(Subcommand)]
pub enum CliCommand {
    /// Run scenarios; exit code 0 when all checks pass, 1 when one fails, 2 when the input is wrong, 3
    /// when an FMU fails, 4 when an analysis says that its result is doubtful.
    Run(run::RunArguments),
    /// Run variants of a scenario, as its [sweep] says; exit code 0 when enough of them pass, 1 when a check fails, 2 when the input is
    /// wrong, 3 when an FMU fails.
    Sweep(sweep::SweepArguments),
    /// Run a variant of a sweep again, with everything recorded.
    Replay(replay::ReplayArguments),
    /// Run scenarios as tests, several at a time, a line for each.
    Test(test::TestArguments),
    /// Take a finished run as right: its recording becomes its baselines, or with --tube the scenario gets tubes that hold it.
    Bless(bless::BlessArguments),
    /// Make scenarios from a folder of FMUs and their reference results, and run them once; exit code 0 when all pass, 1 when one deviates or
    /// fails, 2 when no scenario can be made.
    Init(init::InitArguments),
    /// Build FMU packages of the workspace and pack them, or pack a scenario as a system of SSP or as one FMU.
    Pack(pack::PackArguments),
    /// Print the description of an FMU, or the channels of a recording or a log.
    Inspect(inspect::InspectArguments),
    /// Judge an FMU by the rules of its version of FMI, a line for each; exit code 0 when it breaks none, 1 when it
    /// breaks one, 2 when it cannot be opened.
    Conform(conform::ConformArguments),
    /// Look for errors in the log of a drive: units, signs, clocks, offsets; exit code 0 when nothing certain or likely is
    /// wrong, 1 when something is, 2 when the input is wrong.
    Doctor(Box<doctor::DoctorArguments>),
    /// Open a run in the Rerun viewer, or two runs over each other.
    View(view::ViewArguments),
    /// Explain why two runs differ: what is different, what it did first, and which difference is the cause; exit code 0 when no value
    /// differs, 1 when one does, 2 when the input is wrong, 3 when an FMU fails.
    Why(why::WhyArguments),
    /// Write the signals of a recording as a table, Parquet or CSV, as MDF 4, or for MoTeC i2.
    Convert(convert::ConvertArguments),
    /// Look at a tire: key figures and a page with curves of a `.tir` file, or of two side by side; convert its axes.
    Tire(tire::TireArguments),
    /// Find the fastest lap of a car on a track, with what each parameter is worth, and an interval from what is not known; exit code 4 when
    /// the search does not converge.
    Lap(Box<lap::LapArguments>),
    /// Make a track of the positions in a log: its laps, and the mean line of them.
    Track(track::TrackArguments),
    /// Make a valid recording of one that a killed run left.
    Recover(recover::RecoverArguments),
    /// Print the JSON schema of scenario files, for editors.
    Schema(schema::SchemaArguments),
    /// List the scenarios that came with the program, or copy one with all that it needs.
    Examples(examples::ExamplesArguments),
    /// Explain a key of scenario files.
    Explain(explain::ExplainArguments),
    /// For runs: run an FMU in a process of its own.
    #[command(hide = true)]
    Isolated(isolated::IsolatedArguments),
    /// For sessions of Python: prepare a scenario that another program steps.
    #[command(hide = true)]
    Session(session::SessionArguments),
}

impl CliCommand {
    /// Runs the command; prints an error and returns the exit code.
    pub fn run(&self) -> u8 {
        let result = match self {
            CliCommand::Run(arguments) => run::run_scenarios(arguments),
            CliCommand::Sweep(arguments) => sweep::run_sweep_command(arguments),
            CliCommand::Replay(arguments) => replay::run_replay_command(arguments),
            CliCommand::Test(arguments) => test::run_test_command(arguments),
            CliCommand::Bless(arguments) => bless::run_bless_command(arguments),
            CliCommand::Init(arguments) => init::run_init_command(arguments),
            CliCommand::Pack(arguments) => pack::run_pack_command(arguments),
            CliCommand::Inspect(arguments) => inspect::run_inspect_command(arguments),
            CliCommand::Conform(arguments) => conform::run_conform_command(arguments),
            CliCommand::Doctor(arguments) => doctor::run_doctor_command(arguments),
            CliCommand::View(arguments) => view::run_view_command(arguments),
            CliCommand::Why(arguments) => why::run_why_command(arguments),
            CliCommand::Convert(arguments) => convert::run_convert_command(arguments),
            CliCommand::Tire(arguments) => tire::run_tire_command(arguments),
            CliCommand::Lap(arguments) => lap::run_lap_command(arguments),
            CliCommand::Track(arguments) => track::run_track_command(arguments),
            CliCommand::Recover(arguments) => recover::run_recover_command(arguments),
            CliCommand::Schema(arguments) => schema::run_schema_command(arguments),
            CliCommand::Examples(arguments) => examples::run_examples_command(arguments),
            CliCommand::Explain(arguments) => explain::run_explain_command(arguments),
            CliCommand::Isolated(arguments) => isolated::run_isolated_command(arguments),
            CliCommand::Session(arguments) => session::run_session_command(arguments),
        };
        let code = result.unwrap_or_else(print_error);
        // Whoever asked for it must not take half of it for all.
        if code == 0 && UNPRINTED.load(Relaxed) { UNWRITTEN } else { code }
    }
}

/// Mistakes that are printed; the others are counted.
const PRINTED: usize = 20;

/// Prints an error, or each of several, and returns the exit code.
fn print_error(error: Error) -> u8 {
    let code = error.exit_code();
    print_single_errors(&error.into_single_errors());
    code
}

fn print_single_errors(errors: &[Error]) {
    let (count, more) = (errors.len(), errors.len().saturating_sub(PRINTED));
    for error in errors.iter().take(PRINTED) {
        print_raw_to_stderr(&format!("{:?}", miette::Report::new(PrintableError::from_error(error))));
    }
    match (count, more) {
        (..=1, _) => {}
        (_, 0) => print_to_stderr(&format!("{count} mistakes")),
        _ => print_to_stderr(&format!("and {more} more, {count} mistakes")),
    }
}

/// Whether standard output did not take something.
static UNPRINTED: AtomicBool = AtomicBool::new(false);
/// The exit code when a result could not be written.
const UNWRITTEN: u8 = 2;

/// Prints to standard output; a reader that has gone away has seen enough. Texts of others are shown, not obeyed.
fn print_text(text: &str) {
    write_to_stdout(&escape_for_terminal(text));
}

fn write_to_stdout(text: &str) {
    let mut output = std::io::stdout();
    let written = output.write_all(text.as_bytes()).and_then(|()| output.flush());
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe && !UNPRINTED.swap(true, Relaxed) => {
            print_to_stderr(&format!("standard output: could not write: {error}"));
        }
        _ => {}
    }
}

/// Prints JSON, in which texts of others are escaped as JSON has it.
fn print_json(value: &serde_json::Value) {
    let mut text = String::new();
    for character in format!("{value:#}\n").chars() {
        match is_terminal_control(character) {
            // All of these have four digits.
            true => text += &format!("\\u{:04x}", u32::from(character)),
            false => text.push(character),
        }
    }
    write_to_stdout(&text);
}

fn current_program_path() -> Result<PathBuf, Error> {
    std::env::current_exe()
        .map_err(|error| Error::invalid_input(format!("cannot find this program: {error}")))
}

/// Says how this program puts the commands of scripts into a sandbox.
pub fn offer_sandbox() {
    if let Ok(program) = guest_program_path() {
        isolation::set_sandbox_entrance(program, &["isolated", "0", "--enter"]);
    }
}

/// This program, for processes of FMUs: the very file that runs, even when a build has put another one in its place.
fn guest_program_path() -> Result<PathBuf, Error> {
    match cfg!(target_os = "linux") {
        true => Ok(PathBuf::from("/proc/self/exe")),
        false => current_program_path(),
    }
}
