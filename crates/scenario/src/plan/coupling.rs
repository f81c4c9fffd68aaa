//! The properties of coupling algorithms that connections depend on.

use crate::words::{Algorithm, At};

/// The properties of a coupling algorithm that are known before a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CouplingRules {
    /// The name in messages.
    pub name: &'static str,
    /// The end of the step at which an input takes the output of an FMU unless the connection sets `at`.
    pub default_at: At,
    /// Whether a connection may set `at = "end"`.
    pub allows_end: bool,
}

impl Algorithm {
    /// The rules of the algorithm.
    #[must_use]
    pub fn rules(self) -> CouplingRules {
        match self {
            Algorithm::GaussSeidel => {
                CouplingRules { name: "Gauss-Seidel", default_at: At::End, allows_end: true }
            }
            Algorithm::Jacobi => {
                CouplingRules { name: "Jacobi", default_at: At::Start, allows_end: false }
            }
        }
    }
}
