//! Imports a system of SSP as the text of a scenario: its FMUs, start values and connections, and its step and stop time.

mod connectors;
mod conversions;
mod experiment;
mod parameters;
mod part;

use std::fmt::Write as _;
use std::path::Path;

use diagnostics::{Error, SourceMap, TextFile, group_similar, suggest};
use fmu_import::description::{FmiType, Variable};
use fmu_import::{Causality, FmiInterface, Fmu, Value};
use ssp::{Connection, FmuPort, SourcePosition, StartValue};
use units::Unit;

use super::{Algorithm, Document, ScenarioAnnotation};
use conversions::{connection_unit_conversion, connector_unit, conversion_keys, unit_from_ssp};
pub(super) use experiment::{
    DefaultExperiment, ExperimentSettings, ExperimentTime, SystemStepping, default_experiment,
};
pub(crate) use parameters::ssp_value;
pub(super) use part::{SubsystemPart, SubsystemSettings, import_part};

/// A system or an FMU that a scenario is made of.
#[derive(Debug)]
pub struct SystemImport {
    /// What was taken from where, and what was left out.
    pub notes: Vec<String>,
    /// How it is stepped, unless a scenario in its annotation says that.
    pub(super) stepping: Option<SystemStepping>,
    /// Owns the unpacked archive, which the FMUs are in.
    _system: Option<ssp::SspSystem>,
}

impl SystemImport {
    pub(super) fn new(
        notes: Vec<String>,
        stepping: Option<SystemStepping>,
        system: Option<ssp::SspSystem>,
    ) -> Self {
        SystemImport { notes: group_similar(notes), stepping, _system: system }
    }

    /// The sentence about times and algorithm of a run, as far as the system decides them.
    pub(crate) fn describe_stepping(&self, document: &Document) -> Option<String> {
        self.stepping.as_ref()?.describe_stepping(document)
    }
}

/// Whether a path is that of a system rather than of a scenario.
pub(super) fn is_system(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let named = ["ssp", "ssd"].iter().any(|known| ending.eq_ignore_ascii_case(known));
    named || path.join("SystemStructure.ssd").is_file()
}

/// The system at a path as the text of a scenario; `variant` chooses another description of it.
///
/// # Errors
/// When it is no system, one of its FMUs cannot be opened, or it has what a scenario cannot have.
pub(super) fn import_system(
    path: &Path,
    variant: Option<&str>,
) -> Result<(TextFile, SystemImport), ImportError> {
    let system = ssp::open_system(path, variant).map_err(|error| ImportError::new(&error))?;
    let mut notes = Vec::new();
    if variant.is_none() && !system.others.is_empty() {
        let others = system.others.join(", ");
        notes.push(format!(
            "{} has the variants {others} besides: `--variant NAME` runs one, `variant = \"NAME\"` beside `extends` takes one",
            path.display()
        ));
    }
    let annotation = ScenarioAnnotation::from_system(&system, path);
    if let Some(ScenarioAnnotation::Current(text)) = annotation {
        notes.push(format!("{}: the scenario in its annotation is used", path.display()));
        let folder = Some(system.description_folder().to_owned());
        let file = TextFile { folder, ..TextFile::new(path, text) };
        return Ok((file, SystemImport::new(notes, None, Some(system))));
    }
    // An export notes the step for libcosim, not its algorithm.
    let is_ours = annotation.is_some();
    if let Some(ScenarioAnnotation::Stale(note)) = annotation {
        notes.push(note);
    }
    let mut writer = ScenarioWriter::new(&system, None)?;
    let stepping = writer.write_scenario(is_ours)?;
    let ScenarioWriter { text, source_map, notes: more, .. } = writer;
    let notes = notes.into_iter().chain(system.notes.iter().cloned()).chain(more).collect();
    let file = TextFile { source_map, ..TextFile::new(path, text) };
    Ok((file, SystemImport::new(notes, Some(stepping), Some(system))))
}

/// Why a system cannot be used.
pub(super) struct ImportError {
    pub error: Error,
    /// A variant that is similar to the one that it does not have.
    pub hint: Option<String>,
    /// Whether it does not have the variant.
    pub variant: bool,
}

