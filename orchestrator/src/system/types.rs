//! Says which types fit each other, what must be asked for, and which values an input can take.

use super::nodes::Port;
use crate::error::Error;
use crate::fmu::description::{Item, Type, list};
use crate::scenario::{Connect, Convert, Scenario};

/// Which numbers an input can take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Accepts {
    /// A `Real` takes any, and leaves it to the run what a NaN does.
    Real,
    /// An `Integer` takes whole numbers of 32 bits.
    Integer,
    /// A `Boolean` takes 0 and 1.
    Boolean,
    /// An `Enumeration` takes the values of its items.
    Enumeration(Vec<Item>),
}

impl Accepts {
    /// Whether the number is a value of the type.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        // The conversion saturates, so only a whole number of 32 bits is the same afterwards.
        let whole = || f64::from(value as i32) == value;
        match self {
            Accepts::Real => true,
            Accepts::Integer => whole(),
            Accepts::Boolean => value == 0.0 || value == 1.0,
            Accepts::Enumeration(items) if items.is_empty() => whole(),
            Accepts::Enumeration(items) => items.iter().any(|item| f64::from(item.value) == value),
        }
    }

    /// What the type takes, for a message.
    #[must_use]
    pub fn expected(&self) -> String {
        match self {
            Accepts::Real => "a Real, which takes any number".to_owned(),
            Accepts::Integer => "an Integer, which takes whole numbers of 32 bits".to_owned(),
            Accepts::Boolean => "a Boolean, which takes 0 and 1".to_owned(),
            Accepts::Enumeration(items) => format!("an Enumeration, which takes {}", list(items)),
        }
    }
}

/// A start value that the variable could have, as it is written in a scenario.
pub(super) fn example(port: &Port) -> String {
    match (port.kind, port.items.first()) {
        (Type::Real, _) => "0.0".to_owned(),
        (Type::Boolean, _) => "false".to_owned(),
        (Type::String, _) => "\"\"".to_owned(),
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
    (from, to): (&Port, &Port),
) -> Result<Option<Accepts>, Error> {
    let names = format!("`{}` to `{}`", connect.from.get_ref(), connect.to.get_ref());
    types_fit(scenario, connect, &names, (from, to))?;
    if from.kind == Type::Enumeration && to.kind == from.kind && from.items != to.items {
        let message = format!("cannot connect {names}: the enumerations differ");
        let help = format!("one has {}, the other {}", list(&from.items), list(&to.items));
        return Err(scenario.error(&connect.to, message).help(help));
    }
    Ok(Some(match to.kind {
        Type::String => {
            let Some((effect, place)) = connect.first_effect() else { return Ok(None) };
            let message = format!("{names} carries texts, and `{effect}` acts on numbers only");
            return Err(scenario.source.error(place, message, ""));
        }
        Type::Real => Accepts::Real,
        Type::Integer => Accepts::Integer,
        Type::Boolean => Accepts::Boolean,
        Type::Enumeration => Accepts::Enumeration(to.items.clone()),
    }))
}

/// Checks that the types are the same, or that the scenario asks for the change that they need.
///
/// What signals and tables deliver has no type, so it fits every number, as long as its values do.
fn types_fit(
    scenario: &Scenario,
    connect: &Connect,
    names: &str,
    (from, to): (&Port, &Port),
) -> Result<(), Error> {
    let same = from.kind == to.kind || (!from.typed && to.kind != Type::String);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_takes_the_values_of_its_type_exactly() {
        let items = [("off", 0), ("armed", 3)];
        let items = items.map(|(name, value)| Item { name: name.to_owned(), value });
        let mode = Accepts::Enumeration(items.to_vec());
        let unknown = Accepts::Enumeration(Vec::new());
        for (value, integer, boolean, one_of) in [
            (0.0, true, true, true),
            (-0.0, true, true, true),
            (1.0, true, true, false),
            (3.0, true, false, true),
            (0.5, false, false, false),
            (-1.0, true, false, false),
            (1.0 + f64::EPSILON, false, false, false),
            (2_147_483_647.0, true, false, false),
            (2_147_483_648.0, false, false, false),
            (-2_147_483_648.0, true, false, false),
            (f64::NAN, false, false, false),
            (f64::INFINITY, false, false, false),
        ] {
            assert!(Accepts::Real.holds(value));
            assert_eq!(Accepts::Integer.holds(value), integer, "{value}");
            assert_eq!(unknown.holds(value), integer, "{value}");
            assert_eq!(Accepts::Boolean.holds(value), boolean, "{value}");
            assert_eq!(mode.holds(value), one_of, "{value}");
        }
    }
}
