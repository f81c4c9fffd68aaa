//! A system of the standard System Structure and Parameterization (SSP 1.0 or 2.0) goes in: an `.ssp` archive, its folder, or an
//! `.ssd` file. A flat [`SspSystem`] comes out: FMUs with start values, and connections from one FMU to another.
//!
//! Nested systems, systems in files of their own, parameter bindings of all levels and signal dictionaries are resolved.
//! All files may be hostile: nothing is written outside of a temporary folder, nothing is read outside of the folder of the
//! system, and sizes are bounded. Sections in comments are those of the text of SSP 2.0; the rules are those of 1.0.
//!
//! # Example
//! ```
//! let folder = tempfile::tempdir()?;
//! std::fs::write(folder.path().join("gain.fmu"), "")?;
//! std::fs::write(folder.path().join("SystemStructure.ssd"), r#"
//! <ssd:SystemStructureDescription version="1.0" name="one"
//!     xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
//!     xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
//!   <ssd:System name="root">
//!     <ssd:ParameterBindings><ssd:ParameterBinding prefix="gain."><ssd:ParameterValues>
//!       <ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>
//!         <ssv:Parameter name="k"><ssv:Real value="2"/></ssv:Parameter>
//!       </ssv:Parameters></ssv:ParameterSet>
//!     </ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>
//!     <ssd:Elements><ssd:Component name="gain" source="gain.fmu"/></ssd:Elements>
//!   </ssd:System>
//! </ssd:SystemStructureDescription>"#)?;
//!
//! let system = ssp::open_system(folder.path(), None)?;
//! let gain = &system.components[0];
//! assert_eq!((gain.name.as_str(), gain.start_values[0].variable.as_str()), ("gain", "k"));
//! assert_eq!(gain.start_values[0].value, ssp::SspValue::Real(2.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bind;
mod chain;
mod connect;
mod dictionary;
mod error;
mod fingerprint;
mod flat;
mod limits;
mod notes;
mod open;
mod package;
mod parameters;
mod read;
mod read_archive;
mod source_position;
mod ssd;
mod transformation;
mod tree;
mod unit;
mod value;
mod variant;
pub mod write;
mod xml;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use archive::TemporaryFolder;

pub use error::{Error, SspMistake};
pub use open::{list_variants, open_system};
pub use source_position::SourcePosition;
pub use transformation::ValueTransformation;
pub use unit::{BASES, BaseUnit, Enumeration, SspUnit};
pub use value::{IntegerWidth, SspType, SspValue};
pub use variant::SystemVariant;

/// A system without systems in it.
#[derive(Debug)]
pub struct SspSystem {
    /// What its description calls it.
    pub name: String,
    /// What users know the file of its description by.
    pub description: PathBuf,
    /// Its FMUs.
    pub components: Vec<SystemComponent>,
    /// Connections between variables of FMUs; at most one leads to each variable.
    pub connections: Vec<Connection>,
    /// Connectors of the system that values come in through, also parameters.
    pub inputs: Vec<SystemInput>,
    /// Connectors of the system that values go out through.
    pub outputs: Vec<SystemOutput>,
    /// The time that its description proposes.
    pub experiment: SystemExperiment,
    /// The step that a tool noted in its description.
    pub stepping: Option<StepSettings>,
    /// Annotations of its description as a whole.
    pub annotations: Vec<ToolAnnotation>,
    /// Files of other descriptions beside it.
    pub others: Vec<String>,
    /// Sentences about what was taken from where, and what was ignored.
    pub notes: Vec<String>,
    /// The folder of its description.
    folder: PathBuf,
    /// Folders of unpacked archives: the FMUs are in them.
    folders: Vec<TemporaryFolder>,
}

impl SspSystem {
    /// The folder that its description lies in, of an archive the one that it was unpacked to.
    #[must_use]
    pub fn description_folder(&self) -> &Path {
        &self.folder
    }

    /// Folders that archives were unpacked to. They are removed with this system.
    pub fn unpacked_folders(&self) -> impl Iterator<Item = &Path> {
        self.folders.iter().map(TemporaryFolder::folder_path)
    }
}

/// What a tool wrote down for itself, section 4.4.4: one element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ToolAnnotation {
    /// Its type, which begins with a reversed domain name.
    pub kind: String,
    /// Names and values of the attributes of the element.
    pub attributes: Vec<(String, String)>,
    /// The text in the element.
    pub text: String,
}

/// Start and stop of a run, section 5.1.1: the standard says nothing of steps and algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SystemExperiment {
    /// Start [s].
    pub start: Option<f64>,
    /// Stop [s].
    pub stop: Option<f64>,
}

/// The communication step that a tool noted in an annotation: the standard has none.
#[derive(Debug, Clone)]
pub struct StepSettings {
    /// The tool whose algorithm steps the FMUs.
    pub master: SteppingTool,
    /// [s], above 0.
    pub step: f64,
    /// Where it is written.
    pub position: SourcePosition,
}

/// A tool whose annotations say how a system is stepped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SteppingTool {
    /// libcosim and Ecos: `baseStepSize` of `FixedStepAlgorithm` at the experiment. All FMUs take the values of the start of the step.
    Osp,
    /// OMSimulator: `stepSize` of `FixedStepMaster` at the outermost system.
    OmSimulator,
}

impl SteppingTool {
    /// The element of its annotation and the attribute with the step.
    pub(crate) fn step_parameter(self) -> (&'static str, &'static str) {
        match self {
            SteppingTool::Osp => ("FixedStepAlgorithm", "baseStepSize"),
            SteppingTool::OmSimulator => ("FixedStepMaster", "stepSize"),
        }
    }
}

