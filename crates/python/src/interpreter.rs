//! Finds the Python that runs a script.

use std::env;
use std::path::{Path, PathBuf};

/// The variable of the environment that names the interpreter.
const NAMED_BY: &str = "TRACKSIDE_PYTHON";

/// What is looked for in the search path when nothing else is known.
const USUAL: &str = "python3";

/// The remedy against a Python that does not serve.
pub(crate) const OTHER_PYTHON: &str = "or name another Python by the environment variable TRACKSIDE_PYTHON";

/// The module that an exception says is missing; of `numpy.linalg` that is `numpy`, which can be installed.
#[must_use]
pub fn missing_module(message: &str) -> Option<&str> {
    let (_, rest) = message.split_once("No module named '")?;
    rest.split(['\'', '.']).next()
}

/// How a module gets into a Python: the command, and the other remedy.
#[must_use]
pub fn module_install_advice(python: &Path, module: &str) -> String {
    format!("`{} -m pip install {module}`, {OTHER_PYTHON}", python.display())
}

/// A Python, and why it is this one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PythonInterpreter {
    /// The program.
    pub path: PathBuf,
    /// Who chose it, for people.
    pub reason: &'static str,
}

impl PythonInterpreter {
    /// The one that `TRACKSIDE_PYTHON` names, or else the `known` one if it is still there, or else `python3`.
    #[must_use]
    pub fn choose_interpreter(known: Option<&Path>) -> Self {
        let named = env::var_os(NAMED_BY).filter(|name| !name.is_empty());
        Self::choose_among(named.map(PathBuf::from), known)
    }

    fn choose_among(named: Option<PathBuf>, known: Option<&Path>) -> Self {
        match (named, known.filter(|path| path.is_file())) {
            (Some(path), _) => PythonInterpreter { path, reason: "named by TRACKSIDE_PYTHON" },
            (None, Some(path)) => {
                PythonInterpreter { path: path.to_owned(), reason: "the one of the packing" }
            }
            (None, None) => PythonInterpreter { path: USUAL.into(), reason: "found in PATH" },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_module_is_named_as_it_is_installed() {
        for (message, module) in [
            ("ModuleNotFoundError: No module named 'numpy.linalg'", Some("numpy")),
            ("it said: ModuleNotFoundError: No module named 'tuned'", Some("tuned")),
            ("NameError: name 'tuned' is not defined", None),
        ] {
            assert_eq!(missing_module(message), module, "{message}");
        }
    }

    #[test]
    fn the_environment_decides_before_what_is_known_and_a_lost_one_is_replaced() {
        let here = env::current_exe().expect("this program");
        let path = |named: Option<&str>, known: Option<&Path>| {
            PythonInterpreter::choose_among(named.map(PathBuf::from), known).path
        };
        assert_eq!(path(Some("/opt/python"), Some(&here)), PathBuf::from("/opt/python"));
        assert_eq!(path(None, Some(&here)), here);
        assert_eq!(path(None, Some(Path::new("/nowhere/python"))), PathBuf::from("python3"));
        assert_eq!(path(None, None), PathBuf::from("python3"));
    }
}
