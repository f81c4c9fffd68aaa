//! Checks an FMU before it is simulated: model description, platform, exported symbols, version, GUID.

use std::sync::Arc;

use fmu_import::{FmiVersion, Fmu, Instance};

use super::RuleSeverity::{BreaksRuns, BreaksStandard, NotRobust};
use super::logging::{PERCENT, is_formatted};
use super::test_driver::TestDriver;
use super::{ALL, BOTH, ConformanceRule, RuleCheck, RuleResult, THREE, not_applicable, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "description",
        rank: BreaksStandard,
        sentence: "modelDescription.xml keeps the rules",
        versions: ALL,
        check: RuleCheck::Files(check_description),
    },
    ConformanceRule {
        name: "platform",
        rank: BreaksRuns,
        sentence: "there is a library for this platform",
        versions: ALL,
        check: RuleCheck::Files(check_platform),
    },
    ConformanceRule {
        name: "symbols",
        rank: BreaksRuns,
        sentence: "the library has the functions that every simulation calls",
        versions: ALL,
        check: RuleCheck::Loads(check_required_symbols),
    },
    ConformanceRule {
        name: "functions",
        rank: BreaksStandard,
        sentence: "the library has all functions of co-simulation",
        versions: THREE,
        check: RuleCheck::Loads(check_all_functions),
    },
    ConformanceRule {
        name: "version",
        rank: BreaksStandard,
        sentence: "the library says that it is of the version of its description",
        versions: ALL,
        check: RuleCheck::RunsOne(check_version),
    },
    ConformanceRule {
        name: "guid",
        rank: NotRobust,
        sentence: "a GUID or token that is not the library's is refused",
        versions: BOTH,
        check: RuleCheck::RunsOne(check_guid),
    },
];

fn check_description(fmu: &Fmu) -> RuleResult {
    let about = &fmu.description;
    let found: Vec<_> = about.corrections.iter().chain(&about.problems).cloned().collect();
    match found.is_empty() {
        true => Ok(String::new()),
        false => violated_rule(found.join("; ")),
    }
}

fn check_platform(fmu: &Fmu) -> RuleResult {
    match fmu.prepare_library() {
        Ok(_) => Ok(fmu.compiled_library().map_or_else(String::new, |compiled| compiled.to_string())),
        Err(error) => violated_rule(error.to_string()),
    }
}

fn check_required_symbols(fmu: &Fmu) -> RuleResult {
    match fmu.missing_symbols() {
        Ok([missing, _]) if missing.is_empty() => Ok(String::new()),
        Ok([missing, _]) => violated_rule(format!("the library lacks {}", missing.join(", "))),
        Err(error) => violated_rule(error.to_string()),
    }
}

/// A library has the functions of all interfaces that it offers, also those that it does not support (FMI 3.0, section 2.5.1).
fn check_all_functions(fmu: &Fmu) -> RuleResult {
    match fmu.missing_symbols() {
        Ok([_, missing]) if missing.is_empty() => Ok(String::new()),
        Ok([_, missing]) => violated_rule(format!("the library lacks {}", missing.join(", "))),
        Err(error) => not_applicable(error.to_string()),
    }
}

fn check_version(driver: &TestDriver) -> RuleResult {
    if driver.fmi_version() == FmiVersion::Three {
        let found = driver.library.reported_fmi_version();
        return match found == "3.0" || found.starts_with("3.0.") {
            true => Ok(found),
            false => violated_rule(format!("fmi3GetVersion: expected \"3.0\", found {found:?}")),
        };
    }
    let found = [driver.library.reported_fmi_version(), driver.library.types_platform()];
    let expected = match driver.fmi_version() {
        FmiVersion::One => [("fmiGetVersion", "1.0"), ("fmiGetTypesPlatform", "standard32")],
        _ => [("fmi2GetVersion", "2.0"), ("fmi2GetTypesPlatform", "default")],
    };
    for ((name, expected), found) in expected.into_iter().zip(found) {
        if found != expected {
            return violated_rule(format!("{name}: expected {expected:?}, found {found:?}"));
        }
    }
    Ok(String::new())
}

/// Only a caller that breaks the standard hands over a GUID of others, also when the library takes it for a format of `printf`.
fn check_guid(driver: &TestDriver) -> RuleResult {
    let wrong = "{00000000-0000-0000-0000-000000000000}";
    let call = driver.fmi_name("InstantiateCoSimulation");
    driver.note_progress(&format!("{call} with another GUID or token"));
    match Instance::with_guid(Arc::clone(&driver.library), "conform", wrong, false) {
        Ok(_) => violated_rule(format!(
            "expected no instance of {call} for {wrong}, found one; the library's is {}",
            driver.description().guid
        )),
        Err(_) => check_guid_in_messages(driver),
    }
}

fn check_guid_in_messages(driver: &TestDriver) -> RuleResult {
    driver.note_progress("an instance with percent signs in the GUID or token, to be logged");
    let messages = match Instance::with_guid(Arc::clone(&driver.library), "conform", PERCENT, true) {
        Ok(instance) => instance.take_messages(),
        Err((_, messages)) => messages,
    };
    match messages.iter().find(|message| is_formatted(&message.text)) {
        Some(message) => violated_rule(format!("the GUID or token was taken for a format: {}", message.text)),
        None => Ok(String::new()),
    }
}
