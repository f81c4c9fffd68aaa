//! The integration tests of this package, as one program.

mod bench_file;
mod formats;
mod measured;
mod synthetic;
mod tydex;
#[path = "../../mat-file/tests/support/writer.rs"]
mod writer;
#[path = "support/bench_file.rs"]
mod written_bench;
