//! Repeats the studies of Goblirsch et al., "Bayesian Optimization-based Tire Parameter and Uncertainty Estimation for
//! Real-World Data", IV 2025: what an identification can tell when the truth is known.

pub mod excitation;
pub mod sensitivity;
