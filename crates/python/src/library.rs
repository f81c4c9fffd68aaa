//! Finds the shared library of a Python, for programs and FMUs that have Python in their own process.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use crate::interpreter::{OTHER_PYTHON, PythonInterpreter};

/// Four lines: the interpreter itself, which may be behind a script of pyenv, its version, and folder and name of its library.
const QUESTION: &str = "import sys, sysconfig
names = ['LIBDIR', 'INSTSONAME']
print(sys.executable, '%d.%d' % sys.version_info[:2], *map(sysconfig.get_config_var, names), sep='\\n')";

/// The shared library of a Python, and its interpreter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PythonLibrary {
    /// The interpreter, from whose place a Python finds its packages: that of a virtual environment has them there.
    pub interpreter: PathBuf,
    /// The library.
    pub path: PathBuf,
}

impl PythonInterpreter {
    /// The shared library of this Python.
    ///
    /// # Errors
    /// In a sentence, when the interpreter does not start, or there is no such library.
    pub fn find_shared_library(&self) -> Result<PythonLibrary, String> {
        let PythonInterpreter { path, reason } = self;
        let shown = path.display();
        let mut command = Command::new(path);
        let output = command.args(["-I", "-S", "-c", QUESTION]).stdin(Stdio::null()).output();
        let output = output.map_err(|error| {
            format!("{shown} ({reason}) does not start: {error}; install Python 3, {OTHER_PYTHON}")
        })?;
        let text = String::from_utf8_lossy(&output.stdout);
        let mut lines = text.lines();
        let mut next = || lines.next().filter(|line| !line.is_empty() && *line != "None");
        let (Some(interpreter), Some(version)) = (next(), next()) else {
            let said = String::from_utf8_lossy(&output.stderr);
            let said = said.trim().lines().next_back().unwrap_or("it says nothing").to_owned();
            return Err(format!(
                "{shown} ({reason}) is no Python that starts: {said}; install Python 3, {OTHER_PYTHON}"
            ));
        };
        let library = next().zip(next()).map(|(folder, name)| PathBuf::from(folder).join(name));
        match library.filter(|path| path.is_file() && path.extension().is_none_or(|it| it != "a")) {
            Some(path) => Ok(PythonLibrary { interpreter: interpreter.into(), path }),
            None => Err(format!(
                "the Python {version} of {interpreter} ({reason}) has no shared library: \
                 Debian has it in the package libpython{version}, pyenv builds it with PYTHON_CONFIGURE_OPTS=--enable-shared; install it, {OTHER_PYTHON}"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interpreter(path: &str) -> PythonInterpreter {
        PythonInterpreter { path: path.into(), reason: "named by TRACKSIDE_PYTHON" }
    }

    #[test]
    fn what_is_no_python_is_named_with_its_words() {
        let absent = interpreter("/opt/no/python").find_shared_library().expect_err("it is not there");
        assert!(absent.starts_with("/opt/no/python (named by TRACKSIDE_PYTHON) does not start"), "{absent}");
        let other = interpreter("/bin/sh").find_shared_library().expect_err("a shell");
        assert!(other.starts_with("/bin/sh (named by TRACKSIDE_PYTHON) is no Python that starts"), "{other}");
    }
}
