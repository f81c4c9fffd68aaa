//! Writes the scenario of one FMU: its experiment, its inputs from a table, its reference as a baseline with a tube.

use std::path::Path;

use fmu_import::{Causality, FmiType, FmuDescription, Variability, Variable};
use recording::table;
use scenario::document::toml_string;

use super::experiment::CaseExperiment;
use super::reference::{ReferenceResults, time_column};
use super::toml_text::{
    ColumnOmission, comment_lines, comment_text, omission_notes, toml_number, without_rounding_digits,
};

/// Half the height of tubes as a share of the range of a signal, and half their width as a share of the time, as csv-compare of the
/// Modelica Association has them.
const TUBE: f64 = 0.002;
/// A tube that is wider than this share of the time would hold too much.
const LARGEST_WIDTH: f64 = 0.02;

/// What the scenario of an FMU is made of.
pub(super) struct FmuCase<'a> {
    pub description: &'a FmuDescription,
    /// The name of the node.
    pub node: &'a str,
    /// The archive, relative to the suite.
    pub archive: &'a str,
    /// The file with the reference, as it is named.
    pub reference_name: &'a str,
    pub reference: &'a ReferenceResults,
    /// The file of the baseline, relative to the suite.
    pub recording: &'a str,
    pub experiment: &'a CaseExperiment,
    pub inputs: Option<&'a InputTables>,
}

/// The inputs of an FMU in a table.
#[derive(Debug)]
pub(super) struct InputTables {
    /// The file, as it is named.
    pub name: String,
    /// The file, relative to the suite.
    pub path: String,
    time: String,
    columns: Vec<InputColumn>,
    /// Columns that are no inputs.
    pub notes: Vec<String>,
}

#[derive(Debug)]
struct InputColumn {
    /// The name of the column in the file.
    title: String,
    /// The unit of the input, where the file says none.
    unit: Option<String>,
    variable: String,
    /// Whether values stay as they are until the next row.
    is_held: bool,
}

