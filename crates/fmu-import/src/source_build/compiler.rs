//! Finds the compilers of the system and runs them, with limits.

use std::ffi::OsString;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::program_search::find_program;
use crate::termination_signal;

/// One library may take this long, of which no process may take more time of a processor.
pub(super) const LIMIT: Duration = Duration::from_secs(900);

/// No file that a compiler writes may be longer [blocks of 512 bytes].
const LONGEST_FILE: u64 = 2 << 20;

/// So much of what a compiler says is kept [bytes].
const LONGEST_OUTPUT: usize = 1 << 20;

/// So many errors are shown.
const SHOWN: usize = 5;

/// A compiler of the system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Compiler {
    program: PathBuf,
    /// What the environment variable has behind its name.
    arguments: Vec<String>,
}

/// A language with its compilers.
pub(super) struct Language {
    name: &'static str,
    variable: &'static str,
    programs: &'static [&'static str],
    package: &'static str,
}

pub(super) const C: Language =
    Language { name: "C", variable: "CC", programs: &["cc", "gcc", "clang"], package: "gcc" };
pub(super) const CPP: Language =
    Language { name: "C++", variable: "CXX", programs: &["c++", "g++", "clang++"], package: "g++" };

impl Compiler {
    /// The compiler that the environment variable names, or else the first one of `PATH`.
    ///
    /// # Errors
    /// When there is none, with what to do.
    pub fn find(language: &Language) -> Result<Self, String> {
        let Language { name, variable, programs, package } = language;
        let named = std::env::var(variable).unwrap_or_default();
        let mut words = named.split_whitespace();
        if let Some(word) = words.next() {
            let program = find_program(word).ok_or_else(|| {
                format!("the environment variable {variable} names the compiler `{word}`, which is not there")
            })?;
            return Ok(Compiler { program, arguments: words.map(str::to_owned).collect() });
        }
        let found = programs.iter().find_map(|name| find_program(name)).ok_or_else(|| {
            let names = programs.join(", ");
            format!(
                "no compiler for {name} is there ({names}): install one, on Debian or Ubuntu by `apt install {package} libc6-dev`, or name one in the environment variable {variable}"
            )
        })?;
        Ok(Compiler { program: found, arguments: Vec::new() })
    }

    /// What it is called.
    pub fn name(&self) -> String {
        self.program.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Which one it is: the place of the program, and what it says about its version.
    pub fn identity(&self) -> String {
        let output = Command::new(&self.program).args(&self.arguments).arg("--version").output();
        let version = output.map(|output| output.stdout).unwrap_or_default();
        format!("{self:?} {}", String::from_utf8_lossy(&version))
    }

    /// Runs it in `folder` with these arguments.
    ///
    /// # Errors
    /// With what it says, when it fails, takes too long or is not to go on.
    pub fn run(&self, folder: &Path, arguments: &[OsString], deadline: Instant) -> Result<(), String> {
        let name = self.name();
        let seconds = LIMIT.as_secs();
        // The compiler proper is a process below that of its driver, and has the limits, too.
        let limits = format!("ulimit -t {seconds}; ulimit -f {LONGEST_FILE}; exec \"$@\"");
        let mut command = Command::new("/bin/sh");
        command.args(["-c", &limits, "sh"]).arg(&self.program).args(&self.arguments).args(arguments);
        // The words of errors are looked for; a cache of compilers would be one more place that is written to.
        command.env("LC_ALL", "C").env("CCACHE_DISABLE", "1").current_dir(folder);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| format!("{name} does not start: {error}"))?;
        let output = drain_output(&mut child);
        let status = loop {
            if let Some(status) = child.try_wait().map_err(|error| format!("{name}: {error}"))? {
                break status;
            }
            let too_late = Instant::now() > deadline;
            if too_late || termination_signal().is_some() {
                let _ = child.kill();
                let _ = child.wait();
                return Err(match too_late {
                    true => format!("{name} was ended after {seconds} s"),
                    false => format!("{name} was ended with the run"),
                });
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        if status.success() {
            return Ok(());
        }
        let said = output.join().unwrap_or_default();
        Err(shown_errors(&String::from_utf8_lossy(&said))
            .unwrap_or_else(|| format!("{name} failed: {status}")))
    }
}

/// Reads what a compiler says until it says no more.
fn drain_output(child: &mut Child) -> std::thread::JoinHandle<Vec<u8>> {
    let pipe = child.stderr.take();
    std::thread::spawn(move || {
        let (mut kept, mut part) = (Vec::new(), [0; 4096]);
        let Some(mut pipe) = pipe else { return kept };
        while let Ok(count @ 1..) = pipe.read(&mut part) {
            let free = LONGEST_OUTPUT.saturating_sub(kept.len());
            kept.extend_from_slice(&part[..count.min(free)]);
        }
        kept
    })
}

/// The lines with errors, or else the first lines.
fn shown_errors(output: &str) -> Option<String> {
    let lines = || output.lines().map(str::trim_end).filter(|line| !line.is_empty());
    let is_error = |line: &&str| {
        ["error: ", "undefined reference to", "multiple definition of", "cannot find -l"]
            .iter()
            .any(|words| line.contains(words))
    };
    let errors: Vec<_> = lines().filter(is_error).collect();
    let errors = if errors.is_empty() { lines().collect() } else { errors };
    let more = errors.len().saturating_sub(SHOWN);
    let mut text = errors.iter().take(SHOWN).copied().collect::<Vec<_>>().join("\n  ");
    if more > 0 {
        text += &format!("\n  and {more} more");
    }
    (!text.is_empty()).then_some(text)
}

/// Does jobs on all processors. The first one in their order that fails ends the others.
pub(super) fn run_all<J: Sync>(
    jobs: &[J],
    run: impl Fn(usize, &J) -> Result<(), String> + Sync,
) -> Result<(), String> {
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    let next = AtomicUsize::new(0);
    let failures: Arc<Mutex<Vec<(usize, String)>>> = Arc::default();
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Relaxed);
                    let Some(job) = jobs.get(place) else { return };
                    if let Err(what) = run(place, job) {
                        next.store(jobs.len(), Relaxed);
                        failures.lock().unwrap_or_else(PoisonError::into_inner).push((place, what));
                    }
                }
            });
        }
    });
    let mut failures = failures.lock().unwrap_or_else(PoisonError::into_inner);
    failures.sort();
    failures.drain(..).next().map_or(Ok(()), |(_, what)| Err(what))
}
