//! Drives the scenario as an instance of FMI: variables, times, and the calls of its importer.

mod state;

use std::path::{Path, PathBuf};

use cosim::execution::Execution;
use fmu_export::abi::Status;
use fmu_export::resources::resources_folder;
use fmu_export::{
    CoSimulation, FmiError, FmiResult, FmiValue, Lifecycle, LifecycleState, LogCategories, SUMMARY,
    VariableValue, reject,
};

use crate::INTERFACE;
use crate::interface::{ExposedVariable, ExposedVariableRole, ScenarioFmuInterface};
use crate::running::{EarlyEnd, NODES, ScenarioExecution};
use state::{SavedInstance, ScenarioGeneration};

/// Share of a communication step that times may differ by and still be the same.
const SAME: f64 = 1e-6;

/// A scenario as an instance.
pub struct ScenarioInstance {
    resources: PathBuf,
    pub(crate) interface: ScenarioFmuInterface,
    pub(crate) course: Lifecycle,
    /// The value of each variable, by reference.
    pub(crate) values: Vec<VariableValue>,
    /// The value of each input, by reference; none where the scenario has its own.
    pub(crate) inputs: Vec<Option<f64>>,
    /// Whether an input or parameter was set since the nodes were initialised.
    pub(crate) stale: bool,
    /// Nodes that the importer may have states of, of before the last reset.
    pub(crate) retired: Option<ScenarioGeneration>,
    pub(crate) parts: Option<ScenarioGeneration>,
    /// The number of the next nodes.
    next: u64,
}

/// A failure that ends the life of the instance.
pub(crate) fn fatal_fmi_error(error: diagnostics::Error) -> FmiError {
    FmiError { status: Status::Error, message: error.to_string() }
}

impl ScenarioInstance {
    /// An instance of the FMU with this folder of resources.
    ///
    /// # Errors
    /// When the resources are not those of the FMU with this identity.
    pub fn open_fmu(identifier: &str, resources: &Path) -> FmiResult<Self> {
        // The process belongs to the importer.
        fmu_import::disable_crash_handlers();
        let path = resources.join(INTERFACE);
        let wrong = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
        let text = std::fs::read_to_string(&path).or_else(|error| reject(wrong(&error)))?;
        let interface: ScenarioFmuInterface =
            serde_json::from_str(&text).or_else(|error| reject(wrong(&error)))?;
        if interface.guid != identifier {
            return reject(format!("expected GUID {}, found {identifier}", interface.guid));
        }
        Ok(ScenarioInstance {
            resources: resources.to_owned(),
            course: Lifecycle::default(),
            values: interface.start_values(),
            inputs: interface.start_inputs(),
            interface,
            stale: true,
            retired: None,
            parts: None,
            next: 0,
        })
    }

    /// Nodes with the parameters as they are now.
    pub(crate) fn assemble_nodes(&mut self) -> FmiResult<ScenarioGeneration> {
        let ScenarioInstance { resources, interface, values, course, .. } = self;
        let running = ScenarioExecution::assemble_scenario(resources, interface, values, course)
            .map_err(fatal_fmi_error)?;
        self.next += 1;
        Ok(ScenarioGeneration { number: self.next, running })
    }

    fn check_settable<T: FmiValue>(&self, reference: u32) -> FmiResult {
        let exposed = self.exposed_variable(reference)?;
        let state = self.course.state;
        let may = match exposed.role {
            ExposedVariableRole::Input(_)
            | ExposedVariableRole::SignalOverride
            | ExposedVariableRole::InputOverride => {
                matches!(
                    state,
                    LifecycleState::Instantiated
                        | LifecycleState::Initialization
                        | LifecycleState::StepComplete
                )
            }
            ExposedVariableRole::Parameter => {
                matches!(state, LifecycleState::Instantiated | LifecycleState::Initialization)
            }
            ExposedVariableRole::Output => false,
        };
        if exposed.start.kind() != T::KIND {
            return type_mismatch(exposed, T::KIND);
        }
        match may {
            true => Ok(()),
            false => reject(format!("{} cannot be set in the state {state:?}", exposed.name)),
        }
    }

    fn exposed_variable(&self, reference: u32) -> FmiResult<&ExposedVariable> {
        self.interface.variables.get(reference as usize).ok_or_else(|| FmiError {
            status: Status::Error,
            message: format!("no variable has the value reference {reference}"),
        })
    }
}

fn type_mismatch<T>(exposed: &ExposedVariable, expected: fmu_export::VariableKind) -> FmiResult<T> {
    reject(format!("{} is of type {:?}, not {expected:?}", exposed.name, exposed.start.kind()))
}

impl CoSimulation for ScenarioInstance {
    type State = SavedInstance;

    fn log_categories() -> LogCategories {
        &[(NODES, "Messages of the FMUs inside"), (SUMMARY, "What the FMUs inside are")]
    }

