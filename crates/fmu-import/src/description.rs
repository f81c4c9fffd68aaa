//! Defines the model description, common to all versions of FMI.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};
use units::Unit;

use crate::attributes::{Causality, Initial, Variability};
use crate::fmi1_attributes::Fmi1Attributes;
use crate::fmi1_names::Fmi2Name;
use crate::value::{Value, from_hex};

/// The version of FMI that an FMU is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmiVersion {
    /// 1.0.
    One,
    /// 2.0.
    Two,
    /// 3.0.
    Three,
}

impl FmiVersion {
    /// The name of a function that all versions have, for messages.
    #[must_use]
    pub fn function(self, two: &'static str, three: &'static str) -> &'static str {
        match self {
            // Names that differ in co-simulation are none of steps and events.
            FmiVersion::One => two.fmi1_name(true),
            FmiVersion::Two => two,
            FmiVersion::Three => three,
        }
    }
}

impl std::fmt::Display for FmiVersion {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            FmiVersion::One => "1.0",
            FmiVersion::Two => "2.0",
            FmiVersion::Three => "3.0",
        })
    }
}

/// An interface of FMI through which an FMU can be run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum FmiInterface {
    /// The FMU steps by itself.
    CoSimulation,
    /// The FMU has equations, and an integrator of the importer steps.
    ModelExchange,
}

impl FmiInterface {
    /// All of them, those that are preferred first.
    pub const ALL: [FmiInterface; 2] = [FmiInterface::CoSimulation, FmiInterface::ModelExchange];
}

impl std::fmt::Display for FmiInterface {
    /// The name of its element in a description.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            FmiInterface::CoSimulation => "CoSimulation",
            FmiInterface::ModelExchange => "ModelExchange",
        })
    }
}

/// A continuous state of an FMU for model exchange.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ContinuousState {
    /// Its name, or what it is to be called where the description does not name it.
    pub name: String,
    /// Its value reference; none of an element of an array, or where the description does not tell.
    pub reference: Option<u32>,
    /// The name of its derivative.
    pub derivative: String,
    /// The value reference of its derivative; none of an element of an array.
    pub derivative_reference: Option<u32>,
    /// The value references of all that its derivative depends on; none where the description does not tell.
    pub dependencies: Option<Vec<u32>>,
}

/// The differential equations of an FMU for model exchange.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct EquationStructure {
    /// The continuous states, in the order in which they travel.
    pub states: Vec<ContinuousState>,
    /// The number of event indicators.
    pub event_indicators: usize,
    /// Whether it wants to hear of each completed step of the integrator.
    pub needs_completed_step: bool,
}

/// What an FMU says about itself.
#[derive(Debug)]
#[non_exhaustive]
pub struct FmuDescription {
    /// The version of FMI that it is made for.
    pub version: FmiVersion,
    /// The interface that it is used through.
    pub interface: FmiInterface,
    /// All interfaces that it can be run through.
    pub interfaces: Vec<FmiInterface>,
    /// Its differential equations; empty for co-simulation.
    pub equations: EquationStructure,
    /// Name of the model.
    pub name: String,
    /// Identity that the library is asked to confirm: the `guid`, or the `instantiationToken` of FMI 3.0.
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
    /// Whether inputs may change within a step: in co-simulation those that come with derivatives.
    pub interpolated_inputs: bool,
    /// Up to which order outputs have time derivatives.
    pub output_derivatives: u32,
    /// Whether it has event mode.
    pub event_mode: bool,
    /// Whether it may end a step early, on its own or after an intermediate update.
    pub early_return: bool,
    /// Whether a second instance in the process is impossible.
    pub only_once: bool,
    /// Preferred communication step [s].
    pub default_step: Option<f64>,
    /// The step that it makes inside whatever it is asked for, if that is fixed [s].
    pub internal_step: Option<f64>,
    /// Where a simulation starts unless somebody says otherwise [s].
    pub default_start: f64,
    /// Where a simulation stops unless somebody says otherwise [s].
    pub default_stop: Option<f64>,
    /// Relative tolerance of the FMU's own integration unless somebody says otherwise [-].
    pub default_tolerance: Option<f64>,
    /// The categories that messages may have.
    pub log_categories: Vec<String>,
    /// The variables, in the order of the file; those of an array are its elements, row by row.
    pub variables: Vec<Variable>,
    /// What was read otherwise than it stands in the file, since it breaks the rules and has one safe meaning.
    pub corrections: Vec<String>,
    /// What else breaks the rules of FMI, and makes no difference to a run.
    pub problems: Vec<String>,
    pub(crate) names: VariableNameIndex,
    /// What FMI 1.0 says besides.
    pub(crate) fmi1: Fmi1Attributes,
}

