//! Checks what can be known of an FMU before it is simulated: its description, its library, its identity.

use std::sync::Arc;

use fmu_import::{Fmu, Instance};

use super::Rank::{BreaksRuns, BreaksStandard, NotRobust};
use super::test_driver::TestDriver;
use super::{Check, Rule, Verdict, broken};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "description",
        rank: BreaksStandard,
        sentence: "modelDescription.xml keeps the rules",
        check: Check::Files(description),
    },
    Rule {
        name: "platform",
        rank: BreaksRuns,
        sentence: "there is a library for this platform",
        check: Check::Files(platform),
    },
    Rule {
        name: "symbols",
        rank: BreaksRuns,
        sentence: "the library has all 34 functions of co-simulation",
        check: Check::Loads(symbols),
    },
    Rule {
        name: "version",
        rank: BreaksStandard,
        sentence: "the library is of FMI 2.0, with the default types",
        check: Check::RunsOne(version),
    },
    Rule {
        name: "guid",
        rank: NotRobust,
        sentence: "a GUID that is not the library's is refused",
        check: Check::RunsOne(guid),
    },
];

fn description(fmu: &Fmu) -> Verdict {
    match fmu.description.problems.as_slice() {
        [] => Ok(String::new()),
        problems => broken(problems.join("; ")),
    }
}

fn platform(fmu: &Fmu) -> Verdict {
    match fmu.library() {
        Ok(_) => Ok(String::new()),
        Err(error) => broken(error.to_string()),
    }
}

fn symbols(fmu: &Fmu) -> Verdict {
    match fmu.missing_symbols() {
        Ok(missing) if missing.is_empty() => Ok(String::new()),
        Ok(missing) => broken(format!("the library lacks {}", missing.join(", "))),
        Err(error) => broken(error.to_string()),
    }
}

fn version(driver: &TestDriver) -> Verdict {
    let found = [driver.library.version(), driver.library.types_platform()];
    let names = ["fmi2GetVersion", "fmi2GetTypesPlatform"];
    for ((name, expected), found) in names.into_iter().zip(["2.0", "default"]).zip(found) {
        if found != expected {
            return broken(format!("{name}: expected {expected:?}, found {found:?}"));
        }
    }
    Ok(String::new())
}

fn guid(driver: &TestDriver) -> Verdict {
    let wrong = "{00000000-0000-0000-0000-000000000000}";
    driver.note("fmi2Instantiate with another GUID");
    match Instance::with_guid(Arc::clone(&driver.library), "conform", wrong, false) {
        Ok(_) => broken(format!(
            "expected no instance for the GUID {wrong}, found one; the library's is {}",
            driver.about().guid
        )),
        Err(_) => Ok(String::new()),
    }
}
