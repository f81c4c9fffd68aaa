//! Shows the progress of runs and builds: a line that changes on a terminal, plain lines elsewhere.

use std::io::IsTerminal as _;
use std::path::Path;
use std::time::Duration;

use diagnostics::{Error, escape_for_terminal};
use indicatif::{ProgressBar, ProgressStyle};
use orchestrator::package::BuildProgress;
use orchestrator::{CompletedRun, ProgressEvent, RunContext, RunOptions};

/// Runs a scenario with a progress bar; `show` shows the events that are not about a build.
///
/// # Errors
/// When the run fails.
pub fn run_with_progress_bar(
    scenario: &Path,
    options: &RunOptions,
    context: &mut RunContext,
    show: impl Fn(&ProgressEvent, &ProgressBar),
) -> Result<CompletedRun, Error> {
    let (bar, mut building) = (progress_bar(scenario), BuildLine::default());
    let outcome = orchestrator::run_scenario(scenario, options, context, &mut |event| match event {
        ProgressEvent::Building(progress) => bar.suspend(|| building.show(&progress)),
        event => show(&event, &bar),
    });
    bar.finish_and_clear();
    outcome
}

/// A bar on a terminal, nothing in a pipe.
fn progress_bar(scenario: &Path) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} % {eta:>4}");
    let bar = ProgressBar::new(1).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let name = scenario.file_stem().unwrap_or_default().to_string_lossy();
    bar.set_message(escape_for_terminal(&name).into_owned());
    bar.tick();
    bar
}

/// The line that says what cargo builds.
#[derive(Default)]
pub struct BuildLine {
    /// The line on a terminal.
    spinner: Option<ProgressBar>,
    announced: bool,
}

impl BuildLine {
    /// Shows how far the build is.
    pub fn show(&mut self, progress: &BuildProgress) {
        if std::io::stderr().is_terminal() {
            self.draw_spinner(progress);
        } else if let Some(line) = self.begin_or_end_line(progress) {
            super::print_to_stderr(&line);
        }
    }

    fn draw_spinner(&mut self, progress: &BuildProgress) {
        match progress {
            BuildProgress::Building { packages, elapsed, activity } => {
                let spinner = self.spinner.get_or_insert_with(build_spinner);
                let time = format_seconds(*elapsed);
                spinner.set_message(format!("building {packages} ... ({time}) {activity}"));
                spinner.tick();
            }
            BuildProgress::Done { .. } => {
                if let Some(spinner) = self.spinner.take() {
                    spinner.finish_and_clear();
                }
            }
        }
    }

    /// A plain line for the begin and for the end of a build.
    fn begin_or_end_line(&mut self, progress: &BuildProgress) -> Option<String> {
        match progress {
            BuildProgress::Building { packages, .. } => {
                (!std::mem::replace(&mut self.announced, true)).then(|| format!("building {packages} ..."))
            }
            BuildProgress::Done { packages, elapsed, succeeded } => {
                self.announced = false;
                let time = format_seconds(*elapsed);
                Some(match succeeded {
                    true => format!("built {packages} in {time}"),
                    false => format!("{packages} did not build, after {time}"),
                })
            }
        }
    }
}

/// `{wide_msg}` cuts the text off at the edge of the terminal.
fn build_spinner() -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {wide_msg}");
    ProgressBar::new_spinner().with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
}

fn format_seconds(time: Duration) -> String {
    format!("{} s", time.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_terminal_a_build_takes_two_lines() {
        let mut line = BuildLine::default();
        let packages = "plant-fmu, controller";
        let building = |seconds, activity| BuildProgress::Building {
            packages,
            elapsed: Duration::from_secs(seconds),
            activity,
        };
        let done = |succeeded| BuildProgress::Done { packages, elapsed: Duration::from_secs(31), succeeded };
        let begin = Some("building plant-fmu, controller ...".to_owned());
        assert_eq!(line.begin_or_end_line(&building(0, "Compiling nalgebra v0.35.0")), begin);
        assert_eq!(line.begin_or_end_line(&building(12, "Compiling vehicle v0.1.0")), None);
        let end = line.begin_or_end_line(&done(true));
        assert_eq!(end.as_deref(), Some("built plant-fmu, controller in 31 s"));
        let end = line.begin_or_end_line(&done(false));
        assert_eq!(end.as_deref(), Some("plant-fmu, controller did not build, after 31 s"));
    }
}
