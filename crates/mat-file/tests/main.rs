//! The integration tests of this package, as one program.

mod files;
mod judged;
#[path = "support/writer.rs"]
mod writer;
