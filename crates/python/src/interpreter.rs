//! Finds the Python that runs a script.

use std::env;
use std::path::{Path, PathBuf};

/// The variable of the environment that names the interpreter.
const NAMED_BY: &str = "TRACKSIDE_PYTHON";

/// What is looked for in the search path when nothing else is known.
const USUAL: &str = "python3";

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
