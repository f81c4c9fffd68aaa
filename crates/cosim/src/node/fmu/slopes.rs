//! Hands slopes of inputs to an FMU, and asks it for derivatives of its outputs.

use fmu_import::{CallError, Causality, Instance, Storage, Variability};
use scenario::plan::{Group, Ports};

use super::FmuNode;
use crate::course::Course;

/// The real numbers of an FMU by their places among the numbers that travel.
#[derive(Debug, Default)]
pub(super) struct Slopes {
    /// The references of continuous inputs; none for other inputs.
    inputs: Vec<Option<u32>>,
    /// The same of outputs.
    outputs: Vec<Option<u32>>,
    known: (Vec<u32>, Vec<f64>),
    unknown: (Vec<u32>, Vec<f64>),
}

impl Slopes {
    pub fn new(instance: &Instance, inputs: &Ports, outputs: &Ports) -> Self {
        let inputs = references(instance, &inputs.numbers, Causality::Input);
        let outputs = references(instance, &outputs.numbers, Causality::Output);
        Slopes { inputs, outputs, ..Slopes::default() }
    }
}

/// The references of real numbers that are no arrays and change continuously.
fn references(instance: &Instance, groups: &[Group], causality: Causality) -> Vec<Option<u32>> {
    let variables = &instance.description().variables;
    let is_continuous = |reference: u32| {
        let mut own = variables.iter().filter(|variable| variable.reference == reference);
        own.any(|it| it.causality == causality && it.variability == Variability::Continuous)
    };
    let of = |group: &Group| -> Vec<_> {
        let scalars = group.references.len() == group.elements && group.is_whole();
        let real = scalars && group.storage == Storage::Float64;
        match real {
            true => group.references.iter().map(|it| is_continuous(*it).then_some(*it)).collect(),
            false => vec![None; group.places.len()],
        }
    };
    groups.iter().flat_map(of).collect()
}

impl FmuNode {
    /// Whether the FMU takes slopes of its inputs: those of FMI 2.0 only.
    pub(in crate::node) fn takes_slopes(&self) -> bool {
        self.instance.description().interpolated_inputs
    }

    /// Gives the FMU its inputs at the start of a step [s], and the slopes that they have there.
    pub(super) fn give_slopes(
        &mut self,
        inputs: &mut [f64],
        courses: &[(usize, Course)],
        begin: f64,
    ) -> Result<(), CallError> {
        courses.iter().for_each(|(place, course)| inputs[*place] = course.at(begin));
        self.set_numbers(inputs)?;
        for (place, course) in courses {
            let Some(reference) = self.slopes.inputs.get(*place).copied().flatten() else {
                continue;
            };
            for (order, slope) in (1..).zip(course.slopes(begin)).take(course.degree().max(1)) {
                self.instance.set_input_derivative(reference, order, slope)?;
            }
        }
        Ok(())
    }

    /// How the outputs change with the inputs at this moment; false if the FMU does not say it.
    pub(super) fn ask_derivatives(
        &mut self,
        changes: &[f64],
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        let FmuNode { instance, slopes, .. } = self;
        if !instance.description().directional_derivative {
            return Ok(false);
        }
        let Slopes { inputs, outputs: own, known, unknown } = slopes;
        outputs.fill(0.0);
        let given = inputs.iter().zip(changes).filter(|(_, change)| **change != 0.0);
        known.0.clear();
        known.1.clear();
        for (reference, change) in given {
            // What changes in jumps has no derivative.
            let Some(reference) = reference else { return Ok(false) };
            known.0.push(*reference);
            known.1.push(*change);
        }
        unknown.0.clear();
        unknown.0.extend(own.iter().flatten());
        unknown.1.clear();
        unknown.1.resize(unknown.0.len(), 0.0);
        if known.0.is_empty() || unknown.0.is_empty() {
            return Ok(true);
        }
        let asked = instance.derivatives(&known.0, &known.1, &unknown.0, &mut unknown.1);
        if let Err(error) = asked {
            return if instance.is_lost() { Err(error) } else { Ok(false) };
        }
        let places = own.iter().enumerate().filter(|(_, reference)| reference.is_some());
        places.zip(&unknown.1).for_each(|((place, _), value)| outputs[place] = *value);
        Ok(true)
    }
}
