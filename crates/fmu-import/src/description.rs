//! Reads what an FMU says about itself into the form that the program works with.

use fmi_rs::model_description::fmi2::{self, ModelDescription, SimpleType, VariableType};
use units::Unit;

use crate::attributes::{Causality, Initial, Variability};
use crate::definitions;

/// What an FMU says about itself.
#[derive(Debug)]
pub struct Description {
    /// Name of the model.
    pub name: String,
    /// Identity that the library is asked to confirm.
    pub guid: String,
    /// Name of the library.
    pub identifier: String,
    /// One line about the model.
    pub summary: Option<String>,
    /// The tool that made it.
    pub tool: Option<String>,
    /// Whether the communication step may differ from step to step.
    pub variable_step: bool,
    /// Whether the state can be stored and restored.
    pub state: bool,
    /// Whether the state can be turned into bytes.
    pub serialised_state: bool,
    /// Whether derivatives of outputs are given.
    pub directional_derivative: bool,
    /// Whether inputs may come with derivatives.
    pub interpolated_inputs: bool,
    /// Up to which order outputs have time derivatives.
    pub output_derivatives: u32,
    /// Whether a second instance in the process is impossible.
    pub only_once: bool,
    /// Preferred communication step [s].
    pub default_step: Option<f64>,
    /// Where a simulation starts unless somebody says otherwise [s].
    pub default_start: f64,
    /// The categories that messages may have.
    pub log_categories: Vec<String>,
    /// The variables, in the order of the file.
    pub variables: Vec<Variable>,
    /// What is against the rules of FMI 2.0 but does not hinder a run.
    pub problems: Vec<String>,
}

/// The type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// `Real`.
    Real,
    /// `Integer`.
    Integer,
    /// `Boolean`.
    Boolean,
    /// `String`.
    String,
    /// `Enumeration`.
    Enumeration,
}

/// An item of an enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Its name.
    pub name: String,
    /// The integer that stands for it.
    pub value: i32,
}

/// The items of an enumeration for a message: `off = 0, armed = 1`.
#[must_use]
pub fn list(items: &[Item]) -> String {
    let items = items.iter().map(|item| format!("{} = {}", item.name, item.value));
    items.collect::<Vec<_>>().join(", ")
}

/// A variable of an FMU.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its value reference.
    pub reference: u32,
    /// Its type.
    pub kind: Type,
    /// What an enumeration may be, in the order of the values.
    pub items: Vec<Item>,
    /// Who determines it.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How its first value comes about.
    pub initial: Option<Initial>,
    /// The smallest value that it may have.
    pub min: Option<f64>,
    /// The largest value that it may have.
    pub max: Option<f64>,
    /// What a usual value of it is.
    pub nominal: Option<f64>,
    /// Name of its unit.
    pub unit: Option<String>,
    /// Its unit, when the file or its name says what that is.
    pub dimension: Option<Unit>,
    /// Start value, as written.
    pub start: Option<String>,
    /// One line about it.
    pub description: Option<String>,
    /// For outputs, the places of the variables that it follows directly; `None` means all inputs.
    pub dependencies: Option<Vec<usize>>,
}

impl Description {
    /// Reads the text of a `modelDescription.xml`.
    ///
    /// # Errors
    /// When the text is no description of an FMI 2.0 co-simulation FMU.
    pub fn parse(xml: &str) -> Result<Self, String> {
        // No description needs a document type, and its entities can make a short text very long.
        if xml.contains("<!DOCTYPE") || xml.contains("<!ENTITY") {
            return Err("expected no document type declaration, found one".to_owned());
        }
        let mut found = ModelDescription::from_string(xml).map_err(|error| error.to_string())?;
        definitions::complete(&mut found, xml)?;
        let problems = found.validate().into_iter().map(|problem| problem.message).collect();
        let Some(cs) = &found.coSimulation else {
            return Err("the FMU has no co-simulation interface".to_owned());
        };
        if cs.modelIdentifier.contains(['/', '\\']) || cs.modelIdentifier.is_empty() {
            return Err(format!("modelIdentifier {:?} is not a name", cs.modelIdentifier));
        }
        let default_step =
            found.defaultExperiment.as_ref().and_then(|default| default.stepSize.as_ref());
        Ok(Description {
            name: found.modelName.clone(),
            guid: found.guid.clone(),
            identifier: cs.modelIdentifier.clone(),
            summary: found.description.clone(),
            tool: found.generationTool.clone(),
            variable_step: cs.canHandleVariableCommunicationStepSize,
            state: cs.canGetAndSetFMUstate,
            serialised_state: cs.canSerializeFMUstate,
            directional_derivative: cs.providesDirectionalDerivative,
            interpolated_inputs: cs.canInterpolateInputs,
            output_derivatives: cs.maxOutputDerivativeOrder,
            only_once: cs.canBeInstantiatedOnlyOncePerProcess,
            default_step: default_step.and_then(|step| step.parse().ok()),
            default_start: found
                .defaultExperiment
                .as_ref()
                .and_then(|default| default.startTime.as_ref()?.parse().ok())
                .unwrap_or(0.0),
            log_categories: found
                .logCategories
                .iter()
                .map(|category| category.name.clone())
                .collect(),
            variables: (0..found.modelVariables.len())
                .map(|place| variable(&found, place))
                .collect(),
            problems,
        })
    }

