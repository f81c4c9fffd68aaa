//! The numbers that an input accepts.

use fmu_import::description::{EnumerationItem, StorageType, describe_items};

/// Which numbers an input can take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AcceptedValues {
    /// A `Real` takes any, and leaves it to the run what a NaN does.
    Real,
    /// An integer takes those whole numbers of its form that `f64` holds exactly.
    Integer(StorageType),
    /// A `Boolean` takes 0 and 1.
    Boolean,
    /// An `Enumeration` takes the values of its items.
    Enumeration(Vec<EnumerationItem>),
}

impl AcceptedValues {
    /// Whether the number is a value of the type.
    #[must_use]
    #[inline]
    pub fn contains(&self, value: f64) -> bool {
        // The conversion saturates, so only a whole number is the same afterwards.
        let whole = |form: StorageType| {
            let inside =
                form.exact_integers().is_some_and(|[low, high]| (low..=high).contains(&(value as i128)));
            inside && value as i128 as f64 == value
        };
        match self {
            AcceptedValues::Real => true,
            AcceptedValues::Integer(form) => whole(*form),
            AcceptedValues::Boolean => value == 0.0 || value == 1.0,
            AcceptedValues::Enumeration(items) if items.is_empty() => whole(StorageType::Int32),
            AcceptedValues::Enumeration(items) => items.iter().any(|item| item.value as f64 == value),
        }
    }

    /// Whether an integer is a value of the type, also where no number holds it.
    #[must_use]
    pub fn contains_integer(&self, value: i128) -> bool {
        match self {
            AcceptedValues::Integer(form) => {
                form.integer_range().is_some_and(|[low, high]| (low..=high).contains(&value))
            }
            AcceptedValues::Enumeration(items) if !items.is_empty() => {
                items.iter().any(|item| i128::from(item.value) == value)
            }
            _ => self.contains(value as f64),
        }
    }

    /// The accepted integers, for a message about one that no number may hold.
    #[must_use]
    pub fn describe_integers(&self) -> String {
        match self {
            AcceptedValues::Integer(form) => {
                let [low, high] = form.integer_range().unwrap_or_default();
                format!("an {form:?}, which takes whole numbers from {low} to {high}")
            }
            other => other.describe_values(),
        }
    }

    /// The accepted numbers, for a message.
    #[must_use]
    pub fn describe_values(&self) -> String {
        match self {
            AcceptedValues::Real => "a Real, which takes any number".to_owned(),
            AcceptedValues::Integer(StorageType::Int32) => {
                "an Integer, which takes whole numbers of 32 bits".to_owned()
            }
            AcceptedValues::Integer(form) => {
                let [low, high] = form.exact_integers().unwrap_or_default();
                format!("an {form:?}, which takes whole numbers from {low} to {high}")
            }
            AcceptedValues::Boolean => "a Boolean, which takes 0 and 1".to_owned(),
            AcceptedValues::Enumeration(items) => {
                format!("an Enumeration, which takes {}", describe_items(items))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_takes_the_values_of_its_type_exactly() {
        let items = [("off", 0), ("armed", 3)];
        let items = items.map(|(name, value)| EnumerationItem { name: name.to_owned(), value });
        let mode = AcceptedValues::Enumeration(items.to_vec());
        let unknown = AcceptedValues::Enumeration(Vec::new());
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
            assert!(AcceptedValues::Real.contains(value));
            assert_eq!(AcceptedValues::Integer(StorageType::Int32).contains(value), integer, "{value}");
            assert_eq!(unknown.contains(value), integer, "{value}");
            assert_eq!(AcceptedValues::Boolean.contains(value), boolean, "{value}");
            assert_eq!(mode.contains(value), one_of, "{value}");
        }
    }

    #[test]
    fn an_integer_takes_what_fits_its_form_and_a_number_exactly() {
        let exact = 2.0_f64.powi(53);
        for (form, low, high) in [
            (StorageType::Int8, -128.0, 127.0),
            (StorageType::UInt8, 0.0, 255.0),
            (StorageType::UInt32, 0.0, 4_294_967_295.0),
            (StorageType::Int64, -exact, exact),
            (StorageType::UInt64, 0.0, exact),
        ] {
            let accepts = AcceptedValues::Integer(form);
            assert!(accepts.contains(low) && accepts.contains(high), "{form:?}");
            assert!(!accepts.contains(low - 2.0) && !accepts.contains(high + 2.0), "{form:?}");
            assert!(!accepts.contains(0.5));
        }
    }
}
