//! Reuse of FMU instances between variants, after a test that reset instances give the same results as new ones.

use cosim::node::ReusableInstances;
use scenario::resolve::Overrides;

use super::variant::{RowFingerprint, VariantOutcome, VariantRunner};

/// Whether a worker reuses FMU instances, by its test so far.
pub(super) enum InstanceReuse {
    /// No variant has run yet.
    Untested,
    /// One variant has run, and its instances are kept.
    FirstRun(ReusableInstances),
    /// A variant on instances that were reset gave the rows of one on new instances, bit for bit.
    Verified(ReusableInstances),
    /// Reset instances did not give the same results; each variant gets new ones.
    Rejected,
}

impl InstanceReuse {
    /// Runs a variant, on new instances until it is proven that others do as well. The proof is the second variant of a process, which
    /// runs twice: on the instances that the first one used, with other values, and on new ones.
    pub fn run_variant(&mut self, runner: &mut VariantRunner, overrides: &Overrides) -> VariantOutcome {
        match std::mem::replace(self, InstanceReuse::Rejected) {
            InstanceReuse::Untested => {
                let mut instances = ReusableInstances::default();
                let outcome = runner.run_variant(overrides, &mut instances, None);
                // A failed run does not test a reset.
                *self = match outcome.failure {
                    None => InstanceReuse::FirstRun(instances),
                    Some(_) => InstanceReuse::Untested,
                };
                outcome
            }
            InstanceReuse::FirstRun(mut instances) => {
                let mut of_reset = RowFingerprint::default();
                let reset = runner.run_variant(overrides, &mut instances, Some(&mut of_reset));
                let mut of_new = RowFingerprint::default();
                let new = runner.run_variant(overrides, &mut ReusableInstances::default(), Some(&mut of_new));
                let same = reset.failure.is_none() && new.failure.is_none() && of_reset == of_new;
                if same && instances.reuse_refusal().is_none() {
                    *self = InstanceReuse::Verified(instances);
                }
                new
            }
            InstanceReuse::Verified(mut instances) => {
                let outcome = runner.run_variant(overrides, &mut instances, None);
                let failed = outcome.failure.is_some();
                *self = InstanceReuse::Verified(instances);
                // A failure counts when it is one on new instances.
                if failed {
                    runner.run_variant(overrides, &mut ReusableInstances::default(), None)
                } else {
                    outcome
                }
            }
            InstanceReuse::Rejected => runner.run_variant(overrides, &mut ReusableInstances::default(), None),
        }
    }
}
