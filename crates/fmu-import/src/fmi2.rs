//! Parses the model description of FMI 2.0.

use std::collections::HashMap;
use std::sync::Arc;

use fmi_rs::model_description::DefaultExperiment;
use fmi_rs::model_description::fmi2::{self, ModelDescription, SimpleType, Unknown, VariableType};
use roxmltree::Document;
use units::Unit;

use crate::attributes::{Causality, Initial, Variability};
use crate::definitions::{self, TypeLimits, UnparsedAttributes};
use crate::description::{
    ContinuousState, EnumerationItem, EquationStructure, FmiInterface, FmiType, FmiVersion, FmuDescription,
    StorageType, Variable, VariableNameIndex,
};
use crate::fmi1_attributes::Fmi1Attributes;
use crate::problem_list::describe_place;
use crate::validation::{self, StructureVariable, locate_validation_error};

/// Reads the text of a `modelDescription.xml`.
///
/// # Errors
/// When the text is no description of an FMU of FMI 2.0 with this interface.
pub(crate) fn parse(xml: &str, interface: FmiInterface) -> Result<FmuDescription, String> {
    let refused = |xml: &str| ModelDescription::from_string(xml).err().map(|it| it.to_string());
    let mut found = ModelDescription::from_string(xml).map_err(|error| {
        let document = Document::parse(xml).map_err(|error| error.to_string());
        document.map_or_else(|error| error, |it| locate_validation_error(&it, &error.to_string(), refused))
    })?;
    let rest = definitions::add_units_and_types(&mut found, xml)?;
    let problems = description_problems(&found, xml);
    let capabilities = Capabilities::of_interface(&found, interface)?;
    let identifier = capabilities.identifier.clone();
    if identifier.contains(['/', '\\']) || identifier.is_empty() {
        return Err(format!("modelIdentifier {identifier:?} is not a name"));
    }
    let experiment = found.defaultExperiment.as_ref();
    let default = |of: fn(&DefaultExperiment) -> Option<&String>| -> Option<f64> {
        experiment.and_then(of)?.parse().ok().filter(|it: &f64| it.is_finite())
    };
    let named = found.modelVariables.iter().map(|it| (it.name.as_str(), it.range.start));
    definitions::check_unique_names(named, xml)?;
    let known = SymbolTable::new(&found, &rest, xml)?;
    Ok(FmuDescription {
        version: FmiVersion::Two,
        interface,
        interfaces: Vec::new(),
        equations: match interface {
            FmiInterface::CoSimulation => EquationStructure::default(),
            FmiInterface::ModelExchange => equation_structure(&found),
        },
        name: found.modelName.clone(),
        guid: found.guid.clone(),
        identifier,
        summary: found.description.clone(),
        tool: found.generationTool.clone(),
        variable_step: capabilities.variable_step,
        state: capabilities.state,
        serialised_state: capabilities.serialised_state,
        directional_derivative: capabilities.directional_derivative,
        interpolated_inputs: capabilities.interpolated_inputs,
        output_derivatives: capabilities.output_derivatives,
        event_mode: interface == FmiInterface::ModelExchange,
        early_return: false,
        only_once: capabilities.only_once,
        default_step: default(|it| it.stepSize.as_ref()),
        internal_step: None,
        default_start: default(|it| it.startTime.as_ref()).unwrap_or(0.0),
        default_stop: default(|it| it.stopTime.as_ref()),
        default_tolerance: default(|it| it.tolerance.as_ref()),
        log_categories: found.logCategories.iter().map(|category| category.name.clone()).collect(),
        variables: (0..found.modelVariables.len()).map(|it| build_variable(&found, &known, it)).collect(),
        corrections: Vec::new(),
        problems,
        names: VariableNameIndex::default(),
        fmi1: Fmi1Attributes::default(),
    })
}

/// What the element of an interface says.
struct Capabilities<'a> {
    identifier: &'a String,
    variable_step: bool,
    state: bool,
    serialised_state: bool,
    directional_derivative: bool,
    interpolated_inputs: bool,
    output_derivatives: u32,
    only_once: bool,
}

impl<'a> Capabilities<'a> {
    fn of_interface(found: &'a ModelDescription, interface: FmiInterface) -> Result<Self, String> {
        let none = || format!("expected <{interface}>, found none");
        Ok(match interface {
            FmiInterface::CoSimulation => {
                let it = found.coSimulation.as_ref().ok_or_else(none)?;
                Capabilities {
                    identifier: &it.modelIdentifier,
                    variable_step: it.canHandleVariableCommunicationStepSize,
                    state: it.canGetAndSetFMUstate,
                    serialised_state: it.canSerializeFMUstate,
                    directional_derivative: it.providesDirectionalDerivative,
                    interpolated_inputs: it.canInterpolateInputs,
                    output_derivatives: it.maxOutputDerivativeOrder,
                    only_once: it.canBeInstantiatedOnlyOncePerProcess,
                }
            }
            FmiInterface::ModelExchange => {
                let it = found.modelExchange.as_ref().ok_or_else(none)?;
                Capabilities {
                    identifier: &it.modelIdentifier,
                    variable_step: true,
                    state: it.canGetAndSetFMUstate,
                    serialised_state: it.canSerializeFMUstate,
                    directional_derivative: it.providesDirectionalDerivative,
                    interpolated_inputs: true,
                    output_derivatives: 0,
                    only_once: it.canBeInstantiatedOnlyOncePerProcess,
                }
            }
        })
    }
}

