//! Numbers of many variants of one run: a design says which values they get, a table holds what came of them, statistics say what
//! drives what. Nothing here runs anything.
#![forbid(unsafe_code)]

pub mod design;
pub mod distribution;
pub mod page;
pub mod search;
pub mod statistics;
pub mod summary;
pub mod table;
