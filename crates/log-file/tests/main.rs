//! The integration tests of this package, as one program.

mod formats;
#[path = "support/ld.rs"]
mod ld;
#[path = "../../mat-file/tests/support/writer.rs"]
mod mat;
#[path = "support/writers.rs"]
mod writers;
mod written;
