//! Describes the variables of nodes that can be connected or recorded, and groups those that are read and written at once.

use std::sync::Arc;

use fmu_import::description::{EnumerationItem, Storage, Type, Variable};
use fmu_import::{Causality, Variability};
use recording::ValueKind;
use units::Unit;

use super::types::recorded_kind;
use crate::plan::{Group, Ports};

/// The side of a node that a port is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    Input,
    Output,
}

/// A variable that can be connected or recorded.
#[derive(Debug, Clone)]
pub(super) struct Port {
    pub name: String,
    pub kind: Type,
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
    pub storage: Storage,
    /// Its place in an array, and the number of elements there.
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
    /// Its place among the variables of its FMU.
    pub place: usize,
    /// For outputs, the places of the inputs that they follow; `None` means all.
    pub follows: Option<Arc<[usize]>>,
}

impl Port {
    /// The port of a real number without more, of a node that is no FMU.
    pub fn real(name: &str, unit: Option<String>, dimension: Option<Unit>) -> Self {
        Port {
            name: name.to_owned(),
            kind: Type::Real,
            typed: false,
            items: Vec::new(),
            dimension,
            relative: None,
            unit,
            wrong_unit: false,
            description: None,
            reference: 0,
            storage: Storage::Float64,
            element: (0, 1),
            continuous: true,
            discrete: false,
            tunable: false,
            clocks: Vec::new(),
            optional: false,
            place: 0,
            follows: Some(Arc::default()),
        }
    }
}

/// The port of a variable, of an FMU that has event mode or has not.
pub(super) fn port(variables: &[Variable], place: usize, events: bool) -> Port {
    let variable = &variables[place];
    let tunable = is_tunable(variable);
    Port {
        name: variable.name.clone(),
        kind: variable.kind,
        typed: true,
        items: variable.items.clone(),
        unit: variable.plain_unit(),
        dimension: variable.dimension,
        relative: variable.relative,
        wrong_unit: false,
        description: variable.description.clone(),
        reference: variable.reference,
        storage: variable.storage,
        element: variable.element,
        continuous: variable.kind == Type::Real && variable.variability == Variability::Continuous,
        discrete: events
            && (tunable || variable.causality == Causality::Input)
            && variable.variability != Variability::Continuous,
        tunable,
        clocks: if events { variable.clocks.clone() } else { Vec::new() },
        optional: variable.optional,
        place,
        follows: variable.dependencies.clone(),
    }
}

/// Whether a variable is a parameter that may get other values during a run: between communication points, in event mode of FMUs that have
/// it (FMI 2.0.4, section 4.2.4; FMI 3.0, section 2.4.7.4).
pub(super) fn is_tunable(variable: &Variable) -> bool {
    (variable.causality, variable.variability) == (Causality::Parameter, Variability::Tunable)
}

/// The variables behind ports, which are in the order of their forms and of the file.
pub(super) fn references(ports: &[Port]) -> Ports {
    let mut found = Ports::default();
    for port in ports {
        let is_text = recorded_kind(port.kind, port.storage) == ValueKind::String;
        let groups = if is_text { &mut found.texts } else { &mut found.numbers };
        let one_more = |group: &mut Group| {
            if group.references.last() != Some(&port.reference) {
                group.references.push(port.reference);
                group.elements += port.element.1;
            }
            group.places.push(group.elements - port.element.1 + port.element.0);
        };
        let joins = |group: &&mut Group| {
            let same = group.references.last() == Some(&port.reference);
            let alike = (group.storage, group.discrete, group.tunable)
                == (port.storage, port.discrete, port.tunable)
                && group.clocks == port.clocks;
            alike && (same || !is_text)
        };
        match groups.last_mut().filter(joins) {
            Some(group) => one_more(group),
            None => {
                let mut group = Group {
                    storage: port.storage,
                    references: Vec::new(),
                    elements: 0,
                    discrete: port.discrete,
                    tunable: port.tunable,
                    clocks: port.clocks.clone(),
                    places: Vec::new(),
                    needed: true,
                };
                one_more(&mut group);
                groups.push(group);
            }
        }
    }
    found
}
