//! Compiles what needs C: the logger with its variable number of arguments, the handlers of signals, and what surrounds calls.

fn main() {
    let sources = ["logger", "crash", "interruption", "libraries", "process_state", "threads"]
        .map(|name| format!("src/{name}.c"));
    for source in &sources {
        println!("cargo::rerun-if-changed={source}");
    }
    println!("cargo::rerun-if-changed=src/foreign.h");
    cc::Build::new().files(sources).compile("trackside_fmu");
}
