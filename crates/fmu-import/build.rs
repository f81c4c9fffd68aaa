//! Compiles what needs C: the logger with its variable number of arguments, and the handlers of signals.

fn main() {
    let sources = ["src/logger.c", "src/crash.c", "src/interruption.c"];
    for source in sources {
        println!("cargo::rerun-if-changed={source}");
    }
    cc::Build::new().files(sources).compile("trackside_fmu");
}
