//! Finds out whether instances of FMUs that were reset give the same results as new ones.

use cosim::node::ReusableInstances;
use scenario::resolve::Overrides;

use super::variant::{Bench, Fingerprint, Outcome};

/// Whether instances are used again.
pub(super) enum Reuse {
    /// No variant has run yet.
    Unknown,
    /// One has, and its instances are kept.
    Tried(ReusableInstances),
    /// A variant on instances that were reset gave the rows of one on new instances, bit for bit.
    Proven(ReusableInstances),
    /// They are not.
    Refused,
}

impl Reuse {
    /// Runs a variant, on new instances until it is proven that others do as well. The proof is the second variant of a process, which
    /// runs twice: on the instances that the first one used, with other values, and on new ones.
    pub fn run(&mut self, bench: &mut Bench, overrides: &Overrides) -> Outcome {
        match std::mem::replace(self, Reuse::Refused) {
            Reuse::Unknown => {
                let mut kept = ReusableInstances::default();
                let outcome = bench.run(overrides, &mut kept, None);
                // What went wrong once is no sign of what a reset does.
                *self = match outcome.failure {
                    None => Reuse::Tried(kept),
                    Some(_) => Reuse::Unknown,
                };
                outcome
            }
            Reuse::Tried(mut kept) => {
                let (mut again, mut new) = (Fingerprint::default(), Fingerprint::default());
                let one = bench.run(overrides, &mut kept, Some(&mut again));
                let mut fresh = ReusableInstances::default();
                let other = bench.run(overrides, &mut fresh, Some(&mut new));
                let same = one.failure.is_none() && other.failure.is_none() && again == new;
                if same && kept.refused().is_none() {
                    *self = Reuse::Proven(kept);
                }
                other
            }
            Reuse::Proven(mut kept) => {
                let outcome = bench.run(overrides, &mut kept, None);
                let failed = outcome.failure.is_some();
                *self = Reuse::Proven(kept);
                // A failure counts when it is one on new instances.
                if failed {
                    bench.run(overrides, &mut ReusableInstances::default(), None)
                } else {
                    outcome
                }
            }
            Reuse::Refused => bench.run(overrides, &mut ReusableInstances::default(), None),
        }
    }
}
