//! Checks in which states variables can be set, and that unknown references do no harm.

use fmu_import::description::{FmiType, Variable};
use fmu_import::{CallError, Causality, FmiVersion, Initial, Instance, StorageType, Value, Variability};

use super::RuleSeverity::{BreaksStandard, NotRobust};
use super::call_order::{
    InitializationMode, InstanceState, Instantiated, STATES, StepComplete, Terminated, after_reset,
    instance_in_state,
};
use super::test_driver::{TestDriver, first_elements, set_start};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "variable-access",
        rank: BreaksStandard,
        sentence: "variables can be set when they may be",
        versions: BOTH,
        check: RuleCheck::Runs(check_legal_sets),
    },
    ConformanceRule {
        name: "illegal-access",
        rank: NotRobust,
        sentence: "variables cannot be set when they may not be",
        versions: BOTH,
        check: RuleCheck::Runs(check_illegal_sets),
    },
    ConformanceRule {
        name: "unknown-references",
        rank: NotRobust,
        sentence: "references to no variable are refused, and do no harm",
        versions: BOTH,
        check: RuleCheck::Runs(check_unknown_references),
    },
];

/// Whether a variable may be set in a state (FMI 2.0, notes below table 4.2.4; FMI 3.0, sections 2.3.2, 2.3.3 and 4.2.1), where the
/// standard says so: FMI 2.0 can be read in two ways about inputs before initialization.
fn is_settable(driver: &TestDriver, variable: &Variable, state: InstanceState) -> Option<bool> {
    let Variable { causality, variability, initial, .. } = variable;
    let input = *causality == Causality::Input;
    if *variability == Variability::Constant || *causality == Causality::Independent {
        return Some(false);
    }
    // It is set in configuration mode only.
    if *causality == Causality::StructuralParameter {
        return Some(false);
    }
    // Clocks tick in event mode; an array of no elements has no values.
    if variable.kind == FmiType::Clock || variable.element.1 == 0 {
        return None;
    }
    Some(match state {
        Instantiated if input && driver.fmi_version() == FmiVersion::Two => return None,
        Instantiated => matches!(initial, Some(Initial::Exact | Initial::Approx)),
        InitializationMode => input || *initial == Some(Initial::Exact),
        StepComplete => input || *causality == Causality::Parameter && *variability == Variability::Tunable,
        Terminated => false,
    })
}

/// One variable of each sort, since a library that tells two sorts apart tells all of them apart.
fn representative_variables<'a>(driver: &'a TestDriver) -> Vec<&'a Variable> {
    let mut sorts: Vec<&Variable> = Vec::new();
    let same = |a: &Variable, b: &Variable| {
        (a.causality, a.variability, a.initial, a.kind, a.storage, a.element.1 > 1)
            == (b.causality, b.variability, b.initial, b.kind, b.storage, b.element.1 > 1)
    };
    for variable in first_elements(driver.description().variables.iter()) {
        if !sorts.iter().any(|other| same(other, variable)) {
            sorts.push(variable);
        }
    }
    sorts
}

fn check_legal_sets(driver: &TestDriver) -> RuleResult {
    try_sets_in_each_state(driver, true, |what, result, _| match result {
        Ok(()) => None,
        Err(CallError { call, what: reason, .. }) => {
            Some(format!("expected success, found {call} of {what} {reason}"))
        }
    })
}

pub(super) fn check_illegal_sets(driver: &TestDriver) -> RuleResult {
    let verdict = try_sets_in_each_state(driver, false, |what, result, lost| match result {
        Ok(()) => Some(what.to_owned()),
        Err(_) => lost.then(|| format!("{} for {what}", driver.fmi_name("Fatal"))),
    });
    verdict.map_err(|objection| match objection {
        RuleError::Violated(what) => {
            RuleError::Violated(format!("{}: {what}", driver.unexpected_status("success")))
        }
        other => other,
    })
}

/// Sets a variable of each sort in each state where that is legal, or illegal, and collects what is wrong with the results; the
/// flag tells whether the instance is lost.
fn try_sets_in_each_state(
    driver: &TestDriver,
    legal: bool,
    wrong: impl Fn(&str, Result<(), CallError>, bool) -> Option<String>,
) -> RuleResult {
    let (mut count, mut mistakes) = (0, Vec::new());
    for (variable, state) in
        representative_variables(driver).into_iter().flat_map(|it| STATES.map(|state| (it, state)))
    {
        if is_settable(driver, variable, state) != Some(legal) {
            continue;
        }
        let mut instance = instance_in_state(driver, state)?;
        let what = format!(
            "`{}` ({:?} {:?}) in {}",
            variable.name,
            variable.variability,
            variable.causality,
            state.fmi_state_name(driver.fmi_version())
        );
        driver.note_progress(&format!("setting {what}"));
        count += 1;
        let result = set_start(driver, &mut instance, variable);
        mistakes.extend(wrong(&what, result, instance.has_failed_fatally()));
        // After fmi2Fatal nothing can be tried any more.
        if driver.library.has_failed_fatally() {
            break;
        }
    }
    if mistakes.is_empty() { Ok(format!("{count} calls")) } else { violated_rule(mistakes.join("; ")) }
}

