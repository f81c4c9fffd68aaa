//! Implements co-simulation of a script: each call of the importer is a request to its process.

mod state;

use std::path::{Path, PathBuf};
use std::time::Duration;

use fmu_export::abi::Status;
use fmu_export::resources::resources_folder;
use fmu_export::{
    CoSimulation, FmiError, FmiResult, FmiValue, Lifecycle, LifecycleState, LogCategories, VariableKind,
    VariableValue, log, reject, warn,
};
use python::{
    MODEL_SERVER_PATH, PythonInterpreter, PythonProcess, ScriptError, missing_module, module_install_advice,
};

use crate::INTERFACE;
use crate::interface::{CATEGORIES, PRINTED, ScriptFmuInterface, ScriptVariable, ScriptVariableRole};
use crate::script::{self, SERVE};
use crate::value_codec::{read_values, write_values};
use state::ScriptState;

/// Steps that differ by less than this share are the same step: masters compute it as the difference of two times.
const STEP_TOLERANCE: f64 = 1e-9;

/// What the process is asked; the numbers are those of `fmu.py`.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ScriptRequest {
    /// A new object, with these values, begins a run.
    Initialise = 1,
    /// A step, with these inputs.
    Step = 2,
    /// Inputs and parameters have these values.
    Update = 3,
    /// A copy of all that the object goes on from.
    Save = 4,
    /// An object that goes on from there.
    Restore = 5,
    /// The end of a run.
    Terminate = 6,
}

/// A script as an instance. Its process starts with it, and again after a failure.
pub struct ScriptInstance {
    resources: PathBuf,
    pub(crate) interface: ScriptFmuInterface,
    /// The places of variables by who determines them.
    inputs: Vec<usize>,
    external: Vec<usize>,
    outputs: Vec<usize>,
    pub(crate) lifecycle: Lifecycle,
    /// The value of each variable, by reference.
    pub(crate) values: Vec<VariableValue>,
    /// Whether an input or a parameter was written since outputs were read.
    pub(crate) stale: bool,
    /// Whether a parameter was written that the script does not know of.
    pub(crate) unsent_parameters: bool,
    /// Whether the process has an object of this run.
    pub(crate) initialised: bool,
    process: Option<PythonProcess>,
    /// The contents of a question, kept for the next one.
    message: Vec<u8>,
}

/// Whether Python's module `warnings` wrote a line: `cruise.py:26: UserWarning: it is steep`.
fn is_warning(line: &str) -> bool {
    let mut parts = line.splitn(3, ": ");
    let place = parts.next().and_then(|place| place.rsplit_once(':'));
    let category = parts.next().filter(|_| parts.next().is_some());
    place.is_some_and(|(_, number)| number.parse::<u32>().is_ok())
        && category.is_some_and(|it| it.ends_with("Warning") && !it.contains(char::is_whitespace))
}

impl ScriptInstance {
    /// An instance of the FMU with this folder of resources.
    ///
    /// # Errors
    /// When the resources are not those of the FMU with this identity, or the script does not load here.
    pub fn open_fmu(identifier: &str, resources: &Path) -> FmiResult<Self> {
        let path = resources.join(INTERFACE);
        let wrong = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
        let text = std::fs::read_to_string(&path).or_else(|error| reject(wrong(&error)))?;
        let interface: ScriptFmuInterface =
            serde_json::from_str(&text).or_else(|error| reject(wrong(&error)))?;
        if interface.guid != identifier {
            return reject(format!("expected GUID {}, found {identifier}", interface.guid));
        }
        let mut instance = ScriptInstance {
            resources: resources.to_owned(),
            inputs: interface.step_input_indices(),
            external: interface.external_input_indices(),
            outputs: interface.output_indices(),
            lifecycle: Lifecycle::default(),
            values: interface.variables.iter().map(|it| it.start.clone()).collect(),
            interface,
            stale: true,
            unsent_parameters: false,
            initialised: false,
            process: None,
            message: Vec::new(),
        };
        instance.running_process()?;
        Ok(instance)
    }

    /// The process, which is started when there is none.
    fn running_process(&mut self) -> FmiResult<&mut PythonProcess> {
        let process = match self.process.take() {
            Some(process) => process,
            None => self.start_process()?,
        };
        Ok(self.process.insert(process))
    }

