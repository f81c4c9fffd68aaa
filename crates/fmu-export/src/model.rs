//! Defines a model: the trait behind an FMU, and the failures of its calls.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::derivative::EquationDerivatives;
use crate::info::Info;
use crate::variable::Variable;

/// Failure of a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The step was not done and the state is as before; a shorter step might succeed.
    #[error("{0}")]
    Discard(String),
    /// The model ends the simulation here, as planned.
    #[error("{0}")]
    Terminated(String),
    /// The instance is lost until it is reset, or an older state is restored.
    #[error("{0}")]
    Error(String),
}

/// A model that can be initialised, stepped and read.
///
/// # Contract
///
/// - **State.** `Default` gives the start values, all of them. `Clone` is the FMU state and
///   `Serialize`/`Deserialize` are its bytes: a restored model continues bit for bit. The struct therefore
///   holds everything that it computes with; files, random generators and caches outside of it break this.
/// - **Threads.** An importer may create, call and free an instance on different threads, one call at a
///   time: `Send` is required, thread-local state does not work. Several instances run side by side, so a
///   model has no global state.
/// - **Failures.** A call that returns an error leaves the model as it was before the call; the library
///   restores it after [`Model::step`]. A panic ends the instance: the call returns `fmi2Fatal`, with the
///   message of the panic in the log. This needs `panic = "unwind"`, the default.
/// - **Messages.** [`log()`](crate::log()) and [`warn()`](crate::warn()) collect messages. The importer gets them when the
///   call ends and nothing refers to the instance any more: its logger may call the FMU again.
/// - **Variables.** [`Model::VARIABLES`] is complete and constant. An accessor returns the same member each
///   time and does nothing else.
///
/// ```compile_fail,E0277
/// use fmu_export::{Info, Model, ModelError, Variable};
///
/// // A reference counter of one thread: not `Send`.
/// #[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
/// struct Shared { #[serde(skip)] table: std::rc::Rc<Vec<f64>> }
///
/// impl Model for Shared {
///     const INFO: Info = Info::new("shared", "Shares a table", 0.01);
///     const VARIABLES: &'static [Variable<Self>] = &[];
///     fn step(&mut self, _: f64, _: f64) -> Result<(), ModelError> { Ok(()) }
/// }
/// ```
pub trait Model: Default + Clone + Send + Serialize + DeserializeOwned + 'static {
    /// Name, description and preferred step.
    const INFO: Info;
    /// The table of variables. The row number is the value reference.
    const VARIABLES: &'static [Variable<Self>];
    /// The derivatives of the output equations, for a model with
    /// [`Equations`](crate::Equations).
    const DERIVATIVES: Option<EquationDerivatives<Self>> = None;

    /// Computes the initial state from parameters and start values. It may be called repeatedly and
    /// depends on nothing that an earlier call computed.
    ///
    /// # Errors
    /// When the parameters do not describe a model that can run.
    fn initialise(&mut self) -> Result<(), ModelError> {
        Ok(())
    }

    /// Looks at parameters and start values once, when the initialisation ends: the place to [`warn()`](crate::warn()) of values that are
    /// legal and odd. [`real_values`](crate::real_values) lists them.
    fn review_parameters(&mut self) {}

    /// Advances the state from `time` to `time + step` [s] with the inputs held.
    ///
    /// # Errors
    /// When the step cannot be done; the kind of [`ModelError`] decides how the simulation goes on.
    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError>;

    /// Computes the outputs from state and inputs. It is called after initialisation, after each
    /// step, and when an output is read after an input was written.
    fn compute_outputs(&mut self) {}
}
