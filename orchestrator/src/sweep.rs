//! Runs many variants of a scenario: a plan folder says which ones, worker processes run them, and a table has what came of them.

mod assignment;
mod chunk;
mod comparison;
mod crew;
mod digest;
mod gather;
mod look;
mod make;
mod page;
mod plan;
mod rows;
mod search;
mod settings;
mod submit;
mod trial;
mod variant;
mod worker;

pub use chunk::{Ended, run_chunks};
pub use comparison::differences;
pub use crew::Tally;
pub use gather::{Gathered, gather};
pub use look::Shown;
pub use make::{PlanOptions, make};
pub use plan::{About, Plan};
pub use search::{Found, search};
pub use settings::Setting;
pub use submit::{EngineKind, Followed, SubmitOptions, Watched, submit};
pub use worker::serve;
