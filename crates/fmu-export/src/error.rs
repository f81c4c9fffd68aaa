//! Defines the error of an FMI call: its status, and the message for the log.

use crate::abi::Status;

/// Failure of a call: the status that it returns, and the message for the log.
#[derive(Debug)]
pub struct FmiError {
    /// What the call returns.
    pub status: Status,
    /// What the log says.
    pub message: String,
}

/// What a call gives, or why it failed.
pub type FmiResult<T = ()> = Result<T, FmiError>;

/// Fails a call without harm to the instance.
///
/// # Errors
/// Always, with `fmi2Error` and the message.
pub fn reject<T>(message: impl Into<String>) -> FmiResult<T> {
    Err(FmiError { status: Status::Error, message: message.into() })
}
