//! Checks an FMU before it is simulated: model description, platform, exported symbols, version, GUID.

use std::sync::Arc;

use fmu_import::{Fmu, Instance, Version};

use super::Rank::{BreaksRuns, BreaksStandard, NotRobust};
use super::test_driver::TestDriver;
use super::{BOTH, Check, Rule, RuleResult, THREE, not_applicable, violated};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "description",
        rank: BreaksStandard,
        sentence: "modelDescription.xml keeps the rules",
        versions: BOTH,
        check: Check::Files(description),
    },
    Rule {
        name: "platform",
        rank: BreaksRuns,
        sentence: "there is a library for this platform",
        versions: BOTH,
        check: Check::Files(platform),
    },
    Rule {
        name: "symbols",
        rank: BreaksRuns,
        sentence: "the library has the functions that every simulation calls",
        versions: BOTH,
        check: Check::Loads(symbols),
    },
    Rule {
        name: "functions",
        rank: BreaksStandard,
        sentence: "the library has all functions of co-simulation",
        versions: THREE,
        check: Check::Loads(functions),
    },
    Rule {
        name: "version",
        rank: BreaksStandard,
        sentence: "the library says that it is of the version of its description",
        versions: BOTH,
        check: Check::RunsOne(version),
    },
    Rule {
        name: "guid",
        rank: NotRobust,
        sentence: "a GUID or token that is not the library's is refused",
        versions: BOTH,
        check: Check::RunsOne(guid),
    },
];

fn description(fmu: &Fmu) -> RuleResult {
    let about = &fmu.description;
    let found: Vec<_> = about.corrections.iter().chain(&about.problems).cloned().collect();
    match found.is_empty() {
        true => Ok(String::new()),
        false => violated(found.join("; ")),
    }
}

fn platform(fmu: &Fmu) -> RuleResult {
    match fmu.library() {
        Ok(_) => Ok(String::new()),
        Err(error) => violated(error.to_string()),
    }
}

fn symbols(fmu: &Fmu) -> RuleResult {
    match fmu.missing_symbols() {
        Ok([missing, _]) if missing.is_empty() => Ok(String::new()),
        Ok([missing, _]) => violated(format!("the library lacks {}", missing.join(", "))),
        Err(error) => violated(error.to_string()),
    }
}

/// A library has the functions of all interfaces that it offers, also those that it does not support (FMI 3.0, section 2.5.1).
fn functions(fmu: &Fmu) -> RuleResult {
    match fmu.missing_symbols() {
        Ok([_, missing]) if missing.is_empty() => Ok(String::new()),
        Ok([_, missing]) => violated(format!("the library lacks {}", missing.join(", "))),
        Err(error) => not_applicable(error.to_string()),
    }
}

fn version(driver: &TestDriver) -> RuleResult {
    if driver.version() == Version::Three {
        let found = driver.library.version();
        return match found == "3.0" || found.starts_with("3.0.") {
            true => Ok(found),
            false => violated(format!("fmi3GetVersion: expected \"3.0\", found {found:?}")),
        };
    }
    let found = [driver.library.version(), driver.library.types_platform()];
    let names = ["fmi2GetVersion", "fmi2GetTypesPlatform"];
    for ((name, expected), found) in names.into_iter().zip(["2.0", "default"]).zip(found) {
        if found != expected {
            return violated(format!("{name}: expected {expected:?}, found {found:?}"));
        }
    }
    Ok(String::new())
}

fn guid(driver: &TestDriver) -> RuleResult {
    let wrong = "{00000000-0000-0000-0000-000000000000}";
    let call = driver.fmi("InstantiateCoSimulation");
    driver.note(&format!("{call} with another GUID or token"));
    match Instance::with_guid(Arc::clone(&driver.library), "conform", wrong, false) {
        Ok(_) => violated(format!(
            "expected no instance of {call} for {wrong}, found one; the library's is {}",
            driver.about().guid
        )),
        Err(_) => Ok(String::new()),
    }
}
