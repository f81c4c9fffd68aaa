//! Compiles the FMU of `probe.c`.

include!("pack.in");
