//! The integration tests of this package, as one program.

mod oracles;
mod random;
