//! Loads the example plugin as a library, as the program does, and runs it; once more with valgrind watching.
//!
//! The last test needs valgrind: it is ignored but for `--include-ignored`.

use std::path::PathBuf;
use std::process::{Command, ExitCode};

use libtest_mimic::{Arguments, Failed, Trial};
use plugin::{AnalysisError, AnalysisRequest, AnalysisServices, Diagram, Plugin, Signal};

const MEMORY: &str = "no_call_touches_foreign_memory_or_leaks";

/// Success but for the findings of valgrind, which end the program with 99. Possible losses are the test
/// runner's own.
const VALGRIND: [&str; 4] =
    ["--quiet", "--error-exitcode=99", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect"];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    // Miri supports neither dynamic libraries nor valgrind.
    let here = |trial: Trial| trial.with_ignored_flag(cfg!(miri));
    let trials = vec![
        here(Trial::test("the_example_averages", || the_example_averages().map_err(Failed::from))),
        #[cfg(target_os = "linux")]
        here(Trial::test("a_library_stays_loaded", || {
            a_library_stays_loaded();
            Ok(())
        })),
        Trial::test(MEMORY, all_with_valgrind).with_kind("needs valgrind").with_ignored_flag(true),
    ];
    libtest_mimic::run(&arguments, trials).exit_code()
}

/// The example `mean`, which cargo builds before it runs tests.
fn library() -> PathBuf {
    let tests = std::env::current_exe().expect("this program");
    let folder = tests.ancestors().nth(2).expect("the folder of the build").join("examples");
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    folder.join(format!("{prefix}mean{suffix}"))
}

/// Keeps what was recorded.
struct Recorder(Vec<String>);

impl AnalysisServices for Recorder {
    fn report_progress(&mut self, _share: f64, _task: &str) -> bool {
        true
    }
    fn record_signals(&mut self, group: &str, signals: &[Signal]) {
        self.0.push(format!("{group}: {signals:?}"));
    }
    fn add_diagram(&mut self, _group: &str, _diagram: &Diagram) {}
    fn write_file(&mut self, _name: &str, _text: &str) {}
}

fn the_example_averages() -> Result<(), String> {
    let plugin = Plugin::load(&library()).map_err(|error| error.to_string())?;
    let [need] = plugin.input_signals() else {
        return Err(format!("{:?}", plugin.input_signals()));
    };
    assert_eq!((need.name.as_str(), need.required, plugin.config_schema()), ("x", true, None));
    let x = Signal { name: "x", unit: "m", time: &[0.0, 1.0], values: &[1.0, 4.0] };
    let request = AnalysisRequest { config: "", signals: vec![x] };
    assert_eq!(plugin.check_request(&request), Ok(()));
    let mut recorder = Recorder(Vec::new());
    assert_eq!(plugin.run(&request, &mut recorder), Ok(r#"{"mean": 2.5}"#.to_owned()));
    let deviation = Signal { values: &[-1.5, 1.5], ..x };
    assert_eq!(recorder.0, [format!("deviation: [{deviation:?}]")]);
    let missing = plugin.run(&AnalysisRequest::default(), &mut recorder);
    assert_eq!(missing, Err(AnalysisError::Failed("expected a signal `x`".to_owned())));
    Ok(())
}

/// Threads that a plugin started may run its code as long as the process lives.
#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "asks the loader whether a library is loaded")]
fn a_library_stays_loaded() {
    use libloading::os::unix::{Library, RTLD_NOW};
    const RTLD_NOLOAD: i32 = 4;
    // Under a name of its own: no other test holds it.
    let copy = std::env::temp_dir().join(format!("trackside-mean-{}.so", std::process::id()));
    std::fs::copy(library(), &copy).expect("a copy");
    drop(Plugin::load(&copy).expect("a plugin"));
    // SAFETY: nothing is loaded by that.
    let loaded = unsafe { Library::open(Some(&copy), RTLD_NOW | RTLD_NOLOAD) };
    std::fs::remove_file(&copy).expect("a file to remove");
    assert!(loaded.is_ok(), "the library was unloaded");
}

fn all_with_valgrind() -> Result<(), Failed> {
    let mut valgrind = Command::new("valgrind");
    valgrind.env("RUST_BACKTRACE", "0").args(VALGRIND).arg(std::env::current_exe()?);
    let output = valgrind.args(["--test-threads=1", "--skip", MEMORY]).output()?;
    if output.status.success() {
        return Ok(());
    }
    let [out, err] = [output.stdout, output.stderr];
    let text = [String::from_utf8_lossy(&out), String::from_utf8_lossy(&err)].concat();
    Err(format!("{}\n{text}", output.status).into())
}
