//! Damages inputs at random and tries them by the million: bits, blocks, numbers, words, lines, depth and ends.
//!
//! A [`FuzzTarget`] is what reads such inputs. [`run_fuzz_program`] is the body of a program that tries as many as asked for, each in a process
//! that may die, and [`replay_corpus`] that of a test: it tries what such programs found once, and some thousand new ones.
#![forbid(unsafe_code)]

mod case;
mod change;
mod crew;
mod program;
mod replay;

use std::path::Path;

pub use case::make_damaged_input;
pub use program::run_fuzz_program;
pub use rand_pcg::Pcg64;
pub use replay::replay_corpus;

/// What reads damaged inputs.
pub struct FuzzTarget {
    /// Its name, such as `tables`.
    pub name: &'static str,
    /// The folder of inputs that were hard to read once.
    pub corpus: &'static str,
    /// Sound inputs, which are damaged.
    pub sound: fn() -> Vec<Vec<u8>>,
    /// Words of the format, which get to wrong places.
    pub words: &'static [&'static str],
    /// A damage that only this format can have.
    pub own: Option<fn(&mut Pcg64, &mut Vec<u8>)>,
    /// Reads an input, and says whether it was taken. It has a folder for files, which it leaves as it found it but for those that
    /// it writes anew each time. It panics when the reader did what it must not do.
    pub attempt: fn(&[u8], &Path) -> bool,
}
