//! The integration tests of this package, as one program.

mod answers;
mod fitting;
mod posterior;
