//! Converts errors and panics of format libraries into errors of this crate.

use std::fmt::Display;

use crate::Error;

/// The result of work on a file of a format.
pub fn catch_panics<T, E: Display>(format: &str, work: impl FnOnce() -> Result<T, E>) -> Result<T, Error> {
    match diagnostics::catch_panics(work) {
        Some(Ok(done)) => Ok(done),
        Some(Err(error)) => Err(Error::new(format!("the {format} file cannot be read: {error}"))),
        None => Err(Error::new(format!("the {format} file is damaged"))),
    }
}
