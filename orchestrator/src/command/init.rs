//! `trackside init`: makes a suite from a folder of FMUs and reference results, and runs it once.

use std::path::PathBuf;

use clap::Args;
use diagnostics::Error;
use orchestrator::suite::creation::{self, FileState, SuiteCreation};

use super::print_text;
use super::run::parse_positive_seconds;
use super::test::{SuiteRun, run_suite};

/// Arguments of `trackside init`.
#[derive(Args)]
pub struct InitArguments {
    /// The folder with FMUs and, beside each, its reference results NAME_ref.csv, NAME_out.csv or NAME.csv, inputs NAME_in.csv and
    /// options NAME_ref.opt.
    folder: PathBuf,
    /// The folder for the scenarios. What is there already stays as it is.
    #[arg(long, value_name = "SUITE", default_value = "suite")]
    out: PathBuf,
    /// Only write the scenarios: no code of any FMU runs.
    #[arg(long)]
    no_run: bool,
    /// End each scenario that is not over after this time [s].
    #[arg(long, value_name = "SECONDS", default_value = "300")]
    limit: f64,
}

/// Makes the suite, prints what it is made of, and runs it.
///
/// # Errors
/// When no scenario can be made, or the suite cannot be written.
pub fn run_init_command(arguments: &InitArguments) -> Result<u8, Error> {
    let limit = parse_positive_seconds("--limit", Some(arguments.limit))?;
    let created = creation::create_suite(&arguments.folder, &arguments.out)?;
    print_text(&creation_lines(&created));
    let suite = arguments.out.display().to_string();
    let suite = if suite.contains(' ') { format!("\"{suite}\"") } else { suite };
    if created.cases.is_empty() {
        let fmus =
            if created.fmus == 1 { "its only FMU".to_owned() } else { format!("its {} FMUs", created.fmus) };
        let message = format!("no scenario could be made of {} and {fmus}", arguments.folder.display());
        return Err(Error::invalid_input(message).with_help("the reason stands beside each of them"));
    }
    let (first_runs, others): (Vec<_>, Vec<_>) = created.cases.iter().partition(|case| case.needs_first_run);
    if arguments.no_run {
        for case in &first_runs {
            print_text(&format!("`trackside run {} --bless` writes its baseline\n", case.path.display()));
        }
        print_text(&format!("`trackside test {suite}` runs the suite\n"));
        return Ok(0);
    }
    let mut worst = 0;
    for (cases, bless) in [(first_runs, true), (others, false)] {
        if !cases.is_empty() {
            let paths: Vec<_> = cases.iter().map(|case| case.path.clone()).collect();
            worst = worst.max(run_suite(&paths, &SuiteRun { bless, limit, ..SuiteRun::default() })?);
        }
    }
    print_text(&match worst {
        0 => format!("`trackside test {suite}` runs the suite\n"),
        _ => format!(
            "`trackside test {suite}` runs the suite; report.html in target/runs/NAME shows a deviation, and the tubes that would hold it\n"
        ),
    });
    Ok(worst)
}

/// A line for each scenario, with what was left out of it, and for each FMU without one.
fn creation_lines(created: &SuiteCreation) -> String {
    let mut text = String::new();
    for case in &created.cases {
        let state = match case.state {
            FileState::Written => "wrote",
            FileState::Same => "there",
            FileState::Kept => "kept ",
        };
        let kept = match case.state {
            FileState::Kept => "  (it was there with another text, and stays)",
            _ => "",
        };
        text += &format!("{state}  {}  {}{kept}\n", case.path.display(), case.summary);
        text += &case.notes.iter().map(|note| format!("       {note}\n")).collect::<String>();
    }
    text += &created.omissions.iter().map(|line| format!("no     {line}\n")).collect::<String>();
    let [fmus, scenarios] = [(created.fmus, "FMU"), (created.cases.len(), "scenario")]
        .map(|(count, word)| format!("{count} {word}{}", if count == 1 { "" } else { "s" }));
    text + &format!(
        "{fmus}, {scenarios}; `trackside run X.fmu --save-scenario FILE` begins one of an FMU without a reference\n"
    )
}
