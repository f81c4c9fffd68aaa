//! Infers tire curves: points of slip and friction coefficient go in; parameters of the Magic Formula, their posterior and a verdict
//! for each quantity come out, with reasons in words.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

pub mod axle_coupling;
pub mod axles;
pub mod bound_extension;
pub mod bounds;
pub mod compressed;
pub mod curve_profile;
pub mod density;
pub mod dependence;
pub mod drift;
pub mod estimate;
pub mod fit;
pub mod kernel;
pub mod linearised_slip_noise;
pub mod load;
pub mod local;
pub mod minimise;
pub mod model;
pub mod noise;
pub mod parameters;
pub mod plausibility;
pub mod posterior;
pub mod prior;
pub mod profile;
pub mod quantity;
pub mod regularisation;
pub mod settings;
pub mod synthetic;
pub mod variational;
pub mod verdict;
pub mod window;
