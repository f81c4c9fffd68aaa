//! Checks in which states variables can be set, and that unknown references do no harm.

use fmu_import::description::{Type, Variable};
use fmu_import::{CallError, Causality, Initial, Instance, Storage, Value, Variability, Version};

use super::Rank::{BreaksStandard, NotRobust};
use super::call_order::{
    InitializationMode, Instantiated, STATES, State, StepComplete, Terminated, after_reset,
    bring_to,
};
use super::test_driver::{TestDriver, firsts, set_start};
use super::{BOTH, Check, Rule, RuleError, RuleResult, violated};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "variable-access",
        rank: BreaksStandard,
        sentence: "variables can be set when they may be",
        versions: BOTH,
        check: Check::Runs(set),
    },
    Rule {
        name: "illegal-access",
        rank: NotRobust,
        sentence: "variables cannot be set when they may not be",
        versions: BOTH,
        check: Check::Runs(set_wrongly),
    },
    Rule {
        name: "unknown-references",
        rank: NotRobust,
        sentence: "references to no variable are refused, and do no harm",
        versions: BOTH,
        check: Check::Runs(references),
    },
];

/// Whether a variable may be set in a state (FMI 2.0, notes below table 4.2.4; FMI 3.0, sections 2.3.2, 2.3.3 and 4.2.1), where the
/// standard says so: FMI 2.0 can be read in two ways about inputs before initialization.
fn settable(driver: &TestDriver, variable: &Variable, state: State) -> Option<bool> {
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
    if variable.kind == Type::Clock || variable.element.1 == 0 {
        return None;
    }
    Some(match state {
        Instantiated if input && driver.version() == Version::Two => return None,
        Instantiated => matches!(initial, Some(Initial::Exact | Initial::Approx)),
        InitializationMode => input || *initial == Some(Initial::Exact),
        StepComplete => {
            input || *causality == Causality::Parameter && *variability == Variability::Tunable
        }
        Terminated => false,
    })
}

/// One variable of each sort, since a library that tells two sorts apart tells all of them apart.
fn sorts<'a>(driver: &'a TestDriver) -> Vec<&'a Variable> {
    let mut sorts: Vec<&Variable> = Vec::new();
    let same = |a: &Variable, b: &Variable| {
        (a.causality, a.variability, a.initial, a.kind, a.storage, a.element.1 > 1)
            == (b.causality, b.variability, b.initial, b.kind, b.storage, b.element.1 > 1)
    };
    for variable in firsts(driver.about().variables.iter()) {
        if !sorts.iter().any(|other| same(other, variable)) {
            sorts.push(variable);
        }
    }
    sorts
}

fn set(driver: &TestDriver) -> RuleResult {
    attempts(driver, true, |what, result, _| match result {
        Ok(()) => None,
        Err(CallError { call, what: reason, .. }) => {
            Some(format!("expected success, found {call} of {what} {reason}"))
        }
    })
}

pub(super) fn set_wrongly(driver: &TestDriver) -> RuleResult {
    let verdict = attempts(driver, false, |what, result, lost| match result {
        Ok(()) => Some(what.to_owned()),
        Err(_) => lost.then(|| format!("{} for {what}", driver.fmi("Fatal"))),
    });
    verdict.map_err(|objection| match objection {
        RuleError::Violated(what) => {
            RuleError::Violated(format!("{}: {what}", driver.instead("success")))
        }
        other => other,
    })
}

/// Sets a variable of each sort in each state where that is legal, or illegal, and collects what is wrong with the results; the
/// flag tells whether the instance is lost.
fn attempts(
    driver: &TestDriver,
    legal: bool,
    wrong: impl Fn(&str, Result<(), CallError>, bool) -> Option<String>,
) -> RuleResult {
    let (mut count, mut mistakes) = (0, Vec::new());
    for (variable, state) in
        sorts(driver).into_iter().flat_map(|it| STATES.map(|state| (it, state)))
    {
        if settable(driver, variable, state) != Some(legal) {
            continue;
        }
        let mut instance = bring_to(driver, state)?;
        let what = format!(
            "`{}` ({:?} {:?}) in {}",
            variable.name,
            variable.variability,
            variable.causality,
            state.name(driver.version())
        );
        driver.note(&format!("setting {what}"));
        count += 1;
        let result = set_start(driver, &mut instance, variable);
        mistakes.extend(wrong(&what, result, instance.is_lost()));
        // After fmi2Fatal nothing can be tried any more.
        if driver.library.is_lost() {
            break;
        }
    }
    if mistakes.is_empty() { Ok(format!("{count} calls")) } else { violated(mistakes.join("; ")) }
}

