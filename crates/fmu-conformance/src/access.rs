//! Checks in which states variables can be set, and that unknown references do no harm.

use fmu_import::description::{Type, Variable};
use fmu_import::{CallError, Causality, Initial, Instance, Variability};

use super::order::{
    InitializationMode, Instantiated, State, StepComplete, Terminated, after_reset, bring,
};
use super::test_driver::{TestDriver, set_start};
use super::{Check, Objection, Rule, Verdict, broken};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "variable-access",
        sentence: "variables can be set when they may be, and then only",
        check: Check::Runs(set),
    },
    Rule {
        name: "unknown-references",
        sentence: "references to no variable do no harm",
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

pub(super) fn set(driver: &TestDriver) -> Verdict {
    let (mut count, mut accepted, mut wrong) = (0, Vec::new(), Vec::new());
    for (variable, state) in
        sorts(driver).into_iter().flat_map(|it| STATES.map(|state| (it, state)))
    {
        let Some(legal) = settable(variable, state) else { continue };
        let mut instance = bring(driver, state)?;
        let what = format!(
            "`{}` ({:?} {:?}) in {state:?}",
            variable.name, variable.variability, variable.causality
        );
        driver.note(&format!("setting {what}"));
        count += 1;
        match (set_start(&mut instance, variable), legal) {
            (Ok(()), false) => accepted.push(what),
            (Err(CallError { call, what: reason, .. }), true) => {
                wrong.push(format!("expected success, found {call} of {what} {reason}"));
            }
            (Err(_), false) if instance.is_lost() => wrong.push(format!("fmi2Fatal for {what}")),
            _ => {}
        }
        // After fmi2Fatal nothing can be tried any more.
        if driver.library.is_lost() {
            break;
        }
    }
    if !accepted.is_empty() {
        wrong.insert(0, format!("expected fmi2Error, found success: {}", accepted.join(", ")));
    }
    if wrong.is_empty() { Ok(format!("{count} calls")) } else { broken(wrong.join("; ")) }
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

/// The standard does not say what becomes of a reference that nothing has: an FMU that accepts it is warned
/// about; one that dies of it, or does something else afterwards, breaks the rule.
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
        calls => Ok(format!("warning: accepted: {}", calls.join(", "))),
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
