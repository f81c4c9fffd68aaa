//! Checks the types at both ends of a connection, and gives the values that the input accepts.

use cosim::system::AcceptedValues;
use diagnostics::Error;
use fmu_import::description::{FmiType, describe_items};

use super::ports::Port;
use crate::document::{Connect, Convert, Scenario};

/// A start value that the variable could have, as it is written in a scenario.
pub(super) fn example_start_value(port: &Port) -> String {
    match (port.kind, port.items.first()) {
        (FmiType::Real, _) => "0.0".to_owned(),
        (FmiType::Boolean | FmiType::Clock, _) => "false".to_owned(),
        (FmiType::String | FmiType::Binary, _) => "\"\"".to_owned(),
        (FmiType::Enumeration, Some(item)) => format!("\"{}\"", item.name),
        (FmiType::Integer | FmiType::Enumeration, _) => "0".to_owned(),
    }
}

/// The change of type that one type takes to become the other, if there is one.
fn required_type_conversion(from: FmiType, to: FmiType) -> Option<(Convert, &'static str)> {
    Some(match (from, to) {
        (FmiType::Boolean, FmiType::Integer) => (Convert::BooleanToInteger, "boolean_to_integer"),
        (FmiType::Integer, FmiType::Boolean) => (Convert::IntegerToBoolean, "integer_to_boolean"),
        (FmiType::Enumeration, FmiType::Integer) => (Convert::EnumerationToInteger, "enumeration_to_integer"),
        (FmiType::Integer, FmiType::Enumeration) => (Convert::IntegerToEnumeration, "integer_to_enumeration"),
        (FmiType::Integer, FmiType::Real) => (Convert::IntegerToReal, "integer_to_real"),
        _ => return None,
    })
}

/// Checks that values of one port fit the other. A number may have to be one of those that the input
/// accepts; a text arrives as it is, and there is nothing to say about it.
pub(super) fn check_port_types(
    scenario: &Scenario,
    connect: &Connect,
    from: &Port,
    to: &Port,
) -> Result<Option<AcceptedValues>, Error> {
    let names = format!("`{}` to `{}`", connect.from.get_ref(), connect.to.get_ref());
    check_types_match(scenario, connect, &names, from, to)?;
    if connect.inverted && [from.kind, to.kind] != [FmiType::Real; 2] {
        let message = format!("{names} connects two flows of one direction, which only real numbers can be");
        return Err(scenario.error_at(&connect.to, message));
    }
    if from.kind == FmiType::Enumeration && to.kind == from.kind && from.items != to.items {
        let message = format!("cannot connect {names}: the enumerations differ");
        let help =
            format!("one has {}, the other {}", describe_items(&from.items), describe_items(&to.items));
        return Err(scenario.error_at(&connect.to, message).with_help(help));
    }
    Ok(Some(match to.kind {
        FmiType::String | FmiType::Binary => {
            if let Some(word) = &connect.transform {
                let message = format!("{names} carries texts, and `transform` acts on numbers only");
                return Err(scenario.error_at(word, message));
            }
            let Some((effect, span, _)) = connect.effects().into_iter().next() else {
                return Ok(None);
            };
            let message = format!("{names} carries texts, and `{effect}` acts on numbers only");
            return Err(scenario.source.error_at(span, message, ""));
        }
        FmiType::Real => AcceptedValues::Real,
        FmiType::Integer => AcceptedValues::Integer(to.storage),
        FmiType::Boolean | FmiType::Clock => AcceptedValues::Boolean,
        FmiType::Enumeration if to.items.is_empty() => AcceptedValues::Integer(to.storage),
        FmiType::Enumeration => AcceptedValues::Enumeration(to.items.clone()),
    }))
}

/// Checks that the types are the same, or that the scenario asks for the change that they need.
///
/// Numbers of signals and tables have no type: they fit every input of numbers that accepts their values. So do texts of tables.
fn check_types_match(
    scenario: &Scenario,
    connect: &Connect,
    names: &str,
    from: &Port,
    to: &Port,
) -> Result<(), Error> {
    let is_text = |port: &Port| matches!(port.kind, FmiType::String | FmiType::Binary);
    let same = from.kind == to.kind || (!from.typed && is_text(from) == is_text(to));
    let differ = || {
        let message = format!("cannot connect {names}: {:?} does not fit {:?}", from.kind, to.kind);
        scenario.error_at(&connect.to, message)
    };
    match (required_type_conversion(from.kind, to.kind), &connect.convert) {
        (_, None) if same => Ok(()),
        (_, Some(asked)) if same => {
            let message = format!("{names}: there is no type to convert");
            Err(scenario.error_at(asked, message).with_help("leave `convert` out"))
        }
        (Some((needed, _)), Some(asked)) if needed == *asked.get_ref() => Ok(()),
        (Some((_, needed)), Some(asked)) => {
            let message = format!("{names}: {:?} to {:?} is another conversion", from.kind, to.kind);
            Err(scenario.error_at(asked, message).with_help(format!("write `convert = \"{needed}\"`")))
        }
        (Some((_, needed)), None) => {
            Err(differ()
                .with_help(format!("if that is meant, add `convert = \"{needed}\"` to the connection")))
        }
        (None, _) => {
            Err(differ().with_help(format!("no `convert` makes {:?} into {:?}", from.kind, to.kind)))
        }
    }
}
