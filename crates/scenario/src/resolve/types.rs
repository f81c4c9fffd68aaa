//! Checks the types at both ends of a connection, and gives the values that the input accepts.

use cosim::system::AcceptedValues;
use diagnostics::Error;
use fmu_import::description::{Type, describe_items};

use super::ports::Port;
use crate::document::{Connect, Convert, Scenario};

/// A start value that the variable could have, as it is written in a scenario.
pub(super) fn example(port: &Port) -> String {
    match (port.kind, port.items.first()) {
        (Type::Real, _) => "0.0".to_owned(),
        (Type::Boolean | Type::Clock, _) => "false".to_owned(),
        (Type::String | Type::Binary, _) => "\"\"".to_owned(),
        (Type::Enumeration, Some(item)) => format!("\"{}\"", item.name),
        (Type::Integer | Type::Enumeration, _) => "0".to_owned(),
    }
}

/// The change of type that one type takes to become the other, if there is one.
fn conversion(from: Type, to: Type) -> Option<(Convert, &'static str)> {
    Some(match (from, to) {
        (Type::Boolean, Type::Integer) => (Convert::BooleanToInteger, "boolean_to_integer"),
        (Type::Integer, Type::Boolean) => (Convert::IntegerToBoolean, "integer_to_boolean"),
        (Type::Enumeration, Type::Integer) => {
            (Convert::EnumerationToInteger, "enumeration_to_integer")
        }
        (Type::Integer, Type::Enumeration) => {
            (Convert::IntegerToEnumeration, "integer_to_enumeration")
        }
        (Type::Integer, Type::Real) => (Convert::IntegerToReal, "integer_to_real"),
        _ => return None,
    })
}

/// Checks that values of one port fit the other. A number may have to be one of those that the input
/// accepts; a text arrives as it is, and there is nothing to say about it.
pub(super) fn fit(
    scenario: &Scenario,
    connect: &Connect,
    from: &Port,
    to: &Port,
) -> Result<Option<AcceptedValues>, Error> {
    let names = format!("`{}` to `{}`", connect.from.get_ref(), connect.to.get_ref());
    types_fit(scenario, connect, &names, from, to)?;
    if connect.inverted && [from.kind, to.kind] != [Type::Real; 2] {
        let message =
            format!("{names} connects two flows of one direction, which only real numbers can be");
        return Err(scenario.error(&connect.to, message));
    }
    if from.kind == Type::Enumeration && to.kind == from.kind && from.items != to.items {
        let message = format!("cannot connect {names}: the enumerations differ");
        let help = format!(
            "one has {}, the other {}",
            describe_items(&from.items),
            describe_items(&to.items)
        );
        return Err(scenario.error(&connect.to, message).help(help));
    }
    Ok(Some(match to.kind {
        Type::String | Type::Binary => {
            if let Some(word) = &connect.transform {
                let message =
                    format!("{names} carries texts, and `transform` acts on numbers only");
                return Err(scenario.error(word, message));
            }
            let Some((effect, span, _)) = connect.effects().into_iter().next() else {
                return Ok(None);
            };
            let message = format!("{names} carries texts, and `{effect}` acts on numbers only");
            return Err(scenario.source.error(span, message, ""));
        }
        Type::Real => AcceptedValues::Real,
        Type::Integer => AcceptedValues::Integer(to.storage),
        Type::Boolean | Type::Clock => AcceptedValues::Boolean,
        Type::Enumeration if to.items.is_empty() => AcceptedValues::Integer(to.storage),
        Type::Enumeration => AcceptedValues::Enumeration(to.items.clone()),
    }))
}

/// Checks that the types are the same, or that the scenario asks for the change that they need.
///
/// Numbers of signals and tables have no type: they fit every input of numbers that accepts their values. So do texts of tables.
fn types_fit(
    scenario: &Scenario,
    connect: &Connect,
    names: &str,
    from: &Port,
    to: &Port,
) -> Result<(), Error> {
    let is_text = |port: &Port| matches!(port.kind, Type::String | Type::Binary);
    let same = from.kind == to.kind || (!from.typed && is_text(from) == is_text(to));
    let differ = || {
        let message = format!("cannot connect {names}: {:?} does not fit {:?}", from.kind, to.kind);
        scenario.error(&connect.to, message)
    };
    match (conversion(from.kind, to.kind), &connect.convert) {
        (_, None) if same => Ok(()),
        (_, Some(asked)) if same => {
            let message = format!("{names}: there is no type to convert");
            Err(scenario.error(asked, message).help("leave `convert` out"))
        }
        (Some((needed, _)), Some(asked)) if needed == *asked.get_ref() => Ok(()),
        (Some((_, needed)), Some(asked)) => {
            let message =
                format!("{names}: {:?} to {:?} is another conversion", from.kind, to.kind);
            Err(scenario.error(asked, message).help(format!("write `convert = \"{needed}\"`")))
        }
        (Some((_, needed)), None) => Err(differ()
            .help(format!("if that is meant, add `convert = \"{needed}\"` to the connection"))),
        (None, _) => {
            Err(differ().help(format!("no `convert` makes {:?} into {:?}", from.kind, to.kind)))
        }
    }
}
