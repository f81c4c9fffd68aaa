//! Compiles the one function that Rust cannot define: an FMU's logger takes any number of arguments.

fn main() {
    println!("cargo::rerun-if-changed=src/fmu/logger.c");
    cc::Build::new().file("src/fmu/logger.c").compile("trackside_logger");
}
