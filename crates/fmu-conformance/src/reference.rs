//! Runs the experiments that an archive brings along (FMI-LS-REF) and compares.

use fmu_import::Fmu;

use super::Rank::BreaksStandard;
use super::test_driver::TestDriver;
use super::{BOTH, Check, Rule, Verdict, not_applicable};

pub(super) const RULES: &[Rule] = &[Rule {
    name: "references",
    rank: BreaksStandard,
    sentence: "the reference results in the archive are reproduced",
    versions: BOTH,
    check: Check::References(judge),
}];

pub(super) fn count(fmu: &Fmu) -> usize {
    0
}

fn judge(driver: &TestDriver, which: usize) -> Verdict {
    not_applicable("no")
}