/// The states and indicators of an FMU for model exchange. Indices count from 1.
fn equation_structure(found: &ModelDescription) -> EquationStructure {
    let variable = |index: u32| found.modelVariables.get((index as usize).checked_sub(1)?);
    let state = |unknown: &Unknown| {
        let derivative = variable(unknown.index);
        let state = match derivative.map(|it| &it.variableType) {
            Some(VariableType::Real { derivative: Some(state), .. }) => variable(*state),
            _ => None,
        };
        let name = derivative.map_or_else(|| format!("variable {}", unknown.index), |it| it.name.clone());
        ContinuousState {
            name: state.map_or_else(|| format!("the state of `{name}`"), |it| it.name.clone()),
            reference: state.map(|it| it.valueReference),
            derivative: name,
            derivative_reference: derivative.map(|it| it.valueReference),
            dependencies: unknown.dependencies.as_ref().map(|indices| {
                indices.iter().filter_map(|index| variable(*index)).map(|it| it.valueReference).collect()
            }),
        }
    };
    EquationStructure {
        states: found.derivatives.iter().map(state).collect(),
        event_indicators: found.numberOfEventIndicators as usize,
        needs_completed_step: found
            .modelExchange
            .as_ref()
            .is_some_and(|it| !it.completedIntegratorStepNotNeeded),
    }
}

/// What breaks the rules, by variable and line.
fn description_problems(found: &ModelDescription, xml: &str) -> Vec<String> {
    // Variables count from 1.
    let variables = (1..).zip(&found.modelVariables).map(|(id, it): (u32, _)| StructureVariable {
        id,
        name: &it.name,
        place: it.range.start,
        clocked: false,
    });
    let variables: Vec<_> = variables.collect();
    let unknowns = found.outputs.iter().chain(&found.derivatives).chain(&found.initialUnknowns);
    let unknowns = unknowns.map(|it| (it.range.start, it.index));
    validation::validation_problems(xml, || found.validate(), &variables, unknowns)
}

/// What variables refer to, by names and indices: a description may have a hundred thousand of each.
struct SymbolTable<'a> {
    units: HashMap<&'a str, Unit>,
    types: HashMap<&'a str, &'a SimpleType>,
    rest: &'a UnparsedAttributes,
    /// Outputs by the indices of their variables, which count from 1.
    outputs: HashMap<u32, &'a Unknown>,
}

impl<'a> SymbolTable<'a> {
    /// Of two of one name the first one counts.
    fn new(found: &'a ModelDescription, rest: &'a UnparsedAttributes, xml: &str) -> Result<Self, String> {
        let mut units = HashMap::new();
        for unit in found.unitDefintions.iter().rev() {
            let Some(base) = &unit.baseUnit else { continue };
            let exponents = [base.kg, base.m, base.s, base.A, base.K, base.mol, base.cd, base.rad];
            let defined = definitions::base_unit(exponents, [base.factor, base.offset]);
            let place = || describe_place(xml, Some(&unit.name), base.range.start);
            let wrong = |what| format!("the unit {}: {what}", place());
            units.insert(unit.name.as_str(), defined.map_err(wrong)?);
        }
        let types = found.typeDefinitions.iter().rev().map(|it| (it.name(), it)).collect();
        let outputs = found.outputs.iter().rev().map(|it| (it.index, it)).collect();
        Ok(SymbolTable { units, types, rest, outputs })
    }

    /// The declared type that a variable names.
    fn declared_type(&self, kind: &VariableType) -> Option<&'a SimpleType> {
        let name = match kind {
            VariableType::Real { declaredType, .. } | VariableType::Integer { declaredType, .. } => {
                declaredType.as_ref()?
            }
            VariableType::Enumeration { declaredType, .. } => declaredType,
            _ => return None,
        };
        self.types.get(name.as_str()).copied()
    }
}

