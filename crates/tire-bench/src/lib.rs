//! Fits the Magic Formula 6.1 with temperature terms to data of a tire test bench: a table goes in; coefficients with a posterior,
//! verdicts and the text of a `.tir` file come out. Method and measured figures: docs/methods/bench.md.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

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

pub use channels::{BenchReadOptions, CHANNELS, ConstantChannel, FileUnits};
pub use condition::{RevolutionMean, average_over_revolutions};
pub use file::write_tir;
pub use fit::{ChannelFitSummary, CoefficientEstimate, TireFit, TireFitOptions, fit_tire, fit_tire_to_means};
pub use held_out::{FitHoldout, HoldoutErrors, fit_with_holdout};
pub use model::{ExtensionTerm, FittedChannel, TERMS};
pub use numerics::identifiability::Identifiability;
pub use read::{BenchData, read_bench_file, read_bench_files, read_csv_file};
pub use sample::{BenchError, BenchSample, check_sample_signs};
