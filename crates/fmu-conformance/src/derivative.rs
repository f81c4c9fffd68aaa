//! Checks that the claimed derivatives exist and agree with differences of the outputs.

use fmu_import::description::Variable;
use fmu_import::{ArrayVariable, CallError, Causality, FmiVersion, Instance, StorageType, Value};
use roxmltree::Document;

use super::RuleSeverity::BreaksStandard;
use super::test_driver::{TestDriver, read_variable};
use super::{BOTH, ConformanceRule, RuleCheck, RuleResult, THREE, not_applicable, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "directional-derivative",
        rank: BreaksStandard,
        sentence: "derivatives of outputs are those of their values",
        versions: BOTH,
        check: RuleCheck::RunsOne(|driver| check_derivatives(driver, DerivativeKind::Directional)),
    },
    ConformanceRule {
        name: "adjoint-derivative",
        rank: BreaksStandard,
        sentence: "adjoint derivatives are those of the outputs",
        versions: THREE,
        check: RuleCheck::RunsOne(|driver| check_derivatives(driver, DerivativeKind::Adjoint)),
    },
    ConformanceRule {
        name: "time-derivative",
        rank: BreaksStandard,
        sentence: "derivatives with respect to time are taken and given",
        versions: BOTH,
        check: RuleCheck::RunsOne(check_output_derivatives),
    },
];

/// How far an input is moved for a difference, as a share of its size.
const SHARE: f64 = 1e-4;
/// By how much a derivative may differ from a central difference: the difference is the less exact one.
const TOLERANCE: f64 = 1e-3;
/// What rounding leaves of a difference of two equal outputs, as a share of them.
const NOISE: f64 = 1e-11;
/// The same for `Float32`.
const SINGLE_NOISE: f64 = 5e-7;

/// Which function gives the derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DerivativeKind {
    Directional,
    Adjoint,
}

/// The derivative of an element of an output with respect to one of an input.
type DerivativeFn = fn(&mut Instance, &Variable, &Variable) -> Result<f64, CallError>;

/// By the directional derivative.
pub(super) fn element_directional_derivative(
    instance: &mut Instance,
    output: &Variable,
    input: &Variable,
) -> Result<f64, CallError> {
    if instance.description().version == FmiVersion::Two {
        return instance.directional_derivative(output.reference, input.reference);
    }
    let found = instance.array_directional_derivative(
        to_array_variable(output),
        to_array_variable(input),
        &element_seed(input),
    )?;
    Ok(found.get(output.element.0).copied().unwrap_or(f64::NAN))
}

/// By the adjoint derivative.
fn element_adjoint_derivative(
    instance: &mut Instance,
    output: &Variable,
    input: &Variable,
) -> Result<f64, CallError> {
    let found = instance.array_adjoint_derivative(
        to_array_variable(output),
        to_array_variable(input),
        &element_seed(output),
    )?;
    Ok(found.get(input.element.0).copied().unwrap_or(f64::NAN))
}

fn to_array_variable(variable: &Variable) -> ArrayVariable {
    ArrayVariable { reference: variable.reference, elements: variable.element.1 }
}

/// 1 for this element of an array, 0 for the others.
fn element_seed(variable: &Variable) -> Vec<f64> {
    let (place, count) = variable.element;
    (0..count).map(|element| if element == place { 1.0 } else { 0.0 }).collect()
}

/// An FMU may show an output that follows an input after the next step only; then there is nothing to
/// compare with, and the derivative has to be finite.
fn check_derivatives(driver: &TestDriver, kind: DerivativeKind) -> RuleResult {
    let (call, of): (_, DerivativeFn) = match kind {
        DerivativeKind::Directional if !driver.description().directional_derivative => {
            return not_applicable(match driver.fmi_version() {
                FmiVersion::Two => "providesDirectionalDerivative is not set",
                FmiVersion::Three => "providesDirectionalDerivatives is not set",
            });
        }
        DerivativeKind::Adjoint if !claims_adjoint(&driver.xml) => {
            return not_applicable("providesAdjointDerivatives is not set");
        }
        DerivativeKind::Directional => ("GetDirectionalDerivative", element_directional_derivative),
        DerivativeKind::Adjoint => ("GetAdjointDerivative", element_adjoint_derivative),
    };
    let mut instance = driver.initialised_instance()?;
    driver.run_to_end(&mut instance)?;
    let (mut count, mut given, mut compared) = (0, 0, 0);
    for input in driver.continuous_variables(Causality::Input) {
        for output in driver.continuous_variables(Causality::Output) {
            let pair = format!("`{}` with respect to `{}`", output.name, input.name);
            driver.note_progress(&format!("{} of {pair}", driver.fmi_name(call)));
            count += 1;
            let Ok(found) = of(&mut instance, output, input) else {
                continue;
            };
            if !found.is_finite() {
                return violated_rule(format!("the derivative of {pair} is {found}"));
            }
            given += 1;
            let (expected, noise) = central_difference(&mut instance, output, input)?;
            compared += u32::from(expected != 0.0);
            let scale = expected.abs().max(found.abs());
            if expected != 0.0 && (expected - found).abs() > TOLERANCE * scale + noise {
                return violated_rule(format!(
                    "expected the derivative of {pair} to be {expected:.6e}, found {found:.6e}"
                ));
            }
        }
    }
    match (count, given) {
        (0, _) => not_applicable("there is no real continuous input or output"),
        (_, 0) => violated_rule(format!("none of {count} derivatives is given")),
        _ => Ok(format!("{given} of {count} derivatives, {compared} compared with differences")),
    }
}

