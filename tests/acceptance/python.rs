//! Runs Python scripts in a virtual environment with other people's FMI, MCAP and Rerun programs, made once.

use std::ffi::OsStr;
use std::fs::File;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use super::harness::{Ended, ROOT};

/// The contents of the environment: the viewer's version is that of the library, those of the FMI tools are the
/// ones whose verdict we know. Ecos needs a library that `tbb` brings.
const PACKAGES: &[&str] = &[
    "fmpy==0.3.32",
    "libcosimpy==0.0.6",
    "ecospy==0.7.2",
    "tbb",
    "pythonfmu==0.7.0",
    "mcap",
    "mcap-protobuf-support",
    "mcap-ros2-support==0.6.0",
    "rosbags==0.11.9",
    "rerun-sdk==0.36.3",
    "numpy",
    "pandas",
    "scipy",
    "casadi==3.8.2",
    "polars",
    "pyarrow",
    "tombi==1.9.6",
    "hyperqueue==0.27.0",
    "playwright==1.65.2",
];

/// A virtual environment.
pub struct Python(PathBuf);

impl Python {
    /// Runs a script of `tests/acceptance/python` and insists on its success.
    #[track_caller]
    pub fn run<A: AsRef<OsStr>>(&self, script: &str, arguments: &[A]) -> Ended {
        let script = Path::new(ROOT).join("tests/acceptance/python").join(script);
        let mut python = Command::new(self.0.join("bin/python"));
        python.env("LD_LIBRARY_PATH", self.0.join("lib"));
        // The package of this repository, with the program of this build.
        python.env("PYTHONPATH", Path::new(ROOT).join("python"));
        python.env("TRACKSIDE_PROGRAM", env!("CARGO_BIN_EXE_trackside"));
        let output = python.arg("-B").arg(script).args(arguments).output().expect("Python");
        Ended::of(output).expect(0)
    }

    /// The words of a shell that run a script of `tests/acceptance/python`.
    pub fn script(&self, script: &str) -> String {
        let script = Path::new(ROOT).join("tests/acceptance/python").join(script);
        format!("'{}' -B '{}'", self.0.join("bin/python").display(), script.display())
    }

    /// The interpreter.
    pub fn program(&self) -> PathBuf {
        self.0.join("bin/python")
    }

    /// Python as a library, which FMUs of pythonfmu expect in the process; some Pythons have none.
    pub fn library(&self) -> String {
        let script = "import pathlib, sysconfig; at = sysconfig.get_config_var; \
                      print(pathlib.Path(at('LIBDIR') or '', at('LDLIBRARY') or ''))";
        let output = Command::new(self.0.join("bin/python")).args(["-c", script]).output();
        Ended::of(output.expect("Python")).expect(0).stdout.trim().to_owned()
    }

    /// Makes FMUs by pythonfmu: Python's library, an FMU with variables of all types, and one that integrates its
    /// input.
    pub fn fmus(&self, folder: &Path) -> [String; 3] {
        let made = self.run("make_fmu.py", &[folder]).stdout;
        let lines: Vec<_> = made.lines().map(str::to_owned).collect();
        lines.try_into().expect("a library and two archives")
    }

    /// The linter that editors use for TOML.
    pub fn tombi(&self) -> Command {
        Command::new(self.0.join("bin/tombi"))
    }

    /// The viewer's own program; what pip puts on the path wraps it.
    #[cfg(feature = "rerun")]
    pub fn rerun(&self) -> Command {
        let script = "import rerun_sdk; print(*rerun_sdk.__path__)";
        let output = Command::new(self.0.join("bin/python")).args(["-c", script]).output();
        let folder = Ended::of(output.expect("Python")).expect(0).stdout;
        Command::new(Path::new(folder.trim()).join("rerun_cli/rerun"))
    }
}

/// The environment.
///
/// # Panics
/// With the reason where it cannot be made.
#[track_caller]
pub fn python() -> &'static Python {
    environment().as_ref().unwrap_or_else(|reason| panic!("{reason}"))
}

/// The environment, made once, or the reason why it cannot be made.
pub fn environment() -> &'static Result<Python, String> {
    static MADE: OnceLock<Result<Python, String>> = OnceLock::new();
    MADE.get_or_init(make)
}

/// Makes the environment next to the build unless it exists. The last file marks it as complete.
fn make() -> Result<Python, String> {
    let mut hash = DefaultHasher::new();
    PACKAGES.hash(&mut hash);
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap_or(Path::new("."));
    let folder = target.join(format!("venv-{:016x}", hash.finish()));
    let complete = folder.join("complete");
    let lock = File::create(folder.with_extension("lock")).map_err(|error| error.to_string())?;
    lock.lock().map_err(|error| error.to_string())?;
    if !complete.exists() {
        let _ = std::fs::remove_dir_all(&folder);
        command(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
        let mut pip = Command::new(folder.join("bin/python"));
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
        command(pip.args(PACKAGES))?;
        File::create(&complete).map_err(|error| error.to_string())?;
    }
    Ok(Python(folder))
}

fn command(command: &mut Command) -> Result<(), String> {
    let what = command.get_args().map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ");
    let output = command.output().map_err(|error| format!("no Python: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let stderr = String::from_utf8_lossy(&output.stderr);
    let last = stderr.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no message");
    Err(format!("python {what}: {last}"))
}
