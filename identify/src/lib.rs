//! Identifies the tires of a car from what it did: parameters of the Magic Formula, how certain they are, and in words
//! which of them the data can tell.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

pub mod assessment;
pub mod conclusion;
pub mod config;
pub mod design;
pub mod loads;
pub mod names;
pub mod page;
mod plugin;
pub mod posterior_draws;
pub mod prior_from_file;
pub mod sobol;
pub mod start_values;
pub mod stretches;
pub mod studies;
pub mod summary;
pub mod uncertainty_propagation;
