//! Describes the members of a model that the outside world may see, one row each.

/// How to reach a variable inside the model, and so its type.
#[derive(Debug)]
pub enum Access<M> {
    /// An `fmi2Real`.
    Real(fn(&mut M) -> &mut f64),
    /// An `fmi2Integer`.
    Integer(fn(&mut M) -> &mut i32),
    /// An `fmi2Boolean`.
    Boolean(fn(&mut M) -> &mut bool),
    /// An `fmi2String`.
    String(fn(&mut M) -> &mut String),
}

/// Who determines a variable (FMI 2.0, section 2.2.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Constant during the simulation, given by the environment.
    Parameter,
    /// Constant during the simulation, computed from parameters.
    CalculatedParameter,
    /// Given by the environment at communication points.
    Input,
    /// Given to the environment at communication points.
    Output,
    /// For looking at only.
    Local,
}

/// When a variable may change (FMI 2.0, section 2.2.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variability {
    /// Never.
    Constant,
    /// Never after initialisation.
    Fixed,
    /// Between communication points, by the environment.
    Tunable,
    /// At events only.
    Discrete,
    /// At any time.
    Continuous,
}

/// How a variable gets its initial value (FMI 2.0, section 2.2.7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    /// It is the start value.
    Exact,
    /// It is computed, starting from the start value.
    Approx,
    /// It is computed.
    Calculated,
}

/// The inputs that an output follows without a step in between.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depends {
    /// On every input.
    All,
    /// On the named inputs only.
    On(&'static [&'static str]),
}

/// What a variable is, whatever model it belongs to; [`Row::at`] makes it a [`Variable`] of one.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Structured name, unique in the table: `tire_f.B`.
    pub name: &'static str,
    /// Unit of a real variable, see [`crate::unit`]; empty for the other types.
    pub unit: &'static str,
    /// One line about it.
    pub description: &'static str,
    /// Who determines it.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How it gets its initial value; inputs have none.
    pub initial: Option<Initial>,
    /// Smallest legal value.
    pub min: Option<f64>,
    /// Largest legal value.
    pub max: Option<f64>,
    /// Typical size.
    pub nominal: Option<f64>,
    /// For outputs, what they follow directly.
    pub depends: Depends,
}

/// One row of the table of variables.
#[derive(Debug)]
pub struct Variable<M> {
    /// What it is.
    pub row: Row,
    /// Where it is in the model.
    pub access: Access<M>,
}

/// An input in `unit`.
#[must_use]
pub const fn input(name: &'static str, unit: &'static str, description: &'static str) -> Row {
    Row { causality: Causality::Input, initial: None, ..output(name, unit, description) }
}

/// An output in `unit`, which follows every input directly unless [`Row::depends_on`] says less.
#[must_use]
pub const fn output(name: &'static str, unit: &'static str, description: &'static str) -> Row {
    Row {
        name,
        unit,
        description,
        causality: Causality::Output,
        variability: Variability::Continuous,
        initial: Some(Initial::Calculated),
        min: None,
        max: None,
        nominal: None,
        depends: Depends::All,
    }
}

/// A parameter in `unit`, fixed after initialisation unless it is made [`Row::tunable`].
#[must_use]
pub const fn parameter(name: &'static str, unit: &'static str, description: &'static str) -> Row {
    Row {
        causality: Causality::Parameter,
        variability: Variability::Fixed,
        initial: Some(Initial::Exact),
        ..output(name, unit, description)
    }
}

impl Row {
    /// Sets the smallest legal value.
    #[must_use]
    pub const fn min(self, min: f64) -> Self {
        Row { min: Some(min), ..self }
    }

    /// Sets the largest legal value.
    #[must_use]
    pub const fn max(self, max: f64) -> Self {
        Row { max: Some(max), ..self }
    }

    /// Sets the typical size.
    #[must_use]
    pub const fn nominal(self, nominal: f64) -> Self {
        Row { nominal: Some(nominal), ..self }
    }

    /// Lets a parameter be changed between steps.
    #[must_use]
    pub const fn tunable(self) -> Self {
        Row { variability: Variability::Tunable, ..self }
    }

    /// Says which inputs an output follows directly; an empty list for a state.
    #[must_use]
    pub const fn depends_on(self, inputs: &'static [&'static str]) -> Self {
        Row { depends: Depends::On(inputs), ..self }
    }

    /// A real variable at this place of the model.
    pub const fn at<M>(self, at: fn(&mut M) -> &mut f64) -> Variable<M> {
        Variable { row: self, access: Access::Real(at) }
    }

    /// An integer variable at this place of the model; it has no unit.
    pub const fn at_integer<M>(self, at: fn(&mut M) -> &mut i32) -> Variable<M> {
        Variable { row: self.without_unit(), access: Access::Integer(at) }
    }

    /// A boolean variable at this place of the model; it has no unit.
    pub const fn at_boolean<M>(self, at: fn(&mut M) -> &mut bool) -> Variable<M> {
        Variable { row: self.without_unit(), access: Access::Boolean(at) }
    }

    /// A text variable at this place of the model; it has no unit.
    pub const fn at_string<M>(self, at: fn(&mut M) -> &mut String) -> Variable<M> {
        Variable { row: self.without_unit(), access: Access::String(at) }
    }

    /// FMI 2.0 knows units, and change at any time, of real variables only.
    const fn without_unit(self) -> Self {
        let variability = match self.variability {
            Variability::Continuous => Variability::Discrete,
            other => other,
        };
        Row { unit: "", variability, ..self }
    }

    /// Whether the environment may write it before initialisation ends.
    pub(crate) const fn has_start(&self) -> bool {
        matches!(self.causality, Causality::Input)
            || matches!(self.initial, Some(Initial::Exact | Initial::Approx))
    }
}