    fn instantiate(identifier: &str, resources: Option<&str>) -> FmiResult<Self> {
        match resources.and_then(resources_folder) {
            Some(folder) => Self::open_fmu(identifier, &folder),
            None => reject(format!("expected the place of the folder `resources`, found {resources:?}")),
        }
    }

    fn lifecycle(&mut self) -> &mut Lifecycle {
        &mut self.course
    }

    fn time_reference(&self) -> Option<u32> {
        u32::try_from(self.values.len()).ok()
    }

    fn reset(&mut self) -> FmiResult {
        let may_return = self.parts.as_mut().is_some_and(ScenarioGeneration::can_restore_state);
        let parts = self.parts.take().filter(|_| may_return);
        self.retired = parts.or(self.retired.take());
        (self.values, self.inputs) = (self.interface.start_values(), self.interface.start_inputs());
        self.stale = true;
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
        if self.course.state != LifecycleState::Initialization || !self.stale {
            return Ok(());
        }
        // Of some FMUs a process holds one instance only.
        self.parts = None;
        let mut parts = self.assemble_nodes()?;
        parts.running.initialise_nodes(&self.inputs).map_err(fatal_fmi_error)?;
        parts.running.read_outputs(&mut self.values);
        (self.parts, self.stale) = (Some(parts), false);
        Ok(())
    }

    fn do_step(&mut self, time: f64, step: f64) -> FmiResult {
        self.course.check_step(time, step)?;
        let inner = self.interface.step;
        let steps = (step / inner).round();
        if steps < 1.0 || (steps * inner - step).abs() > SAME * inner {
            return reject(format!(
                "expected a multiple of the communication step {inner} s of the scenario, found {step} s"
            ));
        }
        let Some(ScenarioGeneration { running, .. }) = &mut self.parts else {
            return reject("the scenario is not initialised");
        };
        let done = running.do_steps(&self.inputs, steps as u64);
        running.read_outputs(&mut self.values);
        let (message, status, state) = match done {
            Ok(()) => {
                self.course.now = time + step;
                return Ok(());
            }
            Err(EarlyEnd::Terminated(message)) => {
                self.course.terminated = true;
                (message, Status::Discard, LifecycleState::StepFailed)
            }
            Err(EarlyEnd::Failed(message)) => (message, Status::Error, LifecycleState::Error),
        };
        // The last communication point that all nodes reached.
        let Execution { system, tick, .. } = &running.execution;
        self.course.now = system.clock.time_at(tick.saturating_sub(1));
        self.course.state = state;
        Err(FmiError { status, message })
    }

    fn terminate(&mut self) -> FmiResult {
        self.parts.as_mut().map_or(Ok(()), |parts| parts.running.terminate().map_err(fatal_fmi_error))
    }

    fn get<T: FmiValue>(&mut self, reference: u32) -> FmiResult<T> {
        let value = self.values.get_mut(reference as usize).and_then(VariableValue::get_typed);
        match value {
            Some(value) => Ok(value),
            None => type_mismatch(self.exposed_variable(reference)?, T::KIND),
        }
    }

    fn set<T: FmiValue>(&mut self, references: &[u32], values: &[T]) -> FmiResult {
        references.iter().try_for_each(|reference| self.check_settable::<T>(*reference))?;
        for (reference, value) in references.iter().zip(values) {
            let place = *reference as usize;
            let role = &self.interface.variables[place].role;
            let is_returned = role.is_override() && value.numeric_value().is_some_and(f64::is_nan);
            if is_returned {
                self.inputs[place] = None;
            } else {
                self.values[place].set_typed(value);
                self.inputs[place] = role.is_input().then(|| self.values[place].to_f64()).flatten();
            }
            // A connected input that is set has its value from the first step on, as if its connection had a fault.
            self.stale |= *role != ExposedVariableRole::InputOverride;
        }
        Ok(())
    }

    fn set_input_derivatives(&mut self, _: &[u32], _: &[i32], _: &[f64]) -> FmiResult {
        reject("derivatives of inputs are not supported")
    }

    fn directional_derivative(&mut self, _: &[u32], _: &[u32], _: &[f64]) -> FmiResult<Vec<f64>> {
        reject("a directional derivative is not supported")
    }

    fn save(&mut self) -> FmiResult<SavedInstance> {
        self.save_state()
    }

    fn restore(&mut self, state: &SavedInstance) -> FmiResult {
        self.restore_state(state)
    }

    fn serialize(&mut self, state: &SavedInstance) -> FmiResult<Vec<u8>> {
        self.state_to_bytes(state)
    }

    fn deserialize(&mut self, bytes: &[u8]) -> FmiResult<SavedInstance> {
        self.state_from_bytes(bytes)
    }
}
