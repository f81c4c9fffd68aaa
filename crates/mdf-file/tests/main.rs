//! The integration tests of this package, as one program.

#[path = "support/files.rs"]
mod files;
mod judged;
mod known_values;
#[path = "support/made.rs"]
mod made;
#[path = "support/old.rs"]
mod old;
