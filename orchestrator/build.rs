//! Tells this program its target, and gives foreign code functions of it in the place of the system's: those that end the process, or
//! begin or end a thread.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    println!("cargo::rustc-env=BUILD_TARGET={}", variable("TARGET"));
    // A library that is loaded later looks for a name in the program first.
    if variable("CARGO_CFG_TARGET_OS") == "linux" && variable("CARGO_CFG_TARGET_ENV") == "gnu" {
        for (name, own) in [
            ("_exit", "trackside_foreign_exit"),
            ("_Exit", "trackside_foreign_exit"),
            ("pthread_create", "trackside_start_thread"),
            ("pthread_exit", "trackside_end_thread"),
        ] {
            println!("cargo::rustc-link-arg-bins=-Wl,--defsym={name}={own},--export-dynamic-symbol={name}");
        }
    }
}
