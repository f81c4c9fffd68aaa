//! A checked plan goes in; its nodes are made and stepped. The row of each communication point comes out to a sink, and a verdict on
//! each check at the end.
#![forbid(unsafe_code)]

pub mod baseline;
pub mod check;
pub mod checkpoint;
pub mod collected;
pub mod coupling;
pub mod course;
pub mod exchange;
pub mod fault;
pub mod master;
pub mod node;

#[cfg(test)]
mod testing;
