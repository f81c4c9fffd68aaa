//! Checks in which states variables can be set, and that unknown references do no harm.

use fmu_import::description::{Type, Variable};
use fmu_import::{CallError, Causality, Initial, Instance, Variability};

use super::Rank::{BreaksStandard, NotRobust};
use super::order::{
    InitializationMode, Instantiated, State, StepComplete, Terminated, after_reset, bring,
};
use super::test_driver::{TestDriver, set_start};
use super::{Check, Objection, Rule, Verdict, broken};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "variable-access",
        rank: BreaksStandard,
        sentence: "variables can be set when they may be",
        check: Check::Runs(set),
    },
    Rule {
        name: "illegal-access",
        rank: NotRobust,
        sentence: "variables cannot be set when they may not be",
        check: Check::Runs(set_wrongly),
    },
    Rule {
        name: "unknown-references",
        rank: NotRobust,
        sentence: "references to no variable are refused, and do no harm",
        check: Check::Runs(references),
    },
];

const STATES: [State; 4] = [Instantiated, InitializationMode, StepComplete, Terminated];

/// Whether a variable may be set in a state (FMI 2.0, notes below table 4.2.4), where the standard says so:
/// it can be read in two ways about inputs before initialization.
fn settable(variable: &Variable, state: State) -> Option<bool> {
    let Variable { causality, variability, initial, .. } = variable;
    let input = *causality == Causality::Input;
    if *variability == Variability::Constant || *causality == Causality::Independent {
        return Some(false);
    }
    Some(match state {
        Instantiated if input => return None,
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
        (a.causality, a.variability, a.initial, a.kind)
            == (b.causality, b.variability, b.initial, b.kind)
    };
    for variable in &driver.about().variables {
        if !sorts.iter().any(|other| same(other, variable)) {
            sorts.push(variable);
        }
    }
    sorts
}

fn set(driver: &TestDriver) -> Verdict {
    attempts(driver, true, |what, result, _| match result {
        Ok(()) => None,
        Err(CallError { call, what: reason, .. }) => {
            Some(format!("expected success, found {call} of {what} {reason}"))
        }
    })
}

pub(super) fn set_wrongly(driver: &TestDriver) -> Verdict {
    attempts(driver, false, |what, result, lost| match result {
        Ok(()) => Some(format!("expected fmi2Error, found success: {what}")),
        Err(_) => lost.then(|| format!("fmi2Fatal for {what}")),
    })
}

/// Sets a variable of each sort in each state where that is legal, or illegal, and collects what is wrong with the results; the
/// flag tells whether the instance is lost.
fn attempts(
    driver: &TestDriver,
    legal: bool,
    wrong: impl Fn(&str, Result<(), CallError>, bool) -> Option<String>,
) -> Verdict {
    let (mut count, mut mistakes) = (0, Vec::new());
    for (variable, state) in
        sorts(driver).into_iter().flat_map(|it| STATES.map(|state| (it, state)))
    {
        if settable(variable, state) != Some(legal) {
            continue;
        }
        let mut instance = bring(driver, state)?;
        let what = format!(
            "`{}` ({:?} {:?}) in {state:?}",
            variable.name, variable.variability, variable.causality
        );
        driver.note(&format!("setting {what}"));
        count += 1;
        let result = set_start(&mut instance, variable);
        mistakes.extend(wrong(&what, result, instance.is_lost()));
        // After fmi2Fatal nothing can be tried any more.
        if driver.library.is_lost() {
            break;
        }
    }
    if mistakes.is_empty() { Ok(format!("{count} calls")) } else { broken(mistakes.join("; ")) }
}

type Call = fn(&mut Instance, u32) -> Result<(), CallError>;

#[rustfmt::skip]
const CALLS: [(&str, Type, Call); 8] = [
    ("fmi2GetReal", Type::Real, |instance, reference| instance.get_real(&[reference], &mut [0.0])),
    ("fmi2SetReal", Type::Real, |instance, reference| instance.set_real(&[reference], &[0.0])),
    ("fmi2GetInteger", Type::Integer, |instance, reference| instance.get_integer(&[reference], &mut [0])),
    ("fmi2SetInteger", Type::Integer, |instance, reference| instance.set_integer(&[reference], &[0])),
    ("fmi2GetBoolean", Type::Boolean, |instance, reference| instance.get_boolean(&[reference], &mut [0])),
    ("fmi2SetBoolean", Type::Boolean, |instance, reference| instance.set_boolean(&[reference], &[0])),
    ("fmi2GetString", Type::String, |instance, reference| instance.get_string(reference).map(drop)),
    ("fmi2SetString", Type::String, |instance, reference| instance.set_string(reference, "")),
];

/// References that no variable of the type has: the one after the last, and the largest.
fn unknown(driver: &TestDriver, kind: Type) -> impl Iterator<Item = u32> {
    let same = |other: Type| other == kind || (other, kind) == (Type::Enumeration, Type::Integer);
    let all = driver.about().variables.iter().filter(move |variable| same(variable.kind));
    let last = all.map(|variable| variable.reference).max();
    let next = last.map_or(Some(0), |last| last.checked_add(1));
    let largest = (last != Some(u32::MAX)).then_some(u32::MAX);
    next.into_iter().chain(largest)
}

/// A reference that no variable has is an error (FMI 2.0.4, section 2.1.2), which does no harm.
pub(super) fn references(driver: &TestDriver) -> Verdict {
    let expected = after_reset(driver, bring(driver, StepComplete)?)?;
    let (mut count, mut accepted) = (0, Vec::new());
    for (name, kind, call) in CALLS {
        for reference in unknown(driver, kind) {
            let mut instance = bring(driver, StepComplete)?;
            driver.note(&format!("{name} of the reference {reference}, which no variable has"));
            count += 1;
            match call(&mut instance, reference) {
                Ok(()) => accepted.push(format!("{name} of {reference}")),
                Err(_) if instance.is_lost() => {
                    return broken(format!("{name} of {reference} returned fmi2Fatal"));
                }
                Err(_) => instance.reset()?,
            }
            driver.note(&format!("a run after {name} of the reference {reference}"));
            let found = after_reset(driver, instance)?;
            driver.same(&expected, &found).map_err(|objection| match objection {
                Objection::Broken(what) => {
                    Objection::Broken(format!("{what}, after {name} of {reference}"))
                }
                other => other,
            })?;
        }
    }
    nothing(driver)?;
    match accepted.as_slice() {
        [] => Ok(format!("{count} calls")),
        calls => broken(format!("expected fmi2Error, found success: {}", calls.join(", "))),
    }
}

/// Arrays of no elements may be null.
fn nothing(driver: &TestDriver) -> Result<(), Objection> {
    let mut instance = bring(driver, StepComplete)?;
    driver.note("reading and setting no variables");
    let _ = instance.touch_nothing();
    if instance.is_lost() {
        return broken("reading and setting no variables returned fmi2Fatal");
    }
    let _ = instance.reset();
    Ok(())
}
