//! Defines the trait that the exported C functions drive: an instance of a model, or of anything else that can be stepped.

use crate::error::FmiResult;
use crate::lifecycle::Lifecycle;
use crate::value::FmiValue;

/// Log categories, each with a description.
pub type LogCategories = &'static [(&'static str, &'static str)];

/// An instance as the C functions of FMI 2.0 and 3.0 drive it. They check pointers, catch panics and refuse calls that the
/// [`Lifecycle`] does not allow; everything else is its own. [`Model`](crate::Model) is the simple way to one.
///
/// # Threads
/// An importer may use an instance on different threads, one call at a time.
pub trait CoSimulation: Sized + Send + 'static {
    /// What `fmi2GetFMUstate` copies.
    type State: 'static;

    /// Its own log categories.
    fn log_categories() -> LogCategories {
        &[]
    }

    /// Makes an instance. `identifier` is the GUID or the token of the description, `resources` the place of the folder, as a URI
    /// in FMI 2.0 and as a path in FMI 3.0.
    ///
    /// # Errors
    /// When the description is not that of this library.
    fn instantiate(identifier: &str, resources: Option<&str>) -> FmiResult<Self>;

    /// Whether FMI 3.0 sees arrays: [`element_count`](Self::element_count) is not always 1.
    const HAS_ARRAYS: bool = false;

    /// The number of elements of the array that begins at a value reference: 1 for a scalar, 0 for another element of an array, which
    /// FMI 3.0 does not see.
    fn element_count(&self, _reference: u32) -> usize {
        1
    }

    /// Where the instance stands.
    fn lifecycle(&mut self) -> &mut Lifecycle;

    /// The value reference of the time that only the description of FMI 3.0 has, which needs one; none when a variable is the time.
    fn time_reference(&self) -> Option<u32>;

    /// Goes back to the state after [`instantiate`](Self::instantiate).
    ///
    /// # Errors
    /// When that is not possible any more.
    fn reset(&mut self) -> FmiResult;

    /// Begins the initialisation; the experiment is that of the course.
    ///
    /// # Errors
    /// When it cannot.
    fn enter_initialization(&mut self) -> FmiResult;

    /// Ends the initialisation.
    ///
    /// # Errors
    /// When the start values describe nothing that can run.
    fn exit_initialization(&mut self) -> FmiResult;

    /// Computes what is read next, after inputs or parameters were written.
    ///
    /// # Errors
    /// When they describe nothing that can run.
    fn refresh_outputs(&mut self) -> FmiResult;

    /// Goes from `time` to `time + step` [s].
    ///
    /// # Errors
    /// When it does not come to the end of the step.
    fn do_step(&mut self, time: f64, step: f64) -> FmiResult;

    /// Ends the simulation.
    ///
    /// # Errors
    /// When a part of it refuses to end.
    fn terminate(&mut self) -> FmiResult;

    /// Reads a variable; [`refresh_outputs`](Self::refresh_outputs) comes first.
    ///
    /// # Errors
    /// When there is none of this type.
    fn get<T: FmiValue>(&mut self, reference: u32) -> FmiResult<T>;

    /// Writes variables: all of them, or none when one cannot be written.
    ///
    /// # Errors
    /// When one cannot be written.
    fn set<T: FmiValue>(&mut self, references: &[u32], values: &[T]) -> FmiResult;

    /// Takes derivatives of inputs [1/s, 1/s2, ...] for the next step: all of them, or none.
    ///
    /// # Errors
    /// When one cannot be taken.
    fn set_input_derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> FmiResult;

    /// How `unknowns` change when `knowns` change by `changes`.
    ///
    /// # Errors
    /// When that is not known.
    fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        changes: &[f64],
    ) -> FmiResult<Vec<f64>>;

    /// Copies the state.
    ///
    /// # Errors
    /// When a part of it cannot be copied.
    fn save(&mut self) -> FmiResult<Self::State>;

    /// Goes back to a state.
    ///
    /// # Errors
    /// When a part of it cannot go back.
    fn restore(&mut self, state: &Self::State) -> FmiResult;

    /// A state as bytes, which say whose they are.
    ///
    /// # Errors
    /// When a part of it cannot be written so.
    fn serialize(&mut self, state: &Self::State) -> FmiResult<Vec<u8>>;

    /// The state that bytes describe.
    ///
    /// # Errors
    /// When they are those of something else.
    fn deserialize(&mut self, bytes: &[u8]) -> FmiResult<Self::State>;
}