/// The forms of values that a version has functions for, with the ends of the names of these functions.
pub(super) fn forms(version: Version) -> &'static [(Storage, &'static str)] {
    match version {
        Version::Two => &[
            (Storage::Float64, "Real"),
            (Storage::Int32, "Integer"),
            (Storage::Boolean, "Boolean"),
            (Storage::String, "String"),
        ],
        Version::Three => &[
            (Storage::Float64, "Float64"),
            (Storage::Float32, "Float32"),
            (Storage::Int8, "Int8"),
            (Storage::UInt8, "UInt8"),
            (Storage::Int16, "Int16"),
            (Storage::UInt16, "UInt16"),
            (Storage::Int32, "Int32"),
            (Storage::UInt32, "UInt32"),
            (Storage::Int64, "Int64"),
            (Storage::UInt64, "UInt64"),
            (Storage::Boolean, "Boolean"),
            (Storage::String, "String"),
            (Storage::Binary, "Binary"),
        ],
    }
}

/// Gets or sets one value by the functions of a form.
pub(super) fn access_variable(
    instance: &mut Instance,
    set: bool,
    storage: Storage,
    reference: u32,
) -> Result<(), CallError> {
    if !set {
        return instance.read(storage, reference, 1).map(drop);
    }
    let value = match storage {
        Storage::Float32 | Storage::Float64 => Value::Real(0.0),
        Storage::Boolean | Storage::Clock => Value::Boolean(false),
        Storage::String => Value::String(String::new()),
        Storage::Binary => Value::Binary(Vec::new()),
        _ => Value::Integer(0),
    };
    instance.write(storage, reference, &[value])
}

/// References that no variable of the form has, in FMI 3.0 no variable at all: the one after the last, and the largest.
fn unknown(driver: &TestDriver, storage: Storage) -> impl Iterator<Item = u32> {
    let three = driver.version() == Version::Three;
    let all = driver.about().variables.iter();
    let same = all.filter(move |variable| three || variable.storage == storage);
    let last = same.map(|variable| variable.reference).max();
    let next = last.map_or(Some(0), |last| last.checked_add(1));
    let largest = (last != Some(u32::MAX)).then_some(u32::MAX);
    next.into_iter().chain(largest)
}

/// A reference that no variable has is an error (FMI 2.0.4, section 2.1.2; FMI 3.0, section 2.2.6.2), which does no harm.
pub(super) fn references(driver: &TestDriver) -> RuleResult {
    let expected = after_reset(driver, bring_to(driver, StepComplete)?)?;
    let (mut count, mut accepted) = (0, Vec::new());
    for (storage, form) in forms(driver.version()) {
        for (set, reference) in [false, true]
            .into_iter()
            .flat_map(|set| unknown(driver, *storage).map(move |it| (set, it)))
        {
            let name = driver.fmi(&format!("{}{form}", if set { "Set" } else { "Get" }));
            let mut instance = bring_to(driver, StepComplete)?;
            driver.note(&format!("{name} of the reference {reference}, which no variable has"));
            count += 1;
            match access_variable(&mut instance, set, *storage, reference) {
                Ok(()) => accepted.push(format!("{name} of {reference}")),
                Err(_) if instance.is_lost() => {
                    let fatal = driver.fmi("Fatal");
                    return violated(format!("{name} of {reference} returned {fatal}"));
                }
                Err(_) => instance.reset()?,
            }
            driver.note(&format!("a run after {name} of the reference {reference}"));
            let found = after_reset(driver, instance)?;
            driver.same(&expected, &found).map_err(|objection| match objection {
                RuleError::Violated(what) => {
                    RuleError::Violated(format!("{what}, after {name} of {reference}"))
                }
                other => other,
            })?;
        }
    }
    nothing(driver)?;
    match accepted.as_slice() {
        [] => Ok(format!("{count} calls")),
        calls => violated(format!("{}: {}", driver.instead("success"), calls.join(", "))),
    }
}

/// Arrays of no elements may be null.
fn nothing(driver: &TestDriver) -> Result<(), RuleError> {
    if driver.version() == Version::Three {
        return Ok(());
    }
    let mut instance = bring_to(driver, StepComplete)?;
    driver.note("reading and setting no variables");
    let _ = instance.get_and_set_no_variables();
    if instance.is_lost() {
        return violated("reading and setting no variables returned fmi2Fatal");
    }
    let _ = instance.reset();
    Ok(())
}
