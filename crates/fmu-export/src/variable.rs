//! Describes the variables of a model, one row each.

/// The types of FMI 2.0 that a variable may have; an enumeration is an integer with limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VariableKind {
    /// `fmi2Real`.
    Real,
    /// `fmi2Integer`.
    Integer,
    /// `fmi2Boolean`.
    Boolean,
    /// `fmi2String`.
    String,
}

/// Accessor of a variable inside the model; it determines the type.
#[derive(Debug)]
pub enum VariableAccess<M> {
    /// An `fmi2Real`.
    Real(fn(&mut M) -> &mut f64),
    /// An `fmi2Integer`.
    Integer(fn(&mut M) -> &mut i32),
    /// An `fmi2Boolean`.
    Boolean(fn(&mut M) -> &mut bool),
    /// An `fmi2String`.
    String(fn(&mut M) -> &mut String),
}

impl<M> VariableAccess<M> {
    /// The type of the variable.
    #[must_use]
    pub const fn kind(&self) -> VariableKind {
        match self {
            VariableAccess::Real(_) => VariableKind::Real,
            VariableAccess::Integer(_) => VariableKind::Integer,
            VariableAccess::Boolean(_) => VariableKind::Boolean,
            VariableAccess::String(_) => VariableKind::String,
        }
    }
}

/// Origin of a variable's values (FMI 2.0, section 2.2.7).
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
    /// For observation only.
    Local,
    /// The time [s], which the library writes into the model.
    Independent,
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

/// The inputs that an output depends on without a step in between.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputDependencies {
    /// On every input.
    All,
    /// On the named inputs only.
    On(&'static [&'static str]),
}

/// Attributes of a variable, independent of the model; [`VariableRow::at`] makes it a [`Variable`] of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VariableRow {
    /// Structured name, unique in the table: `tire_f.B`.
    pub name: &'static str,
    /// Unit of a real variable, such as `N.m/rad`; empty for the other types.
    pub unit: &'static str,
    /// Unit in which people read it, when it is not the usual one for its unit.
    pub display_unit: Option<&'static str>,
    /// One line about it.
    pub description: &'static str,
    /// Origin of its values.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How it gets its initial value; inputs and the time have none.
    pub initial: Option<Initial>,
    /// Smallest legal value.
    pub min: Option<f64>,
    /// Largest legal value.
    pub max: Option<f64>,
    /// Typical size.
    pub nominal: Option<f64>,
    /// For outputs: the inputs that they depend on directly.
    pub depends: OutputDependencies,
    /// For inputs: whether the start value means that nothing is connected.
    pub optional: bool,
    /// Whether it is a difference: the offset of its unit does not count.
    pub relative: bool,
}

/// One row of the table of variables.
#[derive(Debug)]
pub struct Variable<M> {
    /// Its attributes.
    pub row: VariableRow,
    /// Its accessor.
    pub access: VariableAccess<M>,
}

/// An input in `unit`.
#[must_use]
pub const fn input(name: &'static str, unit: &'static str, description: &'static str) -> VariableRow {
    VariableRow { causality: Causality::Input, initial: None, ..output(name, unit, description) }
}

/// An output in `unit`. It depends on every input directly, unless [`VariableRow::depends_on`] lists fewer.
#[must_use]
pub const fn output(name: &'static str, unit: &'static str, description: &'static str) -> VariableRow {
    VariableRow {
        name,
        unit,
        display_unit: None,
        description,
        causality: Causality::Output,
        variability: Variability::Continuous,
        initial: Some(Initial::Calculated),
        min: None,
        max: None,
        nominal: None,
        depends: OutputDependencies::All,
        optional: false,
        relative: false,
    }
}

/// A parameter in `unit`, fixed after initialisation unless it is made [`VariableRow::tunable`].
#[must_use]
pub const fn parameter(name: &'static str, unit: &'static str, description: &'static str) -> VariableRow {
    VariableRow {
        causality: Causality::Parameter,
        variability: Variability::Fixed,
        initial: Some(Initial::Exact),
        ..output(name, unit, description)
    }
}

/// A parameter in `unit` that the model computes from others while it is initialised; [`VariableRow::tunable`]
/// when it follows tunable ones.
#[must_use]
pub const fn calculated_parameter(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
) -> VariableRow {
    VariableRow {
        causality: Causality::CalculatedParameter,
        variability: Variability::Fixed,
        ..output(name, unit, description)
    }
}

/// A variable in `unit` for observation; it cannot be connected.
#[must_use]
pub const fn local(name: &'static str, unit: &'static str, description: &'static str) -> VariableRow {
    VariableRow { causality: Causality::Local, ..output(name, unit, description) }
}

/// A number or text that never changes: a local variable, or with `output(..).constant()` an output.
#[must_use]
pub const fn constant(name: &'static str, unit: &'static str, description: &'static str) -> VariableRow {
    local(name, unit, description).constant()
}

/// The time in `unit`, at most once in a table. It is real, and written before the outputs are computed.
#[must_use]
pub const fn independent(name: &'static str, unit: &'static str, description: &'static str) -> VariableRow {
    VariableRow { causality: Causality::Independent, initial: None, ..output(name, unit, description) }
}

