//! The numbers that an input accepts.

use fmu_import::description::{Item, list};

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

    /// The accepted numbers, for a message.
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