/// The variables by their names, once somebody has asked for one.
#[derive(Debug, Default)]
pub(crate) struct VariableNameIndex(OnceLock<HashMap<String, usize>>);

/// The type of a variable, whatever the size of its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmiType {
    /// `Real`, `Float32` or `Float64`.
    Real,
    /// `Integer`, or an integer of any size.
    Integer,
    /// `Boolean`.
    Boolean,
    /// `String`.
    String,
    /// `Enumeration`.
    Enumeration,
    /// `Binary`.
    Binary,
    /// `Clock`.
    Clock,
}

/// The form in which values of a variable are handed over, in the order in which they travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[expect(missing_docs, reason = "they are the types of FMI 3.0")]
pub enum StorageType {
    /// Also `Real` of FMI 2.0.
    Float64,
    Float32,
    /// Also `Integer` and `Enumeration` of FMI 2.0.
    Int32,
    Int8,
    UInt8,
    Int16,
    UInt16,
    UInt32,
    /// Also `Enumeration` of FMI 3.0.
    Int64,
    UInt64,
    Boolean,
    String,
    Binary,
    Clock,
}

/// The whole numbers that `f64` holds exactly with all their neighbours.
const EXACT: i128 = 1 << 53;

impl StorageType {
    /// The smallest and the largest integer of the type; none for what is no integer.
    #[must_use]
    pub fn integer_range(self) -> Option<[i128; 2]> {
        Some(match self {
            StorageType::Int8 => [i8::MIN.into(), i8::MAX.into()],
            StorageType::UInt8 => [0, u8::MAX.into()],
            StorageType::Int16 => [i16::MIN.into(), i16::MAX.into()],
            StorageType::UInt16 => [0, u16::MAX.into()],
            StorageType::Int32 => [i32::MIN.into(), i32::MAX.into()],
            StorageType::UInt32 => [0, u32::MAX.into()],
            StorageType::Int64 => [i64::MIN.into(), i64::MAX.into()],
            StorageType::UInt64 => [0, u64::MAX.into()],
            _ => return None,
        })
    }

    /// Those of them that a number of a run holds exactly.
    #[must_use]
    pub fn exact_integers(self) -> Option<[i128; 2]> {
        self.integer_range().map(|[low, high]| [low.max(-EXACT), high.min(EXACT)])
    }
}

/// An item of an enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnumerationItem {
    /// Its name.
    pub name: String,
    /// The integer that stands for it.
    pub value: i64,
}

/// The items of an enumeration for a message: `off = 0, armed = 1`.
#[must_use]
pub fn describe_items(items: &[EnumerationItem]) -> String {
    let items = items.iter().map(|item| format!("{} = {}", item.name, item.value));
    items.collect::<Vec<_>>().join(", ")
}

/// When an input clock ticks, or that an output clock ticks when the FMU says so (FMI 3.0, section 2.2.9).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum IntervalVariability {
    /// At intervals that never change.
    Constant,
    /// At intervals that do not change after the initialisation.
    Fixed,
    /// At intervals that the FMU knows after its initialisation.
    Calculated,
    /// At intervals that may change with tunable parameters.
    Tunable,
    /// At intervals that the FMU may change at each tick.
    Changing,
    /// Once, the time after an event that the FMU says.
    Countdown,
    /// When somebody says so.
    Triggered,
}

/// The ticks of a clock.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ClockAttributes {
    /// When it ticks.
    pub interval: IntervalVariability,
    /// The time between two ticks, if the description tells [s].
    pub seconds: Option<f64>,
    /// The time before the first tick [s].
    pub shift: f64,
    /// Of clocks that tick at one time the one with the lowest number comes first.
    pub priority: Option<u32>,
}

/// A variable of an FMU.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its value reference.
    pub reference: u32,
    /// Its type.
    pub kind: FmiType,
    /// The form of its values.
    pub storage: StorageType,
    /// Its place in an array, and the number of elements there; 0 of 1 for a variable of its own.
    pub element: (usize, usize),
    /// What an enumeration may be, in the order of the values.
    pub items: Vec<EnumerationItem>,
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
    /// Its unit, when the file or its name says what that is; that of a difference has no offset.
    pub dimension: Option<Unit>,
    /// Of a difference (`relativeQuantity`), the offset that its unit has and that does not count, in SI units; none of another quantity.
    pub relative: Option<f64>,
    /// Start value, as written; of an element, its own.
    pub start: Option<String>,
    /// One line about it.
    pub description: Option<String>,
    /// For outputs, the indices of the variables that it follows directly; `None` means all inputs.
    pub dependencies: Option<Arc<[usize]>>,
    /// Of an input, whether the description says that its start value means that nothing is connected.
    pub optional: bool,
    /// Of a clock, its ticks.
    pub ticks: Option<ClockAttributes>,
    /// The value references of the clocks at whose ticks alone it has a value; none of a variable without clocks.
    pub clocks: Vec<u32>,
}