/// `description::problems` reports combinations that FMI 2.0 does not allow.
impl VariableRow {
    /// Shows it in another unit of the same dimension; angles in deg, speeds in km/h and temperatures in
    /// degC need no mention.
    #[must_use]
    pub const fn display(self, unit: &'static str) -> Self {
        VariableRow { display_unit: Some(unit), ..self }
    }

    /// Sets the smallest legal value.
    #[must_use]
    pub const fn min(self, min: f64) -> Self {
        VariableRow { min: Some(min), ..self }
    }

    /// Sets the largest legal value.
    #[must_use]
    pub const fn max(self, max: f64) -> Self {
        VariableRow { max: Some(max), ..self }
    }

    /// Sets the typical size.
    #[must_use]
    pub const fn nominal(self, nominal: f64) -> Self {
        VariableRow { nominal: Some(nominal), ..self }
    }

    /// Lets a parameter be changed between steps, or a variable follow such a parameter.
    #[must_use]
    pub const fn tunable(self) -> Self {
        VariableRow { variability: Variability::Tunable, ..self }
    }

    /// Keeps a local variable as it is after initialisation.
    #[must_use]
    pub const fn fixed(self) -> Self {
        VariableRow { variability: Variability::Fixed, ..self }
    }

    /// Makes a real input, output or local variable discrete; the other types always are.
    #[must_use]
    pub const fn discrete(self) -> Self {
        VariableRow { variability: Variability::Discrete, ..self }
    }

    /// Keeps an output or local variable at its start value for ever.
    #[must_use]
    pub const fn constant(self) -> Self {
        VariableRow { variability: Variability::Constant, ..self }.exact().depends_on(&[])
    }

    /// Takes the initial value of an output or local variable from its start value, which the
    /// environment may set; `Model::initialise` leaves it alone.
    #[must_use]
    pub const fn exact(self) -> Self {
        VariableRow { initial: Some(Initial::Exact), ..self }
    }

    /// Takes the start value as a guess, from which `Model::initialise` computes the initial
    /// value.
    #[must_use]
    pub const fn approx(self) -> Self {
        VariableRow { initial: Some(Initial::Approx), ..self }
    }

    /// Computes the initial value without a start value, as is usual for outputs and local variables.
    #[must_use]
    pub const fn calculated(self) -> Self {
        VariableRow { initial: Some(Initial::Calculated), ..self }
    }

    /// Lets an input stay without a connection: its start value means none, such as a grade of 0. The description
    /// says so in an annotation of ours, which other tools pass over.
    #[must_use]
    pub const fn optional(self) -> Self {
        VariableRow { optional: true, ..self }
    }

    /// Lists the inputs that an output depends on directly; an empty list for a state.
    #[must_use]
    pub const fn depends_on(self, inputs: &'static [&'static str]) -> Self {
        VariableRow { depends: OutputDependencies::On(inputs), ..self }
    }

    /// A real variable with this accessor.
    pub const fn at<M>(self, at: fn(&mut M) -> &mut f64) -> Variable<M> {
        Variable { row: self, access: VariableAccess::Real(at) }
    }

    /// An integer variable with this accessor.
    pub const fn at_integer<M>(self, at: fn(&mut M) -> &mut i32) -> Variable<M> {
        Variable { row: self.discrete_if_continuous(), access: VariableAccess::Integer(at) }
    }

    /// A boolean variable with this accessor.
    pub const fn at_boolean<M>(self, at: fn(&mut M) -> &mut bool) -> Variable<M> {
        Variable { row: self.discrete_if_continuous(), access: VariableAccess::Boolean(at) }
    }

    /// A text variable with this accessor.
    pub const fn at_string<M>(self, at: fn(&mut M) -> &mut String) -> Variable<M> {
        Variable { row: self.discrete_if_continuous(), access: VariableAccess::String(at) }
    }

    /// Only real variables are continuous in FMI 2.0.
    const fn discrete_if_continuous(self) -> Self {
        match self.variability {
            Variability::Continuous => self.discrete(),
            _ => self,
        }
    }

    /// Whether the description gives a start value.
    pub(crate) const fn has_start(&self) -> bool {
        matches!(self.causality, Causality::Input)
            || matches!(self.initial, Some(Initial::Exact | Initial::Approx))
    }

    /// Whether its initial value is computed: what the description lists as `InitialUnknowns`.
    pub(crate) const fn is_initial_unknown(&self) -> bool {
        matches!(self.causality, Causality::CalculatedParameter)
            || matches!(self.causality, Causality::Output)
                && matches!(self.initial, Some(Initial::Calculated | Initial::Approx))
    }

    /// Whether FMI 2.0 allows this causality, variability and initial together (section 2.2.7).
    pub(crate) const fn is_legal(&self) -> bool {
        use Causality::{CalculatedParameter, Independent, Input, Local, Output, Parameter};
        use Initial::{Approx, Calculated, Exact};
        use Variability::{Constant, Continuous, Discrete, Fixed, Tunable};
        matches!(
            (self.causality, self.variability, self.initial),
            (Parameter, Fixed | Tunable, Some(Exact))
                | (CalculatedParameter | Local, Fixed | Tunable, Some(Calculated | Approx))
                | (Input, Discrete | Continuous, None)
                | (Output | Local, Constant, Some(Exact))
                | (Output | Local, Discrete | Continuous, Some(_))
                | (Independent, Continuous, None)
        )
    }
}
