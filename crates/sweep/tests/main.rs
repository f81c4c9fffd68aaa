//! The integration tests of this package, as one program.

mod design;
mod indices;
mod page;
mod search;
mod table;
