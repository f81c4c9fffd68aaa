//! Design of experiments for the variants of a run, tables of their results, statistics, sensitivities and searches. Nothing here runs
//! anything.
#![forbid(unsafe_code)]

pub mod design;
pub mod distribution;
pub mod page;
pub mod search;
pub mod statistics;
pub mod summary;
pub mod table;
pub mod variant_table;
