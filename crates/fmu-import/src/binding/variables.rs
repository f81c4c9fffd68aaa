//! Gets and sets one variable of any type as a list of values.

use super::Instance;
use crate::{CallError, StorageType, Value};

impl Instance {
    /// The values of all elements of one variable.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn read_variable(
        &mut self,
        storage: StorageType,
        reference: u32,
        elements: usize,
    ) -> Result<Vec<Value>, CallError> {
        Ok(match storage {
            StorageType::Float32 | StorageType::Float64 | StorageType::Boolean => {
                let mut numbers = vec![0.0; elements];
                self.get_numbers(storage, &[reference], &mut numbers)?;
                let value = |number: f64| match storage {
                    StorageType::Boolean => Value::Boolean(number != 0.0),
                    _ => Value::Real(number),
                };
                numbers.into_iter().map(value).collect()
            }
            StorageType::String => {
                self.get_strings(reference, elements)?.into_iter().map(Value::String).collect()
            }
            StorageType::Binary => {
                self.get_binaries(reference, elements)?.into_iter().map(Value::Binary).collect()
            }
            _ => self.get_integers(storage, reference, elements)?.into_iter().map(Value::Integer).collect(),
        })
    }

    /// Gives all elements of one variable values of its type; what is of another type is left out.
    ///
    /// # Errors
    /// See [`Instance`]; also when a text contains NUL.
    pub fn write_variable(
        &mut self,
        storage: StorageType,
        reference: u32,
        values: &[Value],
    ) -> Result<(), CallError> {
        match storage {
            StorageType::Float32 | StorageType::Float64 | StorageType::Boolean => {
                let number = |value: &Value| match value {
                    Value::Real(value) => Some(*value),
                    Value::Boolean(value) => Some(f64::from(u8::from(*value))),
                    _ => None,
                };
                let numbers: Vec<_> = values.iter().filter_map(number).collect();
                self.set_numbers(storage, &[reference], &numbers)
            }
            StorageType::String => {
                let text = |value: &Value| match value {
                    Value::String(text) => Some(text.clone()),
                    _ => None,
                };
                self.set_strings(reference, &values.iter().filter_map(text).collect::<Vec<_>>())
            }
            StorageType::Binary => {
                let bytes = |value: &Value| match value {
                    Value::Binary(bytes) => Some(bytes.clone()),
                    _ => None,
                };
                self.set_binaries(reference, &values.iter().filter_map(bytes).collect::<Vec<_>>())
            }
            _ => {
                let integer = |value: &Value| match value {
                    Value::Integer(integer) => Some(*integer),
                    _ => None,
                };
                let integers: Vec<_> = values.iter().filter_map(integer).collect();
                self.set_integers(storage, reference, &integers)
            }
        }
    }
}

impl Instance {
    /// The names of variables, for a message.
    pub(super) fn list_variable_names(&self, references: &[u32]) -> String {
        let all = &self.library.description().variables;
        let name = |reference: &u32| {
            let found = all.iter().find(|variable| variable.reference == *reference);
            found.map_or_else(|| reference.to_string(), |variable| format!("`{}`", variable.name))
        };
        references.iter().map(name).collect::<Vec<_>>().join(", ")
    }
}
