//! Checks that the claimed derivatives exist and agree with differences of the outputs.

use fmu_import::description::Variable;
use fmu_import::{CallError, Causality, Instance};

use super::Rank::BreaksStandard;
use super::test_driver::TestDriver;
use super::{Check, Rule, Verdict, broken, not_applicable};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "directional-derivative",
        rank: BreaksStandard,
        sentence: "derivatives of outputs are those of their values",
        check: Check::RunsOne(directional),
    },
    Rule {
        name: "time-derivative",
        rank: BreaksStandard,
        sentence: "derivatives with respect to time are taken and given",
        check: Check::RunsOne(in_time),
    },
];

/// How far an input is moved for a difference, as a share of its size.
const SHARE: f64 = 1e-4;
/// By how much a derivative may differ from a central difference: the difference is the less exact one.
const TOLERANCE: f64 = 1e-3;
/// What rounding leaves of a difference of two equal outputs, as a share of them.
const NOISE: f64 = 1e-11;

/// An FMU may show an output that follows an input after the next step only; then there is nothing to
/// compare with, and the derivative has to be finite.
fn directional(driver: &TestDriver) -> Verdict {
    if !driver.about().directional_derivative {
        return not_applicable("providesDirectionalDerivative is not set");
    }
    let mut instance = driver.ready()?;
    driver.run_all(&mut instance)?;
    let (mut count, mut given, mut compared) = (0, 0, 0);
    for input in driver.continuous(Causality::Input) {
        for output in driver.continuous(Causality::Output) {
            let pair = format!("`{}` with respect to `{}`", output.name, input.name);
            driver.note(&format!("fmi2GetDirectionalDerivative of {pair}"));
            count += 1;
            let Ok(found) = instance.derivative(output.reference, input.reference) else {
                continue;
            };
            if !found.is_finite() {
                return broken(format!("the derivative of {pair} is {found}"));
            }
            given += 1;
            let (expected, noise) = difference(&mut instance, output, input)?;
            compared += u32::from(expected != 0.0);
            let scale = expected.abs().max(found.abs());
            if expected != 0.0 && (expected - found).abs() > TOLERANCE * scale + noise {
                return broken(format!(
                    "expected the derivative of {pair} to be {expected:.6e}, found {found:.6e}"
                ));
            }
        }
    }
    match (count, given) {
        (0, _) => not_applicable("there is no real continuous input or output"),
        (_, 0) => broken(format!("none of {count} derivatives is given")),
        _ => Ok(format!("{given} of {count} derivatives, {compared} compared with differences")),
    }
}

/// The central difference of an output, and what rounding makes of it.
fn difference(
    instance: &mut Instance,
    output: &Variable,
    input: &Variable,
) -> Result<(f64, f64), CallError> {
    let mut value = [0.0];
    instance.get_real(&[input.reference], &mut value)?;
    let size = input.nominal.unwrap_or(1.0).abs().max(value[0].abs());
    let moved = SHARE * size;
    let mut at = |input_value: f64| {
        let mut shown = [0.0];
        instance.set_real(&[input.reference], &[input_value])?;
        instance.get_real(&[output.reference], &mut shown).map(|()| shown[0])
    };
    let (above, below) = (at(value[0] + moved)?, at(value[0] - moved)?);
    at(value[0])?;
    Ok(((above - below) / (2.0 * moved), NOISE * above.abs().max(below.abs()) / moved))
}

fn in_time(driver: &TestDriver) -> Verdict {
    let about = driver.about();
    let mut done = Vec::new();
    let mut instance = driver.ready()?;
    if about.interpolated_inputs
        && let Some(input) = driver.continuous(Causality::Input).next()
    {
        driver.set_inputs(&mut instance, 0, 0)?;
        driver.note(&format!("fmi2SetRealInputDerivatives of `{}`", input.name));
        instance.set_input_derivative(input.reference, 1, 0.0)?;
        done.push(format!("an input derivative of `{}`", input.name));
    }
    driver.run_all(&mut instance)?;
    if about.output_derivatives > 0
        && let Some(output) = driver.continuous(Causality::Output).next()
    {
        driver.note(&format!("fmi2GetRealOutputDerivatives of `{}`", output.name));
        let value = instance.output_derivative(output.reference, 1)?;
        if !value.is_finite() {
            return broken(format!("the time derivative of `{}` is {value}", output.name));
        }
        done.push(format!("an output derivative of `{}`", output.name));
    }
    match done.is_empty() {
        true => not_applicable("neither canInterpolateInputs nor maxOutputDerivativeOrder is set"),
        false => Ok(done.join(", ")),
    }
}
