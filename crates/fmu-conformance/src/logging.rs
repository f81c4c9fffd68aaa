//! Checks how an FMU logs: what it hands to the logger, when, and under which name.

use std::sync::Arc;

use fmu_import::{Instance, Message};

use super::bench::{Bench, STEPS};
use super::{Objection, Verdict, broken, not_applicable};

/// A text that means something else, or a crash, once it is taken for a format of `printf`.
const PERCENT: &str = "conform-%s%d%s%d%s";

pub(super) fn logger(bench: &Bench) -> Verdict {
    let mut messages = simulate(bench, true)?;
    messages.extend(refused(bench));
    let declared = &bench.about().log_categories;
    for Message { category, text, .. } in &messages {
        if text.contains("conform-") && !text.contains(PERCENT) {
            return broken(format!("a text was taken for a format: {text}"));
        }
        if !declared.is_empty() && !declared.contains(category) {
            return broken(format!(
                "expected a category of {}, found {category:?} with {text:?}",
                declared.join(", ")
            ));
        }
    }
    if let Some(Message { text, .. }) = simulate(bench, false)?.iter().find(|m| m.status == 0) {
        return broken(format!("loggingOn is false, and it logs {text:?}"));
    }
    Ok(format!("{} messages", messages.len()))
}

/// What an instance logs in a run, and about a call that it refuses.
fn simulate(bench: &Bench, logging: bool) -> Result<Vec<Message>, Objection> {
    bench.note("fmi2Instantiate with percent signs in the name, to be logged");
    let mut instance = Instance::new(Arc::clone(&bench.library), PERCENT, logging)?;
    bench.initialise(&mut instance)?;
    bench.run(&mut instance, 0..STEPS, 0)?;
    let mut messages = instance.messages();
    // Whether the call is refused is another rule's matter; what is said about it is this one's.
    bench.note("fmi2ExitInitializationMode at a communication point, to be logged");
    let _ = instance.exit_initialization();
    messages.extend(instance.messages());
    Ok(messages)
}

/// What the library logs about a GUID that is not its own.
fn refused(bench: &Bench) -> Vec<Message> {
    bench.note("fmi2Instantiate with percent signs in the GUID, to be logged");
    match Instance::with_guid(Arc::clone(&bench.library), "conform", PERCENT, true) {
        Ok(instance) => instance.messages(),
        Err((_, messages)) => messages,
    }
}

pub(super) fn categories(bench: &Bench) -> Verdict {
    let declared = &bench.about().log_categories;
    if declared.is_empty() {
        return not_applicable("no LogCategories are declared");
    }
    let mut instance = bench.instance()?;
    for on in [true, false] {
        for category in declared {
            bench.note(&format!("fmi2SetDebugLogging of {category}"));
            instance.set_debug_logging(on, &[category]).map_err(|error| {
                Objection::Broken(format!("fmi2SetDebugLogging of {category:?} {}", error.what))
            })?;
        }
        let all: Vec<_> = declared.iter().map(String::as_str).collect();
        instance.set_debug_logging(on, &all)?;
        instance.set_debug_logging(on, &[])?;
    }
    Ok(format!("{} categories", declared.len()))
}
