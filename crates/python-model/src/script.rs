//! Asks a script for its description, and makes the interface and model description of its FMU.

use std::path::Path;
use std::time::Duration;

use fmu_export::description::{self, DescriptionTable, FmuCapabilities};
use fmu_export::{
    Causality, Info, Initial, OutputDependencies, Variability, VariableKind, VariableRow, VariableValue,
};
use python::{MODEL_SERVER_PATH, PythonException, PythonInterpreter, PythonProcess, ScriptError};
use serde::Deserialize;
use serde_json::Value;

use crate::interface::{CATEGORIES, ScriptFmuInterface, ScriptVariable, ScriptVariableRole};

/// The word for the process of an instance.
pub(crate) const SERVE: &str = "serve";
/// The word for a look at the script.
const DESCRIBE: &str = "describe";
/// How long a script may take to load when it is packed.
const PATIENCE: Duration = Duration::from_secs(120);

/// What a script says of itself.
#[derive(Debug, Deserialize)]
struct ScriptDescription {
    class: String,
    doc: String,
    version: String,
    author: Option<String>,
    step_size: f64,
    stop_time: Option<f64>,
    variable_step: bool,
    patience: f64,
    direct: bool,
    python: [String; 2],
    unsaved: Option<String>,
    variables: Vec<DescribedScriptVariable>,
}