    /// Starts Python and loads the script.
    fn start_process(&self) -> FmiResult<PythonProcess> {
        let ScriptFmuInterface { script, class, python, .. } = &self.interface;
        let interpreter = PythonInterpreter::choose_interpreter(Some(Path::new(python)));
        let [server, path] = [MODEL_SERVER_PATH, script.as_str()].map(|name| self.resources.join(name));
        let arguments = [server.as_os_str(), SERVE.as_ref(), path.as_os_str(), class.as_ref()];
        let refused = |failure: &ScriptError| {
            let python = interpreter.path.display();
            let reason = interpreter.reason;
            let cure = match failure {
                ScriptError::Exception(exception) => missing_module(&exception.message),
                _ => None,
            };
            let cure = cure
                .map(|module| format!("; type {}", module_install_advice(&interpreter.path, module)))
                .unwrap_or_default();
            let message = format!("the script does not load in {python} ({reason}): {failure}{cure}");
            FmiError { status: Status::Error, message }
        };
        let mut process =
            PythonProcess::start(&interpreter, &[], arguments).map_err(|failure| refused(&failure))?;
        let answer = process.wait_for_answer(self.answer_timeout()).map(<[u8]>::to_vec);
        // What it printed so far goes with the first call: the importer gets nothing of an instance that is only being made.
        let answer = answer.map_err(|failure| refused(&failure))?;
        match script::has_variables(&answer, &self.interface.variables) {
            true => Ok(process),
            false => reject(format!(
                "{script} has other variables here than when it was packed: they must not depend on the machine"
            )),
        }
    }

    fn answer_timeout(&self) -> Duration {
        Duration::try_from_secs_f64(self.interface.patience).unwrap_or(Duration::MAX / 4)
    }

    /// Asks the process, and gives what it answers to `take`.
    ///
    /// # Errors
    /// When the script raises an exception, or there is no answer.
    pub(crate) fn request_answer<T>(
        &mut self,
        question: ScriptRequest,
        contents: &[&[u8]],
        take: impl FnOnce(&mut Self, &[u8]) -> FmiResult<T>,
    ) -> FmiResult<T> {
        let patience = self.answer_timeout();
        self.running_process()?;
        let Some(mut process) = self.process.take() else { return reject("there is no process") };
        let answer = process.request_answer(question as u8, contents, patience).map(|_| ());
        for line in process.take_lines() {
            if is_warning(&line) { warn(line) } else { log(PRINTED, line) }
        }
        let done = match answer {
            Ok(()) => take(self, process.answer_contents()),
            Err(ScriptError::Terminated(message)) => Err(FmiError { status: Status::Discard, message }),
            Err(failure) => {
                if matches!(failure, ScriptError::Ended(_)) {
                    self.initialised = false;
                    self.lifecycle.record_failure(Status::Error);
                    return reject(failure.to_string());
                }
                reject(failure.to_string())
            }
        };
        self.process = Some(process);
        done
    }

    /// Asks a question with these values, and reads outputs from the answer.
    fn request_outputs(&mut self, question: ScriptRequest, numbers: &[f64], all: bool) -> FmiResult {
        let mut message = std::mem::take(&mut self.message);
        message.clear();
        numbers.iter().for_each(|number| message.extend(number.to_le_bytes()));
        write_values(if all { &self.external } else { &self.inputs }, &self.values, &mut message);
        let done = self.request_answer(question, &[&message], |own, answer| {
            read_values(&own.outputs, answer, &mut own.values)
        });
        self.message = message;
        if all && done.is_ok() {
            self.unsent_parameters = false;
        }
        done
    }

    fn check_settable<T: FmiValue>(&self, reference: u32, value: &T) -> FmiResult {
        let script_variable = self.script_variable(reference)?;
        let ScriptVariable { name, role, start, min, max } = script_variable;
        if start.kind() != T::KIND {
            return type_mismatch(script_variable, T::KIND);
        }
        let state = self.lifecycle.state;
        let before = matches!(state, LifecycleState::Instantiated | LifecycleState::Initialization);
        let may = match role {
            ScriptVariableRole::Input | ScriptVariableRole::Tunable => {
                before || state == LifecycleState::StepComplete
            }
            ScriptVariableRole::Parameter => before,
            ScriptVariableRole::Output => false,
        };
        if !may {
            return reject(format!("{name} cannot be set in the state {state:?}"));
        }
        // Inputs come from other models, whose transients may leave the limits.
        let limits = min.unwrap_or(f64::NEG_INFINITY)..=max.unwrap_or(f64::INFINITY);
        match value
            .numeric_value()
            .filter(|number| *role != ScriptVariableRole::Input && !limits.contains(number))
        {
            Some(number) => {
                let (low, high) = limits.into_inner();
                reject(format!("{name} = {number} is outside of {low} .. {high}"))
            }
            None => Ok(()),
        }
    }

    fn script_variable(&self, reference: u32) -> FmiResult<&ScriptVariable> {
        self.interface.variables.get(reference as usize).ok_or_else(|| FmiError {
            status: Status::Error,
            message: format!("no variable has the value reference {reference}"),
        })
    }
}

fn type_mismatch<T>(script_variable: &ScriptVariable, expected: VariableKind) -> FmiResult<T> {
    reject(format!(
        "{} is of type {:?}, not {expected:?}",
        script_variable.name,
        script_variable.start.kind()
    ))
}

impl CoSimulation for ScriptInstance {
    type State = ScriptState;

