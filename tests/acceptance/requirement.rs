//! The requirements of tests besides the workspace, and the reasons for their absence.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use super::harness::ROOT;
#[cfg(feature = "rerun")]
use super::live;
use super::python;

/// Something that a test needs besides the workspace and its toolchain.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Requirement {
    /// A C compiler, for FMUs and plugins that misbehave.
    Compiler,
    /// A virtual environment with other people's programs.
    Python,
    /// Other masters of FMI, in that environment.
    Masters,
    /// Python as a library, which FMUs of pythonfmu expect in the process.
    PythonLibrary,
    /// The Rerun viewer of that environment, which wants graphics drivers even without a window.
    #[cfg(feature = "rerun")]
    Viewer,
    /// Chromium, and in that environment what drives it.
    Browser,
    /// valgrind.
    Valgrind,
    /// The compiler and its options that the golden counts of instructions hold for.
    CompilerOfCounts,
    /// Slurm, which this user may start.
    Slurm,
    /// File systems of any size, which a program may mount in namespaces of its own.
    SmallDisk,
    /// The Modelica Reference FMUs with their published results.
    ReferenceFmus,
    /// FMUs as others have made them, each with a scenario.
    Cases,
    /// Logs that others have made.
    Logs,
    /// What cargo needs to build for Windows.
    WindowsTarget,
    /// Wine, and the compiler for what runs under it.
    Wine,
}

/// For each requirement that was looked for, why it is missing, if it is.
static ANSWERS: [OnceLock<Option<String>>; Requirement::Wine as usize + 1] =
    [const { OnceLock::new() }; Requirement::Wine as usize + 1];

/// Prints why something is missing; the lines of the tests have room for its name only.
pub fn explain() {
    for reason in ANSWERS.iter().filter_map(|answer| answer.get()?.as_ref()) {
        eprintln!("some tests do not run: {reason}");
    }
}

/// The folder of logs that others have made, a folder for each format.
pub fn logs_of_others() -> PathBuf {
    Path::new(ROOT).join("../shared/data/corpus")
}

impl Requirement {
    /// What it is called in the list of tests.
    pub fn name(self) -> &'static str {
        match self {
            Requirement::Compiler => "cc",
            Requirement::Python => "Python",
            Requirement::Masters => "other masters",
            Requirement::PythonLibrary => "libpython",
            #[cfg(feature = "rerun")]
            Requirement::Viewer => "viewer",
            Requirement::Browser => "chromium",
            Requirement::Valgrind => "valgrind",
            Requirement::CompilerOfCounts => "compiler of counts",
            Requirement::Slurm => "Slurm",
            Requirement::SmallDisk => "mount",
            Requirement::ReferenceFmus => "Reference FMUs",
            Requirement::Cases => "cases",
            Requirement::Logs => "logs of others",
            Requirement::WindowsTarget => "Rust for Windows",
            Requirement::Wine => "Wine",
        }
    }

    /// Whether its tests are for `--include-ignored` alone: few machines have it, or it takes minutes.
    pub fn is_rare(self) -> bool {
        use Requirement::{
            Cases, CompilerOfCounts, Logs, Masters, ReferenceFmus, Slurm, Valgrind, WindowsTarget,
        };
        matches!(
            self,
            Masters | Valgrind | CompilerOfCounts | Slurm | ReferenceFmus | Cases | Logs | WindowsTarget
        )
    }

    /// Whether its tests are left out even then: containers without privileges cannot start the daemons of Slurm, few machines
    /// have Rust's library for Windows, and counts of instructions are those of one compiler.
    pub fn may_be_absent(self) -> bool {
        matches!(self, Requirement::Slurm | Requirement::WindowsTarget | Requirement::CompilerOfCounts)
    }

    /// Why it is missing, if it is. The answer is found once.
    pub fn missing(self) -> Option<&'static str> {
        ANSWERS[self as usize].get_or_init(|| self.search()).as_deref()
    }

    fn search(self) -> Option<String> {
        match self {
            Requirement::Compiler => starts("cc", "compiles FMUs and plugins that misbehave"),
            Requirement::Valgrind => starts("valgrind", "looks for errors and leaks in our FMUs"),
            Requirement::CompilerOfCounts => super::instructions::other_compiler(),
            Requirement::Browser => match super::player::browser() {
                None => Some("chromium is not installed, which plays reports".to_owned()),
                Some(_) => python::environment().as_ref().err().cloned(),
            },
            Requirement::Slurm => super::engines::missing_slurm(),
            Requirement::SmallDisk => {
                let mount = super::full_disks::on_disk("1m", "/tmp", "true").output();
                let mounts = mount.is_ok_and(|mount| mount.status.success());
                (!mounts).then(|| "this user cannot mount a small disk (unshare, mount)".to_owned())
            }
            Requirement::Python | Requirement::Masters => python::environment().as_ref().err().cloned(),
            Requirement::PythonLibrary => python::environment().as_ref().map_or_else(
                |reason| Some(reason.clone()),
                |python| {
                    let library = python.library();
                    let reason = format!("this Python has no library {library}");
                    (!Path::new(&library).exists()).then_some(reason)
                },
            ),
            #[cfg(feature = "rerun")]
            Requirement::Viewer => live::missing_viewer(),
            Requirement::ReferenceFmus => absent(&reference_fmus()),
            Requirement::Cases => absent(&cases()),
            Requirement::Logs => absent(&logs_of_others()),
            Requirement::WindowsTarget => super::targets::missing_windows_target(),
            Requirement::Wine => missing_wine(),
        }
    }
}

fn absent(folder: &Path) -> Option<String> {
    (!folder.is_dir()).then(|| format!("there is no folder {}", folder.display()))
}

/// The folder of FMUs and systems of others that once failed, each with what is right.
pub fn cases() -> PathBuf {
    Path::new(ROOT).join("../shared/cases/fmi")
}

/// The folder of the Modelica Reference FMUs, by version of FMI, with their results; `TRACKSIDE_FMUS` names another one around it.
pub fn reference_fmus() -> PathBuf {
    let beside = || Path::new(ROOT).join("../shared/fmus");
    std::env::var_os("TRACKSIDE_FMUS").map_or_else(beside, PathBuf::from).join("reference")
}

/// Debian keeps the program outside of the search path unless the package `wine` is there.
fn missing_wine() -> Option<String> {
    let own = Path::new("/usr/lib/wine/wine64").exists();
    let found = own || ["wine64", "wine"].iter().any(|name| starts(name, "").is_none());
    let missing = (!found).then(|| "wine64 is not installed, which runs FMUs for Windows".to_owned());
    missing.or_else(|| starts("x86_64-w64-mingw32-gcc", "compiles FMUs for Windows"))
}

fn starts(program: &str, purpose: &str) -> Option<String> {
    let output = Command::new(program).arg("--version").output();
    output.is_err().then(|| format!("{program} is not installed, which {purpose}"))
}
