//! Describes signals: samples of one, and those that an analysis accepts.

/// Samples of one signal. Both columns have the same length, times [s] never fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal<'a> {
    /// The analysis' name for it.
    pub name: &'a str,
    /// The unit of the values.
    pub unit: &'a str,
    /// The time of each value [s].
    pub time: &'a [f64],
    /// The values.
    pub values: &'a [f64],
}

/// A signal that an analysis accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputSignal<T = &'static str> {
    /// Its name.
    pub name: T,
    /// The unit that the analysis expects; the program converts. Empty for any unit.
    pub unit: T,
    /// One line about it.
    pub description: T,
    /// Whether the analysis cannot do without it.
    pub required: bool,
}

impl InputSignal {
    /// A signal that the analysis cannot do without.
    #[must_use]
    pub const fn required(name: &'static str, unit: &'static str, description: &'static str) -> Self {
        Self { name, unit, description, required: true }
    }

    /// A signal that the analysis uses when it is there.
    #[must_use]
    pub const fn optional(name: &'static str, unit: &'static str, description: &'static str) -> Self {
        Self { name, unit, description, required: false }
    }
}
