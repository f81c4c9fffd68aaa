//! Drives known cars, prepares their sensor signals, and compares the result with their true tire forces.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

mod drive;
mod laws;
mod real;
mod truth;
