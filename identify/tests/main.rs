//! The integration tests of this package, as one program.

mod configuration;
#[path = "support/log_250lm.rs"]
mod log_250lm;
mod real_car;
mod real_loads;
#[path = "../../crates/drive-doctor/tests/support/real_log.rs"]
mod real_log;
mod real_windows;
mod sequential;
#[path = "support/windows.rs"]
mod windows;