    /// The place of the variable called `name`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|variable| variable.name == name)
    }

    /// The places of the variables with a causality.
    pub fn with(&self, causality: Causality) -> impl Iterator<Item = usize> {
        (0..self.variables.len()).filter(move |&place| self.variables[place].causality == causality)
    }
}

fn variable(found: &ModelDescription, place: usize) -> Variable {
    let scalar = &found.modelVariables[place];
    let unit = unit_name(found, &scalar.variableType);
    let [min, max, nominal] = range(found, &scalar.variableType);
    let unknown = found.outputs.iter().find(|unknown| unknown.index as usize == place + 1);
    let dependencies = unknown.and_then(|unknown| unknown.dependencies.as_ref()).map(|indices| {
        indices.iter().filter_map(|&index| (index as usize).checked_sub(1)).collect()
    });
    Variable {
        name: scalar.name.clone(),
        reference: scalar.valueReference,
        kind: match scalar.variableType {
            VariableType::Real { .. } => Type::Real,
            VariableType::Integer { .. } => Type::Integer,
            VariableType::Boolean { .. } => Type::Boolean,
            VariableType::String { .. } => Type::String,
            VariableType::Enumeration { .. } => Type::Enumeration,
        },
        items: items(found, &scalar.variableType),
        causality: scalar.causality.into(),
        variability: scalar.variability.into(),
        initial: scalar.initial.map(Into::into),
        min,
        max,
        nominal,
        dimension: unit.as_deref().and_then(|name| dimension(found, name)),
        unit,
        start: scalar.variableType.start().clone(),
        description: scalar.description.clone(),
        dependencies,
    }
}

/// The items of an enumeration's declared type.
fn items(found: &ModelDescription, kind: &VariableType) -> Vec<Item> {
    let VariableType::Enumeration { declaredType, .. } = kind else { return Vec::new() };
    let Some(SimpleType::Enumeration { items, .. }) = found.get_type_definition(declaredType)
    else {
        return Vec::new();
    };
    let item = |item: &fmi2::Item| Item { name: item.name.clone(), value: item.value };
    let mut items: Vec<_> = items.iter().map(item).collect();
    items.sort_by_key(|item| item.value);
    items
}

/// The unit that the variable or its declared type names.
fn unit_name(found: &ModelDescription, kind: &VariableType) -> Option<String> {
    let VariableType::Real { unit, declaredType, .. } = kind else { return None };
    unit.clone().or_else(|| {
        let declared = found.get_type_definition(declaredType.as_ref()?)?;
        match declared {
            SimpleType::Real { unit, .. } => unit.clone(),
            _ => None,
        }
    })
}

/// The file's own definition of a unit, or else what its name says.
fn dimension(found: &ModelDescription, name: &str) -> Option<Unit> {
    let defined = found.unitDefintions.iter().find(|unit| unit.name == name);
    let Some(base) = defined.and_then(|unit| unit.baseUnit.as_ref()) else {
        return Unit::parse(name).ok();
    };
    let exponents = [base.kg, base.m, base.s, base.A, base.K, base.mol, base.cd, base.rad];
    let exponents = exponents.map(|exponent| i8::try_from(exponent).unwrap_or(i8::MAX));
    Some(Unit::from_base(exponents, base.factor, base.offset))
}

/// Minimum, maximum and nominal value of the variable or its declared type.
fn range(found: &ModelDescription, kind: &VariableType) -> [Option<f64>; 3] {
    let own = |text: &Option<String>| text.as_ref().and_then(|text| text.parse().ok());
    let (declared, own) = match kind {
        VariableType::Real { declaredType, min, max, nominal, .. } => {
            (declaredType.as_ref(), [own(min), own(max), own(nominal)])
        }
        VariableType::Integer { declaredType, min, max, .. } => {
            (declaredType.as_ref(), [own(min), own(max), None])
        }
        _ => (None, [None; 3]),
    };
    let declared = match declared.and_then(|name| found.get_type_definition(name)) {
        Some(SimpleType::Real { min, max, nominal, .. }) => {
            [*min, *max, *nominal].map(|x| x.map(f64::from))
        }
        Some(SimpleType::Integer { min, max, .. }) => {
            [min.map(f64::from), max.map(f64::from), None]
        }
        _ => [None; 3],
    };
    std::array::from_fn(|i| own[i].or(declared[i]))
}
