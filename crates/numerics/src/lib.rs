//! Numerical methods that know nothing of tires: a function, its derivatives and a box go in; a minimum, a distribution or
//! weighted draws come out. Sequential quadratic programming, the simplex of Nelder and Mead, quadrature, low-discrepancy points,
//! importance sampling with Pareto-smoothed weights, variational fits of normal distributions, and numbers that carry derivatives
//! or stand side by side in the vectors of the processor.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

pub mod convergence;
pub mod golden_section;
pub mod identifiability;
pub mod importance;
pub mod levenberg_marquardt;
pub mod loss;
pub mod low_discrepancy;
pub mod normal;
pub mod psis;
pub mod quadrature;
pub mod resampling;
pub mod simd_batch;
pub mod simplex;
pub mod sobol;
pub mod sqp;
pub mod statistics;
pub mod student;
pub mod tangent;
pub mod text;
pub mod variational;

pub use elementary::scalar;
