//! Checks that values travel by the functions of their type only, and in the number that their variable has (FMI 3.0).

use fmu_import::description::{FmiType, Variable};
use fmu_import::{CallError, Causality, Instance, StorageType};

use super::RuleSeverity::NotRobust;
use super::access::{access_variable, storage_function_names};
use super::call_order::{StepComplete, instance_in_state};
use super::test_driver::{TestDriver, default_value, first_elements};
use super::{ConformanceRule, RuleCheck, RuleError, RuleResult, THREE, not_applicable, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "wrong-type",
        rank: NotRobust,
        sentence: "a variable is refused by the functions of other types",
        versions: THREE,
        check: RuleCheck::Runs(wrong_type),
    },
    ConformanceRule {
        name: "wrong-count",
        rank: NotRobust,
        sentence: "another number of values than a variable has is refused",
        versions: THREE,
        check: RuleCheck::Runs(wrong_count),
    },
];

/// One variable of each form and of each number of elements.
fn variables_of_each_storage<'a>(driver: &'a TestDriver) -> Vec<&'a Variable> {
    let mut found: Vec<&Variable> = Vec::new();
    let readable = driver.description().variables.iter().filter(|it| it.kind != FmiType::Clock);
    for variable in first_elements(readable) {
        let same =
            |other: &&Variable| (other.storage, other.element.1) == (variable.storage, variable.element.1);
        if !found.iter().any(same) {
            found.push(variable);
        }
    }
    found
}

/// Makes a call that the FMU should refuse, and notes it when the FMU does not.
fn note_if_accepted(
    driver: &TestDriver,
    what: String,
    accepted: &mut Vec<String>,
    call: impl FnOnce(&mut Instance) -> Result<(), CallError>,
) -> Result<(), RuleError> {
    let mut instance = instance_in_state(driver, StepComplete)?;
    driver.note_progress(&what);
    match call(&mut instance) {
        Ok(()) => accepted.push(what),
        Err(_) if instance.has_failed_fatally() => {
            return violated_rule(format!("{what} returned {}", driver.fmi_name("Fatal")));
        }
        Err(_) => {}
    }
    Ok(())
}

fn all_refused(driver: &TestDriver, count: usize, accepted: &[String]) -> RuleResult {
    match accepted {
        [] => Ok(format!("{count} calls")),
        calls => violated_rule(format!("{}: {}", driver.unexpected_status("success"), calls.join(", "))),
    }
}

/// Value references are unique over all types (FMI 3.0, section 2.4.7.4), so that a function of another type knows no such variable.
fn wrong_type(driver: &TestDriver) -> RuleResult {
    let (mut count, mut accepted) = (0, Vec::new());
    let mut seen: Vec<StorageType> = Vec::new();
    for variable in variables_of_each_storage(driver) {
        if seen.contains(&variable.storage) {
            continue;
        }
        seen.push(variable.storage);
        for (storage, form) in storage_function_names(driver.fmi_version()) {
            for set in [false, true] {
                if *storage == variable.storage {
                    continue;
                }
                let name = driver.fmi_name(&format!("{}{form}", if set { "Set" } else { "Get" }));
                let what = format!("{name} of `{}`, a {:?}", variable.name, variable.storage);
                count += 1;
                note_if_accepted(driver, what, &mut accepted, |instance| {
                    access_variable(instance, set, *storage, variable.reference)
                })?;
            }
        }
    }
    if count == 0 {
        return not_applicable("there are no variables");
    }
    all_refused(driver, count, &accepted)
}

/// `nValues` is the number of elements of all variables together (FMI 3.0, section 2.2.6.2).
fn wrong_count(driver: &TestDriver) -> RuleResult {
    let (mut count, mut accepted) = (0, Vec::new());
    for variable in variables_of_each_storage(driver) {
        let elements = variable.element.1;
        let settable = variable.causality == Causality::Input;
        for stated in [elements + 1, elements.saturating_sub(1)] {
            count += 1;
            let what = format!("reading {stated} values of `{}`, which has {elements}", variable.name);
            note_if_accepted(driver, what, &mut accepted, |instance| {
                instance.read_n_values(variable.storage, variable.reference, stated)
            })?;
        }
        if settable {
            count += 1;
            let stated = elements + 1;
            let what = format!("setting {stated} values of `{}`, which has {elements}", variable.name);
            let values = vec![default_value(variable); stated];
            note_if_accepted(driver, what, &mut accepted, |instance| {
                instance.write_variable(variable.storage, variable.reference, &values)
            })?;
        }
    }
    if count == 0 {
        return not_applicable("there are no variables");
    }
    all_refused(driver, count, &accepted)
}
