//! Runs one instance of a model under the rules of FMI 2.0, without pointers.

mod direction;
mod slope;

use serde::{Deserialize, Serialize};

use crate::abi::Status;
use crate::array::group_rows_into_variables;
use crate::co_simulation::{CoSimulation, LogCategories};
use crate::description::model_guid;
use crate::error::{FmiError, FmiResult, reject};
use crate::lifecycle::{Lifecycle, LifecycleState};
use crate::model::{Model, ModelError};
use crate::value::FmiValue;
use crate::variable::{Causality, Initial, Variability, Variable, VariableAccess, VariableKind, VariableRow};
use slope::InputDerivative;

/// Steps that differ by less than this share are the same step: masters that compute it as the
/// difference of two times are off by rounding, and a car at its limit would turn that into another lap.
const STEP_TOLERANCE: f64 = 1e-9;

/// Everything that an FMU state restores.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct InstanceSnapshot<M: Model> {
    model: M,
    lifecycle: Lifecycle,
    /// Inputs or parameters were written after the outputs were computed.
    stale: bool,
    /// The size of the last step, or the model's preferred one [s].
    step: f64,
    slopes: Vec<InputDerivative>,
}

impl<M: Model> InstanceSnapshot<M> {
    /// The variable that shows the time.
    const TIME: Option<&'static Variable<M>> = {
        let (rows, mut i) = (M::VARIABLES, 0);
        while i < rows.len() && !matches!(rows[i].row.causality, Causality::Independent) {
            i += 1;
        }
        if i < rows.len() { Some(&rows[i]) } else { None }
    };

    /// Rejects a state that no instance can have been in: bytes may come from anywhere.
    pub fn check_consistency(&self) -> FmiResult {
        self.slopes.iter().try_for_each(InputDerivative::check_supported::<M>)
    }

    fn compute_outputs(&mut self) {
        if let Some(Variable { access: VariableAccess::Real(at), .. }) = Self::TIME {
            *at(&mut self.model) = self.lifecycle.now;
        }
        self.model.compute_outputs();
        self.stale = false;
    }
}

/// An instance: the model with its state of the FMI state machine.
pub struct Instance<M: Model> {
    current: InstanceSnapshot<M>,
    /// For each row of a table with arrays, the elements of the variable that begins there.
    elements: Vec<usize>,
}

impl<M: Model> Instance<M> {
    fn new() -> Self {
        let current = InstanceSnapshot {
            model: M::default(),
            lifecycle: Lifecycle::default(),
            stale: true,
            step: M::INFO.step,
            slopes: Vec::new(),
        };
        let mut elements = Vec::new();
        if Self::HAS_ARRAYS {
            elements = vec![0; M::VARIABLES.len()];
            let rows = M::VARIABLES.iter().map(|it| (&it.row, it.access.kind()));
            group_rows_into_variables(rows).iter().for_each(|span| elements[span.first] = span.elements);
        }
        Instance { current, elements }
    }

    fn check_set<T: FmiValue>(&self, variable: &Variable<M>, value: &T) -> FmiResult {
        let (Variable { row, access }, state) = (variable, self.current.lifecycle.state);
        if access.kind() != T::KIND {
            return reject_wrong_type(variable, T::KIND);
        }
        if !is_writable(row, state) {
            return reject(format!(
                "{} is {:?} {:?} and cannot be set in the state {state:?}",
                row.name, row.variability, row.causality
            ));
        }
        // Inputs come from other models, whose transients may leave the limits.
        if row.causality == Causality::Parameter
            && let Some(number) = value.numeric_value()
        {
            let (min, max) = (row.min.unwrap_or(f64::NEG_INFINITY), row.max.unwrap_or(f64::INFINITY));
            if !(min..=max).contains(&number) {
                return reject(format!("{} = {number} is outside of {min} .. {max}", row.name));
            }
        }
        Ok(())
    }
}

impl<M: Model> CoSimulation for Instance<M> {
    type State = InstanceSnapshot<M>;

    const HAS_ARRAYS: bool = {
        let (rows, mut i) = (M::VARIABLES, 0);
        while i < rows.len() && !matches!(rows[i].row.name.as_bytes(), [.., b'[', b'2', b']']) {
            i += 1;
        }
        i < rows.len()
    };

    fn element_count(&self, reference: u32) -> usize {
        // Nothing has a reference beyond the table, which is told when it is read.
        self.elements.get(reference as usize).copied().unwrap_or(1)
    }

    fn log_categories() -> LogCategories {
        M::INFO.log_categories
    }

    fn instantiate(identifier: &str, _resources: Option<&str>) -> FmiResult<Self> {
        let expected = model_guid::<M>();
        match identifier == expected {
            true => Ok(Self::new()),
            false => reject(format!("expected GUID {expected}, found {identifier}")),
        }
    }

    fn lifecycle(&mut self) -> &mut Lifecycle {
        &mut self.current.lifecycle
    }

    fn time_reference(&self) -> Option<u32> {
        InstanceSnapshot::<M>::TIME.is_none().then_some(M::VARIABLES.len() as u32)
    }

    fn reset(&mut self) -> FmiResult {
        self.current = Self::new().current;
        Ok(())
    }

    fn enter_initialization(&mut self) -> FmiResult {
        self.current.stale = true;
        Ok(())
    }

