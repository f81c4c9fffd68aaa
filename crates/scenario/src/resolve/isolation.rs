//! Decides which FMUs run in processes of their own, with which sandbox and limits.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use cosim::system::{FmuIsolation, NodeBody, ProcessLimits};
use diagnostics::{Error, ErrorCollector};
use python::PythonInterpreter;

use super::node_draft::NodeDraft;
use crate::document::{Fmu, Scenario};

/// Which FMUs run in processes of their own, where the scenario does not say it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum IsolationPolicy {
    /// None.
    #[default]
    Nothing,
    /// All that are not built from a package of the workspace.
    Foreign,
    /// All.
    Everything,
}

/// How an FMU is kept apart from the others.
pub(super) fn fmu_isolation(
    scenario: &Scenario,
    node: &Fmu,
    fmu: &fmu_import::Fmu,
    policy: IsolationPolicy,
    mistakes: &mut ErrorCollector,
) -> Option<FmuIsolation> {
    let written = node.isolate.as_ref().map(|word| *word.get_ref());
    let is_isolated = written.unwrap_or(match policy {
        IsolationPolicy::Nothing => false,
        IsolationPolicy::Foreign => node.package.is_none(),
        IsolationPolicy::Everything => true,
    });
    let limits = [
        ("memory_limit", &node.memory_limit),
        ("process_limit", &node.process_limit),
        ("file_limit", &node.file_limit),
    ];
    let limits = limits.map(|(key, word)| (key, word.as_ref().map(|word| word.span())));
    if written != Some(true) {
        let spans = [
            ("on_failure", node.on_failure.as_ref().map(|word| word.span())),
            ("call_limit", node.call_limit.as_ref().map(|word| word.span())),
            ("sandbox", node.sandbox.as_ref().map(|word| word.span())),
            ("may_read", node.may_read.first().map(|word| word.span())),
        ];
        for (key, span) in
            spans.into_iter().chain(limits.clone()).filter_map(|(key, span)| Some((key, span?)))
        {
            let message = format!("`{key}` is for an FMU in a process of its own");
            let error = scenario.source.error_at(span, message, "");
            mistakes.push(error.with_help("add `isolate = true`"));
        }
    }
    let call_limit = node.call_limit.as_ref().filter(|word| {
        let limit = *word.get_ref();
        let fits = Duration::try_from_secs_f64(limit).is_ok_and(|limit| !limit.is_zero());
        if !fits {
            mistakes.push(scenario.error_at(*word, format!("expected a time above 0 s, found {limit} s")));
        }
        fits
    });
    let call_limit = call_limit.map(|word| *word.get_ref());
    let may_read = node.may_read.iter();
    let mut may_read: Vec<_> =
        may_read.filter_map(|word| mistakes.ok_or_record(existing_path(scenario, word))).collect();
    let sandbox = node.sandbox.as_ref().is_none_or(|word| *word.get_ref());
    if written == Some(true) && !sandbox {
        for (key, span) in limits.into_iter().filter_map(|(key, span)| Some((key, span?))) {
            let message =
                format!("`{key}` is for an FMU in a sandbox, and `sandbox = false` lets this one out");
            mistakes.push(scenario.source.error_at(span, message, "").with_help("leave out one of both"));
        }
    }
    let through_wine = is_isolated.then(|| fmu.wine_platform()).flatten();
    if let Some((platform, word)) = through_wine.as_ref().zip(node.isolate.as_ref()).filter(|_| sandbox) {
        let message =
            format!("no sandbox confines Wine, through which the {platform} library of this FMU runs");
        let help = "`sandbox = false` beside it lets it run in a process of its own all the same";
        mistakes.push(scenario.error_at(word, message).with_help(help));
    }
    // Nobody asked for the sandbox of this FMU.
    let sandbox = sandbox && through_wine.is_none();
    if is_isolated && sandbox {
        may_read.extend(python_code_folders(fmu));
    }
    is_isolated.then(|| FmuIsolation {
        on_failure: node.on_failure.as_ref().map(|word| *word.get_ref()).unwrap_or_default(),
        call_limit,
        sandbox,
        may_read,
        limits: process_limits(node),
    })
}

/// The absolute path that a word of `may_read` names.
///
/// # Errors
/// When there is nothing.
pub(super) fn existing_path(
    scenario: &Scenario,
    word: &diagnostics::Spanned<String>,
) -> Result<PathBuf, Error> {
    let path = scenario.source.resolve_path(word);
    std::path::absolute(&path)
        .and_then(|path| path.metadata().map(|_| path))
        .map_err(|error| scenario.error_at(word, format!("cannot read {}: {error}", path.display())))
}

/// What an FMU may use of the machine in its sandbox.
fn process_limits(node: &Fmu) -> ProcessLimits {
    let usual = ProcessLimits::default();
    let written = |word: &Option<diagnostics::Spanned<u64>>| word.as_ref().map(|word| *word.get_ref());
    ProcessLimits {
        memory: written(&node.memory_limit).unwrap_or(usual.memory),
        processes: written(&node.process_limit).unwrap_or(usual.processes),
        file_size: written(&node.file_limit).unwrap_or(usual.file_size),
    }
}

/// Where the Python of an FMU that is a script, or expects one in its process, reads its code from; none of any other FMU.
fn python_code_folders(fmu: &fmu_import::Fmu) -> Vec<PathBuf> {
    if let Some(found) = fmu.python_library() {
        let Ok(library) = found else { return Vec::new() };
        let interpreter =
            PythonInterpreter { path: library.interpreter.clone(), reason: "the one of the library" };
        return interpreter.code_folders().into_iter().chain([library.path.clone()]).collect();
    }
    let resource = |name: &str| fmu.read_archive_entry(&format!("resources/{name}"));
    if resource(python::MODEL_SERVER_PATH).is_none() {
        return Vec::new();
    }
    let interface = resource(python::MODEL_INTERFACE_PATH);
    let interface = interface.and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
    let known = interface.as_ref().and_then(|it| it["python"].as_str()).map(Path::new);
    PythonInterpreter::choose_interpreter(known).code_folders()
}

/// Tells which FMUs in processes of their own no sandbox confines, since they run through Wine.
pub(super) fn warn_about_wine(nodes: &[NodeDraft], warnings: &mut Vec<String>) {
    for NodeDraft { name, body, .. } in nodes {
        if let NodeBody::Fmu { fmu, isolation: Some(_), .. } = body
            && let Some(platform) = fmu.wine_platform()
        {
            warnings.push(format!(
                "`{name}`: its {platform} library runs through Wine, which no sandbox confines: it may read and write what you may"
            ));
        }
    }
}

/// Gives FMUs processes of their own that would share with another one what each has for itself elsewhere, and tells that.
pub(super) fn isolate_clashing_fmus(nodes: &mut [NodeDraft], warnings: &mut Vec<String>) {
    let mut together: Vec<Arc<fmu_import::Fmu>> = Vec::new();
    for NodeDraft { name, body, .. } in nodes {
        let NodeBody::Fmu { fmu, isolation: isolation @ None, .. } = body else { continue };
        match together.iter().find_map(|other| fmu.clash_reason(other)) {
            Some(why) => {
                warnings.push(FmuIsolation::isolation_notice(name, &why));
                *isolation = Some(FmuIsolation::process_only());
            }
            None if together.iter().any(|other| Arc::ptr_eq(other, fmu)) => {}
            None => together.push(Arc::clone(fmu)),
        }
    }
}
