//! Checks that the claimed derivatives exist and agree with differences of the outputs.

use fmu_import::description::{FmiType, Variable};
use fmu_import::{
    ArrayVariable, CallError, Causality, FmiVersion, Instance, StorageType, Value, Variability,
};
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
        name: "dependencies",
        rank: BreaksStandard,
        sentence: "outputs follow at once only the inputs that their dependencies list",
        versions: BOTH,
        check: RuleCheck::RunsOne(check_dependencies),
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
                FmiVersion::One | FmiVersion::Two => "providesDirectionalDerivative is not set",
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

/// What an output does not depend on (FMI 2.0, section 2.2.8; FMI 3.0, section 2.4.8) must not move it. Who steps by these lists gets
/// a value of the last step otherwise. An output that changes when it is only read again says nothing.
fn check_dependencies(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.initialised_instance()?;
    driver.run_to_end(&mut instance)?;
    let variables = &driver.description().variables;
    let places = |causality| {
        let all = driver.description().indices_with_causality(causality);
        all.filter(|place| variables[*place].kind == FmiType::Real && variables[*place].element.1 == 1)
            .collect::<Vec<_>>()
    };
    let (mut count, mut wrong) = (0, Vec::new());
    for input in places(Causality::Input) {
        for output in places(Causality::Output) {
            let Some(dependencies) = &variables[output].dependencies else { continue };
            if dependencies.contains(&input) || variables[input].variability != Variability::Continuous {
                continue;
            }
            let (input, output) = (&variables[input], &variables[output]);
            driver.note_progress(&format!("moving `{}`, to look at `{}`", input.name, output.name));
            count += 1;
            if is_moved_by(&mut instance, output, input)? {
                wrong.push(format!("`{}` follows `{}`", output.name, input.name));
            }
        }
    }
    match wrong.is_empty() {
        true => Ok(format!("{count} pairs that exclude each other")),
        false => violated_rule(format!("{}, which its dependencies do not list", wrong.join(", "))),
    }
}

/// Whether an output has another value as soon as an input has one.
fn is_moved_by(instance: &mut Instance, output: &Variable, input: &Variable) -> Result<bool, CallError> {
    let held = read_variable(instance, input)?;
    let (before, again) = (read_variable(instance, output)?, read_variable(instance, output)?);
    let Some(Value::Real(value)) = held.first() else { return Ok(false) };
    let size = input.nominal.unwrap_or(1.0).abs().max(value.abs());
    let inside = input.max.is_none_or(|max| value + SHARE * size <= max);
    let moved = if inside { value + SHARE * size } else { value - SHARE * size };
    instance.write_variable(input.storage, input.reference, &[Value::Real(moved)])?;
    let after = read_variable(instance, output)?;
    instance.write_variable(input.storage, input.reference, &held)?;
    Ok(before == again && after != before)
}

/// The time derivatives of an order of all elements of an output.
pub(super) fn output_time_derivatives(
    instance: &mut Instance,
    output: &Variable,
    order: i32,
) -> Result<Vec<f64>, CallError> {
    match instance.description().version {
        FmiVersion::One | FmiVersion::Two => {
            instance.output_derivative(output.reference, order).map(|value| vec![value])
        }
        FmiVersion::Three => instance.output_derivatives(to_array_variable(output), order),
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
        // Each order up to the largest can be asked for (FMI 2.0, table of section 4.3.1; FMI 3.0, section 4.2.2).
        for order in 1..=i32::try_from(about.output_derivatives).unwrap_or(i32::MAX) {
            let of = format!("the time derivative of order {order} of `{}`", output.name);
            driver.note_progress(&of);
            let values = output_time_derivatives(&mut instance, output, order).map_err(|mut error| {
                error.what += &format!(" for {of}");
                error
            })?;
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return violated_rule(format!("{of} is {value}"));
            }
        }
        done.push(format!("output derivatives of `{}`", output.name));
    }
    match done.is_empty() {
        true if driver.fmi_version() == FmiVersion::Three => {
            not_applicable("maxOutputDerivativeOrder is not set")
        }
        true => not_applicable("neither canInterpolateInputs nor maxOutputDerivativeOrder is set"),
        false => Ok(done.join(", ")),
    }
}