impl InputTables {
    /// Finds the inputs of the FMU in the file `file`, which the suite knows as `path`.
    ///
    /// # Errors
    /// In words, when the file cannot be read, or has none of the inputs.
    pub fn read(file: &Path, path: String, description: &FmuDescription) -> Result<Self, String> {
        let titles = table::read_titles(file).map_err(|error| error.to_string())?;
        let time = time_column(file)?.ok_or("it has no columns")?;
        let (mut columns, mut omissions) = (Vec::new(), Vec::new());
        for title in titles.columns.iter().filter(|title| title.name != time) {
            let variable = description.find_variable(&title.plain).map(|place| &description.variables[place]);
            match variable.filter(|it| it.causality == Causality::Input) {
                Some(variable) if variable.name != title.plain => {
                    omissions.push(omission(title, "an array in one column"));
                }
                Some(variable) => columns.push(InputColumn {
                    title: title.name.clone(),
                    unit: variable.offset_free_unit_name().filter(|_| title.unit.is_none()),
                    variable: variable.name.clone(),
                    is_held: is_held(variable),
                }),
                None => omissions.push(omission(title, "no input of the FMU")),
            }
        }
        if columns.is_empty() {
            return Err("none of its columns is an input of the FMU".to_owned());
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let notes = omission_notes("not connected", &omissions);
        Ok(InputTables { name, path, time, columns, notes })
    }

    /// A table for each kind of values between rows, and a connection for each column.
    fn toml_sections(&self, node: &str) -> String {
        let mut text = String::new();
        for (table, interpolation, is_held) in [("inputs", "linear", false), ("held_inputs", "hold", true)] {
            let columns: Vec<_> = self.columns.iter().filter(|column| column.is_held == is_held).collect();
            if columns.is_empty() {
                continue;
            }
            let lines = columns.iter().map(|InputColumn { title, unit, variable, .. }| {
                let unit =
                    unit.as_ref().map(|unit| format!(", unit = {}", toml_string(unit))).unwrap_or_default();
                format!("{} = {{ column = {}{unit} }}\n", toml_string(variable), toml_string(title))
            });
            text += &format!(
                "\n# The inputs of {}\n[[table]]\nname = \"{table}\"\npath = {}\ntime = {}\norigin = 0.0 # its times are those of the run\n\
                 interpolation = \"{interpolation}\"\n[table.columns]\n{}",
                comment_text(&self.name),
                toml_string(&self.path),
                toml_string(&self.time),
                lines.collect::<String>()
            );
            for column in columns {
                let [from, to] =
                    [table, node].map(|node| toml_string(&format!("{node}.{}", column.variable)));
                text += &format!("\n[[connect]]\nfrom = {from}\nto = {to}\n");
            }
        }
        text + &comment_lines(&self.notes)
    }
}

fn omission(title: &table::ColumnTitle, reason: &str) -> ColumnOmission {
    ColumnOmission { column: title.plain.clone(), reason: reason.to_owned() }
}

/// Whether values of a variable stay as they are between two rows: there is nothing between two gears.
fn is_held(variable: &Variable) -> bool {
    variable.kind != FmiType::Real || matches!(variable.variability, Variability::Discrete)
}

impl FmuCase<'_> {
    /// The text of the scenario file.
    pub fn scenario_text(&self) -> String {
        let FmuCase { description, node, reference_name, reference, experiment, .. } = self;
        let archive_name = self.archive.rsplit('/').next().unwrap_or_default();
        let observed = match reference.observed.as_slice() {
            [] => String::new(),
            names => {
                let names: Vec<_> = names.iter().map(|name| toml_string(name)).collect();
                format!("observe = [{}] # compared, and no outputs\n", names.join(", "))
            }
        };
        let inputs = self.inputs.map(|inputs| inputs.toml_sections(node)).unwrap_or_default();
        let duration = experiment.stop.value - experiment.start.value;
        let (width, reason) = match experiment.step.value {
            step if step > TUBE * duration && step <= LARGEST_WIDTH * duration => {
                (step, "a step: an event is seen at the next communication point")
            }
            _ => (without_rounding_digits(TUBE * duration), "0.2 % of the time, as csv-compare has it"),
        };
        format!(
            "# Made by `trackside init` from {} and {}. It is yours: nothing overwrites it.\ntitle = {}\n\n{}\n\
             [[fmu]]\nname = {}\npath = {}\n{}{observed}{inputs}\n\
             # {}, with the names of this scenario\n{}[[baseline]]\nname = \"as the reference\"\nrecording = {}\n\
             relative = {} # half height, as a share of the range of each signal, as csv-compare has it\ntime = {} # half width [s]: {reason}\n",
            comment_text(archive_name),
            comment_text(reference_name),
            toml_string(&format!("{}, as {reference_name} has it", description.name)),
            experiment.toml_section(),
            toml_string(node),
            toml_string(self.archive),
            self.unconnected_line(),
            comment_text(reference_name),
            comment_lines(&reference.notes),
            toml_string(self.recording),
            toml_number(TUBE),
            toml_number(width),
        )
    }

    /// The line that gives the other inputs their start values, if there are any.
    fn unconnected_line(&self) -> String {
        let connected = |name: &str| {
            self.inputs.is_some_and(|inputs| inputs.columns.iter().any(|column| column.variable == name))
        };
        let inputs = self.description.indices_with_causality(Causality::Input);
        let inputs = inputs.map(|place| self.description.variables[place].array_name());
        let mut open: Vec<_> = inputs.filter(|name| !connected(name)).collect();
        open.dedup();
        match open.as_slice() {
            [] => String::new(),
            names => {
                let names = diagnostics::suggest::join_shortened(names);
                format!("unconnected = \"start\" # no table has {}\n", comment_text(&names))
            }
        }
    }
}
