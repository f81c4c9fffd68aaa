//! Runs every file of `scenarios/` and `scenarios/manoeuvres/` as a test of its name, with the program as a user starts it.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use libtest_mimic::{Arguments, Failed, Trial};
use orchestrator::suite;
use scenario::Scenario;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    // Paths in messages are short from the workspace on.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).expect("the workspace");
    let folders = ["scenarios".into(), "scenarios/manoeuvres".into()];
    let files = suite::find_scenario_files(&folders).expect("there are scenarios");
    libtest_mimic::run(&arguments, files.into_iter().map(trial).collect()).exit_code()
}

/// A scenario whose data is not there is ignored, but for `--include-ignored`, with which its run fails and says which file is missing.
fn trial(file: PathBuf) -> Trial {
    let below = file.strip_prefix("scenarios").unwrap_or(&file);
    let name = below.with_extension("").to_string_lossy().into_owned();
    let absent = Scenario::read(&file).ok().and_then(|scenario| suite::missing_data_file(&scenario));
    let trial = Trial::test(name.as_str(), {
        let name = name.clone();
        move || run(&file, &name)
    });
    match absent {
        Some(absent) => trial.with_kind(format!("needs {}", absent.display())).with_ignored_flag(true),
        None => trial,
    }
}

fn run(file: &Path, name: &str) -> Result<(), Failed> {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scenarios").join(name);
    let mut trackside = Command::new(env!("CARGO_BIN_EXE_trackside"));
    trackside.arg("run").arg(file).arg("--out").arg(out).stdin(Stdio::null());
    let output = trackside.output()?;
    if output.status.success() {
        return Ok(());
    }
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).trim_end().to_owned());
    Err(format!("{}\n{stdout}\n{stderr}", output.status).into())
}