fn build_variable(found: &ModelDescription, known: &SymbolTable, index: usize) -> Variable {
    let scalar = &found.modelVariables[index];
    let declared = known.declared_type(&scalar.variableType);
    let unit = unit_name(declared, &scalar.variableType)
        .filter(|name| known.units.contains_key(name.as_str()) || definitions::is_unit(name));
    let limits = declared.and_then(|it| known.rest.types.get(it.name())).copied();
    let limits = limits.unwrap_or_default();
    let [min, max, nominal] = min_max_nominal(limits, &scalar.variableType);
    let marks = known.rest.variables.get(&scalar.name).copied().unwrap_or_default();
    let is_real = matches!(scalar.variableType, VariableType::Real { .. });
    let relative = is_real && marks.relative.unwrap_or(limits.relative);
    // The file's own definition of a unit, or else what its name says.
    let measure =
        unit.as_deref().and_then(|name| known.units.get(name).copied().or_else(|| Unit::parse(name).ok()));
    let unknown = u32::try_from(index + 1).ok().and_then(|index| known.outputs.get(&index));
    let dependencies = unknown.and_then(|unknown| unknown.dependencies.as_ref()).map(|indices| {
        indices.iter().filter_map(|&index| (index as usize).checked_sub(1)).collect::<Arc<[_]>>()
    });
    let (kind, storage) = match scalar.variableType {
        VariableType::Real { .. } => (FmiType::Real, StorageType::Float64),
        VariableType::Integer { .. } => (FmiType::Integer, StorageType::Int32),
        VariableType::Boolean { .. } => (FmiType::Boolean, StorageType::Boolean),
        VariableType::String { .. } => (FmiType::String, StorageType::String),
        VariableType::Enumeration { .. } => (FmiType::Enumeration, StorageType::Int32),
    };
    Variable {
        name: scalar.name.clone(),
        reference: scalar.valueReference,
        kind,
        storage,
        element: (0, 1),
        items: enumeration_items(declared, &scalar.variableType),
        causality: scalar.causality.into(),
        variability: scalar.variability.into(),
        initial: scalar.initial.map(Into::into),
        min,
        max,
        nominal,
        dimension: measure.map(|it| if relative { it.difference_unit() } else { it }),
        relative: relative.then(|| measure.map_or(0.0, |it| it.offset)),
        unit,
        start: scalar.variableType.start().clone(),
        description: scalar.description.clone(),
        dependencies,
        optional: marks.optional,
        ticks: None,
        clocks: Vec::new(),
    }
}

/// The items of an enumeration's declared type.
fn enumeration_items(declared: Option<&SimpleType>, kind: &VariableType) -> Vec<EnumerationItem> {
    let (VariableType::Enumeration { .. }, Some(SimpleType::Enumeration { items, .. })) = (kind, declared)
    else {
        return Vec::new();
    };
    let item = |item: &fmi2::Item| EnumerationItem { name: item.name.clone(), value: item.value.into() };
    let mut items: Vec<_> = items.iter().map(item).collect();
    items.sort_by_key(|item| item.value);
    items
}

/// The unit that the variable or its declared type names.
fn unit_name(declared: Option<&SimpleType>, kind: &VariableType) -> Option<String> {
    let VariableType::Real { unit, .. } = kind else { return None };
    unit.clone().or_else(|| match declared? {
        SimpleType::Real { unit, .. } => unit.clone(),
        _ => None,
    })
}

/// Minimum, maximum and nominal value of the variable or its declared type.
fn min_max_nominal(declared: TypeLimits, kind: &VariableType) -> [Option<f64>; 3] {
    let own = |text: &Option<String>| text.as_ref().and_then(|text| text.parse().ok());
    let own = match kind {
        VariableType::Real { min, max, nominal, .. } => [own(min), own(max), own(nominal)],
        VariableType::Integer { min, max, .. } => [own(min), own(max), None],
        _ => return [None; 3],
    };
    std::array::from_fn(|i| own[i].or(declared.range[i]))
}

impl From<fmi2::Causality> for Causality {
    fn from(found: fmi2::Causality) -> Self {
        match found {
            fmi2::Causality::Parameter => Causality::Parameter,
            fmi2::Causality::CalculatedParameter => Causality::CalculatedParameter,
            fmi2::Causality::Input => Causality::Input,
            fmi2::Causality::Output => Causality::Output,
            fmi2::Causality::Local => Causality::Local,
            fmi2::Causality::Independent => Causality::Independent,
        }
    }
}

impl From<fmi2::Variability> for Variability {
    fn from(found: fmi2::Variability) -> Self {
        match found {
            fmi2::Variability::Constant => Variability::Constant,
            fmi2::Variability::Fixed => Variability::Fixed,
            fmi2::Variability::Tunable => Variability::Tunable,
            fmi2::Variability::Discrete => Variability::Discrete,
            fmi2::Variability::Continuous => Variability::Continuous,
        }
    }
}

impl From<fmi2::Initial> for Initial {
    fn from(found: fmi2::Initial) -> Self {
        match found {
            fmi2::Initial::Exact => Initial::Exact,
            fmi2::Initial::Approx => Initial::Approx,
            fmi2::Initial::Calculated => Initial::Calculated,
        }
    }
}
