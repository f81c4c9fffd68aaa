//! Reuse of FMU instances between variants, after a test that reset instances give the same results as new ones.

use cosim::node::Kept;
use scenario::resolve::Overrides;

use super::variant::{Fingerprint, Outcome, VariantRunner};

/// Whether instances are used again.
pub(super) enum InstanceReuse {
    /// No variant has run yet.
    Untested,
    /// One has, and its instances are kept.
    FirstRun(Kept),
    /// A variant on instances that were reset gave the rows of one on new instances, bit for bit.
    Verified(Kept),
    /// They are not.
    Rejected,
}

impl InstanceReuse {
    /// Runs a variant, on new instances until it is proven that others do as well. The proof is the second variant of a process, which
    /// runs twice: on the instances that the first one used, with other values, and on new ones.
    pub fn run(&mut self, runner: &mut VariantRunner, overrides: &Overrides) -> Outcome {
        match std::mem::replace(self, InstanceReuse::Rejected) {
            InstanceReuse::Untested => {
                let mut kept = Kept::default();
                let outcome = runner.run(overrides, &mut kept, None);
                // What went wrong once is no sign of what a reset does.
                *self = match outcome.failure {
                    None => InstanceReuse::FirstRun(kept),
                    Some(_) => InstanceReuse::Untested,
                };
                outcome
            }
            InstanceReuse::FirstRun(mut kept) => {
                let (mut again, mut new) = (Fingerprint::default(), Fingerprint::default());
                let one = runner.run(overrides, &mut kept, Some(&mut again));
                let mut fresh = Kept::default();
                let other = runner.run(overrides, &mut fresh, Some(&mut new));
                let same = one.failure.is_none() && other.failure.is_none() && again == new;
                if same && kept.refused().is_none() {
                    *self = InstanceReuse::Verified(kept);
                }
                other
            }
            InstanceReuse::Verified(mut kept) => {
                let outcome = runner.run(overrides, &mut kept, None);
                let failed = outcome.failure.is_some();
                *self = InstanceReuse::Verified(kept);
                // A failure counts when it is one on new instances.
                if failed { runner.run(overrides, &mut Kept::default(), None) } else { outcome }
            }
            InstanceReuse::Rejected => runner.run(overrides, &mut Kept::default(), None),
        }
    }
}