fn claims_adjoint(xml: &str) -> bool {
    let Ok(document) = Document::parse(xml) else { return false };
    let root = document.root_element();
    let interface = root.children().find(|node| node.has_tag_name("CoSimulation"));
    let flag = interface.and_then(|node| node.attribute("providesAdjointDerivatives"));
    matches!(flag.map(str::trim), Some("true" | "1"))
}

/// The central difference of an output, and what rounding makes of it.
fn central_difference(
    instance: &mut Instance,
    output: &Variable,
    input: &Variable,
) -> Result<(f64, f64), CallError> {
    let real = |values: &[Value], place: usize| match values.get(place) {
        Some(Value::Real(value)) => *value,
        _ => f64::NAN,
    };
    let mut inputs = read_variable(instance, input)?;
    let held = real(&inputs, input.element.0);
    let size = input.nominal.unwrap_or(1.0).abs().max(held.abs());
    let moved = SHARE * size;
    let mut at = |value: f64| {
        if let Some(place) = inputs.get_mut(input.element.0) {
            *place = Value::Real(value);
        }
        instance.write_variable(input.storage, input.reference, &inputs)?;
        read_variable(instance, output).map(|shown| real(&shown, output.element.0))
    };
    let (above, below) = (at(held + moved)?, at(held - moved)?);
    at(held)?;
    let single = [input, output].iter().any(|it| it.storage == StorageType::Float32);
    let noise = if single { SINGLE_NOISE } else { NOISE };
    Ok(((above - below) / (2.0 * moved), noise * above.abs().max(below.abs()) / moved))
}

/// The first time derivatives of all elements of an output.
pub(super) fn output_time_derivatives(
    instance: &mut Instance,
    output: &Variable,
) -> Result<Vec<f64>, CallError> {
    match instance.description().version {
        FmiVersion::Two => instance.output_derivative(output.reference, 1).map(|value| vec![value]),
        FmiVersion::Three => instance.output_derivatives(to_array_variable(output), 1),
    }
}

fn check_output_derivatives(driver: &TestDriver) -> RuleResult {
    let about = driver.description();
    let mut done = Vec::new();
    let mut instance = driver.initialised_instance()?;
    if about.interpolated_inputs
        && let Some(input) = driver.continuous_variables(Causality::Input).next()
    {
        driver.set_inputs(&mut instance, 0, 0)?;
        driver.note_progress(&format!("fmi2SetRealInputDerivatives of `{}`", input.name));
        instance.set_input_derivative(input.reference, 1, 0.0)?;
        done.push(format!("an input derivative of `{}`", input.name));
    }
    driver.run_to_end(&mut instance)?;
    if about.output_derivatives > 0
        && let Some(output) = driver.continuous_variables(Causality::Output).next()
    {
        driver.note_progress(&format!("the time derivative of `{}`", output.name));
        let values = output_time_derivatives(&mut instance, output)?;
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return violated_rule(format!("the time derivative of `{}` is {value}", output.name));
        }
        done.push(format!("an output derivative of `{}`", output.name));
    }
    match done.is_empty() {
        true if driver.fmi_version() == FmiVersion::Three => {
            not_applicable("maxOutputDerivativeOrder is not set")
        }
        true => not_applicable("neither canInterpolateInputs nor maxOutputDerivativeOrder is set"),
        false => Ok(done.join(", ")),
    }
}
