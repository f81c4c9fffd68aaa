//! Compiles the two functions that need C: the logger with its variable number of arguments, and the handler of crashes.

fn main() {
    let sources = ["src/logger.c", "src/crash.c"];
    for source in sources {
        println!("cargo::rerun-if-changed={source}");
    }
    cc::Build::new().files(sources).compile("trackside_fmu");
}
