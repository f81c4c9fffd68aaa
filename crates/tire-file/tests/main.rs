//! The integration tests of this package, as one program.

mod corpus;
mod texts;
mod variants;
