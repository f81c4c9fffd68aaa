//! Compiles the two things that Rust cannot do: a function with any number of arguments, which an FMU's
//! logger is, and a handler that runs when a foreign library has crashed.

fn main() {
    let sources = ["src/logger.c", "src/crash.c"];
    for source in sources {
        println!("cargo::rerun-if-changed={source}");
    }
    cc::Build::new().files(sources).compile("trackside_fmu");
}
