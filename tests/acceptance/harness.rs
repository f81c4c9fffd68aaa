//! Starts the program in a folder of its own and collects its output, exit code and files.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// The workspace.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Output and exit status of the program.
pub struct Ended {
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
}

impl Ended {
    pub fn of(output: Output) -> Self {
        let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
        Ended { status: output.status, stdout: text(&output.stdout), stderr: text(&output.stderr) }
    }

    /// The exit code, unless a signal ended the program.
    pub fn code(&self) -> Option<i32> {
        self.status.code()
    }

    /// The error message on one line: terminals get it wrapped and framed.
    pub fn message(&self) -> String {
        let frame = |c: char| "│╭╰─┬▲×·".contains(c);
        let words = self.stderr.split_whitespace();
        words
            .map(|word| word.trim_matches(frame))
            .filter(|word| !word.is_empty())
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// Insists on the exit code.
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.code(), Some(code), "{}\n{}\n{}", self.status, self.stdout, self.stderr);
        self
    }

    /// Insists on a run that came to its end, whether or not its checks passed.
    #[track_caller]
    pub fn completes(self) -> Self {
        let code = self.code();
        assert!(matches!(code, Some(0 | 1)), "{}\n{}\n{}", self.status, self.stdout, self.stderr);
        self
    }

    /// Insists on words of the error message.
    #[track_caller]
    pub fn says(self, words: &[&str]) -> Self {
        let message = self.message();
        for word in words {
            assert!(message.contains(word), "expected {word:?} in:\n{}", self.stderr);
        }
        assert!(!message.contains("panicked"), "{}", self.stderr);
        self
    }
}

/// A folder for one test, where the program runs; paths in messages stay short that way.
pub struct Lab(TempDir);

impl Lab {
    pub fn new() -> Self {
        Lab(TempDir::with_prefix_in("lab-", temporary()).expect("a temporary folder"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, text).expect("a file");
        path
    }

    /// Puts a copy of a file into the folder.
    pub fn add(&self, file: &Path) {
        let name = file.file_name().expect("a name");
        std::fs::copy(file, self.0.path().join(name)).expect("a copy");
    }

    /// Runs `trackside` with these arguments in the folder.
    pub fn trackside<A: AsRef<OsStr>>(&self, arguments: &[A]) -> Ended {
        Ended::of(trackside(self.0.path()).args(arguments).output().expect("it starts"))
    }

    /// The report of the run that wrote into `folder`.
    pub fn report(&self, folder: &str) -> serde_json::Value {
        let text = self.read(&format!("{folder}/report.json"));
        serde_json::from_str(&text).expect("JSON")
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The CSV table of a run, with the names of its columns without their units.
    pub fn table(&self, name: &str) -> String {
        let text = self.read(name);
        let (titles, rows) = text.split_once('\n').expect("a line of titles");
        let mut names = String::new();
        for (place, part) in titles.split(" [").enumerate() {
            names += if place == 0 { part } else { part.split_once(']').expect("a unit").1 };
        }
        format!("{names}\n{rows}")
    }

    pub fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }
}

/// The program, to be started in `folder`.
pub fn trackside(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trackside"));
    command.current_dir(folder).stdin(Stdio::null()).env("TMPDIR", temporary());
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    command
}

/// The program, to be started in `folder`, with its signals as they are on a terminal. It keeps to what it inherits, as all programs
/// do: shells start jobs in the background with SIGINT ignored, `nohup` with SIGHUP.
pub fn signalled(folder: &Path) -> Command {
    with_signals(folder, "--default-signal=INT,TERM,HUP")
}

/// The program, to be started in `folder` by `env` with this option about signals.
pub fn with_signals(folder: &Path, option: &str) -> Command {
    let own = trackside(folder);
    let mut command = Command::new("env");
    command.arg(option).arg(own.get_program()).current_dir(folder).stdin(Stdio::null());
    command.envs(own.get_envs().filter_map(|(name, value)| Some((name, value?))));
    command
}

/// Sends a signal to a process that a test started.
#[track_caller]
pub fn signal(child: &Child, name: &str) {
    let kill = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(kill.expect("kill").success());
}

/// The time that something may take which is a matter of milliseconds on an idle machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until something is so.
#[track_caller]
pub fn wait_until(what: &str, is_so: impl FnMut() -> bool) {
    wait_for(what, is_so).unwrap_or_else(|reason| panic!("{reason}"));
}

/// Waits until something is so.
///
/// # Errors
/// When it takes too long.
pub fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) -> Result<(), String> {
    let begin = Instant::now();
    while !is_so() {
        if is_overdue(begin, PATIENCE) {
            return Err(format!("waited {} s in vain until {what}", begin.elapsed().as_secs()));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

/// Waits until something is so that a program does, which must go on meanwhile.
#[track_caller]
pub fn wait_while_it_runs(child: &mut Child, what: &str, mut is_so: impl FnMut() -> bool) {
    wait_until(what, || {
        let ended = child.try_wait().expect("its state");
        assert!(ended.is_none(), "it ended by itself before {what}: {ended:?}");
        is_so()
    });
}

/// Whether what began then takes too long, for the machine as it is now.
pub fn is_overdue(begin: Instant, limit: Duration) -> bool {
    begin.elapsed() > limit && begin.elapsed() > limit.mul_f64(slowness())
}

/// A limit [s] for what an idle machine does in no time: longer on a machine that is slow or busy.
pub fn limit(seconds: f64) -> f64 {
    (10.0 * seconds * slowness()).ceil() / 10.0
}

/// How many times longer a start of the program takes now than on an idle machine.
fn slowness() -> f64 {
    /// Of the program without optimisation, on a machine of 2020: twice what it takes alone.
    const START: Duration = Duration::from_millis(20);
    let begin = Instant::now();
    trackside(Path::new(ROOT)).arg("--version").output().expect("it starts");
    begin.elapsed().div_duration_f64(START).max(1.0)
}

/// A folder for temporary files that is not cleared while tests run, outside of the workspace.
fn temporary() -> PathBuf {
    let lasting = Path::new("/var/tmp");
    if lasting.is_dir() { lasting.to_owned() } else { std::env::temp_dir() }
}

/// The folder with a run of the limit handling, with CSV, made once for all tests that look at it.
pub fn limit_handling() -> &'static Lab {
    static RUN: OnceLock<Lab> = OnceLock::new();
    RUN.get_or_init(|| {
        let lab = Lab::new();
        let scenario = Path::new(ROOT).join("scenarios/limit_handling.toml");
        lab.write("limit_handling.toml", std::fs::read(scenario).expect("the scenario"));
        record(&lab, "limit_handling.toml", "run", &[]);
        lab
    })
}

/// Runs a scenario of a lab into its folder `out`, with CSV.
pub fn record(lab: &Lab, scenario: &str, out: &str, more: &[&str]) {
    let mut command = trackside(Path::new(ROOT));
    command.arg("run").arg(lab.path(scenario)).arg("--out").arg(lab.path(out));
    Ended::of(command.arg("--csv").args(more).output().expect("it starts")).completes();
}
