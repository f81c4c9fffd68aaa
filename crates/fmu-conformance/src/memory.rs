//! Measures memory leaks over many cycles of instances.

use std::time::Instant;

use super::RuleSeverity::BreaksStandard;
use super::test_driver::{FAR, TestDriver};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, not_applicable, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[ConformanceRule {
    name: "memory",
    rank: BreaksStandard,
    sentence: "instances leave no memory behind",
    versions: BOTH,
    check: RuleCheck::Runs(check_memory_leak),
}];

/// How many instances are made and freed.
const CYCLES: u32 = 10_000;
/// How many of them come before the first measurement: allocators and libraries keep what they take at first.
const WARM_UP: u32 = 1_000;
/// What may be left for each instance [bytes]: less than the smallest block that `malloc` gives on a
/// 64-bit system, which is 32 bytes, and more than the noise of whole pages over all cycles.
const BOUND: f64 = 26.0;
/// The size of a page on the platforms that FMI has names for [bytes].
const PAGE: f64 = 4096.0;

fn check_memory_leak(driver: &TestDriver) -> RuleResult {
    let end = Instant::now() + driver.limit.mul_f64(0.8);
    let warm = run_instance_cycles(driver, WARM_UP, end)?;
    let before = resident_memory()?;
    // A slow FMU gets fewer cycles rather than no verdict.
    let count = run_instance_cycles(driver, CYCLES, end)?;
    if count < WARM_UP {
        return not_applicable(format!(
            "{} instances within the time limit are too few to tell",
            warm + count
        ));
    }
    let growth = (resident_memory()? - before) / f64::from(count);
    let measured = format!("{growth:.1} bytes per instance over {count} instances");
    if growth > BOUND { violated_rule(measured) } else { Ok(measured) }
}

/// Makes and frees so many instances, or fewer when the time is up, and says how many; each lives through a whole, short
/// simulation.
fn run_instance_cycles(driver: &TestDriver, count: u32, end: Instant) -> Result<u32, RuleError> {
    driver.note_progress(&format!("{count} short simulations"));
    for done in 0..count {
        if Instant::now() >= end {
            return Ok(done);
        }
        let mut instance = driver.new_instance_without_note()?;
        driver.set_up(&mut instance, FAR)?;
        instance.enter_initialization()?;
        instance.exit_initialization()?;
        instance.step(driver.tick_time(0.0), driver.step_size())?;
        instance.terminate()?;
    }
    Ok(count)
}

/// The memory of this process that is in use and its own [bytes]: pages of files come and go as the system likes.
fn resident_memory() -> Result<f64, RuleError> {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let numbers: Vec<f64> = text.split_whitespace().map_while(|pages| pages.parse().ok()).collect();
    match numbers.as_slice() {
        [_, resident, of_files, ..] => Ok((resident - of_files) * PAGE),
        _ => not_applicable("there is no /proc/self/statm"),
    }
}
