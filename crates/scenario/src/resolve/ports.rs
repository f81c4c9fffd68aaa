//! Describes ports, the variables of nodes that can be connected or recorded.

use std::sync::Arc;

use cosim::assembly::{is_discrete, is_tunable};
use cosim::quantity::InputUnit;
use fmu_import::Variability;
use fmu_import::description::{EnumerationItem, FmiType, StorageType, Variable};
use units::Unit;

/// The side of a node that a port is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum PortSide {
    Input,
    Output,
}

/// A variable that can be connected or recorded.
#[derive(Debug, Clone)]
pub(super) struct Port {
    pub name: String,
    pub kind: FmiType,
    /// Signals and tables deliver numbers that are of no type of FMI.
    pub typed: bool,
    /// Items of an enumeration.
    pub items: Vec<EnumerationItem>,
    pub unit: Option<String>,
    pub dimension: Option<Unit>,
    /// Of a difference, the offset that its unit has in the description of its FMU and that does not count, in SI units.
    pub relative: Option<f64>,
    /// Whether something is wrong with its unit that was told already.
    pub wrong_unit: bool,
    pub description: Option<String>,
    pub reference: u32,
    /// The form of its values.
    pub storage: StorageType,
    /// Its index in an array, and the number of elements there.
    pub element: (usize, usize),
    /// Whether it is a real number that changes continuously.
    pub continuous: bool,
    /// Whether it is an input or a tunable parameter that changes at events only, of an FMU with event mode.
    pub discrete: bool,
    /// Whether it is a tunable parameter.
    pub tunable: bool,
    /// The value references of its clocks, of an FMU with event mode.
    pub clocks: Vec<u32>,
    /// Of an input, whether its start value means that nothing is connected.
    pub optional: bool,
    /// Its index among the variables of its FMU.
    pub index: usize,
    /// For outputs, the places of the inputs that they follow; `None` means all.
    pub follows: Option<Arc<[usize]>>,
}

impl Port {
    /// The unit of an input, for numbers that have one of their own.
    pub fn input_unit(&self) -> InputUnit<'_> {
        InputUnit {
            name: self.unit.as_deref(),
            definition: self.dimension,
            is_difference: self.relative.is_some(),
        }
    }

    /// The port of a real number without more, of a node that is no FMU.
    pub fn real_port(name: &str, unit: Option<String>, dimension: Option<Unit>) -> Self {
        Port {
            name: name.to_owned(),
            kind: FmiType::Real,
            typed: false,
            items: Vec::new(),
            dimension,
            relative: None,
            unit,
            wrong_unit: false,
            description: None,
            reference: 0,
            storage: StorageType::Float64,
            element: (0, 1),
            continuous: true,
            discrete: false,
            tunable: false,
            clocks: Vec::new(),
            optional: false,
            index: 0,
            follows: Some(Arc::default()),
        }
    }
}

/// The port of a variable, of an FMU that has event mode or has not.
pub(super) fn fmu_port(variables: &[Variable], index: usize, events: bool) -> Port {
    let variable = &variables[index];
    Port {
        name: variable.name.clone(),
        kind: variable.kind,
        typed: true,
        items: variable.items.clone(),
        unit: variable.offset_free_unit_name(),
        dimension: variable.dimension,
        relative: variable.relative,
        wrong_unit: false,
        description: variable.description.clone(),
        reference: variable.reference,
        storage: variable.storage,
        element: variable.element,
        continuous: variable.kind == FmiType::Real && variable.variability == Variability::Continuous,
        discrete: events && is_discrete(variable),
        tunable: is_tunable(variable),
        clocks: if events { variable.clocks.clone() } else { Vec::new() },
        optional: variable.optional,
        index,
        follows: variable.dependencies.clone(),
    }
}