    fn log_categories() -> LogCategories {
        CATEGORIES
    }

    fn instantiate(identifier: &str, resources: Option<&str>) -> FmiResult<Self> {
        match resources.and_then(resources_folder) {
            Some(folder) => Self::open_fmu(identifier, &folder),
            None => reject(format!("expected the place of the folder `resources`, found {resources:?}")),
        }
    }

    fn lifecycle(&mut self) -> &mut Lifecycle {
        &mut self.lifecycle
    }

    fn time_reference(&self) -> Option<u32> {
        u32::try_from(self.values.len()).ok()
    }

    fn reset(&mut self) -> FmiResult {
        self.values = self.interface.variables.iter().map(|it| it.start.clone()).collect();
        (self.stale, self.unsent_parameters, self.initialised) = (true, false, false);
        Ok(())
    }

    fn enter_initialization(&mut self) -> FmiResult {
        self.stale = true;
        Ok(())
    }

    fn exit_initialization(&mut self) -> FmiResult {
        self.refresh_outputs()
    }

    fn refresh_outputs(&mut self) -> FmiResult {
        match self.lifecycle.state {
            _ if !self.stale => return Ok(()),
            LifecycleState::Initialization => {
                self.request_outputs(ScriptRequest::Initialise, &[self.lifecycle.now], true)?;
                self.initialised = true;
            }
            LifecycleState::StepComplete if self.interface.direct => {
                self.request_outputs(ScriptRequest::Update, &[], true)?;
            }
            _ => return Ok(()),
        }
        self.stale = false;
        Ok(())
    }

    fn do_step(&mut self, time: f64, step: f64) -> FmiResult {
        self.lifecycle.check_step(time, step)?;
        let usual = self.interface.step;
        if !self.interface.variable_step && (step - usual).abs() > STEP_TOLERANCE * usual {
            return reject(format!("expected steps of {usual} s, found one of {step} s"));
        }
        let told = match self.unsent_parameters {
            true => self.request_outputs(ScriptRequest::Update, &[], true),
            false => Ok(()),
        };
        let done = told.and_then(|()| self.request_outputs(ScriptRequest::Step, &[time, step], false));
        let Err(FmiError { status, message }) = done else {
            self.lifecycle.now = time + step;
            self.stale = false;
            return Ok(());
        };
        self.lifecycle.terminated = status == Status::Discard;
        self.lifecycle.state =
            if self.lifecycle.terminated { LifecycleState::StepFailed } else { LifecycleState::Error };
        Err(FmiError { status, message: format!("step of {step} s from {time} s: {message}") })
    }

    fn terminate(&mut self) -> FmiResult {
        match self.initialised {
            true => self.request_answer(ScriptRequest::Terminate, &[], |_, _| Ok(())),
            false => Ok(()),
        }
    }

    fn get<T: FmiValue>(&mut self, reference: u32) -> FmiResult<T> {
        let value = self.values.get_mut(reference as usize).and_then(VariableValue::get_typed);
        match value {
            Some(value) => Ok(value),
            None => type_mismatch(self.script_variable(reference)?, T::KIND),
        }
    }

    fn set<T: FmiValue>(&mut self, references: &[u32], values: &[T]) -> FmiResult {
        let mut all = references.iter().zip(values);
        all.try_for_each(|(reference, value)| self.check_settable(*reference, value))?;
        for (reference, value) in references.iter().zip(values) {
            let place = *reference as usize;
            self.values[place].set_typed(value);
            self.stale = true;
            self.unsent_parameters |= self.interface.variables[place].role != ScriptVariableRole::Input;
        }
        Ok(())
    }

    fn set_input_derivatives(&mut self, _: &[u32], _: &[i32], _: &[f64]) -> FmiResult {
        reject("derivatives of inputs are not supported")
    }

    fn directional_derivative(&mut self, _: &[u32], _: &[u32], _: &[f64]) -> FmiResult<Vec<f64>> {
        reject("a directional derivative is not supported")
    }

    fn save(&mut self) -> FmiResult<ScriptState> {
        self.save_state()
    }

    fn restore(&mut self, state: &ScriptState) -> FmiResult {
        self.restore_state(state)
    }

    fn serialize(&mut self, state: &ScriptState) -> FmiResult<Vec<u8>> {
        self.state_to_bytes(state)
    }

    fn deserialize(&mut self, bytes: &[u8]) -> FmiResult<ScriptState> {
        self.state_from_bytes(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_of_python_are_told_from_other_lines() {
        assert!(is_warning("/a b/cruise.py:26: UserWarning: it is: steep"));
        assert!(is_warning("<string>:1: DeprecationWarning: old"));
        for line in ["Warning: steep", "cruise.py:26: steep", "a: UserWarning: b", "x:1: two Warning: b", ""]
        {
            assert!(!is_warning(line), "{line}");
        }
    }
}
