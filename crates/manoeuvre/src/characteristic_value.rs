//! Characteristic values of a test, their descriptions, and errors in the parameters of a manoeuvre.

/// Name, unit and meaning of a characteristic value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacteristicValueInfo {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
}

/// A characteristic value: a number, or a list with one for each frequency.
#[derive(Debug, Clone, PartialEq)]
pub enum CharacteristicValue {
    /// One number; none where the car has no such value, such as the time of a peak that never came.
    Number(Option<f64>),
    /// Numbers.
    List(Vec<f64>),
}

/// The characteristic values of a test, by their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CharacteristicValues(pub Vec<(&'static str, CharacteristicValue)>);

impl CharacteristicValues {
    /// Adds a number.
    #[must_use]
    pub fn with_number(mut self, name: &'static str, value: impl Into<Option<f64>>) -> Self {
        self.0.push((name, CharacteristicValue::Number(value.into().filter(|it| it.is_finite()))));
        self
    }

    /// Adds a list.
    #[must_use]
    pub fn with_list(mut self, name: &'static str, values: Vec<f64>) -> Self {
        self.0.push((name, CharacteristicValue::List(values)));
        self
    }

    /// A number by its name.
    #[must_use]
    pub fn get_number(&self, name: &str) -> Option<f64> {
        let (_, found) = self.0.iter().find(|(known, _)| *known == name)?;
        if let CharacteristicValue::Number(number) = found { *number } else { None }
    }

    /// A list by its name.
    #[must_use]
    pub fn get_list(&self, name: &str) -> &[f64] {
        let found = self.0.iter().find(|(known, _)| *known == name);
        if let Some((_, CharacteristicValue::List(list))) = found { list } else { &[] }
    }
}

/// An error in a parameter of a manoeuvre.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterError {
    /// The key.
    pub key: &'static str,
    /// Whether it is a key of the kind, and not one that all kinds share.
    pub of_kind: bool,
    /// What was expected, and what was found.
    pub message: String,
}

impl ParameterError {
    /// A mistake at a key of the kind.
    #[must_use]
    pub fn at_kind_key(key: &'static str, message: String) -> Self {
        ParameterError { key, of_kind: true, message }
    }

    /// A mistake at a key that all kinds share.
    #[must_use]
    pub fn at_common_key(key: &'static str, message: String) -> Self {
        ParameterError { key, of_kind: false, message }
    }

    /// Refuses numbers that are not finite and above 0; the unit is that of the message.
    ///
    /// # Errors
    /// With the first one.
    pub fn check_positive<const N: usize>(keys: [(&'static str, f64, &str); N]) -> Result<(), Self> {
        let wrong = keys.into_iter().find(|(_, value, _)| !(value.is_finite() && *value > 0.0));
        wrong.map_or(Ok(()), |(key, value, unit)| {
            let message = format!("expected a number above 0 for `{key}` [{unit}], found {value}");
            Err(ParameterError::at_kind_key(key, message))
        })
    }
}
