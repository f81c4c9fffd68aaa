//! Describes a model as a whole: name, step sizes, default experiment and log categories.

use crate::terminal::Terminal;

/// Name, step sizes, default experiment and log categories of a model: [`Info::new`], and methods for all
/// that differs from its defaults.
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
    /// Start time of the default experiment [s].
    pub start: f64,
    /// Stop time of the default experiment [s].
    pub stop: Option<f64>,
    /// Relative tolerance of the integrator, for a model that has one.
    pub tolerance: Option<f64>,
    /// Version of the model.
    pub version: &'static str,
    /// Author of the model.
    pub author: Option<&'static str>,
    /// The model's own log categories, each with a description; see [`log()`](crate::log()).
    pub log_categories: &'static [(&'static str, &'static str)],
    /// Variables that other tools connect at once.
    pub terminals: &'static [Terminal],
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
            terminals: &[],
        }
    }

    /// Sets the largest time over which an interpolated input is held [s]; a preferred step without it.
    #[must_use]
    pub const fn substep(self, substep: f64) -> Self {
        Info { substep, ..self }
    }

    /// Sets the start time of the default experiment [s]; 0 without it.
    #[must_use]
    pub const fn start(self, start: f64) -> Self {
        Info { start, ..self }
    }

    /// Sets the stop time of the default experiment [s].
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

    /// Names the author of the model.
    #[must_use]
    pub const fn author(self, author: &'static str) -> Self {
        Info { author: Some(author), ..self }
    }

    /// Adds log categories, each with a description.
    #[must_use]
    pub const fn log_categories(self, categories: &'static [(&'static str, &'static str)]) -> Self {
        Info { log_categories: categories, ..self }
    }

    /// Adds terminals.
    #[must_use]
    pub const fn terminals(self, terminals: &'static [Terminal]) -> Self {
        Info { terminals, ..self }
    }
}