/// An FMU of the system.
#[derive(Debug)]
pub struct SystemComponent {
    /// Its name and those of the systems that it is in, from outside to inside with dots; without the outermost system.
    pub name: String,
    /// The FMU.
    pub source: PathBuf,
    /// What users know that file by: of an archive, its path and the path inside of it.
    pub display_path: PathBuf,
    /// Which interface to use: `any`, `CoSimulation`, `ModelExchange` or `ScheduledExecution`.
    pub implementation: String,
    /// Start values by name of the variable. Section 5.2.3: one that the FMU has no variable for is to be ignored.
    pub start_values: Vec<StartValue>,
    /// Its connectors; the FMU may have more variables.
    pub connectors: Vec<Connector>,
    /// Where it is written.
    pub position: SourcePosition,
}

/// A connector of a component or of the system.
#[derive(Debug, Clone)]
pub struct Connector {
    /// The name, at a component that of a variable of the FMU.
    pub name: String,
    /// Who determines its value.
    pub kind: ConnectorKind,
    /// What it carries; `None` when that is not written: it is what the variable of the FMU is.
    pub data_type: Option<SspType>,
    /// Its unit; `None` when that is not written: it is that of the variable of the FMU.
    pub unit: Option<Arc<SspUnit>>,
    /// Sizes of an array, empty for a single value.
    pub dimensions: Vec<ArrayDimension>,
    /// Where it is written.
    pub position: SourcePosition,
}

/// One direction of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArrayDimension {
    /// So many elements.
    Fixed(u64),
    /// As many as this connector of the same element says.
    Of(String),
    /// It is not written.
    Open,
}

/// Who determines the value of a connector, section 5.2.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConnectorKind {
    /// Another element.
    Input,
    /// The element.
    Output,
    /// The environment, before the run.
    Parameter,
    /// The element, from parameters.
    CalculatedParameter,
    /// The environment, before anything else: sizes of arrays follow from it.
    StructuralParameter,
    /// The element, and it never changes.
    Constant,
    /// The element, for itself.
    Local,
    /// It depends on the connections.
    InOut,
    /// It is not decided.
    Unspecified,
}

impl ConnectorKind {
    /// The words of the standard.
    pub const ALL: [(&str, ConnectorKind); 9] = [
        ("input", ConnectorKind::Input),
        ("output", ConnectorKind::Output),
        ("parameter", ConnectorKind::Parameter),
        ("calculatedParameter", ConnectorKind::CalculatedParameter),
        ("structuralParameter", ConnectorKind::StructuralParameter),
        ("constant", ConnectorKind::Constant),
        ("local", ConnectorKind::Local),
        ("inout", ConnectorKind::InOut),
        ("unspecified", ConnectorKind::Unspecified),
    ];
}

/// The value that a variable has at the beginning.
#[derive(Debug, Clone)]
pub struct StartValue {
    /// The variable of the FMU.
    pub variable: String,
    /// The value, in [`StartValue::unit`].
    pub value: SspValue,
    /// The unit of the value. `None`: it is in the unit of the connector and must not be converted.
    pub unit: Option<Arc<SspUnit>>,
    /// The unit of the connector. `None`: that of the variable of the FMU.
    pub connector_unit: Option<Arc<SspUnit>>,
    /// What is left to do after the value was converted to the unit of the connector.
    pub transformation: ValueTransformation,
    /// Where the value is written.
    pub position: SourcePosition,
}

impl StartValue {
    /// The value for the FMU, when `factor * value + offset` converts it to the unit of the connector. `None` when only
    /// numbers can be converted so, and it is none.
    #[must_use]
    pub fn converted_value(&self, factor: f64, offset: f64) -> Option<SspValue> {
        let converted = ValueTransformation::Linear { factor, offset }.apply(&self.value)?;
        self.transformation.apply(&converted)
    }
}

/// A variable of an FMU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FmuPort {
    /// Place of the FMU among [`SspSystem::components`].
    pub component: usize,
    /// The variable.
    pub variable: String,
}

/// What happens to values between two connectors, through all connectors of nested systems between them. A value is converted
/// from the first unit to the second one, unless that is suppressed, and transformed after that.
#[derive(Debug, Clone)]
pub struct SignalConversion {
    /// The transformation. Its offset is in the second unit.
    pub transformation: ValueTransformation,
    /// Whether units must not be converted.
    pub suppress_unit_conversion: bool,
    /// Whether this holds only when the variables at both ends have the same unit: connectors between them have
    /// transformations, and no connector on the way has a unit.
    pub assumes_equal_units: bool,
    /// The units of the connectors at both ends. `None`: that of the variable of the FMU.
    pub units: (Option<Arc<SspUnit>>, Option<Arc<SspUnit>>),
    /// Where the last of the connections is written.
    pub position: SourcePosition,
}

/// A connection between two FMUs, or between parameters of two FMUs.
#[derive(Debug, Clone)]
pub struct Connection {
    /// Where values come from.
    pub from: FmuPort,
    /// Where they go.
    pub to: FmuPort,
    /// What happens between.
    pub conversion: SignalConversion,
}

/// A connector of the system that values come in through.
#[derive(Debug, Clone)]
pub struct SystemInput {
    /// The connector.
    pub connector: Connector,
    /// Where values go, and what happens on the way.
    pub to: Vec<(FmuPort, SignalConversion)>,
}

/// A connector of the system that values go out through.
#[derive(Debug, Clone)]
pub struct SystemOutput {
    /// The connector.
    pub connector: Connector,
    /// Where values come from, and what happens on the way; `None` when nothing leads to it.
    pub from: Option<(FmuPort, SignalConversion)>,
}
