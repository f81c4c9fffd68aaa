//! Turns connections between parameters into start values.

use diagnostics::Error;
use fmu_import::description::{FmiType, Variable};
use fmu_import::{Causality, Value, Variability};
use ssp::{Connection, SspSystem, StartValue};

use super::{connection_unit_conversion, error_at, ssp_value_to_toml};

/// Whether a variable takes its value before the run, section 5.3.2.1: what is connected to it is a start value.
pub(super) fn is_parameter(variable: &Variable) -> bool {
    matches!(variable.causality, Causality::Parameter | Causality::StructuralParameter)
}

/// Whether what is connected to a variable is its start value. A tunable parameter takes what an FMU computes during the run, as an input
/// does.
pub(super) fn is_start(source: &Variable, target: &Variable) -> bool {
    let tuned = target.variability == Variability::Tunable && !is_fixed(source);
    is_parameter(target) && !(tuned && target.causality == Causality::Parameter)
}

fn is_fixed(source: &Variable) -> bool {
    source.variability == Variability::Constant || is_parameter(source)
}

/// The value of the parameter at the end of a connection, as TOML.
///
/// # Errors
/// When the FMU at its start computes the value: that is too late for a parameter.
pub(super) fn parameter_start_toml(
    system: &SspSystem,
    connection: &Connection,
    source: &Variable,
    target: &Variable,
) -> Result<String, Error> {
    let Connection { from, to, conversion: way } = connection;
    let known = is_fixed(source);
    let component = system.components.get(from.component);
    let bound = component.and_then(|it| it.start_values.iter().find(|it| it.variable == from.variable));
    if let Some(bound) = bound.filter(|_| known && is_parameter(source)) {
        let value = super::converted_start_value(bound, source)?;
        return converted_start_toml(connection, value, source, target);
    }
    match source.start_value().filter(|_| known) {
        Some(value) => converted_start_toml(connection, ssp_value(&value, source), source, target),
        None => Err(error_at(
            &way.position,
            format!(
                "expected a constant or a parameter for the parameter `{}`, found `{}`, which is {:?}: its FMU computes it when all parameters are set already; bind the value in a ParameterBinding",
                to.variable, from.variable, source.causality
            ),
        )),
    }
}

fn converted_start_toml(
    connection: &Connection,
    value: ssp::SspValue,
    source: &Variable,
    target: &Variable,
) -> Result<String, Error> {
    let way = &connection.conversion;
    let (factor, offset) = connection_unit_conversion(way, source, target)?;
    let start = StartValue {
        variable: connection.to.variable.clone(),
        value,
        unit: None,
        connector_unit: None,
        transformation: way.transformation.clone(),
        position: way.position.clone(),
    };
    let value = start.converted_value(factor, offset).ok_or_else(|| {
        error_at(&way.position, "expected a number for a conversion or transformation, found none")
    })?;
    Ok(ssp_value_to_toml(&value, target))
}

/// A value of an FMU as SSP has it: a number of an Enumeration by the name of its item.
pub(crate) fn ssp_value(value: &Value, variable: &Variable) -> ssp::SspValue {
    let item = |number: i128| {
        let mut items = variable.items.iter();
        let item = items.find(|item| i128::from(item.value) == number);
        item.filter(|_| variable.kind == FmiType::Enumeration).map(|item| item.name.clone())
    };
    match value {
        Value::Real(real) => ssp::SspValue::Real(*real),
        Value::Integer(number) => {
            item(*number).map_or(ssp::SspValue::Integer(*number), ssp::SspValue::Enumeration)
        }
        Value::Boolean(truth) => ssp::SspValue::Boolean(*truth),
        Value::String(text) => ssp::SspValue::String(text.clone()),
        Value::Binary(bytes) => ssp::SspValue::Binary(bytes.clone()),
    }
}
