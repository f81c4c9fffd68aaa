//! Identifies the tires of a car from what it did: parameters of the Magic Formula, how certain they are, and in words
//! which of them the data can tell.
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

// The drives of the integration tests name this crate.
#[cfg(test)]
extern crate self as identify;

pub mod closed_loop;
pub mod compressed;
pub mod config;
pub mod design;
pub mod direction;
pub mod earlier;
pub mod effective;
pub mod estimate;
pub mod fit;
pub mod kernel;
pub mod loss;
pub mod noise;
pub mod normal;
pub mod page;
pub mod parameters;
mod plugin;
pub mod posterior;
pub mod prepare;
pub mod prior;
pub mod quadrature;
pub mod quantity;
pub mod result;
pub mod samples;
pub mod settings;
pub mod similar;
pub mod sobol;
pub mod start_values;
pub mod study;
pub mod svi;
pub mod text;
pub mod verdict;
