//! Parameter sweeps: a plan folder lists the variants of a scenario, worker processes run them, and a table collects their results.

mod assignment;
mod chunk;
mod comparison;
mod create;
mod digest;
mod file_names;
mod gather;
mod instance_reuse;
mod notable;
mod page;
mod plan;
mod plan_metadata;
mod result_rows;
mod search;
mod submit;
mod variant;
mod worker;
mod worker_process;

pub use chunk::{ChunksOutcome, run_chunks};
pub use comparison::differences;
pub use create::{PlanOptions, create};
pub use gather::{SweepResult, gather};
pub use notable::NotableVariant;
pub use plan::Plan;
pub use plan_metadata::PlanMetadata;
pub use search::{SearchResult, search};
pub use submit::{ChunkProgress, EngineKind, FollowOutcome, SubmitOptions, submit};
pub use worker::serve;
pub use worker_process::VariantCounts;
