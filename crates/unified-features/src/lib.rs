//! Nothing goes in or out: depending on this crate gives shared dependencies the same features in every build, so that cargo compiles
//! none of them twice.
#![forbid(unsafe_code)]