/// The forms of values that a version has functions for, with the ends of the names of these functions.
pub(super) fn storage_function_names(version: FmiVersion) -> &'static [(StorageType, &'static str)] {
    match version {
        FmiVersion::One | FmiVersion::Two => &[
            (StorageType::Float64, "Real"),
            (StorageType::Int32, "Integer"),
            (StorageType::Boolean, "Boolean"),
            (StorageType::String, "String"),
        ],
        FmiVersion::Three => &[
            (StorageType::Float64, "Float64"),
            (StorageType::Float32, "Float32"),
            (StorageType::Int8, "Int8"),
            (StorageType::UInt8, "UInt8"),
            (StorageType::Int16, "Int16"),
            (StorageType::UInt16, "UInt16"),
            (StorageType::Int32, "Int32"),
            (StorageType::UInt32, "UInt32"),
            (StorageType::Int64, "Int64"),
            (StorageType::UInt64, "UInt64"),
            (StorageType::Boolean, "Boolean"),
            (StorageType::String, "String"),
            (StorageType::Binary, "Binary"),
        ],
    }
}

/// Gets or sets one value by the functions of a form.
pub(super) fn access_variable(
    instance: &mut Instance,
    set: bool,
    storage: StorageType,
    reference: u32,
) -> Result<(), CallError> {
    if !set {
        return instance.read_variable(storage, reference, 1).map(drop);
    }
    let value = match storage {
        StorageType::Float32 | StorageType::Float64 => Value::Real(0.0),
        StorageType::Boolean | StorageType::Clock => Value::Boolean(false),
        StorageType::String => Value::String(String::new()),
        StorageType::Binary => Value::Binary(Vec::new()),
        _ => Value::Integer(0),
    };
    instance.write_variable(storage, reference, &[value])
}

/// References that no variable of the form has, in FMI 3.0 no variable at all: the one after the last, and the largest.
fn unknown_references(driver: &TestDriver, storage: StorageType) -> impl Iterator<Item = u32> {
    let three = driver.fmi_version() == FmiVersion::Three;
    let all = driver.description().variables.iter();
    let same = all.filter(move |variable| three || variable.storage == storage);
    let last = same.map(|variable| variable.reference).max();
    let next = last.map_or(Some(0), |last| last.checked_add(1));
    let largest = (last != Some(u32::MAX)).then_some(u32::MAX);
    next.into_iter().chain(largest)
}

/// A reference that no variable has is an error (FMI 2.0.4, section 2.1.2; FMI 3.0, section 2.2.6.2), which does no harm.
pub(super) fn check_unknown_references(driver: &TestDriver) -> RuleResult {
    let expected = after_reset(driver, instance_in_state(driver, StepComplete)?)?;
    let (mut count, mut accepted) = (0, Vec::new());
    for (storage, form) in storage_function_names(driver.fmi_version()) {
        for (set, reference) in [false, true]
            .into_iter()
            .flat_map(|set| unknown_references(driver, *storage).map(move |it| (set, it)))
        {
            let name = driver.fmi_name(&format!("{}{form}", if set { "Set" } else { "Get" }));
            let mut instance = instance_in_state(driver, StepComplete)?;
            driver.note_progress(&format!("{name} of the reference {reference}, which no variable has"));
            count += 1;
            match access_variable(&mut instance, set, *storage, reference) {
                Ok(()) => accepted.push(format!("{name} of {reference}")),
                Err(_) if instance.has_failed_fatally() => {
                    let fatal = driver.fmi_name("Fatal");
                    return violated_rule(format!("{name} of {reference} returned {fatal}"));
                }
                Err(_) => instance.reset()?,
            }
            driver.note_progress(&format!("a run after {name} of the reference {reference}"));
            let found = after_reset(driver, instance)?;
            driver.require_equal_runs(&expected, &found).map_err(|objection| match objection {
                RuleError::Violated(what) => {
                    RuleError::Violated(format!("{what}, after {name} of {reference}"))
                }
                other => other,
            })?;
        }
    }
    check_empty_arrays(driver)?;
    match accepted.as_slice() {
        [] => Ok(format!("{count} calls")),
        calls => violated_rule(format!("{}: {}", driver.unexpected_status("success"), calls.join(", "))),
    }
}

/// Arrays of no elements may be null.
fn check_empty_arrays(driver: &TestDriver) -> Result<(), RuleError> {
    if driver.fmi_version() == FmiVersion::Three {
        return Ok(());
    }
    let mut instance = instance_in_state(driver, StepComplete)?;
    driver.note_progress("reading and setting no variables");
    let _ = instance.get_and_set_no_variables();
    if instance.has_failed_fatally() {
        return violated_rule("reading and setting no variables returned fmi2Fatal");
    }
    let _ = instance.reset();
    Ok(())
}
