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
mod scenario_values;
mod search;
mod submit;
mod variant;
mod worker;
mod worker_process;

pub use chunk::{ChunksOutcome, run_chunks};
pub use comparison::differences_from_sweep_result;
pub use create::{PlanOptions, create_sweep_plan};
pub use gather::{SweepResult, gather_sweep_results};
pub use notable::NotableVariant;
pub use page::renew_sweep_page;
pub use plan::SweepPlanFolder;
pub use plan_metadata::PlanMetadata;
pub use search::{SearchResult, search_in_batches};
pub use submit::{ChunkProgress, EngineKind, FollowOutcome, SubmitOptions, submit_and_follow};
pub use worker::serve_sweep_worker;
pub use worker_process::VariantCounts;