    fn exit_initialization(&mut self) -> FmiResult {
        self.refresh_outputs()?;
        self.current.model.review_parameters();
        Ok(())
    }

    fn refresh_outputs(&mut self) -> FmiResult {
        let InstanceSnapshot { model, lifecycle, stale, .. } = &mut self.current;
        if *stale && matches!(lifecycle.state, LifecycleState::Initialization | LifecycleState::StepComplete)
        {
            if lifecycle.state == LifecycleState::Initialization {
                model.initialise().map_err(|error| FmiError {
                    status: Status::Error,
                    message: format!("initialisation failed: {error}"),
                })?;
            }
            self.current.compute_outputs();
        }
        Ok(())
    }

    fn do_step(&mut self, time: f64, step: f64) -> FmiResult {
        let current = &mut self.current;
        current.lifecycle.check_step(time, step)?;
        if (step - current.step).abs() > STEP_TOLERANCE * step {
            current.step = step;
        }
        let step = current.step;
        let before = current.model.clone();
        let (state, status, message) = match current.advance(time, step) {
            Ok(()) => {
                // They refer to the beginning of this step (FMI 2.0, section 4.2.2).
                current.slopes.clear();
                current.lifecycle.now = time + step;
                current.compute_outputs();
                return Ok(());
            }
            Err(ModelError::Error(message)) => (LifecycleState::Error, Status::Error, message),
            Err(ModelError::Discard(message)) => (LifecycleState::StepFailed, Status::Discard, message),
            Err(ModelError::Terminated(message)) => {
                current.lifecycle.terminated = true;
                (LifecycleState::StepFailed, Status::Discard, message)
            }
        };
        current.model = before;
        current.lifecycle.state = state;
        Err(FmiError { status, message: format!("step of {step} s from {time} s: {message}") })
    }

    fn terminate(&mut self) -> FmiResult {
        Ok(())
    }

    fn get<T: FmiValue>(&mut self, reference: u32) -> FmiResult<T> {
        let variable = find_variable::<M>(reference)?;
        match T::read_from_model(&variable.access, &mut self.current.model) {
            Some(value) => Ok(value),
            None => reject_wrong_type(variable, T::KIND),
        }
    }

    fn set<T: FmiValue>(&mut self, references: &[u32], values: &[T]) -> FmiResult {
        for (reference, value) in references.iter().zip(values) {
            self.check_set(find_variable::<M>(*reference)?, value)?;
        }
        for (reference, value) in references.iter().zip(values) {
            value.write_to_model(&find_variable::<M>(*reference)?.access, &mut self.current.model);
            self.current.stale = true;
            self.current.slopes.retain(|slope| slope.reference != *reference);
        }
        Ok(())
    }

    fn set_input_derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> FmiResult {
        self.store_input_derivatives(references, orders, values)
    }

    fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        changes: &[f64],
    ) -> FmiResult<Vec<f64>> {
        self.compute_directional_derivative(unknowns, knowns, changes)
    }

    fn save(&mut self) -> FmiResult<InstanceSnapshot<M>> {
        Ok(self.current.clone())
    }

    fn restore(&mut self, state: &InstanceSnapshot<M>) -> FmiResult {
        self.current = state.clone();
        Ok(())
    }

    fn serialize(&mut self, state: &InstanceSnapshot<M>) -> FmiResult<Vec<u8>> {
        postcard::to_stdvec(&(model_guid::<M>(), state)).or_else(|cause| reject(cause.to_string()))
    }

    fn deserialize(&mut self, bytes: &[u8]) -> FmiResult<InstanceSnapshot<M>> {
        let expected = model_guid::<M>();
        match postcard::from_bytes::<(String, InstanceSnapshot<M>)>(bytes) {
            Ok((found, snapshot)) if found == expected => snapshot.check_consistency().map(|()| snapshot),
            Ok((found, _)) => reject(format!("expected a state of {expected}, found one of {found}")),
            Err(cause) => reject(format!("these bytes are no FMU state: {cause}")),
        }
    }
}

fn find_variable<M: Model>(reference: u32) -> FmiResult<&'static Variable<M>> {
    M::VARIABLES.get(reference as usize).ok_or_else(|| FmiError {
        status: Status::Error,
        message: format!("no variable has the value reference {reference}"),
    })
}

/// The accessor of a real variable.
fn real_accessor<M: Model>(reference: u32) -> Option<fn(&mut M) -> &mut f64> {
    match M::VARIABLES.get(reference as usize)?.access {
        VariableAccess::Real(at) => Some(at),
        _ => None,
    }
}

fn reject_wrong_type<M, T>(Variable { row, access }: &Variable<M>, expected: VariableKind) -> FmiResult<T> {
    reject(format!("{} is of type {:?}, not {expected:?}", row.name, access.kind()))
}

/// Whether a variable may be written in a state: the notes below table 4.2.4 of FMI 2.0.
fn is_writable(row: &VariableRow, state: LifecycleState) -> bool {
    let input = row.causality == Causality::Input;
    let constant = row.variability == Variability::Constant;
    match state {
        LifecycleState::Instantiated => row.has_start() && !constant,
        LifecycleState::Initialization => input || row.initial == Some(Initial::Exact) && !constant,
        LifecycleState::StepComplete => input || is_tunable(row),
        _ => false,
    }
}

fn is_tunable(row: &VariableRow) -> bool {
    row.causality == Causality::Parameter && row.variability == Variability::Tunable
}
