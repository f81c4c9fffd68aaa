//! Fits the Magic Formula 6.1 with temperature terms to data of a tire test bench: a table goes in; coefficients with a posterior,
//! verdicts and the text of a `.tir` file come out. Method and measured figures: docs/methods/bench.md.
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

mod axes;
mod channels;
mod condition;
mod csv;
mod file;
mod fit;
mod held_out;
mod inputs;
mod mat;
mod model;
mod prior;
mod read;
mod sample;
mod solve;
mod spread;
mod sweeps;
mod table;
mod text;
mod tydex;

pub use channels::{CHANNELS, Constant, FileUnits, Reading};
pub use condition::{Point, condition};
pub use file::write_tir;
pub use fit::{Estimate, Fit, Options, Residuals, fit, fit_points};
pub use held_out::{Holdout, HoldoutErrors, held_out};
pub use model::{Channel, TERMS, Term};
pub use numerics::identifiability::Verdict;
pub use read::{BenchData, read, read_all, read_csv_file};
pub use sample::{BenchError, Sample, check};