impl Variable {
    /// The name of the array that it is an element of, or its own.
    #[must_use]
    pub fn array_name(&self) -> &str {
        let of_array = self.element.1 > 1;
        self.name.rsplit_once('[').filter(|_| of_array).map_or(&self.name, |(array, _)| array)
    }

    /// Gives it a unit, whose offset does not count if it is a difference.
    pub fn set_unit(&mut self, unit: Unit) {
        self.relative = self.relative.map(|_| unit.offset);
        self.dimension = Some(self.offset_free_unit(unit));
    }

    /// A unit as it measures this variable: without an offset if that is a difference.
    #[must_use]
    pub fn offset_free_unit(&self, unit: Unit) -> Unit {
        if self.relative.is_some() { unit.difference_unit() } else { unit }
    }

    /// The name of its unit for those who do not know that it is a difference: K in place of degC.
    #[must_use]
    pub fn offset_free_unit_name(&self) -> Option<String> {
        let shifted = self.relative.is_some_and(|offset| offset != 0.0);
        let plain = self.dimension.filter(|_| shifted).and_then(|unit| unit.offset_free_name());
        plain.map(str::to_owned).or_else(|| self.unit.clone())
    }

    /// Its start value; none when the description has none, or one that is none of its form.
    #[must_use]
    pub fn start_value(&self) -> Option<Value> {
        let start = self.start.as_deref()?;
        Some(match (self.kind, start.trim()) {
            (FmiType::Real, start) => Value::Real(start.parse().ok()?),
            (FmiType::Integer | FmiType::Enumeration, start) => {
                let [low, high] = self.storage.integer_range()?;
                let value = start.parse().ok()?;
                Value::Integer((low..=high).contains(&value).then_some(value)?)
            }
            (FmiType::Boolean, "true" | "1") => Value::Boolean(true),
            (FmiType::Boolean, "false" | "0") => Value::Boolean(false),
            (FmiType::String, _) => Value::String(start.to_owned()),
            (FmiType::Binary, start) => Value::Binary(from_hex(start)?),
            (FmiType::Boolean | FmiType::Clock, _) => return None,
        })
    }
}

impl FmuDescription {
    /// What its interface of FMI 1.0 calls a function or a status of FMI 2.0.
    pub(crate) fn fmi1_name<T: Fmi2Name>(&self, two: T) -> T {
        two.fmi1_name(self.interface == FmiInterface::ModelExchange)
    }

    /// What stands before the names of the library's functions.
    pub(crate) fn symbol_prefix(&self) -> String {
        match self.version {
            FmiVersion::One => format!("{}_", self.identifier),
            FmiVersion::Two | FmiVersion::Three => String::new(),
        }
    }

    /// The value reference of a variable as it stands in the file: a negated alias of FMI 1.0 has its own one here.
    #[must_use]
    pub fn reference_in_file(&self, variable: &Variable) -> u32 {
        self.fmi1.negated.shared_reference(variable.reference).unwrap_or(variable.reference)
    }

    /// Whether steps may end early: at events, or for other reasons.
    #[must_use]
    pub fn may_return_early(&self) -> bool {
        self.event_mode || self.early_return
    }

    /// The communication step that it is made for, if its description tells one [s].
    #[must_use]
    pub fn default_step_size(&self) -> Option<f64> {
        self.default_step.or(self.internal_step).filter(|step| *step > 0.0)
    }

    /// The index of the variable called `name`, or of the first element of the array.
    #[must_use]
    pub fn find_variable(&self, name: &str) -> Option<usize> {
        let names = self.names.0.get_or_init(|| {
            let mut names = HashMap::new();
            for (place, variable) in self.variables.iter().enumerate() {
                names.insert(variable.name.clone(), place);
            }
            for (place, variable) in self.variables.iter().enumerate() {
                if variable.element.1 > 1 && variable.element.0 == 0 {
                    names.entry(variable.array_name().to_owned()).or_insert(place);
                }
            }
            names
        });
        names.get(name).copied()
    }

    /// The indices of the variables with a causality.
    pub fn indices_with_causality(&self, causality: Causality) -> impl Iterator<Item = usize> {
        (0..self.variables.len()).filter(move |&index| self.variables[index].causality == causality)
    }
}
