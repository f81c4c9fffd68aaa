//! Says what a model is called, how it likes to be stepped, and what it logs.

/// What a model is called, how it likes to be stepped, and what it logs: [`Info::new`] and what is to
/// be said beyond that.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Info {
    /// Name of the model, of its archive and of the library in it; a C identifier.
    pub name: &'static str,
    /// One line about the model.
    pub description: &'static str,
    /// Preferred communication step size [s].
    pub step: f64,
    /// Largest time over which an interpolated input is held [s].
    pub substep: f64,
    /// Where an experiment starts unless the user says otherwise [s].
    pub start: f64,
    /// Where an experiment ends unless the user says otherwise [s].
    pub stop: Option<f64>,
    /// Relative tolerance of the integrator, for a model that has one.
    pub tolerance: Option<f64>,
    /// Version of the model.
    pub version: &'static str,
    /// Who made the model.
    pub author: Option<&'static str>,
    /// Log categories of the model's own with what they carry; see [`crate::log`].
    pub log_categories: &'static [(&'static str, &'static str)],
}

impl Info {
    /// A model with a preferred communication step size [s].
    #[must_use]
    pub const fn new(name: &'static str, description: &'static str, step: f64) -> Self {
        Info {
            name,
            description,
            step,
            substep: step,
            start: 0.0,
            stop: None,
            tolerance: None,
            version: env!("CARGO_PKG_VERSION"),
            author: None,
            log_categories: &[],
        }
    }

    /// Holds an interpolated input no longer than this [s], instead of for a preferred step.
    #[must_use]
    pub const fn substep(self, substep: f64) -> Self {
        Info { substep, ..self }
    }

    /// Starts the default experiment here [s] instead of at 0.
    #[must_use]
    pub const fn start(self, start: f64) -> Self {
        Info { start, ..self }
    }

    /// Ends the default experiment here [s].
    #[must_use]
    pub const fn stop(self, stop: f64) -> Self {
        Info { stop: Some(stop), ..self }
    }

    /// Recommends a relative tolerance.
    #[must_use]
    pub const fn tolerance(self, tolerance: f64) -> Self {
        Info { tolerance: Some(tolerance), ..self }
    }

    /// Gives the version of the model, such as `env!("CARGO_PKG_VERSION")`.
    #[must_use]
    pub const fn version(self, version: &'static str) -> Self {
        Info { version, ..self }
    }

    /// Says who made the model.
    #[must_use]
    pub const fn author(self, author: &'static str) -> Self {
        Info { author: Some(author), ..self }
    }

    /// Adds log categories, each with what it carries.
    #[must_use]
    pub const fn log_categories(self, categories: &'static [(&'static str, &'static str)]) -> Self {
        Info { log_categories: categories, ..self }
    }
}
