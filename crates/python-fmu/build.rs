//! Keeps the library loaded once it is: destructors of thread-local values outlive the call of `dlclose`.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Rust's library registers a destructor for each thread that asks who it is. Importers such as libcosim unload the library
    // of an FMU before their threads end, which would then call what is gone.
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
