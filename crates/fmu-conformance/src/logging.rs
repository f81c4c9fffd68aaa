//! Checks the messages of an FMU: their content, their time and their categories.

use std::sync::Arc;

use fmu_import::{FOREIGN_ENVIRONMENT, FmuMessage, Instance, MessageLevel, SUMMARY};

use super::RuleSeverity::BreaksStandard;
use super::test_driver::{STEPS, TestDriver};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, not_applicable, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "logger",
        rank: BreaksStandard,
        sentence: "messages are formatted, wanted, and of declared categories",
        versions: BOTH,
        check: RuleCheck::Runs(check_logged_messages),
    },
    ConformanceRule {
        name: "log-categories",
        rank: BreaksStandard,
        sentence: "declared categories can be switched",
        versions: BOTH,
        check: RuleCheck::RunsOne(check_log_categories),
    },
];

/// A text that means something else, or a crash, once it is taken for a format of `printf`.
pub(super) const PERCENT: &str = "with-percent-signs-%s%d%s%d%s";
/// What is left of it then; no folder and no file has such a name.
const MARK: &str = "with-percent-signs-";

/// Whether a message with that text went through a format.
pub(super) fn is_formatted(text: &str) -> bool {
    text.contains(MARK) && !text.contains(PERCENT)
}

fn check_logged_messages(driver: &TestDriver) -> RuleResult {
    let messages = messages_of_run(driver, true)?;
    let declared = &driver.description().log_categories;
    for FmuMessage { text, .. } in &messages {
        if is_formatted(text) {
            return violated_rule(format!("a text was taken for a format: {text}"));
        }
        if text == FOREIGN_ENVIRONMENT {
            return violated_rule(text);
        }
    }
    // It turns off debug logging (FMI 2.0, section 2.1.5; FMI 3.0, section 2.3.1), and no description says which categories are that.
    if let Some(FmuMessage { text, .. }) = messages_of_run(driver, false)?
        .iter()
        .find(|m| m.level() == MessageLevel::Info && m.category != SUMMARY)
    {
        return Ok(format!("warning: loggingOn is false, and it logs {text:?}"));
    }
    // FMI 3.0 and FMI 2.0 until 2.0.3 do not ask for declared categories, and no description says which 2.0 it is of.
    let undeclared = messages.iter().find(|it| !declared.contains(&it.category));
    match undeclared.filter(|_| !declared.is_empty()) {
        Some(FmuMessage { category, text, .. }) => Ok(format!(
            "warning: expected a category of {}, found {category:?} with {text:?}",
            declared.join(", ")
        )),
        None => Ok(format!("{} messages", messages.len())),
    }
}

/// What an instance logs in a run, and about a call that it refuses.
fn messages_of_run(driver: &TestDriver, logging: bool) -> Result<Vec<FmuMessage>, RuleError> {
    driver.note_progress("an instance with percent signs in the name, to be logged");
    let mut instance = Instance::new(Arc::clone(&driver.library), PERCENT, logging)?;
    driver.initialise(&mut instance)?;
    driver.run_ticks(&mut instance, 0..STEPS, 0)?;
    let mut messages = instance.take_messages();
    // Whether the call is refused is another rule's matter; what is said about it is this one's.
    driver.note_progress("an illegal call at a communication point, to be logged");
    let _ = instance.exit_initialization();
    messages.extend(instance.take_messages());
    Ok(messages)
}

fn check_log_categories(driver: &TestDriver) -> RuleResult {
    let declared = &driver.description().log_categories;
    if declared.is_empty() {
        return not_applicable("no LogCategories are declared");
    }
    let mut instance = driver.new_instance()?;
    for on in [true, false] {
        for category in declared {
            let call = driver.fmi_name("SetDebugLogging");
            driver.note_progress(&format!("{call} of {category}"));
            instance
                .set_debug_logging(on, &[category])
                .map_err(|error| RuleError::Violated(format!("{call} of {category:?} {}", error.what)))?;
        }
        let all: Vec<_> = declared.iter().map(String::as_str).collect();
        instance.set_debug_logging(on, &all)?;
        instance.set_debug_logging(on, &[])?;
    }
    Ok(format!("{} categories", declared.len()))
}
