//! The integration tests of this package, as one program.

mod damaged;
mod killed;
#[path = "support/made.rs"]
mod made;
#[path = "support/recoveries.rs"]
mod recoveries;
mod strangers;
