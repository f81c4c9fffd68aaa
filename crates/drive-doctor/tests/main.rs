//! The integration tests of this package, as one program.

#[path = "support/cars.rs"]
mod cars;
#[path = "support/clean_drive.rs"]
mod clean_drive;
mod columns;
#[path = "../../drive-inference/tests/support/drive.rs"]
mod drive;
mod false_alarms;
mod gains;
#[path = "support/mistake.rs"]
mod mistake;
mod mistakes;
mod real;
#[path = "support/real_log.rs"]
mod real_log;
