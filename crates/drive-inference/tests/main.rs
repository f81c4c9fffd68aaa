//! The integration tests of this package, as one program.

mod calibration;
mod closed_loop;
#[path = "support/drive.rs"]
mod drive;
mod errors;
#[path = "support/injected.rs"]
mod injected;
#[path = "support/mistakes.rs"]
mod mistakes;
#[path = "../../drive-doctor/tests/support/real_log.rs"]
mod real_log;
