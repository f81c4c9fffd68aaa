//! Lists the real parameters and inputs of a model with their values, for those who judge them.

use crate::model::Model;
use crate::variable::{Causality, VariableAccess};

/// A real parameter or input, and what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealValue {
    /// Its name in the table.
    pub name: &'static str,
    /// Its value, in the unit of the table.
    pub value: f64,
    /// Whether it is another one than that of the description.
    pub is_given: bool,
}

/// All real parameters and inputs of a model, in the order of its table.
pub fn real_values<M: Model>(model: &mut M) -> Vec<RealValue> {
    let mut described = M::default();
    let mut values = Vec::new();
    for variable in M::VARIABLES {
        let VariableAccess::Real(at) = variable.access else { continue };
        if matches!(variable.row.causality, Causality::Parameter | Causality::Input) {
            let (value, start) = (*at(model), *at(&mut described));
            let is_given = value.to_bits() != start.to_bits();
            values.push(RealValue { name: variable.row.name, value, is_given });
        }
    }
    values
}
