//! Prints lines to standard error, where a reader that has gone away or a full disk ends nothing.

use std::io::Write as _;

use crate::shown::escape_for_terminal;

/// Prints a line to standard error. Texts of others are shown, not obeyed. `eprintln!` would panic where nobody takes the line, and the
/// exit code would say nothing of the run.
pub fn print_to_stderr(line: &str) {
    print_raw_to_stderr(&escape_for_terminal(line));
}

/// Prints a line that is harmless already, such as an error with its colours, to standard error.
pub fn print_raw_to_stderr(line: &str) {
    // There is no other place to tell it.
    let _ = std::io::stderr().write_all(format!("{line}\n").as_bytes());
}
