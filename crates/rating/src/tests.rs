//! Checks ratings against another program, and bands against geometry.

mod band;
mod objective;
