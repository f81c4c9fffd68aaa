//! Fits the Magic Formula 6.1 with temperature terms to data of a tire test bench: a table goes in; coefficients with a posterior,
//! verdicts and the text of a `.tir` file come out. Method and measured figures: docs/methods/bench.md.
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

mod condition;
mod csv;
mod file;
mod fit;
mod held_out;
mod model;
mod prior;
mod sample;
mod solve;
mod spread;

pub use condition::{Point, condition};
pub use csv::{CSV_NAMES, read_csv, read_csv_file};
pub use file::write_tir;
pub use fit::{Estimate, Fit, Options, Residuals, Verdict, fit};
pub use held_out::{HeldOut, Left, held_out};
pub use model::{Channel, TERMS, Term};
pub use sample::{Bad, Sample, check};