/// A variable, in the words of `fmu.py`.
#[derive(Debug, Deserialize)]
struct DescribedScriptVariable {
    name: String,
    causality: ScriptCausality,
    kind: ScriptType,
    start: Value,
    unit: String,
    doc: String,
    min: Option<f64>,
    max: Option<f64>,
    nominal: Option<f64>,
    display_unit: Option<String>,
    tunable: bool,
    discrete: bool,
    depends: Option<Vec<String>>,
    /// File and line.
    place: (String, usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ScriptCausality {
    Input,
    Output,
    Parameter,
    Local,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ScriptType {
    Real,
    Integer,
    Boolean,
    String,
}

/// A script, as its FMU is described.
pub struct PackedScript {
    /// What the library has to know, without the identity.
    pub interface: ScriptFmuInterface,
    /// The description.
    pub table: DescriptionTable,
    /// Why the state cannot be copied, if it cannot.
    pub unsaved: Option<String>,
    /// The version of Python.
    pub python: String,
    /// What the script printed.
    pub printed: Vec<String>,
}

/// Describes the script of this name in a folder with `fmu.py`, for an FMU of another name.
///
/// # Errors
/// With the exception, when the script does not load; when it says what FMI does not allow.
pub fn describe_script(
    interpreter: &PythonInterpreter,
    folder: &Path,
    script: &str,
    class: Option<&str>,
    name: &str,
) -> Result<PackedScript, ScriptError> {
    let [server, path] = [MODEL_SERVER_PATH, script].map(|name| folder.join(name));
    let class = class.unwrap_or_default();
    let arguments = [server.as_os_str(), DESCRIBE.as_ref(), path.as_os_str(), class.as_ref()];
    let mut process = PythonProcess::start(interpreter, &[], arguments)?;
    let answer = process.wait_for_answer(PATIENCE).map(<[u8]>::to_vec)?;
    let said: ScriptDescription = serde_json::from_slice(&answer).map_err(|error| {
        ScriptError::Ended(format!("the script has attributes of other types than expected: {error}"))
    })?;
    let (interface, table) = fmu_description(&said, script, name)?;
    let ScriptDescription { unsaved, python: [_, python], .. } = said;
    Ok(PackedScript { interface, table, unsaved, python, printed: process.take_lines() })
}

/// Whether a script still has the variables that it was packed with.
pub(crate) fn has_variables(answer: &[u8], packed: &[ScriptVariable]) -> bool {
    let Ok(found) = serde_json::from_slice::<Value>(answer) else { return false };
    let Ok(found) = Vec::<DescribedScriptVariable>::deserialize(&found["variables"]) else {
        return false;
    };
    found.len() == packed.len()
        && found.iter().zip(packed).all(|(found, packed)| {
            let kind = start_value(found).map(|cell| cell.kind());
            found.name == packed.name
                && variable_role(found) == packed.role
                && kind == Some(packed.start.kind())
        })
}

fn variable_role(variable: &DescribedScriptVariable) -> ScriptVariableRole {
    match variable.causality {
        ScriptCausality::Input => ScriptVariableRole::Input,
        ScriptCausality::Parameter if variable.tunable => ScriptVariableRole::Tunable,
        ScriptCausality::Parameter => ScriptVariableRole::Parameter,
        ScriptCausality::Output | ScriptCausality::Local => ScriptVariableRole::Output,
    }
}

/// The start value; none that its type does not hold.
fn start_value(variable: &DescribedScriptVariable) -> Option<VariableValue> {
    let start = &variable.start;
    Some(match variable.kind {
        // Texts are those numbers that JSON does not have.
        ScriptType::Real => VariableValue::Real(start.as_f64().or_else(|| start.as_str()?.parse().ok())?),
        ScriptType::Integer => VariableValue::Integer(i32::try_from(start.as_i64()?).ok()?),
        ScriptType::Boolean => VariableValue::Boolean(start.as_bool()?),
        ScriptType::String => VariableValue::String(start.as_str()?.to_owned()),
    })
}

fn fmu_description(
    said: &ScriptDescription,
    script: &str,
    name: &str,
) -> Result<(ScriptFmuInterface, DescriptionTable), ScriptError> {
    let mut wrong = Vec::new();
    let mut variables = Vec::new();
    let mut described = Vec::new();
    for variable in &said.variables {
        let Some(start) = start_value(variable) else {
            let (name, start) = (&variable.name, &variable.start);
            let problem = format!("`{name}`: expected a start value of 32 bits, found {start}");
            wrong.push((Some(&variable.place), problem));
            continue;
        };
        let row = variable_table_row(variable, start.kind(), said.direct);
        let start_text =
            (variable_role(variable) != ScriptVariableRole::Output).then(|| start.to_start_attribute());
        described.push(description::DescribedVariable { row, kind: start.kind(), start: start_text });
        let DescribedScriptVariable { name, min, max, .. } = variable;
        let (name, role) = (name.clone(), variable_role(variable));
        variables.push(ScriptVariable { name, role, start, min: *min, max: *max });
    }
    let text = |text: &str| -> &'static str { text.to_owned().leak() };
    let mut info = Info::new(text(name), text(&said.doc), said.step_size);
    info.stop = said.stop_time;
    info = info.version(text(&said.version)).log_categories(CATEGORIES);
    info.author = said.author.as_deref().map(text);
    let capabilities = FmuCapabilities {
        variable_step: said.variable_step,
        state: said.unsaved.is_none(),
        serialized_state: said.unsaved.is_none(),
        needs_tool: true,
        ..FmuCapabilities::default()
    };
    let table = DescriptionTable { info, variables: described, capabilities, arrays: false };
    wrong.extend(table.description_problems().into_iter().map(|(place, problem)| match place {
        Some(place) => {
            let name = table.variables[place].row.name;
            let variable = said.variables.iter().find(|variable| variable.name == name);
            (variable.map(|it| &it.place), format!("`{name}`: {problem}"))
        }
        None => (None, problem),
    }));
    if said.patience.is_nan() || said.patience <= 0.0 {
        wrong.push((None, format!("expected a positive `patience`, found {}", said.patience)));
    }
    check_no_mistakes(&said.class, &wrong)?;
    let interface = ScriptFmuInterface {
        name: name.to_owned(),
        guid: String::new(),
        script: script.to_owned(),
        class: said.class.clone(),
        python: said.python[0].clone(),
        direct: said.direct,
        step: said.step_size,
        variable_step: said.variable_step,
        patience: said.patience,
        variables,
    };
    Ok((interface, table))
}

/// Tells all that is wrong, at the first place that is known.
fn check_no_mistakes(class: &str, wrong: &[(Option<&(String, usize)>, String)]) -> Result<(), ScriptError> {
    if wrong.is_empty() {
        return Ok(());
    }
    let problems: Vec<_> = wrong.iter().map(|(_, problem)| problem.as_str()).collect();
    let place = wrong.iter().find_map(|(place, _)| *place);
    Err(ScriptError::Exception(PythonException {
        message: format!("the class {class}: {}", problems.join("; ")),
        file: place.map(|(file, _)| file.clone()),
        line: place.map(|(_, line)| *line),
        function: None,
    }))
}

/// The attributes of a variable. Its texts live as long as the program, which packs one FMU.
fn variable_table_row(variable: &DescribedScriptVariable, kind: VariableKind, direct: bool) -> VariableRow {
    let text = |text: &str| -> &'static str { text.to_owned().leak() };
    let output = fmu_export::output(text(&variable.name), text(&variable.unit), text(&variable.doc));
    // Without direct outputs all inputs act in steps.
    let depends = match &variable.depends {
        _ if !direct || variable.causality != ScriptCausality::Output => OutputDependencies::On(&[]),
        None => OutputDependencies::All,
        Some(names) => OutputDependencies::On(names.iter().map(|name| text(name)).collect::<Vec<_>>().leak()),
    };
    let discrete = variable.discrete || kind != VariableKind::Real;
    let (causality, variability, initial) = match variable.causality {
        ScriptCausality::Input => (Causality::Input, discrete, None),
        ScriptCausality::Output => (Causality::Output, discrete, Some(Initial::Calculated)),
        ScriptCausality::Local => (Causality::Local, discrete, Some(Initial::Calculated)),
        ScriptCausality::Parameter => (Causality::Parameter, false, Some(Initial::Exact)),
    };
    let variability = match (causality, variability) {
        (Causality::Parameter, _) if variable.tunable => Variability::Tunable,
        (Causality::Parameter, _) => Variability::Fixed,
        (_, true) => Variability::Discrete,
        (_, false) => Variability::Continuous,
    };
    let DescribedScriptVariable { min, max, nominal, display_unit, .. } = variable;
    let display_unit = display_unit.as_deref().map(text);
    let (min, max, nominal) = (*min, *max, *nominal);
    VariableRow { causality, variability, initial, depends, min, max, nominal, display_unit, ..output }
}
