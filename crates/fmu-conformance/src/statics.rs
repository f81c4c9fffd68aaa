//! Checks what can be known of an FMU before it is simulated: its description, its library, its identity.

use std::sync::Arc;

use fmu_import::{Fmu, Instance};

use super::bench::Bench;
use super::{Verdict, broken};

pub(super) fn description(fmu: &Fmu) -> Verdict {
    match fmu.description.problems.as_slice() {
        [] => Ok(String::new()),
        problems => broken(problems.join("; ")),
    }
}

pub(super) fn platform(fmu: &Fmu) -> Verdict {
    match fmu.library() {
        Ok(_) => Ok(String::new()),
        Err(error) => broken(error.to_string()),
    }
}

pub(super) fn symbols(fmu: &Fmu) -> Verdict {
    match fmu.missing_symbols() {
        Ok(missing) if missing.is_empty() => Ok(String::new()),
        Ok(missing) => broken(format!("the library lacks {}", missing.join(", "))),
        Err(error) => broken(error.to_string()),
    }
}

pub(super) fn version(bench: &Bench) -> Verdict {
    let found = [bench.library.version(), bench.library.types_platform()];
    let names = ["fmi2GetVersion", "fmi2GetTypesPlatform"];
    for ((name, expected), found) in names.into_iter().zip(["2.0", "default"]).zip(found) {
        if found != expected {
            return broken(format!("{name}: expected {expected:?}, found {found:?}"));
        }
    }
    Ok(String::new())
}

pub(super) fn guid(bench: &Bench) -> Verdict {
    let wrong = "{00000000-0000-0000-0000-000000000000}";
    bench.note("fmi2Instantiate with another GUID");
    match Instance::with_guid(Arc::clone(&bench.library), "conform", wrong, false) {
        Ok(_) => broken(format!(
            "expected no instance for the GUID {wrong}, found one; the library's is {}",
            bench.about().guid
        )),
        Err(_) => Ok(String::new()),
    }
}
