//! Drives known cars, prepares what their sensors show, and compares with what their tires did.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

mod drive;
mod laws;
mod real;
mod truth;