impl ImportError {
    fn new(error: &ssp::Error) -> Self {
        let hint = match error {
            ssp::Error::Variant { wanted, found, .. } => {
                let stems = found.iter().map(|it| it.file.strip_suffix(".ssd").unwrap_or(&it.file));
                let names = found.iter().map(|it| it.name.as_str()).filter(|name| !name.is_empty());
                suggest::did_you_mean(wanted, stems.chain(names))
            }
            _ => None,
        };
        let variant = matches!(error, ssp::Error::Variant { .. });
        ImportError { error: Error::invalid_input(error.to_string()), hint, variant }
    }
}

impl From<Error> for ImportError {
    fn from(error: Error) -> Self {
        ImportError { error, hint: None, variant: false }
    }
}

impl From<ImportError> for Error {
    fn from(ImportError { error, hint, .. }: ImportError) -> Self {
        error.with_optional_help(hint)
    }
}

/// A mistake at a place of the system.
fn error_at(place: &SourcePosition, message: impl std::fmt::Display) -> Error {
    Error::invalid_input(format!("{place}: {message}"))
}

struct ScenarioWriter<'a> {
    system: &'a ssp::SspSystem,
    /// The name of the node of each component.
    names: Vec<String>,
    fmus: Vec<Fmu>,
    text: String,
    /// Where what the text says stands in the system.
    source_map: SourceMap,
    notes: Vec<String>,
}

/// The interface that a component asks for; none leaves it to the FMU.
fn component_interface(component: &ssp::SystemComponent) -> Result<Option<FmiInterface>, Error> {
    match component.implementation.as_str() {
        "any" => Ok(None),
        "CoSimulation" => Ok(Some(FmiInterface::CoSimulation)),
        "ModelExchange" => Ok(Some(FmiInterface::ModelExchange)),
        other => {
            let message = format!(
                "expected the implementation any, CoSimulation or ModelExchange, found {other}: export the component for co-simulation"
            );
            Err(error_at(&component.position, message))
        }
    }
}

impl<'a> ScenarioWriter<'a> {
    fn new(system: &'a ssp::SspSystem, role: Option<&SubsystemSettings>) -> Result<Self, Error> {
        let prefix = role.map_or_else(String::new, |role| format!("{}_", role.name));
        let mut names: Vec<String> = Vec::new();
        let mut fmus = Vec::new();
        for component in &system.components {
            let interface = component_interface(component)?;
            let fmu = Fmu::open_interface(&component.source, interface).map_err(|error| {
                let [path, shown] = [&component.source, &component.display_path].map(|it| it.display());
                let message = error.to_string().replace(&path.to_string(), &shown.to_string());
                error_at(&component.position, message)
            })?;
            fmus.push(fmu);
            let mut name = prefix.clone() + &node_name(&component.name);
            while names.contains(&name) {
                name.push('_');
            }
            names.push(name);
        }
        let mut source_map = SourceMap::default();
        source_map.add_mapping(0, system.description.display().to_string());
        for component in &system.components {
            let source = std::path::absolute(&component.source);
            source_map.rename_path(source.as_deref().unwrap_or(&component.source), &component.display_path);
        }
        Ok(ScenarioWriter { system, names, fmus, text: String::new(), source_map, notes: Vec::new() })
    }

    /// Writes the whole scenario; `is_ours` says that annotations for other tools come from this program.
    fn write_scenario(&mut self, is_ours: bool) -> Result<SystemStepping, Error> {
        let system = self.system;
        self.write_line(format_args!("title = {}", toml_string(&system.name)));
        let stepping = self.write_stepping(is_ours)?;
        self.write_nodes_and_connections()?;
        Ok(stepping)
    }

    /// Says where what follows stands in the system.
    fn mark_text_origin(&mut self, place: &SourcePosition) {
        self.source_map.add_mapping(self.text.len(), place.clone());
    }

    fn write_nodes_and_connections(&mut self) -> Result<(), Error> {
        let system = self.system;
        let fed = system.connections.iter().map(|it| &it.to).collect::<Vec<_>>();
        for index in 0..system.components.len() {
            self.write_component(index, &fed)?;
        }
        system.connections.iter().try_for_each(|connection| self.write_connection(connection))
    }

    fn write_line(&mut self, line: std::fmt::Arguments) {
        // Writing into a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }

    /// SSP has no step and no algorithm: they are those of annotations, of the FMUs and of this program.
    fn write_stepping(&mut self, is_ours: bool) -> Result<SystemStepping, Error> {
        let times = self.default_experiment(None)?;
        let DefaultExperiment { start, step, stop } = &times;
        let (step, stop) = (step.value, stop.value);
        self.write_line(format_args!("\n[time]\nstart = {start:?}\nstep = {step:?}\nstop = {stop:?}"));
        self.write_line(format_args!("\n[coupling]\nloops = \"delay\""));
        let annotation = self.system.stepping.as_ref().filter(|_| !is_ours);
        let noted = annotation.filter(|it| it.master == ssp::SteppingTool::Osp);
        let noted = noted.map(|it| format!("the FixedStepAlgorithm of {}", it.position));
        let reason = noted.or_else(|| experiment::jacobi_reason(self.system).map(str::to_owned));
        let algorithm = reason.map(|reason| {
            self.write_line(format_args!("algorithm = \"{}\"", Algorithm::Jacobi.keyword()));
            (Algorithm::Jacobi, reason)
        });
        Ok(SystemStepping::Whole { name: self.system.name.clone(), times, algorithm })
    }

    /// The times of a run; `step` is the one that the scenario around the system has.
    fn default_experiment(&self, step: Option<ExperimentTime>) -> Result<DefaultExperiment, Error> {
        let system = self.system;
        let annotation = system.stepping.as_ref();
        let annotation =
            annotation.map(|it| ExperimentTime::new(it.step, format!("noted at {}", it.position)));
        let stop = system.experiment.stop.map(|stop| ExperimentTime::new(stop, "its DefaultExperiment"));
        let start = system.experiment.start.unwrap_or(0.0);
        default_experiment(
            &system.name,
            ExperimentSettings { start, stop, step: step.or(annotation) },
            &self.fmus,
        )
    }

    fn find_port_variable(&self, FmuPort { component, variable }: &FmuPort) -> Option<&Variable> {
        let description = &self.fmus.get(*component)?.description;
        description.find_variable(variable).map(|index| &description.variables[index])
    }

    fn write_component(&mut self, index: usize, fed: &[&FmuPort]) -> Result<(), Error> {
        let component = &self.system.components[index];
        let interface = match component_interface(component)? {
            Some(FmiInterface::ModelExchange) => "interface = \"model-exchange\"\n",
            Some(FmiInterface::CoSimulation) | None => "",
        };
        self.mark_text_origin(&component.position);
        // Relative to where the program was started, not to the system.
        let source = std::path::absolute(&component.source);
        let source = source.map_err(|error| error_at(&component.position, error))?;
        let source = source.to_string_lossy();
        self.write_line(format_args!(
            "\n[[fmu]]\nname = {}\npath = {}\n{interface}unconnected = \"start\"\n\n[fmu.start]",
            toml_string(&self.names[index]),
            toml_string(&source)
        ));
        for start in &component.start_values {
            let port = FmuPort { component: index, variable: start.variable.clone() };
            let is_array = || {
                let prefix = format!("{}[", start.variable);
                let variables = &self.fmus[index].description.variables;
                variables.iter().find(|variable| variable.name.starts_with(&prefix))
            };
            let Some(variable) = self.find_port_variable(&port).or_else(is_array) else {
                // Section 5.2.3 of SSP 2.0.
                let note = format!(
                    "{}: `{}` has no variable `{}`, so its start value is left out",
                    start.position, component.name, start.variable
                );
                self.notes.push(note);
                continue;
            };
            let takes = variable.causality == Causality::Input || parameters::is_parameter(variable);
            if fed.contains(&&port) && takes {
                continue;
            }
            let value = start_value(start, variable)?;
            self.mark_text_origin(&start.position);
            self.write_line(format_args!("{} = {value}", toml_string(&start.variable)));
        }
        for connection in self.system.connections.iter().filter(|it| it.to.component == index) {
            let (source, target) = self.connection_variables(connection)?;
            if parameters::is_start(source, target) {
                let value = parameters::parameter_start_toml(self.system, connection, source, target)?;
                self.mark_text_origin(&connection.conversion.position);
                self.write_line(format_args!("{} = {value}", toml_string(&connection.to.variable)));
            }
        }
        Ok(())
    }

    /// The variables at both ends of a connection.
    fn connection_variables(
        &self,
        Connection { from, to, conversion: way }: &Connection,
    ) -> Result<(&Variable, &Variable), Error> {
        Ok((self.require_variable(from, way)?, self.require_variable(to, way)?))
    }

    fn write_connection(&mut self, connection: &Connection) -> Result<(), Error> {
        let Connection { from, to, conversion: way } = connection;
        let (source, target) = self.connection_variables(connection)?;
        if parameters::is_start(source, target) {
            return Ok(());
        }
        if target.causality != Causality::Input && !parameters::is_parameter(target) {
            let message = format!(
                "expected an input, found `{}`, which is {:?}: bind the value to it in a ParameterBinding",
                to.variable, target.causality
            );
            return Err(error_at(&way.position, message));
        }
        let words = conversion_keys(way, source, target)?;
        let name = |port: &FmuPort| toml_string(&format!("{}.{}", self.names[port.component], port.variable));
        let (from, to) = (name(from), name(to));
        self.mark_text_origin(&way.position);
        self.write_line(format_args!("\n[[connect]]\nfrom = {from}\nto = {to}{words}"));
        Ok(())
    }
}

/// The name of a node for a component or a file: a dot ends the name of a node.
#[must_use]
pub fn node_name(name: &str) -> String {
    name.replace(['.', '"', '\\'], "_")
}

/// A text of TOML.
#[must_use]
pub fn toml_string(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A start value in the unit and of the type of its variable, as TOML.
fn start_value(start: &StartValue, variable: &Variable) -> Result<String, Error> {
    Ok(ssp_value_to_toml(&converted_start_value(start, variable)?, variable))
}

/// A start value in the unit of its variable.
fn converted_start_value(start: &StartValue, variable: &Variable) -> Result<ssp::SspValue, Error> {
    let (mut factor, mut offset) = (1.0, 0.0);
    if let Some(from) = &start.unit {
        let to = connector_unit(start.connector_unit.as_deref(), variable);
        if let (Some(given), Some((b, to))) = (unit_from_ssp(from), to) {
            let a = variable.offset_free_unit(given);
            let message = || format!("[{}] is no unit of [{to}]", from.name);
            (factor, offset) =
                Unit::conversion(&a, &b).ok_or_else(|| error_at(&start.position, message()))?;
        }
    }
    start.converted_value(factor, offset).ok_or_else(|| {
        error_at(&start.position, "expected a number for a conversion or transformation, found none")
    })
}

fn ssp_value_to_toml(value: &ssp::SspValue, variable: &Variable) -> String {
    match value {
        ssp::SspValue::Real(number) if variable.kind == FmiType::Integer && number.fract() == 0.0 => {
            format!("{number:.0}")
        }
        ssp::SspValue::Real(number) => format!("{number:?}").to_lowercase(),
        ssp::SspValue::Integer(number) if variable.kind == FmiType::Real => format!("{number}.0"),
        ssp::SspValue::Integer(number) if i64::try_from(*number).is_err() => toml_string(&number.to_string()),
        ssp::SspValue::Integer(number) => number.to_string(),
        ssp::SspValue::Boolean(truth) => truth.to_string(),
        ssp::SspValue::String(text) | ssp::SspValue::Enumeration(text) => toml_string(text),
        ssp::SspValue::Binary(bytes) => Value::Binary(bytes.clone()).to_string(),
        ssp::SspValue::Array { elements, .. } => {
            let elements: Vec<_> =
                elements.iter().map(|element| ssp_value_to_toml(element, variable)).collect();
            format!("[{}]", elements.join(", "))
        }
    }
}
